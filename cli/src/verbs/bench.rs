//! `mimic bench`: measures how fast this machine is at every stage of the work.

use crate::failure::{Failure, Outcome};
use crate::printer::Printer;
use crate::runs;
use mimic::clip::Clip;
use mimic::import;
use mimic::learn::Trainer;
use mimic::retarget;
use mimic::run::Plan;
use mimic::sim::World;
use mimic::skeleton::Skeleton;
use mimic::task::{
    CharacterModel, Environment, EpisodeStart, Outcome as Stands, Purpose, Reference, StartState,
    Stepping, Task, size, step_together,
};
use rayon::prelude::*;
use serde::Serialize;
use std::fmt::Write;
use std::sync::Arc;
use std::time::{Duration, Instant};

const EXAMPLES: &str = "\
Examples:
  mimic bench                       measure for about ten seconds
  mimic bench --seconds 10 --json   measure longer, for steadier numbers";

/// The clip that is measured with, built in so that machines can be compared.
const CLIP: &[u8] = include_bytes!("../../../clips/walk.glb");

/// Longest measurement, seconds: an hour is more than any needs.
const MOST_SECONDS: f64 = 3600.0;

/// Length of an environment's episode, seconds.
const HORIZON_S: f64 = 20.0;

/// Measure how fast this machine simulates, trains and retargets
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Length of each measurement, in seconds
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = seconds, allow_negative_numbers = true)]
    seconds: f64,
    /// Number of threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = crate::args::threads, allow_negative_numbers = true)]
    threads: Option<usize>,
}

fn seconds(text: &str) -> Result<f64, String> {
    runs::at_most(text, MOST_SECONDS, "seconds")
}

/// What was measured.
#[derive(Serialize)]
struct Report {
    threads: usize,
    /// Physics steps of one character each, all threads together.
    physics_steps_per_second: f64,
    /// Control steps with observation and reward, without a network.
    env_steps_per_second: f64,
    /// Samples of whole training iterations.
    train_samples_per_second: f64,
    /// Control steps per second of simulated time.
    control_hz: f64,
    /// Physics steps per second of simulated time.
    physics_hz: f64,
    /// Degrees of freedom that the policy drives.
    dof: usize,
    /// Widths of the hidden layers.
    network: Vec<usize>,
    /// Samples of a reference motion on one thread.
    reference_frames_per_second: f64,
    /// Frames that the retargeter solves on one thread.
    retarget_frames_per_second: f64,
}

/// All that the measurements need.
struct Bench {
    plan: Plan,
    clip: Clip,
    task: Arc<dyn Task>,
    reference: Arc<Reference>,
    threads: usize,
    /// Length of each measurement.
    time: Duration,
}

impl Args {
    /// Runs the command.
    pub fn run(self, printer: &Printer) -> Outcome {
        let threads = runs::use_threads(self.threads)?;
        let bench = Bench::new(threads, Duration::from_secs_f64(self.seconds))?;
        let say = |what: &str| printer.note(format!("measuring {what}"));
        let physics = bench.plan.task.physics();
        say("retargeting");
        let retarget_frames_per_second = bench.retarget()?;
        say("the reference");
        let reference_frames_per_second = bench.reference()?;
        say("physics");
        let physics_steps_per_second = bench.physics()?;
        say("the environment");
        let env_steps_per_second = bench.environment()?;
        say("training");
        let train_samples_per_second = bench.train()?;
        let report = Report {
            threads,
            physics_steps_per_second,
            env_steps_per_second,
            train_samples_per_second,
            control_hz: physics.control_hz,
            physics_hz: physics.physics_hz(),
            dof: size(bench.task.action()),
            network: bench.plan.hidden.clone(),
            reference_frames_per_second,
            retarget_frames_per_second,
        };
        printer.result(&report, || text(&report))
    }
}

/// The inputs are built in, so a failure is a fault of the program.
fn broken(error: impl std::fmt::Display) -> Failure {
    Failure::work(format!("cannot measure: {error}"))
}

impl Bench {
    fn new(threads: usize, time: Duration) -> Outcome<Self> {
        let plan = Plan::default();
        let clip =
            import::read(CLIP, "walk.glb", None, &import::Options::default()).map_err(broken)?;
        let skeleton = Skeleton::load("humanoid").map_err(broken)?;
        let options = retarget::Options::default();
        let motion = retarget::retarget(&clip, &skeleton, &options)
            .map_err(broken)?
            .motion;
        let model = Arc::new(CharacterModel::new(skeleton).map_err(broken)?);
        let reference = Reference::new(&motion, &model).map_err(broken)?;
        let motions = std::slice::from_ref(&motion);
        let task = plan.task.build(model, motions).map_err(broken)?;
        let reference = Arc::new(reference);
        Ok(Self {
            plan,
            clip,
            task,
            reference,
            threads,
            time,
        })
    }

