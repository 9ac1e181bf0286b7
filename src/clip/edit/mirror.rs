//! Mirrored clips: left and right swapped.

use crate::clip::{Clip, Error, Joint, Margin, Problem, extent};
use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

/// A pair that rests farther from its mirror image than this fraction of the figure's size is worth a warning: 8 cm in an
/// adult. Chosen.
const ASYMMETRIC: f64 = 0.05;
/// A rest pose that is its own mirror image to within this fraction of its size defines the mirror's plane. Chosen: rigs are
/// symmetric but for rounding and posing by hand.
const SYMMETRIC: f64 = 0.01;

/// A plane that mirrors: all points p with normal · p = offset, in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: Unit<Vector3<f64>>,
    /// Metres from the origin.
    pub offset: f64,
}

impl Plane {
    /// The upright plane in which the rest pose of these pairs (left, right) of joints is its own mirror image. For figures
    /// that aren't symmetric at rest, the plane through their middle along X, which is where clips face.
    pub fn sagittal(joints: &[Joint], pairs: &[(usize, usize)]) -> Self {
        let places = places(joints);
        let sides: Vec<(Vector3<f64>, Vector3<f64>)> = pairs
            .iter()
            .filter_map(|&(left, right)| Some((*places.get(left)?, *places.get(right)?)))
            .collect();
        // A symmetric rest pose tells where its mirror is, wherever it stands and faces.
        let fitted = Self::fitted(&sides);
        if !sides.is_empty() && fitted.gap(&sides) <= SYMMETRIC * extent(places.iter().copied()) {
            fitted
        } else {
            Self::across(Vector3::y_axis(), &sides)
        }
    }

    /// The upright plane with the least squared distances between joints and their partners' mirror images.
    ///
    /// For differences d and sums s of the pairs, s taken from their mean, the horizontal unit normal n makes
    /// Σ (n·d)² − Σ (n·s)² greatest. This is the larger eigenvector of a symmetric 2 × 2 matrix: its angle is half that of
    /// (xx − yy, 2 xy).
    fn fitted(sides: &[(Vector3<f64>, Vector3<f64>)]) -> Self {
        let middle = middle(sides);
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        // Entries of the symmetric 2 × 2 matrix, horizontal parts only: the plane is upright.
        for (left, right) in sides {
            let (d, m) = (left - right, left + right - 2.0 * middle);
            xx += d.x * d.x - m.x * m.x;
            xy += d.x * d.y - m.x * m.y;
            yy += d.y * d.y - m.y * m.y;
        }
        let angle = 0.5 * f64::atan2(2.0 * xy, xx - yy);
        let (sin, cos) = angle.sin_cos();
        Self::across(Unit::new_unchecked(Vector3::new(cos, sin, 0.0)), sides)
    }

    fn across(normal: Unit<Vector3<f64>>, sides: &[(Vector3<f64>, Vector3<f64>)]) -> Self {
        let offset = normal.dot(&middle(sides));
        Self { normal, offset }
    }

    /// Mirror image of a point, metres.
    pub fn reflect(&self, p: &Vector3<f64>) -> Vector3<f64> {
        p - *self.normal * (2.0 * (self.normal.dot(p) - self.offset))
    }

    /// Mirror image of a direction.
    fn reflect_along(&self, v: &Vector3<f64>) -> Vector3<f64> {
        v - *self.normal * (2.0 * self.normal.dot(v))
    }

    /// Mirror image of a rotation: its axis is reflected, and it turns the other way round the axis.
    fn reflect_turn(&self, turn: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        let axis = -self.reflect_along(&turn.imag());
        UnitQuaternion::new_unchecked(Quaternion::from_parts(turn.w, axis))
    }

    /// Greatest distance between a joint and its partner's mirror image, metres.
    fn gap(&self, sides: &[(Vector3<f64>, Vector3<f64>)]) -> f64 {
        let gap =
            |(left, right): &(Vector3<f64>, Vector3<f64>)| (self.reflect(left) - right).norm();
        sides.iter().map(gap).fold(0.0, f64::max)
    }
}

fn middle(sides: &[(Vector3<f64>, Vector3<f64>)]) -> Vector3<f64> {
    let sum: Vector3<f64> = sides.iter().map(|(left, right)| left + right).sum();
    sum / (2 * sides.len().max(1)) as f64
}

/// Where joints rest in the world.
fn places(joints: &[Joint]) -> Vec<Vector3<f64>> {
    rest_world(joints)
        .iter()
        .map(|at| at.translation.vector)
        .collect()
}

fn rest_world(joints: &[Joint]) -> Vec<Isometry3<f64>> {
    let mut world: Vec<Isometry3<f64>> = Vec::with_capacity(joints.len());
    for joint in joints {
        let above = joint.parent.and_then(|p| world.get(p).copied());
        world.push(above.unwrap_or_default() * joint.rest);
    }
    world
}

/// Whose motion each joint gets.
struct Partners {
    /// Index of the partner: the joint itself where it has none.
    of: Vec<usize>,
    /// Joints that only one side has, such as a weapon: they stay as they are in their parent.
    alone: Vec<bool>,
}

