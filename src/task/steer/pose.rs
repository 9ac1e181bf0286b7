//! Poses as a root and joint rotations, mixed from several and carried to the links.

use crate::sim::{Character, LinkState};
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3, Vector4};

/// A pose of a character.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pose {
    /// The root, in the frame that the pose is given in.
    pub root: Isometry3<f32>,
    /// One per link: the rotation of its joint, the identity at rest; the root's is unused.
    pub joints: Vec<UnitQuaternion<f32>>,
}

impl Pose {
    /// The pose of these links, seen from `frame`.
    pub fn of(character: &Character, links: &[LinkState], frame: &Isometry3<f32>) -> Pose {
        let joint = |(i, link): (usize, &crate::sim::Link)| {
            let turn = |parent: usize| links[parent].pose.rotation;
            link.parent.map_or_else(UnitQuaternion::identity, |parent| {
                character.joint_rotation(i, turn(parent), links[i].pose.rotation)
            })
        };
        Pose {
            root: frame.inverse() * links[0].pose,
            joints: character.links.iter().enumerate().map(joint).collect(),
        }
    }

    /// An upright pose with all joints at rest.
    pub fn rest(character: &Character) -> Pose {
        Pose {
            root: Isometry3::identity(),
            joints: vec![UnitQuaternion::identity(); character.links.len()],
        }
    }
}

/// A weighted mean of poses. Rotations are means of quaternions, brought to unit length: near to the geodesic mean for poses of
/// one kind (Gramkow, "On averaging rotations", 2001).
#[derive(Clone, Debug)]
pub(super) struct Mix {
    weight: f32,
    place: Vector3<f32>,
    /// The root's rotation, then one per link.
    turns: Vec<Vector4<f32>>,
}

impl Mix {
    /// An empty mean for a character of so many links.
    pub fn new(links: usize) -> Mix {
        Mix {
            weight: 0.0,
            place: Vector3::zeros(),
            turns: vec![Vector4::zeros(); links + 1],
        }
    }

    /// Empties it.
    pub fn clear(&mut self) {
        self.weight = 0.0;
        self.place = Vector3::zeros();
        self.turns.fill(Vector4::zeros());
    }

    /// Adds a pose.
    pub fn add(&mut self, pose: &Pose, weight: f32) {
        if weight <= 0.0 {
            return;
        }
        self.weight += weight;
        self.place += pose.root.translation.vector * weight;
        let turns = std::iter::once(&pose.root.rotation).chain(&pose.joints);
        for (sum, turn) in self.turns.iter_mut().zip(turns) {
            // A quaternion and its negative are one rotation; the one near to the sum counts.
            let side = if sum.dot(&turn.coords) < 0.0 {
                -1.0
            } else {
                1.0
            };
            *sum += turn.coords * (side * weight);
        }
    }

    /// Writes the mean into `pose`.
    pub fn mean(&self, pose: &mut Pose) {
        let unit = |sum: &Vector4<f32>| UnitQuaternion::new_normalize(Quaternion::from(*sum));
        let place = self.place / self.weight.max(f32::MIN_POSITIVE);
        pose.root = Isometry3::from_parts(Translation3::from(place), unit(&self.turns[0]));
        for (joint, sum) in pose.joints.iter_mut().zip(&self.turns[1..]) {
            *joint = unit(sum);
        }
    }
}

/// How the links of a character hang together, in single precision.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    links: Vec<Branch>,
}

/// How a link hangs on its parent.
#[derive(Clone, Debug)]
struct Branch {
    parent: Option<usize>,
    /// Rotation of the link in its parent at rest.
    rest: UnitQuaternion<f32>,
    /// The joint in the parent's frame and in the link's own, metres.
    joint: [Point3<f32>; 2],
}

impl Tree {
    /// The tree of this character.
    pub fn new(character: &Character) -> Tree {
        let branch = |link: &crate::sim::Link| {
            let rest = link.rest.cast::<f32>();
            let anchor = Point3::from(link.anchor.cast::<f32>());
            Branch {
                parent: link.parent,
                rest: rest.rotation,
                joint: [rest * anchor, anchor],
            }
        };
        Tree {
            links: character.links.iter().map(branch).collect(),
        }
    }

    /// The parent of a link.
    pub fn parent(&self, link: usize) -> Option<usize> {
        self.links[link].parent
    }

    /// Place of a link's joint in its own frame, metres.
    pub fn joint_in_link(&self, link: usize) -> Point3<f32> {
        self.links[link].joint[1]
    }

    /// Rotation of a link in its parent at rest.
    pub fn rest(&self, link: usize) -> UnitQuaternion<f32> {
        self.links[link].rest
    }

    /// Writes the places of all links whose number is `from` or above: `poses` of lower ones stay as they are.
    pub fn place(&self, pose: &Pose, poses: &mut [Isometry3<f32>], from: usize) {
        for i in from..self.links.len() {
            poses[i] = match self.links[i].parent {
                None => pose.root,
                Some(parent) => self.hung(i, &poses[parent], pose.joints[i]),
            };
        }
    }

    /// Where a link is, given its parent and the rotation of its joint.
    pub fn hung(
        &self,
        link: usize,
        parent: &Isometry3<f32>,
        joint: UnitQuaternion<f32>,
    ) -> Isometry3<f32> {
        let Branch {
            rest,
            joint: [there, here],
            ..
        } = &self.links[link];
        let turn = parent.rotation * rest * joint;
        let at = parent * there - turn * here.coords;
        Isometry3::from_parts(Translation3::from(at.coords), turn)
    }
}
