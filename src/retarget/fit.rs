//! Stage 6, fit: fits one trajectory of the skeleton to its goals, with flights that fall and spin freely, inside the joint
//! limits and above the ground.
//!
//! What carries the body and where it flies can be recognised only in a trajectory that is nearly right, so the fit goes in steps,
//! each from the result of the one before. A first fit follows the goals. Then bodies that carry are led down to the ground, and
//! for a body that is to perform the motion, swings that no ground could push are taken out. Then flights are shifted onto their parabolas and turned so that they spin
//! freely, and the frames that lead to them are solved again. Frames that break a limit are solved again more stiffly. In
//! the end flights are put back onto the paths that fitting moved them off.

mod ballistic;
mod banded;
mod carriers;
mod cost;
mod flight;
mod friction;
mod smoothness;
mod solver;
mod span;
mod spin;
mod system;
mod tile;
mod torque_free;
mod trajectory;
mod weight;
mod window;

use super::anchor::Anchor;
use super::goals::Goals;
use super::model::Model;
use super::qpos::CycleStep;
use crate::clip::Problem;
use crate::motion::Cycle;
use crate::skeleton::limits;
use ballistic::FlightShift;
use cost::LeastSquares;
use nalgebra::Vector2;
use solver::Solver;
use span::Flight;
use spin::FlightTurn;
use trajectory::Trajectory;

/// Depth below the ground from which on a frame is solved again, metres. Chosen below the 1 cm that is asked of a motion.
const DEEPEST: f64 = 0.004;

/// How often the path of a body over the ground is smoothed, and shifts that are left out, metres.
const FRICTION_GOES: usize = 3;
const UNSEEN: f64 = 1e-4;

/// Share of the work that the first fit is, and what is done once flights fall and once they spin freely. Chosen: of a walk
/// of 11,001 frames the first fit took 14 of 18 s, and flights take more of it.
const FIRST_FIT: f64 = 0.7;
const FALLEN: f64 = 0.8;
const SPUN: f64 = 0.9;

/// What a trajectory is fitted with, beside its goals.
#[derive(Clone, Copy)]
pub(super) struct Fit<'a> {
    /// The skeleton.
    pub model: &'a Model<'a>,
    /// The points that stand, by frame.
    pub anchors: &'a [Vec<Anchor>],
    /// For a motion that repeats.
    pub cycle: Option<&'a Cycle>,
    /// Frames per second.
    pub fps: f64,
    /// As in [`super::Options`].
    pub to_perform: bool,
    /// Is told which share of the work is done, from 0 to 1.
    pub progress: &'a dyn Fn(f64),
}

/// A fitted trajectory.
pub(super) struct Fitted {
    /// The points that stand or carry, by frame.
    pub anchors: Vec<Vec<Anchor>>,
    /// Coordinates of every frame; the last one of a cycle is the first, carried on.
    pub frames: Vec<Vec<f64>>,
    /// Most steps that a window took in the first fit.
    pub iterations: usize,
    /// The notes `flight-corrected` and `spin-corrected`.
    pub problems: Vec<Problem>,
}

/// Goals and a trajectory on the way to fit them.
struct Fitting {
    goals: Goals,
    frames: Vec<Vec<f64>>,
}

impl<'a> Fit<'a> {
    /// Fits a trajectory to the goals.
    pub fn run(&self, goals: Goals) -> Fitted {
        let (mut fitting, iterations) = self.first(goals);
        (self.progress)(FIRST_FIT);
        // What carries the body is found in the trajectory, too, and is part of it from now on.
        let carried = carriers::anchors(self, &fitting.frames);
        let anchors = carried.unwrap_or_else(|| self.anchors.to_vec());
        let fit = Fit {
            anchors: &anchors,
            ..*self
        };
        let carries = |f: usize, _: &[f64]| anchors[f].iter().any(|anchor| anchor.is_level);
        fit.solver(&fit.least_squares(&fitting.goals))
            .repair(&mut fitting.frames, carries);
        if fit.to_perform {
            fitting = fit.with_friction(fitting);
        }
        fit.with_physics(fitting, iterations)
    }

