//! A skeleton as the simulation sees it: bodies that are welded together are one link, and each link has one joint.

use super::error::SimError;
use super::state::LinkState;
use crate::skeleton::{Body, Drive, Joint, JointKind, Shape, Skeleton, point_inertia};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

/// How a link moves in its parent.
#[derive(Clone, Debug, PartialEq)]
pub enum LinkJoint {
    /// Moves and turns freely: the root.
    Free,
    /// Turns any way about the anchor.
    Ball {
        /// Drives of the exponential-map coordinates along the link's x, y, z.
        drives: [Drive; 3],
        /// Ranges of the same coordinates, radians. Targets keep to them; the simulation doesn't enforce them.
        limits: [[f64; 2]; 3],
    },
    /// Two or three hinges of one body, which turn it one after the other. The simulation treats them as a ball whose targets
    /// are rotations that the hinges can reach. An axis that none of two hinges has is held by a drive as stiff as theirs.
    Hinges {
        /// The hinges in the order in which they act.
        hinges: Vec<HingeAxis>,
        /// Drives of the exponential-map coordinates along the link's x, y, z.
        drives: [Drive; 3],
    },
    /// Turns about one axis.
    Hinge {
        /// The axis and the range about it.
        axis: HingeAxis,
        /// The drive of the angle.
        drive: Drive,
    },
}

/// The axis about which a hinge turns, and its range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HingeAxis {
    /// Unit vector in the link's frame.
    pub direction: Vector3<f64>,
    /// Lowest and highest angle, radians.
    pub limit: [f64; 2],
}

impl HingeAxis {
    /// Whether the range limits anything. A full turn doesn't: MJCF without a range loads as −π to π. The tolerance is for
    /// ranges that are written in degrees or with few digits.
    pub(super) fn is_limited(&self) -> bool {
        self.limit[1] - self.limit[0] < TAU - 1e-6
    }
}

impl LinkJoint {
    /// Number of drive coordinates: 3 for a ball, 1 for each hinge, none for the root.
    pub fn dof(&self) -> usize {
        match self {
            LinkJoint::Free => 0,
            LinkJoint::Ball { .. } => 3,
            LinkJoint::Hinges { hinges, .. } => hinges.len(),
            LinkJoint::Hinge { .. } => 1,
        }
    }
}

/// A rigid part of the character: a body of the skeleton and the bodies that are welded to it.
#[derive(Clone, Debug)]
pub struct Link {
    /// Name of the body whose frame is this link's frame.
    pub name: String,
    /// Index of that body in the skeleton.
    pub body: usize,
    /// Index of the parent link; `None` for the root.
    pub parent: Option<usize>,
    /// Parent link from this link, at zero joint coordinates.
    pub rest: Isometry3<f64>,
    /// The joint between parent and link.
    pub joint: LinkJoint,
    /// Centre of the joint in the link's frame, metres.
    pub anchor: Vector3<f64>,
    /// Index of its first drive coordinate.
    pub dof: usize,
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the link's frame, metres.
    pub com: Vector3<f64>,
    /// Moment of inertia about the centre of mass, along the link's axes, kg·m².
    pub inertia: Matrix3<f64>,
    /// The shapes that can touch the ground, in the link's frame.
    pub shapes: Vec<Shape>,
    /// Coulomb friction coefficient of the link's own body. It counts for all shapes.
    pub friction: f64,
}

/// How a body of the skeleton sits on the link that carries it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attachment {
    /// Index of the link.
    pub link: usize,
    /// The body's frame in the link's; the identity for the body whose frame the link has.
    pub link_from_body: Isometry3<f64>,
}

/// The character as a tree of links. Parents come before their children.
#[derive(Clone, Debug)]
pub struct Character {
    /// The links, parents before children.
    pub links: Vec<Link>,
    /// Number of drive coordinates of all links together.
    pub dof: usize,
    /// Where each body of the skeleton sits, in the skeleton's order.
    pub bodies: Vec<Attachment>,
}

impl Character {
    /// Makes the character of a skeleton: merges bodies that are welded together into links.
    ///
    /// # Errors
    /// [`SimError`] for a skeleton that can't be simulated: one with slide joints, more joints on a body than a ball or three
    /// hinges, a root that isn't free, a second root, or a link without mass.
    pub fn new(skeleton: &Skeleton) -> Result<Self, SimError> {
        let mut character = Character {
            links: Vec::new(),
            dof: 0,
            bodies: Vec::new(),
        };
        for (index, body) in skeleton.bodies.iter().enumerate() {
            match body.parent {
                Some(parent) if body.joints.is_empty() => character.weld(body, parent),
                parent => character.add(index, body, parent)?,
            }
        }
        match character.links.iter().find(|link| link.mass <= 0.0) {
            Some(link) => Err(SimError::Massless {
                body: link.name.clone(),
            }),
            None if character.links.is_empty() => Err(SimError::Empty),
            None => Ok(character),
        }
    }

