//! A scene's take becomes joints and frames in canonical space.

use super::axes::UpAxis;
use super::error::ErrorKind;
use super::facing;
use super::rigid::{Frame, locals};
use super::scene::Scene;
use super::tree;
use super::upright::{self, Stature};
use crate::clip::{Joint, Problem};
use nalgebra::{Isometry3, UnitQuaternion};

/// A rest pose is unusable where it is smaller than this fraction of the first frame's pose. Chosen: in such
/// files all joints are in one place, up to rounding.
const COLLAPSED: f64 = 0.01;

/// How many poses of a take tell which way the figure stands, ends included. Chosen: most of a motion must be upright,
/// not most frames of it.
const LOOKS: usize = 9;

/// The joints of a scene, and how its world matrices become theirs.
pub(crate) struct Rig<'a> {
    scene: &'a dyn Scene,
    frame: Frame,
    /// Index of every joint's node.
    nodes: Vec<usize>,
    parents: Vec<Option<usize>>,
    /// The joints at rest, in canonical space.
    pub joints: Vec<Joint>,
    /// Up axis that the figure has, where the file states another one.
    pub other_up: Option<UpAxis>,
    /// What was found about the joints.
    pub problems: Vec<Problem>,
}

impl<'a> Rig<'a> {
    /// Chooses the joints and brings their rest pose to canonical space (metres, Z up), facing +X.
    ///
    /// `first` is a take and a time in it, seconds. Its pose replaces a rest pose that can't be used.
    pub fn new(
        scene: &'a dyn Scene,
        frame: Frame,
        first: Option<(usize, f64)>,
    ) -> Result<Self, ErrorKind> {
        let nodes = tree::joints(scene);
        if nodes.is_empty() {
            return Err(ErrorKind::NoJoints);
        }
        let parents = parents(scene, &nodes);
        let left_out = first.and_then(|(take, _)| tree::left_out(scene, &nodes, take));
        let (joints, problems) = (Vec::new(), Vec::from_iter(left_out));
        let mut rig = Self {
            scene,
            frame,
            nodes,
            parents,
            joints,
            other_up: None,
            problems,
        };
        // First the rest pose, then which way is up in it, then which way it faces: each step needs the one before.
        let rest = rig.usable_rest(first)?;
        rig.joints = rig.rest_joints(rest)?;
        if !frame.is_sure {
            rig.stand_up(rest, first.map(|(take, _)| take))?;
        }
        rig.face_forward(rest)?;
        Ok(rig)
    }

    /// World transforms of the joints in canonical space, at a take and its seconds, or at rest without `at`. A joint that
    /// is scaled to nothing has no rotation: it keeps that of the frame `before`, or takes its parent's.
    pub fn world(
        &self,
        at: Option<(usize, f64)>,
        before: Option<&[Isometry3<f64>]>,
    ) -> Result<Vec<Isometry3<f64>>, ErrorKind> {
        let matrices = self.scene.world(at);
        let mut world: Vec<Isometry3<f64>> = Vec::with_capacity(self.nodes.len());
        for (j, &node) in self.nodes.iter().enumerate() {
            let parent = self.parents[j].map(|p| world[p].rotation);
            // A joint scaled to nothing has no rotation: it keeps its last one, or its parent's.
            let otherwise = before
                .map(|frame| frame[j].rotation)
                .or(parent)
                .unwrap_or_else(UnitQuaternion::identity);
            let rigid = matrices
                .get(node)
                .and_then(|m| self.frame.rigid(m, &otherwise));
            world.push(rigid.ok_or_else(|| self.not_finite(node, at))?);
        }
        Ok(world)
    }

    /// World transforms at these seconds of `take`, in order.
    pub fn frames(
        &self,
        take: usize,
        times: &[f64],
    ) -> Result<Vec<Vec<Isometry3<f64>>>, ErrorKind> {
        let mut frames: Vec<Vec<Isometry3<f64>>> = Vec::with_capacity(times.len());
        for &time in times {
            let at = Some((take, time));
            let world = self.world(at, frames.last().map(Vec::as_slice))?;
            frames.push(world);
        }
        Ok(frames)
    }

    /// Local transforms of one frame of world transforms.
    pub fn locals(&self, world: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
        locals(&self.parents, world)
    }

