//! The joint tree with its rest positions.

use crate::clip::Joint;
use nalgebra::{Isometry3, Point3, Vector3};

/// A joint tree for searches up and down.
pub(super) struct Tree {
    /// Parent of every joint.
    pub parent: Vec<Option<usize>>,
    /// Children of every joint, in order.
    pub children: Vec<Vec<usize>>,
    /// Positions of the joints at rest: world, metres.
    pub at: Vec<Point3<f64>>,
}

impl Tree {
    pub fn new(joints: &[Joint]) -> Tree {
        let mut world: Vec<Isometry3<f64>> = Vec::with_capacity(joints.len());
        let mut children = vec![Vec::new(); joints.len()];
        let mut parent = Vec::with_capacity(joints.len());
        for (j, joint) in joints.iter().enumerate() {
            // Parents come before their children. Joints made by hand may break this: such a link is ignored.
            let up = joint.parent.filter(|p| *p < j);
            let base = up.map_or_else(Isometry3::identity, |p| world[p]);
            if let Some(p) = up {
                children[p].push(j);
            }
            world.push(base * joint.rest);
            parent.push(up);
        }
        let at = world.iter().map(|w| w.translation.vector.into()).collect();
        Tree {
            parent,
            children,
            at,
        }
    }

    /// The joint itself, then its parent, and so on to the root.
    pub fn upward(&self, joint: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(joint), |j| self.parent[*j])
    }

    /// Whether `above` is a strict ancestor of `below`.
    pub fn is_above(&self, above: usize, below: usize) -> bool {
        above != below && self.upward(below).any(|j| j == above)
    }

    /// The lowest joint that is above both, or one of them; `None` in separate trees.
    pub fn meet(&self, a: usize, b: usize) -> Option<usize> {
        let (mut a, mut b) = (a, b);
        // Parents have lower indices, so the higher of the two can't be above the other.
        while a != b {
            if a > b {
                a = self.parent[a]?;
            } else {
                b = self.parent[b]?;
            }
        }
        Some(a)
    }

    /// From `top` down to `bottom`, both included; empty when `top` isn't above `bottom`.
    pub fn path(&self, top: usize, bottom: usize) -> Vec<usize> {
        let mut path: Vec<usize> = self.upward(bottom).take_while(|j| *j >= top).collect();
        if path.last() != Some(&top) {
            return Vec::new();
        }
        path.reverse();
        path
    }

    /// From one joint to another at rest: world axes, metres.
    pub fn span(&self, from: usize, to: usize) -> Vector3<f64> {
        self.at[to] - self.at[from]
    }
}