    /// Adds a link for a body that has joints.
    fn add(&mut self, index: usize, body: &Body, parent: Option<usize>) -> Result<(), SimError> {
        let joint = link_joint(body, parent.is_none())?;
        if parent.is_none() && !self.links.is_empty() {
            return Err(SimError::SecondRoot {
                body: body.name.clone(),
            });
        }
        let carrier = parent.map(|p| self.bodies[p]);
        let dof = self.dof;
        self.dof += joint.dof();
        self.bodies.push(Attachment {
            link: self.links.len(),
            link_from_body: Isometry3::identity(),
        });
        self.links.push(Link {
            name: body.name.clone(),
            body: index,
            parent: carrier.map(|c| c.link),
            rest: carrier.map_or_else(Isometry3::identity, |c| c.link_from_body * body.rest),
            joint,
            anchor: body
                .joints
                .first()
                .map_or_else(Vector3::zeros, |j| j.anchor),
            dof,
            mass: body.mass,
            com: body.com,
            inertia: body.inertia,
            shapes: body.shapes.clone(),
            friction: body.friction,
        });
        Ok(())
    }

    /// Merges a body without joints into its parent's link.
    fn weld(&mut self, body: &Body, parent: usize) {
        let Attachment {
            link,
            link_from_body,
        } = self.bodies[parent];
        let at = link_from_body * body.rest;
        self.bodies.push(Attachment {
            link,
            link_from_body: at,
        });
        let link = &mut self.links[link];
        link.shapes
            .extend(body.shapes.iter().map(|shape| moved(shape, &at)));
        let com = (at * nalgebra::Point3::from(body.com)).coords;
        let turn = at.rotation.to_rotation_matrix();
        let inertia = turn * body.inertia * turn.inverse();
        // Both inertias move to the common centre of mass by the parallel axis theorem.
        let mass = link.mass + body.mass;
        if mass > 0.0 {
            let center = (link.com * link.mass + com * body.mass) / mass;
            link.inertia += point_inertia(link.mass, &(link.com - center))
                + inertia
                + point_inertia(body.mass, &(com - center));
            link.com = center;
            link.mass = mass;
        }
    }

    /// States of all links, `[links]`, at coordinates `qpos` and velocities `qvel` of the skeleton that this character was made
    /// of.
    ///
    /// # Panics
    /// If `qpos` is shorter than [`Skeleton::nq`] or `qvel` than [`Skeleton::nv`].
    pub fn states(&self, skeleton: &Skeleton, qpos: &[f64], qvel: &[f64]) -> Vec<LinkState> {
        let (poses, twists) = (skeleton.forward(qpos), skeleton.twists(qpos, qvel));
        let state = |link: &Link| LinkState {
            pose: poses[link.body].cast(),
            linear: twists[link.body].linear.cast(),
            angular: twists[link.body].angular.cast(),
        };
        self.links.iter().map(state).collect()
    }

    /// World from body: the pose of a body of the skeleton, given the states of all links.
    ///
    /// # Panics
    /// Where the skeleton has no such body, or `links` are fewer than the character's.
    #[inline]
    pub fn body_pose(&self, links: &[LinkState], body: usize) -> Isometry3<f32> {
        let at = &self.bodies[body];
        links[at.link].pose * at.link_from_body.cast::<f32>()
    }

    /// World from body of every body of the skeleton, in double precision, for pictures and files.
    ///
    /// # Panics
    /// Where `links` are fewer than the character's.
    pub fn body_poses(&self, links: &[LinkState]) -> Vec<Isometry3<f64>> {
        let pose = |at: &Attachment| links[at.link].pose.cast::<f64>() * at.link_from_body;
        self.bodies.iter().map(pose).collect()
    }

    /// Pose and velocity of a body of the skeleton, given the states of all links.
    ///
    /// A body welded to a link turns with it, ω = ω_link, and its origin moves with v = v_link + ω × r, where r leads
    /// from the link's origin to the body's.
    ///
    /// # Panics
    /// Where the skeleton has no such body, or `links` are fewer than the character's.
    #[inline]
    pub fn body_state(&self, links: &[LinkState], body: usize) -> LinkState {
        let link = &links[self.bodies[body].link];
        let pose = self.body_pose(links, body);
        let arm = pose.translation.vector - link.pose.translation.vector;
        LinkState {
            pose,
            linear: link.linear + link.angular.cross(&arm),
            angular: link.angular,
        }
    }

