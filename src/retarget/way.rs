//! The way of a body over the ground that is nearest to what is wished of its place, speed and acceleration.

use nalgebra::{Matrix2, Vector2, Vector4};

/// Fewest frames of a way that is solved for; shorter ones stay where they are. Five frames are as many as a row couples.
const FEWEST: usize = 5;

/// How much each wish counts for a way s: stay ‖s‖² + follow ‖ṡ − v‖² + push ‖s̈ − a‖², summed over all frames.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    /// Whether the first frame follows the last.
    pub repeats: bool,
    /// Frames per second.
    pub fps: f64,
    /// Weight of a place's square, 1/m².
    pub stay: f64,
    /// Weight of the speed's, s²/m².
    pub follow: f64,
    /// Weight of the acceleration's, s⁴/m².
    pub push: f64,
}

/// The normal equations. A row couples a frame to itself and to the two after it; beyond the last frame the first follows.
struct Normal {
    /// `rows[f][k]` couples f and f + k.
    rows: Vec<[f64; 3]>,
    right: Vec<Vector2<f64>>,
}

impl Way {
    /// The best places for these speeds from each frame to the next, and accelerations in each frame; metres and seconds.
    pub fn solve(
        &self,
        speeds: &[Vector2<f64>],
        accelerations: &[Vector2<f64>],
    ) -> Vec<Vector2<f64>> {
        let count = accelerations.len();
        if count < FEWEST {
            return vec![Vector2::zeros(); count];
        }
        let mut normal = Normal {
            rows: vec![[self.stay, 0.0, 0.0]; count],
            right: vec![Vector2::zeros(); count],
        };
        // A way that ends has no speed after its last frame, and no acceleration at its ends.
        let ends = |reach: usize| if self.repeats { count } else { count - reach };
        for (f, speed) in speeds.iter().enumerate().take(ends(1)) {
            let follow = self.follow * self.fps.powi(2);
            normal.add(f, &[-1.0, 1.0], (follow, speed / self.fps));
        }
        for f in 0..ends(2) {
            let turn = accelerations[(f + 1) % count] / self.fps.powi(2);
            normal.add(f, &[1.0, -2.0, 1.0], (self.push * self.fps.powi(4), turn));
        }
        normal.solve()
    }
}

impl Normal {
    /// Adds weight × ‖Σ coefficients · s − wanted‖² over the frames from f on.
    fn add(&mut self, f: usize, coefficients: &[f64], (weight, wanted): (f64, Vector2<f64>)) {
        let count = self.rows.len();
        for (i, a) in coefficients.iter().enumerate() {
            self.right[(f + i) % count] += wanted * (weight * a);
            for (k, b) in coefficients[i..].iter().enumerate() {
                self.rows[(f + i) % count][k] += weight * a * b;
            }
        }
    }

    /// The solution. The last two frames, which the seam couples to the first, are the border of a banded system: with A the
    /// band, B the border's columns and C its own block, (C − Bᵀ A⁻¹ B) y = q − Bᵀ A⁻¹ r, and x = A⁻¹ r − A⁻¹ B y.
    fn solve(self) -> Vec<Vector2<f64>> {
        let count = self.rows.len();
        let inner = count - 2;
        // r beside the two columns of B, whose entries are where a frame is near the border; the shortest way's are all near.
        let mut right: Vec<Vector4<f64>> = self.right[..inner]
            .iter()
            .map(|r| Vector4::new(r.x, r.y, 0.0, 0.0))
            .collect();
        let is_near = |f: &usize| *f < 2 || *f + 2 >= inner;
        let near: Vec<usize> = (0..inner).filter(is_near).collect();
        for &f in &near {
            let [z, w] = self.border(f);
            (right[f].z, right[f].w) = (z, w);
        }
        solve_band(&mut self.rows[..inner].to_vec(), &mut right);
        let Some(ends) = self.ends(&near, &right) else {
            return vec![Vector2::zeros(); count];
        };
        let place = |r: &Vector4<f64>| r.xy() - ends[0] * r.z - ends[1] * r.w;
        right.iter().map(place).chain(ends).collect()
    }

    /// What couples a frame to the last two.
    fn border(&self, f: usize) -> [f64; 2] {
        let count = self.rows.len();
        [count - 2, count - 1].map(|end| self.row_between(f, end))
    }

    /// The places y of the last two frames. `solved` has A⁻¹ r and A⁻¹ B, and B isn't zero at the frames `near`.
    fn ends(&self, near: &[usize], solved: &[Vector4<f64>]) -> Option<[Vector2<f64>; 2]> {
        let inner = solved.len();
        let own = [self.border(inner), self.border(inner + 1)];
        let mut block = Matrix2::from_fn(|i, k| own[i][k]);
        let mut rest = [self.right[inner], self.right[inner + 1]];
        for &f in near {
            let columns = self.border(f);
            for i in 0..2 {
                rest[i] -= solved[f].xy() * columns[i];
                for k in 0..2 {
                    block[(i, k)] -= columns[i] * solved[f][2 + k];
                }
            }
        }
        let inverse = block.try_inverse()?;
        Some([0, 1].map(|i| rest[0] * inverse[(i, 0)] + rest[1] * inverse[(i, 1)]))
    }