    /// Leads the body along where the ground can push it.
    fn with_friction(&self, mut fitting: Fitting) -> Fitting {
        // What the ground can do depends on where the body is, so the way is found in several goes.
        for _ in 0..FRICTION_GOES {
            let Some(ways) = friction::shifts(self, &fitting.frames) else {
                break;
            };
            let shift = |by: &Vector2<f64>| {
                (by.norm() > UNSEEN).then(|| FlightShift {
                    by: by.push(0.0),
                    flies: false,
                })
            };
            let shifts: Vec<_> = ways.iter().map(shift).collect();
            fitting = self.shifted(fitting, &shifts);
        }
        fitting
    }

    /// Makes the first fit a trajectory that a body could follow.
    fn with_physics(&self, fitting: Fitting, iterations: usize) -> Fitted {
        // Flights are found in the fitted trajectory, for the goals may float or sink.
        let (flights, shifts) = flight::find(&self.trajectory(&fitting.frames));
        let (frames, problems) = match flights.is_empty() {
            true => (
                self.within_limits(&fitting.goals, fitting.frames),
                Vec::new(),
            ),
            false => self.with_flights(fitting, &flights, &shifts),
        };
        Fitted {
            anchors: self.anchors.to_vec(),
            frames: self.whole_cycle(frames),
            iterations,
            problems,
        }
    }

    /// The first fit, from the guess. Returns the steps that it took as well.
    fn first(&self, goals: Goals) -> (Fitting, usize) {
        let mut frames = goals.guess.clone();
        // The last frame of a cycle is the first of the next, and isn't solved for twice.
        if self.cycle.is_some() {
            frames.pop();
        }
        let progress = |done| (self.progress)(FIRST_FIT * done);
        let problem = self.least_squares(&goals);
        let iterations = self.solver(&problem).run(&mut frames, progress);
        (Fitting { goals, frames }, iterations)
    }

    /// Makes flights fall and spin freely, and brings all frames inside their limits.
    fn with_flights(
        &self,
        fitting: Fitting,
        flights: &[Flight],
        shifts: &[Option<FlightShift>],
    ) -> (Vec<Vec<f64>>, Vec<Problem>) {
        let fallen = self.shifted(fitting, shifts);
        (self.progress)(FALLEN);
        // The spin comes after the fall, which doesn't change it: a body is shifted as a whole.
        let turns = spin::turns(&self.trajectory(&fallen.frames), flights);
        let Fitting { goals, frames } = self.turned(fallen, &turns.frames);
        (self.progress)(SPUN);
        // Limits come first, for a stiffer fit moves flights again.
        let frames = self.within_limits(&goals, frames);
        let frames = self.put_back(frames, flights, &turns.free);
        // A flight that was put back may touch what it flew past.
        let frames = self.within_limits(&goals, frames);
        let all_free = turns.free.len() == flights.len();
        let problems = [
            ballistic::problem(farthest_shift(shifts)),
            spin::problem(farthest_turn(&turns.frames), all_free),
        ];
        (frames, problems.into_iter().flatten().collect())
    }

    /// Shifts flights onto their parabolas, and solves for them and for what leads to them again.
    fn shifted(&self, fitting: Fitting, shifts: &[Option<FlightShift>]) -> Fitting {
        let Fitting {
            mut goals,
            mut frames,
        } = fitting;
        // Goals and trajectory are shifted alike, so flying frames still fit; only those that lead to them have to be solved
        // for.
        for (f, shift) in shifts.iter().enumerate() {
            let Some(shift) = shift else { continue };
            // Targets of limbs in contact stay; the others go along.
            let anchors = self.trajectory(&frames).stood_on(f);
            ballistic::shift_goals(self.model, &mut goals, f, &anchors, shift);
            shift.apply(&mut frames[f]);
        }
        self.solver(&self.least_squares(&goals))
            .repair(&mut frames, |f, _| shifts[f].is_some());
        Fitting { goals, frames }
    }

