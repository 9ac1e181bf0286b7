//! Spatial vectors and inertias of eight characters: chapter 2 of Featherstone, "Rigid Body Dynamics Algorithms", Springer
//! 2008, which comments in this folder call RBDA.
//!
//! All of them are in world axes and about one common point, the root's origin, so that vectors of different bodies can be
//! added and multiplied without transforms between them.

use super::algebra::{Symmetric, Vec3};
use super::lanes::Lanes;
use std::ops::{Add, AddAssign, Mul, Sub};

/// A velocity or an acceleration: angular, rad/s, and linear, m/s, of the point of the body that is at the common point just
/// now (RBDA's motion vector).
#[derive(Clone, Copy, Debug)]
pub(super) struct MotionVector<L> {
    pub angular: Vec3<L>,
    pub linear: Vec3<L>,
}

/// A force, an impulse or a momentum, and its moment about the common point (RBDA's force vector).
#[derive(Clone, Copy, Debug)]
pub(super) struct ForceVector<L> {
    pub moment: Vec3<L>,
    pub force: Vec3<L>,
}

/// The inertia of a rigid body about the common point (RBDA §2.13): a linear map from velocity to momentum.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpatialInertia<L> {
    /// kg.
    pub mass: L,
    /// Mass times centre of mass, kg·m.
    first_moment: Vec3<L>,
    /// Rotational inertia about the common point, kg·m².
    rotational: Symmetric<L>,
}

impl<L: Lanes> MotionVector<L> {
    pub const ZERO: Self = MotionVector {
        angular: Vec3::ZERO,
        linear: Vec3::ZERO,
    };

    /// Rotation at unit rate about the unit vector `axis` through the point `at`.
    #[inline(always)]
    pub fn about_axis(axis: Vec3<L>, at: &Vec3<L>) -> Self {
        MotionVector {
            angular: axis,
            linear: at.cross(&axis),
        }
    }

    /// Linear velocity of the body's point that is at `point`.
    #[inline(always)]
    pub fn velocity_at(&self, point: &Vec3<L>) -> Vec3<L> {
        self.linear + self.angular.cross(point)
    }

    /// Rate of change of a motion vector that is carried along at this velocity, v × m (RBDA eq. 2.31).
    #[inline(always)]
    pub fn cross(&self, carried: &Self) -> Self {
        MotionVector {
            angular: self.angular.cross(&carried.angular),
            linear: self.angular.cross(&carried.linear) + self.linear.cross(&carried.angular),
        }
    }

    /// Rate of change of a force vector that is carried along at this velocity, v ×* f (RBDA eq. 2.32).
    #[inline(always)]
    pub fn cross_force(&self, carried: &ForceVector<L>) -> ForceVector<L> {
        ForceVector {
            moment: self.angular.cross(&carried.moment) + self.linear.cross(&carried.force),
            force: self.angular.cross(&carried.force),
        }
    }

    /// Power of a force at this velocity: the scalar product of a motion and a force vector.
    #[inline(always)]
    pub fn dot(&self, force: &ForceVector<L>) -> L {
        self.angular.dot(&force.moment) + self.linear.dot(&force.force)
    }
}

impl<L: Lanes> SpatialInertia<L> {
    pub const ZERO: Self = SpatialInertia {
        mass: L::ZERO,
        first_moment: Vec3::ZERO,
        rotational: Symmetric::ZERO,
    };

    /// The inertia of a body with its centre of mass at `com`, and `central` its rotational inertia about that.
    #[inline(always)]
    pub fn new(mass: L, com: &Vec3<L>, central: Symmetric<L>) -> Self {
        SpatialInertia {
            mass,
            first_moment: *com * mass,
            rotational: central + Symmetric::point_inertia(mass, com),
        }
    }

    /// The momentum at a velocity.
    #[inline(always)]
    pub fn times(&self, motion: &MotionVector<L>) -> ForceVector<L> {
        ForceVector {
            moment: self.rotational.times(&motion.angular)
                + self.first_moment.cross(&motion.linear),
            force: motion.linear * self.mass + motion.angular.cross(&self.first_moment),
        }
    }

    /// Centre of mass, from the common point.
    #[inline(always)]
    pub fn com(&self) -> Vec3<L> {
        self.first_moment * (L::splat(1.0) / self.mass)
    }

    /// The velocity at which the body has this momentum: ω from the moment about the centre of mass, then the linear part.
    #[inline(always)]
    pub fn solve(&self, momentum: &ForceVector<L>) -> MotionVector<L> {
        let com = self.com();
        let central = self.rotational + Symmetric::point_inertia(-self.mass, &com);
        let spin = momentum.moment - com.cross(&momentum.force);
        let angular = central.solve(&spin);
        MotionVector {
            angular,
            linear: momentum.force * (L::splat(1.0) / self.mass) + com.cross(&angular),
        }
    }
}

impl<L: Lanes> ForceVector<L> {
    pub const ZERO: Self = ForceVector {
        moment: Vec3::ZERO,
        force: Vec3::ZERO,
    };

    /// A force or an impulse that acts at a point.
    #[inline(always)]
    pub fn at_point(force: Vec3<L>, point: &Vec3<L>) -> Self {
        ForceVector {
            moment: point.cross(&force),
            force,
        }
    }

    /// The same force with its moment about `point`.
    #[inline(always)]
    pub fn about(&self, point: &Vec3<L>) -> Self {
        ForceVector {
            moment: self.moment - point.cross(&self.force),
            force: self.force,
        }
    }
}

impl<L: Lanes> Add for MotionVector<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        MotionVector {
            angular: self.angular + other.angular,
            linear: self.linear + other.linear,
        }
    }
}

impl<L: Lanes> Add for ForceVector<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        ForceVector {
            moment: self.moment + other.moment,
            force: self.force + other.force,
        }
    }
}

impl<L: Lanes> Sub for ForceVector<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        ForceVector {
            moment: self.moment - other.moment,
            force: self.force - other.force,
        }
    }
}

impl<L: Lanes> Mul<L> for ForceVector<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: L) -> Self {
        ForceVector {
            moment: self.moment * factor,
            force: self.force * factor,
        }
    }
}

impl<L: Lanes> AddAssign for ForceVector<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<L: Lanes> AddAssign for SpatialInertia<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.mass += other.mass;
        self.first_moment += other.first_moment;
        self.rotational = self.rotational + other.rotational;
    }
}
