//! A symmetric positive definite system whose unknowns come in equal blocks, each coupled to the next two.

/// Most that a column of a coupling is to the right or the left of its row.
const BESIDE: usize = 2;
/// Share of the right side of [`Factor::solve_ends`] that is nothing beside it.
const NOTHING: f64 = 1e-10;
/// Numbers of a coupling's row.
const BAND: usize = 2 * BESIDE + 1;

/// Blocks are row-major; block row `f` holds the `n × n` diagonal and the couplings to `f + 1` and `f + 2`, which are
/// bands.
pub(super) struct Pentadiagonal {
    pub n: usize,
    pub count: usize,
    /// Only the lower triangle of each is read.
    pub diagonal: Vec<f64>,
    /// Row block f, column block f + 1.
    next: Vec<[f64; BAND]>,
    /// Row block f, column block f + 2.
    second: Vec<[f64; BAND]>,
}

/// The triangle U with UᵀU the system, block row by block row: n rows of [`Factor::stride`] numbers, in which are U's
/// block on the diagonal (what is left of its diagonal means nothing), its couplings to the next block and to the one
/// after it, and zeros.
pub(super) struct Factor {
    n: usize,
    count: usize,
    stride: usize,
    rows: Vec<f64>,
}

/// Numbers of a block's row in a [`Factor`].
fn stride(n: usize) -> usize {
    (3 * n + WIDE).next_multiple_of(WIDE)
}

impl Pentadiagonal {
    /// Memory of a block row, bytes.
    pub fn bytes(n: usize) -> usize {
        8 * n * (n + 2 * BAND)
    }

    pub fn new(n: usize, count: usize) -> Pentadiagonal {
        let couplings = || vec![[0.0; BAND]; n * count];
        Pentadiagonal {
            n,
            count,
            diagonal: vec![0.0; n * n * count],
            next: couplings(),
            second: couplings(),
        }
    }

    pub fn clear(&mut self) {
        self.diagonal.fill(0.0);
        self.next.fill([0.0; BAND]);
        self.second.fill([0.0; BAND]);
    }

    /// Adds to the coupling of block `f` to the one `ahead` of it, 1 or 2; the column is at most [`BESIDE`] from the row.
    pub fn couple(&mut self, f: usize, ahead: usize, (row, column): (usize, usize), value: f64) {
        let couplings = match ahead {
            1 => &mut self.next,
            _ => &mut self.second,
        };
        couplings[f * self.n + row][column + BESIDE - row] += value;
    }

    /// The mean of the diagonal, times `factor`.
    pub fn mean_times(&self, factor: f64) -> f64 {
        let places = (0..self.count).flat_map(|f| self.places(f));
        let total: f64 = places.map(|at| self.diagonal[at]).sum();
        factor * total / (self.n * self.count) as f64
    }

    /// Where the diagonal of block `f` is.
    fn places(&self, f: usize) -> impl Iterator<Item = usize> + use<> {
        let n = self.n;
        (0..n).map(move |i| f * n * n + i * n + i)
    }
}

/// Rows and columns of the result that [`subtract_product`] holds in registers.
const TALL: usize = 4;
const WIDE: usize = 8;

impl Factor {
    /// Memory of a block row, bytes.
    pub fn bytes(n: usize) -> usize {
        8 * n * stride(n)
    }

    /// Room for the factor of such systems.
    pub fn new(n: usize, count: usize) -> Factor {
        let stride = stride(n);
        Factor {
            n,
            count,
            stride,
            rows: vec![0.0; n * stride * count],
        }
    }

    /// Factors the system with `added` to its diagonal; `false` when that isn't positive definite.
    pub fn set(&mut self, system: &Pentadiagonal, added: f64) -> bool {
        widely(
            #[inline(always)]
            || self.set_here(system, added),
        )
    }

    #[inline(always)]
    fn set_here(&mut self, system: &Pentadiagonal, added: f64) -> bool {
        let (n, stride, size) = (self.n, self.stride, self.n * self.stride);
        for f in 0..self.count {
            self.load(system, f, added);
        }
        for block in 0..self.count {
            let (here, after) = self.rows[block * size..].split_at_mut(size);
            if !eliminate(here, n, stride) {
                return false;
            }
            let product = Product {
                n,
                stride,
                from: here,
            };
            if let Some(next) = after.get_mut(..size) {
                product.subtract(next, n, 2 * n);
            }
            if let Some(second) = after.get_mut(size..2 * size) {
                product.subtract(second, 2 * n, n);
            }
        }
        true
    }

    /// Copies block row `f` of the system.
    #[inline(always)]
    fn load(&mut self, system: &Pentadiagonal, f: usize, added: f64) {
        let (n, stride) = (self.n, self.stride);
        let rows = &mut self.rows[f * n * stride..(f + 1) * n * stride];
        rows.fill(0.0);
        let lower = &system.diagonal[f * n * n..(f + 1) * n * n];
        for (i, row) in rows.chunks_exact_mut(stride).enumerate() {
            (i..n).for_each(|j| row[j] = lower[j * n + i]);
            row[i] += added;
            let columns = i.saturating_sub(BESIDE)..n.min(i + BESIDE + 1);
            for column in columns {
                let at = column + BESIDE - i;
                row[n + column] = system.next[f * n + i][at];
                row[2 * n + column] = system.second[f * n + i][at];
            }
        }
    }

