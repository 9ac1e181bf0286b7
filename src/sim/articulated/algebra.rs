//! Vectors, matrices and rotations of eight characters.
//!
//! Sines, cosines and arc tangents are polynomials in the basic operations, because the functions of the C library work on
//! one number at a time and differ between systems in the last bit.

use super::lanes::Lanes;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, PI};
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// A vector of three components.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vec3<L> {
    pub x: L,
    pub y: L,
    pub z: L,
}

impl<L: Lanes> Vec3<L> {
    pub const ZERO: Self = Vec3 {
        x: L::ZERO,
        y: L::ZERO,
        z: L::ZERO,
    };

    #[inline(always)]
    pub fn new(x: L, y: L, z: L) -> Self {
        Vec3 { x, y, z }
    }

    /// The same vector in every lane.
    #[inline(always)]
    pub fn splat(v: &Vector3<f32>) -> Self {
        Vec3::new(L::splat(v.x), L::splat(v.y), L::splat(v.z))
    }

    #[inline(always)]
    pub fn get(&self, lane: usize) -> Vector3<f32> {
        Vector3::new(self.x.get(lane), self.y.get(lane), self.z.get(lane))
    }

    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: &Vector3<f32>) {
        self.x.set(lane, v.x);
        self.y.set(lane, v.y);
        self.z.set(lane, v.z);
    }

    #[inline(always)]
    pub fn dot(&self, other: &Self) -> L {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub fn cross(&self, other: &Self) -> Self {
        Vec3 {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    #[inline(always)]
    pub fn norm(&self) -> L {
        self.dot(self).sqrt()
    }
}

impl<L: Lanes> Add for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Vec3::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<L: Lanes> Sub for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Vec3::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl<L: Lanes> Neg for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Vec3::new(-self.x, -self.y, -self.z)
    }
}

impl<L: Lanes> AddAssign for Vec3<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<L: Lanes> Mul<L> for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: L) -> Self {
        Vec3::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

/// A rotation matrix by columns: the axes of the rotated frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rotation<L>(pub [Vec3<L>; 3]);

impl<L: Lanes> Rotation<L> {
    #[inline(always)]
    pub fn times(&self, v: &Vec3<L>) -> Vec3<L> {
        let [x, y, z] = self.0;
        x * v.x + y * v.y + z * v.z
    }
}

/// A symmetric 3×3 matrix.
#[derive(Clone, Copy, Debug)]
pub(super) struct Symmetric<L> {
    pub xx: L,
    pub yy: L,
    pub zz: L,
    pub xy: L,
    pub xz: L,
    pub yz: L,
}

impl<L: Lanes> Symmetric<L> {
    pub const ZERO: Self = Symmetric {
        xx: L::ZERO,
        yy: L::ZERO,
        zz: L::ZERO,
        xy: L::ZERO,
        xz: L::ZERO,
        yz: L::ZERO,
    };

    /// The same matrix in every lane. Only its upper triangle is read.
    #[inline(always)]
    pub fn splat(m: &Matrix3<f32>) -> Self {
        Symmetric {
            xx: L::splat(m.m11),
            yy: L::splat(m.m22),
            zz: L::splat(m.m33),
            xy: L::splat(m.m12),
            xz: L::splat(m.m13),
            yz: L::splat(m.m23),
        }
    }

    #[inline(always)]
    pub fn times(&self, v: &Vec3<L>) -> Vec3<L> {
        Vec3 {
            x: self.xx * v.x + self.xy * v.y + self.xz * v.z,
            y: self.xy * v.x + self.yy * v.y + self.yz * v.z,
            z: self.xz * v.x + self.yz * v.y + self.zz * v.z,
        }
    }

    /// R S Rᵀ: the matrix of a quantity such as an inertia in the axes that R turns to.
    #[inline(always)]
    pub fn rotated(&self, rotation: &Rotation<L>) -> Self {
        let [a, b, c] = rotation.0;
        // Columns of R S.
        let x = a * self.xx + b * self.xy + c * self.xz;
        let y = a * self.xy + b * self.yy + c * self.yz;
        let z = a * self.xz + b * self.yz + c * self.zz;
        Symmetric {
            xx: x.x * a.x + y.x * b.x + z.x * c.x,
            yy: x.y * a.y + y.y * b.y + z.y * c.y,
            zz: x.z * a.z + y.z * b.z + z.z * c.z,
            xy: x.x * a.y + y.x * b.y + z.x * c.y,
            xz: x.x * a.z + y.x * b.z + z.x * c.z,
            yz: x.y * a.z + y.y * b.z + z.y * c.z,
        }
    }

