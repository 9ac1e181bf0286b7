//! Phase-based imitation: one environment.

use super::observe::{observation_size, observe};
use super::reference::{Reference, Sample};
use super::reward::{Terms, terms};
use super::setting::{Actions, Setting, Stage};
use super::terminate::{Failure, failure};
use crate::clip::LoopMode;
use crate::sim::{HingeAxis, LinkJoint, LinkState, Target, World};
use crate::skeleton::Drive;
use crate::task::Dynamics;
use nalgebra::{UnitQuaternion, Vector3};
use std::sync::Arc;

/// How an episode stands after a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    Running,
    /// Terminal: nothing more can be earned.
    Failed(Failure),
    /// Terminal: the motion was performed to its end.
    Finished,
    /// Cut off by the time limit; the state goes on being worth something.
    TimeLimit,
}

/// What one step gave.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// In (0, 1].
    pub reward: f32,
    pub terms: Terms,
    pub outcome: Outcome,
}

/// An agent that imitates a reference.
pub struct Imitate {
    stage: Arc<Stage>,
    reference: Arc<Reference>,
    setting: Setting,
    world: World,
    time: f64,
    started: f64,
    /// The reference at the next control step.
    next: Sample,
    dynamics: Dynamics,
    targets: Vec<Target>,
    /// Per contact link of the reference.
    touching: Vec<bool>,
}

impl Imitate {
    pub fn new(stage: Arc<Stage>, reference: Arc<Reference>, setting: &Setting) -> Self {
        let mut env = Imitate {
            world: World::new(&stage.character, setting.physics),
            next: reference.blank(),
            targets: vec![Target::Free; stage.character.links.len()],
            touching: Vec::new(),
            stage,
            reference,
            setting: *setting,
            time: 0.0,
            started: 0.0,
            dynamics: Dynamics::default(),
        };
        env.reset(0.0);
        env
    }

    pub fn observation_size(&self) -> usize {
        observation_size(&self.stage, self.reference.contact_links.len())
    }

    pub fn action_size(&self) -> usize {
        self.stage.character.dof
    }

    /// Starts an episode in the reference's own state at `time` seconds.
    pub fn reset(&mut self, time: f64) {
        self.time = time;
        self.started = time;
        self.reference.sample(time, &mut self.next);
        self.world.reset(&self.next.links);
        self.dynamics = self.reference.masses().dynamics(self.world.states());
        // The engine finds contacts only in a step; until then the agent touches what its reference does.
        self.touching.clone_from(&self.next.contacts);
        self.look_ahead();
    }

    /// Latest start that leaves something to do, seconds.
    pub fn last_start(&self) -> f64 {
        match self.reference.loop_mode() {
            LoopMode::Wrap => self.reference.duration(),
            LoopMode::Clamp => {
                (self.reference.duration() - 2.0 * self.setting.physics.control_dt()).max(0.0)
            }
        }
    }

    /// Steps from here to the end of the motion or the time limit, whichever is nearer.
    pub fn possible_steps(&self) -> f64 {
        let limit = self.setting.episode_s - (self.time - self.started);
        let left = match self.reference.loop_mode() {
            LoopMode::Wrap => limit,
            LoopMode::Clamp => limit.min(self.reference.duration() - self.time),
        };
        (left * self.setting.physics.control_hz - 1e-6)
            .ceil()
            .max(1.0)
    }

    /// Writes what the policy sees.
    pub fn observe(&self, out: &mut [f32]) {
        observe(
            &self.stage,
            self.world.states(),
            &self.dynamics,
            &self.touching,
            &self.next,
            out,
        );
    }

    /// Advances by one control step under `action`.
    pub fn step(&mut self, action: &[f32]) -> Step {
        self.aim(action);
        let stepped = self.world.step();
        self.time += self.setting.physics.control_dt();
        if stepped.is_err() {
            return Step {
                reward: 0.0,
                terms: Terms::default(),
                outcome: Outcome::Failed(Failure::Diverged),
            };
        }
        let states = self.world.states();
        let pressed = self.world.contacts();
        let links = self.reference.contact_links.iter();
        self.touching.clear();
        self.touching.extend(links.map(|&link| pressed[link]));
        self.dynamics = self.reference.masses().dynamics(states);
        let terms = terms(
            &self.stage,
            (states, &self.dynamics),
            (&self.next.links, &self.next.dynamics),
        );
        let reward = terms.total(&self.setting.rewards);
        let outcome = self.outcome(reward);
        self.look_ahead();
        Step {
            reward,
            terms,
            outcome,
        }
    }

    /// Link states of the agent.
    pub fn states(&self) -> &[LinkState] {
        self.world.states()
    }

    /// Per link: whether the agent presses on the ground with it.
    pub fn contacts(&self) -> &[bool] {
        self.world.contacts()
    }

    pub fn dynamics(&self) -> &Dynamics {
        &self.dynamics
    }

