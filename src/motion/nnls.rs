//! Least squares with non-negative unknowns.

use nalgebra::{DMatrix, DVector};

/// Finds the x ≥ 0 that minimises ‖A x − b‖, by the active-set method of Lawson and Hanson, Solving Least Squares Problems
/// (1974), chapter 23.
///
/// Columns enter the solution one by one while the gradient says that they help, and a column that would turn negative
/// leaves.
pub(crate) fn solve(a: &DMatrix<f64>, b: &DVector<f64>) -> DVector<f64> {
    active_set(a, b, 0.0, |part| {
        let normal = part.transpose() * part;
        Some(normal.cholesky()?.solve(&(part.transpose() * b)))
    })
}

/// Finds the x ≥ 0 that minimises ‖A x − b‖² + ‖`even` x‖², which spreads x over columns that do the same.
///
/// The systems have only as many unknowns as A has rows, by (AᵀA + e²)⁻¹ Aᵀ = Aᵀ (A Aᵀ + e²)⁻¹.
pub(crate) fn solve_evenly(a: &DMatrix<f64>, b: &DVector<f64>, even: f64) -> DVector<f64> {
    active_set(a, b, even, |part| {
        let mut small = part * part.transpose();
        (0..small.nrows()).for_each(|i| small[(i, i)] += even * even);
        Some(part.transpose() * small.cholesky()?.solve(b))
    })
}

/// The active-set method; `optimum` gives the unconstrained optimum over some columns.
fn active_set(
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    even: f64,
    optimum: impl Fn(&DMatrix<f64>) -> Option<DVector<f64>>,
) -> DVector<f64> {
    let columns = a.ncols();
    let mut x = DVector::zeros(columns);
    let mut passive = vec![false; columns];
    // A gradient this small, relative to the sizes of A and b, is rounding.
    let tolerance = 1e-10 * (1.0 + a.norm() * b.norm());
    // The method is finite; the bound only guards against cycling by rounding.
    for _ in 0..3 * columns {
        let gradient = a.transpose() * (b - a * &x) - &x * (even * even);
        let entering = (0..columns)
            .filter(|&j| !passive[j] && gradient[j] > tolerance)
            .max_by(|&i, &j| gradient[i].total_cmp(&gradient[j]));
        let Some(entering) = entering else {
            break;
        };
        passive[entering] = true;
        let Some(next) = descend(a, x.clone(), &mut passive, &optimum) else {
            break;
        };
        x = next;
    }
    x
}

/// Moves `x` to the unconstrained optimum over the passive columns, dropping those that reach zero on the way.
/// `None` if the passive columns have become dependent.
fn descend(
    a: &DMatrix<f64>,
    mut x: DVector<f64>,
    passive: &mut [bool],
    optimum: &impl Fn(&DMatrix<f64>) -> Option<DVector<f64>>,
) -> Option<DVector<f64>> {
    loop {
        let set: Vec<usize> = (0..passive.len()).filter(|&j| passive[j]).collect();
        let optimum = optimum(&a.select_columns(&set))?;
        // The longest step towards the optimum that keeps all of x non-negative, and the column that stops it.
        let ratio = |j: usize, s: f64| if x[j] > 0.0 { x[j] / (x[j] - s) } else { 0.0 };
        let blocking = set
            .iter()
            .zip(optimum.iter())
            .filter(|(_, s)| **s <= 0.0)
            .map(|(&j, &s)| (j, ratio(j, s)))
            .min_by(|(_, p), (_, q)| p.total_cmp(q));
        let step = blocking.map_or(1.0, |(_, ratio)| ratio);
        for (&j, s) in set.iter().zip(optimum.iter()) {
            x[j] = (x[j] + step * (s - x[j])).max(0.0);
        }
        let Some((leaving, _)) = blocking else {
            return Some(x);
        };
        x[leaving] = 0.0;
        passive[leaving] = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Karush–Kuhn–Tucker: x ≥ 0, gradient Aᵀ(Ax − b) ≥ 0, and one of the two is zero in every place.
    fn assert_optimal(a: &DMatrix<f64>, b: &DVector<f64>) {
        let x = solve(a, b);
        let gradient = a.transpose() * (a * &x - b);
        for (x, g) in x.iter().zip(gradient.iter()) {
            assert!(*x >= 0.0 && *g >= -1e-8 && (x * g).abs() < 1e-8, "{x} {g}");
        }
        let even = 0.1;
        let x = solve_evenly(a, b, even);
        let gradient = a.transpose() * (a * &x - b) + &x * (even * even);
        for (x, g) in x.iter().zip(gradient.iter()) {
            assert!(
                *x >= 0.0 && *g >= -1e-8 && (x * g).abs() < 1e-8,
                "even: {x} {g}"
            );
        }
    }

    #[test]
    fn the_optimum_satisfies_kuhn_tucker() {
        let mut state = 1_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        for columns in [1, 3, 6, 20, 64] {
            for _ in 0..50 {
                let a = DMatrix::from_fn(6, columns, |_, _| random());
                let b = DVector::from_fn(6, |_, _| random());
                assert_optimal(&a, &b);
            }
        }
    }

    #[test]
    fn an_unreachable_target_gives_zero() {
        let a = DMatrix::from_row_slice(2, 1, &[1.0, 0.0]);
        let x = solve(&a, &DVector::from_vec(vec![-1.0, 2.0]));
        assert_eq!(x[0], 0.0);
    }
}
