//! Metrics over the frames of episodes; formulas as in DeepMimic, PHC and the papers they name.

use super::episode::{Frame, Start, Trace, positions};
use crate::motion::skate;
use crate::sim::{Link, LinkState};
use crate::skeleton::Twist;
use crate::task::{Failure, Stage};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// What an evaluation found. Means are over all frames of all episodes, the one that shows a failure included.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    pub episodes: usize,
    /// Mean share of an episode's frames before its failure.
    pub survival: f64,
    /// The same for the episode from the first frame alone.
    pub survival_from_start: f64,
    /// Share of episodes without a fall whose mean body error never exceeds 0.5 m.
    pub success_mean_0_5: f64,
    /// Share of those whose largest body error never exceeds 0.25 m.
    pub success_max_0_25: f64,
    /// Mean distance of bodies from their reference, mm.
    pub mpjpe_global_mm: f64,
    /// The same with each skeleton's root position subtracted, and no rotation alignment, mm.
    pub mpjpe_local_mm: f64,
    /// Mean difference of the velocities of the links' origins, m/s.
    pub velocity_error_m_s: f64,
    /// Mean distance of the centres of mass, m.
    pub com_error_m: f64,
    /// mean‖L − L̂‖ / max‖L̂‖.
    pub angular_momentum_error: f64,
    /// 2PR/(P + R) of contact link × frame against the reference's contacts.
    pub contact_f1: f64,
    /// Mean horizontal speed of a contact link on the ground while it presses on it, m/s; see [`skate::sole_speed`].
    pub foot_skate_m_s: f64,
    /// Mean over episodes of summed reward ÷ the steps of an episode without failure.
    pub normalized_return: f64,
    /// How far the root turned about the axis about which the reference turns most, radians, in the episode from the
    /// first frame.
    pub root_rotation_turned_rad: f64,
    /// How far the reference turned about it.
    pub root_rotation_reference_rad: f64,
    /// The episodes that failed.
    #[serde(default)]
    pub failures: Vec<Failed>,
    /// One more episode, from standing still in the rest pose.
    #[serde(default)]
    pub from_rest: Option<Digest>,
    /// The same phases again, disturbed. Where the reference follows who was shoved, errors are measured from there, and
    /// nobody fails by being out of its way.
    #[serde(default)]
    pub perturbed: Option<Digest>,
}

/// An episode that failed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Failed {
    /// Where in the motion it started, as a share of all possible starts.
    pub start: f64,
    pub survived_s: f64,
    pub failure: Failure,
}

impl Failed {
    fn of(trace: &Trace) -> Option<Self> {
        let Start::At(start) = trace.start else {
            return None;
        };
        Some(Self {
            start,
            survived_s: trace.survived as f64 / trace.control_hz,
            failure: trace.failure?,
        })
    }
}

/// The fields of an [`Evaluation`] that count where an agent has more to do than to track.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Digest {
    pub episodes: usize,
    pub survival: f64,
    pub success_mean_0_5: f64,
    pub mpjpe_global_mm: f64,
    pub mpjpe_local_mm: f64,
    pub normalized_return: f64,
    /// The episodes that failed.
    #[serde(default)]
    pub failures: Vec<Failed>,
}

impl From<Evaluation> for Digest {
    fn from(all: Evaluation) -> Self {
        Self {
            episodes: all.episodes,
            survival: all.survival,
            success_mean_0_5: all.success_mean_0_5,
            mpjpe_global_mm: all.mpjpe_global_mm,
            mpjpe_local_mm: all.mpjpe_local_mm,
            normalized_return: all.normalized_return,
            failures: all.failures,
        }
    }
}