    /// Joint rotation of link `link`, the identity at rest, given the orientations of its parent and of itself in the world.
    pub fn joint_rotation(
        &self,
        link: usize,
        parent: UnitQuaternion<f32>,
        child: UnitQuaternion<f32>,
    ) -> UnitQuaternion<f32> {
        self.links[link].rest.rotation.cast::<f32>().inverse() * parent.inverse() * child
    }
}

/// A shape in the frame that `by` leads to.
fn moved(shape: &Shape, by: &Isometry3<f64>) -> Shape {
    let point = |p: &Vector3<f64>| (by * nalgebra::Point3::from(*p)).coords;
    match shape {
        Shape::Sphere { center, radius } => Shape::Sphere {
            center: point(center),
            radius: *radius,
        },
        Shape::Capsule { a, b, radius } => Shape::Capsule {
            a: point(a),
            b: point(b),
            radius: *radius,
        },
        Shape::Box { pose, half } => Shape::Box {
            pose: by * pose,
            half: *half,
        },
    }
}

/// The one joint that stands for all joints of a body.
fn link_joint(body: &Body, is_root: bool) -> Result<LinkJoint, SimError> {
    let name = || body.name.clone();
    if is_root {
        return match body.joints.as_slice() {
            [joint] if joint.kind == JointKind::Free => Ok(LinkJoint::Free),
            _ => Err(SimError::RootIsNotFree { body: name() }),
        };
    }
    if let [joint] = body.joints.as_slice()
        && joint.kind == JointKind::Ball
    {
        return Ok(LinkJoint::Ball {
            drives: [joint.drives[0], joint.drives[1], joint.drives[2]],
            limits: [joint.limits[0], joint.limits[1], joint.limits[2]],
        });
    }
    let hinges = hinges(body)?;
    match hinges.as_slice() {
        [(axis, drive)] => Ok(LinkJoint::Hinge {
            axis: *axis,
            drive: *drive,
        }),
        [_, _] | [_, _, _] => {
            hinges_of_one(&hinges).ok_or_else(|| SimError::ParallelHinges { body: name() })
        }
        _ => Err(too_many(body)),
    }
}

/// The hinges of a body that has no other joints.
fn hinges(body: &Body) -> Result<Vec<(HingeAxis, Drive)>, SimError> {
    let hinge = |joint: &Joint| match joint.kind {
        JointKind::Hinge(direction) => {
            let limit = joint.limits[0];
            Ok((HingeAxis { direction, limit }, joint.drives[0]))
        }
        JointKind::Slide(_) => Err(SimError::SlideJoint {
            body: body.name.clone(),
            joint: joint.name.clone(),
        }),
        JointKind::Free | JointKind::Ball => Err(too_many(body)),
    };
    body.joints.iter().map(hinge).collect()
}

fn too_many(body: &Body) -> SimError {
    SimError::TooManyJoints {
        body: body.name.clone(),
        count: body.joints.len(),
    }
}

/// Several hinges of one body as one joint; `None` if neighbours turn about the same axis.
fn hinges_of_one(hinges: &[(HingeAxis, Drive)]) -> Option<LinkJoint> {
    for pair in hinges.windows(2) {
        // Sine of the angle between the axes; chosen: below a millionth they are the same.
        let across = pair[0].0.direction.cross(&pair[1].0.direction);
        across.try_normalize(1e-6)?;
    }
    Some(LinkJoint::Hinges {
        drives: [Vector3::x(), Vector3::y(), Vector3::z()].map(|along| gains(hinges, &along)),
        hinges: hinges.iter().map(|(axis, _)| *axis).collect(),
    })
}

/// The drive of the hinge whose axis is nearest to a direction, or the stiffest drive if no axis is near.
fn gains(hinges: &[(HingeAxis, Drive)], along: &Vector3<f64>) -> Drive {
    let share = |hinge: &(HingeAxis, Drive)| hinge.0.direction.dot(along).abs();
    // Of equally near ones, the first counts.
    let mut best = hinges[0];
    for hinge in hinges {
        if share(hinge) > share(&best) {
            best = *hinge;
        }
    }
    // Chosen: an axis more than 60° away says nothing about this direction.
    if share(&best) < 0.5 {
        for hinge in hinges {
            if hinge.1.kp > best.1.kp {
                best = *hinge;
            }
        }
    }
    best.1
}

/// A rotation that turns X to the unit vector `axis`.
pub(super) fn x_along(axis: &Vector3<f64>) -> UnitQuaternion<f64> {
    let turn = Rotation3::rotation_between(&Vector3::x(), axis)
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI));
    UnitQuaternion::from_rotation_matrix(&turn)
}
