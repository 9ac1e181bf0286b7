//! Builds the bodies of a character from a parsed MJCF model, as MuJoCo's compiler would.

use super::error::{Defect, SkeletonError};
use super::inertia::{MassProperties, set_total_mass};
use super::shape::{Solid, isometry};
use super::{Body, Joint, JointKind, actuators, drive};
use mjcf_rs::Model;
use mjcf_rs::body::{Body as MjcfBody, Geom, GeomType, Joint as MjcfJoint, JointType};
use mjcf_rs::compiler::InertiaFromGeom;
use nalgebra::{Isometry3, Vector3};

/// Lengths and distances that are let through, metres. Chosen: no character is a kilometre tall.
pub(super) const MOST_LENGTH: f64 = 1000.0;
/// Mass that a part may have, kg, and that a body which moves on its own has at least, with what is welded to it. Chosen:
/// links that only carry joints are written with a milligram, and the heaviest animals have 150 tonnes.
pub(super) const MOST_MASS: f64 = 1e6;
const LEAST_MASS: f64 = 1e-9;
/// Smallest moment of inertia of a body that moves on its own, kg·m²: MuJoCo's `mjMINVAL`, which its compiler asks for.
const LEAST_INERTIA: f64 = 1e-15;
/// Most degrees of freedom of a body: MuJoCo's compiler allows no more.
const MOST_OF_BODY: usize = 6;
/// Most degrees of freedom of a character. Chosen, as for the joints in the text (see [`super::guard`]).
const MOST_FREEDOMS: usize = 256;

/// How far the ground may be from where it is simulated, metres, and how far its normal from the vertical. Chosen: rounding.
const LEVEL: f64 = 1e-6;

/// What to do about numbers such as `nan` and `1e999`.
const FINITE: &str = "write finite numbers of at most 1000 m";

/// The bodies of a character and the sizes of its coordinates.
pub(super) struct Built {
    pub bodies: Vec<Body>,
    pub nq: usize,
    pub nv: usize,
}

/// Builds the bodies of `model`, parents before children. `skeleton` is the name for errors.
pub(super) fn bodies(skeleton: &str, model: &Model) -> Result<Built, SkeletonError> {
    check_option(skeleton, model)?;
    actuators::check(skeleton, model)?;
    let mut builder = Builder::new(skeleton, model);
    builder.add_bodies()?;
    let Builder {
        mut bodies, nq, nv, ..
    } = builder;
    if nv > MOST_FREEDOMS {
        let cause =
            format!("the character has {nv} degrees of freedom, at most {MOST_FREEDOMS} are read");
        let defect = Defect::new(
            cause,
            "weld bodies that needn't move, by removing their joints",
        );
        return Err(SkeletonError::mjcf(skeleton, None, defect));
    }
    set_total_mass(&mut bodies, model.compiler.set_total_mass);
    check_masses(skeleton, &bodies)?;
    Ok(Built { bodies, nq, nv })
}

/// The simulation has a gravity and a time step of its own, but a file that states impossible ones isn't to be believed.
fn check_option(skeleton: &str, model: &Model) -> Result<(), SkeletonError> {
    let option = &model.option;
    let (cause, remedy) = match option.timestep > 0.0 {
        false => ("its `timestep` is not positive", "write seconds above 0"),
        true if option.gravity.iter().all(|x| x.is_finite()) => return Ok(()),
        true => ("its `gravity` is not finite", "write three finite numbers"),
    };
    let defect = Defect::new(cause, remedy);
    Err(SkeletonError::mjcf(
        skeleton,
        Some("<option>".to_owned()),
        defect,
    ))
}

/// Whether a point is near enough to be meant.
pub(super) fn is_near(point: &Vector3<f64>) -> bool {
    point.iter().all(|x| x.abs() <= MOST_LENGTH)
}

/// Collects the bodies of the character out of a parsed model.
struct Builder<'a> {
    skeleton: &'a str,
    model: &'a Model,
    bodies: Vec<Body>,
    /// Our index of each body of the model; `None` for scenery.
    index: Vec<Option<usize>>,
    nq: usize,
    nv: usize,
}

