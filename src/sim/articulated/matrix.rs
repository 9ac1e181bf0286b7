//! The inertia matrix of a tree and its factor.
//!
//! Two coordinates have an entry only if one carries the other, so a coordinate's row holds the blocks of its path and
//! nothing else. M = Hᵀ H, factored from the tips inwards, keeps that pattern (RBDA §6.5), and since the path of an
//! ancestor is the beginning of the path of what it carries, every inner loop runs over neighbours in memory.

use super::tree::Tree;
use wide::f32x4;

/// Rows of one block of coordinates.
#[derive(Clone, Copy, Debug)]
struct Rows {
    /// Where they begin: `[length]`, three of a block of the path each.
    start: usize,
    /// How many of the three are in use.
    lanes: usize,
    /// Blocks of the path, and where they are listed.
    length: usize,
    path: usize,
    /// After factoring: the inverse of the diagonal block of Hᵀ, a lower triangle, by columns and by rows.
    columns: [f32x4; 3],
    rows: [f32x4; 3],
}

/// A symmetric matrix over the paths of a tree, or its factor.
#[derive(Clone, Debug)]
pub(super) struct PathMatrix {
    /// By block.
    rows: Vec<Rows>,
    paths: Vec<usize>,
    entries: Vec<[f32x4; 3]>,
}

impl PathMatrix {
    pub fn new(tree: &Tree) -> Self {
        let mut matrix = PathMatrix {
            rows: Vec::new(),
            paths: Vec::new(),
            entries: Vec::new(),
        };
        for node in &tree.nodes {
            let path = matrix.paths.len();
            matrix.paths.extend(&node.path);
            for block in matrix.rows.len()..=node.block {
                let length = node.path.iter().filter(|&&b| b <= block).count();
                matrix.add(tree.used[block], length, path);
            }
        }
        matrix
    }

    fn add(&mut self, lanes: usize, length: usize, path: usize) {
        self.rows.push(Rows {
            start: self.entries.len(),
            lanes,
            length,
            path,
            columns: [f32x4::ZERO; 3],
            rows: [f32x4::ZERO; 3],
        });
        let end = self.entries.len() + length;
        self.entries.resize(end, [f32x4::ZERO; 3]);
    }

    /// Rows of a block, along its path.
    pub fn rows_mut(&mut self, block: usize) -> &mut [[f32x4; 3]] {
        let Rows { start, length, .. } = self.rows[block];
        &mut self.entries[start..start + length]
    }

    /// Coordinate `lane` of a block: its diagonal entry, before factoring.
    pub fn diagonal(&self, block: usize, lane: usize) -> f32 {
        let Rows { start, length, .. } = self.rows[block];
        self.entries[start + length - 1][lane].as_array()[lane]
    }

    /// M = Hᵀ H in place, of M and `added` on its diagonal.
    pub fn factor(&mut self, added: &[f32x4]) {
        for block in (0..self.rows.len()).rev() {
            let (before, rest) = self.rows.split_at_mut(block);
            let own = &mut rest[0];
            let (above, entries) = self.entries.split_at_mut(own.start);
            let entries = &mut entries[..own.length];
            own.invert(&entries[own.length - 1], added[block].as_array());
            own.divide(&mut entries[..own.length - 1]);
            let path = &self.paths[own.path..own.path + own.length - 1];
            for (p, &ancestor) in path.iter().enumerate() {
                let start = before[ancestor].start;
                subtract(&mut above[start..=start + p], &entries[..=p], own.lanes);
            }
        }
    }

    /// x becomes y = H⁻ᵀ x, half of a solution.
    pub fn halve(&self, x: &mut [f32x4]) {
        for (block, rows) in self.rows.iter().enumerate().rev() {
            let (entries, path) = self.of(rows);
            x[block] = product(&rows.columns, x[block]);
            let [a, b, c, _] = x[block].to_array().map(f32x4::splat);
            for (half, &above) in entries.iter().zip(path) {
                x[above] -= half[0] * a + half[1] * b + half[2] * c;
            }
        }
    }