    /// Inertia about the origin of a point mass at `at`, m (|r|² 1 − r rᵀ): the parallel axis theorem's term.
    #[inline(always)]
    pub fn point_inertia(mass: L, at: &Vec3<L>) -> Self {
        let m = *at * mass;
        let [xx, yy, zz] = [m.x * at.x, m.y * at.y, m.z * at.z];
        Symmetric {
            xx: yy + zz,
            yy: xx + zz,
            zz: xx + yy,
            xy: -(m.x * at.y),
            xz: -(m.x * at.z),
            yz: -(m.y * at.z),
        }
    }

    #[inline(always)]
    pub fn scaled(&self, factor: L) -> Self {
        Symmetric {
            xx: self.xx * factor,
            yy: self.yy * factor,
            zz: self.zz * factor,
            xy: self.xy * factor,
            xz: self.xz * factor,
            yz: self.yz * factor,
        }
    }

    /// S⁻¹ v by Cramer's rule; zero where S is singular.
    #[inline(always)]
    pub fn solve(&self, v: &Vec3<L>) -> Vec3<L> {
        let cofactors = Symmetric {
            xx: self.yy * self.zz - self.yz * self.yz,
            yy: self.xx * self.zz - self.xz * self.xz,
            zz: self.xx * self.yy - self.xy * self.xy,
            xy: self.xz * self.yz - self.xy * self.zz,
            xz: self.xy * self.yz - self.xz * self.yy,
            yz: self.xy * self.xz - self.xx * self.yz,
        };
        let determinant = self.xx * cofactors.xx + self.xy * cofactors.xy + self.xz * cofactors.xz;
        // One over a smaller determinant would be infinite. Such a lane gets zero instead, without a branch.
        let inverse = L::splat(f32::MIN_POSITIVE)
            .below(determinant.abs())
            .select(L::splat(1.0) / determinant, L::ZERO);
        cofactors.times(v) * inverse
    }
}

impl<L: Lanes> Add for Symmetric<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Symmetric {
            xx: self.xx + other.xx,
            yy: self.yy + other.yy,
            zz: self.zz + other.zz,
            xy: self.xy + other.xy,
            xz: self.xz + other.xz,
            yz: self.yz + other.yz,
        }
    }
}

/// A unit quaternion: w = cos(angle / 2), v = axis · sin(angle / 2).
#[derive(Clone, Copy, Debug)]
pub(super) struct Quat<L> {
    pub w: L,
    pub v: Vec3<L>,
}

impl<L: Lanes> Quat<L> {
    #[inline(always)]
    pub fn identity() -> Self {
        Quat {
            w: L::splat(1.0),
            v: Vec3::ZERO,
        }
    }

    #[inline(always)]
    pub fn splat(turn: &UnitQuaternion<f32>) -> Self {
        Quat {
            w: L::splat(turn.w),
            v: Vec3::splat(&turn.imag()),
        }
    }

    #[inline(always)]
    pub fn get(&self, lane: usize) -> UnitQuaternion<f32> {
        UnitQuaternion::new_unchecked(Quaternion::from_parts(self.w.get(lane), self.v.get(lane)))
    }

    #[inline(always)]
    pub fn set(&mut self, lane: usize, turn: &UnitQuaternion<f32>) {
        self.w.set(lane, turn.w);
        self.v.set(lane, &turn.imag());
    }

    #[inline(always)]
    pub fn times(&self, other: &Self) -> Self {
        Quat {
            w: self.w * other.w - self.v.dot(&other.v),
            v: other.v * self.w + self.v * other.w + self.v.cross(&other.v),
        }
    }

    #[inline(always)]
    pub fn inverse(&self) -> Self {
        Quat {
            w: self.w,
            v: -self.v,
        }
    }

    #[inline(always)]
    pub fn normalized(&self) -> Self {
        let share = L::splat(1.0) / (self.w * self.w + self.v.dot(&self.v)).sqrt();
        Quat {
            w: self.w * share,
            v: self.v * share,
        }
    }

    #[inline(always)]
    pub fn to_matrix(self) -> Rotation<L> {
        let Quat { w, v } = self;
        let (double, one) = (v + v, L::splat(1.0));
        let [xx, yy, zz] = [double.x * v.x, double.y * v.y, double.z * v.z];
        let [xy, xz, yz] = [double.x * v.y, double.x * v.z, double.y * v.z];
        let w = double * w;
        Rotation([
            Vec3::new(one - (yy + zz), xy + w.z, xz - w.y),
            Vec3::new(xy - w.z, one - (xx + zz), yz + w.x),
            Vec3::new(xz + w.y, yz - w.x, one - (xx + yy)),
        ])
    }