impl<'a> Builder<'a> {
    fn new(skeleton: &'a str, model: &'a Model) -> Self {
        Self {
            skeleton,
            model,
            bodies: Vec::new(),
            index: vec![None; model.bodies.len()],
            nq: 0,
            nv: 0,
        }
    }

    fn error(&self, place: impl Into<String>, defect: Defect) -> SkeletonError {
        SkeletonError::mjcf(self.skeleton, Some(place.into()), defect)
    }

    fn add_bodies(&mut self) -> Result<(), SkeletonError> {
        let model = self.model;
        // Where the scenery is: bodies without a joint above them. The first is the world.
        let mut placed = vec![None; model.bodies.len()];
        if let Some(world) = model.bodies.first() {
            placed[0] = Some(Isometry3::identity());
            self.check_planes(&world.body, placed[0])?;
        }
        for (id, entry) in model.bodies_iter() {
            let above = entry.parent.and_then(|parent| placed[parent]);
            placed[id] = above
                .filter(|_| entry.body.joints.is_empty())
                .map(|above| above * isometry(&entry.body.pose));
            self.check_planes(&entry.body, placed[id])?;
            let parent = entry.parent.and_then(|p| self.index.get(p).copied());
            let parent = parent.flatten();
            let joints = &entry.body.joints;
            let free = joints.iter().any(|j| j.type_ == JointType::Free);
            let name = entry.body.name.clone();
            let name = name.unwrap_or_else(|| format!("body{id}"));
            // A body that is fixed to the world is scenery, and so is the world body itself.
            if parent.is_none() && joints.is_empty() {
                continue;
            }
            self.check_place(&name, parent.is_some(), free, joints.len())?;
            self.check_freedoms(&name, joints)?;
            let body = self.body(name, parent, &entry.body)?;
            self.index[id] = Some(self.bodies.len());
            self.bodies.push(body);
        }
        if self.bodies.is_empty() {
            let defect = Defect::new(
                "no body has a free joint",
                "add <freejoint/> to the character's top body",
            );
            return Err(self.error("<worldbody>", defect));
        }
        Ok(())
    }

    /// Checks the planes of a body: the ground is the level one at height 0, and there is no other. `place` is that of a body that
    /// doesn't move.
    fn check_planes(
        &self,
        body: &MjcfBody,
        place: Option<Isometry3<f64>>,
    ) -> Result<(), SkeletonError> {
        let is_plane = |geom: &&Geom| geom.type_ == GeomType::Plane;
        let touches = |geom: &&Geom| geom.contype != 0 || geom.conaffinity != 0;
        for geom in body.geoms.iter().filter(is_plane).filter(touches) {
            let at = place.map(|place| place * isometry(&geom.pose));
            let is_ground = |at: Isometry3<f64>| {
                let up = at.rotation * Vector3::z();
                at.translation.z.abs() <= LEVEL && up.z >= 1.0 - LEVEL
            };
            let cause = match at {
                None => "a plane that moves is not simulated",
                Some(at) if !is_ground(at) => {
                    "the ground is simulated as the level plane at z = 0, and this one is another"
                }
                Some(_) => continue,
            };
            let name = geom.name.as_deref().unwrap_or("without a name");
            let defect = Defect::new(cause, "put the plane there, or remove it");
            return Err(self.error(format!("geom `{name}`"), defect));
        }
        Ok(())
    }

    /// Checks that a body fits into one tree whose root is free.
    fn check_place(
        &self,
        name: &str,
        has_parent: bool,
        free: bool,
        joints: usize,
    ) -> Result<(), SkeletonError> {
        let (cause, remedy) = match (has_parent, free) {
            (false, false) => (
                "it moves, but no body above it has a free joint",
                "add <freejoint/> to the character's top body, and remove scenery that has joints",
            ),
            (false, true) if !self.bodies.is_empty() => (
                "it is a second moving tree",
                "keep one character in the file and remove the rest",
            ),
            (false, true) if joints > 1 => (
                "it has other joints beside its free joint",
                "keep the free joint alone",
            ),
            (true, true) => (
                "it has a free joint below the top body",
                "replace the free joint with a ball joint or hinges",
            ),
            _ if self.bodies.iter().any(|b| b.name == name) => (
                "the name is used twice",
                "give every body a name of its own",
            ),
            _ => return Ok(()),
        };
        Err(self.error(format!("body `{name}`"), Defect::new(cause, remedy)))
    }

