//! The character of a task, with the bodies that observations and rewards look at.

use super::contact::ContactBody;
use super::error::TaskError;
use crate::humanoid::Slot;
use crate::sim::{Character, Link, LinkState, SimError};
use crate::skeleton::{GRAVITY, Shape, Skeleton};
use nalgebra::{UnitQuaternion, Vector3};

/// Points at most this far above the lowest one belong to the sole, metres. Chosen.
const SOLE: f64 = 0.01;

/// A round end or a corner of a foot's shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolePoint {
    /// Number of the link that it belongs to.
    pub link: usize,
    /// In the link's frame, metres.
    pub center: Vector3<f32>,
    /// Of the ball about the centre, metres; 0 for a corner.
    pub radius: f32,
}

/// What every environment of a run shares: skeleton, character and the bodies of interest.
#[derive(Clone, Debug)]
pub struct CharacterModel {
    /// The character as its file describes it, with the slots of a humanoid.
    pub skeleton: Skeleton,
    /// The same as the links that the physics moves.
    pub character: Character,
    /// Bodies whose positions the observation holds: head, hands and feet where the skeleton has them.
    pub key_bodies: Vec<usize>,
    /// Hands and feet where the skeleton has them.
    pub end_bodies: Vec<usize>,
    /// The chest where the skeleton has one.
    pub chest_body: Option<usize>,
    /// The bodies that can touch the ground.
    pub contacts: Vec<ContactBody>,
    /// Heel, left of the toes, right of the toes, of each foot.
    pub soles: Vec<SolePoint>,
    /// One per link: how much its joint counts where joints are weighted. The weights of all joints add up to 1.
    pub joint_weights: Vec<f32>,
    /// What angular momentum is divided by, so that it has no unit and doesn't grow with the character: mass × leg length × √(g × leg length), kg·m²/s.
    pub momentum_scale: f32,
}

impl CharacterModel {
    /// What a task needs to know of this skeleton.
    ///
    /// # Errors
    /// A skeleton that can't be simulated, or one without legs, whose size can't be told.
    pub fn new(skeleton: Skeleton) -> Result<Self, TaskError> {
        if let Some((body, joint)) = skeleton.undriven() {
            let (body, joint) = (body.name.clone(), joint.name.clone());
            return Err(SimError::Undriven { body, joint }.into());
        }
        let character = Character::new(&skeleton)?;
        let ends = [
            Slot::LeftHand,
            Slot::RightHand,
            Slot::LeftFoot,
            Slot::RightFoot,
        ];
        let body = |slot: &Slot| skeleton.slots.get(slot).copied();
        let end_bodies: Vec<usize> = ends.iter().filter_map(body).collect();
        let leg = skeleton.leg_length();
        if !(leg.is_finite() && leg > 0.0) {
            return Err(TaskError::NoLegs {
                skeleton: skeleton.name,
                leg,
            });
        }
        Ok(CharacterModel {
            key_bodies: body(&Slot::Head)
                .into_iter()
                .chain(end_bodies.iter().copied())
                .collect(),
            chest_body: body(&Slot::Chest),
            contacts: ContactBody::all(&skeleton, &character),
            soles: soles(&skeleton, &character),
            end_bodies,
            joint_weights: joint_weights(&skeleton, &character),
            momentum_scale: (skeleton.total_mass() * leg * (GRAVITY * leg).sqrt()) as f32,
            skeleton,
            character,
        })
    }

    /// World positions of all the skeleton's bodies, welded ones included, metres.
    pub fn positions<'a>(
        &'a self,
        links: &'a [LinkState],
    ) -> impl Iterator<Item = Vector3<f32>> + 'a {
        let bodies = 0..self.character.bodies.len();
        bodies.map(|b| self.character.body_pose(links, b).translation.vector)
    }

    /// The number of a body among [`CharacterModel::contacts`].
    pub fn contact(&self, body: usize) -> Option<usize> {
        self.contacts
            .iter()
            .position(|contact| contact.body == body)
    }

    /// The body that is shoved: the chest, or the root where the skeleton has none.
    pub fn trunk(&self) -> usize {
        self.chest_body.unwrap_or(0)
    }
}

