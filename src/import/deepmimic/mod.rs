//! DeepMimic motion files: JSON with one row of 44 numbers per frame, for one humanoid that isn't in the file (Peng et al.,
//! "DeepMimic", 2018).

mod rows;

use super::measure::whole_rate;
use super::scene::{Contents, Node, Scene, Take, composed};
use crate::clip::{MOST_FPS, Problem, slerp};
use crate::explain::{Explain, Explanation, explained};
use nalgebra::{Isometry3, Matrix3, Matrix4, Quaternion, UnitQuaternion, Vector3};
use rows::Rows;

/// Numbers in one frame: duration in seconds, root position in metres, root rotation, then the joints in the order of
/// [`JOINTS`].
const ROW: usize = 44;
/// Numbers in one frame of the format's quadruped.
const DOG_ROW: usize = 84;

/// How a joint moves, and so how many numbers it has in a row.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// Quaternion w, x, y, z.
    Spherical,
    /// Angle about the parent's Z axis: positive angles bend an elbow forward, negative ones a knee backward.
    Revolute,
    Fixed,
}

struct Definition {
    name: &'static str,
    parent: Option<usize>,
    kind: Kind,
    /// Position in the parent's frame, metres; Y up, X forward, Z to the right.
    offset: [f64; 3],
}

const fn joint(name: &'static str, parent: usize, kind: Kind, offset: [f64; 3]) -> Definition {
    Definition {
        name,
        parent: Some(parent),
        kind,
        offset,
    }
}

/// The format's humanoid. The sizes are those of its character file, `humanoid3d.txt`.
const JOINTS: [Definition; 15] = [
    Definition {
        name: "root",
        parent: None,
        kind: Kind::Spherical,
        offset: [0.0; 3],
    },
    joint("chest", 0, Kind::Spherical, [0.0, 0.236151, 0.0]),
    joint("neck", 1, Kind::Spherical, [0.0, 0.223894, 0.0]),
    joint("right_hip", 0, Kind::Spherical, [0.0, 0.0, 0.084887]),
    joint("right_knee", 3, Kind::Revolute, [0.0, -0.421546, 0.0]),
    joint("right_ankle", 4, Kind::Spherical, [0.0, -0.409870, 0.0]),
    joint(
        "right_shoulder",
        1,
        Kind::Spherical,
        [-0.02405, 0.24350, 0.18311],
    ),
    joint("right_elbow", 6, Kind::Revolute, [0.0, -0.274788, 0.0]),
    joint("right_wrist", 7, Kind::Fixed, [0.0, -0.258947, 0.0]),
    joint("left_hip", 0, Kind::Spherical, [0.0, 0.0, -0.084887]),
    joint("left_knee", 9, Kind::Revolute, [0.0, -0.421546, 0.0]),
    joint("left_ankle", 10, Kind::Spherical, [0.0, -0.409870, 0.0]),
    joint(
        "left_shoulder",
        1,
        Kind::Spherical,
        [-0.02405, 0.24350, -0.18311],
    ),
    joint("left_elbow", 12, Kind::Revolute, [0.0, -0.274788, 0.0]),
    joint("left_wrist", 13, Kind::Fixed, [0.0, -0.258947, 0.0]),
];

