//! Mass properties of bodies, with MuJoCo's rules for `<inertial>`, geoms and the compiler's bounds.

use super::Body;
use super::build::{MOST_MASS, is_near};
use super::error::Defect;
use super::shape::{Solid, isometry};
use mjcf_rs::body::{InertiaSpec, Inertial};
use mjcf_rs::compiler::Compiler;
use nalgebra::{Matrix3, Vector3};

/// Mass, centre of mass and inertia about it, in the body's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MassProperties {
    /// kg.
    pub(super) mass: f64,
    /// Metres.
    pub(super) com: Vector3<f64>,
    /// About the centre of mass, along the body's axes, kg·m².
    pub(super) inertia: Matrix3<f64>,
}

impl MassProperties {
    /// The solids of one body together; zero for none. Each solid's own inertia is moved to the common centre of mass by the
    /// parallel axis theorem.
    pub(super) fn from_solids(solids: &[Solid]) -> Self {
        let mass: f64 = solids.iter().map(|s| s.mass).sum();
        if mass <= 0.0 {
            return Self {
                mass: 0.0,
                com: Vector3::zeros(),
                inertia: Matrix3::zeros(),
            };
        }
        let moment: Vector3<f64> = solids
            .iter()
            .map(|s| s.pose.translation.vector * s.mass)
            .sum();
        let com = moment / mass;
        let inertia = solids
            .iter()
            .map(|s| s.inertia() + point_inertia(s.mass, &(s.pose.translation.vector - com)))
            .sum();
        Self { mass, com, inertia }
    }

    /// The properties that `<inertial>` states, turned to the body's axes.
    /// With `balance`, which is MuJoCo's `balanceinertia`, three equal moments take the place of those that no body has.
    pub(super) fn from_inertial(inertial: &Inertial, balance: bool) -> Result<Self, Defect> {
        let pose = isometry(&inertial.pose);
        let own = match inertial.inertia {
            InertiaSpec::Diagonal([x, y, z]) => Matrix3::from_diagonal(&Vector3::new(x, y, z)),
            InertiaSpec::Full([xx, yy, zz, xy, xz, yz]) => {
                Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
            }
        };
        let own = match is_of_a_body(&own) {
            true => own,
            false if balance => Matrix3::from_diagonal_element(own.trace() / 3.0),
            false => {
                return Err(Defect::new(
                    "no body has the inertia of its <inertial>",
                    "write moments that are not negative, none larger than the other two together",
                ));
            }
        };
        // From the inertial frame's axes to the body's.
        let r = pose.rotation.to_rotation_matrix();
        let inertia = r * own * r.transpose();
        let finite = inertia.iter().all(|x| x.is_finite()) && is_near(&pose.translation.vector);
        if !(finite && (0.0..=MOST_MASS).contains(&inertial.mass)) {
            return Err(Defect::new(
                "the mass, inertia or place of its <inertial> is negative, not finite or too large",
                format!("write a mass from 0 to {MOST_MASS:e} kg, and finite numbers"),
            ));
        }
        Ok(Self {
            mass: inertial.mass,
            com: pose.translation.vector,
            inertia,
        })
    }

    /// Applies `<compiler boundmass boundinertia>`: lower bounds of the mass and of the principal moments of inertia.
    pub(super) fn bounded(mut self, compiler: &Compiler) -> Self {
        self.mass = self.mass.max(compiler.bound_mass);
        if compiler.bound_inertia > 0.0 {
            let mut eigen = self.inertia.symmetric_eigen();
            eigen
                .eigenvalues
                .apply(|x| *x = x.max(compiler.bound_inertia));
            self.inertia = eigen.recompose();
        }
        self
    }
}

/// Whether a tensor is the inertia of some body: its principal moments are not negative, and none exceeds the sum of the
/// others. Chosen: a part in a hundred is rounding, because files are written with few digits.
fn is_of_a_body(inertia: &Matrix3<f64>) -> bool {
    let moments = inertia.symmetric_eigenvalues();
    let (most, all) = (moments.max(), moments.sum());
    moments.min() >= -1e-9 * most.abs() && most <= 1.01 * (all - most)
}

/// Inertia about the origin of a point mass at `offset`, m (|r|² 1 − r rᵀ): what the parallel axis theorem adds.
pub(crate) fn point_inertia(mass: f64, offset: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * offset.norm_squared() - offset * offset.transpose()) * mass
}

/// Applies `<compiler settotalmass>`: scales all masses and inertias by the same factor, so that they add up to `target` kg.
/// In MuJoCo a target that is not positive means no scaling.
pub(super) fn set_total_mass(bodies: &mut [Body], target: f64) {
    let total: f64 = bodies.iter().map(|b| b.mass).sum();
    if target > 0.0 && target.is_finite() && total > 0.0 {
        for body in bodies {
            body.mass *= target / total;
            body.inertia *= target / total;
        }
    }
}
