//! MJCF text to [`Skeleton`].

use super::inertia::{MassProperties, set_total_mass};
use super::shape::{Solid, isometry};
use super::{Body, Joint, JointKind, Skeleton, SkeletonError, drive, guard, slots};
use mjcf_rs::Model;
use mjcf_rs::body::{Body as MjcfBody, GeomType, Joint as MjcfJoint, JointType};
use mjcf_rs::compiler::InertiaFromGeom;
use nalgebra::Vector3;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Characters compiled into the library: name, MJCF, slots.
const BUILT_IN: [(&str, &str, &str); 3] = [
    (
        "humanoid",
        include_str!("../../skeletons/humanoid.xml"),
        include_str!("../../skeletons/humanoid.json"),
    ),
    (
        "marathon",
        include_str!("../../skeletons/marathon.xml"),
        include_str!("../../skeletons/marathon.json"),
    ),
    (
        "robot",
        include_str!("../../skeletons/robot.xml"),
        include_str!("../../skeletons/robot.json"),
    ),
];

impl Skeleton {
    /// Names of the built-in characters.
    pub fn built_in() -> impl Iterator<Item = &'static str> {
        BUILT_IN.iter().map(|(name, ..)| *name)
    }

    /// Loads a built-in character by name, or an MJCF file by path, with `NAME.json` beside it if it is there.
    pub fn load(name_or_path: &str) -> Result<Self, SkeletonError> {
        if let Some((name, xml, json)) = BUILT_IN.iter().find(|(name, ..)| *name == name_or_path) {
            return Self::from_mjcf(name, xml, Some(json));
        }
        let path = Path::new(name_or_path);
        if path.extension().is_none() && !path.exists() {
            return Err(SkeletonError::UnknownName {
                name: name_or_path.into(),
                known: Self::built_in().collect::<Vec<_>>().join(", "),
            });
        }
        let xml = read(path)?;
        let beside = path.with_extension("json");
        let json = beside.is_file().then(|| read(&beside)).transpose()?;
        let name = path
            .file_stem()
            .map_or_else(|| name_or_path.into(), |s| s.to_string_lossy().into_owned());
        Self::from_mjcf(&name, &xml, json.as_deref())
    }

    /// Reads MJCF text, as MuJoCo would compile it, into a character.
    ///
    /// `slots_json` is `{"slots": {"hips": "pelvis", …}}`; without it slots are guessed from body names. The
    /// text has to hold one character whose top body has a free joint, and may hold static scenery, which is
    /// ignored. Position servos become drives; a joint with a mere torque motor takes its drive from its
    /// `stiffness` and `damping` if that spring reaches the motor's limit within a radian, and else gains of
    /// 4 × (limit) N·m/rad with a tenth of that as damping.
    pub fn from_mjcf(
        name: &str,
        xml: &str,
        slots_json: Option<&str>,
    ) -> Result<Self, SkeletonError> {
        let mjcf = |message: String| SkeletonError::Mjcf {
            skeleton: name.into(),
            message,
        };
        guard::check(xml).map_err(mjcf)?;
        let model = Model::from_str(xml, ".").map_err(|e| mjcf(e.to_string()))?;
        let mut builder = Builder::new(name, &model);
        builder.add_bodies()?;
        let Builder {
            mut bodies, nq, nv, ..
        } = builder;
        set_total_mass(&mut bodies, model.compiler.set_total_mass);
        check_masses(name, &bodies)?;
        let slots = match slots_json {
            Some(json) => {
                slots::from_json(json, &bodies).map_err(|message| SkeletonError::Slots {
                    skeleton: name.into(),
                    message,
                })?
            }
            None => slots::from_names(&bodies),
        };
        Ok(Self {
            name: name.into(),
            sha256: format!("{:x}", Sha256::digest(xml.as_bytes())),
            mjcf: xml.into(),
            bodies,
            slots,
            nq,
            nv,
        })
    }
}

fn read(path: &Path) -> Result<String, SkeletonError> {
    std::fs::read_to_string(path).map_err(|source| SkeletonError::Read {
        path: PathBuf::from(path),
        source,
    })
}

/// Every body that moves on its own needs mass, in itself or in bodies welded to it.
fn check_masses(skeleton: &str, bodies: &[Body]) -> Result<(), SkeletonError> {
    let mut carried: Vec<f64> = bodies.iter().map(|b| b.mass).collect();
    for (index, body) in bodies.iter().enumerate().rev() {
        match body.parent {
            Some(parent) if body.joints.is_empty() => carried[parent] += carried[index],
            _ if carried[index] > 0.0 => {}
            _ => {
                return Err(SkeletonError::Unsupported {
                    skeleton: skeleton.into(),
                    place: format!("body `{}`", body.name),
                    message: "it moves but has no mass; give it a geom or an <inertial>".into(),
                });
            }
        }
    }
    Ok(())
}