    /// Time in the reference, seconds.
    pub fn time(&self) -> f64 {
        self.time
    }

    fn look_ahead(&mut self) {
        self.reference.sample(
            self.time + self.setting.physics.control_dt(),
            &mut self.next,
        );
    }

    fn outcome(&self, reward: f32) -> Outcome {
        let (states, contacts) = (self.world.states(), self.world.contacts());
        let allowed = &self.reference.contact_links;
        match failure(
            &self.setting.terminations,
            states,
            &self.next.links,
            contacts,
            allowed,
            reward,
        ) {
            Some(failure) => Outcome::Failed(failure),
            None if self.reference.is_over(self.time) => Outcome::Finished,
            None if self.time - self.started >= self.setting.episode_s - 1e-9 => Outcome::TimeLimit,
            None => Outcome::Running,
        }
    }

    fn aim(&mut self, action: &[f32]) {
        for (i, link) in self.stage.character.links.iter().enumerate() {
            let Some(parent) = link.parent else { continue };
            let part = &action[link.dof..link.dof + link.joint.dof()];
            self.targets[i] = match self.setting.actions {
                Actions::Residual { scale } => self.residual(i, parent, part, scale),
                Actions::Absolute { reach } => absolute(&link.joint, part, reach),
            };
        }
        self.world.set_targets(&self.targets);
    }

    /// The reference's own rotation, turned on by the action.
    ///
    /// A drive kp (q* − q) − kd ω trails a moving reference by kd/kp · ω; so the target leads by as much, which is a
    /// velocity feed-forward with position drives alone.
    fn residual(&self, link: usize, parent: usize, action: &[f32], scale: f32) -> Target {
        let (mine, other) = (&self.next.links[link], &self.next.links[parent]);
        let turn =
            self.stage
                .character
                .joint_rotation(link, other.pose.rotation, mine.pose.rotation);
        let rate = mine
            .pose
            .rotation
            .inverse_transform_vector(&(mine.angular - other.angular));
        let joint = &self.stage.character.links[link].joint;
        match joint {
            LinkJoint::Free => Target::Free,
            LinkJoint::Ball { drives, .. } | LinkJoint::Hinges { drives, .. } => {
                let lead = Vector3::from_fn(|k, _| lag(&drives[k]) * rate[k]);
                let added = turned(joint, action) * scale;
                Target::Ball(turn * UnitQuaternion::from_scaled_axis(lead + added))
            }
            LinkJoint::Hinge { axis, drive } => {
                let direction = axis.direction.cast::<f32>();
                let lead = lag(drive) * rate.dot(&direction);
                let angle = turn.scaled_axis().dot(&direction) + lead + action[0] * scale;
                let [low, high] = axis.limit.map(|end| end as f32);
                Target::Hinge(angle.clamp(low - BEYOND_LIMIT, high + BEYOND_LIMIT))
            }
        }
    }
}

/// How far beyond a hinge's range its drive may aim, radians: to press against the end of the range, or to hold a
/// load near it. `skeletons/humanoid.xml` has the same in its control ranges.
const BEYOND_LIMIT: f32 = 0.5;

/// Rotation vector in the link's frame that the action of a joint with several coordinates stands for.
fn turned(joint: &LinkJoint, action: &[f32]) -> Vector3<f32> {
    match joint {
        LinkJoint::Hinges { hinges, .. } => hinges
            .iter()
            .zip(action)
            .map(|(hinge, a)| hinge.direction.cast() * *a)
            .sum(),
        _ => Vector3::from_column_slice(action),
    }
}

/// Seconds by which a drive trails a target that moves at constant speed.
fn lag(drive: &Drive) -> f32 {
    if drive.kp > 0.0 {
        (drive.kd / drive.kp) as f32
    } else {
        0.0
    }
}

fn absolute(joint: &LinkJoint, action: &[f32], reach: f32) -> Target {
    let place = |limit: &[f64; 2], a: f32| {
        let (middle, half) = ((limit[0] + limit[1]) / 2.0, (limit[1] - limit[0]) / 2.0);
        middle as f32 + a * reach * half as f32
    };
    match joint {
        LinkJoint::Free => Target::Free,
        LinkJoint::Hinge { axis, .. } => Target::Hinge(place(&axis.limit, action[0])),
        LinkJoint::Ball { limits, .. } => {
            let v = Vector3::from_fn(|k, _| place(&limits[k], action[k]));
            Target::Ball(UnitQuaternion::from_scaled_axis(v))
        }
        LinkJoint::Hinges { hinges, .. } => {
            let turn = |(hinge, a): (&HingeAxis, &f32)| {
                UnitQuaternion::from_scaled_axis(hinge.direction.cast() * place(&hinge.limit, *a))
            };
            let turns = hinges.iter().zip(action).map(turn);
            Target::Ball(turns.fold(UnitQuaternion::identity(), |all, next| all * next))
        }
    }
}
