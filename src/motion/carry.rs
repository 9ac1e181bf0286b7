//! Which bodies carry a motion: those that give it the force that it needs.
//!
//! In every frame the ground has to give a force and a moment ([`required`]). What is near the ground
//! gives them. Of all explanations by forces inside friction cones the cheapest counts, and a point is the dearer the higher it
//! is and the faster it moves. So a foot that swings past the ground gets nothing while the other one stands, and a hand that
//! slides over it gets everything where nothing else is near. No body needs to stand still for that, or to be a foot.

use super::contact::{State, settled};
use super::timeline::Timeline;
use super::wrench::{Load, Wrench, friction_rays, required, wrench_equations};
use super::{Cycle, momentum, nnls, velocity};
use crate::clip::LoopMode;
use crate::skeleton::{GRAVITY, Skeleton, Twist};
use nalgebra::{DVector, Isometry3, Vector3};

/// Cost of a load on a point at rest on the ground, beside the force that isn't explained; both are shares of the weight. Its
/// square is a ten-thousandth.
const COST: f64 = 0.01;
/// Height (leg lengths) and speed (m/s) at which a load's cost has doubled; it rises with their squares. Chosen: 1.6 cm with
/// legs of 0.8 m. A hand that slides at 0.8 m/s costs 8 times as much as one at rest, and a foot that swings 100 times.
const HEIGHT: f64 = 0.02;
const SPEED: f64 = 0.3;
/// Share of the weight from which on a body surely carries, and down to which it goes on carrying. Where even the body that carries
/// most has less than [`MOST`], as in lying, both are less in proportion. Chosen.
const CARRIES: [f64; 2] = [0.1, 0.03];
const MOST: f64 = 0.4;
/// Share of the weight that all bodies together carry at least, where one does.
const LEAST: f64 = 0.2;

/// Vertical speed from which on a point passes the ground and doesn't press on it, m/s. Chosen.
const PASSES: f64 = 1.0;
/// Height above a neighbouring body from which on that one holds a body up, metres. Chosen.
const LOWER: f64 = 0.015;

/// A motion of which some bodies carry the rest.
pub(crate) struct Carried<'a> {
    /// The skeleton that moves.
    pub(crate) skeleton: &'a Skeleton,
    /// `bodies[f][b]`: world pose of each body.
    pub(crate) bodies: &'a [Vec<Isometry3<f64>>],
    /// `twists[f][b]`: velocity of each body.
    pub(crate) twists: &'a [Vec<Twist>],
    /// `com[f]`: centre of mass, world, metres.
    pub(crate) com: &'a [Vector3<f64>],
    /// `required[f]`: what [`required`] gives.
    pub(crate) required: &'a [Wrench],
    /// Frames per second.
    pub(crate) fps: f64,
    /// Which frame follows which.
    pub(crate) timeline: &'a Timeline,
}

/// Coordinates over time.
pub(crate) struct Path<'a> {
    /// Coordinates of every frame; where it repeats, the last frame is the first, carried on.
    pub(crate) qpos: &'a [Vec<f64>],
    /// Frames per second.
    pub(crate) fps: f64,
    /// For what repeats.
    pub(crate) cycle: Option<&'a Cycle>,
}

/// What carries, by frame.
pub(crate) struct Carrying {
    /// As [`Carried::by`] has it.
    pub(crate) by: Vec<Vec<bool>>,
    /// The force upwards that the motion needs, as a share of the weight: 1 at rest, 0 in free fall.
    pub(crate) need: Vec<f64>,
}

/// What carries, from coordinates alone; see [`Carried::by`].
pub(crate) fn carrying(
    skeleton: &Skeleton,
    path: &Path,
    candidates: &[usize],
    reach: &[f64],
) -> Carrying {
    let (loop_mode, cycle) = match path.cycle {
        Some(cycle) => (LoopMode::Wrap, *cycle),
        None => (LoopMode::Clamp, Cycle::NONE),
    };
    let timeline = Timeline {
        frames: path.qpos.len(),
        loop_mode,
        cycle,
    };
    let qvel = velocity::qvel(skeleton, path.qpos, path.fps, &timeline);
    let bodies: Vec<_> = path.qpos.iter().map(|q| skeleton.forward(q)).collect();
    let whole = momentum::whole_body(skeleton, path.qpos, &qvel, &bodies);
    let mass = skeleton.total_mass();
    let required = required(
        &whole.com,
        &whole.angular_momentum,
        mass,
        path.fps,
        &timeline,
    );
    let carried = Carried {
        skeleton,
        bodies: &bodies,
        twists: &twists(skeleton, path.qpos, &qvel),
        com: &whole.com,
        required: &required,
        fps: path.fps,
        timeline: &timeline,
    };
    let need = |wrench: &Wrench| wrench.force.z / (mass * GRAVITY);
    Carrying {
        by: carried.by(candidates, reach),
        need: required.iter().map(need).collect(),
    }
}

