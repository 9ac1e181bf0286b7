//! Gaits as poses over a phase that is the same for all: the left foot comes down at phase 0, the right one at a half.

use super::mirror::Mirror;
use super::pose::{Mix, Pose};
use super::role::{facing, foot_contact, mean_place, travel};
use crate::humanoid::Slot;
use crate::motion::Motion;
use crate::task::model::CharacterModel;
use nalgebra::{Isometry3, Translation3, Vector2};

/// Poses of a cycle. Chosen: 60 a second in a cycle of a second, as many as most clips have.
const POSES: usize = 64;

/// A motion that travels, cut to poses at even phases.
#[derive(Clone, Debug)]
pub(super) struct Gait {
    /// Name of the motion.
    pub name: String,
    /// Mean velocity in the frame that travels and faces along X with it, m/s.
    pub velocity: Vector2<f32>,
    /// Seconds of a cycle.
    pub period: f32,
    /// Share of the cycle in which each foot stands, from the moment when it comes down; left, right.
    pub stance: [f32; 2],
    /// In the frame that travels with the gait.
    poses: Vec<Pose>,
}

impl Gait {
    /// A motion that repeats; `None` if a foot never comes down or never leaves the ground.
    pub fn new(motion: &Motion, model: &CharacterModel) -> Option<Gait> {
        let steps = Steps::of(motion, model)?;
        let travel = travel(motion);
        let facing = facing(motion, &model.skeleton);
        let start = mean_place(motion, &travel);
        let duration = motion.duration();
        let pose = |k: usize| {
            let phase = k as f64 / POSES as f64;
            let time = steps.time(phase);
            // The frame travels evenly over the phase, so that it does when the phase goes on evenly.
            let along = steps.strikes[0] + phase * duration;
            let at = start.coords + (travel * along).push(0.0);
            let frame = Isometry3::from_parts(Translation3::from(at), facing).cast::<f32>();
            let qpos = motion.sample_qpos(&model.skeleton, time);
            let still = vec![0.0; model.skeleton.nv];
            let links = model.character.states(&model.skeleton, &qpos, &still);
            Pose::of(&model.character, &links, &frame)
        };
        Some(Gait {
            name: motion.name.clone(),
            velocity: (facing.inverse() * travel.push(0.0)).xy().cast(),
            period: duration as f32,
            stance: steps.stance.map(|share| share as f32),
            poses: (0..POSES).map(pose).collect(),
        })
    }

    /// The gait to the other side.
    pub fn mirrored(&self, mirror: &Mirror) -> Gait {
        let [left, right] = self.stance;
        // The left foot comes down where the right one did: half a cycle later.
        let pose = |k: usize| mirror.pose(&self.poses[(k + POSES / 2) % POSES]);
        Gait {
            name: format!("{} (mirrored)", self.name),
            velocity: Vector2::new(self.velocity.x, -self.velocity.y),
            period: self.period,
            stance: [right, left],
            poses: (0..POSES).map(pose).collect(),
        }
    }

    /// The gait in reverse: it goes the other way, and each foot comes down where it left.
    pub fn reversed(&self) -> Gait {
        let lifts = (self.stance[0] * POSES as f32).round() as usize;
        let pose = |k: usize| self.poses[(lifts + POSES - k) % POSES].clone();
        Gait {
            name: format!("{} (reversed)", self.name),
            velocity: -self.velocity,
            period: self.period,
            stance: self.stance,
            poses: (0..POSES).map(pose).collect(),
        }
    }

    /// Speed, m/s.
    pub fn speed(&self) -> f32 {
        self.velocity.norm()
    }

    /// Adds the pose at a phase to a mean.
    pub fn add(&self, phase: f32, weight: f32, mix: &mut Mix) {
        let at = phase.rem_euclid(1.0) * POSES as f32;
        let (k, blend) = (at as usize, at.fract());
        mix.add(&self.poses[k % POSES], weight * (1.0 - blend));
        mix.add(&self.poses[(k + 1) % POSES], weight * blend);
    }
}

/// When the feet of a gait come down and leave, seconds and shares of the cycle.
struct Steps {
    /// When each foot comes down: the left one in the first cycle, the right one after it.
    strikes: [f64; 2],
    stance: [f64; 2],
    duration: f64,
}

impl Steps {
    fn of(motion: &Motion, model: &CharacterModel) -> Option<Steps> {
        let duration = motion.duration();
        let stance = |slot| {
            let flags = foot_contact(motion, &model.skeleton, slot);
            // The last frame is the first of the next cycle.
            longest_run(&flags[..flags.len().checked_sub(1)?])
        };
        let (left, right) = (stance(Slot::LeftFoot)?, stance(Slot::RightFoot)?);
        let time = |frame: usize| frame as f64 / motion.fps;
        let strike = time(left.from);
        let after = (time(right.from) - strike).rem_euclid(duration);
        let frames = (motion.qpos.len() - 1) as f64;
        Some(Steps {
            strikes: [strike, strike + after],
            stance: [left.length, right.length].map(|n| n as f64 / frames),
            duration,
        })
    }

    /// The time of a phase, seconds; even between one foot's coming down and the other's.
    fn time(&self, phase: f64) -> f64 {
        let [left, right] = self.strikes;
        match phase {
            p if p < 0.5 => left + 2.0 * p * (right - left),
            p => right + (2.0 * p - 1.0) * (left + self.duration - right),
        }
    }
}

/// Frames in a row, going on over the end.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Run {
    from: usize,
    length: usize,
}

/// The longest run of flagged frames of a cycle; `None` if all are flagged or none is.
fn longest_run(flags: &[bool]) -> Option<Run> {
    let count = flags.len();
    let begins = |f: &usize| flags[*f] && !flags[(f + count - 1) % count];
    let run = |from: usize| Run {
        from,
        length: (0..count).take_while(|k| flags[(from + k) % count]).count(),
    };
    let runs = (0..count).filter(begins).map(run);
    runs.max_by_key(|run| run.length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_run_may_go_over_the_end() {
        let flags = |text: &str| -> Vec<bool> { text.chars().map(|c| c == '#').collect() };
        let run = |text: &str| longest_run(&flags(text)).map(|run| (run.from, run.length));
        assert_eq!(run("##..#..###"), Some((7, 5)));
        assert_eq!(run("...##.."), Some((3, 2)));
        assert_eq!(run("####"), None);
        assert_eq!(run("...."), None);
    }

    #[test]
    fn phases_are_even_from_foot_to_foot() {
        let steps = Steps {
            strikes: [0.1, 0.5],
            stance: [0.6, 0.6],
            duration: 1.0,
        };
        let times = [0.0, 0.25, 0.5, 0.75].map(|phase| steps.time(phase));
        for (time, expected) in times.into_iter().zip([0.1, 0.3, 0.5, 0.8]) {
            assert!((time - expected).abs() < 1e-12, "{time} {expected}");
        }
    }
}
