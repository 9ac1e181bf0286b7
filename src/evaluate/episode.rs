//! One deterministic episode, kept frame by frame for metrics and replay.

use crate::clip::LoopMode;
use crate::learn::{LearnError, Memory, Performer};
use crate::sim::LinkState;
use crate::task::{
    Dynamics, Failure, Imitate, Outcome, Perturbations, Reference, Sample, Setting, Stage, Step,
    Terminations, Terms,
};
use nalgebra::Vector3;

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
    /// Impulse of the shove on the trunk that the step began with, N·s, world axes.
    pub shove: Option<Vector3<f32>>,
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
    /// Steps of an episode without failure; in a sequence those of the motions that were begun.
    pub possible: usize,
    /// Frames before a failure; with one, the last frame shows it.
    pub survived: usize,
    /// Largest angular momentum of the reference, kg·m²/s.
    pub largest_momentum: f32,
    pub failure: Option<Failure>,
    /// Links that the motion puts on the ground, in the order of [`Frame::contacts`].
    pub contact_links: Vec<usize>,
}

/// How an episode begins, and by which ranges and which seed it is disturbed.
pub type Opening = (Start, Option<(Perturbations, u64)>);

/// One of the episodes that are played together.
struct Playing {
    env: Imitate,
    trace: Trace,
    outcome: Outcome,
}

/// Plays reference number `which` once for each of `openings`, for `seconds` or to its end.
///
/// An episode fails by a fall, or when the bodies are 0.5 m from their reference in the mean, whatever rules the policy
/// was trained under; where the reference follows the agent along the ground, from there. Up to [`LANES`](crate::sim::LANES) episodes take little longer than one.
///
/// # Errors
/// A task of another shape than the policy's.
pub fn play(
    performer: &Performer,
    which: usize,
    openings: &[Opening],
    seconds: f64,
) -> Result<Vec<Trace>, LearnError> {
    let open = |opening| Playing::new(performer, which, opening, seconds);
    let mut all: Vec<Playing> = openings.iter().map(open).collect();
    let (mut memory, mut actions) = (Memory::default(), Vec::new());
    loop {
        let running = all.iter_mut().filter(|p| p.outcome == Outcome::Running);
        let mut running: Vec<&mut Playing> = running.collect();
        if running.is_empty() {
            return Ok(all.into_iter().map(|playing| playing.trace).collect());
        }
        actions.clear();
        for playing in &running {
            actions.extend_from_slice(performer.act(&playing.env, &mut memory)?);
        }
        let agents = running.iter_mut().map(|playing| &mut playing.env);
        let steps = Imitate::step_together(agents, &actions);
        for (playing, step) in running.into_iter().zip(steps) {
            playing.outcome = playing.trace.keep(performer, &playing.env, &step);
        }
    }
}

impl Playing {
    fn new(
        performer: &Performer,
        which: usize,
        (start, disturbed): &Opening,
        seconds: f64,
    ) -> Self {
        let ranges = disturbed.map_or_else(Perturbations::default, |(ranges, _)| ranges);
        let seconds = episode_s(&performer.references()[which], seconds);
        let setting = rules(performer, seconds, ranges);
        let mut env = performer.environment(which, &setting);
        match start {
            Start::At(share) => env.reset(share * env.last_start()),
            Start::Rest => env.reset_at_rest(),
        }
        if let Some((_, seed)) = disturbed {
            env.perturb(*seed);
        }
        Playing {
            trace: Trace::new(performer, which, *start, &env),
            env,
            outcome: Outcome::Running,
        }
    }
}

