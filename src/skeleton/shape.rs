//! MJCF geoms as solids, with exact mass properties, and the sphere, capsule or box that stands for each in contacts.

use super::Shape;
use super::build::{MOST_LENGTH, MOST_MASS, is_near};
use super::error::Defect;
use mjcf_rs::Pose;
use mjcf_rs::body::{Geom, GeomType};
use nalgebra::{Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::PI;

/// Density of a geom that states neither mass nor density, kg/m³ (MuJoCo's default).
const DEFAULT_DENSITY: f64 = 1000.0;

/// The form of a geom in its own frame, metres. Capsules and cylinders lie along z, `half` being half their length without
/// the caps.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    Sphere { radius: f64 },
    Capsule { radius: f64, half: f64 },
    Cylinder { radius: f64, half: f64 },
    Ellipsoid { semi: Vector3<f64> },
    Box { half: Vector3<f64> },
}

/// A geom with volume, placed in its body's frame.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Solid {
    form: Form,
    /// Body from geom.
    pub(super) pose: Isometry3<f64>,
    /// kg.
    pub(super) mass: f64,
    /// Whether it takes part in contacts, or is only drawn and weighed.
    pub(super) collides: bool,
    /// Sliding friction coefficient.
    pub(super) friction: f64,
}

/// Our isometry from the parser's pose.
pub(super) fn isometry(pose: &Pose) -> Isometry3<f64> {
    let (t, r) = (pose.translation, pose.rotation);
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(r.w, r.x, r.y, r.z));
    Isometry3::from_parts(Translation3::new(t.x, t.y, t.z), rotation)
}

impl Solid {
    /// The solid of a geom; `None` for planes and height fields, which are scenery.
    pub(super) fn from_geom(geom: &Geom) -> Result<Option<Self>, Defect> {
        if matches!(geom.type_, GeomType::Plane | GeomType::Hfield) {
            return Ok(None);
        }
        if geom.friction.iter().any(|x| x.is_nan() || *x < 0.0) {
            return Err(Defect::new(
                "a number of its `friction` is negative or not finite",
                "write 0 or positive numbers",
            ));
        }
        let (pose, size) = placed(geom)?;
        let is_sound = pose.to_homogeneous().iter().all(|x| x.is_finite());
        if !(is_sound && is_near(&pose.translation.vector)) {
            return Err(Defect::new(
                "its `pos`, `fromto` or rotation is not finite or too large",
                format!("write finite numbers of at most {MOST_LENGTH} m"),
            ));
        }
        let form = form(geom.type_, size)?;
        let mass = match geom.mass {
            Some(mass) => mass,
            None => form.volume() * geom.density.unwrap_or(DEFAULT_DENSITY),
        };
        if !(0.0..=MOST_MASS).contains(&mass) {
            return Err(Defect::new(
                format!("its mass of {mass:.4e} kg is negative or too large"),
                format!("write a mass from 0 to {MOST_MASS:e} kg, or a `density` that makes one"),
            ));
        }
        Ok(Some(Self {
            form,
            pose,
            mass,
            // MuJoCo: a geom with neither bit can touch nothing.
            collides: geom.contype != 0 || geom.conaffinity != 0,
            friction: geom.friction[0],
        }))
    }

    /// Inertia about the solid's own centre, along the body's axes, kg·m².
    pub(super) fn inertia(&self) -> Matrix3<f64> {
        let r = self.pose.rotation.to_rotation_matrix();
        let principal = self.form.unit_inertia() * self.mass;
        r * Matrix3::from_diagonal(&principal) * r.transpose()
    }

    /// The shape that stands for it in contacts. A cylinder becomes a capsule of the same length, or a box if it is wider than
    /// long. An ellipsoid becomes a capsule along its longest axis, as thick as the geometric mean of the other two.
    pub(super) fn shape(&self) -> Shape {
        let center = self.pose.translation.vector;
        match self.form {
            Form::Sphere { radius } => Shape::Sphere { center, radius },
            Form::Capsule { radius, half } => self.capsule(Vector3::z() * half, radius),
            Form::Cylinder { radius, half } if half > radius => {
                self.capsule(Vector3::z() * (half - radius), radius)
            }
            Form::Cylinder { radius, half } => Shape::Box {
                pose: self.pose,
                half: Vector3::new(radius, radius, half),
            },
            Form::Ellipsoid { semi } => {
                let long = semi.imax();
                let radius = (semi.product() / semi[long]).sqrt();
                let mut along = Vector3::zeros();
                along[long] = (semi[long] - radius).max(0.0);
                self.capsule(along, radius)
            }
            Form::Box { half } => Shape::Box {
                pose: self.pose,
                half,
            },
        }
    }

    fn capsule(&self, along: Vector3<f64>, radius: f64) -> Shape {
        let center = self.pose.translation.vector;
        let along = self.pose.rotation * along;
        Shape::Capsule {
            a: center - along,
            b: center + along,
            radius,
        }
    }
}

