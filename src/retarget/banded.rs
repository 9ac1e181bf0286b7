//! A symmetric positive definite system whose unknowns come in equal blocks, each coupled to the next two.

/// Blocks are row-major `n × n`; block row `f` holds the diagonal and the couplings to `f + 1` and `f + 2`.
pub(super) struct Pentadiagonal {
    pub n: usize,
    pub count: usize,
    /// Only the lower triangle of each is read.
    pub diagonal: Vec<f64>,
    /// Row block f, column block f + 1.
    pub next: Vec<f64>,
    /// Row block f, column block f + 2; nothing right of its 3 × 3 blocks on the diagonal.
    pub second: Vec<f64>,
}

/// Width of the blocks along the diagonal of [`Pentadiagonal::second`].
const BLOCK: usize = 3;

impl Pentadiagonal {
    pub fn new(n: usize, count: usize) -> Pentadiagonal {
        let zeros = || vec![0.0; n * n * count];
        Pentadiagonal {
            n,
            count,
            diagonal: zeros(),
            next: zeros(),
            second: zeros(),
        }
    }

    pub fn clear(&mut self) {
        self.diagonal.fill(0.0);
        self.next.fill(0.0);
        self.second.fill(0.0);
    }

    /// Cholesky factor in place: `diagonal` becomes L, `next` and `second` L⁻¹ times themselves.
    /// `false` when the matrix is not positive definite.
    pub fn factor(&mut self) -> bool {
        widely(
            #[inline(always)]
            || self.factor_here(),
        )
    }

    #[inline(always)]
    fn factor_here(&mut self) -> bool {
        let (n, size) = (self.n, self.n * self.n);
        for f in 0..self.count {
            let (done, rest) = self.diagonal.split_at_mut((f + 1) * size);
            let lower = &mut done[f * size..];
            if !cholesky(lower, n) {
                return false;
            }
            let (next_done, next_rest) = self.next.split_at_mut((f + 1) * size);
            let next = &mut next_done[f * size..];
            if f + 1 < self.count {
                solve_rows(lower, next, n);
                subtract_product(&mut rest[..size], next, next, n, n, |i| i + 1);
            }
            if f + 2 < self.count {
                let second = &mut self.second[f * size..(f + 1) * size];
                solve_rows(lower, second, n);
                subtract_product(&mut next_rest[..size], next, second, n, BLOCK, |_| n);
                let after = &mut rest[size..2 * size];
                subtract_product(after, second, second, n, BLOCK, |i| i + 1);
            }
        }
        true
    }

    /// Solves with the factor, in place.
    pub fn solve(&self, x: &mut [f64]) {
        widely(
            #[inline(always)]
            || self.solve_here(x),
        );
    }

    #[inline(always)]
    fn solve_here(&self, x: &mut [f64]) {
        let (n, size) = (self.n, self.n * self.n);
        for f in 0..self.count {
            let (done, rest) = x.split_at_mut((f + 1) * n);
            let here = &mut done[f * n..];
            let lower = &self.diagonal[f * size..(f + 1) * size];
            for i in 0..n {
                let sum = dot(&lower[i * n..i * n + i], &here[..i]);
                here[i] = (here[i] - sum) / lower[i * n + i];
            }
            for (ahead, blocks) in [(1, &self.next), (2, &self.second)] {
                if f + ahead < self.count {
                    let block = &blocks[f * size..(f + 1) * size];
                    let there = &mut rest[(ahead - 1) * n..ahead * n];
                    for (row, value) in block.chunks_exact(n).zip(here.iter()) {
                        add_scaled(there, row, -value);
                    }
                }
            }
        }
        for f in (0..self.count).rev() {
            let (done, rest) = x.split_at_mut((f + 1) * n);
            let here = &mut done[f * n..];
            for (ahead, blocks) in [(1, &self.next), (2, &self.second)] {
                if f + ahead < self.count {
                    let block = &blocks[f * size..(f + 1) * size];
                    let there = &rest[(ahead - 1) * n..ahead * n];
                    for (row, value) in block.chunks_exact(n).zip(here.iter_mut()) {
                        *value -= dot(row, there);
                    }
                }
            }
            let lower = &self.diagonal[f * size..(f + 1) * size];
            for i in (0..n).rev() {
                here[i] /= lower[i * n + i];
                let value = here[i];
                add_scaled(&mut here[..i], &lower[i * n..i * n + i], -value);
            }
        }
    }
}

/// Runs `work` with instructions for four numbers at a time where the processor has them; the bits are the same.
fn widely<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn avx2<R>(work: impl FnOnce() -> R) -> R {
            work()
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has the feature that the function is compiled for.
            return unsafe { avx2(work) };
        }
    }
    work()
}

#[inline(always)]
fn add_scaled(to: &mut [f64], from: &[f64], factor: f64) {
    for (t, s) in to.iter_mut().zip(from) {
        *t += factor * s;
    }
}