/// Measures episodes.
pub fn measure(stage: &Stage, traces: &[Trace]) -> Evaluation {
    let per_episode = |value: &dyn Fn(&Trace) -> f64| mean(traces.iter().map(value));
    let from_start = |value: &dyn Fn(&Trace) -> f64| {
        mean(
            traces
                .iter()
                .filter(|t| t.start == Start::At(0.0))
                .map(value),
        )
    };
    let frames = || traces.iter().flat_map(|t| &t.frames);
    let per_frame = |value: &dyn Fn(&Frame) -> f64| mean(frames().map(value));
    let largest_momentum = traces
        .iter()
        .map(|t| t.largest_momentum)
        .fold(0.0, f32::max);
    Evaluation {
        episodes: traces.len(),
        survival: per_episode(&survival),
        survival_from_start: from_start(&survival),
        success_mean_0_5: per_episode(&|t| f64::from(u8::from(t.failure.is_none()))),
        success_max_0_25: per_episode(&|t| {
            f64::from(u8::from(
                t.failure.is_none() && stays_within(stage, t, 0.25),
            ))
        }),
        mpjpe_global_mm: 1e3 * per_frame(&|f| mean_error(stage, f, false)),
        mpjpe_local_mm: 1e3 * per_frame(&|f| mean_error(stage, f, true)),
        velocity_error_m_s: per_frame(&velocity_error),
        com_error_m: per_frame(&|f| f64::from((f.dynamics.com - f.reference.dynamics.com).norm())),
        angular_momentum_error: per_frame(&|f| {
            f64::from((f.dynamics.angular_momentum - f.reference.dynamics.angular_momentum).norm())
        }) / f64::from(largest_momentum.max(1e-6)),
        contact_f1: contact_f1(traces),
        foot_skate_m_s: foot_skate(stage, traces),
        normalized_return: per_episode(&|t| {
            t.frames.iter().map(|f| f64::from(f.reward)).sum::<f64>() / t.possible.max(1) as f64
        }),
        root_rotation_turned_rad: from_start(&|t| turned(t, |f| &f.agent[0])),
        root_rotation_reference_rad: from_start(&|t| turned(t, |f| &f.reference.links[0])),
        failures: traces.iter().filter_map(Failed::of).collect(),
        from_rest: None,
        perturbed: None,
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| {
        (sum + value, count + 1)
    });
    if count == 0 { 0.0 } else { sum / count as f64 }
}

fn survival(trace: &Trace) -> f64 {
    (trace.survived as f64 / trace.possible.max(1) as f64).min(1.0)
}

fn errors<'a>(stage: &'a Stage, frame: &'a Frame, local: bool) -> impl Iterator<Item = f64> + 'a {
    let (a, b) = (&frame.agent, &frame.reference.links);
    let shift = if local {
        a[0].pose.translation.vector - b[0].pose.translation.vector
    } else {
        Vector3::zeros()
    };
    positions(stage, a)
        .zip(positions(stage, b))
        .map(move |(p, q)| f64::from((p - q - shift).norm()))
}

fn mean_error(stage: &Stage, frame: &Frame, local: bool) -> f64 {
    mean(errors(stage, frame, local))
}

fn stays_within(stage: &Stage, trace: &Trace, limit: f64) -> bool {
    trace
        .frames
        .iter()
        .all(|frame| errors(stage, frame, false).all(|error| error <= limit))
}

fn velocity_error(frame: &Frame) -> f64 {
    mean(
        frame
            .agent
            .iter()
            .zip(&frame.reference.links)
            .map(|(a, b)| f64::from((a.linear - b.linear).norm())),
    )
}

fn contact_f1(traces: &[Trace]) -> f64 {
    let (mut both, mut either) = (0usize, 0usize);
    for frame in traces.iter().flat_map(|t| &t.frames) {
        for (mine, wanted) in frame.contacts.iter().zip(&frame.reference.contacts) {
            both += usize::from(*mine && *wanted);
            either += usize::from(*mine) + usize::from(*wanted);
        }
    }
    // 2PR/(P + R) = 2·TP / (TP + FP + TP + FN).
    if either == 0 {
        1.0
    } else {
        2.0 * both as f64 / either as f64
    }
}

fn foot_skate(stage: &Stage, traces: &[Trace]) -> f64 {
    mean(traces.iter().flat_map(|trace| {
        trace.frames.iter().flat_map(move |frame| {
            let standing = trace
                .contact_links
                .iter()
                .zip(&frame.contacts)
                .filter(|(_, contact)| **contact);
            standing
                .map(move |(&link, _)| sole_speed(&stage.character.links[link], &frame.agent[link]))
        })
    }))
}

fn sole_speed(link: &Link, state: &LinkState) -> f64 {
    let twist = Twist {
        linear: state.linear.cast(),
        angular: state.angular.cast(),
    };
    skate::sole_speed(&link.shapes, &state.pose.cast(), &twist)
}

/// Angle that a root turned about the axis of the reference's own net turning, each in its own frame.
fn turned(trace: &Trace, root: impl Fn(&Frame) -> &LinkState) -> f64 {
    let spin = |state: &LinkState| {
        state
            .pose
            .rotation
            .inverse_transform_vector(&state.angular)
            .cast::<f64>()
    };
    let net: Vector3<f64> = trace
        .frames
        .iter()
        .map(|f| spin(&f.reference.links[0]))
        .sum();
    let axis = net.try_normalize(1e-9).unwrap_or_else(Vector3::z);
    trace
        .frames
        .iter()
        .map(|f| spin(root(f)).dot(&axis))
        .sum::<f64>()
        / trace.control_hz
}