/// Pose and size of a geom, with `fromto` resolved as in MuJoCo: the segment sets centre, z axis and half-length.
fn placed(geom: &Geom) -> Result<(Isometry3<f64>, [f64; 3]), Defect> {
    let Some([ax, ay, az, bx, by, bz]) = geom.fromto else {
        return Ok((isometry(&geom.pose), geom.size));
    };
    let (a, b) = (Vector3::new(ax, ay, az), Vector3::new(bx, by, bz));
    // MuJoCo's z axis points from the second point to the first.
    let axis = a - b;
    if !(axis.norm() > 1e-9 && axis.norm().is_finite()) {
        return Err(Defect::new(
            "the two points of its `fromto` are the same or not finite",
            "write two different points",
        ));
    }
    let rotation = UnitQuaternion::rotation_between(&Vector3::z(), &axis)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI));
    let half = axis.norm() / 2.0;
    let [width, ..] = geom.size;
    let size = match geom.type_ {
        GeomType::Box | GeomType::Ellipsoid => [width, width, half],
        _ => [width, half, 0.0],
    };
    let pose = Isometry3::from_parts(((a + b) / 2.0).into(), rotation);
    Ok((pose, size))
}

fn form(kind: GeomType, size: [f64; 3]) -> Result<Form, Defect> {
    let used = match kind {
        GeomType::Sphere => 1,
        GeomType::Capsule | GeomType::Cylinder => 2,
        GeomType::Ellipsoid | GeomType::Box => 3,
        _ => {
            return Err(Defect::new(
                "only sphere, capsule, cylinder, ellipsoid and box geoms are supported",
                "give the body an <inertial>, and collision geoms of these types",
            ));
        }
    };
    if size
        .iter()
        .take(used)
        .any(|s| !(*s > 0.0 && *s <= MOST_LENGTH))
    {
        return Err(Defect::new(
            "a number of its `size` is missing, not positive or too large",
            format!("write {used} positive number(s) of at most {MOST_LENGTH} m"),
        ));
    }
    let [a, b, c] = size;
    Ok(match kind {
        GeomType::Sphere => Form::Sphere { radius: a },
        GeomType::Capsule => Form::Capsule { radius: a, half: b },
        GeomType::Cylinder => Form::Cylinder { radius: a, half: b },
        GeomType::Ellipsoid => Form::Ellipsoid {
            semi: Vector3::new(a, b, c),
        },
        _ => Form::Box {
            half: Vector3::new(a, b, c),
        },
    })
}

impl Form {
    /// Volume, m³.
    fn volume(self) -> f64 {
        match self {
            Form::Sphere { radius } => 4.0 / 3.0 * PI * radius.powi(3),
            Form::Capsule { radius, half } => {
                PI * radius.powi(2) * (2.0 * half + 4.0 / 3.0 * radius)
            }
            Form::Cylinder { radius, half } => PI * radius.powi(2) * 2.0 * half,
            Form::Ellipsoid { semi } => 4.0 / 3.0 * PI * semi.product(),
            Form::Box { half } => 8.0 * half.product(),
        }
    }

    /// Principal moments of inertia of a homogeneous solid of 1 kg, m²: the formulas of any table of moments of inertia.
    fn unit_inertia(self) -> Vector3<f64> {
        match self {
            Form::Sphere { radius } => Vector3::repeat(0.4 * radius.powi(2)),
            Form::Capsule { radius, half } => capsule_inertia(radius, 2.0 * half),
            Form::Cylinder { radius, half } => {
                let across = radius.powi(2) / 4.0 + half.powi(2) / 3.0;
                Vector3::new(across, across, radius.powi(2) / 2.0)
            }
            Form::Ellipsoid { semi } => sums_of_others(&semi) / 5.0,
            Form::Box { half } => sums_of_others(&half) / 3.0,
        }
    }
}

/// Principal moments of a capsule of 1 kg: a cylinder of length `length` with a half ball on each end.
///
/// The two half balls together have a ball's 2/5 r² about the cylinder's end. The centroid of each lies 3/8 r beyond that
/// end, so moving it out by l/2 adds l²/4 + 2 · l/2 · 3/8 r (parallel axis theorem, twice).
fn capsule_inertia(radius: f64, length: f64) -> Vector3<f64> {
    let (r2, l2) = (radius.powi(2), length.powi(2));
    // Share of the ball's volume, 4/3 π r³ to 4/3 π r³ + π r² l.
    let ball = 4.0 * radius / (4.0 * radius + 3.0 * length);
    let tube = 1.0 - ball;
    let along = tube * r2 / 2.0 + ball * 0.4 * r2;
    let across =
        tube * (r2 / 4.0 + l2 / 12.0) + ball * (0.4 * r2 + l2 / 4.0 + 3.0 / 8.0 * length * radius);
    Vector3::new(across, across, along)
}

/// (y² + z², x² + z², x² + y²).
fn sums_of_others(v: &Vector3<f64>) -> Vector3<f64> {
    let s = v.component_mul(v);
    Vector3::new(s.y + s.z, s.x + s.z, s.x + s.y)
}
