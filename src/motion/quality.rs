//! How fit a motion is for physics: measures of the motion, each checked against a limit.

use super::check::{
    AGREEMENT, BALLISTIC, Check, FLOAT, KEY_POINTS, LIMITS, PENETRATION, RESIDUAL, SKATE, SLIDE,
    SMOOTHNESS, TORQUE,
};
use super::skate::sole_speed;
use super::{Motion, wrench};
use crate::skeleton::{GRAVITY, JointKind, Skeleton, limits};
use nalgebra::Vector3;

/// Height of the lowest point above the ground from which on a character counts as flying, leg lengths. Chosen: 2.4 cm with
/// legs of 0.8 m, more than twice what standing feet may float.
const OFF_GROUND: f64 = 0.03;
/// Frames on each side of a frame with which an acceleration is compared. Chosen: a median of fourteen
/// accelerations hardly changes with the three that another bad frame spoils.
const AROUND: i64 = 8;
/// Accelerations below this don't count as rough, however still the frames around are, m/s². Chosen: twice gravity.
const CALM: f64 = 20.0;
/// Time at either end of a stance in which the foot may still move, s. Chosen: while a heel
/// comes down or toes leave the ground, the rest of the foot moves.
const EDGE: f64 = 0.05;

impl Motion {
    /// All checks that can be made of the motion. Those against the source need the report of retargeting, and those of
    /// stances and flights need a stance or a flight; they are left out where there is none.
    ///
    /// # Panics
    /// If the motion was made for another skeleton (see [`Motion::check_skeleton`]).
    pub fn quality(&self, skeleton: &Skeleton) -> Vec<Check> {
        let report = self.report.as_ref();
        let keypoints = report.map(|report| report.keypoint_error_m.mean);
        let disagreement = report.and_then(|report| report.contact_disagreement);
        let frames = || 0..self.qpos.len();
        let depth = |f: usize| -skeleton.lowest_point(&self.bodies[f]);
        let outside = |f: usize| limits::violations(skeleton, &self.qpos[f]) as f64;
        let speeds = self.contact_speeds(skeleton);
        let weight = skeleton.total_mass() * GRAVITY;
        let missing: Vec<f64> = self.tracks.unsupported_force().collect();
        let checks = [
            keypoints.map(|error| KEY_POINTS.check(error, None)),
            disagreement.map(|share| AGREEMENT.check(share, None)),
            SKATE.mean(speeds.iter().flat_map(|track| mid_stance(track, self.fps))),
            SLIDE.greatest(slides(&speeds, self.fps)),
            PENETRATION.greatest(frames().map(|f| (f, depth(f).max(0.0)))),
            FLOAT.mean(self.standing_heights(skeleton)),
            Some(LIMITS.check(
                frames().map(outside).sum(),
                frames().find(|f| outside(*f) > 0.0),
            )),
            SMOOTHNESS.greatest(self.relative_accelerations()),
            RESIDUAL.mean(missing.iter().map(|force| force / weight)),
            BALLISTIC.mean(self.flights(skeleton).map(|f| missing[f] / weight)),
            self.torque_check(skeleton),
        ];
        checks.into_iter().flatten().collect()
    }

    /// Whether contact body `contact` stands in frame `f`.
    fn stands(&self, f: usize, contact: usize) -> bool {
        let row = self.tracks.contact.get(f);
        row.and_then(|row| row.get(contact)) == Some(&true)
    }

    /// `[end][f]`: how fast each foot and hand among the contact bodies slides over the ground, m/s; `None` where it doesn't stand.
    fn contact_speeds(&self, skeleton: &Skeleton) -> Vec<Vec<Option<f64>>> {
        let frames = 0..self.qpos.len();
        let twists: Vec<_> = frames
            .clone()
            .map(|f| skeleton.twists(&self.qpos[f], &self.qvel[f]))
            .collect();
        let ends = skeleton.hands_and_feet();
        let contacts = self.contact_bodies.iter().enumerate();
        let contacts = contacts.filter(|(_, body)| ends[**body]);
        let of = |(c, &body): (usize, &usize)| {
            let shapes = &skeleton.bodies[body].shapes;
            let speed = |f: usize| sole_speed(shapes, &self.bodies[f][body], &twists[f][body]);
            let frames = frames.clone();
            frames
                .map(|f| self.stands(f, c).then(|| speed(f)))
                .collect()
        };
        contacts.map(of).collect()
    }

    /// Heights above the ground of all contact bodies in all frames in which they stand, metres.
    fn standing_heights(&self, skeleton: &Skeleton) -> impl Iterator<Item = f64> {
        let pairs = (0..self.qpos.len())
            .flat_map(|f| (0..self.contact_bodies.len()).map(move |c| (f, c)))
            .filter(|(f, c)| self.stands(*f, *c));
        pairs.map(|(f, c)| {
            let body = self.contact_bodies[c];
            skeleton.lowest_point_of(&self.bodies[f], &[body]).max(0.0)
        })
    }

    /// The frames in the midst of flights: nothing is near the ground in them or around them.
    ///
    /// Around means within the window in which accelerations were fitted, for near a takeoff or a landing that window holds
    /// a part of the stance, and the residual of the frame would be that of both.
    fn flights(&self, skeleton: &Skeleton) -> impl Iterator<Item = usize> {
        let clear = OFF_GROUND * skeleton.leg_length();
        let high = |f: usize| {
            let stands = self.tracks.contact[f].contains(&true);
            !stands && skeleton.lowest_point(&self.bodies[f]) > clear
        };
        let high: Vec<bool> = (0..self.qpos.len()).map(high).collect();
        let timeline = self.timeline();
        let reach = wrench::reach(self.fps);
        // A motion without contact bodies is one without a ground.
        let has_ground = !self.contact_bodies.is_empty();
        (0..self.qpos.len()).filter(move |f| {
            let mut near = timeline.window(*f, reach);
            has_ground && near.all(|i| timeline.locate(i).is_none_or(|(_, at)| high[at]))
        })
    }