/// The sole points of both feet.
fn soles(skeleton: &Skeleton, character: &Character) -> Vec<SolePoint> {
    let rest = skeleton.forward(&skeleton.rest_qpos());
    let feet = [Slot::LeftFoot, Slot::RightFoot];
    let feet = feet.iter().filter_map(|slot| skeleton.slots.get(slot));
    feet.flat_map(|&foot| {
        let link = character.bodies[foot].link;
        let upright = rest[character.links[link].body].rotation;
        sole(link, &character.links[link], &upright)
    })
    .collect()
}

/// The points of a link's sole that are furthest back, front and left, front and right in the rest pose.
fn sole(index: usize, link: &Link, upright: &UnitQuaternion<f64>) -> Vec<SolePoint> {
    let balls = link.shapes.iter().flat_map(Shape::hull_balls);
    let points: Vec<_> = balls.map(|(at, radius)| (at.coords, radius)).collect();
    let height = |(p, radius): &(Vector3<f64>, f64)| (upright * p).z - radius;
    let lowest = points.iter().map(height).fold(f64::INFINITY, f64::min);
    let low = || points.iter().filter(|p| height(p) < lowest + SOLE);
    let ways = [(-1.0, 0.0), (1.0, 1.0), (1.0, -1.0)];
    let furthest = ways.iter().filter_map(|(x, y)| {
        let along = |p: &Vector3<f64>| (upright * p).dot(&Vector3::new(*x, *y, 0.0));
        low().max_by(|a, b| along(&a.0).total_cmp(&along(&b.0)))
    });
    furthest
        .map(|(center, radius)| SolePoint {
            link: index,
            center: center.cast(),
            radius: *radius as f32,
        })
        .collect()
}

/// What each link's joint weighs in the program that Peng et al. published with "DeepMimic" (2018): root 1, hips and trunk
/// 0.5, knees, shoulders and neck 0.3, ankles and elbows 0.2, over their sum; wrists weigh nothing, nor do toes, which its
/// character hasn't. Where several links make up a joint, one for each motor, those above count as the one that has the slot.
fn joint_weights(skeleton: &Skeleton, character: &Character) -> Vec<f32> {
    let mut slotted: Vec<Option<f32>> = vec![None; character.links.len()];
    for (slot, body) in &skeleton.slots {
        let weighs = &mut slotted[character.bodies[*body].link];
        *weighs = Some(weighs.unwrap_or(0.0).max(joint_weight(*slot)));
    }
    slotted[0] = Some(joint_weight(Slot::Hips));
    let sum: f32 = slotted.iter().flatten().sum();
    let mut below = vec![0.0_f32; character.links.len()];
    // Parents stand before their children.
    for (i, link) in character.links.iter().enumerate().rev() {
        below[i] = slotted[i].unwrap_or(below[i]);
        if let Some(parent) = link.parent {
            below[parent] = below[parent].max(below[i]);
        }
    }
    below.iter().map(|weight| weight / sum).collect()
}

/// The weight of the joint above the body in this slot, before weights are divided by their sum.
fn joint_weight(slot: Slot) -> f32 {
    use Slot::*;
    match slot {
        Hips => 1.0,
        Spine | Chest | LeftUpperLeg | RightUpperLeg => 0.5,
        Neck | Head | LeftLowerLeg | RightLowerLeg => 0.3,
        LeftShoulder | LeftUpperArm | RightShoulder | RightUpperArm => 0.3,
        LeftFoot | RightFoot | LeftLowerArm | RightLowerArm => 0.2,
        LeftHand | RightHand | LeftToes | RightToes => 0.0,
    }
}