    /// y becomes H⁻¹ y: the other half, so that both together make M⁻¹ x.
    pub fn finish(&self, y: &mut [f32x4]) {
        for (block, rows) in self.rows.iter().enumerate() {
            let (entries, path) = self.of(rows);
            let mut sums = [f32x4::ZERO; 4];
            for (half, &above) in entries.iter().zip(path) {
                for (sum, entry) in sums.iter_mut().zip(half) {
                    *sum += *entry * y[above];
                }
            }
            let [a, b, c, d] = f32x4::transpose(sums);
            y[block] = product(&rows.rows, y[block] - (a + b + c + d));
        }
    }

    /// The first half of six rows at once that run along `path` only, `[path]`.
    pub fn halve_rows(&self, path: &[usize], x: &mut [[f32x4; 6]]) {
        for (p, &block) in path.iter().enumerate().rev() {
            let rows = &self.rows[block];
            let (entries, _) = self.of(rows);
            x[p] = x[p].map(|x| product(&rows.columns, x));
            for lane in 0..rows.lanes {
                let own = x[p].map(|x| f32x4::splat(x.as_array()[lane]));
                for (half, x) in entries.iter().zip(&mut x[..p]) {
                    for (x, own) in x.iter_mut().zip(&own) {
                        *x -= half[lane] * *own;
                    }
                }
            }
        }
    }

    /// A block's rows and the blocks above it.
    fn of(&self, rows: &Rows) -> (&[[f32x4; 3]], &[usize]) {
        (
            &self.entries[rows.start..rows.start + rows.length - 1],
            &self.paths[rows.path..rows.path + rows.length - 1],
        )
    }
}

impl Rows {
    /// Cholesky's factor of the diagonal block, inverted.
    fn invert(&mut self, diagonal: &[f32x4; 3], added: &[f32; 4]) {
        let mut inverse = [[0.0_f32; 4]; 3];
        let mut factor = [[0.0_f32; 3]; 3];
        for i in 0..self.lanes {
            let row = diagonal[i].as_array();
            for j in 0..i {
                let known: f32 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
                factor[i][j] = (row[j] - known) * inverse[j][j];
            }
            let known: f32 = factor[i][..i].iter().map(|f| f * f).sum();
            inverse[i][i] = 1.0 / (row[i] + added[i] - known).sqrt();
            for j in 0..i {
                let known: f32 = (j..i).map(|k| factor[i][k] * inverse[k][j]).sum();
                inverse[i][j] = -known * inverse[i][i];
            }
        }
        self.rows = inverse.map(f32x4::from);
        self.columns =
            [0, 1, 2].map(|j| f32x4::from([inverse[0][j], inverse[1][j], inverse[2][j], 0.0]));
    }

    /// Multiplies the rows with that inverse.
    fn divide(&self, entries: &mut [[f32x4; 3]]) {
        let share = |i: usize, j: usize| f32x4::splat(self.rows[i].as_array()[j]);
        let [a, b, c] = [share(0, 0), share(1, 1), share(2, 2)];
        let [d, e, f] = [share(1, 0), share(2, 0), share(2, 1)];
        for rows in entries {
            let [x, y, z] = *rows;
            *rows = [x * a, x * d + y * b, x * e + y * f + z * c];
        }
    }
}

/// Takes from an ancestor's rows what the first `lanes` halved rows have in common with them; the last block is its own.
fn subtract(rows: &mut [[f32x4; 3]], halves: &[[f32x4; 3]], lanes: usize) {
    let own = &halves[halves.len() - 1];
    for lane in 0..lanes {
        let [a, b, c, _] = own[lane].to_array().map(f32x4::splat);
        for (row, half) in rows.iter_mut().zip(halves) {
            row[0] -= half[lane] * a;
            row[1] -= half[lane] * b;
            row[2] -= half[lane] * c;
        }
    }
}

fn product(columns: &[f32x4; 3], x: f32x4) -> f32x4 {
    let [a, b, c, _] = x.to_array().map(f32x4::splat);
    columns[0] * a + columns[1] * b + columns[2] * c
}
