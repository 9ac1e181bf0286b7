//! The banded solver beside a dense one.

use super::*;
use nalgebra::{DMatrix, DVector};

/// A sparse J of the band's shape, its JᵀJ + I as blocks and dense.
fn system(n: usize, count: usize) -> (Pentadiagonal, DMatrix<f64>) {
    let mut seed = 7_u64;
    let mut random = || {
        seed = seed
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (seed >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
    };
    let mut dense = DMatrix::<f64>::identity(n * count, n * count);
    for f in 0..count {
        let a = DMatrix::from_fn(2 * n, n, |_, _| random());
        let mut block = dense.view_mut((f * n, f * n), (n, n));
        block += a.transpose() * a;
    }
    for f in 1..count.saturating_sub(1) {
        for i in 0..n {
            let mut row = DVector::<f64>::zeros(n * count);
            for k in (i / 3 * 3)..n.min(i / 3 * 3 + 3) {
                for g in f - 1..=f + 1 {
                    row[g * n + k] = random();
                }
            }
            dense += &row * row.transpose();
        }
    }
    let mut blocks = Pentadiagonal::new(n, count);
    for (f, r, c) in places(n, count) {
        blocks.diagonal[f * n * n + r * n + c] = dense[(f * n + r, f * n + c)];
        for ahead in (1..=2).filter(|ahead| f + ahead < count && r / 3 == c / 3) {
            let value = dense[(f * n + r, (f + ahead) * n + c)];
            blocks.couple(f, ahead, (r, c), value);
        }
    }
    (blocks, dense)
}

/// Every number of every block on the diagonal.
fn places(n: usize, count: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..count * n * n).map(move |at| (at / n / n, at / n % n, at % n))
}

#[test]
fn it_solves_what_a_dense_solver_solves() {
    for (n, count) in [(1, 1), (3, 2), (6, 9), (34, 7), (35, 3), (3, 400)] {
        let (blocks, dense) = system(n, count);
        let mut factor = Factor::new(n, count);
        let right = DVector::from_fn(n * count, |i, _| (i as f64 * 0.7).sin());
        let expected = dense.clone().lu().solve(&right).unwrap();
        let mut x = right.as_slice().to_vec();
        assert!(factor.set(&blocks, 0.0));
        factor.solve(&mut x);
        let error = (DVector::from_vec(x) - expected).norm();
        assert!(error < 1e-8, "{n} × {count}: {error}");
        let at_ends = |i: usize| i < 2 * n || i + 2 * n >= n * count;
        let right = DVector::from_fn(n * count, |i, _| f64::from(u8::from(at_ends(i))) * right[i]);
        let expected = dense.lu().solve(&right).unwrap();
        let mut x = right.as_slice().to_vec();
        factor.solve_ends(&mut x);
        let error = (DVector::from_vec(x) - expected).norm();
        assert!(error < 1e-7, "{n} × {count}, from the ends: {error}");
    }
}

#[test]
fn an_indefinite_matrix_is_refused() {
    let mut blocks = Pentadiagonal::new(2, 2);
    blocks
        .diagonal
        .copy_from_slice(&[1.0, 0.0, 2.0, 1.0, 1.0, 0.0, 0.0, 1.0]);
    assert!(!Factor::new(2, 2).set(&blocks, 0.0));
}
