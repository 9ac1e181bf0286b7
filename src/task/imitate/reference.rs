//! The reference motion as link states, at any time.

use super::placement::{Placement, moved};
use super::touch::may_touch;
use crate::clip::LoopMode;
use crate::motion::{Cycle, Motion};
use crate::sim::LinkState;
use crate::task::dynamics::{Dynamics, Masses};
use crate::task::error::TaskError;
use crate::task::follow::anchor;
use crate::task::model::CharacterModel;
use crate::task::step::ReferenceState;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// Frames per second that the table of link states has at least. Between its frames they are blended link by link, which
/// shortens a limb that turns at ω by
/// 1 − cos(ω/2f): at 12 rad/s by 0.1 % in a table of 120 Hz, and by 7 % in one of a clip's own
/// 16 Hz.
const TABLE_HZ: f64 = 120.0;
/// Most frames of the table, each of some 4 kB. Chosen: 20 minutes at [`TABLE_HZ`], several times what can be evaluated.
const MOST_TABLE: f64 = 144_000.0;
/// The reference's velocities are means over this many seconds on either side, one control step: no drive can follow what
/// comes and goes faster, and in recordings it is mostly noise.
const AVERAGED_S: f64 = 1.0 / 30.0;
/// Frames per second that [`Reference::distance`] looks at. Chosen: it is asked at every step of a second.
const SEARCH_HZ: f64 = 30.0;

/// A motion ready to be imitated.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Name of the motion.
    pub name: String,
    /// Frames of the table per second.
    rate: f64,
    loop_mode: LoopMode,
    duration: f64,
    /// Link states, frame after frame.
    frames: Vec<Vec<LinkState>>,
    /// Anchor of the first cycle.
    start: Isometry3<f32>,
    contacts: Vec<Vec<bool>>,
    /// For every frame, one per [`CharacterModel::contacts`]: whether the agent may touch the ground with it.
    may_touch: Vec<Vec<bool>>,
    cycle: Cycle,
    /// For every frame, positions and velocities of its links as [`seen_from_root`] sees them.
    grounded: Vec<Vec<[Vector3<f32>; 2]>>,
    masses: Masses,
    /// As [`Motion::beyond_reach`] has them.
    pub beyond_reach: Vec<[f64; 2]>,
    /// Bodies that the motion puts on the ground.
    pub contact_bodies: Vec<usize>,
    /// Their numbers among [`CharacterModel::contacts`].
    pub contacts_of_motion: Vec<usize>,
}

impl Reference {
    /// A motion as states of the links of `model`.
    ///
    /// # Errors
    /// A motion of another skeleton, or of a single frame.
    pub fn new(motion: &Motion, model: &CharacterModel) -> Result<Self, TaskError> {
        let skeleton = &model.skeleton;
        motion.check_skeleton(skeleton)?;
        if motion.qpos.len() < 2 {
            return Err(TaskError::TooShort {
                frames: motion.qpos.len(),
            });
        }
        let finer = (TABLE_HZ / motion.fps).ceil().max(1.0);
        let rate = motion.fps * finer;
        let count = (motion.qpos.len() - 1) as f64 * finer + 1.0;
        if count.is_nan() || count > MOST_TABLE {
            return Err(TaskError::TooLong {
                motion: motion.name.clone(),
                seconds: motion.duration(),
                most: MOST_TABLE / rate,
            });
        }
        let count = count as usize;
        let duration = motion.duration();
        let times = || (0..count).map(|f| (f as f64 / rate).min(duration));
        let contact = |time| {
            let bodies = 0..motion.contact_bodies.len();
            bodies.map(|c| motion.sample_contact(c, time)).collect()
        };
        let frames: Vec<_> = times().map(|t| link_states(motion, model, t)).collect();
        Ok(Reference {
            name: motion.name.clone(),
            rate,
            loop_mode: motion.loop_mode,
            duration,
            start: anchor(&frames[0][0].pose),
            grounded: frames.iter().map(|links| seen_from_root(links)).collect(),
            may_touch: may_touch(model, &frames, rate, motion.loop_mode),
            frames,
            contacts: times().map(contact).collect(),
            cycle: motion.cycle,
            beyond_reach: motion.beyond_reach(skeleton),
            masses: Masses::new(&model.character),
            contact_bodies: motion.contact_bodies.clone(),
            contacts_of_motion: motion
                .contact_bodies
                .iter()
                .filter_map(|&b| model.contact(b))
                .collect(),
        })
    }

