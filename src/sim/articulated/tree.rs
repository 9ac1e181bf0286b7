//! What doesn't change while a character moves: its joints, their order, and which of them carry which.

use super::super::character::{Character, Link, LinkJoint};
use crate::skeleton::{Drive, Shape};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::ops::Range;

/// How a node turns in its parent.
#[derive(Clone, Copy, Debug)]
pub(super) enum Joint {
    /// Three coordinates along the world's axes, then three about them.
    Free,
    /// Three coordinates about the node's own axes.
    Ball,
    /// One, about a unit axis in the node's frame; between the ends of its range, if it has one.
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
    /// Its velocity coordinates.
    pub dofs: Range<usize>,
    /// Coordinates that move it, from the root's to its own.
    pub path: Vec<usize>,
    pub mass: f32,
    pub com: Vector3<f32>,
    /// About the centre of mass, along the link's axes.
    pub inertia: Matrix3<f32>,
    pub friction: f32,
    /// Points that can touch the ground, in the link's frame, each with a radius.
    pub points: Vec<(Vector3<f32>, f32)>,
}

/// Gains of one velocity coordinate; zero where nothing drives it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gains {
    pub kp: f32,
    pub kd: f32,
    pub limit: f32,
}

/// The nodes, parents before children.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    pub nodes: Vec<Node>,
    /// One for each velocity coordinate.
    pub gains: Vec<Gains>,
    /// `[nodes, nodes]`: how many coordinates move both.
    shared: Vec<usize>,
}

impl Tree {
    pub fn new(character: &Character) -> Self {
        let mut tree = Tree {
            nodes: Vec::new(),
            gains: Vec::new(),
            shared: Vec::new(),
        };
        for link in &character.links {
            let first = tree.gains.len();
            tree.gains.extend(gains(&link.joint));
            let dofs = first..tree.gains.len();
            let mut path = link
                .parent
                .map_or_else(Vec::new, |p| tree.nodes[p].path.clone());
            path.extend(dofs.clone());
            tree.nodes.push(node(link, dofs, path));
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

    /// How many coordinates move both nodes: the first ones of either's path.
    pub fn shared(&self, a: usize, b: usize) -> usize {
        self.shared[a * self.nodes.len() + b]
    }

    /// Number of velocity coordinates.
    pub fn dofs(&self) -> usize {
        self.gains.len()
    }
}

fn node(link: &Link, dofs: Range<usize>, path: Vec<usize>) -> Node {
    Node {
        parent: link.parent,
        joint: joint(&link.joint),
        rest: link.rest.rotation.cast(),
        pivot: (link.rest * nalgebra::Point3::from(link.anchor))
            .coords
            .cast(),
        anchor: link.anchor.cast(),
        dofs,
        path,
        mass: link.mass as f32,
        com: link.com.cast(),
        inertia: link.inertia.cast(),
        friction: link.friction as f32,
        points: link.shapes.iter().flat_map(points).collect(),
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

fn gains(joint: &LinkJoint) -> Vec<Gains> {
    let one = |drive: &Drive| Gains {
        kp: drive.kp as f32,
        kd: drive.kd as f32,
        limit: drive.force_limit.min(f64::from(f32::MAX)) as f32,
    };
    match joint {
        LinkJoint::Free => vec![Gains::default(); 6],
        LinkJoint::Hinge { drive, .. } => vec![one(drive)],
        LinkJoint::Ball { drives, .. } | LinkJoint::Hinges { drives, .. } => {
            drives.iter().map(one).collect()
        }
    }
}

/// The points of a shape that are lowest in one pose or another.
fn points(shape: &Shape) -> Vec<(Vector3<f32>, f32)> {
    let radius = |r: f64| r as f32;
    match shape {
        Shape::Sphere { center, radius: r } => vec![(center.cast(), radius(*r))],
        Shape::Capsule { a, b, radius: r } => {
            vec![(a.cast(), radius(*r)), (b.cast(), radius(*r))]
        }
        Shape::Box { pose, half } => (0..8)
            .map(|corner| {
                let side = |axis: usize| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
                let at = Vector3::from_fn(|axis, _| side(axis) * half[axis]);
                ((pose * nalgebra::Point3::from(at)).coords.cast(), 0.0)
            })
            .collect(),
    }
}
