//! What a pose looks like, wherever the figure stands and faces, and how much two poses differ.

use super::figure::Figure;
use crate::clip::Clip;
use nalgebra::{Vector2, Vector3};

/// Most joints that represent a pose. Chosen: hands, feet, head, elbows, knees and the trunk between.
const LANDMARKS: usize = 16;
/// Velocities count as the distance covered in this time, seconds. Chosen: joints that move at 1 m/s in opposite directions
/// differ as much as ones that are 20 cm apart.
const FORESIGHT: f64 = 0.1;

/// Joints that show the pose: starting from the traveller, always the one farthest from those chosen before (farthest-point
/// sampling), which finds hands, feet and head first.
pub(super) fn landmarks(clip: &Clip, figure: &Figure) -> Vec<usize> {
    let world = clip.world(0);
    let place = |j: usize| world[j].translation.vector;
    let mut chosen = vec![figure.traveller];
    let mut far: Vec<f64> = vec![f64::INFINITY; figure.members.len()];
    while chosen.len() < LANDMARKS {
        let latest = place(chosen[chosen.len() - 1]);
        // Distance of each joint from the nearest one chosen so far.
        for (far, &j) in far.iter_mut().zip(&figure.members) {
            *far = far.min((place(j) - latest).norm());
        }
        let (next, distance) =
            (figure.members.iter().zip(&far)).fold((0, 0.0), |best, (&j, &far)| {
                if far > best.1 { (j, far) } else { best }
            });
        if distance <= 0.0 {
            break;
        }
        chosen.push(next);
    }
    chosen
}

/// Positions and velocities of the landmarks at one frame, metres; velocities times [`FORESIGHT`].
pub(super) struct Look {
    /// Horizontal parts: positions from their centre, then velocities.
    flat: Vec<Vector2<f64>>,
    /// Vertical parts, in the same order.
    up: Vec<f64>,
    /// Sum of the squared horizontal parts.
    square: f64,
}

impl Look {
    pub fn new(clip: &Clip, landmarks: &[usize], frame: usize) -> Self {
        let places = |frame: usize| -> Vec<Vector3<f64>> {
            let world = clip.world(frame);
            landmarks
                .iter()
                .map(|&j| world[j].translation.vector)
                .collect()
        };
        let (before, after) = (
            frame.saturating_sub(1),
            (frame + 1).min(clip.frames.len() - 1),
        );
        let (now, earlier, later) = (places(frame), places(before), places(after));
        // Central differences, one-sided at the ends of the clip.
        let scale = FORESIGHT * clip.fps / (after - before).max(1) as f64;
        let centre: Vector2<f64> = now.iter().map(|p| p.xy()).sum();
        let centre = centre / now.len().max(1) as f64;
        let velocities = earlier.iter().zip(&later).map(|(a, b)| (b - a) * scale);
        let from_centre = now.iter().map(|p| p - centre.push(0.0));
        let all: Vec<Vector3<f64>> = from_centre.chain(velocities).collect();
        let flat: Vec<Vector2<f64>> = all.iter().map(|v| v.xy()).collect();
        Self {
            square: flat.iter().map(Vector2::norm_squared).sum(),
            flat,
            up: all.iter().map(|v| v.z).collect(),
        }
    }

    /// Root mean square distance of the landmarks' positions and velocities, metres, at the heading and the place on the
    /// ground at which it is least. With horizontal vectors as complex numbers, the best heading leaves
    /// |a|² + |b|² − 2 |Σ ā b| of their squared distance.
    pub fn distance(&self, other: &Self) -> f64 {
        let (mut dot, mut cross, mut up) = (0.0, 0.0, 0.0);
        // Σ ā b: its modulus is what the best heading can bring into line.
        for (a, b) in self.flat.iter().zip(&other.flat) {
            dot += a.x * b.x + a.y * b.y;
            cross += a.x * b.y - a.y * b.x;
        }
        for (a, b) in self.up.iter().zip(&other.up) {
            up += (a - b) * (a - b);
        }
        // Rounding may leave a tiny negative number where both are equal.
        let flat = self.square + other.square - 2.0 * f64::hypot(dot, cross);
        let landmarks = (self.up.len() / 2).max(1) as f64;
        ((flat.max(0.0) + up) / landmarks).sqrt()
    }
}