    /// Solves with the factor, in place.
    pub fn solve(&self, x: &mut [f64]) {
        widely(
            #[inline(always)]
            || {
                for f in 0..self.count {
                    self.forward(x, f);
                }
                for f in (0..self.count).rev() {
                    self.back(x, f);
                }
            },
        );
    }

    /// The same for a right side that is zero but in the first and last two blocks. What has become small beside it is
    /// taken to be zero.
    pub fn solve_ends(&self, x: &mut [f64]) {
        let small = NOTHING * x.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let n = self.n;
        let is_small = |x: &[f64], f: usize| x[f * n..(f + 2) * n].iter().all(|v| v.abs() <= small);
        let last = self.count.saturating_sub(2);
        widely(
            #[inline(always)]
            || {
                let mut reached = 0;
                while reached < last && !is_small(x, reached) {
                    self.forward(x, reached);
                    reached += 1;
                }
                x[reached * n..last * n].fill(0.0);
                for f in last..self.count {
                    self.forward(x, f);
                }
                let mut f = self.count;
                while f > 0 {
                    f -= 1;
                    self.back(x, f);
                    if f > reached && f + 2 <= self.count && is_small(x, f) {
                        f = reached;
                    }
                }
            },
        );
    }

    /// Uᵀ⁻¹ of block `f`, taken from what follows as well.
    #[inline(always)]
    fn forward(&self, x: &mut [f64], f: usize) {
        let (n, stride) = (self.n, self.stride);
        let x = &mut x[f * n..self.count.min(f + 3) * n];
        let rows = self.rows[f * n * stride..].chunks_exact(stride);
        for (i, row) in rows.take(n).enumerate() {
            let (done, rest) = x.split_at_mut(i + 1);
            done[i] /= row[i];
            let width = (2 * n + BESIDE).min(rest.len());
            for (x, u) in rest[..width].iter_mut().zip(&row[i + 1..]) {
                *x = u.mul_add(-done[i], *x);
            }
        }
    }

    /// U⁻¹ of block `f`.
    #[inline(always)]
    fn back(&self, x: &mut [f64], f: usize) {
        let (n, stride) = (self.n, self.stride);
        let x = &mut x[f * n..self.count.min(f + 3) * n];
        for i in (0..n).rev() {
            let row = &self.rows[(f * n + i) * stride..(f * n + i + 1) * stride];
            let width = (2 * n + BESIDE).min(x.len() - i - 1);
            let sum = dot(&row[i + 1..][..width], &x[i + 1..][..width]);
            x[i] = (x[i] - sum) / row[i];
        }
    }
}

/// Runs `work` with wide instructions where the processor has them; the bits are the same.
fn widely<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,fma")]
        fn avx2<R>(work: impl FnOnce() -> R) -> R {
            work()
        }
        if has_avx() {
            // SAFETY: the processor has the features that the function is compiled for.
            return unsafe { avx2(work) };
        }
    }
    work()
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn has_avx() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

/// Cholesky elimination of a block row: U and Uᵀ⁻¹ times the couplings, in place.
#[inline(always)]
fn eliminate(rows: &mut [f64], n: usize, stride: usize) -> bool {
    for top in (0..n).step_by(TALL) {
        let height = TALL.min(n - top);
        // The second coupling ends beside the diagonal.
        let end = 2 * n + (top + height + BESIDE).min(n);
        let (done, rest) = rows.split_at_mut(top * stride);
        let strip = &mut rest[..height * stride];
        for column in (top / WIDE * WIDE..end).step_by(WIDE) {
            let from = column.saturating_sub(2 * n + BESIDE);
            let (done, at) = (&done[from.min(top) * stride..], &mut strip[column..]);
            let (a, b) = (
                &done[top.min(done.len())..],
                &done[column.min(done.len())..],
            );
            subtract_product(at, (a, b), stride, height);
        }
        for i in 0..height {
            let (above, below) = strip.split_at_mut((i + 1) * stride);
            let row = &mut above[i * stride + top + i..i * stride + end];
            let pivot = row[0];
            if pivot.is_nan() || pivot <= 0.0 {
                return false;
            }
            let inverse = 1.0 / pivot.sqrt();
            row.iter_mut().for_each(|x| *x *= inverse);
            for (k, other) in below.chunks_exact_mut(stride).enumerate() {
                let factor = -row[k + 1];
                let other = &mut other[top + i..end];
                for (x, u) in other.iter_mut().zip(&*row) {
                    *x = u.mul_add(factor, *x);
                }
            }
        }
    }
    true
}

/// What an eliminated block row takes from those it is coupled to.
struct Product<'a> {
    n: usize,
    stride: usize,
    from: &'a [f64],
}

