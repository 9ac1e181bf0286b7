//! The trajectory: fitted to its goals, with flights that follow gravity and spin freely, inside the joint limits.

use super::cost::{self, Problem};
use super::flight::{self, Air, Flight, Lift};
use super::goals::Goals;
use super::model::Model;
use super::rotation;
use super::solve::{self, Solver};
use super::spin::{self, Tilt, Tilts};
use super::stance::Anchor;
use crate::motion::Cycle;
use crate::skeleton::limits;
use nalgebra::Vector3;

/// Depth below the ground from which on a frame is solved again, metres.
const DEEPEST: f64 = 0.004;

/// What a trajectory is fitted with, beside its goals.
#[derive(Clone, Copy)]
pub(super) struct Fit<'a> {
    pub model: &'a Model<'a>,
    pub anchors: &'a [Vec<Anchor>],
    pub cycle: Option<&'a Cycle>,
    pub fps: f64,
    /// As in [`super::Options`].
    pub to_perform: bool,
}

/// A trajectory, and what became of it.
pub(super) struct Fitted {
    pub frames: Vec<Vec<f64>>,
    /// Steps of the first fit.
    pub iterations: usize,
    /// How far a flight was moved at most, metres.
    pub lifted: f64,
    /// How far a flight was turned at most, radians.
    pub turned: f64,
    /// Whether all flights keep their angular momentum.
    pub spins_freely: bool,
}

impl<'a> Fit<'a> {
    pub fn run(&self, goals: &mut Goals) -> Fitted {
        let mut frames = goals.guess.clone();
        if self.cycle.is_some() {
            frames.pop();
        }
        let iterations = self.solver(&self.problem(goals)).run(&mut frames);
        let (flights, lifts) = self.air(&frames).lifts();
        let mut tilts = Tilts {
            frames: Vec::new(),
            free: Vec::new(),
        };
        if !flights.is_empty() {
            self.lift(goals, &lifts, &mut frames);
            tilts = spin::tilts(&self.air(&frames), &flights);
            self.tilt(goals, &tilts.frames, &mut frames);
        }
        let problem = self.problem(goals);
        self.mend(&problem, &mut frames);
        if !flights.is_empty() {
            self.set_free(&flights, &tilts.free, &mut frames);
            // A flight that was freed may touch what it flew past.
            self.mend(&problem, &mut frames);
        }
        if let (Some(cycle), Some(first)) = (self.cycle, frames.first()) {
            let turn = rotation::exp(&(Vector3::z() * cycle.heading)).to_rotation_matrix();
            let last = solve::carried(first, turn.matrix(), &cycle.translation);
            frames.push(last);
        }
        let flying = lifts.iter().flatten().filter(|lift| lift.flies);
        let turned = tilts.frames.iter().flatten().filter(|tilt| tilt.flies);
        let turned = turned.map(|tilt| tilt.by.angle());
        Fitted {
            frames,
            iterations,
            lifted: flying.map(|lift| lift.shift.norm()).fold(0.0, f64::max),
            turned: turned.fold(0.0, f64::max),
            spins_freely: tilts.free.len() == flights.len(),
        }
    }

    fn problem<'g>(&self, goals: &'g Goals) -> Problem<'g>
    where
        'a: 'g,
    {
        Problem::new(self.model, goals, self.anchors, self.fps)
    }

    fn solver<'p>(&self, problem: &'p Problem<'p>) -> Solver<'p>
    where
        'a: 'p,
    {
        Solver::new(problem, self.cycle)
    }

    fn air<'f>(&self, frames: &'f [Vec<f64>]) -> Air<'f>
    where
        'a: 'f,
    {
        Air {
            model: self.model,
            frames,
            anchors: self.anchors,
            cycle: self.cycle,
            fps: self.fps,
            to_perform: self.to_perform,
        }
    }

    /// Moves flights onto their parabolas, with what leads to them.
    fn lift(&self, goals: &mut Goals, lifts: &[Option<Lift>], frames: &mut [Vec<f64>]) {
        for (f, lift) in lifts.iter().enumerate() {
            let Some(lift) = lift else { continue };
            flight::lift(self.model, goals, f, &self.air(frames).stood_on(f), lift);
            lift.apply(&mut frames[f]);
        }
        let problem = self.problem(goals);
        self.solver(&problem)
            .mend(frames, |f, _| lifts[f].is_some());
    }

    /// Turns flights so that they spin freely, with what leads to them.
    fn tilt(&self, goals: &mut Goals, tilts: &[Option<Tilt>], frames: &mut [Vec<f64>]) {
        for (f, tilt) in tilts.iter().enumerate() {
            let Some(tilt) = tilt else { continue };
            let anchors = self.air(frames).stood_on(f);
            spin::tilt_goals(self.model, goals, f, &anchors, (&frames[f], tilt));
            tilt.apply(self.model.skeleton, &mut frames[f]);
        }
        // What flies was turned with its goals, and fits them as before.
        let leads = |f: usize, _: &[f64]| tilts[f].is_some_and(|tilt| !tilt.flies);
        let problem = self.problem(goals);
        self.solver(&problem).mend(frames, leads);
    }

    /// Fitting anew has moved flights off their parabolas again, by little: now they are moved, and those that `spin` turned,
    /// as they are.
    fn set_free(&self, flights: &[Flight], spin: &[Flight], frames: &mut [Vec<f64>]) {
        let lifts = self.air(frames).lifts_of(flights);
        for (qpos, lift) in frames.iter_mut().zip(lifts) {
            if let Some(lift) = lift.filter(|lift| lift.flies) {
                lift.apply(qpos);
            }
        }
        let tilts = spin::tilts(&self.air(frames), spin).frames;
        for (qpos, tilt) in frames.iter_mut().zip(tilts) {
            if let Some(tilt) = tilt.filter(|tilt| tilt.flies) {
                tilt.apply(self.model.skeleton, qpos);
            }
        }
    }

    /// Solves again, more stiffly, where a coordinate is outside of its limits or a body below the ground.
    fn mend(&self, problem: &Problem, frames: &mut [Vec<f64>]) {
        // Clamping moves feet, so it should have nothing left to do.
        let skeleton = self.model.skeleton;
        let is_wrong = |_: usize, qpos: &[f64]| {
            limits::violations(skeleton, qpos) > 0
                || skeleton.lowest_point(&skeleton.forward(qpos)) < -DEEPEST
        };
        let stiffer = cost::weight::STIFF_LIMITS.into_iter();
        for (limit, ground) in stiffer.zip(cost::weight::STIFF_GROUND) {
            if !frames.iter().any(|qpos| is_wrong(0, qpos)) {
                break;
            }
            let stiff = Problem {
                limit,
                ground,
                ..*problem
            };
            Solver::new(&stiff, self.cycle).mend(frames, is_wrong);
        }
        for qpos in frames {
            limits::clamp(skeleton, qpos);
        }
    }
}
