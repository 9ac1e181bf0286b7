//! Formats of files and the one rule about their versions.

use super::Flaw;
use serde_json::Value;

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

impl Format {
    /// Checks that an object whose `format` and `version` are given says that it has this format. Older versions can be
    /// read, newer ones can't. A newer version may have changed anything else, so nothing else may be looked at before.
    pub(crate) fn check(&self, stamped: &Value) -> Result<(), Flaw> {
        let (format, version) = (&stamped["format"], &stamped["version"]);
        let (Some(found), Some(version)) = (format.as_str(), version.as_u64()) else {
            return Err(Flaw::Foreign);
        };
        if found != self.name {
            let found = found.to_owned();
            return Err(Flaw::OtherFormat { found });
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
            assert!(format.check(&stamped).is_ok(), "{version}");
        }
        let newer = format.check(&json!({ "format": "clip", "version": 4, "fps": {} }));
        assert!(matches!(newer, Err(Flaw::Newer { version: 4 })));
        // Another format has versions of its own.
        let other = format.check(&json!({ "format": "motion", "version": 4 }));
        assert!(matches!(other, Err(Flaw::OtherFormat { found }) if found == "motion"));
        for foreign in [
            json!({}),
            json!([]),
            json!({ "format": "clip", "version": -1 }),
        ] {
            assert!(matches!(format.check(&foreign), Err(Flaw::Foreign)));
        }
    }
}