    /// Frames that are retargeted per second.
    fn retarget(&self) -> Outcome<f64> {
        let options = retarget::Options::default();
        let once = || retarget::retarget(&self.clip, &self.task.model().skeleton, &options);
        once().map_err(broken)?;
        self.count(|| {
            let done = once().map_err(broken)?;
            Ok(done.motion.qpos.len() as u64)
        })
    }

    /// Samples of the reference per second.
    fn reference(&self) -> Outcome<f64> {
        let mut sample = self.reference.blank();
        let mut time = 0.0;
        self.count(|| {
            for _ in 0..1000 {
                time = (time + 0.013) % HORIZON_S;
                self.reference.sample(time, &mut sample);
            }
            Ok(1000)
        })
    }

    /// Where number `i` of a group begins, as a share of the motion: each elsewhere, as in training.
    fn share(&self, i: usize) -> f64 {
        i as f64 / self.plan.group as f64
    }

    /// Physics steps per second of characters that fall to the ground. Each thread steps as many at once as in training.
    fn physics(&self) -> Outcome<f64> {
        let settings = *self.plan.task.physics();
        self.on_all_threads(|| {
            let mut first = self.reference.blank();
            let new = |_| World::new(&self.task.model().character, settings);
            let mut worlds: Vec<World> = (0..self.plan.group).map(new).collect();
            let mut results = vec![Ok(()); worlds.len()];
            self.count(|| {
                for (i, world) in worlds.iter_mut().enumerate() {
                    let time = self.reference.duration() * self.share(i);
                    self.reference.sample(time, &mut first);
                    world.reset(&first.links);
                }
                let mut all: Vec<&mut World> = worlds.iter_mut().collect();
                for _ in 0..settings.control_hz as usize {
                    World::step_together(&mut all, &mut results);
                    results.iter().try_for_each(|r| r.map_err(broken))?;
                }
                Ok(settings.physics_hz() as u64 * all.len() as u64)
            })
        })
    }

    /// Control steps per second with observation, reward and reference, without a network.
    fn environment(&self) -> Outcome<f64> {
        self.on_all_threads(|| {
            let new = |_| self.task.environment(Purpose::Training);
            let mut all: Vec<Box<dyn Environment>> = (0..self.plan.group).map(new).collect();
            let actions = vec![0.0; all.len() * size(self.task.action())];
            let mut observation = vec![0.0; size(self.task.observation())];
            let start = |i| EpisodeStart::new(0, StartState::Reference(self.share(i)));
            for (i, environment) in all.iter_mut().enumerate() {
                environment.start_at(&start(i))?;
            }
            self.count(|| {
                let stepping = all.iter_mut().map(|e| (e.as_mut() as _, None));
                let mut stepping: Vec<Stepping> = stepping.collect();
                let steps = step_together(&mut stepping, &actions);
                for (i, (environment, step)) in all.iter_mut().zip(&steps).enumerate() {
                    if step.outcome != Stands::Running {
                        environment.start_at(&start(i))?;
                    }
                    environment.observe(&mut observation);
                }
                Ok(steps.len() as u64)
            })
        })
    }

    /// Samples per second of whole iterations: acting, physics and learning.
    fn train(&self) -> Outcome<f64> {
        let mut trainer = Trainer::new(self.plan.trainer(), self.task.clone())?;
        trainer.iterate()?;
        let (start, before) = (Instant::now(), trainer.samples());
        while start.elapsed() < self.time {
            trainer.iterate()?;
        }
        Ok((trainer.samples() - before) as f64 / start.elapsed().as_secs_f64())
    }

    /// Units of `work` per second, repeated until the time is up.
    fn count(&self, mut work: impl FnMut() -> Outcome<u64>) -> Outcome<f64> {
        let start = Instant::now();
        let mut done = 0;
        while start.elapsed() < self.time {
            done += work()?;
        }
        Ok(done as f64 / start.elapsed().as_secs_f64())
    }

    /// The sum of what `work` reaches on every thread at once.
    fn on_all_threads(&self, work: impl Fn() -> Outcome<f64> + Sync) -> Outcome<f64> {
        (0..self.threads)
            .into_par_iter()
            .with_max_len(1)
            .map(|_| work())
            .sum()
    }
}

fn text(report: &Report) -> String {
    let layers: Vec<String> = report.network.iter().map(usize::to_string).collect();
    let mut text = format!(
        "{} threads, {} degrees of freedom, {} Hz control, {} Hz physics, network {}\n",
        report.threads,
        report.dof,
        report.control_hz,
        report.physics_hz,
        layers.join("-")
    );
    for (name, value) in [
        ("physics steps", report.physics_steps_per_second),
        ("environment steps", report.env_steps_per_second),
        ("training samples", report.train_samples_per_second),
        ("reference frames", report.reference_frames_per_second),
        ("retargeted frames", report.retarget_frames_per_second),
    ] {
        writeln!(text, "  {name:20} {value:>12.0} /s").ok();
    }
    text
}
