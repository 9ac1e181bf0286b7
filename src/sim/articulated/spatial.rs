//! Spatial vectors of Featherstone's "Rigid Body Dynamics Algorithms", chapter 2, all in world axes and about one point.

use nalgebra::{Matrix3, Vector3};
use std::ops::{Add, AddAssign, Mul, Sub};
use wide::f32x4;

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
    pub fn about(axis: Vector3<f32>, at: &Vector3<f32>) -> Self {
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
}

/// Motions of the coordinates of a block, component by component.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Axes {
    pub angular: [f32x4; 3],
    pub linear: [f32x4; 3],
}

impl Axes {
    /// Turning about each of `axes` through the point `at`.
    pub fn about(axes: &[Vector3<f32>], at: &Vector3<f32>) -> Self {
        let lanes = |k: usize| {
            let entry = |lane: usize| axes.get(lane).map_or(0.0, |axis| axis[k]);
            f32x4::from([entry(0), entry(1), entry(2), 0.0])
        };
        let angular = [lanes(0), lanes(1), lanes(2)];
        let [x, y, z] = [at.x, at.y, at.z].map(f32x4::splat);
        let [a, b, c] = angular;
        Axes {
            angular,
            linear: [y * c - z * b, z * a - x * c, x * b - y * a],
        }
    }

    /// Velocities of the bodies' points that are at `point`.
    pub fn at(&self, point: &Vector3<f32>) -> [f32x4; 3] {
        let [x, y, z] = [point.x, point.y, point.z].map(f32x4::splat);
        let ([a, b, c], [u, v, w]) = (self.angular, self.linear);
        [u + b * z - c * y, v + c * x - a * z, w + a * y - b * x]
    }

    /// Power of forces, component by component, of which each counts in one row: `[lane]` of the result are the powers
    /// of force `lane` in every one of the axes. Three rows of a block of the inertia matrix.
    pub fn powers(&self, forces: &[[f32x4; 6]; 3]) -> [f32x4; 3] {
        let ([a, b, c], [u, v, w]) = (self.angular, self.linear);
        forces.map(|[l, m, n, x, y, z]| a * l + b * m + c * n + u * x + v * y + w * z)
    }

    /// Power of a force in each.
    pub fn dot(&self, force: &Force) -> f32x4 {
        let sum = |axes: &[f32x4; 3], v: &Vector3<f32>| {
            axes[0] * f32x4::splat(v.x) + axes[1] * f32x4::splat(v.y) + axes[2] * f32x4::splat(v.z)
        };
        sum(&self.angular, &force.moment) + sum(&self.linear, &force.force)
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

    /// Momenta of axes, each component spread over all lanes: `[axis, component]`.
    pub fn momenta(&self, axes: &Axes) -> [[f32x4; 6]; 3] {
        let ([a, b, c], [u, v, w]) = (axes.angular, axes.linear);
        let [x, y, z] = [self.first.x, self.first.y, self.first.z].map(f32x4::splat);
        let row = |i: usize| {
            let part = |j: usize| f32x4::splat(self.second[(i, j)]);
            part(0) * a + part(1) * b + part(2) * c
        };
        let mass = f32x4::splat(self.mass);
        let components = [
            row(0) + y * w - z * v,
            row(1) + z * u - x * w,
            row(2) + x * v - y * u,
            mass * u + b * z - c * y,
            mass * v + c * x - a * z,
            mass * w + a * y - b * x,
        ];
        [0, 1, 2].map(|lane| components.map(|c| f32x4::splat(c.as_array()[lane])))
    }

    pub fn mass(&self) -> f32 {
        self.mass
    }

    pub fn com(&self) -> Vector3<f32> {
        self.first / self.mass
    }

    /// The motion of this momentum, if the body has any extent.
    pub fn motion_of(&self, momentum: &Force) -> Option<Motion> {
        let com = self.com();
        let central = Inertia::new(-self.mass, com, self.second).second;
        let spin = momentum.moment - com.cross(&momentum.force);
        let angular = central.try_inverse()? * spin;
        Some(Motion {
            angular,
            linear: momentum.force / self.mass + com.cross(&angular),
        })
    }
}

impl Force {
    /// An impulse or a force at a point.
    pub fn at(force: Vector3<f32>, point: &Vector3<f32>) -> Self {
        Force {
            moment: point.cross(&force),
            force,
        }
    }

    /// The same about another point.
    pub fn about(&self, point: &Vector3<f32>) -> Self {
        Force {
            moment: self.moment - point.cross(&self.force),
            force: self.force,
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

impl Add for Force {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Force {
            moment: self.moment + other.moment,
            force: self.force + other.force,
        }
    }
}

impl Mul<f32> for Force {
    type Output = Self;
    fn mul(self, factor: f32) -> Self {
        Force {
            moment: self.moment * factor,
            force: self.force * factor,
        }
    }
}

impl Sub for Force {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + other * -1.0
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