impl Product<'_> {
    /// Takes from the first `width` columns of `to` the transpose of the `n` columns from `first` on times the `width`
    /// columns from there on, right of the diagonal.
    #[inline(always)]
    fn subtract(&self, to: &mut [f64], first: usize, width: usize) {
        let (n, stride) = (self.n, self.stride);
        for top in (0..n).step_by(TALL) {
            let height = TALL.min(n - top);
            let strip = &mut to[top * stride..(top + height) * stride];
            for column in (top / WIDE * WIDE..width).step_by(WIDE) {
                // Nothing is that far right in the second coupling.
                let from = (first + column).saturating_sub(2 * n + BESIDE);
                let rows = &self.from[from.min(n) * stride..];
                let (a, b) = (rows.get(first + top..), rows.get(first + column..));
                if let (Some(a), Some(b)) = (a, b) {
                    subtract_product(&mut strip[column..], (a, b), stride, height);
                }
            }
        }
    }
}

/// c −= aᵀ b for `height` rows and [`WIDE`] columns of c, all with rows of `stride` numbers.
#[inline(always)]
fn subtract_product(c: &mut [f64], (a, b): (&[f64], &[f64]), stride: usize, height: usize) {
    match height {
        TALL => subtract_tile::<TALL>(c, a, b, stride),
        3 => subtract_tile::<3>(c, a, b, stride),
        2 => subtract_tile::<2>(c, a, b, stride),
        _ => subtract_tile::<1>(c, a, b, stride),
    }
}

#[inline(always)]
fn subtract_tile<const H: usize>(c: &mut [f64], a: &[f64], b: &[f64], stride: usize) {
    #[cfg(target_arch = "x86_64")]
    if has_avx() {
        // SAFETY: the processor has the features that the function is compiled for.
        return unsafe { subtract_tile_avx::<H>(c, a, b, stride) };
    }
    let mut sums = [[0.0; WIDE]; H];
    for (a, b) in tile_rows::<H>(a, b, stride) {
        for (sums, a) in sums.iter_mut().zip(a) {
            for (sum, b) in sums.iter_mut().zip(b) {
                *sum = a.mul_add(*b, *sum);
            }
        }
    }
    subtract_sums(c, &sums, stride);
}

/// The same; the compiler doesn't find these instructions by itself.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
#[inline]
fn subtract_tile_avx<const H: usize>(c: &mut [f64], a: &[f64], b: &[f64], stride: usize) {
    use std::arch::x86_64::{__m256d, _mm256_fmadd_pd, _mm256_set1_pd, _mm256_setr_pd};
    let mut sums = [[_mm256_set1_pd(0.0); 2]; H];
    for (a, b) in tile_rows::<H>(a, b, stride) {
        let halves = [
            _mm256_setr_pd(b[0], b[1], b[2], b[3]),
            _mm256_setr_pd(b[4], b[5], b[6], b[7]),
        ];
        for (sums, a) in sums.iter_mut().zip(a) {
            let a = _mm256_set1_pd(*a);
            for (sum, half) in sums.iter_mut().zip(halves) {
                *sum = _mm256_fmadd_pd(a, half, *sum);
            }
        }
    }
    // SAFETY: eight doubles are as large as two vectors of four, and any bits of them are doubles.
    let sums = sums.map(|row| unsafe { std::mem::transmute::<[__m256d; 2], [f64; WIDE]>(row) });
    subtract_sums(c, &sums, stride);
}

#[inline(always)]
fn tile_rows<'a, const H: usize>(
    a: &'a [f64],
    b: &'a [f64],
    stride: usize,
) -> impl Iterator<Item = (&'a [f64; H], &'a [f64; WIDE])> {
    let pairs = a.chunks(stride).zip(b.chunks(stride));
    pairs.map_while(|(a, b)| Some((a.first_chunk()?, b.first_chunk()?)))
}

#[inline(always)]
fn subtract_sums(c: &mut [f64], sums: &[[f64; WIDE]], stride: usize) {
    for (c, sums) in c.chunks_mut(stride).zip(sums) {
        for (c, sum) in c.iter_mut().zip(sums) {
            *c -= sum;
        }
    }
}

/// Sum of products in eight strands, which the compiler can keep side by side.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; WIDE];
    let (wide_a, wide_b) = (a.chunks_exact(WIDE), b.chunks_exact(WIDE));
    let rest = wide_a.remainder().iter().zip(wide_b.remainder());
    let mut sum = 0.0;
    for (x, y) in rest {
        sum = x.mul_add(*y, sum);
    }
    for (x, y) in wide_a.zip(wide_b) {
        for (sum, (x, y)) in sums.iter_mut().zip(x.iter().zip(y)) {
            *sum = x.mul_add(*y, *sum);
        }
    }
    sums.iter().sum::<f64>() + sum
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
            let right =
                DVector::from_fn(n * count, |i, _| f64::from(u8::from(at_ends(i))) * right[i]);
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
}
