//! A scene's take becomes joints and frames in canonical space.

use super::facing;
use super::rigid::{Frame, locals};
use super::scene::Scene;
use super::upright::{self, Stature};
use super::{Error, UpAxis, tree};
use crate::clip::{Joint, Problem, Severity};
use nalgebra::{Isometry3, UnitQuaternion};

/// A rest pose this much smaller than the first frame's, as a part of it, has collapsed.
const COLLAPSED: f64 = 0.01;

/// Times within a take at which it is looked at which way the figure stands.
const LOOKS: usize = 9;

/// The joints of a scene, and how its world matrices become theirs.
pub(crate) struct Rig<'a> {
    file: &'a str,
    scene: &'a dyn Scene,
    frame: Frame,
    /// Node of every joint.
    nodes: Vec<usize>,
    parents: Vec<Option<usize>>,
    pub joints: Vec<Joint>,
    /// Up axis that the figure has, where the file states another.
    pub other_up: Option<UpAxis>,
    pub problems: Vec<Problem>,
}

impl<'a> Rig<'a> {
    /// Chooses the joints and brings their rest pose to canonical space, facing +X.
    ///
    /// `first` is the take and time whose pose stands in for a rest pose that can't be used.
    pub fn new(
        scene: &'a dyn Scene,
        file: &'a str,
        frame: Frame,
        first: Option<(usize, f64)>,
    ) -> Result<Self, Error> {
        let nodes = tree::joints(scene);
        if nodes.is_empty() {
            return Err(Error::NoJoints {
                file: file.to_owned(),
            });
        }
        let parents = parents(scene, &nodes);
        let left_out = first.and_then(|(take, _)| tree::left_out(scene, &nodes, take));
        let (joints, problems) = (Vec::new(), Vec::from_iter(left_out));
        let mut rig = Self {
            file,
            scene,
            frame,
            nodes,
            parents,
            joints,
            other_up: None,
            problems,
        };
        let rest = rig.usable_rest(first)?;
        rig.joints = rig.rest_joints(rest)?;
        if !frame.is_sure {
            rig.stand_up(rest, first.map(|(take, _)| take))?;
        }
        rig.face_forward(rest)?;
        Ok(rig)
    }

    /// World transforms of the joints at `at` (take and seconds; `None` at rest). `before` supplies the rotation
    /// of joints that are scaled to nothing at that time.
    pub fn world(
        &self,
        at: Option<(usize, f64)>,
        before: Option<&[Isometry3<f64>]>,
    ) -> Result<Vec<Isometry3<f64>>, Error> {
        let matrices = self.scene.world(at);
        let mut world: Vec<Isometry3<f64>> = Vec::with_capacity(self.nodes.len());
        for (j, &node) in self.nodes.iter().enumerate() {
            let parent = self.parents[j].map(|p| world[p].rotation);
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

    /// World transforms at these seconds of `take`, one after the other.
    pub fn frames(&self, take: usize, times: &[f64]) -> Result<Vec<Vec<Isometry3<f64>>>, Error> {
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
    fn usable_rest(&mut self, first: Option<(usize, f64)>) -> Result<Option<(usize, f64)>, Error> {
        let Some(first) = first else { return Ok(None) };
        let rest = self.world(None, None).map_or(0.0, |rest| span(&rest));
        if self.nodes.len() < 2 || rest > COLLAPSED * span(&self.world(Some(first), None)?) {
            return Ok(None);
        }
        self.problems.push(Problem {
            id: "rest-pose-collapsed".to_owned(),
            severity: Severity::Warning,
            message: "the file's rest pose has all joints in one place; the first frame stands in"
                .to_owned(),
        });
        Ok(Some(first))
    }

    fn rest_joints(&self, rest: Option<(usize, f64)>) -> Result<Vec<Joint>, Error> {
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

    /// Takes the figure's own up axis where the file's is wrong.
    fn stand_up(&mut self, rest: Option<(usize, f64)>, take: Option<usize>) -> Result<(), Error> {
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
            self.frame.axes = up.canonical_from_file();
            self.joints = self.rest_joints(rest)?;
            self.problems
                .push(upright::problem(&self.scene.contents().up_axis, up));
            self.other_up = Some(up);
        }
        Ok(())
    }

    fn face_forward(&mut self, rest: Option<(usize, f64)>) -> Result<(), Error> {
        let turn = facing::turn_to_forward(&facing::pairs(&self.joints, &self.world(rest, None)?))
            .unwrap_or(0.0);
        if turn == 0.0 {
            return Ok(());
        }
        self.frame.axes = facing::about_z(turn) * self.frame.axes;
        self.joints = self.rest_joints(rest)?;
        self.problems.push(Problem {
            id: "turned-to-forward".to_owned(),
            severity: Severity::Note,
            message: format!(
                "turned {:.0}° about the up axis to face forward",
                turn.to_degrees()
            ),
        });
        Ok(())
    }

    fn not_finite(&self, node: usize, at: Option<(usize, f64)>) -> Error {
        let place = match at {
            Some((_, time)) => format!("at {time:.3} s"),
            None => "at rest".to_owned(),
        };
        let joint = self
            .scene
            .nodes()
            .get(node)
            .map_or_else(String::new, |node| node.name.clone());
        Error::NotFinite {
            file: self.file.to_owned(),
            joint,
            place,
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
