//! The model of a character: what doesn't change while it moves. Bodies, joints, and which coordinates move which body.

use super::super::character::{Character, Link, LinkJoint};
use crate::skeleton::{Drive, Shape};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// How a node's joint lets it move in its parent, and along which axes its velocity coordinates are.
#[derive(Clone, Copy, Debug)]
pub(super) enum Joint {
    /// Three translations along the world's axes, then three rotations about them.
    Free,
    /// Three rotations about the node's own axes.
    Ball,
    /// One rotation about a unit axis in the node's frame, and its range in radians if it is limited.
    Hinge(Vector3<f32>, Option<[f32; 2]>),
}

/// A link and the joint that connects it to its parent.
#[derive(Clone, Debug)]
pub(super) struct Node {
    /// Index of the parent, which comes before this node; `None` for the root.
    pub parent: Option<usize>,
    pub joint: Joint,
    /// Parent from link, at rest: the rotation.
    pub rest: UnitQuaternion<f32>,
    /// Centre of the joint in the parent's frame, metres.
    pub pivot: Vector3<f32>,
    /// The same point in the link's frame, metres.
    pub anchor: Vector3<f32>,
    /// Index of its first velocity coordinate.
    pub first: usize,
    /// How many velocity coordinates it has.
    pub dof: usize,
    /// The velocity coordinates that move it, from the root's to its own.
    pub path: Vec<usize>,
    /// kg.
    pub mass: f32,
    /// Centre of mass in the link's frame, metres.
    pub com: Vector3<f32>,
    /// About the centre of mass, along the link's axes, kg·m².
    pub inertia: Matrix3<f32>,
    /// Coulomb friction coefficient.
    pub friction: f32,
    /// Balls that can touch the ground: centre in the link's frame, and radius, metres.
    pub points: Vec<(Vector3<f32>, f32)>,
    /// Radius of the ball about the link's origin that holds all points, metres.
    pub reach: f32,
}

/// One velocity coordinate (degree of freedom).
#[derive(Clone, Copy, Debug)]
pub(super) struct Coordinate {
    /// The node whose joint it belongs to.
    pub node: usize,
    /// Its position on that node's path: the number of coordinates above it.
    pub depth: usize,
    /// Where its row of a [`super::matrix::PathMatrix`] begins.
    pub row: usize,
    /// The drive that acts on it.
    pub gains: Gains,
}

/// Gains of the drive of one coordinate; zeros where nothing drives it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gains {
    /// N·m/rad.
    pub kp: f32,
    /// N·m·s/rad.
    pub kd: f32,
    /// Largest torque, N·m.
    pub limit: f32,
}

/// The nodes of a character, parents before children, and their coordinates in the same order.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    pub nodes: Vec<Node>,
    pub coordinates: Vec<Coordinate>,
    /// `[nodes, nodes]`: how many coordinates move both of two nodes.
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

    /// The path of a coordinate's node. The coordinate's own path is the beginning of it, up to its depth.
    #[inline(always)]
    pub fn path(&self, coordinate: &Coordinate) -> &[usize] {
        &self.nodes[coordinate.node].path
    }

    /// How many coordinates move both nodes. They are the first ones of either's path.
    pub fn shared(&self, a: usize, b: usize) -> usize {
        self.shared[a * self.nodes.len() + b]
    }

    /// Number of points of all nodes that can touch the ground.
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

/// Gains of each coordinate of a joint.
fn gains(joint: &LinkJoint) -> Vec<Gains> {
    let of = |drive: &Drive| {
        // A drive that may give no torque is no drive.
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
