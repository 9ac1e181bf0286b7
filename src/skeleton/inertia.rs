//! Mass properties of bodies, with MuJoCo's rules for `<inertial>`, geoms and the compiler's bounds.

use super::Body;
use super::shape::{Solid, isometry};
use mjcf_rs::body::{InertiaSpec, Inertial};
use mjcf_rs::compiler::Compiler;
use nalgebra::{Matrix3, Vector3};

/// Mass, centre of mass and inertia about it, in the body's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MassProperties {
    pub(super) mass: f64,
    pub(super) com: Vector3<f64>,
    pub(super) inertia: Matrix3<f64>,
}

impl MassProperties {
    /// All solids of one body together; zero for none.
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
            .map(|s| s.inertia() + offset_inertia(s.mass, &(s.pose.translation.vector - com)))
            .sum();
        Self { mass, com, inertia }
    }

    pub(super) fn from_inertial(inertial: &Inertial) -> Result<Self, String> {
        let pose = isometry(&inertial.pose);
        let own = match inertial.inertia {
            InertiaSpec::Diagonal([x, y, z]) => Matrix3::from_diagonal(&Vector3::new(x, y, z)),
            InertiaSpec::Full([xx, yy, zz, xy, xz, yz]) => {
                Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
            }
        };
        let r = pose.rotation.to_rotation_matrix();
        let inertia = r * own * r.transpose();
        let finite = inertial.mass.is_finite() && inertia.iter().all(|x| x.is_finite());
        if !finite || inertial.mass < 0.0 {
            return Err("its <inertial> needs a finite mass and inertia, not negative".into());
        }
        Ok(Self {
            mass: inertial.mass,
            com: pose.translation.vector,
            inertia,
        })
    }

    /// Applies `<compiler boundmass boundinertia>`.
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

/// Inertia of a point mass at `offset` (parallel axis theorem).
fn offset_inertia(mass: f64, offset: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * offset.norm_squared() - offset * offset.transpose()) * mass
}

/// Applies `<compiler settotalmass>`: masses and inertias are scaled alike.
pub(super) fn set_total_mass(bodies: &mut [Body], target: f64) {
    let total: f64 = bodies.iter().map(|b| b.mass).sum();
    if target > 0.0 && target.is_finite() && total > 0.0 {
        for body in bodies {
            body.mass *= target / total;
            body.inertia *= target / total;
        }
    }
}
