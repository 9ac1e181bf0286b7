//! Episodes of an agent, without noise in its actions.

use super::agent::{Agent, EvaluateError};
use crate::task::{
    Environment, Episode, EpisodeStart, Input, Outcome, Purpose, StartState, Step, Task, frame,
    step, step_together,
};

/// Most control steps that are kept at a time. Chosen: ten times those of an evaluation with the default options. Kept, they
/// take about 2 kB each.
const MOST_STEPS: f64 = 500_000.0;

/// Longest case, seconds, that can be evaluated in so many episodes, at so many control steps a second.
pub(crate) fn longest(episodes: f64, control_hz: f64) -> f64 {
    MOST_STEPS / episodes / control_hz
}

/// One of the episodes that run together.
struct Running {
    environment: Box<dyn Environment>,
    episode: Episode,
    outcome: Outcome,
}

/// Performs an episode for each of `starts`: a case that goes on for ever for `seconds`, any other to its end.
///
/// Episodes end by the rules of [`Purpose::Evaluation`], whatever rules the agent was trained under. Up to
/// [`LANES`](crate::sim::LANES) episodes take little longer than one.
///
/// # Errors
/// A task of another shape than the agent's, or more steps than can be kept.
pub fn perform<A: Agent>(
    agent: &A,
    starts: &[EpisodeStart],
    seconds: f64,
) -> Result<Vec<Episode>, EvaluateError> {
    let task = agent.task();
    let start = |start: &EpisodeStart| Running::new(task.as_ref(), start, seconds);
    let mut all: Vec<Running> = starts.iter().map(start).collect::<Result<_, _>>()?;
    let steps = all.iter().map(|running| running.episode.possible as f64);
    check_steps(steps.sum())?;
    let (mut memory, mut actions) = (A::Memory::default(), Vec::new());
    loop {
        let running = all.iter_mut().filter(|r| r.outcome == Outcome::Running);
        let mut running: Vec<&mut Running> = running.collect();
        if running.is_empty() {
            return Ok(all.into_iter().map(|running| running.episode).collect());
        }
        actions.clear();
        for running in &running {
            let environment = running.environment.as_ref();
            actions.extend_from_slice(agent.act(environment, &mut memory)?);
        }
        let environments = running
            .iter_mut()
            .map(|r| (r.environment.as_mut() as _, None));
        let steps = step_together(&mut environments.collect::<Vec<_>>(), &actions);
        for (running, step) in running.into_iter().zip(steps) {
            running.outcome = step.outcome;
            let environment = running.environment.as_ref();
            keep(&mut running.episode, environment, &step);
        }
    }
}

/// Checks that so many control steps can be kept.
pub(super) fn check_steps(steps: f64) -> Result<(), EvaluateError> {
    match steps <= MOST_STEPS {
        true => Ok(()),
        false => Err(EvaluateError::TooLong {
            steps,
            most: MOST_STEPS,
        }),
    }
}

impl Running {
    fn new(task: &dyn Task, start: &EpisodeStart, seconds: f64) -> Result<Self, EvaluateError> {
        let mut environment = task.environment(Purpose::Evaluation { seconds });
        environment.start_at(start)?;
        let possible = environment.possible_steps() as usize;
        Ok(Running {
            episode: Episode::new(*start, task.control_hz(), possible),
            environment,
            outcome: Outcome::Running,
        })
    }
}

fn keep(episode: &mut Episode, environment: &dyn Environment, step: &Step) {
    episode.keep(frame(environment, step), step.outcome);
}

/// Performs the cases of these numbers one after the other in one episode: each for `seconds` or to its end, and each from
/// where the one before has led. A failure ends the episode early, as in [`perform`]. Also returns how many of the cases were
/// begun.
///
/// # Errors
/// A task of another shape than the agent's, or a case that it doesn't have.
pub fn perform_sequence<A: Agent>(
    agent: &A,
    cases: &[usize],
    seconds: f64,
) -> Result<(Episode, usize), EvaluateError> {
    let task = agent.task();
    let first = cases.first().copied().unwrap_or(0);
    let start = EpisodeStart::new(first, StartState::Reference(0.0));
    let mut environment = task.environment(Purpose::Performance);
    environment.start_at(&start)?;
    let mut episode = Episode::new(start, task.control_hz(), 0);
    let mut memory = A::Memory::default();
    let mut advance = |environment: &mut dyn Environment, episode: &mut Episode| {
        let action = agent.act(environment, &mut memory)?;
        let step = step(environment, action);
        keep(episode, environment, &step);
        Ok::<bool, EvaluateError>(episode.failure.is_some())
    };
    for (part, &number) in cases.iter().enumerate() {
        if part > 0 {
            environment.input(Input::Case(number))?;
        }
        // The case before is performed until the transition begins; these steps count as possible ones too.
        while environment.is_changing() {
            episode.possible += 1;
            if advance(environment.as_mut(), &mut episode)? {
                return Ok((episode, part));
            }
        }
        // A second more than a motion lasts at its own pace, for it may begin at a slower one.
        let duration = task.cases()[number].duration_s;
        let steps = duration.map_or(seconds, |s| s + 1.0) * task.control_hz();
        let steps = steps.round().clamp(1.0, environment.possible_steps()) as usize;
        episode.possible += steps;
        check_steps(episode.possible as f64)?;
        for _ in 0..steps {
            if advance(environment.as_mut(), &mut episode)? {
                return Ok((episode, part + 1));
            }
        }
    }
    Ok((episode, cases.len()))
}
