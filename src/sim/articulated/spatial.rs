//! Spatial vectors of Featherstone's "Rigid Body Dynamics Algorithms", chapter 2, all in world axes and about one point,
//! of eight characters.

use super::algebra::{Symmetric, Vec3};
use super::lanes::Lanes;
use std::ops::{Add, AddAssign, Mul, Sub};

/// A velocity or an acceleration: of the turning, and of the point of the body that is at the common point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion<L> {
    pub angular: Vec3<L>,
    pub linear: Vec3<L>,
}

/// A force or a momentum: its moment about the common point, and itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Force<L> {
    pub moment: Vec3<L>,
    pub force: Vec3<L>,
}

/// Mass, first moment of mass and inertia about the common point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inertia<L> {
    pub mass: L,
    first: Vec3<L>,
    second: Symmetric<L>,
}

impl<L: Lanes> Motion<L> {
    pub const ZERO: Self = Motion {
        angular: Vec3::ZERO,
        linear: Vec3::ZERO,
    };

    /// Turning about `axis` through the point `at`.
    #[inline(always)]
    pub fn about(axis: Vec3<L>, at: &Vec3<L>) -> Self {
        Motion {
            angular: axis,
            linear: at.cross(&axis),
        }
    }

    /// Velocity of the body's point that is at `point`.
    #[inline(always)]
    pub fn at(&self, point: &Vec3<L>) -> Vec3<L> {
        self.linear + self.angular.cross(point)
    }

    /// Rate at which `carried` changes when it moves with this motion (RBDA eq. 2.31).
    #[inline(always)]
    pub fn cross(&self, carried: &Self) -> Self {
        Motion {
            angular: self.angular.cross(&carried.angular),
            linear: self.angular.cross(&carried.linear) + self.linear.cross(&carried.angular),
        }
    }

    /// The same of a force (RBDA eq. 2.32).
    #[inline(always)]
    pub fn cross_force(&self, carried: &Force<L>) -> Force<L> {
        Force {
            moment: self.angular.cross(&carried.moment) + self.linear.cross(&carried.force),
            force: self.angular.cross(&carried.force),
        }
    }

    /// Power of a force in this motion.
    #[inline(always)]
    pub fn dot(&self, force: &Force<L>) -> L {
        self.angular.dot(&force.moment) + self.linear.dot(&force.force)
    }
}

impl<L: Lanes> Inertia<L> {
    pub const ZERO: Self = Inertia {
        mass: L::ZERO,
        first: Vec3::ZERO,
        second: Symmetric::ZERO,
    };

    /// Of a body with its centre of mass at `com` and `central` inertia about that.
    #[inline(always)]
    pub fn new(mass: L, com: &Vec3<L>, central: Symmetric<L>) -> Self {
        Inertia {
            mass,
            first: *com * mass,
            second: central + Symmetric::parallel(mass, com),
        }
    }

    /// Momentum of a motion.
    #[inline(always)]
    pub fn times(&self, motion: &Motion<L>) -> Force<L> {
        Force {
            moment: self.second.times(&motion.angular) + self.first.cross(&motion.linear),
            force: motion.linear * self.mass + motion.angular.cross(&self.first),
        }
    }

    #[inline(always)]
    pub fn com(&self) -> Vec3<L> {
        self.first * (L::splat(1.0) / self.mass)
    }

    /// The motion of this momentum.
    #[inline(always)]
    pub fn motion_of(&self, momentum: &Force<L>) -> Motion<L> {
        let com = self.com();
        let central = self.second + Symmetric::parallel(-self.mass, &com);
        let spin = momentum.moment - com.cross(&momentum.force);
        let angular = central.solve(&spin);
        Motion {
            angular,
            linear: momentum.force * (L::splat(1.0) / self.mass) + com.cross(&angular),
        }
    }
}

impl<L: Lanes> Force<L> {
    pub const ZERO: Self = Force {
        moment: Vec3::ZERO,
        force: Vec3::ZERO,
    };

    /// An impulse or a force at a point.
    #[inline(always)]
    pub fn at(force: Vec3<L>, point: &Vec3<L>) -> Self {
        Force {
            moment: point.cross(&force),
            force,
        }
    }

    /// The same about another point.
    #[inline(always)]
    pub fn about(&self, point: &Vec3<L>) -> Self {
        Force {
            moment: self.moment - point.cross(&self.force),
            force: self.force,
        }
    }
}

impl<L: Lanes> Add for Motion<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Motion {
            angular: self.angular + other.angular,
            linear: self.linear + other.linear,
        }
    }
}

impl<L: Lanes> Add for Force<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Force {
            moment: self.moment + other.moment,
            force: self.force + other.force,
        }
    }
}

impl<L: Lanes> Sub for Force<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Force {
            moment: self.moment - other.moment,
            force: self.force - other.force,
        }
    }
}

impl<L: Lanes> Mul<L> for Force<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: L) -> Self {
        Force {
            moment: self.moment * factor,
            force: self.force * factor,
        }
    }
}

impl<L: Lanes> AddAssign for Force<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<L: Lanes> AddAssign for Inertia<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.mass += other.mass;
        self.first += other.first;
        self.second = self.second + other.second;
    }
}