/// Collects the bodies of the character out of a parsed model.
struct Builder<'a> {
    skeleton: &'a str,
    model: &'a Model,
    bodies: Vec<Body>,
    /// Our index of each of the model's bodies, `None` for scenery.
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

    fn error(&self, place: String, message: impl Into<String>) -> SkeletonError {
        SkeletonError::Unsupported {
            skeleton: self.skeleton.into(),
            place,
            message: message.into(),
        }
    }

    fn add_bodies(&mut self) -> Result<(), SkeletonError> {
        let model = self.model;
        for (id, entry) in model.bodies_iter() {
            let parent = entry.parent.and_then(|p| self.index.get(p).copied());
            let parent = parent.flatten();
            let joints = &entry.body.joints;
            let free = joints.iter().any(|j| j.type_ == JointType::Free);
            let name = entry.body.name.clone();
            let name = name.unwrap_or_else(|| format!("body{id}"));
            if parent.is_none() && joints.is_empty() {
                continue;
            }
            self.check_place(&name, parent.is_some(), free, joints.len())?;
            let body = self.body(name, parent, &entry.body)?;
            self.index[id] = Some(self.bodies.len());
            self.bodies.push(body);
        }
        if self.bodies.is_empty() {
            return Err(self.error(
                "worldbody".into(),
                "it has no body with a free joint; add <freejoint/> to the character's top body",
            ));
        }
        Ok(())
    }

    /// That a body fits into the one tree on a free root.
    fn check_place(
        &self,
        name: &str,
        has_parent: bool,
        free: bool,
        joints: usize,
    ) -> Result<(), SkeletonError> {
        let problem = match (has_parent, free) {
            (false, false) => {
                "it moves, but no body above it has a free joint; add <freejoint/> to the \
                 character's top body, and take scenery with joints away"
            }
            (false, true) if !self.bodies.is_empty() => {
                "it is a second moving tree; keep the character alone in the file"
            }
            (false, true) if joints > 1 => "a free joint has to be its body's only joint",
            (true, true) => "only the top body can have a free joint",
            _ if self.bodies.iter().any(|b| b.name == name) => "the name is used twice",
            _ => return Ok(()),
        };
        Err(self.error(format!("body `{name}`"), problem))
    }

    fn body(
        &mut self,
        name: String,
        parent: Option<usize>,
        body: &MjcfBody,
    ) -> Result<Body, SkeletonError> {
        let place = format!("body `{name}`");
        let rest = isometry(&body.pose);
        if !rest.to_homogeneous().iter().all(|x| x.is_finite()) {
            return Err(self.error(place, "its `pos` or rotation is not finite"));
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
            if meshed && drawn_only && body.inertial.is_some() {
                continue;
            }
            let label = geom.name.as_deref().unwrap_or("without a name");
            let solid = Solid::from_geom(geom)
                .map_err(|message| self.error(format!("{place}, geom {label}"), message))?;
            solids.extend(solid);
        }
        Ok(solids)
    }

    /// `<inertial>` or geoms, as `<compiler inertiafromgeom>` says.
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
            (Some(inertial), _) => MassProperties::from_inertial(inertial)
                .map_err(|message| self.error(place.into(), message))?,
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
        let place = format!("joint `{name}`");
        if joint.ref_ != 0.0 {
            return Err(self.error(place, "a `ref` offset is not supported; set it to 0"));
        }
        let kind = self.joint_kind(joint, &place)?;
        let anchor = Vector3::from(joint.pos);
        if !anchor.iter().all(|x| x.is_finite()) {
            return Err(self.error(place, "its `pos` is not finite"));
        }
        let (drives, limits) = drive::drives(joint, kind, self.model)
            .map_err(|message| self.error(place.clone(), message))?;
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
            Vector3::from(joint.axis)
                .try_normalize(1e-9)
                .filter(|a| a.iter().all(|x| x.is_finite()))
                .ok_or_else(|| self.error(place.into(), "its `axis` has no direction"))
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

impl JointKind {
    /// Coordinates in `qpos`.
    pub fn nq(self) -> usize {
        match self {
            Self::Free => 7,
            Self::Ball => 4,
            Self::Hinge(_) | Self::Slide(_) => 1,
        }
    }

    /// Degrees of freedom in `qvel`.
    pub fn nv(self) -> usize {
        match self {
            Self::Free => 6,
            Self::Ball => 3,
            Self::Hinge(_) | Self::Slide(_) => 1,
        }
    }
}
