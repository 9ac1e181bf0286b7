//! Curves of time: the smoothest passage through via points, and its periodic sister.

use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Value, first and second derivative.
pub type Jet = [f64; 3];

/// The curve of least jerk through via points: the quintic spline with continuous fourth derivative
/// (Flash and Hogan, J. Neurosci. 5, 1985, take it as the model of human reaching). It rests before its first
/// and after its last point.
pub struct MinJerk {
    times: Vec<f64>,
    /// Per span, the coefficients of powers of (t − start of span).
    spans: Vec<[f64; 6]>,
}

impl MinJerk {
    /// Through `points` (time, value), at rest at both ends.
    pub fn through(points: &[(f64, f64)]) -> Self {
        let (first, last) = (points[0].1, points[points.len() - 1].1);
        Self::between(points, [first, 0.0, 0.0], [last, 0.0, 0.0])
    }

    /// Through `points`, with the derivatives of `start` and `end` at the ends.
    pub fn between(points: &[(f64, f64)], start: Jet, end: Jet) -> Self {
        let spans = points.len() - 1;
        let mut rows = Rows::new(6 * spans);
        for d in 0..3usize {
            rows.push(&[(0, 0.0, d as i32, 1.0)], start[d]);
            let width = points[spans].0 - points[spans - 1].0;
            rows.push(&[(spans - 1, width, d as i32, 1.0)], end[d]);
        }
        for k in 1..spans {
            let width = points[k].0 - points[k - 1].0;
            rows.push(&[(k - 1, width, 0, 1.0)], points[k].1);
            rows.push(&[(k, 0.0, 0, 1.0)], points[k].1);
            for d in 1..5 {
                rows.push(&[(k - 1, width, d, 1.0), (k, 0.0, d, -1.0)], 0.0);
            }
        }
        Self {
            times: points.iter().map(|p| p.0).collect(),
            spans: rows.solve(),
        }
    }

    pub fn at(&self, t: f64) -> f64 {
        let (first, last) = (self.times[0], self.times[self.times.len() - 1]);
        let t = t.clamp(first, last);
        let span = self.times[1..self.spans.len()]
            .iter()
            .filter(|&&knot| knot <= t)
            .count();
        powers(t - self.times[span], 0)
            .iter()
            .zip(&self.spans[span])
            .map(|(p, c)| p * c)
            .sum()
    }
}

/// Value and derivatives of `f` by central differences.
pub fn jet(f: &dyn Fn(f64) -> f64, at: f64) -> Jet {
    let h = 1e-4;
    let [a, b, c] = [at - h, at, at + h].map(f);
    [b, (c - a) / (2.0 * h), (a - 2.0 * b + c) / (h * h)]
}

/// Derivative number `d` of 1, t, …, t⁵.
fn powers(t: f64, d: i32) -> [f64; 6] {
    std::array::from_fn(|k| {
        let k = k as i32;
        let factor: f64 = (0..d).map(|i| f64::from(k - i)).product();
        if k < d { 0.0 } else { factor * t.powi(k - d) }
    })
}

/// The linear system for a spline's coefficients, row by row.
struct Rows {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    filled: usize,
}

impl Rows {
    fn new(size: usize) -> Self {
        Self {
            matrix: DMatrix::zeros(size, size),
            right: DVector::zeros(size),
            filled: 0,
        }
    }

    /// Terms are (span, time in it, derivative, factor).
    fn push(&mut self, terms: &[(usize, f64, i32, f64)], value: f64) {
        for &(span, t, d, factor) in terms {
            for (k, p) in powers(t, d).into_iter().enumerate() {
                self.matrix[(self.filled, 6 * span + k)] = factor * p;
            }
        }
        self.right[self.filled] = value;
        self.filled += 1;
    }

    fn solve(self) -> Vec<[f64; 6]> {
        let x = self
            .matrix
            .lu()
            .solve(&self.right)
            .expect("via points have distinct times");
        let spans = x.len() / 6;
        (0..spans)
            .map(|s| std::array::from_fn(|k| x[6 * s + k]))
            .collect()
    }
}

/// The Fourier series of period 1 through equally spaced values, the first at phase 0.
pub struct Fourier {
    mean: f64,
    /// (cosine, sine) amplitudes of harmonics 1, 2, …
    harmonics: Vec<(f64, f64)>,
}

impl Fourier {
    pub fn through(values: &[f64], harmonics: usize) -> Self {
        let n = values.len() as f64;
        let project = |k: usize, wave: fn(f64) -> f64| {
            let terms = values.iter().enumerate();
            2.0 / n
                * terms
                    .map(|(i, v)| v * wave(TAU * (k * i) as f64 / n))
                    .sum::<f64>()
        };
        Self {
            mean: values.iter().sum::<f64>() / n,
            harmonics: (1..=harmonics)
                .map(|k| (project(k, f64::cos), project(k, f64::sin)))
                .collect(),
        }
    }

    /// Every harmonic `k` (the mean is 0) times `factor(k)`.
    pub fn filtered(self, factor: impl Fn(usize) -> f64) -> Self {
        let scaled = self.harmonics.iter().enumerate();
        Self {
            mean: self.mean * factor(0),
            harmonics: scaled
                .map(|(i, (c, s))| (c * factor(i + 1), s * factor(i + 1)))
                .collect(),
        }
    }

    pub fn at(&self, phase: f64) -> f64 {
        let waves = self.harmonics.iter().enumerate().map(|(i, (c, s))| {
            let angle = TAU * (i + 1) as f64 * phase;
            c * angle.cos() + s * angle.sin()
        });
        self.mean + waves.sum::<f64>()
    }
}
