//! From a node's transform properties to its world transform, as FBX composes them.

use nalgebra::{Matrix3, Matrix4, Rotation3, UnitQuaternion, Vector3};

/// A transform property that a curve may drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Property {
    Translation,
    Rotation,
    Scaling,
    PreRotation,
    PostRotation,
    RotationOffset,
    RotationPivot,
    ScalingOffset,
    ScalingPivot,
}

impl Property {
    pub const ALL: [(&'static str, Self); 9] = [
        ("Lcl Translation", Self::Translation),
        ("Lcl Rotation", Self::Rotation),
        ("Lcl Scaling", Self::Scaling),
        ("PreRotation", Self::PreRotation),
        ("PostRotation", Self::PostRotation),
        ("RotationOffset", Self::RotationOffset),
        ("RotationPivot", Self::RotationPivot),
        ("ScalingOffset", Self::ScalingOffset),
        ("ScalingPivot", Self::ScalingPivot),
    ];

    /// The property that a connection names.
    pub fn named(name: &[u8]) -> Option<Self> {
        Self::ALL
            .iter()
            .find(|(known, _)| known.as_bytes() == name)
            .map(|&(_, property)| property)
    }
}

/// Values of all transform properties: rotations are Euler angles in degrees, positions are in the file's units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose([Vector3<f64>; 9]);

impl Pose {
    /// Scale 1, everything else 0.
    pub fn identity() -> Self {
        let mut pose = Self([Vector3::zeros(); 9]);
        *pose.at_mut(Property::Scaling) = Vector3::repeat(1.0);
        pose
    }

    /// The value of a property.
    pub fn at(&self, property: Property) -> Vector3<f64> {
        self.0[property as usize]
    }

    /// The value of a property, to be changed.
    pub fn at_mut(&mut self, property: Property) -> &mut Vector3<f64> {
        &mut self.0[property as usize]
    }
}

/// The axes (0 to 2) in the order in which Euler angles turn about them.
pub(super) type Order = [usize; 3];
pub(super) const XYZ: Order = [0, 1, 2];

/// The order that `RotationOrder` means. The spheric order, 6, is XYZ: it differs only in how software interpolates.
pub(super) fn rotation_order(code: i64) -> Order {
    match code {
        1 => [0, 2, 1],
        2 => [1, 2, 0],
        3 => [1, 0, 2],
        4 => [2, 0, 1],
        5 => [2, 1, 0],
        _ => XYZ,
    }
}

/// Which part of its parent's scale a node inherits, by FBX's names: R and S are the parent's rotation and scale, r and s the
/// node's own, multiplied in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Inherit {
    /// The parent's scale acts along the node's own axes, without shear.
    RrSs,
    /// The ordinary matrix product.
    RSrs,
    /// The parent's own scale is left out; what the parent inherited stays.
    Rrs,
}

/// How a node's properties become its transform.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    /// Order of its Euler angles.
    pub order: Order,
    /// Whether pre- and post-rotation and the rotation order count.
    pub rotation_space: bool,
    /// Which scale it inherits.
    pub inherit: Inherit,
}

/// Rotation of Euler angles in degrees.
pub(super) fn from_euler(degrees: Vector3<f64>, order: Order) -> Matrix3<f64> {
    // Angles turn about fixed axes, the first one first, so later rotations multiply from the left.
    order.iter().fold(Matrix3::identity(), |m, &axis| {
        about(axis, degrees[axis]) * m
    })
}

/// Rotation about a coordinate axis, exact for 0: most angles of a rig are, and then nothing is rounded.
fn about(axis: usize, degrees: f64) -> Matrix3<f64> {
    let mut m = Matrix3::identity();
    if degrees != 0.0 {
        let (sin, cos) = degrees.to_radians().sin_cos();
        // The two other axes in cyclic order, in which a positive angle turns j towards k.
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        m[(j, j)] = cos;
        m[(k, k)] = cos;
        m[(j, k)] = -sin;
        m[(k, j)] = sin;
    }
    m
}

/// Euler angles of a rotation, degrees; the middle one within ±90°.
///
/// With axes i, j, k the rotation is R_k R_j R_i. Its entry (k, i) is −sin of the middle angle for even orders (i, j, k = x, y, z
/// and its shifts) and +sin for odd ones; the two others follow from the rest of column i and row k. At ±90°, to a billionth
/// of the sine, only their sum or difference is defined, and the first angle is 0.
pub(super) fn to_euler(m: &Matrix3<f64>, order: Order) -> Vector3<f64> {
    let [i, j, k] = order;
    let parity = if (i + 1) % 3 == j { 1.0 } else { -1.0 };
    // Rounding may carry the sine beyond 1, where its arc is undefined.
    let sin = (-parity * m[(k, i)]).clamp(-1.0, 1.0);
    let mut angles = Vector3::zeros();
    angles[j] = sin.asin();
    if sin.abs() < 0.999_999_999 {
        angles[i] = (parity * m[(k, j)]).atan2(m[(k, k)]);
        angles[k] = (parity * m[(j, i)]).atan2(m[(i, i)]);
    } else {
        // At a pole both outer axes coincide: the first angle stays 0 and the last one has all of the turn.
        angles[k] = (-parity * m[(i, j)]).atan2(m[(j, j)]);
    }
    angles.map(f64::to_degrees)
}

