//! How fit a motion is for physics: checks with a stable id, a limit, and what to do beyond it.

use super::skate::sole_speed;
use super::{Motion, wrench};
use crate::clip::Severity;
use crate::skeleton::{GRAVITY, JointKind, Skeleton, limits};
use nalgebra::Vector3;
use serde::Serialize;

/// One measure of a motion against its limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// Never changes its meaning.
    pub id: &'static str,
    /// What is measured.
    pub name: &'static str,
    pub value: f64,
    pub unit: &'static str,
    /// Largest value that is good.
    pub limit: f64,
    pub passed: bool,
    /// How much it matters when it isn't passed.
    pub severity: Severity,
    /// Frame in which the value is greatest, where it is that of a frame.
    pub frame: Option<usize>,
    /// What to do when it isn't passed.
    pub advice: &'static str,
}

/// What a check is, apart from its value.
struct Kind {
    id: &'static str,
    name: &'static str,
    unit: &'static str,
    limit: f64,
    severity: Severity,
    advice: &'static str,
}

const KEY_POINTS: Kind = Kind {
    id: "keypoint-error",
    name: "distance from the source's joints, mean",
    unit: "m",
    limit: 0.05,
    severity: Severity::Warning,
    advice: "look at the joint map (mimic info), and give another with --map if a joint is wrong",
};
const AGREEMENT: Kind = Kind {
    id: "contact-disagreement",
    name: "contacts of feet and hands that differ from the source's, share",
    unit: "",
    limit: 0.1,
    severity: Severity::Warning,
    advice: "the source floats or sinks: check its ground, --up and --unit",
};
const SKATE: Kind = Kind {
    id: "foot-skate",
    name: "speed of feet and hands in the midst of their stances, mean",
    unit: "m/s",
    limit: 0.05,
    severity: Severity::Warning,
    advice: "the source's own feet may slide: look at it, or cut the part with --trim",
};
const SLIDE: Kind = Kind {
    id: "stance-slide",
    name: "way that a foot or hand slides in a stance, most",
    unit: "m",
    limit: 0.1,
    severity: Severity::Note,
    advice: "a stance this long may be a pivot or a slide that is meant; if not, cut it with --trim",
};
const PENETRATION: Kind = Kind {
    id: "penetration",
    name: "depth below the ground, most",
    unit: "m",
    limit: 0.01,
    severity: Severity::Warning,
    advice: "check the ground of the clip; physics starts episodes there with a push",
};
const FLOAT: Kind = Kind {
    id: "float",
    name: "height of standing feet and hands, mean",
    unit: "m",
    limit: 0.01,
    severity: Severity::Warning,
    advice: "check the ground of the clip; a policy can't press on what it doesn't touch",
};
const LIMITS: Kind = Kind {
    id: "joint-limits",
    name: "coordinates outside of their range",
    unit: "",
    limit: 0.0,
    severity: Severity::Error,
    advice: "retarget the clip anew, or widen the range in the skeleton",
};
const SMOOTHNESS: Kind = Kind {
    id: "smoothness",
    name: "acceleration of a body beside that of the frames around, most",
    unit: "times",
    limit: 8.0,
    severity: Severity::Warning,
    advice: "the source jumps there: look at it, and cut the jump with --trim",
};
const RESIDUAL: Kind = Kind {
    id: "root-residual",
    name: "force that nothing supplies, mean share of the weight",
    unit: "",
    limit: 0.25,
    severity: Severity::Warning,
    advice: "the motion needs a hand from nowhere: expect the policy to differ there",
};
const BALLISTIC: Kind = Kind {
    id: "ballistic",
    name: "the same while nothing touches the ground",
    unit: "",
    limit: 0.5,
    severity: Severity::Warning,
    advice: "the flight is no free fall: check --unit; if the source was slowed down, `mimic edit --speed` gives it its own time",
};
const TORQUE: Kind = Kind {
    id: "joint-torque",
    name: "torque beside what the drive can give, in the worst hundredth of the frames",
    unit: "times",
    limit: 1.0,
    severity: Severity::Note,
    advice: "the skeleton is weaker than the performer: raise forcerange in its MJCF, or expect softer motion",
};

impl Kind {
    fn check(&self, value: f64, frame: Option<usize>) -> Check {
        Check {
            id: self.id,
            name: self.name,
            value,
            unit: self.unit,
            limit: self.limit,
            passed: value <= self.limit,
            severity: self.severity,
            frame,
            advice: self.advice,
        }
    }

    fn mean(&self, values: impl Iterator<Item = f64>) -> Option<Check> {
        let values: Vec<f64> = values.collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (!values.is_empty()).then(|| self.check(mean, None))
    }

    /// Of values by frame.
    fn most(&self, values: impl Iterator<Item = (usize, f64)>) -> Option<Check> {
        let (frame, value) = values.max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(self.check(value, Some(frame)))
    }
}

