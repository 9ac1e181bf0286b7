//! The scores in a run's `eval.json`, by which runs are compared.

use super::error::RunError;
use super::files;
use super::folder::Run;
use crate::file::text_at_most;
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;
use std::path::Path;

/// Most bytes that are read of an evaluation. Chosen: a thousand motions have a tenth.
const MOST_BYTES: u64 = 16 << 20;

/// How well a run performed at its last evaluation, averaged over its motions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scores {
    /// Mean share of its episodes that the agent survives, 0 to 1.
    pub survival: f64,
    /// Mean distance of the joints from the reference's, seen from the root, mm; `None` where it wasn't measured.
    pub mpjpe_local_mm: Option<f64>,
}

impl Run {
    /// The scores of the run in `dir`; `None` if it wasn't evaluated.
    ///
    /// # Errors
    /// An `eval.json` that can't be read, or isn't an evaluation: the run then counts as not evaluated, too.
    pub fn scores(dir: impl AsRef<Path>) -> Result<Option<Scores>, RunError> {
        let path = dir.as_ref().join(files::EVALUATION);
        if path.symlink_metadata().is_err() {
            return Ok(None);
        }
        let text = text_at_most(&path, MOST_BYTES).map_err(|source| RunError::Read {
            path: path.clone(),
            source,
        })?;
        let scores = serde_json::from_str(&text).map_err(|e| e.to_string());
        let scores = scores.and_then(|file: File| file.scores().map_err(str::to_owned));
        scores
            .map(Some)
            .map_err(|reason| RunError::NoEvaluation { path, reason })
    }
}

/// What is read of the file: the scores of one motion, or those of several. Whatever else is there is passed over.
#[derive(Deserialize)]
struct File {
    survival: Option<f64>,
    mpjpe_local_mm: Option<f64>,
    #[serde(default)]
    motions: Sums,
}

/// The scores of motions, added up as they are read: a list in a file may be long.
#[derive(Default)]
struct Sums {
    count: f64,
    survival: f64,
    mpjpe_local_mm: f64,
}

impl File {
    fn scores(self) -> Result<Scores, &'static str> {
        let Sums {
            count,
            survival,
            mpjpe_local_mm,
        } = self.motions;
        let (survival, mpjpe_local_mm) = match count > 0.0 {
            true => (survival / count, Some(mpjpe_local_mm / count)),
            false => (
                self.survival.ok_or("it has no `survival`")?,
                self.mpjpe_local_mm,
            ),
        };
        // A sum with a missing number is none.
        let mpjpe_local_mm = mpjpe_local_mm.filter(|error| !error.is_nan());
        match (0.0..=1.0).contains(&survival) {
            true => Ok(Scores {
                survival,
                mpjpe_local_mm,
            }),
            false => Err("`survival` is not a number from 0 to 1"),
        }
    }
}

impl<'de> Deserialize<'de> for Sums {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(Adding)
    }
}

struct Adding;

impl<'de> Visitor<'de> for Adding {
    type Value = Sums;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a list of motions")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Sums, A::Error> {
        #[derive(Deserialize)]
        struct Motion {
            survival: Option<f64>,
            mpjpe_local_mm: Option<f64>,
        }
        let mut sums = Sums::default();
        while let Some(motion) = list.next_element::<Motion>()? {
            let survival = motion.survival.filter(|share| (0.0..=1.0).contains(share));
            let survival = survival.ok_or_else(|| A::Error::custom("a motion has no `survival`"));
            sums.count += 1.0;
            sums.survival += survival?;
            sums.mpjpe_local_mm += motion.mpjpe_local_mm.unwrap_or(f64::NAN);
        }
        Ok(sums)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scores(text: &str) -> Result<Option<Scores>, RunError> {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join(files::EVALUATION), text).expect("written");
        Run::scores(folder.path())
    }

    #[test]
    fn scores_are_those_of_all_motions() {
        let folder = tempfile::tempdir().expect("a folder");
        assert!(matches!(Run::scores(folder.path()), Ok(None)));
        for (text, survival, mpjpe_local_mm) in [
            (
                r#"{"survival": 0.5, "mpjpe_local_mm": 20, "new": [{}]}"#,
                0.5,
                Some(20.0),
            ),
            (r#"{"survival": 1, "mpjpe_local_mm": null}"#, 1.0, None),
            (
                r#"{"motions": [{"survival": 1, "mpjpe_local_mm": 10}, {"survival": 0, "mpjpe_local_mm": 30}]}"#,
                0.5,
                Some(20.0),
            ),
            (r#"{"motions": [{"survival": 1}]}"#, 1.0, None),
        ] {
            let expected = Scores {
                survival,
                mpjpe_local_mm,
            };
            assert_eq!(scores(text).ok().flatten(), Some(expected), "{text}");
        }
    }

    #[test]
    fn what_is_no_evaluation_is_refused() {
        for text in [
            "",
            "[",
            "{}",
            "\"x\"",
            "null",
            "7",
            "[0.5]",
            r#"{"survival": 1e400}"#,
            r#"{"survival": 1e308}"#,
            r#"{"survival": -0.1}"#,
            r#"{"survival": "1"}"#,
            r#"{"motions": []}"#,
            r#"{"motions": [{}]}"#,
            r#"{"motions": [{"survival": 2}]}"#,
        ] {
            let found = scores(text);
            assert!(
                matches!(found, Err(RunError::NoEvaluation { .. })),
                "{text}: {found:?}"
            );
        }
    }
}
