//! Which of the known names somebody may have meant by one that isn't known.

use std::cmp::Reverse;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use strsim::osa_distance;

/// Most characters of a name that are compared. Names come from files and may be endless, and the comparison takes time in
/// proportion to the square of their length.
const COMPARED: usize = 64;

/// Shortest name that is looked for inside of others: shorter ones are inside of too many.
const SHORTEST_PART: usize = 3;

/// The `count` names that are nearest to `typed`, the nearest first.
pub fn nearest<S: AsRef<str>>(
    typed: &str,
    known: impl IntoIterator<Item = S>,
    count: usize,
) -> Vec<String> {
    let typed = Name::new(typed);
    let mut near: Vec<(_, S)> = known
        .into_iter()
        .map(|name| {
            let other = Name::new(name.as_ref());
            let whole = edits(&typed.whole, &other.whole);
            let part = Reverse(typed.within(&other));
            ((typed.distance(&other), part, whole), name)
        })
        .collect();
    // Stable, so that of equally near names the first stays first.
    near.sort_by_key(|(distance, _)| *distance);
    let names = near.iter().map(|(_, name)| name.as_ref().to_owned());
    names.take(count).collect()
}

/// The known name that was probably meant: one in three letters may be wrong, or one name be part of the other. `None` if no
/// name is that near.
pub fn meant<S: AsRef<str>>(typed: &str, known: impl IntoIterator<Item = S>) -> Option<String> {
    let wanted = Name::new(typed);
    let close = known
        .into_iter()
        .filter(|name| wanted.is_near(&Name::new(name.as_ref())));
    nearest(typed, close, 1).pop()
}

/// The known file that was probably meant, as [`meant`] for names of files: what is before the ending has to be near, for
/// many files have one ending, and of those that are, the one whose whole name is nearest was meant. A file may stand there
/// without its ending.
pub fn meant_file(typed: &str, known: impl IntoIterator<Item = PathBuf>) -> Option<PathBuf> {
    let whole = |name: &str| Name {
        last: Vec::new(),
        ..Name::new(name)
    };
    let stem = |name: &str| {
        whole(
            Path::new(name)
                .file_stem()
                .map_or(name.into(), OsStr::to_string_lossy)
                .as_ref(),
        )
    };
    let (wanted, before) = (whole(typed), stem(typed));
    let near = known.into_iter().filter_map(|path| {
        let name = path.file_name()?.to_string_lossy().into_owned();
        let (own, own_before) = (whole(&name), stem(&name));
        let is_near = before.is_near(&own_before) || wanted.is_near(&own_before);
        let distance = edits(&wanted.whole, &own.whole);
        is_near.then_some((distance, path))
    });
    near.min().map(|(_, path)| path)
}

/// The question that goes with [`meant`], in front of other advice.
pub fn did_you_mean<S: AsRef<str>>(
    typed: &str,
    known: impl IntoIterator<Item = S>,
) -> Option<String> {
    meant(typed, known).map(|name| format!("did you mean `{name}`?"))
}

/// A name as it is compared: in small letters, and the last of its parts, for whoever leaves out the others.
struct Name {
    whole: Vec<char>,
    last: Vec<char>,
}

impl Name {
    fn new(text: &str) -> Self {
        let letters = text.chars().flat_map(char::to_lowercase);
        let whole: Vec<char> = letters.take(COMPARED).collect();
        let last = whole
            .rsplit(|c| ['.', '/', '|', ':'].contains(c))
            .next()
            .unwrap_or_default()
            .to_vec();
        Self { whole, last }
    }

    /// Letters to add, to leave out, to change or to exchange with their neighbours.
    fn distance(&self, other: &Self) -> usize {
        edits(&self.whole, &other.whole).min(edits(&self.last, &other.last))
    }

    /// Whether one is part of the other.
    fn within(&self, other: &Self) -> bool {
        let part = |a: &[char], b: &[char]| {
            a.len() >= SHORTEST_PART && b.windows(a.len()).any(|window| window == a)
        };
        part(&self.whole, &other.whole) || part(&other.whole, &self.whole)
    }

    fn is_near(&self, other: &Self) -> bool {
        let near =
            |a: &[char], b: &[char]| !a.is_empty() && 3 * edits(a, b) <= a.len().max(b.len());
        near(&self.whole, &other.whole) || near(&self.last, &other.last) || self.within(other)
    }
}

fn edits(a: &[char], b: &[char]) -> usize {
    let (a, b): (String, String) = (a.iter().collect(), b.iter().collect());
    osa_distance(&a, &b)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLIPS: [&str; 5] = ["walk", "run", "kick", "backflip", "walk-cycle"];

    #[test]
    fn slips_are_understood() {
        for (typed, name) in [
            ("kik", "kick"),
            ("KICK", "kick"),
            ("wlak", "walk"),
            ("bakflip", "backflip"),
            ("flip", "backflip"),
            ("cycle", "walk-cycle"),
            ("run2", "run"),
        ] {
            assert_eq!(meant(typed, CLIPS).as_deref(), Some(name), "{typed}");
        }
        for other in ["jump", "", "x", "wa", "…"] {
            assert_eq!(meant(other, CLIPS), None, "{other}");
        }
        assert_eq!(meant("kick", [""; 0]), None);
    }

    #[test]
    fn the_last_part_of_a_name_counts_alone() {
        let paths = ["task", "ppo.gamma", "ppo.lambda"];
        assert_eq!(nearest("gama", paths, 1), ["ppo.gamma"]);
        assert_eq!(
            meant("Kick", ["Armature|Kick"]).as_deref(),
            Some("Armature|Kick")
        );
    }

    #[test]
    fn of_files_the_whole_name_counts_and_no_ending_alone() {
        let known = [
            "01_01.motion",
            "01_01.clip",
            "kick.clip",
            "kick.motion",
            "kick-edited.clip",
            "walk.fbx",
        ];
        for (typed, file) in [
            ("kick.motin", Some("kick.motion")),
            ("kick.clp", Some("kick.clip")),
            ("kik.clip", Some("kick.clip")),
            ("KICK.MOTION", Some("kick.motion")),
            ("kick-edit.clip", Some("kick-edited.clip")),
            ("walk.glb", Some("walk.fbx")),
            ("walk", Some("walk.fbx")),
            ("01_1.clip", Some("01_01.clip")),
            ("jump.clip", None),
            ("run.motion", None),
            (".motion", None),
        ] {
            let found = meant_file(typed, known.map(PathBuf::from));
            assert_eq!(found, file.map(PathBuf::from), "{typed}");
        }
    }

    #[test]
    fn of_names_with_equally_near_endings_the_nearest_comes_first() {
        let known = ["arm.Hip", "leg.Hip", "leg.Knee"];
        assert_eq!(nearest("lag.Hip", known, 1), ["leg.Hip"]);
        assert_eq!(nearest("Hip", known, 2), ["arm.Hip", "leg.Hip"]);
    }

    #[test]
    fn endless_names_take_no_time() {
        let long = "ö".repeat(10_000_000);
        let begun = std::time::Instant::now();
        assert_eq!(
            meant(&long, [long.as_str(), "walk"]).as_deref(),
            Some(long.as_str())
        );
        assert!(begun.elapsed().as_secs_f64() < 1.0);
    }
}