    /// Checks that the joints of a body aren't too many, and that each has a name of its own.
    fn check_freedoms(&self, body: &str, joints: &[MjcfJoint]) -> Result<(), SkeletonError> {
        let of_joint = |joint: &MjcfJoint| match joint.type_ {
            JointType::Free => 6,
            JointType::Ball => 3,
            JointType::Hinge | JointType::Slide => 1,
        };
        let freedoms: usize = joints.iter().map(of_joint).sum();
        if freedoms > MOST_OF_BODY {
            let cause = format!("it has {freedoms} degrees of freedom");
            let remedy = format!("keep at most {MOST_OF_BODY}, which is all that MuJoCo allows");
            return Err(self.error(format!("body `{body}`"), Defect::new(cause, remedy)));
        }
        let before = self.bodies.iter().flat_map(|body| &body.joints);
        let mut taken: Vec<&str> = before.map(|joint| joint.name.as_str()).collect();
        for name in joints.iter().filter_map(|joint| joint.name.as_deref()) {
            if taken.contains(&name) {
                let defect = Defect::new(
                    "the name is used twice",
                    "give every joint a name of its own",
                );
                return Err(self.error(format!("joint `{name}` of body `{body}`"), defect));
            }
            taken.push(name);
        }
        Ok(())
    }

    fn body(
        &mut self,
        name: String,
        parent: Option<usize>,
        body: &MjcfBody,
    ) -> Result<Body, SkeletonError> {
        let place = format!("body `{name}`");
        let rest = isometry(&body.pose);
        let is_sound = rest.to_homogeneous().iter().all(|x| x.is_finite());
        if !(is_sound && is_near(&rest.translation.vector)) {
            let defect = Defect::new("its `pos` or rotation is not finite or too large", FINITE);
            return Err(self.error(place, defect));
        }
        let solids = self.solids(body, &place)?;
        let properties = self.mass_properties(body, &solids, &place)?;
        let joints = body
            .joints
            .iter()
            .enumerate()
            .map(|(i, joint)| self.joint(&name, i, joint))
            .collect::<Result<Vec<_>, _>>()?;
        let colliding = solids.iter().filter(|s| s.collides);
        // MuJoCo takes the larger friction of the two geoms of a contact; a body counts as one geom here. Without geoms it
        // has MuJoCo's default for sliding friction, 1.
        let friction = colliding.clone().map(|s| s.friction).fold(None, larger);
        Ok(Body {
            name,
            parent,
            rest,
            joints,
            shapes: colliding.map(Solid::shape).collect(),
            friction: friction.unwrap_or(1.0),
            mass: properties.mass,
            com: properties.com,
            inertia: properties.inertia,
        })
    }

    fn solids(&self, body: &MjcfBody, place: &str) -> Result<Vec<Solid>, SkeletonError> {
        let mut solids = Vec::new();
        for geom in &body.geoms {
            let drawn_only = geom.contype == 0 && geom.conaffinity == 0;
            let meshed = matches!(geom.type_, GeomType::Mesh | GeomType::Sdf);
            // A mesh that neither collides nor has a say in the mass is for the eye only.
            if meshed && drawn_only && body.inertial.is_some() {
                continue;
            }
            let solid = Solid::from_geom(geom).map_err(|defect| {
                let place = match &geom.name {
                    Some(name) => format!("{place}, geom `{name}`"),
                    None => format!("{place}, a geom without a name"),
                };
                self.error(place, defect)
            })?;
            solids.extend(solid);
        }
        Ok(solids)
    }

    /// Mass properties from `<inertial>` or from geoms, as `<compiler inertiafromgeom>` says.
    fn mass_properties(
        &self,
        body: &MjcfBody,
        solids: &[Solid],
        place: &str,
    ) -> Result<MassProperties, SkeletonError> {
        let compiler = &self.model.compiler;
        let stated = match compiler.inertia_from_geom {
            InertiaFromGeom::True => None,
            InertiaFromGeom::False | InertiaFromGeom::Auto => body.inertial.as_ref(),
        };
        let properties = match (stated, compiler.inertia_from_geom) {
            (Some(inertial), _) => {
                MassProperties::from_inertial(inertial, compiler.balance_inertia)
                    .map_err(|defect| self.error(place, defect))?
            }
            (None, InertiaFromGeom::False) => MassProperties::from_solids(&[]),
            (None, _) => MassProperties::from_solids(solids),
        };
        Ok(properties.bounded(compiler))
    }