/// Why a DeepMimic file couldn't be read. Frames are counted from 0.
#[derive(Debug)]
pub(crate) enum DeepMimicError {
    /// Not JSON, or not of the format's fields.
    Json { reason: String },
    /// A file without motion.
    NoFrames,
    /// A motion of the format's quadruped.
    Dog,
    /// A frame that doesn't fit the humanoid.
    Width { frame: usize, found: usize },
    /// A frame that doesn't last a positive time.
    Duration { frame: usize, seconds: f64 },
    /// A quaternion of length zero.
    ZeroRotation { frame: usize, joint: &'static str },
    /// A number too large to compute with.
    Magnitude { frame: usize },
}

explained!(DeepMimicError);

impl Explain for DeepMimicError {
    fn explain(&self) -> Explanation {
        let wrong = |cause: String| Explanation::input(cause).remedy("write the file again");
        let at = |frame, cause: String| wrong(cause).place(format!("frame {frame}"));
        match self {
            Self::Json { reason } => wrong(format!("broken JSON ({reason})")),
            Self::NoFrames => wrong("no frames".to_owned()),
            Self::Dog => Explanation::input(format!(
                "its frames of {DOG_ROW} numbers are a DeepMimic dog's"
            ))
            .remedy(format!(
                "give a motion of the DeepMimic humanoid, with frames of {ROW} numbers"
            )),
            Self::Width { frame, found } => at(
                frame,
                format!("it has {found} numbers where a DeepMimic humanoid has {ROW}"),
            ),
            Self::Duration { frame, seconds } => at(frame, format!("it lasts {seconds} s"))
                .remedy("make its duration a positive number"),
            Self::ZeroRotation { frame, joint } => at(frame, "its rotation is zero".to_owned())
                .place(format!("frame {frame}, joint `{joint}`"))
                .remedy("repair the file"),
            Self::Magnitude { frame } => {
                at(frame, "it holds a number too large to use".to_owned()).remedy("repair the file")
            }
        }
    }
}

/// One frame: the root's position and every joint's rotation in its parent.
struct Pose {
    /// Seconds from the first frame.
    time: f64,
    root: Vector3<f64>,
    rotations: Vec<UnitQuaternion<f64>>,
}

#[derive(serde::Deserialize)]
struct File {
    #[serde(rename = "Loop")]
    loops: Option<String>,
    #[serde(rename = "Frames")]
    frames: Rows,
}

/// A DeepMimic motion on its humanoid.
pub(crate) struct DeepMimicScene {
    contents: Contents,
    poses: Vec<Pose>,
}

/// Reads a motion file. `name` becomes the take's name, since the format has none.
pub(crate) fn read(bytes: &[u8], name: &str) -> Result<DeepMimicScene, DeepMimicError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let file: File = serde_json::from_slice(bytes).map_err(|e| DeepMimicError::Json {
        reason: e.to_string(),
    })?;
    let poses = poses(file.frames)?;
    let mut problems = Vec::new();
    let wraps = loop_word(file.loops.as_deref(), &mut problems);
    let end = poses.last().map_or(0.0, |pose| pose.time);
    let take = Take {
        end,
        fps: rate(&poses),
        animated: (0..JOINTS.len())
            .filter(|&j| JOINTS[j].kind != Kind::Fixed)
            .collect(),
        wraps,
        channels: JOINTS.len(),
        ..Take::still(name.to_owned())
    };
    let nodes = JOINTS
        .iter()
        .map(|d| Node::bone(d.name.to_owned(), d.parent));
    Ok(DeepMimicScene {
        contents: Contents {
            // Y up, but X forward: the rotation of other Y-up files would be wrong.
            canonical_from_file: Matrix3::new(1., 0., 0., 0., 0., -1., 0., 1., 0.),
            problems,
            ..Contents::new("deepmimic", nodes.collect(), vec![take])
        },
        poses,
    })
}

/// Whether the file says that the motion repeats.
fn loop_word(word: Option<&str>, problems: &mut Vec<Problem>) -> Option<bool> {
    match word {
        Some("wrap") => Some(true),
        Some("none") => Some(false),
        Some(other) => {
            problems.push(Problem::warning(
                "unknown-loop-word",
                format!("`Loop` is `{other}`, neither wrap nor none: whether it repeats was read off the motion"),
            ));
            None
        }
        None => None,
    }
}

