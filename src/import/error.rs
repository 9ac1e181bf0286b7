//! What can go wrong between a file and a clip.

use super::acclaim::AcclaimError;
use super::bvh::BvhError;
use super::deepmimic::DeepMimicError;
use super::fbx::FbxError;
use super::gltf::GltfError;
use crate::clip;
use crate::humanoid::NotHumanoid;

/// Why a file couldn't become a clip. Every message names the file and says what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    #[error("{file}: cannot be read ({source}); check the path and its permissions")]
    Io {
        file: String,
        source: std::io::Error,
    },
    #[error("{file}: {size} bytes are more than the {limit} that are read; split the file")]
    TooLarge { file: String, size: u64, limit: u64 },
    #[error("{file}: {}", one_line(reason))]
    Unsupported { file: String, reason: String },
    #[error("{file}: {}", one_line(source))]
    Fbx { file: String, source: FbxError },
    #[error("{file}: {}", one_line(source))]
    Gltf { file: String, source: GltfError },
    #[error("{file}: {}", one_line(source))]
    Bvh { file: String, source: BvhError },
    #[error("{file}: {}", one_line(source))]
    Acclaim { file: String, source: AcclaimError },
    #[error("{file}: {}", one_line(source))]
    DeepMimic {
        file: String,
        source: DeepMimicError,
    },
    #[error("{file}: {reason}")]
    NoTakes { file: String, reason: &'static str },
    #[error("{file}: holds no joints; export it with its skeleton")]
    NoJoints { file: String },
    #[error("{file}: no take `{wanted}`; it has {}", one_line(takes))]
    UnknownTake {
        file: String,
        wanted: String,
        takes: String,
    },
    #[error("{file}: {}", one_line(reason))]
    Take { file: String, reason: String },
    #[error(
        "{file}: trim {from}..{to} s leaves nothing of take `{}`, which lasts {duration} s; trim within it",
        one_line(take)
    )]
    EmptyTrim {
        file: String,
        take: String,
        from: f64,
        to: f64,
        duration: f64,
    },
    #[error(
        "{file}: a rate of {fps} frames per second can't be sampled; give a positive number up to 10000 with --fps"
    )]
    Rate { file: String, fps: f64 },
    #[error(
        "{file}: a unit of {unit_m} m can't be used; give a positive number of metres with --unit"
    )]
    Unit { file: String, unit_m: f64 },
    #[error(
        "{file}: take `{}` would have {frames} frames of {nodes} nodes; shorten it with --trim or lower --fps",
        one_line(take)
    )]
    TooLong {
        file: String,
        take: String,
        frames: f64,
        nodes: usize,
    },
    #[error(
        "{file}: joint `{}` has no finite place {place}; repair its keys in the tool that wrote them",
        one_line(joint)
    )]
    NotFinite {
        file: String,
        joint: String,
        place: String,
    },
    #[error(
        "{file}: left and right aren't known, so it can't be mirrored: {source}; import it without, then `mimic edit --mirror --map FILE`"
    )]
    NoSides { file: String, source: NotHumanoid },
    #[error("{file}: {}", one_line(source))]
    Mirror { file: String, source: clip::Error },
}

/// Most characters that are kept of each end of a text.
const MOST: usize = 400;

/// A text with what a file put into it, such as names, without line ends or other control characters, and without its
/// middle where it is long: the end says what to do.
fn one_line(text: &impl ToString) -> String {
    let plain = |c: char| if c.is_control() { ' ' } else { c };
    let letters: Vec<char> = text.to_string().chars().map(plain).collect();
    match letters.len() > 2 * MOST {
        true => {
            let (start, end) = (&letters[..MOST], &letters[letters.len() - MOST..]);
            start.iter().chain(&['…']).chain(end).collect()
        }
        false => letters.into_iter().collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_one_line_of_bearable_length() {
        let take = |name: &str| Error::Take {
            file: "a.fbx".to_owned(),
            reason: format!("take `{name}` is broken; export it again"),
        };
        let said = take("a\r\nb\u{1b}[2J").to_string();
        assert_eq!(said, "a.fbx: take `a  b [2J` is broken; export it again");
        let said = take(&"ö".repeat(100_000)).to_string();
        assert!(said.chars().count() < 1000 && said.ends_with("ö` is broken; export it again"));
    }
}
