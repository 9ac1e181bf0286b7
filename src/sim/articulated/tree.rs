//! What doesn't change while a character moves: its joints, their order, and which of them carry which.

use super::super::character::{Character, Link, LinkJoint};
use crate::skeleton::{Drive, Shape};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// How a node turns in its parent.
#[derive(Clone, Copy, Debug)]
pub(super) enum Joint {
    /// Along the world's axes, then about them.
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
    /// Its first coordinate, and how many it has.
    pub first: usize,
    pub dof: usize,
    /// Coordinates that move it, from the root's to its own.
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

/// One velocity coordinate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coordinate {
    /// The node whose joint it turns, and its place on that node's path.
    pub node: usize,
    pub depth: usize,
    /// Where its row of a matrix begins.
    pub row: usize,
    pub gains: Gains,
}

/// Zero where nothing drives a coordinate.
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
    pub coordinates: Vec<Coordinate>,
    /// `[nodes, nodes]`: how many coordinates move both.
    shared: Vec<usize>,
}

impl Tree {
    pub fn new(character: &Character) -> Self {
        let mut tree = Tree {
            nodes: Vec::new(),
            coordinates: Vec::new(),
            shared: Vec::new(),
        };
        for link in &character.links {
            tree.add(link);
        }
        for a in &tree.nodes {
            let both = |b: &Node| {
                let pairs = a.path.iter().zip(&b.path);
                pairs.take_while(|(x, y)| x == y).count()
            };
            tree.shared.extend(tree.nodes.iter().map(both));
        }
        tree
    }

    fn add(&mut self, link: &Link) {
        let (first, node_index) = (self.coordinates.len(), self.nodes.len());
        let mut path = link
            .parent
            .map_or_else(Vec::new, |p| self.nodes[p].path.clone());
        for gains in gains(&link.joint) {
            let row = self.coordinates.last().map_or(0, |c| c.row + c.depth + 1);
            self.coordinates.push(Coordinate {
                node: node_index,
                depth: path.len(),
                row,
                gains,
            });
            path.push(self.coordinates.len() - 1);
        }
        self.nodes.push(node(link, first, path));
    }

    /// The path of a coordinate's node, which begins with its own.
    #[inline(always)]
    pub fn path(&self, coordinate: &Coordinate) -> &[usize] {
        &self.nodes[coordinate.node].path
    }

    /// How many coordinates move both nodes: the first ones of either's path.
    pub fn shared(&self, a: usize, b: usize) -> usize {
        self.shared[a * self.nodes.len() + b]
    }

    pub fn points(&self) -> usize {
        self.nodes.iter().map(|node| node.points.len()).sum()
    }
}

fn node(link: &Link, first: usize, path: Vec<usize>) -> Node {
    let tips = link.shapes.iter().flat_map(Shape::hull_balls);
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
        first,
        dof: path.last().map_or(0, |last| last + 1 - first),
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

/// Of each coordinate of a joint.
fn gains(joint: &LinkJoint) -> Vec<Gains> {
    let of = |drive: &Drive| {
        // What may give no force drives nothing.
        if drive.force_limit <= 0.0 {
            return Gains::default();
        }
        let [kp, kd, limit] =
            [drive.kp, drive.kd, drive.force_limit].map(|x| x.min(f64::from(f32::MAX)) as f32);
        Gains { kp, kd, limit }
    };
    match joint {
        LinkJoint::Free => vec![Gains::default(); 6],
        LinkJoint::Hinge { drive, .. } => vec![of(drive)],
        LinkJoint::Ball { drives, .. } | LinkJoint::Hinges { drives, .. } => {
            drives.iter().map(of).collect()
        }
    }
}