fn poses(rows: Rows) -> Result<Vec<Pose>, DeepMimicError> {
    match rows.odd {
        Some((_, DOG_ROW)) => return Err(DeepMimicError::Dog),
        Some((frame, found)) => return Err(DeepMimicError::Width { frame, found }),
        None => {}
    }
    let rows = rows.numbers.as_chunks::<ROW>().0;
    let mut poses = Vec::with_capacity(rows.len());
    let mut time = 0.0;
    for (frame, row) in rows.iter().enumerate() {
        poses.push(pose(frame, row, time)?);
        // The motion ends at the last frame, so that frame's duration doesn't count.
        if frame + 1 < rows.len() {
            if !(row[0] > 0.0 && row[0].is_finite()) {
                return Err(DeepMimicError::Duration {
                    frame,
                    seconds: row[0],
                });
            }
            time += row[0];
        }
    }
    if poses.is_empty() {
        return Err(DeepMimicError::NoFrames);
    }
    Ok(poses)
}

fn pose(frame: usize, row: &[f64; ROW], time: f64) -> Result<Pose, DeepMimicError> {
    // Chosen: whatever is larger is damage, and sums and products of smaller numbers stay finite.
    if !row.iter().all(|x| x.abs() < 1e9) {
        return Err(DeepMimicError::Magnitude { frame });
    }
    // After the duration and the root's position.
    let mut at = 4;
    let mut rotations = Vec::with_capacity(JOINTS.len());
    for definition in &JOINTS {
        let (rotation, width) = match definition.kind {
            Kind::Spherical => {
                let q = Quaternion::new(row[at], row[at + 1], row[at + 2], row[at + 3]);
                let rotation =
                    UnitQuaternion::try_new(q, 1e-6).ok_or(DeepMimicError::ZeroRotation {
                        frame,
                        joint: definition.name,
                    })?;
                (rotation, 4)
            }
            Kind::Revolute => (
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), row[at]),
                1,
            ),
            Kind::Fixed => (UnitQuaternion::identity(), 0),
        };
        rotations.push(rotation);
        at += width;
    }
    Ok(Pose {
        time,
        root: Vector3::new(row[1], row[2], row[3]),
        rotations,
    })
}

/// Frames per second, Hz, by the median of the frames' durations, within what can be sampled. A single frame has 30, the rate of
/// the format's files.
fn rate(poses: &[Pose]) -> f64 {
    let mut gaps: Vec<f64> = poses.windows(2).map(|w| w[1].time - w[0].time).collect();
    gaps.sort_by(f64::total_cmp);
    let Some(&gap) = gaps.get(gaps.len() / 2) else {
        return 30.0;
    };
    whole_rate((1.0 / gap).clamp(1.0, MOST_FPS))
}

impl DeepMimicScene {
    /// Root position and joint rotations at `time` seconds: linear between the two frames around it, and rotations along the
    /// shortest arc.
    fn pose_at(&self, time: f64) -> (Vector3<f64>, Vec<UnitQuaternion<f64>>) {
        // The frames before and after this time; outside the motion, the first or last one twice.
        let after = self.poses.partition_point(|pose| pose.time <= time);
        let b = &self.poses[after.min(self.poses.len() - 1)];
        let a = &self.poses[after.saturating_sub(1)];
        let span = b.time - a.time;
        let t = if span > 0.0 {
            (time - a.time) / span
        } else {
            0.0
        };
        let rotations = a.rotations.iter().zip(&b.rotations);
        (
            a.root.lerp(&b.root, t),
            rotations.map(|(a, b)| slerp(a, b, t)).collect(),
        )
    }
}

impl Scene for DeepMimicScene {
    fn contents(&self) -> &Contents {
        &self.contents
    }

    fn placed(&self, at: Option<(usize, f64)>) -> Vec<Matrix4<f64>> {
        let (root, rotations) = match at {
            Some((_, time)) => self.pose_at(time),
            None => (
                Vector3::zeros(),
                vec![UnitQuaternion::identity(); JOINTS.len()],
            ),
        };
        let local = |(definition, rotation): (&Definition, &UnitQuaternion<f64>)| {
            let offset = Vector3::from(definition.offset);
            let place = definition.parent.map_or(root + offset, |_| offset);
            Isometry3::from_parts(place.into(), *rotation).to_homogeneous()
        };
        composed(
            &self.contents.nodes,
            JOINTS.iter().zip(&rotations).map(local),
        )
    }
}
