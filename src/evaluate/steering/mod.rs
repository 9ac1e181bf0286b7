//! How well a steered character follows its player: heading, speed, answers, standing and pushes, of the simulated character and of
//! the animated one beside it.

mod figures;
mod script;
mod take;

use super::agent::{Agent, EvaluateError};
use super::episode::check_steps;
use crate::sim::LANES;
use crate::task::{
    Environment, EpisodeStart, Input, Outcome, Purpose, StartState, Stepping, step_together,
};
use figures::{random, rise, standing, turns};
use rayon::prelude::*;
use script::{Asks, Script, direction};
use serde::Serialize;
use take::{Before, Camera, Take};

pub use figures::{Figures, Pushed, Spread, Turn};

/// What to evaluate of a steered character.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteeringOptions {
    /// Episodes of random input.
    pub episodes: usize,
    /// Seconds of each.
    pub seconds: f64,
    /// Starts from standing, and turns by 180°, of each.
    pub tries: usize,
    /// Speed of the walk that is started and turned, m/s.
    pub walk_m_s: f32,
    /// Impulse of a push on the trunk every 3 s, N·s.
    pub push_ns: f32,
}

impl Default for SteeringOptions {
    fn default() -> Self {
        Self {
            episodes: 32,
            seconds: 60.0,
            tries: 200,
            walk_m_s: 1.65,
            push_ns: 18.0,
        }
    }
}

/// How well a character is steered.
#[derive(Clone, Debug, Serialize)]
pub struct SteeringEvaluation {
    /// Episodes of random input.
    pub episodes: usize,
    /// Seconds of each.
    pub seconds: f64,
    /// Share of them without a fall.
    pub survival: f64,
    /// Figures of the simulated character.
    #[serde(flatten)]
    pub agent: Figures,
    /// Mean distance of the bodies from the animated character's, seen from the root, mm.
    pub mpjpe_local_mm: f64,
    /// Under pushes.
    pub pushed: Pushed,
    /// One control step of one character on one core, policy and physics, ms.
    pub step_ms: f64,
    /// The same figures of the animated character.
    pub reference: Figures,
}

/// Seconds before a walk that is started, and that is turned, begins; seconds after the turn. Chosen so that the character has
/// settled.
const STANDS_S: f64 = 2.0;
const WALKS_S: f64 = 3.0;
const AFTER_S: f64 = 8.0;
/// Seconds of standing in which drift is measured.
const STANDING_S: f64 = 60.0;
/// Seconds between pushes, and of a push.
const PUSH_EVERY_S: f64 = 3.0;
const PUSH_S: f64 = 0.1;

/// Evaluates a steered agent.
///
/// # Errors
/// A task of another shape than the agent's, or more steps than can be kept.
pub fn evaluate_steering<A: Agent>(
    agent: &A,
    options: &SteeringOptions,
) -> Result<SteeringEvaluation, EvaluateError> {
    let hz = agent.task().control_hz();
    let steps = |seconds: f64| (seconds * hz).round() as usize;
    // Twice the random input, and the other scripts.
    let free_s = 2.0 * options.episodes as f64 * options.seconds;
    let tries = options.tries as f64 * (STANDS_S + 2.0 * WALKS_S + 1.0 + AFTER_S);
    check_steps((free_s + tries + STANDING_S) * hz)?;
    let long = steps(options.seconds);
    let script = |asks: Vec<_>, steps| Script { asks, steps };
    let free: Vec<Script> = (0..options.episodes)
        .map(|_| script(Vec::new(), long))
        .collect();
    let pushes: Vec<Script> = (0..options.episodes)
        .map(|n| {
            let every = steps(PUSH_EVERY_S);
            let times = (1..)
                .map(|k| k * every)
                .take_while(|step| step + every < long);
            times
                .enumerate()
                .fold(script(Vec::new(), long), |all, (k, step)| {
                    all.pushed(step, steps(PUSH_S), direction(n * 131 + k), options.push_ns)
                })
        })
        .collect();
    let walk = options.walk_m_s;
    let starts = (0..options.tries).map(|n| {
        script(Vec::new(), steps(STANDS_S + WALKS_S))
            .goes(0, 0.0, 0.0)
            .goes(steps(STANDS_S), direction(n), walk)
    });
    let turned = (0..options.tries).map(|n| {
        let way = direction(n);
        // The turn begins in any part of a step.
        let at = steps(WALKS_S) + n % steps(1.0);
        script(Vec::new(), at + steps(AFTER_S))
            .goes(0, way, walk)
            .goes(at, way + std::f32::consts::PI, walk)
    });
    let stand = [script(Vec::new(), steps(STANDING_S)).goes(0, 0.0, 0.0)];
    let begun = std::time::Instant::now();
    let free = perform(agent, &free)?;
    let taken: usize = free.iter().map(|take| take.agent.len()).sum();
    let threads = rayon::current_num_threads().min(free.len().div_ceil(LANES));
    let step_ms = begun.elapsed().as_secs_f64() * 1e3 * threads as f64 / taken.max(1) as f64;
    let pushed = perform(agent, &pushes)?;
    let starts = perform(agent, &starts.collect::<Vec<_>>())?;
    let turned = perform(agent, &turned.collect::<Vec<_>>())?;
    let stand = perform(agent, &stand)?;
    let figures = |of: figures::Of| Figures {
        heading_error_deg: random(&free, of, hz).heading,
        facing_error_deg: random(&free, of, hz).facing,
        speed_error_m_s: random(&free, of, hz).speed,
        slide_per_stance_m: random(&free, of, hz).slide,
        rise_s: rise(&starts, of, hz, steps(STANDS_S)),
        turn_180: turns(&turned, of, hz),
        idle_drift_m: standing(&stand, of),
    };
    let upright = |takes: &[Take]| {
        let up = takes.iter().filter(|take| !take.fell).count();
        up as f64 / takes.len().max(1) as f64
    };
    let errors = free.iter().flat_map(|take| take.errors.iter().copied());
    Ok(SteeringEvaluation {
        episodes: free.len(),
        seconds: options.seconds,
        survival: upright(&free),
        agent: figures(|take| &take.agent),
        mpjpe_local_mm: 1000.0 * crate::task::mean(errors),
        pushed: Pushed {
            impulse_ns: f64::from(options.push_ns),
            survival: upright(&pushed),
        },
        step_ms,
        reference: figures(|take| &take.reference),
    })
}

