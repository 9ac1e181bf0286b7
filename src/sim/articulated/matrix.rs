//! The inertia matrix of a tree and its factors.
//!
//! Two coordinates have an entry only if one carries the other, so a coordinate's row holds its path, from the root
//! to itself, and nothing else. M = Lᵀ D L keeps that pattern (RBDA §6.5), and since the path of an ancestor is the
//! beginning of the path of what it carries, every inner loop runs over neighbours in memory.

use super::tree::Tree;

/// A symmetric matrix over the paths of a tree, or its factors.
#[derive(Clone, Debug)]
pub(super) struct PathMatrix {
    /// Of every coordinate: where its row begins, and the coordinates of its path.
    rows: Vec<(usize, Vec<usize>)>,
    entries: Vec<f32>,
    /// After factoring: reciprocal of D, and of its root.
    inverse: Vec<f32>,
    root: Vec<f32>,
}

impl PathMatrix {
    pub fn new(tree: &Tree) -> Self {
        let mut rows = Vec::new();
        let mut start = 0;
        for node in &tree.nodes {
            let above = node.path.len() - node.dofs.len();
            for length in above + 1..=node.path.len() {
                rows.push((start, node.path[..length].to_vec()));
                start += length;
            }
        }
        PathMatrix {
            inverse: vec![0.0; rows.len()],
            root: vec![0.0; rows.len()],
            entries: vec![0.0; start],
            rows,
        }
    }

    /// Row of coordinate `k`, along its path.
    pub fn row_mut(&mut self, k: usize) -> &mut [f32] {
        let (start, path) = &self.rows[k];
        &mut self.entries[*start..*start + path.len()]
    }

    pub fn add_diagonal(&mut self, added: &[f32]) {
        for ((start, path), added) in self.rows.iter().zip(added) {
            self.entries[start + path.len() - 1] += added;
        }
    }

    /// M = Lᵀ D L in place (RBDA table 6.3): rows of L, without its unit diagonal, and D.
    pub fn factor(&mut self) {
        for (k, (start, path)) in self.rows.iter().enumerate().rev() {
            let (above, row) = self.entries.split_at_mut(*start);
            let (row, last) = row[..path.len()].split_at_mut(path.len() - 1);
            let inverse = 1.0 / last[0];
            for (p, &i) in path[..row.len()].iter().enumerate().rev() {
                let share = row[p] * inverse;
                let from = self.rows[i].0;
                for (m, own) in above[from..=from + p].iter_mut().zip(&row[..=p]) {
                    *m -= share * own;
                }
            }
            for entry in row {
                *entry *= inverse;
            }
            self.inverse[k] = inverse;
            self.root[k] = inverse.sqrt();
        }
    }

    /// x becomes M⁻¹ x.
    pub fn solve(&self, x: &mut [f32]) {
        for (k, (start, path)) in self.rows.iter().enumerate().rev() {
            let own = x[k];
            for (entry, &i) in self.entries[*start..].iter().zip(&path[..path.len() - 1]) {
                x[i] -= entry * own;
            }
        }
        for (x, inverse) in x.iter_mut().zip(&self.inverse) {
            *x *= inverse;
        }
        self.forward(x);
    }

    /// x becomes L⁻¹ x.
    fn forward(&self, x: &mut [f32]) {
        for (k, (start, path)) in self.rows.iter().enumerate() {
            let carried = self.entries[*start..].iter().zip(&path[..path.len() - 1]);
            let sum: f32 = carried.map(|(entry, &i)| entry * x[i]).sum();
            x[k] -= sum;
        }
    }

    /// A row j of a Jacobian, along `path`, becomes g = D^-½ L⁻ᵀ j, so that j M⁻¹ j'ᵀ = g · g' over what the two paths
    /// share.
    pub fn halve(&self, path: &[usize], row: &mut [f32]) {
        for (p, &k) in path.iter().enumerate().rev() {
            let (above, own) = row.split_at_mut(p);
            for (x, entry) in above.iter_mut().zip(&self.entries[self.rows[k].0..]) {
                *x -= entry * own[0];
            }
            own[0] *= self.root[k];
        }
    }

    /// y, a sum of halved rows, becomes the change of velocity that belongs to it.
    pub fn unhalve(&self, y: &mut [f32]) {
        for (y, root) in y.iter_mut().zip(&self.root) {
            *y *= root;
        }
        self.forward(y);
    }
}