    /// The rotation by the rotation vector `v`; the identity if `v` is longer than 2π.
    #[inline(always)]
    pub fn from_rotation_vector(v: &Vec3<L>) -> Self {
        // The series are taken at a quarter of the angle, where they converge fast: up to a full turn it is at most π/2.
        // With s and c the sine and cosine of the quarter, the half angle of the quaternion has sin = 2 s c and
        // cos = 1 − 2 s². Everything is a function of the squared angle, so a zero vector needs no special case.
        let (square, full) = (
            v.dot(v) * L::splat(1.0 / 16.0),
            L::splat(FRAC_PI_2 * FRAC_PI_2),
        );
        let (within, square) = (square.below(full), square.min(full));
        let (cos, ratio) = cos_sin(square);
        let share = ratio * cos * L::splat(0.5);
        Quat {
            w: L::splat(1.0) - L::splat(2.0) * ratio * ratio * square,
            v: *v * within.select(share, L::ZERO),
        }
    }

    /// The rotation by `angle`, of any size, about a unit axis.
    #[inline(always)]
    pub fn from_axis_angle(axis: &Vec3<L>, angle: L) -> Self {
        // Half turns of a quarter of the angle are whole turns of the half angle and change nothing. Taking the nearest whole
        // number of them away leaves at most π/2, up to rounding, which the clamp removes.
        let quarter = angle * L::splat(0.25);
        let rotations = (quarter * L::splat(FRAC_1_PI) + L::splat(ROUND)) - L::splat(ROUND);
        let rest = quarter - rotations * L::splat(PI);
        let rest = rest.min(L::splat(FRAC_PI_2)).max(L::splat(-FRAC_PI_2));
        let (cos, ratio) = cos_sin(rest * rest);
        let sin = ratio * rest;
        let double = sin + sin;
        Quat {
            w: L::splat(1.0) - double * sin,
            v: *axis * (double * cos),
        }
    }

    /// The rotation vector, no longer than π: the logarithm of the rotation.
    #[inline(always)]
    pub fn rotation_vector(&self) -> Vec3<L> {
        // tan(angle/4) = |v| / (1 + |w|), half-angle formula, which lies in 0..1. Where it exceeds tan(π/8), the tangent of
        // angle/4 − π/4 is taken instead, (t − 1) / (t + 1), so that the series never sees more than tan(π/8).
        let (one, length) = (L::splat(1.0), self.v.norm());
        let base = one + self.w.abs();
        let tangent = length / base;
        let large = L::splat(TAN_PI_8).below(tangent);
        let reduced = large.select((tangent - one) / (tangent + one), tangent);
        let ratio = arctangent_ratio(reduced * reduced);
        let angle = ratio * reduced + L::splat(FRAC_PI_4);
        // angle/4 = |v| · ratio / (1 + |w|) for small angles: no division by |v|, which may be 0.
        let share = large.select(angle / length, ratio / base) * L::splat(4.0);
        // q and −q are the same rotation; with w < 0 the short way goes along −v.
        let sign = self.w.below(L::ZERO).select(-one, one);
        self.v * (share * sign)
    }
}

/// 1.5 · 2²³: an f32 of this size has no fraction bits, so adding it and subtracting it again rounds a number below 2²² to the
/// nearest whole number.
const ROUND: f32 = 12_582_912.0;
/// tan(π/8) = √2 − 1.
const TAN_PI_8: f32 = 0.414_213_57;

/// cos x and sin x / x from x² ≤ (π/2)², by their Taylor series up to x¹² (the first term left out is below 7e-9).
#[inline(always)]
fn cos_sin<L: Lanes>(square: L) -> (L, L) {
    (alternating(square, 12.0), alternating(square, 13.0))
}

/// The Taylor series 1 − x/(m (m−1)) (1 − x/((m+2) (m+1)) (1 − …)) up to the factor with `n`, by Horner's scheme. With x² for
/// `x` it is cos x for n = 12 and sin x / x for n = 13.
#[inline(always)]
fn alternating<L: Lanes>(x: L, mut n: f32) -> L {
    let mut sum = L::splat(1.0);
    for _ in 0..6 {
        sum = L::splat(1.0) - x * L::splat(1.0 / (n * (n - 1.0))) * sum;
        n -= 2.0;
    }
    sum
}

/// arctan(x) / x from x² ≤ tan²(π/8): the first ten terms 1 − x²/3 + x⁴/5 − … (the first term left out is below 2e-9).
#[inline(always)]
fn arctangent_ratio<L: Lanes>(square: L) -> L {
    let mut sum = L::ZERO;
    let mut n = 19.0;
    for _ in 0..10 {
        sum = L::splat(1.0 / n) - square * sum;
        n -= 2.0;
    }
    sum
}
