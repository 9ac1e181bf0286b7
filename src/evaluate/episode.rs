//! One deterministic episode, kept frame by frame for metrics and replay.

use crate::clip::LoopMode;
use crate::learn::{LearnError, Memory, Performer};
use crate::sim::LinkState;
use crate::task::{
    Dynamics, Failure, Outcome, Perturbations, Sample, Setting, Stage, Terminations, Terms,
};
use nalgebra::{Point3, Vector3};

/// Mean distance of the bodies from their reference beyond which an episode has failed, metres.
const LOST_M: f32 = 0.5;

/// Agent and reference at the end of one control step.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Time in the reference, seconds.
    pub time: f64,
    pub agent: Vec<LinkState>,
    pub reference: Sample,
    pub dynamics: Dynamics,
    /// Per contact link of the motion: whether the agent presses on the ground with it.
    pub contacts: Vec<bool>,
    pub terms: Terms,
    /// In (0, 1].
    pub reward: f32,
}

/// How an episode begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// In the reference's own state at this share of the motion.
    At(f64),
    /// In the rest pose, standing still, at the reference's first frame.
    Rest,
}

/// An episode.
#[derive(Clone, Debug)]
pub struct Trace {
    pub start: Start,
    pub control_hz: f64,
    pub frames: Vec<Frame>,
    /// Steps of an episode without failure.
    pub possible: usize,
    /// Frames before a failure; with one, the last frame shows it.
    pub survived: usize,
    /// Largest angular momentum of the reference, kg·m²/s.
    pub largest_momentum: f32,
    pub failure: Option<Failure>,
    /// Links that the motion puts on the ground, in the order of [`Frame::contacts`].
    pub contact_links: Vec<usize>,
}

/// Plays reference number `which` from `start`, for `seconds` or to its end, disturbed as `disturbed` says and by its
/// seed.
///
/// An episode fails by a fall, or when the bodies are 0.5 m from their reference in the mean, whatever rules the policy
/// was trained under.
///
/// # Errors
/// A task of another shape than the policy's.
pub fn play(
    performer: &Performer,
    which: usize,
    start: Start,
    seconds: f64,
    disturbed: Option<(Perturbations, u64)>,
) -> Result<Trace, LearnError> {
    let rules = Terminations {
        distance: None,
        fall: true,
        reward: None,
    };
    let reference = &performer.references()[which];
    let episode_s = match reference.loop_mode() {
        LoopMode::Wrap => seconds,
        LoopMode::Clamp => reference.duration() + 1.0,
    };
    let setting = Setting {
        terminations: rules,
        episode_s,
        perturbations: disturbed.map_or_else(Perturbations::default, |(ranges, _)| ranges),
        ..*performer.setting()
    };
    let mut env = performer.environment(which, &setting);
    match start {
        Start::At(share) => env.reset(share * env.last_start()),
        Start::Rest => env.reset_at_rest(),
    }
    if let Some((_, seed)) = disturbed {
        env.perturb(seed);
    }
    let mut trace = Trace {
        start,
        control_hz: setting.physics.control_hz,
        frames: Vec::new(),
        possible: env.possible_steps() as usize,
        survived: 0,
        largest_momentum: reference.largest_momentum(),
        failure: None,
        contact_links: reference.contact_links.clone(),
    };
    let mut memory = Memory::default();
    loop {
        let action = performer.act(&env, &mut memory)?;
        let step = env.step(action);
        let mut sample = reference.blank();
        reference.sample(env.time(), &mut sample);
        trace.failure = match step.outcome {
            Outcome::Failed(failure) => Some(failure),
            _ if mean_distance(performer.stage(), env.states(), &sample.links) > LOST_M => {
                Some(Failure::Distance)
            }
            _ => None,
        };
        trace.frames.push(Frame {
            time: env.time(),
            agent: env.states().to_vec(),
            reference: sample,
            dynamics: *env.dynamics(),
            contacts: trace
                .contact_links
                .iter()
                .map(|&link| env.contacts()[link])
                .collect(),
            terms: step.terms,
            reward: step.reward,
        });
        if trace.failure.is_some() {
            return Ok(trace);
        }
        trace.survived += 1;
        if step.outcome != Outcome::Running {
            return Ok(trace);
        }
    }
}

/// World positions of all the skeleton's bodies, welded ones included, metres.
pub(super) fn positions<'a>(
    stage: &'a Stage,
    links: &'a [LinkState],
) -> impl Iterator<Item = Vector3<f32>> + 'a {
    stage.character.bodies.iter().map(|(link, offset)| {
        (links[*link].pose * Point3::from(offset.translation.vector.cast::<f32>())).coords
    })
}

fn mean_distance(stage: &Stage, a: &[LinkState], b: &[LinkState]) -> f32 {
    let sum: f32 = positions(stage, a)
        .zip(positions(stage, b))
        .map(|(p, q)| (p - q).norm())
        .sum();
    sum / stage.character.bodies.len() as f32
}
