//! The tracks of a motion in a few numbers.

use super::{Motion, Tracks};
use serde::Serialize;

/// Least, mean and greatest value over the frames; zeros for a motion without frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Extent {
    /// The least value.
    pub min: f64,
    /// The mean over all frames.
    pub mean: f64,
    /// The greatest value.
    pub max: f64,
}

/// How long a body stands on the ground.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContactShare {
    /// Name of the body.
    pub body: String,
    /// Share of the frames in which the body stands, from 0 to 1.
    pub share: f64,
}

/// The tracks of a motion over all its frames. Vectors are summed up by their lengths.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Height of the centre of mass above the ground, metres.
    pub com_height_m: Extent,
    /// Speed of the centre of mass, m/s.
    pub com_speed_m_s: Extent,
    /// Linear momentum of the whole body, kg·m/s.
    pub linear_momentum: Extent,
    /// Angular momentum about the centre of mass, kg·m²/s.
    pub angular_momentum: Extent,
    /// Force that no ground contact can supply, N.
    pub unsupported_force_n: Extent,
    /// Moment about the root that no ground contact can supply, N·m.
    pub unsupported_moment_n_m: Extent,
    /// How long each contact body stands, in the order of [`Motion::contact_bodies`].
    pub contacts: Vec<ContactShare>,
}

impl Motion {
    /// Sums up the tracks in a few numbers.
    pub fn summary(&self) -> Summary {
        let tracks = &self.tracks;
        Summary {
            com_height_m: Extent::of(tracks.com.iter().map(|p| p.z)),
            com_speed_m_s: Extent::of(tracks.com_velocity.iter().map(|v| v.norm())),
            linear_momentum: Extent::of(tracks.linear_momentum.iter().map(|p| p.norm())),
            angular_momentum: Extent::of(tracks.angular_momentum.iter().map(|l| l.norm())),
            unsupported_force_n: Extent::of(tracks.unsupported_force()),
            unsupported_moment_n_m: Extent::of(tracks.unsupported_moment()),
            contacts: self.contact_shares(),
        }
    }

    /// Names of the bodies that may stand on the ground, in the order of [`Motion::contact_bodies`].
    pub fn contact_names(&self) -> Vec<String> {
        let name = |body: &usize| {
            let name = self.body_names.get(*body).cloned();
            name.unwrap_or_else(|| format!("body {body}"))
        };
        self.contact_bodies.iter().map(name).collect()
    }

    fn contact_shares(&self) -> Vec<ContactShare> {
        let rows = &self.tracks.contact;
        let share = |c: usize| {
            let down = rows.iter().filter(|row| row.get(c) == Some(&true)).count();
            down as f64 / rows.len().max(1) as f64
        };
        let names = self.contact_names().into_iter().enumerate();
        let of = |(c, body)| ContactShare {
            body,
            share: share(c),
        };
        names.map(of).collect()
    }
}

impl Tracks {
    /// Size of the force that no ground contact can supply, per frame, N.
    pub fn unsupported_force(&self) -> impl Iterator<Item = f64> + '_ {
        let wrenches = self.root_wrench_residual.iter();
        wrenches.map(|wrench| wrench.fixed_rows::<3>(0).norm())
    }

    /// Size of the moment about the root that no ground contact can supply, per frame, N·m.
    pub fn unsupported_moment(&self) -> impl Iterator<Item = f64> + '_ {
        let wrenches = self.root_wrench_residual.iter();
        wrenches.map(|wrench| wrench.fixed_rows::<3>(3).norm())
    }
}

impl Extent {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let (mut count, mut sum) = (0_usize, 0.0);
        let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values {
            (count, sum) = (count + 1, sum + value);
            (min, max) = (min.min(value), max.max(value));
        }
        if count == 0 {
            return Self::default();
        }
        let mean = sum / count as f64;
        Self { min, mean, max }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clip::LoopMode;
    use crate::motion::Cycle;
    use nalgebra::{Vector3, Vector6};

    /// Two frames of a body that rises, pulled by a force of 5 N in the second.
    fn motion() -> Motion {
        let rise = vec![Vector3::z(), 3.0 * Vector3::z()];
        let still = vec![Vector3::zeros(); 2];
        let pull = Vector6::new(3.0, 0.0, 4.0, 0.0, 2.0, 0.0);
        Motion {
            name: "rise".into(),
            fps: 30.0,
            loop_mode: LoopMode::Clamp,
            cycle: Cycle::NONE,
            skeleton_name: "stick".into(),
            skeleton_sha256: String::new(),
            body_names: vec!["root".into(), "foot".into()],
            contact_bodies: vec![1, 7],
            qpos: vec![vec![0.0; 7]; 2],
            qvel: vec![vec![0.0; 6]; 2],
            bodies: vec![Vec::new(); 2],
            tracks: Tracks {
                phase: vec![0.0, 1.0],
                com: rise,
                com_velocity: still.clone(),
                linear_momentum: still.clone(),
                angular_momentum: still,
                contact: vec![vec![true, false], vec![false, false]],
                root_wrench_residual: vec![Vector6::zeros(), pull],
            },
            report: None,
            source: None,
        }
    }

    #[test]
    fn tracks_are_summed_up() {
        let summary = motion().summary();
        let extent = |min, mean, max| Extent { min, mean, max };
        assert_eq!(summary.com_height_m, extent(1.0, 2.0, 3.0));
        assert_eq!(summary.com_speed_m_s, Extent::default());
        assert_eq!(summary.unsupported_force_n, extent(0.0, 2.5, 5.0));
        assert_eq!(summary.unsupported_moment_n_m, extent(0.0, 1.0, 2.0));
        let contacts = summary.contacts.iter();
        let contacts: Vec<_> = contacts.map(|c| (c.body.as_str(), c.share)).collect();
        assert_eq!(contacts, [("foot", 0.5), ("body 7", 0.0)]);
    }

    #[test]
    fn no_frames_come_to_zeros() {
        assert_eq!(Extent::of(std::iter::empty()), Extent::default());
    }
}