    /// Turns flights so that they spin freely, and solves for what leads to them again.
    fn turned(&self, fitting: Fitting, turns: &[Option<FlightTurn>]) -> Fitting {
        let Fitting {
            mut goals,
            mut frames,
        } = fitting;
        for (f, turn) in turns.iter().enumerate() {
            let Some(turn) = turn else { continue };
            let anchors = self.trajectory(&frames).stood_on(f);
            spin::turn_goals(self.model, &mut goals, f, &anchors, (&frames[f], turn));
            turn.apply(self.model.skeleton, &mut frames[f]);
        }
        // Flying frames were turned with their goals, and fit them as before.
        let leads = |f: usize, _: &[f64]| turns[f].is_some_and(|turn| !turn.flies);
        self.solver(&self.least_squares(&goals))
            .repair(&mut frames, leads);
        Fitting { goals, frames }
    }

    /// Puts flights back onto their parabolas, and those of `spin` back to one angular momentum. Fitting has moved them off
    /// by little, so flying frames are moved as they are, and those that lead to them stay.
    fn put_back(
        &self,
        mut frames: Vec<Vec<f64>>,
        flights: &[Flight],
        spin: &[Flight],
    ) -> Vec<Vec<f64>> {
        let shifts = ballistic::shifts(&self.trajectory(&frames), flights);
        for (qpos, shift) in frames.iter_mut().zip(shifts) {
            if let Some(shift) = shift.filter(|shift| shift.flies) {
                shift.apply(qpos);
            }
        }
        let turns = spin::turns(&self.trajectory(&frames), spin).frames;
        for (qpos, turn) in frames.iter_mut().zip(turns) {
            if let Some(turn) = turn.filter(|turn| turn.flies) {
                turn.apply(self.model.skeleton, qpos);
            }
        }
        frames
    }

    /// Solves again, more and more stiffly, where a coordinate is outside of its limits or a body below the ground, and
    /// clamps what is left. Clamping moves feet, so it should have nothing left to do.
    fn within_limits(&self, goals: &Goals, mut frames: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let skeleton = self.model.skeleton;
        let is_wrong = |_: usize, qpos: &[f64]| {
            limits::violations(skeleton, qpos) > 0
                || skeleton.lowest_point(&skeleton.forward(qpos)) < -DEEPEST
        };
        let stiffer = weight::STIFF_LIMITS.into_iter();
        for (limit, ground) in stiffer.zip(weight::STIFF_GROUND) {
            // Most motions are right at the first go.
            if !frames.iter().any(|qpos| is_wrong(0, qpos)) {
                break;
            }
            let stiff = LeastSquares {
                limit,
                ground,
                ..self.least_squares(goals)
            };
            self.solver(&stiff).repair(&mut frames, is_wrong);
        }
        for qpos in &mut frames {
            limits::clamp(skeleton, qpos);
        }
        frames
    }

    /// Appends the last frame of a cycle, which is the first, carried on.
    fn whole_cycle(&self, mut frames: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        if let (Some(cycle), Some(first)) = (self.cycle, frames.first()) {
            let last = CycleStep::of(cycle).carry(first);
            frames.push(last);
        }
        frames
    }

    /// The least-squares problem of these goals.
    fn least_squares<'g>(&self, goals: &'g Goals) -> LeastSquares<'g>
    where
        'a: 'g,
    {
        LeastSquares::new(self.model, goals, self.anchors, self.fps)
    }

    /// A solver for it.
    fn solver<'p>(&self, problem: &'p LeastSquares<'p>) -> Solver<'p>
    where
        'a: 'p,
    {
        Solver::new(problem, self.cycle)
    }

    /// These frames with their contacts.
    fn trajectory<'f>(&self, frames: &'f [Vec<f64>]) -> Trajectory<'f>
    where
        'a: 'f,
    {
        Trajectory {
            model: self.model,
            frames,
            anchors: self.anchors,
            cycle: self.cycle,
            fps: self.fps,
            to_perform: self.to_perform,
        }
    }
}

/// How far a flight is shifted at most, metres.
fn farthest_shift(shifts: &[Option<FlightShift>]) -> f64 {
    let flying = shifts.iter().flatten().filter(|shift| shift.flies);
    flying.map(|shift| shift.by.norm()).fold(0.0, f64::max)
}

/// How far a flight is turned at most, radians.
fn farthest_turn(turns: &[Option<FlightTurn>]) -> f64 {
    let flying = turns.iter().flatten().filter(|turn| turn.flies);
    flying.map(|turn| turn.by.angle()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests;
