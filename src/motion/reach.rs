//! From which frames a motion is beyond reach.
//!
//! Where no ground could give the motion its force and moment (see [`wrench`](super::wrench)), a body that starts in its
//! state lacks the momentum that the motion gains from nowhere, however it moves. Little of that can be made up for.

use super::Motion;
use crate::clip::LoopMode;
use crate::skeleton::{GRAVITY, Skeleton};
use nalgebra::Vector3;

/// Time that is looked ahead, s. Chosen: a step is taken in about twice that, and corrects what came before.
const AHEAD: f64 = 0.2;
/// Most speed that may be lacking after that time, of the centre of mass as of a turn at a leg's length, in units of √(g l)
/// with l the length of the leg: 0.7 m/s for a leg of 0.9 m. Chosen (`docs/notebook/starts.md`).
const LACKING: f64 = 0.24;

impl Motion {
    /// Spans of time from which the motion asks for more than the ground can give, seconds from the first frame, in order.
    ///
    /// A frame belongs to them if the residual force of the next 0.2 s adds up to more than m v, or the residual moment about
    /// the centre of mass to more than m l v, with m the mass, l the length of a leg and v = 0.24 √(g l).
    pub fn beyond_reach(&self, skeleton: &Skeleton) -> Vec<[f64; 2]> {
        let leg = skeleton.leg_length();
        let most = LACKING * (GRAVITY * leg).sqrt() * skeleton.total_mass();
        let lacking = self.lacking();
        let is_beyond = |[linear, angular]: &[f64; 2]| *linear > most || *angular > most * leg;
        let mut spans: Vec<[f64; 2]> = Vec::new();
        // A frame stands for half a frame's time on either side.
        let half = 0.5 / self.fps;
        let frames = lacking.iter().enumerate();
        for (f, _) in frames.filter(|(_, lacking)| is_beyond(lacking)) {
            let time = f as f64 / self.fps;
            let (from, to) = ((time - half).max(0.0), (time + half).min(self.duration()));
            match spans.last_mut() {
                Some(last) if last[1] >= from - half => last[1] = to,
                _ => spans.push([from, to]),
            }
        }
        spans
    }

    /// Linear momentum (N·s) and angular momentum about the centre of mass (N·m·s) that the motion gains from nowhere within
    /// [`AHEAD`] of every frame.
    fn lacking(&self) -> Vec<[f64; 2]> {
        let residual = self.residual_about_com();
        let ahead = ((AHEAD * self.fps).round() as usize).max(1);
        let from = |f: usize| {
            // A motion that ends asks for nothing after its end.
            let frames = (f..f + ahead).map_while(|index| self.residual_at(&residual, index));
            let sum = frames.fold([Vector3::zeros(); 2], |[force, moment], [f, m]| {
                [force + f, moment + m]
            });
            sum.map(|sum| sum.norm() / self.fps)
        };
        (0..residual.len()).map(from).collect()
    }

    /// The residual at a frame, of a later cycle where the index is past the end of one that repeats.
    fn residual_at(
        &self,
        residual: &[[Vector3<f64>; 2]],
        index: usize,
    ) -> Option<[Vector3<f64>; 2]> {
        match self.loop_mode {
            LoopMode::Clamp => residual.get(index).copied(),
            LoopMode::Wrap => {
                // The last frame is the first of the next cycle.
                let cycle = residual.len().saturating_sub(1).max(1);
                let turn = self.cycle_offset((index / cycle) as i64).rotation;
                Some(residual[index % cycle].map(|v| turn * v))
            }
        }
    }

    /// Residual force (N) and moment about the centre of mass (N·m) of every frame, world axes.
    fn residual_about_com(&self) -> Vec<[Vector3<f64>; 2]> {
        let wrenches = self.tracks.root_wrench_residual.iter();
        let frames = wrenches.zip(&self.tracks.com).zip(&self.bodies);
        let about_com = frames.map(|((wrench, com), bodies)| {
            let force = wrench.fixed_rows::<3>(0).into_owned();
            let arm = bodies[0].translation.vector - com;
            [force, wrench.fixed_rows::<3>(3) + arm.cross(&force)]
        });
        about_com.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{draft, humanoid};
    use super::*;
    use nalgebra::{Unit, UnitQuaternion};

    /// A body that stands and is dragged over the ground at 30 m/s² for a tenth of a second: 3 m/s that no ground gives. What leads to
    /// it is beyond reach, what follows isn't.
    #[test]
    fn who_is_dragged_cannot_be_followed() {
        let s = humanoid();
        let mut qpos = vec![s.rest_qpos(); 121];
        for (f, q) in qpos.iter_mut().enumerate() {
            let t = (f as f64 / 60.0 - 1.0).clamp(0.0, 0.1);
            let after = (f as f64 / 60.0 - 1.1).max(0.0);
            q[0] += 15.0 * t * t + 3.0 * after;
        }
        let motion = Motion::from_poses(&s, draft(&s, qpos, 60.0));
        let spans = motion.beyond_reach(&s);
        let [[from, to]] = spans[..] else {
            panic!("{spans:?}");
        };
        assert!(
            (0.75..0.9).contains(&from) && (1.0..1.15).contains(&to),
            "{spans:?}"
        );

        let still = vec![s.rest_qpos(); 121];
        let motion = Motion::from_poses(&s, draft(&s, still, 60.0));
        assert!(motion.beyond_reach(&s).is_empty());
    }

    /// A body that falls freely and turns about `axis` at 4 rad/s, then, from half a second on, at 12.
    fn faster(axis: Unit<Vector3<f64>>) -> Vec<[f64; 2]> {
        let s = humanoid();
        let mut qpos = vec![s.rest_qpos(); 60];
        for (f, q) in qpos.iter_mut().enumerate() {
            let t = f as f64 / 60.0;
            q[2] += 5.0 + 3.0 * t - 0.5 * GRAVITY * t * t;
            let angle = 4.0 * t + 8.0 * (t - 0.5).max(0.0);
            let turn = UnitQuaternion::from_axis_angle(&axis, angle);
            q[3..7].copy_from_slice(&[turn.w, turn.i, turn.j, turn.k]);
        }
        Motion::from_poses(&s, draft(&s, qpos, 60.0)).beyond_reach(&s)
    }

    /// Nothing in the air gives a somersault more spin. About the long axis the same takes little momentum.
    #[test]
    fn a_spin_that_changes_in_the_air_cannot_be_followed() {
        let twist = faster(Vector3::z_axis());
        assert!(twist.is_empty(), "{twist:?}");
        let [[from, to]] = faster(Vector3::y_axis())[..] else {
            panic!("one span is expected");
        };
        assert!((0.25..0.4).contains(&from) && (0.45..0.6).contains(&to));
    }
}