    /// By frame: the acceleration of the body that stands out most from the frames around, relative to the median there.
    ///
    /// A jump in the data shows in one or two frames, while a quick movement is quick in the frames around as well.
    fn relative_accelerations(&self) -> impl Iterator<Item = (usize, f64)> {
        let timeline = self.timeline();
        let place = move |index: i64, body: usize| {
            let (n, at) = timeline.locate(index)?;
            let at = self.bodies[at][body].translation.vector;
            Some((timeline.cycle.offset(n) * nalgebra::Point3::from(at)).coords)
        };
        let rate = self.fps * self.fps;
        let acceleration = move |f: i64, body: usize| -> Option<f64> {
            let [a, b, c]: [Vector3<f64>; 3] =
                [place(f - 1, body)?, place(f, body)?, place(f + 1, body)?];
            Some((a - b * 2.0 + c).norm() * rate)
        };
        // The frame's neighbours are left out: a jump shows in their accelerations too.
        let around = move |f: i64, body: usize| {
            let near = (-AROUND..=AROUND).filter(|d| d.abs() > 1);
            let mut near: Vec<f64> = near.filter_map(|d| acceleration(f + d, body)).collect();
            near.sort_by(f64::total_cmp);
            near.get(near.len() / 2).copied().unwrap_or(f64::INFINITY)
        };
        let bodies = self.body_names.len();
        (0..self.qpos.len()).map(move |f| {
            let at = f as i64;
            let ratio = |body| Some(acceleration(at, body)? / (around(at, body) + CALM));
            let ratios = (0..bodies).filter_map(ratio);
            (f, ratios.fold(0.0, f64::max))
        })
    }

    /// How near the drives come to their limits; `None` for a skeleton whose drives have none.
    ///
    /// The worst hundredth of the frames is passed over: torques follow from second derivatives, and single frames say
    /// little.
    fn torque_check(&self, skeleton: &Skeleton) -> Option<Check> {
        let joints = skeleton.bodies.iter().flat_map(|body| &body.joints);
        let drives = joints
            .filter(|joint| joint.kind != JointKind::Free)
            .flat_map(|joint| {
                joint
                    .drives
                    .iter()
                    .enumerate()
                    .map(|(i, d)| (joint.dof + i, d))
            })
            .filter(|(_, drive)| drive.force_limit.is_finite() && drive.force_limit > 0.0);
        let limits: Vec<(usize, f64)> = drives.map(|(dof, d)| (dof, d.force_limit)).collect();
        let of = |torques: &Vec<f64>| {
            let ratios = limits
                .iter()
                .map(|(dof, limit)| torques[*dof].abs() / limit);
            ratios.fold(0.0, f64::max)
        };
        let torques = self.joint_torques(skeleton);
        let mut ratios: Vec<(usize, f64)> = torques.iter().map(of).enumerate().collect();
        ratios.sort_by(|a, b| a.1.total_cmp(&b.1));
        let at = (ratios.len() * 99).div_ceil(100).saturating_sub(1);
        let (frame, value) = ratios.get(at).filter(|_| !limits.is_empty())?;
        Some(TORQUE.check(*value, Some(*frame)))
    }
}

/// The speeds in those frames of `track` around which the stance goes on for [`EDGE`], m/s.
fn mid_stance(track: &[Option<f64>], fps: f64) -> impl Iterator<Item = f64> + '_ {
    let edge = (EDGE * fps).round() as usize;
    let inside = move |f: usize| {
        let near = f.saturating_sub(edge)..(f + edge + 1).min(track.len());
        track[near].iter().all(Option::is_some)
    };
    let frames = (0..track.len()).filter(move |f| inside(*f));
    frames.filter_map(|f| track[f])
}

/// How far each contact body slides in each stance, metres, with the frame in which the stance ends.
fn slides(speeds: &[Vec<Option<f64>>], fps: f64) -> impl Iterator<Item = (usize, f64)> {
    let mut slides = Vec::new();
    for track in speeds {
        let mut length = 0.0;
        for (f, speed) in track.iter().enumerate() {
            length = speed.map_or(0.0, |speed| length + speed / fps);
            let ends = track.get(f + 1).is_none_or(Option::is_none);
            if speed.is_some() && ends {
                slides.push((f, length));
            }
        }
    }
    slides.into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slide_is_as_long_as_the_path_of_one_stance() {
        let speeds = [vec![Some(1.0), Some(2.0), None, Some(4.0)], vec![None; 4]];
        let found: Vec<_> = slides(&speeds, 2.0).collect();
        assert_eq!(found, [(1, 1.5), (3, 2.0)]);
    }

    #[test]
    fn a_foot_may_move_when_a_stance_begins_and_ends() {
        let track = [1.0, 2.0, 3.0, f64::NAN, 4.0, 5.0, 6.0, 7.0];
        let track = track.map(|v| Some(v).filter(|v: &f64| !v.is_nan()));
        assert_eq!(
            mid_stance(&track, 20.0).collect::<Vec<_>>(),
            [1.0, 2.0, 5.0, 6.0, 7.0]
        );
    }
}