/// Lower Cholesky factor in place, column by column of its transpose so that the inner loops run along rows.
#[inline(always)]
fn cholesky(a: &mut [f64], n: usize) -> bool {
    for j in 0..n {
        for i in j..n {
            let (head, tail) = a.split_at(i * n);
            let row_j = if i == j {
                &tail[..j]
            } else {
                &head[j * n..j * n + j]
            };
            let sum = dot(&tail[..j], row_j);
            a[i * n + j] -= sum;
        }
        let pivot = a[j * n + j];
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        let root = pivot.sqrt();
        for i in j..n {
            a[i * n + j] /= root;
        }
    }
    true
}

/// Sum of products in four strands, which the compiler can keep side by side.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a4
        .remainder()
        .iter()
        .zip(b4.remainder())
        .map(|(x, y)| x * y)
        .sum();
    for (x, y) in a4.zip(b4) {
        for (sum, (x, y)) in sums.iter_mut().zip(x.iter().zip(y)) {
            *sum += x * y;
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// `b` becomes L⁻¹ b.
#[inline(always)]
fn solve_rows(lower: &[f64], b: &mut [f64], n: usize) {
    for i in 0..n {
        let (done, rest) = b.split_at_mut(i * n);
        let row = &mut rest[..n];
        subtract_rows(row, done, &lower[i * n..i * n + i], n);
        let inverse = 1.0 / lower[i * n + i];
        row.iter_mut().for_each(|x| *x *= inverse);
    }
}

/// `row` −= Σₖ factorsₖ · (row k of `rows`), four rows at a time.
#[inline(always)]
fn subtract_rows(row: &mut [f64], rows: &[f64], factors: &[f64], n: usize) {
    let fours = factors.len() / 4 * 4;
    for (f, four) in factors[..fours]
        .chunks_exact(4)
        .zip(rows.chunks_exact(4 * n))
    {
        let (a, rest) = four.split_at(n);
        let (b, rest) = rest.split_at(n);
        let (c, d) = rest.split_at(n);
        for ((((x, a), b), c), d) in row.iter_mut().zip(a).zip(b).zip(c).zip(d) {
            *x -= f[0] * a + f[1] * b + f[2] * c + f[3] * d;
        }
    }
    for (f, one) in factors[fours..]
        .iter()
        .zip(rows[fours * n..].chunks_exact(n))
    {
        add_scaled(row, one, -f);
    }
}

/// c −= aᵀ b, where row k of `b` is zero from column `k + reach` on, in the first `columns(i)` columns of row i.
#[inline(always)]
fn subtract_product(
    c: &mut [f64],
    a: &[f64],
    b: &[f64],
    n: usize,
    reach: usize,
    columns: impl Fn(usize) -> usize,
) {
    let fours = n / 4 * 4;
    for k in (0..fours).step_by(4) {
        let width = n.min(k + 3 + reach);
        let row = |m: &'_ [f64], k: usize| -> usize {
            debug_assert!(k * n < m.len());
            k * n
        };
        let (b0, b1) = (&b[row(b, k)..][..width], &b[row(b, k + 1)..][..width]);
        let (b2, b3) = (&b[row(b, k + 2)..][..width], &b[row(b, k + 3)..][..width]);
        for i in 0..n {
            let (f0, f1) = (a[k * n + i], a[(k + 1) * n + i]);
            let (f2, f3) = (a[(k + 2) * n + i], a[(k + 3) * n + i]);
            let out = &mut c[i * n..i * n + width.min(columns(i))];
            for ((((x, p), q), r), s) in out.iter_mut().zip(b0).zip(b1).zip(b2).zip(b3) {
                *x -= f0 * p + f1 * q + f2 * r + f3 * s;
            }
        }
    }
    for k in fours..n {
        let width = n.min(k + reach);
        for i in 0..n {
            let factor = a[k * n + i];
            let width = width.min(columns(i));
            add_scaled(
                &mut c[i * n..i * n + width],
                &b[k * n..k * n + width],
                -factor,
            );
        }
    }
}

#[cfg(test)]
mod tests {
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
        for f in 0..count {
            for (ahead, to) in [
                (0, &mut blocks.diagonal),
                (1, &mut blocks.next),
                (2, &mut blocks.second),
            ] {
                if f + ahead < count {
                    let view = dense.view((f * n, (f + ahead) * n), (n, n));
                    for r in 0..n {
                        for c in 0..n {
                            to[f * n * n + r * n + c] = view[(r, c)];
                        }
                    }
                }
            }
        }
        (blocks, dense)
    }

    #[test]
    fn it_solves_what_a_dense_solver_solves() {
        for (n, count) in [(1, 1), (3, 2), (6, 9), (34, 7), (35, 3)] {
            let (mut blocks, dense) = system(n, count);
            let right = DVector::from_fn(n * count, |i, _| (i as f64 * 0.7).sin());
            let expected = dense.clone().lu().solve(&right).unwrap();
            let mut x = right.as_slice().to_vec();
            assert!(blocks.factor());
            blocks.solve(&mut x);
            let error = (DVector::from_vec(x) - expected).norm();
            assert!(error < 1e-8, "{n} × {count}: {error}");
        }
    }

    #[test]
    fn an_indefinite_matrix_is_refused() {
        let mut blocks = Pentadiagonal::new(2, 2);
        blocks
            .diagonal
            .copy_from_slice(&[1.0, 0.0, 2.0, 1.0, 1.0, 0.0, 0.0, 1.0]);
        assert!(!blocks.factor());
    }
}
