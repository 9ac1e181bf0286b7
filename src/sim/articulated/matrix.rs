//! The joint-space inertia matrix M of a tree and its sparse factor, of eight characters.
//!
//! Two coordinates have an entry only if one moves the other's body, so the row of a coordinate holds the entries along its
//! path from the root to itself and nothing else (branch-induced sparsity, RBDA §6.4). The factorisation M = Lᵀ L, from the
//! leaves to the root, keeps that pattern, where the usual L Lᵀ would fill it in (RBDA §6.5). And since the path of an
//! ancestor is the beginning of the path of its descendants, every inner loop runs over neighbours in memory.
//!
//! Both halves of a solution, x = L⁻¹ (L⁻ᵀ b), are separate functions: contacts are added between them.

use super::lanes::Lanes;
use super::tree::Tree;

/// A symmetric matrix with the pattern of a tree, or its factor L.
#[derive(Clone, Debug)]
pub(super) struct PathMatrix<L> {
    /// Rows one after the other: the row of a coordinate, along its path, ends with the diagonal.
    entries: Vec<L>,
    /// For a factor: one over each diagonal entry.
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

    /// The row of coordinate `k`, up to the diagonal.
    #[inline(always)]
    pub fn row_mut(&mut self, tree: &Tree, k: usize) -> &mut [L] {
        let c = &tree.coordinates[k];
        &mut self.entries[c.row..=c.row + c.depth]
    }

    /// The diagonal entry of coordinate `k` of a matrix that is no factor.
    #[inline(always)]
    pub fn diagonal(&self, tree: &Tree, k: usize) -> L {
        let c = &tree.coordinates[k];
        self.entries[c.row + c.depth]
    }

    /// Makes this the factor L of `matrix` + diag(`added`) = Lᵀ L (RBDA §6.5, with the divisions by the diagonal replaced
    /// by products with its inverse).
    #[inline(always)]
    pub fn factor(&mut self, tree: &Tree, matrix: &Self, added: &[L]) {
        self.entries.copy_from_slice(&matrix.entries);
        for (k, c) in tree.coordinates.iter().enumerate().rev() {
            // All rows above belong to earlier coordinates, and with them all ancestors.
            let (above, own) = self.entries.split_at_mut(c.row);
            let own = &mut own[..=c.depth];
            // Descendants have been subtracted by now, so this row is final: divide it by the root of its diagonal.
            let inverse = L::splat(1.0) / (own[c.depth] + added[k]).sqrt();
            self.inverse[k] = inverse;
            for entry in &mut own[..c.depth] {
                *entry = *entry * inverse;
            }
            // Subtract what this row contributes to the rows of its ancestors.
            for (p, &ancestor) in tree.path(c)[..c.depth].iter().enumerate() {
                let start = tree.coordinates[ancestor].row;
                let factor = own[p];
                for (entry, half) in above[start..=start + p].iter_mut().zip(&own[..=p]) {
                    *entry -= *half * factor;
                }
            }
        }
    }

    /// Replaces b by y = L⁻ᵀ b, the first half of a solution, from the leaves to the root.
    #[inline(always)]
    pub fn solve_transposed(&self, tree: &Tree, x: &mut [L]) {
        for (k, c) in tree.coordinates.iter().enumerate().rev() {
            let own = x[k] * self.inverse[k];
            x[k] = own;
            let row = &self.entries[c.row..c.row + c.depth];
            for (half, &above) in row.iter().zip(tree.path(c)) {
                x[above] -= *half * own;
            }
        }
    }

    /// Replaces y by x = L⁻¹ y, the second half of a solution, from the root to the leaves.
    #[inline(always)]
    pub fn solve(&self, tree: &Tree, y: &mut [L]) {
        for (k, c) in tree.coordinates.iter().enumerate() {
            let row = &self.entries[c.row..c.row + c.depth];
            let mut rest = y[k];
            for (half, &above) in row.iter().zip(tree.path(c)) {
                rest -= *half * y[above];
            }
            y[k] = rest * self.inverse[k];
        }
    }

    /// L⁻ᵀ of six right-hand sides at once, whose entries outside `path` are zero; `x` is `[path]`. The ancestors of a
    /// coordinate are on its path, so the result is zero outside of it, too.
    #[inline(always)]
    pub fn solve_transposed_rows(&self, tree: &Tree, path: &[usize], x: &mut [[L; 6]]) {
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