/// Performs all scripts, several together; takes are in their order.
fn perform<A: Agent>(agent: &A, scripts: &[Script]) -> Result<Vec<Take>, EvaluateError> {
    let numbered: Vec<(usize, &Script)> = scripts.iter().enumerate().collect();
    let all: Result<Vec<Vec<Take>>, EvaluateError> = numbered
        .par_chunks(LANES)
        .map(|scripts| together(agent, scripts))
        .collect();
    Ok(all?.into_iter().flatten().collect())
}

/// An episode that runs together with others.
struct Running<'s> {
    environment: Box<dyn Environment>,
    script: &'s Script,
    /// How much of the script was asked for.
    asked: usize,
    take: Take,
    is_over: bool,
}

impl Running<'_> {
    /// Asks for what the script has at this step.
    fn ask(&mut self, step: usize) -> Result<(), EvaluateError> {
        while let Some((at, ask)) = self.script.asks.get(self.asked) {
            if *at > step {
                break;
            }
            self.asked += 1;
            self.environment.input(match ask {
                Asks::Wish(wish) => Input::Wish(*wish),
                Asks::Push(impulse) => Input::Push(*impulse),
            })?;
        }
        Ok(())
    }
}

fn together<A: Agent>(agent: &A, scripts: &[(usize, &Script)]) -> Result<Vec<Take>, EvaluateError> {
    let task = agent.task();
    let camera = Camera::new(task.model());
    let begin = |number: usize| -> Result<Box<dyn Environment>, EvaluateError> {
        let mut environment = task.environment(Purpose::Performance);
        // The share is the seed of the player who asks where the script doesn't.
        let start = StartState::Reference((number as f64 + 1.0) / 1e6);
        environment.start_at(&EpisodeStart::new(0, start))?;
        Ok(environment)
    };
    let mut all = Vec::new();
    for (number, script) in scripts {
        all.push(Running {
            environment: begin(*number)?,
            script,
            asked: 0,
            take: Take::default(),
            is_over: false,
        });
    }
    let longest = scripts.iter().map(|(_, script)| script.steps).max();
    let (mut memory, mut actions) = (A::Memory::default(), Vec::new());
    for step in 0..longest.unwrap_or(0) {
        let mut running: Vec<&mut Running> = all
            .iter_mut()
            .filter(|r| !r.is_over && step < r.script.steps)
            .collect();
        actions.clear();
        let mut before = Vec::with_capacity(running.len());
        for one in &mut running {
            one.ask(step)?;
            actions.extend_from_slice(agent.act(one.environment.as_ref(), &mut memory)?);
            before.push(Before::of(one.environment.as_ref()));
        }
        let mut stepping: Vec<Stepping> = Vec::with_capacity(running.len());
        stepping.extend(
            running
                .iter_mut()
                .map(|r| (r.environment.as_mut() as _, None)),
        );
        let steps = step_together(&mut stepping, &actions);
        for ((one, taken), before) in running.into_iter().zip(steps).zip(&before) {
            match taken.outcome {
                Outcome::Running => camera.keep(&mut one.take, one.environment.as_ref(), before),
                Outcome::Failed(_) => (one.take.fell, one.is_over) = (true, true),
                _ => one.is_over = true,
            }
        }
    }
    Ok(all.into_iter().map(|running| running.take).collect())
}