/// Plays the references of these numbers one after the other, each for `seconds` or to its end, and each from where the
/// one before has led. It ends early with a failure, as in [`play`]. Gives also how many of them were begun.
///
/// # Errors
/// A task of another shape than the policy's.
pub fn play_sequence(
    performer: &Performer,
    which: &[usize],
    seconds: f64,
) -> Result<(Trace, usize), LearnError> {
    let setting = rules(performer, f64::MAX, Perturbations::default());
    let first = which.first().copied().unwrap_or(0);
    let mut env = performer.environment(first, &setting);
    let mut trace = Trace::new(performer, first, Start::At(0.0), &env);
    trace.possible = 0;
    let mut memory = Memory::default();
    for (part, &number) in which.iter().enumerate() {
        let reference = &performer.references()[number];
        if part > 0 {
            env.lead_to(reference);
        }
        while env.is_leading() {
            trace.possible += 1;
            let step = env.step(performer.act(&env, &mut memory)?);
            trace.keep(performer, &env, &step);
            if trace.failure.is_some() {
                return Ok((trace, part));
            }
        }
        trace.largest_momentum = trace.largest_momentum.max(reference.largest_momentum());
        let steps = episode_s(reference, seconds) * setting.physics.control_hz;
        let steps = steps.round().clamp(1.0, env.possible_steps()) as usize;
        trace.possible += steps;
        for _ in 0..steps {
            let step = env.step(performer.act(&env, &mut memory)?);
            trace.keep(performer, &env, &step);
            if trace.failure.is_some() {
                return Ok((trace, part + 1));
            }
        }
    }
    Ok((trace, which.len()))
}

/// Length of an episode, with room for the end of a motion that has one.
fn episode_s(reference: &Reference, seconds: f64) -> f64 {
    match reference.loop_mode() {
        LoopMode::Wrap => seconds,
        LoopMode::Clamp => reference.duration() + 1.0,
    }
}

/// The performer's task under the rules of evaluation.
fn rules(performer: &Performer, episode_s: f64, perturbations: Perturbations) -> Setting {
    Setting {
        terminations: Terminations {
            distance: None,
            fall: true,
            reward: None,
        },
        episode_s,
        perturbations,
        ..*performer.setting()
    }
}

impl Trace {
    fn new(performer: &Performer, which: usize, start: Start, env: &Imitate) -> Self {
        let reference = &performer.references()[which];
        Trace {
            start,
            control_hz: performer.setting().physics.control_hz,
            frames: Vec::new(),
            possible: env.possible_steps() as usize,
            survived: 0,
            largest_momentum: reference.largest_momentum(),
            failure: None,
            contact_links: reference.contact_links.clone(),
        }
    }

    /// Keeps the frame that a step has led to; an episode that failed by its distance goes no further.
    fn keep(&mut self, performer: &Performer, env: &Imitate, step: &Step) -> Outcome {
        let mut reference = env.blank();
        env.wanted(&mut reference);
        let far = mean_distance(performer.stage(), env.states(), &reference.links) > LOST_M;
        let outcome = match step.outcome {
            Outcome::Failed(failure) => Outcome::Failed(failure),
            _ if far => Outcome::Failed(Failure::Distance),
            outcome => outcome,
        };
        let contact = |&link: &usize| env.contacts()[link];
        self.frames.push(Frame {
            time: env.time(),
            agent: env.states().to_vec(),
            reference,
            dynamics: *env.dynamics(),
            contacts: self.contact_links.iter().map(contact).collect(),
            terms: step.terms,
            reward: step.reward,
            shove: env.shove(),
        });
        match outcome {
            Outcome::Failed(failure) => self.failure = Some(failure),
            _ => self.survived += 1,
        }
        outcome
    }
}

/// World positions of all the skeleton's bodies, welded ones included, metres.
pub(super) fn positions<'a>(
    stage: &'a Stage,
    links: &'a [LinkState],
) -> impl Iterator<Item = Vector3<f32>> + 'a {
    let bodies = 0..stage.character.bodies.len();
    bodies.map(|b| stage.character.body_pose(links, b).translation.vector)
}

fn mean_distance(stage: &Stage, a: &[LinkState], b: &[LinkState]) -> f32 {
    let sum: f32 = positions(stage, a)
        .zip(positions(stage, b))
        .map(|(p, q)| (p - q).norm())
        .sum();
    sum / stage.character.bodies.len() as f32
}