impl Motion {
    /// All checks that can be made: those against the source only of a motion that was retargeted, those of stances and
    /// flights only where there are any.
    ///
    /// # Panics
    /// If the motion is not one of `skeleton`'s (see [`Motion::check_skeleton`]).
    pub fn quality(&self, skeleton: &Skeleton) -> Vec<Check> {
        let report = self.report.as_ref();
        let keypoints = report.map(|report| report.keypoint_error_m.mean);
        let disagreement = report.and_then(|report| report.contact_disagreement);
        let frames = || 0..self.qpos.len();
        let depth = |f: usize| -skeleton.lowest_point(&self.bodies[f]);
        let outside = |f: usize| limits::violations(skeleton, &self.qpos[f]) as f64;
        let speeds = self.sole_speeds(skeleton);
        let weight = skeleton.total_mass() * GRAVITY;
        let missing: Vec<f64> = self.tracks.unsupported_force().collect();
        let clear = OFF_GROUND * skeleton.leg_length();
        let high = |f: usize| {
            let stands = self.tracks.contact[f].contains(&true);
            !stands && skeleton.lowest_point(&self.bodies[f]) > clear
        };
        let high: Vec<bool> = frames().map(high).collect();
        let flights = frames().filter(|f| self.is_flight(&high, *f));
        let checks = [
            keypoints.map(|error| KEY_POINTS.check(error, None)),
            disagreement.map(|share| AGREEMENT.check(share, None)),
            SKATE.mean(speeds.iter().flat_map(|track| midst(track, self.fps))),
            SLIDE.most(slides(&speeds, self.fps)),
            PENETRATION.most(frames().map(|f| (f, depth(f).max(0.0)))),
            FLOAT.mean(self.heights(skeleton)),
            Some(LIMITS.check(
                frames().map(outside).sum(),
                frames().find(|f| outside(*f) > 0.0),
            )),
            SMOOTHNESS.most(self.roughness()),
            RESIDUAL.mean(missing.iter().map(|force| force / weight)),
            BALLISTIC.mean(flights.map(|f| missing[f] / weight)),
            self.strain(skeleton),
        ];
        checks.into_iter().flatten().collect()
    }

    fn stands(&self, f: usize, contact: usize) -> bool {
        let row = self.tracks.contact.get(f);
        row.and_then(|row| row.get(contact)) == Some(&true)
    }

    /// `[contact][f]`: how fast it slides where it stands, m/s.
    fn sole_speeds(&self, skeleton: &Skeleton) -> Vec<Vec<Option<f64>>> {
        let frames = 0..self.qpos.len();
        let twists: Vec<_> = frames
            .clone()
            .map(|f| skeleton.twists(&self.qpos[f], &self.qvel[f]))
            .collect();
        let contacts = self.contact_bodies.iter().enumerate();
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

    fn heights(&self, skeleton: &Skeleton) -> impl Iterator<Item = f64> {
        let pairs = (0..self.qpos.len())
            .flat_map(|f| (0..self.contact_bodies.len()).map(move |c| (f, c)))
            .filter(|(f, c)| self.stands(*f, *c));
        pairs.map(|(f, c)| {
            let body = self.contact_bodies[c];
            skeleton.lowest_point_of(&self.bodies[f], &[body]).max(0.0)
        })
    }

    /// Whether nothing is near the ground around frame `f`, told in which frames nothing is.
    fn is_flight(&self, high: &[bool], f: usize) -> bool {
        let timeline = self.timeline();
        let near = timeline.window(f, wrench::reach(self.fps));
        !self.contact_bodies.is_empty()
            && near
                .filter_map(|i| timeline.locate(i))
                .all(|(_, at)| high[at])
    }

    /// By frame: the acceleration of the body that stands out most from how it moves in the frames around.
    fn roughness(&self) -> impl Iterator<Item = (usize, f64)> {
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

    /// How near the drives come to their limits.
    fn strain(&self, skeleton: &Skeleton) -> Option<Check> {
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
        let mut strains: Vec<(usize, f64)> = torques.iter().map(of).enumerate().collect();
        strains.sort_by(|a, b| a.1.total_cmp(&b.1));
        let at = (strains.len() * 99).div_ceil(100).saturating_sub(1);
        let (frame, value) = strains.get(at).filter(|_| !limits.is_empty())?;
        Some(TORQUE.check(*value, Some(*frame)))
    }
}

/// Height of the lowest point from which on a body flies, leg lengths.
const OFF_GROUND: f64 = 0.03;
/// Frames on each side that say how a body moves.
const AROUND: i64 = 8;
/// Accelerations below this are calm whatever is around them, m/s².
const CALM: f64 = 20.0;

/// Time in which a stance begins or ends, s.
const EDGE: f64 = 0.05;

/// Speeds in frames around which the stance goes on.
fn midst(track: &[Option<f64>], fps: f64) -> impl Iterator<Item = f64> + '_ {
    let edge = (EDGE * fps).round() as usize;
    let inside = move |f: usize| {
        let near = f.saturating_sub(edge)..(f + edge + 1).min(track.len());
        track[near].iter().all(Option::is_some)
    };
    let frames = (0..track.len()).filter(move |f| inside(*f));
    frames.filter_map(|f| track[f])
}

/// Way of every stance, with the frame in which it ends.
fn slides(speeds: &[Vec<Option<f64>>], fps: f64) -> impl Iterator<Item = (usize, f64)> {
    let mut slides = Vec::new();
    for track in speeds {
        let mut way = 0.0;
        for (f, speed) in track.iter().enumerate() {
            way = speed.map_or(0.0, |speed| way + speed / fps);
            let ends = track.get(f + 1).is_none_or(Option::is_none);
            if speed.is_some() && ends {
                slides.push((f, way));
            }
        }
    }
    slides.into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slide_is_the_way_of_one_stance() {
        let speeds = [vec![Some(1.0), Some(2.0), None, Some(4.0)], vec![None; 4]];
        let found: Vec<_> = slides(&speeds, 2.0).collect();
        assert_eq!(found, [(1, 1.5), (3, 2.0)]);
    }

    #[test]
    fn a_stance_begins_and_ends_on_the_move() {
        let track = [1.0, 2.0, 3.0, f64::NAN, 4.0, 5.0, 6.0, 7.0];
        let track = track.map(|v| Some(v).filter(|v: &f64| !v.is_nan()));
        assert_eq!(
            midst(&track, 20.0).collect::<Vec<_>>(),
            [1.0, 2.0, 5.0, 6.0, 7.0]
        );
    }
}