/// `[f][b]`: velocity of every body.
pub(super) fn twists(skeleton: &Skeleton, qpos: &[Vec<f64>], qvel: &[Vec<f64>]) -> Vec<Vec<Twist>> {
    let frames = qpos.iter().zip(qvel);
    frames.map(|(q, v)| skeleton.twists(q, v)).collect()
}

impl Carried<'_> {
    /// `[f][c]`: whether `candidates[c]` carries in frame `f`. Its points up to `reach[c]` above the ground can, metres.
    pub(crate) fn by(&self, candidates: &[usize], reach: &[f64]) -> Vec<Vec<bool>> {
        let leg = self.skeleton.leg_length().max(1e-3);
        let shares: Vec<Vec<f64>> = (0..self.bodies.len())
            .map(|f| self.shares(f, candidates, reach, leg))
            .collect();
        let mut carries = vec![vec![false; candidates.len()]; shares.len()];
        for c in 0..candidates.len() {
            let state = |row: &Vec<f64>| {
                let most = row.iter().copied().fold(0.0, f64::max);
                let part = (most / MOST).min(1.0);
                match row[c] {
                    _ if row.iter().sum::<f64>() < LEAST => State::Away,
                    share if share >= CARRIES[0] * part => State::Clear,
                    share if share >= CARRIES[1] * part => State::Fair,
                    _ => State::Away,
                }
            };
            let states: Vec<State> = shares.iter().map(state).collect();
            let track = settled(&states, self.fps, self.timeline.loop_mode);
            carries
                .iter_mut()
                .zip(track)
                .for_each(|(row, on)| row[c] = on);
        }
        carries
    }

    /// The share of the weight that each candidate carries in frame `f`.
    fn shares(&self, f: usize, candidates: &[usize], reach: &[f64], leg: f64) -> Vec<f64> {
        let weight = self.skeleton.total_mass() * GRAVITY;
        let (skeleton, poses) = (self.skeleton, &self.bodies[f]);
        let low = low_on_limb(skeleton, poses);
        let of = |(c, &body): (usize, &usize)| {
            if !low[body] {
                return Vec::new();
            }
            let rays = friction_rays(skeleton, poses, body, leg);
            let near = rays
                .into_iter()
                .filter(|ray| ray.point.z <= reach[c] && self.velocity(f, ray).z.abs() < PASSES);
            near.map(|ray| (c, ray)).collect::<Vec<_>>()
        };
        let rays: Vec<(usize, Load)> = candidates.iter().enumerate().flat_map(of).collect();
        let mut shares = vec![0.0; candidates.len()];
        if rays.is_empty() {
            return shares;
        }
        // Loads in shares of the weight, each divided by its cost: those of the cheapest explanation are then as even as can be.
        let costs: Vec<f64> = rays.iter().map(|(_, ray)| self.cost(f, ray, leg)).collect();
        let loads: Vec<Load> = rays.iter().map(|(_, ray)| *ray).collect();
        let (mut a, b) = wrench_equations(&loads, &self.required[f], &self.com[f], leg);
        for (mut column, cost) in a.column_iter_mut().zip(&costs) {
            column /= *cost;
        }
        let scaled: DVector<f64> = nnls::solve_evenly(&a, &(b / weight), COST);
        for (((c, ray), cost), load) in rays.iter().zip(&costs).zip(scaled.iter()) {
            shares[*c] += load / cost * ray.force.z;
        }
        shares
    }

    /// What a load on this point costs, as a multiple of that at rest on the ground.
    fn cost(&self, f: usize, ray: &Load, leg: f64) -> f64 {
        let height = ray.point.z.max(0.0) / (HEIGHT * leg);
        let speed = self.velocity(f, ray).norm() / SPEED;
        1.0 + height.powi(2) + speed.powi(2)
    }

    /// Velocity of the point of the body on which a load acts, m/s.
    fn velocity(&self, f: usize, ray: &Load) -> Vector3<f64> {
        let pose = &self.bodies[f][ray.body];
        self.twists[f][ray.body].at(pose, &ray.point).linear
    }
}

