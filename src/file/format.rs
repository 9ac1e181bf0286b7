//! Formats of files and the one rule about their versions.

use super::Flaw;
use serde::Deserialize;

/// A format of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// What files of the format say that they are.
    pub name: &'static str,
    /// The latest version of the format, which is the one that is written.
    pub version: u64,
    /// How to replace a damaged file, beginning with a verb.
    pub remedy: &'static str,
}

/// What a file says about its format. Everything else that it says is passed over.
#[derive(Deserialize)]
pub(super) struct Stamp {
    pub format: String,
    version: u64,
}

impl Stamp {
    /// The stamp in a JSON object, if it is of this program: versions are counted from 1.
    pub fn of(object: &str) -> Option<Self> {
        let stamp: Self = serde_json::from_str(object).ok()?;
        (stamp.version > 0).then_some(stamp)
    }
}

impl Format {
    /// Checks that a JSON object says that it has this format. Older versions can be read, newer ones can't. A newer
    /// version may have changed anything else, so nothing else may be looked at before.
    pub(crate) fn check(&self, object: &str) -> Result<(), Flaw> {
        let Stamp { format, version } = Stamp::of(object).ok_or(Flaw::Foreign)?;
        if format != self.name {
            return Err(Flaw::OtherFormat { found: format });
        }
        if version > self.version {
            return Err(Flaw::Newer { version });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn older_versions_are_read_and_newer_ones_are_not() {
        let format = Format {
            name: "clip",
            version: 3,
            remedy: "import it again",
        };
        for version in [1, 2, 3] {
            let stamped = json!({ "format": "clip", "version": version });
            assert!(format.check(&stamped.to_string()).is_ok(), "{version}");
        }
        let newer = format.check(r#"{ "format": "clip", "version": 4, "fps": {} }"#);
        assert!(matches!(newer, Err(Flaw::Newer { version: 4 })));
        // Another format has versions of its own.
        let other = format.check(r#"{ "format": "motion", "version": 4 }"#);
        assert!(matches!(other, Err(Flaw::OtherFormat { found }) if found == "motion"));
        for foreign in [
            json!({}),
            json!([]),
            json!({ "format": "clip", "version": 0 }),
            json!({ "format": "clip", "version": -1 }),
            json!({ "format": "clip", "version": 1.0 }),
            json!({ "format": ["clip"], "version": 1 }),
        ] {
            let refused = format.check(&foreign.to_string());
            assert!(matches!(refused, Err(Flaw::Foreign)), "{foreign}");
        }
    }
}