    /// Seconds of one cycle.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Latest start, seconds, that leaves at least two control steps of `control_dt` seconds.
    pub fn last_start(&self, control_dt: f64) -> f64 {
        match self.loop_mode {
            LoopMode::Wrap => self.duration,
            LoopMode::Clamp => (self.duration - 2.0 * control_dt).max(0.0),
        }
    }

    /// Whether a start at this share of all starts is beyond reach.
    pub fn is_beyond_reach(&self, share: f64, control_dt: f64) -> bool {
        let time = share * self.last_start(control_dt);
        let mut spans = self.beyond_reach.iter();
        spans.any(|[from, to]| (*from..*to).contains(&time))
    }

    /// Whether the motion repeats.
    pub fn loop_mode(&self) -> LoopMode {
        self.loop_mode
    }

    /// Whether the motion has ended at `time`, seconds. One that repeats never does.
    pub fn is_over(&self, time: f64) -> bool {
        self.loop_mode == LoopMode::Clamp && time >= self.duration - 1e-9
    }

    /// Whether a cycle of a motion that repeats began between these two times.
    pub fn begins_cycle(&self, span: [f64; 2]) -> bool {
        let [before, after] = span.map(|time| self.split(time).0);
        after > before
    }

    /// Largest angular momentum of all frames, kg·m²/s.
    pub fn largest_momentum(&self) -> f32 {
        let momentum = |links: &Vec<LinkState>| self.masses.dynamics(links).angular_momentum.norm();
        self.frames.iter().map(momentum).fold(0.0, f32::max)
    }

    pub(crate) fn masses(&self) -> &Masses {
        &self.masses
    }

    /// An empty sample to write into.
    pub fn blank(&self) -> ReferenceState {
        ReferenceState {
            links: self.frames[0].clone(),
            dynamics: Dynamics::default(),
            contacts: self.contacts[0].clone(),
            may_touch: self.may_touch[0].clone(),
            phase: 0.0,
            anchor: self.start,
        }
    }

    /// Writes the reference at `time` seconds into `sample`. A wrapping motion goes on cycle after cycle; an ending
    /// one holds its last frame.
    pub fn sample(&self, time: f64, sample: &mut ReferenceState) {
        self.sample_at(&Placement::own(), time, sample);
    }

    /// The same at another place.
    pub fn sample_at(&self, place: &Placement, time: f64, sample: &mut ReferenceState) {
        // A cycle that travels or turns begins where the one before it ended.
        let (cycle, within) = self.split(time);
        let at = within * self.rate;
        let last = self.frames.len() - 1;
        let frame = (at.floor() as usize).min(last - 1);
        let blend = (at - frame as f64).clamp(0.0, 1.0) as f32;
        let place = Placement {
            pose: place.pose * self.cycle.offset(cycle).cast::<f32>(),
            ..*place
        };
        for (link, (a, b)) in sample
            .links
            .iter_mut()
            .zip(self.frames[frame].iter().zip(&self.frames[frame + 1]))
        {
            *link = between(a, b, blend);
            place.put(link);
        }
        sample.dynamics = self.masses.dynamics(&sample.links);
        let nearest = if blend < 0.5 { frame } else { frame + 1 };
        sample.contacts.copy_from_slice(&self.contacts[nearest]);
        sample.may_touch.copy_from_slice(&self.may_touch[nearest]);
        sample.phase = (within / self.duration) as f32;
        sample.anchor = place.pose * self.start;
    }

