//! What doesn't change while a character moves: its joints, their order, and which of them carry which.
//!
//! Velocity coordinates lie in blocks of four, of which a joint uses three or one (the root two blocks, three of
//! each): so every sum over the coordinates that move a node runs four at a time.

use super::super::character::{Character, Link, LinkJoint};
use crate::skeleton::{Drive, Shape};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use wide::f32x4;

/// How a node turns in its parent.
#[derive(Clone, Copy, Debug)]
pub(super) enum Joint {
    /// A block along the world's axes, and one about them.
    Free,
    /// About the node's own axes.
    Ball,
    /// About a unit axis in the node's frame; between the ends of its range, if it has one.
    Hinge(Vector3<f32>, Option<[f32; 2]>),
}

/// A link and the joint that carries it.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub parent: Option<usize>,
    pub joint: Joint,
    /// Rotation of the link in its parent at rest.
    pub rest: UnitQuaternion<f32>,
    /// Where the joint turns, in the parent's frame and in the link's.
    pub pivot: Vector3<f32>,
    pub anchor: Vector3<f32>,
    /// Its coordinates' block; the root's second.
    pub block: usize,
    /// Blocks that move it, from the root's to its own.
    pub path: Vec<usize>,
    pub mass: f32,
    pub com: Vector3<f32>,
    /// About the centre of mass, along the link's axes.
    pub inertia: Matrix3<f32>,
    pub friction: f32,
    /// Points that can touch the ground, in the link's frame, each with a radius.
    pub points: Vec<(Vector3<f32>, f32)>,
    /// None of them is farther from the link's origin, metres.
    pub reach: f32,
}

/// Gains of a block; zero where nothing drives a coordinate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gains {
    pub kp: f32x4,
    pub kd: f32x4,
    pub limit: f32x4,
}

/// The nodes, parents before children.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    pub nodes: Vec<Node>,
    /// One for each block.
    pub gains: Vec<Gains>,
    /// Coordinates in use in each block: the first ones.
    pub used: Vec<usize>,
    /// `[nodes, nodes]`: how many blocks move both.
    shared: Vec<usize>,
}

impl Tree {
    pub fn new(character: &Character) -> Self {
        let mut tree = Tree {
            nodes: Vec::new(),
            gains: Vec::new(),
            used: Vec::new(),
            shared: Vec::new(),
        };
        for link in &character.links {
            tree.add(link);
        }
        for a in &tree.nodes {
            let both = |b: &Node| {
                a.path
                    .iter()
                    .zip(&b.path)
                    .take_while(|(x, y)| x == y)
                    .count()
            };
            tree.shared.extend(tree.nodes.iter().map(both));
        }
        tree
    }

    fn add(&mut self, link: &Link) {
        let first = self.gains.len();
        if let LinkJoint::Free = link.joint {
            self.gains.push(Gains::default());
            self.used.push(3);
        }
        self.gains.push(gains(&link.joint));
        self.used.push(if let LinkJoint::Hinge { .. } = link.joint {
            1
        } else {
            3
        });
        let mut path = link
            .parent
            .map_or_else(Vec::new, |p| self.nodes[p].path.clone());
        path.extend(first..self.gains.len());
        self.nodes.push(node(link, path));
    }

    /// How many blocks move both nodes: the first ones of either's path.
    pub fn shared(&self, a: usize, b: usize) -> usize {
        self.shared[a * self.nodes.len() + b]
    }

    pub fn blocks(&self) -> usize {
        self.gains.len()
    }
}

fn node(link: &Link, path: Vec<usize>) -> Node {
    let tips = link.shapes.iter().flat_map(Shape::tips);
    let points: Vec<(Vector3<f32>, f32)> = tips
        .map(|(at, radius)| (at.coords.cast(), radius as f32))
        .collect();
    let reaches = points.iter().map(|(at, radius)| at.norm() + radius);
    Node {
        reach: reaches.fold(0.0, f32::max),
        parent: link.parent,
        joint: joint(&link.joint),
        rest: link.rest.rotation.cast(),
        pivot: (link.rest * nalgebra::Point3::from(link.anchor))
            .coords
            .cast(),
        anchor: link.anchor.cast(),
        block: path[path.len() - 1],
        path,
        mass: link.mass as f32,
        com: link.com.cast(),
        inertia: link.inertia.cast(),
        friction: link.friction as f32,
        points,
    }
}

fn joint(joint: &LinkJoint) -> Joint {
    match joint {
        LinkJoint::Free => Joint::Free,
        LinkJoint::Ball { .. } | LinkJoint::Hinges { .. } => Joint::Ball,
        LinkJoint::Hinge { axis, .. } => {
            let limit = axis.is_limited().then(|| axis.limit.map(|end| end as f32));
            Joint::Hinge(axis.direction.cast(), limit)
        }
    }
}

fn gains(joint: &LinkJoint) -> Gains {
    let drives: &[Drive] = match joint {
        LinkJoint::Free => &[],
        LinkJoint::Hinge { drive, .. } => std::slice::from_ref(drive),
        LinkJoint::Ball { drives, .. } | LinkJoint::Hinges { drives, .. } => drives,
    };
    let each = |of: fn(&Drive) -> f64| {
        // What may give no force drives nothing.
        let of = |drive: &Drive| {
            if drive.force_limit > 0.0 {
                of(drive)
            } else {
                0.0
            }
        };
        let value = |k: usize| drives.get(k).map_or(0.0, of).min(f64::from(f32::MAX)) as f32;
        f32x4::from([value(0), value(1), value(2), 0.0])
    };
    Gains {
        kp: each(|drive| drive.kp),
        kd: each(|drive| drive.kd),
        limit: each(|drive| drive.force_limit),
    }
}
