//! Vectors, matrices and rotations of eight characters.

use super::lanes::Lanes;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, PI};
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

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
    pub fn of(&self, lane: usize) -> Vector3<f32> {
        Vector3::new(self.x.of(lane), self.y.of(lane), self.z.of(lane))
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

/// A rotation matrix, by columns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rotation<L>(pub [Vec3<L>; 3]);

impl<L: Lanes> Rotation<L> {
    #[inline(always)]
    pub fn times(&self, v: &Vec3<L>) -> Vec3<L> {
        let [x, y, z] = self.0;
        x * v.x + y * v.y + z * v.z
    }
}

/// A symmetric matrix.
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

    /// The same matrix in every lane; its upper triangle is read.
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

    /// R S Rᵀ.
    #[inline(always)]
    pub fn turned(&self, rotation: &Rotation<L>) -> Self {
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

    /// Second moment of `mass` at `at`: mass (|at|² 1 − at atᵀ).
    #[inline(always)]
    pub fn parallel(mass: L, at: &Vec3<L>) -> Self {
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

    /// S⁻¹ v by cofactors; zero where S has no inverse.
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
        let inverse = L::splat(f32::MIN_POSITIVE)
            .below(determinant.abs())
            .choose(L::splat(1.0) / determinant, L::ZERO);
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

/// A unit quaternion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn<L> {
    pub w: L,
    pub v: Vec3<L>,
}

impl<L: Lanes> Turn<L> {
    #[inline(always)]
    pub fn identity() -> Self {
        Turn {
            w: L::splat(1.0),
            v: Vec3::ZERO,
        }
    }

    #[inline(always)]
    pub fn splat(turn: &UnitQuaternion<f32>) -> Self {
        Turn {
            w: L::splat(turn.w),
            v: Vec3::splat(&turn.imag()),
        }
    }

    #[inline(always)]
    pub fn of(&self, lane: usize) -> UnitQuaternion<f32> {
        UnitQuaternion::new_unchecked(Quaternion::from_parts(self.w.of(lane), self.v.of(lane)))
    }

    #[inline(always)]
    pub fn set(&mut self, lane: usize, turn: &UnitQuaternion<f32>) {
        self.w.set(lane, turn.w);
        self.v.set(lane, &turn.imag());
    }

    #[inline(always)]
    pub fn times(&self, other: &Self) -> Self {
        Turn {
            w: self.w * other.w - self.v.dot(&other.v),
            v: other.v * self.w + self.v * other.w + self.v.cross(&other.v),
        }
    }

    #[inline(always)]
    pub fn inverse(&self) -> Self {
        Turn {
            w: self.w,
            v: -self.v,
        }
    }

    #[inline(always)]
    pub fn normalized(&self) -> Self {
        let share = L::splat(1.0) / (self.w * self.w + self.v.dot(&self.v)).sqrt();
        Turn {
            w: self.w * share,
            v: self.v * share,
        }
    }

    #[inline(always)]
    pub fn matrix(&self) -> Rotation<L> {
        let Turn { w, v } = *self;
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

    /// Turn by the rotation vector `v`, not farther than a full one.
    #[inline(always)]
    pub fn by(v: &Vec3<L>) -> Self {
        // Of a quarter of the angle, which doubling it twice makes the half angle of a quaternion and then the angle.
        let (square, full) = (
            v.dot(v) * L::splat(1.0 / 16.0),
            L::splat(FRAC_PI_2 * FRAC_PI_2),
        );
        let (within, square) = (square.below(full), square.min(full));
        let (cos, ratio) = cos_sin(square);
        let share = ratio * cos * L::splat(0.5);
        Turn {
            w: L::splat(1.0) - L::splat(2.0) * ratio * ratio * square,
            v: *v * within.choose(share, L::ZERO),
        }
    }

    /// Turn by `angle` about a unit axis.
    #[inline(always)]
    pub fn about(axis: &Vec3<L>, angle: L) -> Self {
        // A quarter of the angle, less whole half turns of it.
        let quarter = angle * L::splat(0.25);
        let turns = (quarter * L::splat(FRAC_1_PI) + L::splat(ROUND)) - L::splat(ROUND);
        let rest = quarter - turns * L::splat(PI);
        let rest = rest.min(L::splat(FRAC_PI_2)).max(L::splat(-FRAC_PI_2));
        let (cos, ratio) = cos_sin(rest * rest);
        let sin = ratio * rest;
        let double = sin + sin;
        Turn {
            w: L::splat(1.0) - double * sin,
            v: *axis * (double * cos),
        }
    }

    /// The rotation vector, not longer than π.
    #[inline(always)]
    pub fn vector(&self) -> Vec3<L> {
        // tan(angle/4) = |v| / (1 + |w|): at most 1, and at most tan(π/8) after one more reduction.
        let (one, length) = (L::splat(1.0), self.v.norm());
        let base = one + self.w.abs();
        let tangent = length / base;
        let large = L::splat(TAN_PI_8).below(tangent);
        let reduced = large.choose((tangent - one) / (tangent + one), tangent);
        let ratio = arctangent_ratio(reduced * reduced);
        let angle = ratio * reduced + L::splat(FRAC_PI_4);
        // Of a small one |v| isn't divided by.
        let share = large.choose(angle / length, ratio / base) * L::splat(4.0);
        let sign = self.w.below(L::ZERO).choose(-one, one);
        self.v * (share * sign)
    }
}

/// Added and taken away again it leaves the nearest whole number of less than 2²².
const ROUND: f32 = 12_582_912.0;
const TAN_PI_8: f32 = 0.414_213_57;

/// cos x and sin x / x of x² up to (π/2)², by their Taylor series.
#[inline(always)]
fn cos_sin<L: Lanes>(square: L) -> (L, L) {
    (alternating(square, 12.0), alternating(square, 13.0))
}

/// 1 − x/(m (m − 1)) + … with m the smallest of n, n − 2, … above 1, up to the term that n ends.
#[inline(always)]
fn alternating<L: Lanes>(x: L, mut n: f32) -> L {
    let mut sum = L::splat(1.0);
    for _ in 0..6 {
        sum = L::splat(1.0) - x * L::splat(1.0 / (n * (n - 1.0))) * sum;
        n -= 2.0;
    }
    sum
}

/// arctan(x) / x of x² up to tan²(π/8): the first ten terms of its series, which leave 3e-9.
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