    /// Seconds at which this motion is nearest to `sample` of another, whatever their places and headings: the sum over
    /// all links of the squared distances, and of the squared differences of velocity times 0.1 s. One that ends is
    /// entered in its first half.
    pub fn nearest(&self, sample: &ReferenceState) -> f64 {
        self.entry(sample, 1).0
    }

    /// How near this motion comes to `sample`: the least of the sums that [`Reference::nearest`] compares, m².
    pub fn distance(&self, sample: &ReferenceState) -> f32 {
        let step = (self.rate / SEARCH_HZ).ceil().max(1.0);
        self.entry(sample, step as usize).1
    }

    /// The best entry among every `step`th frame, seconds, and its distance, m².
    fn entry(&self, sample: &ReferenceState, step: usize) -> (f64, f32) {
        let wanted = seen_from_root(&sample.links);
        let distance = |links: &Vec<[Vector3<f32>; 2]>| -> f32 {
            // Positions alone would enter a swinging leg on its way back. 0.01 s²: a difference of 1 m/s counts as 0.1 m. Chosen.
            let apart = |(a, b): (&[Vector3<f32>; 2], &[Vector3<f32>; 2])| {
                (a[0] - b[0]).norm_squared() + 0.01 * (a[1] - b[1]).norm_squared()
            };
            links.iter().zip(&wanted).map(apart).sum()
        };
        let entries = match self.loop_mode {
            LoopMode::Wrap => self.frames.len(),
            LoopMode::Clamp => self.frames.len().div_ceil(2),
        };
        let frames = self.grounded[..entries].iter().enumerate().step_by(step);
        let distances = frames.map(|(frame, links)| (frame as f64 / self.rate, distance(links)));
        let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1));
        nearest.unwrap_or((0.0, f32::INFINITY))
    }

    /// Number of the cycle at `time`, and seconds since it began.
    fn split(&self, time: f64) -> (i64, f64) {
        match self.loop_mode {
            LoopMode::Clamp => (0, time.clamp(0.0, self.duration)),
            LoopMode::Wrap => {
                let cycle = (time / self.duration).floor().max(0.0);
                (
                    cycle as i64,
                    (time - cycle * self.duration).clamp(0.0, self.duration),
                )
            }
        }
    }
}

/// Position (m) and velocity (m/s) of each link, from the point on the ground below the root, in axes along its heading.
fn seen_from_root(links: &[LinkState]) -> Vec<[Vector3<f32>; 2]> {
    let into = anchor(&links[0].pose).inverse();
    let seen = |link: &LinkState| {
        let state = moved(link, &into);
        [state.pose.translation.vector, state.linear]
    };
    links.iter().map(seen).collect()
}

fn link_states(motion: &Motion, model: &CharacterModel, time: f64) -> Vec<LinkState> {
    let skeleton = &model.skeleton;
    let qpos = motion.sample_qpos(skeleton, time);
    let qvel = motion.mean_qvel(time, AVERAGED_S);
    model.character.states(skeleton, &qpos, &qvel)
}

/// The state between two frames of the table: `a` at `blend` 0, `b` at 1.
fn between(a: &LinkState, b: &LinkState, blend: f32) -> LinkState {
    let at = a
        .pose
        .translation
        .vector
        .lerp(&b.pose.translation.vector, blend);
    let (qa, qb) = (a.pose.rotation.coords, b.pose.rotation.coords);
    let near = if qa.dot(&qb) < 0.0 { -qb } else { qb };
    // The table's frames are close: at 12 rad/s the normalised mean is within 1e-5 rad of slerp.
    let turn = UnitQuaternion::new_normalize(nalgebra::Quaternion::from(qa.lerp(&near, blend)));
    LinkState {
        pose: Isometry3::from_parts(Translation3::from(at), turn),
        linear: a.linear.lerp(&b.linear, blend),
        angular: a.angular.lerp(&b.angular, blend),
    }
}
