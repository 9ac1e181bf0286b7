//! The inertia matrix of a tree and its factor, of eight characters.
//!
//! Two coordinates have an entry only if one carries the other, so a coordinate's row holds those of its path up to itself
//! and nothing else. M = Hᵀ H, factored from the tips inwards, keeps that pattern (RBDA §6.5), and since the path of an
//! ancestor is the beginning of the path of what it carries, every inner loop runs over neighbours in memory.

use super::lanes::Lanes;
use super::tree::Tree;

/// A symmetric matrix over the paths of a tree, or its factor.
#[derive(Clone, Debug)]
pub(super) struct PathMatrix<L> {
    /// Rows one after the other, each along its coordinate's path.
    entries: Vec<L>,
    /// Of the factor: one over each diagonal entry.
    inverse: Vec<L>,
}

impl<L: Lanes> PathMatrix<L> {
    pub fn new(tree: &Tree) -> Self {
        let entries = tree.coordinates.iter().map(|c| c.depth + 1).sum();
        PathMatrix {
            entries: vec![L::ZERO; entries],
            inverse: vec![L::ZERO; tree.coordinates.len()],
        }
    }

    #[inline(always)]
    pub fn row_mut(&mut self, tree: &Tree, k: usize) -> &mut [L] {
        let c = &tree.coordinates[k];
        &mut self.entries[c.row..=c.row + c.depth]
    }

    /// A diagonal entry, before factoring.
    #[inline(always)]
    pub fn diagonal(&self, tree: &Tree, k: usize) -> L {
        let c = &tree.coordinates[k];
        self.entries[c.row + c.depth]
    }

    /// Becomes the factor of `matrix` with `added` on its diagonal.
    #[inline(always)]
    pub fn factor(&mut self, tree: &Tree, matrix: &Self, added: &[L]) {
        self.entries.copy_from_slice(&matrix.entries);
        for (k, c) in tree.coordinates.iter().enumerate().rev() {
            let (above, own) = self.entries.split_at_mut(c.row);
            let own = &mut own[..=c.depth];
            let inverse = L::splat(1.0) / (own[c.depth] + added[k]).sqrt();
            self.inverse[k] = inverse;
            for entry in own[..c.depth].iter_mut() {
                *entry = *entry * inverse;
            }
            for (p, &ancestor) in tree.path(c)[..c.depth].iter().enumerate() {
                let start = tree.coordinates[ancestor].row;
                let factor = own[p];
                for (entry, half) in above[start..=start + p].iter_mut().zip(&own[..=p]) {
                    *entry -= *half * factor;
                }
            }
        }
    }

    /// x becomes y = H⁻ᵀ x, half of a solution.
    #[inline(always)]
    pub fn halve(&self, tree: &Tree, x: &mut [L]) {
        for (k, c) in tree.coordinates.iter().enumerate().rev() {
            let own = x[k] * self.inverse[k];
            x[k] = own;
            let row = &self.entries[c.row..c.row + c.depth];
            for (half, &above) in row.iter().zip(tree.path(c)) {
                x[above] -= *half * own;
            }
        }
    }

    /// y becomes H⁻¹ y: the other half, so that both together make M⁻¹ x.
    #[inline(always)]
    pub fn finish(&self, tree: &Tree, y: &mut [L]) {
        for (k, c) in tree.coordinates.iter().enumerate() {
            let row = &self.entries[c.row..c.row + c.depth];
            let mut rest = y[k];
            for (half, &above) in row.iter().zip(tree.path(c)) {
                rest -= *half * y[above];
            }
            y[k] = rest * self.inverse[k];
        }
    }

    /// The first half of six right sides at once that run along `path` only, `[path]`.
    #[inline(always)]
    pub fn halve_rows(&self, tree: &Tree, path: &[usize], x: &mut [[L; 6]]) {
        for (p, &k) in path.iter().enumerate().rev() {
            let c = &tree.coordinates[k];
            let (above, rest) = x.split_at_mut(p);
            let own = &mut rest[0];
            for x in own.iter_mut() {
                *x = *x * self.inverse[k];
            }
            let row = &self.entries[c.row..c.row + c.depth];
            for (half, x) in row.iter().zip(above) {
                for i in 0..6 {
                    x[i] -= *half * own[i];
                }
            }
        }
    }
}