    /// What couples two frames.
    fn row_between(&self, a: usize, b: usize) -> f64 {
        let count = self.rows.len();
        let [ahead, behind] = [(b + count - a) % count, (a + count - b) % count];
        let coupled = |from: usize, by: usize| self.rows[from].get(by).copied().unwrap_or(0.0);
        match ahead.cmp(&behind) {
            std::cmp::Ordering::Less => coupled(a, ahead),
            _ => coupled(b, behind),
        }
    }
}

/// Solves a symmetric banded system for every column of `right`, by Cholesky's L D Lᵀ.
fn solve_band(rows: &mut [[f64; 3]], right: &mut [Vector4<f64>]) {
    let count = rows.len();
    for f in 0..count {
        let [pivot, one, two] = rows[f];
        for (k, coupling) in [(1, one), (2, two)] {
            if f + k < count {
                let factor = coupling / pivot;
                rows[f + k][0] -= factor * coupling;
                let known = right[f] * factor;
                right[f + k] -= known;
            }
        }
        if f + 1 < count {
            rows[f + 1][1] -= one / pivot * two;
        }
    }
    for f in (0..count).rev() {
        let later = (1..=2).filter(|k| f + k < count);
        let known: Vector4<f64> = later.map(|k| right[f + k] * rows[f][k]).sum();
        right[f] = (right[f] - known) / rows[f][0];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use std::f64::consts::TAU;

    /// The same as a dense least-squares problem, solved by nalgebra.
    #[test]
    fn the_band_agrees_with_a_dense_solver() {
        for (count, repeats) in [(5, true), (5, false), (6, true), (17, true), (17, false)] {
            let way = Way {
                repeats,
                fps: 3.0,
                stay: 0.7,
                follow: 0.4,
                push: 0.05,
            };
            let wish = |seed: f64| -> Vec<Vector2<f64>> {
                let at = |f: usize| Vector2::new((f as f64 * seed).sin(), (f as f64 + seed).cos());
                (0..count).map(at).collect()
            };
            let (speeds, accelerations) = (wish(1.3), wish(2.1));
            let (mut rows, mut right): (Vec<Vec<f64>>, Vec<Vector2<f64>>) = (vec![], vec![]);
            let mut add = |entries: &[(usize, f64)], weight: f64, wanted: Vector2<f64>| {
                let mut row = vec![0.0; count];
                entries
                    .iter()
                    .for_each(|(f, a)| row[f % count] += a * weight.sqrt());
                rows.push(row);
                right.push(wanted * weight.sqrt());
            };
            for f in 0..count {
                add(&[(f, 1.0)], way.stay, Vector2::zeros());
                if repeats || f + 1 < count {
                    add(&[(f, -3.0), (f + 1, 3.0)], way.follow, speeds[f]);
                }
                if repeats || f + 2 < count {
                    let turn = [(f, 9.0), (f + 1, -18.0), (f + 2, 9.0)];
                    add(&turn, way.push, accelerations[(f + 1) % count]);
                }
            }
            let matrix = DMatrix::from_fn(rows.len(), count, |i, j| rows[i][j]);
            let wanted = DMatrix::from_fn(rows.len(), 2, |i, j| right[i][j]);
            let normal = matrix.transpose() * &matrix;
            let dense = normal.lu().solve(&(matrix.transpose() * wanted));
            let dense = dense.expect("regular");
            for (f, s) in way.solve(&speeds, &accelerations).iter().enumerate() {
                let off = (s.x - dense[(f, 0)]).abs() + (s.y - dense[(f, 1)]).abs();
                assert!(off < 1e-9, "{count} {repeats}: frame {f} off by {off}");
            }
        }
    }

    /// A quick swing is taken out, a slow one is left: s = ρ ω²/(ω⁴ + stay).
    #[test]
    fn quick_swings_are_taken_out() {
        let fps = 60.0;
        let way = Way {
            repeats: true,
            fps,
            stay: TAU.powi(4),
            follow: 0.0,
            push: 1.0,
        };
        for (period, frames) in [(0.4, 24), (2.0, 120)] {
            let omega: f64 = TAU / period;
            let swing = |f: usize| Vector2::new((omega * f as f64 / fps).sin(), 0.0);
            let lacking: Vec<_> = (0..frames).map(swing).collect();
            let wished: Vec<_> = lacking.iter().map(|a| -a).collect();
            let found = way.solve(&vec![Vector2::zeros(); frames], &wished);
            let expected = omega.powi(2) / (omega.powi(4) + way.stay);
            for (s, a) in found.iter().zip(&lacking) {
                assert!((s - a * expected).norm() < 0.02 * expected, "{s} {a}");
            }
        }
    }
}