/// Whether each body may touch the ground as far as its neighbours tell: one that hangs on a body that is lower, or carries one,
/// is held up by that.
fn low_on_limb(skeleton: &Skeleton, poses: &[Isometry3<f64>]) -> Vec<bool> {
    let shaped = |b: usize| !skeleton.bodies[b].shapes.is_empty();
    let heights: Vec<f64> = (0..poses.len())
        .map(|b| skeleton.lowest_point_of(poses, &[b]))
        .collect();
    let mut low = vec![true; poses.len()];
    for (b, body) in skeleton.bodies.iter().enumerate() {
        let Some(parent) = body.parent.filter(|p| shaped(*p) && shaped(b)) else {
            continue;
        };
        let (higher, lower) = match heights[b] > heights[parent] {
            true => (b, parent),
            false => (parent, b),
        };
        low[higher] &= heights[higher] < heights[lower].max(0.0) + LOWER;
    }
    low
}

#[cfg(test)]
mod tests {
    use crate::clip::LoopMode;
    use crate::motion::{Cycle, Draft, Motion};
    use crate::skeleton::{GRAVITY, Skeleton};
    use nalgebra::{UnitQuaternion, Vector3};

    fn humanoid() -> Skeleton {
        Skeleton::load("humanoid").expect("the built-in humanoid is valid")
    }

    /// Frames at 60 Hz, over which the whole character slides at `speed`, m/s.
    fn motion(
        skeleton: &Skeleton,
        pose: &[f64],
        speed: Vector3<f64>,
        bodies: Vec<usize>,
    ) -> Motion {
        let at = |f: i32| {
            let mut qpos = pose.to_vec();
            (0..3).for_each(|i| qpos[i] += speed[i] * f64::from(f) / 60.0);
            qpos
        };
        let draft = Draft {
            name: "test".into(),
            fps: 60.0,
            loop_mode: LoopMode::Clamp,
            cycle: Cycle::NONE,
            qpos: (0..30).map(at).collect(),
            contact: Some(vec![vec![false; bodies.len()]; 30]),
            contact_bodies: bodies,
        };
        Motion::from_poses(skeleton, draft)
    }

    /// The rest pose on its back, on the ground.
    fn lying(skeleton: &Skeleton) -> Vec<f64> {
        let mut pose = skeleton.rest_qpos();
        let back = -std::f64::consts::FRAC_PI_2;
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), back);
        pose[3..7].copy_from_slice(&[turn.w, turn.i, turn.j, turn.k]);
        pose[2] -= skeleton.lowest_point(&skeleton.forward(&pose));
        pose
    }

    /// Names of the bodies in contact in the middle of a motion.
    fn touching(motion: &Motion) -> Vec<String> {
        let names = motion.contact_names().into_iter();
        let row = &motion.tracks.contact[15];
        names
            .zip(row)
            .filter(|(_, on)| **on)
            .map(|(n, _)| n)
            .collect()
    }

    #[test]
    fn feet_that_slide_carry() {
        let skeleton = humanoid();
        let (rest, all) = (skeleton.rest_qpos(), skeleton.contact_bodies());
        let sliding = motion(&skeleton, &rest, Vector3::x() * 0.8, all.clone());
        assert_eq!(touching(&sliding), ["right_foot", "left_foot"]);
        // What rises at 2 m/s leaves the ground.
        let rising = motion(&skeleton, &rest, Vector3::z() * 2.0, all);
        assert!(touching(&rising).is_empty());
    }

    #[test]
    fn whoever_lies_is_carried_by_what_lies_on_the_ground() {
        let skeleton = humanoid();
        let all = skeleton.contact_bodies();
        let still = motion(&skeleton, &lying(&skeleton), Vector3::zeros(), all);
        let touching = touching(&still);
        assert!(touching.contains(&"torso".to_owned()), "{touching:?}");
        let feet = touching.iter().any(|name| name.ends_with("foot"));
        assert!(!feet, "{touching:?}");
    }

    /// Motions of earlier versions had feet alone.
    #[test]
    fn an_older_motion_gets_the_contacts_of_its_character() {
        let skeleton = humanoid();
        let foot = |name: &str| skeleton.bodies.iter().position(|b| b.name == name);
        let feet: Vec<usize> = ["right_foot", "left_foot"]
            .into_iter()
            .filter_map(foot)
            .collect();
        let mut old = motion(&skeleton, &lying(&skeleton), Vector3::zeros(), feet);
        old.tracks.contact[15][1] = true;
        let new = old.clone().with_all_contacts(&skeleton);
        assert_eq!(new.contact_bodies, skeleton.contact_bodies());
        let touching = touching(&new);
        for name in ["torso", "left_foot"] {
            assert!(touching.contains(&name.to_owned()), "{touching:?}");
        }
        assert_eq!(new.clone().with_all_contacts(&skeleton), new);
        let weight = skeleton.total_mass() * GRAVITY;
        let force = |motion: &Motion| {
            motion.tracks.root_wrench_residual[15]
                .fixed_rows::<3>(0)
                .norm()
        };
        assert!(force(&new) < 0.1 * weight, "{} of {weight} N", force(&new));
    }
}