impl Partners {
    fn new(joints: &[Joint], pairs: &[(usize, usize)]) -> Result<Self, Error> {
        let mut of: Vec<usize> = (0..joints.len()).collect();
        for &(left, right) in pairs {
            let free = |j: usize| of.get(j) == Some(&j);
            // A joint in two pairs would get two motions.
            if left == right || !free(left) || !free(right) {
                let joints = joints.len();
                return Err(Error::Pair {
                    left,
                    right,
                    joints,
                });
            }
            (of[left], of[right]) = (right, left);
        }
        let mut alone: Vec<bool> = Vec::with_capacity(joints.len());
        for (j, joint) in joints.iter().enumerate() {
            let one_sided = |p: usize| of[p] != p || alone[p];
            alone.push(of[j] == j && joint.parent.is_some_and(one_sided));
        }
        Ok(Self { of, alone })
    }
}

impl Clip {
    /// The clip seen in a mirror: the joints of each pair swap their motion, and every other joint does its own mirrored.
    ///
    /// In world axes, the rotation of a joint from its rest pose is the mirror image of its partner's rotation from its own
    /// rest pose, and so is its shift in its parent. Axes and lengths of the bones stay as they are. Joints of one side
    /// without a partner keep their transform in their parent.
    ///
    /// # Errors
    /// An [`Error`] for pairs that aren't of this clip's joints or that share one, and for a clip that contradicts itself.
    pub fn mirror(&self, pairs: &[(usize, usize)], plane: &Plane) -> Result<Clip, Error> {
        self.check()?;
        let partners = Partners::new(&self.joints, pairs)?;
        let rest: Vec<UnitQuaternion<f64>> = rest_world(&self.joints)
            .iter()
            .map(|at| unit(&at.rotation))
            .collect();
        let mirrored = |frames: &[Vec<Isometry3<f64>>]| {
            let frames = frames.iter();
            let frames = frames.map(|frame| self.mirrored(frame, &rest, &partners, plane));
            frames.collect()
        };
        let mut clip = self.with_frames(mirrored(&self.frames), self.fps, self.loop_mode);
        clip.margin = Margin {
            before: mirrored(&self.margin.before),
            after: mirrored(&self.margin.after),
        };
        clip.add_problems(self.asymmetry(pairs, plane));
        Ok(clip)
    }

    fn mirrored(
        &self,
        frame: &[Isometry3<f64>],
        rest: &[UnitQuaternion<f64>],
        partners: &Partners,
        plane: &Plane,
    ) -> Vec<Isometry3<f64>> {
        let turns = self.turns(frame, rest);
        // World rotation of a joint's parent at rest: shifts are mirrored in world axes.
        let under = |j: usize| {
            self.joints[j]
                .parent
                .map_or_else(Default::default, |p| rest[p])
        };
        let mut world: Vec<UnitQuaternion<f64>> = Vec::with_capacity(frame.len());
        let mut mirrored = Vec::with_capacity(frame.len());
        for (j, joint) in self.joints.iter().enumerate() {
            let above = joint.parent.map_or_else(Default::default, |p| world[p]);
            if partners.alone[j] {
                world.push(above * unit(&frame[j].rotation));
                mirrored.push(frame[j]);
                continue;
            }
            let partner = partners.of[j];
            // The partner's turn from rest, mirrored, on top of this joint's own rest.
            let turned = plane.reflect_turn(&turns[partner]) * rest[j];
            let (theirs, rested) = (&frame[partner], &self.joints[partner].rest);
            // The partner's shift from rest: into world axes, mirrored, and into this joint's parent.
            let shift = under(partner) * (theirs.translation.vector - rested.translation.vector);
            let shift = under(j).inverse() * plane.reflect_along(&shift);
            let place = joint.rest.translation.vector + shift;
            mirrored.push(Isometry3::from_parts(
                Translation3::from(place),
                above.inverse() * turned,
            ));
            world.push(turned);
        }
        mirrored
    }

    /// The rotation of each joint from its rest pose, in world axes.
    fn turns(
        &self,
        frame: &[Isometry3<f64>],
        rest: &[UnitQuaternion<f64>],
    ) -> Vec<UnitQuaternion<f64>> {
        let mut world: Vec<UnitQuaternion<f64>> = Vec::with_capacity(frame.len());
        for (joint, at) in self.joints.iter().zip(frame) {
            let above = joint.parent.map_or_else(Default::default, |p| world[p]);
            world.push(above * unit(&at.rotation));
        }
        let turns = world
            .iter()
            .zip(rest)
            .map(|(now, rest)| now * rest.inverse());
        turns.collect()
    }

    fn asymmetry(&self, pairs: &[(usize, usize)], plane: &Plane) -> Option<Problem> {
        let places = places(&self.joints);
        let sides: Vec<_> = pairs.iter().map(|&(l, r)| (places[l], places[r])).collect();
        let gap = plane.gap(&sides);
        (gap > ASYMMETRIC * extent(places.iter().copied())).then(|| {
            Problem::warning(
                "asymmetric-rest",
                format!(
                    "a joint rests {:.0} mm from its partner's mirror image, and the mirrored poses are off by as much; \
                     import the clip from a file with a symmetric bind pose",
                    1e3 * gap
                ),
            )
        })
    }
}

/// Normalised: files round, and the error would grow where rotations are multiplied along a chain.
fn unit(q: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(*q.quaternion())
}
