//! A symmetric positive definite system whose unknowns come in equal blocks, each coupled to the next two, and its Cholesky
//! factor.
//!
//! A block is a frame, and its unknowns are the degrees of freedom. Goals make the blocks on the diagonal, which are dense;
//! accelerations make the couplings, in which each degree of freedom meets only itself or those of the same joint. The
//! factor fills in within the band only, so time and memory grow with the number of frames, not with its square.

use super::tile::{TALL, WIDE, dot, subtract_product, widely};

/// Most that a column of a coupling is to the right or the left of its row: a ball joint has three degrees of freedom.
const BESIDE: usize = 2;
/// Share of the largest number on the right side of [`Factor::solve_ends`] below which others are taken to be zero. Chosen
/// far below what a step of the solver has to be exact to.
const NOTHING: f64 = 1e-10;
/// Numbers in a coupling's row.
const BAND: usize = 2 * BESIDE + 1;

/// The system: block row `f` has the `n × n` block on the diagonal and the couplings to the blocks `f + 1` and `f + 2`.
pub(super) struct Pentadiagonal {
    /// Unknowns of a block.
    pub n: usize,
    /// Blocks.
    pub count: usize,
    /// The blocks on the diagonal one after the other, row by row. Only the lower triangle of each is read.
    pub diagonal: Vec<f64>,
    /// Row block f, column block f + 1, by row: the columns beside the row's own.
    next: Vec<[f64; BAND]>,
    /// Row block f, column block f + 2.
    second: Vec<[f64; BAND]>,
}

/// The upper triangle U with UᵀU the system.
///
/// It lies block row by block row, n rows of `stride` numbers each: U's block on the diagonal (what is below the diagonal
/// means nothing), its couplings to the next block and to the one after it, and zeros. So elimination, products and
/// solutions all run along rows, which made retargeting half again as fast as adding rows to rows.
pub(super) struct Factor {
    n: usize,
    count: usize,
    stride: usize,
    rows: Vec<f64>,
}

/// Numbers of a row in a [`Factor`]: three blocks, and padding so that tiles of eight columns never end beyond the row.
fn stride(n: usize) -> usize {
    (3 * n + WIDE).next_multiple_of(WIDE)
}

impl Pentadiagonal {
    /// Memory of a block row, bytes.
    pub fn bytes(n: usize) -> usize {
        8 * n * (n + 2 * BAND)
    }

    /// A system of zeros.
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

    /// Sets all to zero.
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

    /// The mean of the whole diagonal, times `factor`.
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

impl Factor {
    /// Memory of a block row, bytes.
    pub fn bytes(n: usize) -> usize {
        8 * n * stride(n)
    }

    /// Memory for the factor of such systems.
    pub fn new(n: usize, count: usize) -> Factor {
        let stride = stride(n);
        Factor {
            n,
            count,
            stride,
            rows: vec![0.0; n * stride * count],
        }
    }

    /// Factors the system with `added` to its diagonal; `false` if that isn't positive definite.
    pub fn set(&mut self, system: &Pentadiagonal, added: f64) -> bool {
        widely(
            #[inline(always)]
            || self.set_here(system, added),
        )
    }

    /// Block by block: the block row is eliminated, and what that takes from the two block rows below it is subtracted.
    #[inline(always)]
    fn set_here(&mut self, system: &Pentadiagonal, added: f64) -> bool {
        let (n, stride, size) = (self.n, self.stride, self.n * self.stride);
        // All is loaded first, for the elimination of a block row subtracts from the two below it.
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
            // The next block row: its own block and its coupling to the one after it, which is this row's second.
            if let Some(next) = after.get_mut(..size) {
                product.subtract(next, n, 2 * n);
            }
            // The one after it: its own block alone, for nothing couples this row to anything further.
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
            // The upper triangle is the lower one's mirror image.
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

    /// The same for a right side that is zero except in the first and the last two blocks, as around the seam of a cycle.
    /// Its influence decays along the band, so both substitutions stop where what they carry on has become [`NOTHING`]
    /// beside it.
    pub fn solve_ends(&self, x: &mut [f64]) {
        let small = NOTHING * x.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let n = self.n;
        let is_small = |x: &[f64], f: usize| x[f * n..(f + 2) * n].iter().all(|v| v.abs() <= small);
        let last = self.count.saturating_sub(2);
        widely(
            #[inline(always)]
            || {
                // From the first blocks forward until what is carried on has died away …
                let mut reached = 0;
                while reached < last && !is_small(x, reached) {
                    self.forward(x, reached);
                    reached += 1;
                }
                // … the blocks between are zero, and those at the other end have a right side of their own.
                x[reached * n..last * n].fill(0.0);
                for f in last..self.count {
                    self.forward(x, f);
                }
                // Back from the end until that has died away, then on from where the first blocks reached.
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

    /// Forward substitution of block `f`: x ← Uᵀ⁻¹ x, subtracted from what follows as well.
    #[inline(always)]
    fn forward(&self, x: &mut [f64], f: usize) {
        let (n, stride) = (self.n, self.stride);
        let x = &mut x[f * n..self.count.min(f + 3) * n];
        let rows = self.rows[f * n * stride..].chunks_exact(stride);
        for (i, row) in rows.take(n).enumerate() {
            let (done, rest) = x.split_at_mut(i + 1);
            done[i] /= row[i];
            // Beyond its two couplings a row has nothing; the last rows end with the system.
            let width = (2 * n + BESIDE).min(rest.len());
            for (x, u) in rest[..width].iter_mut().zip(&row[i + 1..]) {
                *x = u.mul_add(-done[i], *x);
            }
        }
    }

    /// Back substitution of block `f`: x ← U⁻¹ x.
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

/// Cholesky elimination of a block row, in place: its block becomes U, its couplings Uᵀ⁻¹ times themselves; `false` if a
/// pivot isn't positive. A strip of four rows at a time: first what all rows above take from it, tile by tile, then the four
/// rows by themselves.
#[inline(always)]
fn eliminate(rows: &mut [f64], n: usize, stride: usize) -> bool {
    for top in (0..n).step_by(TALL) {
        let height = TALL.min(n - top);
        // The second coupling has nothing further right than this.
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
            // A pivot that is NaN, or not positive, means that the system isn't positive definite.
            let pivot = row[0];
            if pivot.is_nan() || pivot <= 0.0 {
                return false;
            }
            let inverse = 1.0 / pivot.sqrt();
            row.iter_mut().for_each(|x| *x *= inverse);
            // What this row takes from those below it in the strip.
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

/// An eliminated block row, whose products are taken from the block rows that it is coupled to.
struct Product<'a> {
    n: usize,
    stride: usize,
    from: &'a [f64],
}

impl Product<'_> {
    /// Subtracts AᵀB from the first `width` columns of `to`, right of the diagonal: A is the `n` columns from `first` on, B
    /// the `width` columns from there on.
    #[inline(always)]
    fn subtract(&self, to: &mut [f64], first: usize, width: usize) {
        let (n, stride) = (self.n, self.stride);
        for top in (0..n).step_by(TALL) {
            let height = TALL.min(n - top);
            let strip = &mut to[top * stride..(top + height) * stride];
            for column in (top / WIDE * WIDE..width).step_by(WIDE) {
                // Rows above this one have nothing that far right in the second coupling.
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

#[cfg(test)]
mod tests;
