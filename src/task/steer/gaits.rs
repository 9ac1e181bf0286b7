//! What a steered character is made of: a pose to stand in, gaits, and what else it can perform.

use super::gait::Gait;
use super::leg::Leg;
use super::mirror::Mirror;
use super::pose::{Mix, Pose, Tree};
use super::role::{Role, Traits, facing, mean_place};
use super::space::GaitSpace;
use crate::clip::LoopMode;
use crate::motion::Motion;
use crate::task::error::TaskError;
use crate::task::model::CharacterModel;
use nalgebra::{Isometry3, Translation3, Vector2};

/// Poses a second of a motion that stands. Chosen: breathing is slow.
const IDLE_HZ: f64 = 10.0;

/// How a character stands.
#[derive(Clone, Debug)]
pub(super) struct Idle {
    poses: Vec<Pose>,
}

impl Idle {
    /// A motion that stands.
    fn new(motion: &Motion, model: &CharacterModel) -> Idle {
        let at = mean_place(motion, &Vector2::zeros());
        let facing = facing(motion, &model.skeleton);
        let frame = Isometry3::from_parts(Translation3::from(at), facing).cast::<f32>();
        let still = vec![0.0; model.skeleton.nv];
        let pose = |time: f64| {
            let qpos = motion.sample_qpos(&model.skeleton, time);
            let links = model.character.states(&model.skeleton, &qpos, &still);
            Pose::of(&model.character, &links, &frame)
        };
        let count = (motion.duration() * IDLE_HZ).ceil().max(1.0) as usize;
        let step = motion.duration() / count as f64;
        let mut poses: Vec<Pose> = (0..count).map(|k| pose(k as f64 * step)).collect();
        // One that ends goes back the way that it came.
        if motion.loop_mode == LoopMode::Clamp {
            poses.extend(
                (1..poses.len().max(2) - 1)
                    .rev()
                    .map(|k| poses[k].clone())
                    .collect::<Vec<_>>(),
            );
        }
        Idle { poses }
    }

    /// Adds the pose at a time, seconds, to a mean.
    pub fn add(&self, time: f32, weight: f32, mix: &mut Mix) {
        let at = time * IDLE_HZ as f32;
        let (k, blend) = (at as usize, at.fract());
        let count = self.poses.len();
        mix.add(&self.poses[k % count], weight * (1.0 - blend));
        mix.add(&self.poses[(k + 1) % count], weight * blend);
    }
}

/// All that a steered character does.
pub(super) struct Gaits {
    pub tree: Tree,
    pub legs: [Leg; 2],
    pub rest: Pose,
    pub idle: Idle,
    pub space: GaitSpace,
}

impl Gaits {
    /// Sorts motions by what they are for; see [`Traits`].
    ///
    /// # Errors
    /// No motion that stands, none that walks, or a character without legs.
    pub fn new(motions: &[Motion], model: &CharacterModel) -> Result<Gaits, TaskError> {
        let traits = motions
            .iter()
            .map(|motion| (motion, Traits::of(motion, &model.skeleton)));
        let traits: Vec<_> = traits.collect();
        let of = |role: Role| traits.iter().filter(move |(_, found)| found.role == role);
        let calmest = of(Role::Idle).min_by(|a, b| a.1.liveliness.total_cmp(&b.1.liveliness));
        let (idle, _) = calmest.ok_or(TaskError::NoStanding)?;
        let gaits: Vec<Gait> = of(Role::Gait)
            .filter_map(|(motion, _)| Gait::new(motion, model))
            .collect();
        if gaits.is_empty() {
            return Err(TaskError::NoGait);
        }
        let legs = Leg::both(model).ok_or_else(|| TaskError::NoLegs {
            skeleton: model.skeleton.name.clone(),
            leg: model.skeleton.leg_length(),
        })?;
        Ok(Gaits {
            tree: Tree::new(&model.character),
            legs,
            rest: Pose::rest(&model.character),
            idle: Idle::new(idle, model),
            space: GaitSpace::new(gaits, &Mirror::new(model)),
        })
    }

    /// How many links the character has.
    pub fn links(&self) -> usize {
        self.rest.joints.len()
    }
}
