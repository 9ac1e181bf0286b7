//! MJCF geoms as solids: their mass properties exactly, their contact shape as sphere, capsule or box.

use super::Shape;
use mjcf_rs::Pose;
use mjcf_rs::body::{Geom, GeomType};
use nalgebra::{Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::PI;

/// Density of a geom that states neither mass nor density, kg/m³ (MuJoCo's default).
const DEFAULT_DENSITY: f64 = 1000.0;

/// A geom's form in its own frame. Heights are half-lengths along z.
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
    pub(super) pose: Isometry3<f64>,
    pub(super) mass: f64,
    pub(super) collides: bool,
    pub(super) friction: f64,
}

/// Our isometry from the parser's pose.
pub(super) fn isometry(pose: &Pose) -> Isometry3<f64> {
    let (t, r) = (pose.translation, pose.rotation);
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(r.w, r.x, r.y, r.z));
    Isometry3::from_parts(Translation3::new(t.x, t.y, t.z), rotation)
}

impl Solid {
    /// `None` for planes and height fields, which are scenery.
    pub(super) fn from_geom(geom: &Geom) -> Result<Option<Self>, String> {
        if matches!(geom.type_, GeomType::Plane | GeomType::Hfield) {
            return Ok(None);
        }
        let (pose, size) = placed(geom)?;
        let form = form(geom.type_, size)?;
        let mass = match geom.mass {
            Some(mass) => mass,
            None => form.volume() * geom.density.unwrap_or(DEFAULT_DENSITY),
        };
        if !(mass >= 0.0 && mass.is_finite()) {
            return Err(format!("its mass {mass} has to be finite and not negative"));
        }
        Ok(Some(Self {
            form,
            pose,
            mass,
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

    /// Contact shape. A cylinder becomes a capsule of the same length (a disc becomes a box), an ellipsoid a
    /// capsule along its longest axis.
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

/// Pose and size with `fromto` resolved as MuJoCo does: the segment sets centre, z axis and half-length.
fn placed(geom: &Geom) -> Result<(Isometry3<f64>, [f64; 3]), String> {
    let Some([ax, ay, az, bx, by, bz]) = geom.fromto else {
        return Ok((isometry(&geom.pose), geom.size));
    };
    let (a, b) = (Vector3::new(ax, ay, az), Vector3::new(bx, by, bz));
    let axis = a - b;
    if !(axis.norm() > 1e-9 && axis.norm().is_finite()) {
        return Err("its `fromto` needs two different points".into());
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

fn form(kind: GeomType, size: [f64; 3]) -> Result<Form, String> {
    let used = match kind {
        GeomType::Sphere => 1,
        GeomType::Capsule | GeomType::Cylinder => 2,
        GeomType::Ellipsoid | GeomType::Box => 3,
        _ => {
            return Err(
                "only sphere, capsule, cylinder, ellipsoid and box geoms are supported: give the \
                 body an <inertial> and simple collision geoms"
                    .into(),
            );
        }
    };
    if size.iter().take(used).any(|s| !(*s > 0.0 && s.is_finite())) {
        return Err(format!("its `size` needs {used} positive numbers"));
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
    /// m³.
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

    /// Principal moments of a homogeneous solid of 1 kg (standard formulas, e.g. Goldstein, Classical Mechanics).
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

/// A cylinder of length `length` with a half ball on each end; each half ball's centroid lies 3/8 of the radius
/// beyond the cylinder's end.
fn capsule_inertia(radius: f64, length: f64) -> Vector3<f64> {
    let (r2, l2) = (radius.powi(2), length.powi(2));
    let ball = 4.0 * radius / (4.0 * radius + 3.0 * length);
    let tube = 1.0 - ball;
    let along = tube * r2 / 2.0 + ball * 0.4 * r2;
    let across =
        tube * (r2 / 4.0 + l2 / 12.0) + ball * (0.4 * r2 + l2 / 4.0 + 3.0 / 8.0 * length * radius);
    Vector3::new(across, across, along)
}

fn sums_of_others(v: &Vector3<f64>) -> Vector3<f64> {
    let s = v.component_mul(v);
    Vector3::new(s.y + s.z, s.x + s.z, s.x + s.y)
}