    fn joint(
        &mut self,
        body: &str,
        index: usize,
        joint: &MjcfJoint,
    ) -> Result<Joint, SkeletonError> {
        let name = joint.name.clone().unwrap_or_else(|| match index {
            0 => body.to_owned(),
            n => format!("{body}_{n}"),
        });
        let place = format!("joint `{name}` of body `{body}`");
        if joint.ref_ != 0.0 {
            let defect = Defect::new("a `ref` offset is not supported", "set `ref` to 0");
            return Err(self.error(place, defect));
        }
        let kind = self.joint_kind(joint, &place)?;
        let anchor = Vector3::from(joint.pos);
        if !is_near(&anchor) {
            let defect = Defect::new("its `pos` is not finite or too large", FINITE);
            return Err(self.error(place, defect));
        }
        let (drives, limits) = drive::drives(joint, kind, self.model)
            .map_err(|defect| self.error(place.as_str(), defect))?;
        let placed = Joint {
            name,
            kind,
            anchor,
            qpos: self.nq,
            dof: self.nv,
            drives,
            limits,
        };
        self.nq += placed.kind.nq();
        self.nv += placed.kind.nv();
        Ok(placed)
    }

    fn joint_kind(&self, joint: &MjcfJoint, place: &str) -> Result<JointKind, SkeletonError> {
        let axis = || {
            // Chosen: a shorter axis is a zero that went through text and rounding.
            Vector3::from(joint.axis)
                .try_normalize(1e-9)
                .filter(|a| a.iter().all(|x| x.is_finite()))
                .ok_or_else(|| {
                    let defect = Defect::new(
                        "its `axis` has no direction",
                        "write three finite numbers that are not all 0",
                    );
                    self.error(place, defect)
                })
        };
        Ok(match joint.type_ {
            JointType::Free => JointKind::Free,
            JointType::Ball => JointKind::Ball,
            JointType::Hinge => JointKind::Hinge(axis()?),
            JointType::Slide => JointKind::Slide(axis()?),
        })
    }
}

fn larger(best: Option<f64>, next: f64) -> Option<f64> {
    Some(best.map_or(next, |b| b.max(next)))
}

/// Checks that every body that moves on its own has mass, in itself or in bodies welded to it, and resists turning.
fn check_masses(skeleton: &str, bodies: &[Body]) -> Result<(), SkeletonError> {
    let mut carried: Vec<f64> = bodies.iter().map(|b| b.mass).collect();
    // Parents come before their children, so from the last body on each welded mass reaches the body that moves it.
    for (index, body) in bodies.iter().enumerate().rev() {
        match body.parent {
            Some(parent) if body.joints.is_empty() => carried[parent] += carried[index],
            _ => check_mass(body, carried[index]).map_err(|defect| {
                SkeletonError::mjcf(skeleton, Some(format!("body `{}`", body.name)), defect)
            })?,
        }
    }
    Ok(())
}

/// Checks the mass of a body that moves on its own, given that mass and what is welded to it together.
fn check_mass(body: &Body, carried: f64) -> Result<(), Defect> {
    if carried < LEAST_MASS {
        return Err(Defect::new(
            "it moves but has no mass",
            "give it a geom or an <inertial>",
        ));
    }
    // Also after `settotalmass`.
    if carried.is_nan() || carried > MOST_MASS {
        let cause = format!("its mass of {carried:e} kg is too large to use");
        return Err(Defect::new(
            cause,
            format!("write at most {MOST_MASS:e} kg"),
        ));
    }
    // What is welded to a body lends it inertia.
    let least = body.inertia.symmetric_eigenvalues().min();
    if carried == body.mass && (least.is_nan() || least < LEAST_INERTIA) {
        return Err(Defect::new(
            "it moves but has no inertia about one of its axes",
            "write three positive numbers as `diaginertia` of its <inertial>",
        ));
    }
    Ok(())
}
