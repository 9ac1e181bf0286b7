//! The inertia matrix of a tree and its factors.
//!
//! Two coordinates have an entry only if one carries the other, so a coordinate's row holds the blocks of its path and
//! nothing else. M = Lᵀ D L keeps that pattern (RBDA §6.5), and since the path of an ancestor is the beginning of the
//! path of what it carries, every inner loop runs over neighbours in memory.

use super::tree::Tree;
use wide::f32x4;

/// Row of one coordinate.
#[derive(Clone, Copy, Debug)]
struct Row {
    /// Its first block among the entries.
    start: usize,
    /// Blocks of its path.
    length: usize,
    /// Where the blocks of its path are listed.
    path: usize,
    /// The coordinate's place in its block.
    lane: usize,
}

/// A symmetric matrix over the paths of a tree, or its factors.
#[derive(Clone, Debug)]
pub(super) struct PathMatrix {
    /// Of the coordinates in use, in their order.
    rows: Vec<Row>,
    /// First row of every block, and the end.
    first: Vec<usize>,
    paths: Vec<usize>,
    entries: Vec<f32x4>,
    /// After factoring, by block: reciprocal of D, and of its root.
    inverse: Vec<f32x4>,
    root: Vec<f32x4>,
}

impl PathMatrix {
    pub fn new(tree: &Tree) -> Self {
        let mut matrix = PathMatrix {
            rows: Vec::new(),
            first: vec![0],
            paths: Vec::new(),
            entries: Vec::new(),
            inverse: vec![f32x4::ZERO; tree.blocks()],
            root: vec![f32x4::ZERO; tree.blocks()],
        };
        for node in &tree.nodes {
            let path = matrix.paths.len();
            matrix.paths.extend(&node.path);
            for block in matrix.first.len() - 1..=node.block {
                let length = node.path.iter().filter(|&&b| b <= block).count();
                matrix.add(tree.used[block], length, path);
            }
        }
        matrix
    }

    fn add(&mut self, lanes: usize, length: usize, path: usize) {
        for lane in 0..lanes {
            self.rows.push(Row {
                start: self.entries.len(),
                length,
                path,
                lane,
            });
            self.entries
                .resize(self.entries.len() + length, f32x4::ZERO);
        }
        self.first.push(self.rows.len());
    }

    /// Row of coordinate `lane` of a block, along its path; what lies beyond the diagonal doesn't count.
    pub fn row_mut(&mut self, block: usize, lane: usize) -> &mut [f32x4] {
        let Row { start, length, .. } = self.rows[self.first[block] + lane];
        &mut self.entries[start..start + length]
    }

    /// M = Lᵀ D L in place, of M and `added` on its diagonal (RBDA table 6.3).
    pub fn factor(&mut self, added: &[f32x4]) {
        for row in self.rows.iter().rev() {
            let path = &self.paths[row.path..row.path + row.length];
            let (above, own) = self.entries.split_at_mut(row.start);
            let own = &mut own[..row.length];
            let end = row.length - 1;
            let block = path[end];
            let last = own[end].as_mut_array();
            last[row.lane + 1..].fill(0.0);
            let inverse = 1.0 / (last[row.lane] + added[block].as_array()[row.lane]);
            for (p, &ancestor) in path.iter().enumerate() {
                let lanes = if p == end {
                    row.lane
                } else {
                    self.first[ancestor + 1] - self.first[ancestor]
                };
                let shares = own[p] * f32x4::splat(inverse);
                for (lane, share) in shares.as_array()[..lanes].iter().enumerate() {
                    let from = self.rows[self.first[ancestor] + lane].start;
                    subtract(&mut above[from..=from + p], &own[..=p], *share);
                }
            }
            for entry in &mut *own {
                *entry *= f32x4::splat(inverse);
            }
            own[end].as_mut_array()[row.lane] = 0.0;
            self.inverse[block].as_mut_array()[row.lane] = inverse;
            self.root[block].as_mut_array()[row.lane] = inverse.sqrt();
        }
    }

    /// x becomes y = D^-½ L⁻ᵀ x, half of a solution.
    pub fn halve(&self, x: &mut [f32x4]) {
        for row in self.rows.iter().rev() {
            let (entries, path) = self.of(row);
            let own = f32x4::splat(x[path[row.length - 1]].as_array()[row.lane]);
            for (entry, &block) in entries.iter().zip(path) {
                x[block] -= *entry * own;
            }
        }
        for (x, root) in x.iter_mut().zip(&self.root) {
            *x *= *root;
        }
    }

    /// y becomes L⁻¹ D^-½ y: the other half, so that both together make M⁻¹ x.
    pub fn finish(&self, y: &mut [f32x4]) {
        for (y, root) in y.iter_mut().zip(&self.root) {
            *y *= *root;
        }
        for row in &self.rows {
            let (entries, path) = self.of(row);
            let mut sum = f32x4::ZERO;
            for (entry, &block) in entries.iter().zip(path) {
                sum += *entry * y[block];
            }
            y[path[row.length - 1]].as_mut_array()[row.lane] -= sum.reduce_add();
        }
    }

    fn of(&self, row: &Row) -> (&[f32x4], &[usize]) {
        (
            &self.entries[row.start..row.start + row.length],
            &self.paths[row.path..row.path + row.length],
        )
    }

    /// The same half of rows that run along `path` only: `[path, rows]` for six rows, each a coordinate of a body.
    pub fn halve_rows(&self, path: &[usize], rows: &mut [[f32x4; 6]]) {
        for (p, &block) in path.iter().enumerate().rev() {
            for row in self.rows[self.first[block]..self.first[block + 1]]
                .iter()
                .rev()
            {
                let own = rows[p].map(|half| f32x4::splat(half.as_array()[row.lane]));
                let entries = &self.entries[row.start..=row.start + p];
                for (half, entry) in rows.iter_mut().zip(entries) {
                    for (half, own) in half.iter_mut().zip(&own) {
                        *half -= *entry * *own;
                    }
                }
            }
            for half in &mut rows[p] {
                *half *= self.root[block];
            }
        }
    }

    /// Coordinate `lane` of a block: its diagonal entry, before factoring.
    pub fn diagonal(&self, block: usize, lane: usize) -> f32 {
        let row = &self.rows[self.first[block] + lane];
        self.entries[row.start + row.length - 1].as_array()[lane]
    }
}

fn subtract(from: &mut [f32x4], row: &[f32x4], share: f32) {
    let share = f32x4::splat(share);
    for (from, entry) in from.iter_mut().zip(row) {
        *from -= *entry * share;
    }
}
