//! The stage on which a task plays.

use super::reward::joint_weights;
use super::setting::TaskError;
use crate::humanoid::Slot;
use crate::sim::{Character, Link};
use crate::skeleton::{GRAVITY, Shape, Skeleton};
use nalgebra::{UnitQuaternion, Vector3};

/// Points this little above the lowest one are of the sole, metres.
const SOLE: f64 = 0.01;

/// A round end or a corner of a foot's shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolePoint {
    pub link: usize,
    /// In the link's frame, metres.
    pub center: Vector3<f32>,
    pub radius: f32,
}

/// What every environment of a run shares: skeleton, character and the bodies of interest.
#[derive(Clone, Debug)]
pub struct Stage {
    pub skeleton: Skeleton,
    pub character: Character,
    /// Bodies whose positions the observation holds: head, hands and feet where the skeleton has them.
    pub key_bodies: Vec<usize>,
    /// Hands and feet where the skeleton has them.
    pub end_bodies: Vec<usize>,
    pub chest_body: Option<usize>,
    /// Heel, left of the toes, right of the toes, of each foot.
    pub soles: Vec<SolePoint>,
    /// What each link counts for where joints are weighted: all joints together one.
    pub joint_weights: Vec<f32>,
    /// What divides angular momentum: mass × leg length × √(g × leg length), kg·m²/s.
    pub momentum_scale: f32,
}

impl Stage {
    /// # Errors
    /// A skeleton that can't be simulated.
    pub fn new(skeleton: Skeleton) -> Result<Self, TaskError> {
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
        Ok(Stage {
            key_bodies: body(&Slot::Head)
                .into_iter()
                .chain(end_bodies.iter().copied())
                .collect(),
            chest_body: body(&Slot::Chest),
            soles: soles(&skeleton, &character),
            end_bodies,
            joint_weights: joint_weights(&skeleton, &character),
            momentum_scale: (skeleton.total_mass() * leg * (GRAVITY * leg).sqrt()) as f32,
            skeleton,
            character,
        })
    }

    /// The body that is shoved: the chest, or the root where the skeleton has none.
    pub fn trunk(&self) -> usize {
        self.chest_body.unwrap_or(0)
    }
}

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
