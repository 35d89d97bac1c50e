//! Orthogonal matching pursuit on a Gram matrix.

use super::factor::{CONVERGED, back_substitute};
use crate::kernels;
use crate::problem::Solution;

/// Smallest share of an atom's square outside the span of the chosen ones.
const DEPENDENT_SQUARE: f64 = 1e-10;

/// Share of ‖y‖² below which the recurrence ‖r‖² ← ‖r‖² − p² holds rounding only.
const CONVERGED_SQUARE: f64 = 1e-14;

/// Rule by which a pursuit selects the next atom.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Choice {
    /// The atom with the largest |cosine| to the residual, as [`Omp`](super::Omp).
    #[default]
    Correlation,
    /// The atom that leaves the smallest residual, as [`Ols`](super::Ols).
    LeastSquares,
}

/// Scratch memory of a [`GramPursuit`].
#[derive(Debug, Default)]
pub(crate) struct GramScratch {
    weights: Vec<f64>,
    /// Aᵀ r: before the pursuit Aᵀ y.
    pub(super) correlation: Vec<f64>,
    /// vᵢ, one after the other.
    images: Vec<f64>,
    /// Columns of R, one after the other; column n has n + 1 entries.
    upper: Vec<f64>,
    projections: Vec<f64>,
    pub(super) residual: Vec<f64>,
    /// ‖aₖ‖² outside the span of the selected atoms.
    remaining: Vec<f64>,
}

/// Pursuit that looks at G = Aᵀ A instead of A.
///
/// With the directions qᵢ of the chosen atoms, vᵢ = Aᵀ qᵢ follows from the row g of G that belongs to the new atom k,
/// vₙ = (g − Σᵢ vᵢₖ vᵢ) / d with d² = ‖aₖ‖² − Σᵢ vᵢₖ², and the correlations from vₙ: a step costs O(n·K). (The source
/// updates the correlations from the coefficients instead, Aᵀ r = Aᵀ y − G_S α, to the same effect.) d² is a
/// difference, exact to a few 1e-16 of ‖a‖²: atoms with less than 1e-10 of their square outside the span of the chosen
/// ones are passed over, and a pursuit ends when ‖r‖² is below 1e-14 of ‖y‖². [`Omp`](super::Omp) resolves more.
/// Source: R. Rubinstein, M. Zibulevsky, M. Elad, "Efficient implementation of the K-SVD algorithm using batch
/// orthogonal matching pursuit", Technion CS-2008-08 (2008).
#[derive(Debug, Clone, Copy)]
pub(super) struct GramPursuit<'a> {
    /// G, K × K.
    pub(super) gram: &'a [f64],
    /// Weight of every atom in the selection, length K.
    pub(super) weights: &'a [f64],
    /// Selection rule.
    pub(super) choice: Choice,
    /// Largest number of atoms.
    pub(super) limit: usize,
}

impl GramPursuit<'_> {
    /// Chooses the atoms and writes their coefficients. `scratch.correlation` holds Aᵀ y, `y_square` is ‖y‖².
    pub(super) fn run(&self, y_square: f64, scratch: &mut GramScratch, solution: &mut Solution) {
        let support = &mut solution.support;
        let mut residual_square = y_square;
        self.start(scratch);
        scratch.images.resize(self.limit * self.weights.len(), 0.0);
        scratch.upper.clear();
        scratch.projections.clear();
        support.clear();
        while support.len() < self.limit && residual_square > CONVERGED_SQUARE * y_square {
            let Some((atom, score)) = self.best(scratch) else {
                break;
            };
            if score <= CONVERGED * y_square.sqrt() {
                break;
            }
            // chosen, or in the span of the chosen ones: not again
            scratch.weights[atom] = 0.0;
            if let Some(projection) = self.push(atom, scratch, support.len()) {
                residual_square -= projection * projection;
                support.push(atom);
                if self.choice == Choice::LeastSquares && support.len() < self.limit {
                    let k = self.weights.len();
                    let v = &scratch.images[(support.len() - 1) * k..][..k];
                    kernels::deflate(v, DEPENDENT_SQUARE, &mut scratch.remaining, &mut scratch.weights);
                }
            }
        }
        back_substitute(&scratch.upper, &scratch.projections, &mut solution.coefficients);
    }

    /// Weights of the atoms before any is chosen.
    fn start(&self, scratch: &mut GramScratch) {
        scratch.weights.clear();
        scratch.weights.extend_from_slice(self.weights);
        if self.choice == Choice::LeastSquares {
            let k = self.weights.len();
            scratch.remaining.clear();
            scratch.remaining.extend(self.gram.iter().step_by(k + 1));
            scratch.weights.iter_mut().for_each(|w| *w *= *w);
        }
    }

    /// The next atom, and by how much it shortens the residual at least.
    fn best(&self, scratch: &GramScratch) -> Option<(usize, f64)> {
        match self.choice {
            Choice::Correlation => kernels::best_magnitude(&scratch.correlation, &scratch.weights),
            Choice::LeastSquares => {
                kernels::best_square(&scratch.correlation, &scratch.weights).map(|(atom, square)| (atom, square.sqrt()))
            }
        }
    }

    /// Appends `atom` as column `n` and returns the projection of `y` on its direction; the correlations follow when
    /// there are steps to come. `None`, and nothing is changed, when it lies in the span of the others.
    fn push(&self, atom: usize, scratch: &mut GramScratch, n: usize) -> Option<f64> {
        let (k, start) = (self.weights.len(), scratch.upper.len());
        let g = &self.gram[atom * k..(atom + 1) * k];
        let (done, rest) = scratch.images.split_at_mut(n * k);
        scratch.upper.extend(done.chunks_exact(k).map(|v| v[atom]));
        let overlaps = &scratch.upper[start..];
        let square = g[atom] - overlaps.iter().map(|r| r * r).sum::<f64>();
        // not `<=`: a NaN must be passed over as well
        if square.partial_cmp(&(DEPENDENT_SQUARE * g[atom])) != Some(std::cmp::Ordering::Greater) {
            scratch.upper.truncate(start);
            return None;
        }
        let length = square.sqrt();
        let projection = scratch.correlation[atom] / length;
        if n + 1 < self.limit {
            let v = &mut rest[..k];
            kernels::gram_step(g, done, overlaps, length, projection, v, &mut scratch.correlation);
        }
        scratch.upper.push(length);
        scratch.projections.push(projection);
        Some(projection)
    }
}
