//! Coordinates that take over the source's orientations: where the solver starts, and what it falls back to.

use super::align::Alignment;
use crate::humanoid::Slot;
use crate::skeleton::{Skeleton, limits};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// Passes over the tree. In the second, joints below a hinge make up for what the hinge couldn't take in the first.
const PASSES: usize = 2;

/// Guesses the coordinates of a frame.
pub(super) struct Guesser<'a> {
    skeleton: &'a Skeleton,
    /// Place in [`Alignment::binds`] of every body's bind.
    bind_of: Vec<Option<usize>>,
}

impl<'a> Guesser<'a> {
    /// For bodies that follow the source by this alignment.
    pub fn new(alignment: &Alignment, skeleton: &'a Skeleton) -> Guesser<'a> {
        let mut bind_of = vec![None; skeleton.bodies.len()];
        for (i, bind) in alignment.binds.iter().enumerate() {
            bind_of[bind.body] = Some(i);
        }
        Guesser { skeleton, bind_of }
    }

    /// Coordinates and bodies of the pose with these orientations of the bound bodies, as far as its joints can have them. The
    /// middle of its hip joints is at `hips`; `before` is the frame before, whose turns of hinges it continues.
    pub fn guess(
        &self,
        hips: Vector3<f64>,
        rotations: &[UnitQuaternion<f64>],
        before: Option<&Vec<f64>>,
    ) -> (Vec<f64>, Vec<Isometry3<f64>>) {
        let facing = self
            .goal(0, rotations)
            .unwrap_or_else(UnitQuaternion::identity);
        let root = Isometry3::from_parts(Translation3::identity(), facing);
        let mut world = self.wanted(facing, rotations);
        let mut qpos = Vec::new();
        let mut reached = Vec::new();
        for _ in 0..PASSES {
            let turns = self.local(facing, &world);
            // No history: the same pose gives the same coordinates, wherever the clip begins.
            qpos = self.skeleton.rotations_to_qpos(&root, &turns, None);
            // Hinges take what they can of the turn, within their limits. Ball joints may go beyond theirs: the fit brings
            // them back.
            limits::clamp_hinges(self.skeleton, &mut qpos);
            reached = self.skeleton.forward(&qpos);
            for (b, rotation) in world.iter_mut().enumerate().skip(1) {
                let goal = self.goal(b, rotations);
                // What can take any orientation keeps its goal; all else is as it was reached, and those below it make up
                // for it.
                let free = goal.filter(|_| self.turns_freely(b));
                *rotation = free.unwrap_or(reached[b].rotation);
            }
        }
        // The root was at the origin so far. It goes to where the hip joints are in the right place, whichever joints are
        // between.
        let shift = hips - self.hip_middle(&reached);
        qpos[..3].copy_from_slice(shift.as_slice());
        let shift = Translation3::from(shift);
        reached.iter_mut().for_each(|body| *body = shift * *body);
        // An angle and the same plus a full turn are one pose; the one nearer to the frame before makes no jump.
        if let Some(before) = before {
            limits::unwrap(self.skeleton, before, &mut qpos);
        }
        (qpos, reached)
    }

    /// World orientation of every body; one that isn't bound stays as it is on its parent at rest.
    fn wanted(
        &self,
        facing: UnitQuaternion<f64>,
        rotations: &[UnitQuaternion<f64>],
    ) -> Vec<UnitQuaternion<f64>> {
        let bodies = &self.skeleton.bodies;
        let mut world = vec![facing; bodies.len()];
        for (b, body) in bodies.iter().enumerate().skip(1) {
            let parent = body.parent.map_or(facing, |p| world[p]);
            let carried = parent * body.rest.rotation;
            world[b] = self.goal(b, rotations).unwrap_or(carried);
        }
        world
    }

    /// By how much every body is turned from its place on its parent at rest.
    fn local(
        &self,
        facing: UnitQuaternion<f64>,
        world: &[UnitQuaternion<f64>],
    ) -> Vec<UnitQuaternion<f64>> {
        let turn = |(b, body): (usize, &crate::skeleton::Body)| {
            let parent = body.parent.map_or(facing, |p| world[p]);
            (parent * body.rest.rotation).inverse() * world[b]
        };
        self.skeleton.bodies.iter().enumerate().map(turn).collect()
    }

    /// Keeps the head's target within what the neck can do. Otherwise a head that turns further, as a robot's does, takes
    /// chest and arms along.
    pub fn limit_head(
        &self,
        qpos: &[f64],
        bodies: &[Isometry3<f64>],
        rotations: &mut [UnitQuaternion<f64>],
    ) {
        let Some(&head) = self.skeleton.slots.get(&Slot::Head) else {
            return;
        };
        let (Some(bind), Some(neck)) = (self.bind_of[head], self.skeleton.bodies[head].parent)
        else {
            return;
        };
        let mut within = qpos.to_vec();
        limits::clamp(self.skeleton, &mut within);
        let within = self.skeleton.forward(&within);
        // The neck's pose relative to the trunk as limited, on the trunk as guessed.
        let turn = within[neck].rotation.inverse() * within[head].rotation;
        rotations[bind] = bodies[neck].rotation * turn;
    }

    /// Middle between the hip joints; the root's origin where the skeleton lacks one of them.
    fn hip_middle(&self, bodies: &[Isometry3<f64>]) -> Vector3<f64> {
        let hip = |slot: Slot| {
            let body = self.skeleton.slots.get(&slot)?;
            Some(bodies[*body].translation.vector)
        };
        match (hip(Slot::LeftUpperLeg), hip(Slot::RightUpperLeg)) {
            (Some(left), Some(right)) => (left + right) / 2.0,
            _ => bodies[0].translation.vector,
        }
    }

    /// Whether a body's joints can give it any orientation.
    fn turns_freely(&self, body: usize) -> bool {
        let joints = &self.skeleton.bodies[body].joints;
        joints.iter().map(|j| j.kind.nv()).sum::<usize>() >= 3
    }

    /// The orientation that a body should have, if it is bound.
    fn goal(&self, body: usize, rotations: &[UnitQuaternion<f64>]) -> Option<UnitQuaternion<f64>> {
        self.bind_of[body].map(|i| rotations[i])
    }
}
