//! Spatial vectors of Featherstone's "Rigid Body Dynamics Algorithms", chapter 2, all in world axes and about one point.

use nalgebra::{Matrix3, Vector3};
use std::ops::{Add, AddAssign, Mul, Sub};

/// A velocity or an acceleration: of the turning, and of the point of the body that is at the common point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Motion {
    pub angular: Vector3<f32>,
    pub linear: Vector3<f32>,
}

/// A force or a momentum: its moment about the common point, and itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Force {
    pub moment: Vector3<f32>,
    pub force: Vector3<f32>,
}

/// Mass, first moment of mass and inertia about the common point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Inertia {
    mass: f32,
    first: Vector3<f32>,
    second: Matrix3<f32>,
}

impl Motion {
    /// Turning about `axis` through the point `at`.
    pub fn about(axis: Vector3<f32>, at: Vector3<f32>) -> Self {
        Motion {
            angular: axis,
            linear: at.cross(&axis),
        }
    }

    /// Velocity of the body's point that is at `point`.
    pub fn at(&self, point: &Vector3<f32>) -> Vector3<f32> {
        self.linear + self.angular.cross(point)
    }

    /// Rate at which `carried` changes when it moves with this motion (RBDA eq. 2.31).
    pub fn cross(&self, carried: &Motion) -> Motion {
        Motion {
            angular: self.angular.cross(&carried.angular),
            linear: self.angular.cross(&carried.linear) + self.linear.cross(&carried.angular),
        }
    }

    /// The same of a force (RBDA eq. 2.32).
    pub fn cross_force(&self, carried: &Force) -> Force {
        Force {
            moment: self.angular.cross(&carried.moment) + self.linear.cross(&carried.force),
            force: self.angular.cross(&carried.force),
        }
    }

    /// Power of a force, or a row of the inertia matrix.
    pub fn dot(&self, force: &Force) -> f32 {
        self.angular.dot(&force.moment) + self.linear.dot(&force.force)
    }
}

impl Inertia {
    /// Of a body with its centre of mass at `com` and `central` inertia about that.
    pub fn new(mass: f32, com: Vector3<f32>, central: Matrix3<f32>) -> Self {
        let parallel = Matrix3::from_diagonal_element(com.norm_squared()) - com * com.transpose();
        Inertia {
            mass,
            first: com * mass,
            second: central + parallel * mass,
        }
    }

    /// Momentum of a motion.
    pub fn times(&self, motion: &Motion) -> Force {
        Force {
            moment: self.second * motion.angular + self.first.cross(&motion.linear),
            force: motion.linear * self.mass + motion.angular.cross(&self.first),
        }
    }
}

impl Add for Motion {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Motion {
            angular: self.angular + other.angular,
            linear: self.linear + other.linear,
        }
    }
}

impl Mul<f32> for Motion {
    type Output = Self;
    fn mul(self, factor: f32) -> Self {
        Motion {
            angular: self.angular * factor,
            linear: self.linear * factor,
        }
    }
}

impl Add for Force {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Force {
            moment: self.moment + other.moment,
            force: self.force + other.force,
        }
    }
}

impl Sub for Force {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Force {
            moment: self.moment - other.moment,
            force: self.force - other.force,
        }
    }
}

impl AddAssign for Force {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl AddAssign for Inertia {
    fn add_assign(&mut self, other: Self) {
        self.mass += other.mass;
        self.first += other.first;
        self.second += other.second;
    }
}