    /// The time to read the rest pose at: `None`, the file's own, unless its joints all stand in one place.
    fn usable_rest(
        &mut self,
        first: Option<(usize, f64)>,
    ) -> Result<Option<(usize, f64)>, ErrorKind> {
        let Some(first) = first else { return Ok(None) };
        // A rest pose that isn't finite counts as collapsed: the first frame may be sound.
        let rest = self.world(None, None).map_or(0.0, |rest| span(&rest));
        if self.nodes.len() < 2 || rest > COLLAPSED * span(&self.world(Some(first), None)?) {
            return Ok(None);
        }
        self.problems.push(Problem::warning(
            "rest-pose-collapsed",
            "the file's rest pose has all joints in one place; the first frame is used as the rest pose",
        ));
        Ok(Some(first))
    }

    /// The joints with their local transforms in the pose at `rest`.
    fn rest_joints(&self, rest: Option<(usize, f64)>) -> Result<Vec<Joint>, ErrorKind> {
        let locals = self.locals(&self.world(rest, None)?);
        let joint = |(j, rest): (usize, Isometry3<f64>)| {
            let node = &self.scene.nodes()[self.nodes[j]];
            Joint {
                name: node.name.clone(),
                parent: self.parents[j],
                rest,
                bone: node.bone.clone(),
            }
        };
        Ok(locals.into_iter().enumerate().map(joint).collect())
    }

    /// Uses the figure's own up axis where the file's is wrong.
    fn stand_up(
        &mut self,
        rest: Option<(usize, f64)>,
        take: Option<usize>,
    ) -> Result<(), ErrorKind> {
        let (Some(take), Some(stature)) = (take, Stature::of(&self.joints)) else {
            return Ok(());
        };
        let about = &self.scene.takes()[take];
        let at = |k: usize| about.start + (about.end - about.start) * k as f64 / (LOOKS - 1) as f64;
        let motion: Vec<_> = (0..LOOKS)
            .filter_map(|k| self.world(Some((take, at(k))), None).ok())
            .collect();
        let up = stature.other_up(&self.world(rest, None)?, &motion, &self.frame.axes);
        if let Some(up) = up {
            // New axes change every rest transform.
            self.frame.axes = up.canonical_from_file();
            self.joints = self.rest_joints(rest)?;
            self.problems
                .push(upright::problem(&self.scene.contents().up_axis, up));
            self.other_up = Some(up);
        }
        Ok(())
    }

    /// Turns the figure about the up axis until its rest pose faces +X.
    fn face_forward(&mut self, rest: Option<(usize, f64)>) -> Result<(), ErrorKind> {
        let turn = facing::turn_to_forward(&facing::pairs(&self.joints, &self.world(rest, None)?))
            .unwrap_or(0.0);
        if turn == 0.0 {
            return Ok(());
        }
        // The turn comes after the change of axes, so it multiplies from the left.
        self.frame.axes = facing::about_z(turn) * self.frame.axes;
        self.joints = self.rest_joints(rest)?;
        self.problems.push(Problem::note(
            "turned-to-forward",
            format!(
                "turned {:.0}° about the up axis to face forward",
                turn.to_degrees()
            ),
        ));
        Ok(())
    }

    fn not_finite(&self, node: usize, at: Option<(usize, f64)>) -> ErrorKind {
        let about = self.scene.nodes().get(node);
        ErrorKind::NotFinite {
            joint: about.map_or_else(String::new, |node| node.name.clone()),
            time: at.map(|(_, time)| time),
        }
    }
}

/// Joint parents: the nearest node above that is a joint too.
fn parents(scene: &dyn Scene, nodes: &[usize]) -> Vec<Option<usize>> {
    let mut joint_of = vec![None; scene.nodes().len()];
    let mut parents = Vec::with_capacity(nodes.len());
    for (j, &node) in nodes.iter().enumerate() {
        let mut above = scene.nodes()[node].parent;
        while let Some(node) = above.filter(|&node| joint_of[node].is_none()) {
            above = scene.nodes()[node].parent;
        }
        parents.push(above.and_then(|node| joint_of[node]));
        joint_of[node] = Some(j);
    }
    parents
}

/// Largest distance of a joint from the first, metres.
fn span(world: &[Isometry3<f64>]) -> f64 {
    let Some(first) = world.first() else {
        return 0.0;
    };
    let distance =
        |joint: &Isometry3<f64>| (joint.translation.vector - first.translation.vector).norm();
    world.iter().map(distance).fold(0.0, f64::max)
}
