//! Running mean and variance of observations.

use super::error::{LearnError, check_length};
use super::kernels::{Scalar, standardise};

/// Normalised observations are clipped to ± this many deviations, as in OpenAI's `baselines`.
pub(crate) const OBSERVATION_LIMIT: f64 = 10.0;

/// Smaller deviations count as this much, so that rounding errors of a constant column aren't blown up. Chosen.
const SMALLEST_DEVIATION: f64 = 1e-4;

/// Running statistics of each column of the observations.
#[derive(Clone, Debug, PartialEq)]
pub struct Normalizer {
    /// Rows seen.
    pub count: f64,
    /// `[columns]`: mean of each column.
    pub mean: Vec<f64>,
    /// `[columns]`: sum of the squared differences from the mean.
    pub squares: Vec<f64>,
}

/// A copy for inference: `clamp((x − mean)/deviation, ±limit)`.
#[derive(Clone, Debug, PartialEq)]
pub struct FrozenNormalizer<T> {
    /// `[columns]`: mean of each column.
    pub mean: Vec<T>,
    /// `[columns]`: one over the standard deviation of each column.
    pub inverse_deviation: Vec<T>,
    /// Deviations that a normalised observation is clipped to.
    pub limit: T,
}

impl Normalizer {
    /// Statistics of no rows yet.
    pub fn new(columns: usize) -> Self {
        Self {
            count: 0.0,
            mean: vec![0.0; columns],
            squares: vec![0.0; columns],
        }
    }

    /// Takes in raw observations `[rows, columns]`.
    ///
    /// # Errors
    /// Rows that aren't whole, or an observation that isn't finite; the statistics then stay as they were.
    pub fn update<T: Scalar>(&mut self, rows: &[T]) -> Result<(), LearnError> {
        let columns = self.mean.len();
        let count = rows.len() / columns.max(1);
        check_length("batch of observations", rows.len(), count * columns)?;
        let mut batch = Self::new(columns);
        batch.count = count as f64;
        // First the mean, then the differences from it: Σx² − n·mean² would lose all digits of a column far from 0.
        for row in rows.chunks_exact(columns.max(1)) {
            batch
                .mean
                .iter_mut()
                .zip(row)
                .for_each(|(m, x)| *m += x.to_f64());
        }
        batch
            .mean
            .iter_mut()
            .for_each(|m| *m /= batch.count.max(1.0));
        for row in rows.chunks_exact(columns.max(1)) {
            for ((s, m), x) in batch.squares.iter_mut().zip(&batch.mean).zip(row) {
                let difference = x.to_f64() - m;
                *s += difference * difference;
            }
        }
        // A NaN or an infinity in any row reaches its column's sum, so one look per column is enough.
        if let Some(column) = batch.squares.iter().position(|s| !s.is_finite()) {
            return Err(LearnError::Observation { column });
        }
        self.merge(&batch);
        Ok(())
    }

    /// Adds the statistics of other rows (Chan, Golub & LeVeque 1983, "Algorithms for computing the sample variance").
    /// Merge in a fixed order to get the same bits.
    ///
    /// Columns that only one of the two has are left alone.
    pub fn merge(&mut self, other: &Self) {
        let total = self.count + other.count;
        if other.count == 0.0 {
            return;
        }
        let columns = self.mean.iter_mut().zip(&mut self.squares);
        for ((mean, squares), (other_mean, other_squares)) in
            columns.zip(other.mean.iter().zip(&other.squares))
        {
            let difference = other_mean - *mean;
            *mean += difference * other.count / total;
            *squares += other_squares + difference * difference * self.count * other.count / total;
        }
        self.count = total;
    }

    /// Population variance of each column, 1 before anything was seen.
    pub fn variance(&self) -> Vec<f64> {
        if self.count == 0.0 {
            return vec![1.0; self.squares.len()];
        }
        self.squares.iter().map(|s| s / self.count).collect()
    }

    /// A copy for inference that clips to ±`limit` deviations.
    pub fn frozen<T: Scalar>(&self, limit: f64) -> FrozenNormalizer<T> {
        let inverse = |variance: f64| T::from_f64(1.0 / variance.sqrt().max(SMALLEST_DEVIATION));
        FrozenNormalizer {
            mean: self.mean.iter().map(|&m| T::from_f64(m)).collect(),
            inverse_deviation: self.variance().into_iter().map(inverse).collect(),
            limit: T::from_f64(limit),
        }
    }
}

impl<T: Scalar> FrozenNormalizer<T> {
    /// Normalises observations `[rows, columns]` into `out` of the same length.
    ///
    /// # Errors
    /// Rows that aren't whole, or `out` of another length.
    pub fn apply(&self, raw: &[T], out: &mut [T]) -> Result<(), LearnError> {
        let columns = self.mean.len();
        check_length(
            "batch of observations",
            raw.len(),
            raw.len() / columns.max(1) * columns,
        )?;
        check_length("normalised observations", out.len(), raw.len())?;
        if columns > 0 {
            standardise(raw, &self.mean, &self.inverse_deviation, self.limit, out);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: [f64; 12] = [
        1.0,
        1e6,
        2.0,
        1e6 + 1.0,
        4.0,
        1e6 + 2.0,
        -3.0,
        1e6,
        0.5,
        1e6 + 5.0,
        7.0,
        1e6,
    ];

    #[test]
    fn merged_batches_have_the_statistics_of_all_rows() {
        let mut running = Normalizer::new(2);
        running.update(&ROWS[..2]).unwrap();
        running.update(&ROWS[2..8]).unwrap();
        running.update(&ROWS[8..]).unwrap();
        for column in 0..2 {
            let values: Vec<f64> = ROWS.iter().skip(column).step_by(2).copied().collect();
            let mean = values.iter().sum::<f64>() / 6.0;
            let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 6.0;
            assert!((running.mean[column] - mean).abs() < 1e-9);
            assert!((running.variance()[column] - variance).abs() < 1e-9);
        }
    }

    #[test]
    fn frozen_copy_standardises_and_clips() {
        let mut running = Normalizer::new(1);
        running.update(&[1.0, 3.0]).unwrap();
        let mut out = [0.0_f32; 3];
        running
            .frozen(10.0)
            .apply(&[4.0, 100.0, -100.0], &mut out)
            .unwrap();
        assert_eq!(out, [2.0, 10.0, -10.0]);
    }

    #[test]
    fn a_value_that_is_not_finite_is_refused() {
        let mut running = Normalizer::new(2);
        let before = running.clone();
        assert_eq!(
            running.update(&[0.0, 1.0, 0.0, f64::NAN]),
            Err(LearnError::Observation { column: 1 })
        );
        assert_eq!(running, before);
    }
}