/// The rotation a fraction `weight` of the way from `a` to `b`, the shorter way round.
pub(super) fn slerp(a: &Matrix3<f64>, b: &Matrix3<f64>, weight: f64) -> Matrix3<f64> {
    let way = Rotation3::from_matrix_unchecked(a.transpose() * b);
    // The axis of a quaternion is exact near 180°, where that of a matrix isn't.
    let step = UnitQuaternion::from_rotation_matrix(&way).powf(weight);
    a * step.to_rotation_matrix().matrix()
}

/// The transform of a node in its parent: scale, then rotate, then translate.
pub(super) struct Local {
    /// In the file's units.
    pub translation: Vector3<f64>,
    /// Parent from node, without scale.
    pub rotation: Matrix3<f64>,
    /// Along the node's axes.
    pub scale: Vector3<f64>,
}

/// The transform of a node's properties: `T·Roff·Rp·Rpre·R·Rpost⁻¹·Rp⁻¹·Soff·Sp·S·Sp⁻¹`, the chain of the FBX SDK's documentation
/// ("Computing transformation matrices"). All factors but R, Rpre, Rpost and S are translations, so that its linear part is
/// Rpre·R·Rpost⁻¹·S. Its translation follows by applying the chain to the origin, from the right: −Sp, scaled, + Sp + Soff − Rp,
/// rotated, + Rp + Roff + T. Pre- and post-rotation are always in XYZ order.
fn local(pose: &Pose, rules: &Rules) -> Local {
    use Property::*;
    // Without its rotation space active, a node ignores pre- and post-rotation and its order of axes.
    let rotation = if rules.rotation_space {
        let own = from_euler(pose.at(Rotation), rules.order);
        from_euler(pose.at(PreRotation), XYZ)
            * own
            * from_euler(pose.at(PostRotation), XYZ).transpose()
    } else {
        from_euler(pose.at(Rotation), XYZ)
    };
    let scale = pose.at(Scaling);
    let (pivot, centre) = (pose.at(RotationPivot), pose.at(ScalingPivot));
    // The chain applied to the origin, up to the rotation: −Sp, scaled, + Sp + Soff − Rp.
    let turned = pose.at(ScalingOffset) + centre - scale.component_mul(&centre) - pivot;
    let translation = pose.at(Translation) + pose.at(RotationOffset) + pivot + rotation * turned;
    Local {
        translation,
        rotation,
        scale,
    }
}

/// The world transform of a node, in the file's axes and units. Its linear part is `frame` times the diagonal of `scale`.
#[derive(Clone, Copy, Debug)]
pub(super) struct World {
    /// A rotation, unless an ancestor shears.
    frame: Matrix3<f64>,
    scale: Vector3<f64>,
    /// The part of `scale` that comes from the ancestors.
    received: Vector3<f64>,
    translation: Vector3<f64>,
}

impl World {
    /// The transform of the scene itself.
    pub fn root() -> Self {
        let one = Vector3::repeat(1.0);
        Self {
            frame: Matrix3::identity(),
            scale: one,
            received: one,
            translation: Vector3::zeros(),
        }
    }

    /// The world transform of a child with these properties.
    pub fn child(&self, pose: &Pose, rules: &Rules) -> Self {
        self.below(&local(pose, rules), rules.inherit)
    }

    /// The world transform of a child whose transform in this node is `local`.
    pub fn below(&self, local: &Local, inherit: Inherit) -> Self {
        // How the parent's scale reaches the child: in its axes, along the child's own axes, or only what the parent received.
        let (frame, received) = match inherit {
            Inherit::RSrs => (self.linear(), Vector3::repeat(1.0)),
            Inherit::RrSs => (self.frame, self.scale),
            Inherit::Rrs => (self.frame, self.received),
        };
        Self {
            frame: frame * local.rotation,
            scale: local.scale.component_mul(&received),
            received,
            // Positions always follow the parent's full linear part, whatever the child inherits.
            translation: self.translation + self.linear() * local.translation,
        }
    }

    fn linear(&self) -> Matrix3<f64> {
        let mut linear = self.frame;
        for (mut column, scale) in linear.column_iter_mut().zip(&self.scale) {
            column *= *scale;
        }
        linear
    }

    /// As a matrix.
    pub fn matrix(&self) -> Matrix4<f64> {
        let mut matrix = self.linear().to_homogeneous();
        matrix
            .fixed_view_mut::<3, 1>(0, 3)
            .copy_from(&self.translation);
        matrix
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn euler_angles_of_a_rotation_give_that_rotation_back() {
        for code in 0..6 {
            let order = rotation_order(code);
            for step in 0..1000 {
                let angle = |rate: f64| f64::from(step) * rate % 360.0 - 180.0;
                // Every tenth has its middle angle at a pole.
                let mut degrees = Vector3::new(angle(7.1), angle(13.3), angle(29.7));
                if step % 10 == 0 {
                    degrees[order[1]] = 90f64.copysign(degrees[0]);
                }
                let rotation = from_euler(degrees, order);
                assert_relative_eq!(
                    from_euler(to_euler(&rotation, order), order),
                    rotation,
                    epsilon = 1e-7
                );
            }
        }
    }

    #[test]
    fn xyz_turns_about_x_first() {
        let turned = from_euler(Vector3::new(90.0, 0.0, 90.0), XYZ) * Vector3::y();
        assert_relative_eq!(turned, Vector3::z(), epsilon = 1e-15);
    }
}
