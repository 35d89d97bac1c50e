//! Quality of a measurement matrix, independent of the decoder: coherence of columns and rows, rank and condition,
//! restricted isometry.
//!
//! ```
//! use spts_recon::{Matrix, coherence};
//!
//! // three directions of the plane, 120° apart: no three are less coherent
//! let h = 0.75_f64.sqrt();
//! let a = Matrix::from_rows(2, 3, vec![1.0, -0.5, -0.5, 0.0, h, -h]).unwrap();
//! let columns = coherence::columns(a.view())?;
//! assert!((columns.max - coherence::welch_bound(2, 3)).abs() < 1e-12);
//! # Ok::<(), coherence::CoherenceError>(())
//! ```

use crate::checks::{RangeError, within};
use crate::matrix::MatrixView;
use crate::recover::power_of_two;
use nalgebra::{DMatrix, SymmetricEigen};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

/// A matrix or parameter that is not valid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CoherenceError {
    /// The matrix has no row or no column.
    #[error("matrix has shape {rows} × {cols}; both must be at least 1")]
    Empty {
        /// Rows of the matrix.
        rows: usize,
        /// Columns of the matrix.
        cols: usize,
    },
    /// An entry is NaN or infinite.
    #[error("matrix[{row}, {col}] = {value} is not finite")]
    NotFinite {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        col: usize,
        /// The value.
        value: f64,
    },
    /// A parameter is outside its range.
    #[error(transparent)]
    Range(#[from] RangeError),
}

/// Similarity of vectors: |cos| of the angle between two of them, over all pairs. A zero vector, which no measurement
/// can detect, counts as parallel to every other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coherence {
    /// Largest value, in [0, 1]: the mutual coherence μ. 0 for a single vector.
    pub max: f64,
    /// Root mean square over all pairs, in [0, 1].
    pub rms: f64,
}

/// Coherence of the columns of `a`: how well unknowns can be distinguished.
/// Source: D. L. Donoho, X. Huo, IEEE Trans. Inf. Theory 47 (2001) 2845.
///
/// # Errors
/// [`CoherenceError`] for an empty matrix, or a value that is not finite.
pub fn columns(a: MatrixView<'_>) -> Result<Coherence, CoherenceError> {
    Ok(coherence(&Gram::of_columns(&scaled(a)?)))
}

/// Coherence of the rows of `a`: how much of a measurement is already contained in another one.
///
/// # Errors
/// As [`columns`].
pub fn rows(a: MatrixView<'_>) -> Result<Coherence, CoherenceError> {
    Ok(coherence(&Gram::of_columns(&scaled(a)?.transpose())))
}

/// Smallest possible mutual coherence of `vectors` vectors of `dimension` numbers: √((n − m) / (m (n − 1))), and 0 for
/// n ≤ m.
/// Source: L. R. Welch, IEEE Trans. Inf. Theory 20 (1974) 397.
#[must_use]
pub fn welch_bound(dimension: usize, vectors: usize) -> f64 {
    if vectors <= dimension || dimension == 0 {
        return 0.0;
    }
    let (m, n) = (dimension as f64, vectors as f64);
    ((n - m) / (m * (n - 1.0))).sqrt()
}

/// Rank and condition of a matrix, from its singular values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spectrum {
    /// Number of singular values above max(M, N)·ε·σ₁, the usual tolerance for rounding.
    pub rank: usize,
    /// Number of singular values, min(M, N).
    pub full: usize,
    /// Condition number σ₁/σ of the smallest one: the largest amplification of noise. ∞ if the rank is not full.
    pub condition: f64,
}

/// Rank and condition of `a`.
///
/// # Errors
/// As [`columns`].
pub fn spectrum(a: MatrixView<'_>) -> Result<Spectrum, CoherenceError> {
    let values = scaled(a)?.singular_values();
    let (largest, least) = (values.max(), values.min());
    let tolerance = a.nrows().max(a.ncols()) as f64 * f64::EPSILON * largest;
    let rank = values.iter().filter(|v| **v > tolerance).count();
    Ok(Spectrum {
        rank,
        full: values.len(),
        condition: if rank == values.len() {
            largest / least
        } else {
            f64::INFINITY
        },
    })
}

/// Deviation from an isometry, and the columns with this deviation.
#[derive(Debug, Clone, PartialEq)]
pub struct Isometry {
    /// Largest deviation found; δ_S is at least this large.
    pub delta: f64,
    /// The S columns, in no particular order.
    pub support: Vec<usize>,
}

/// Effort of the search for columns far from an isometry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IsometrySearch {
    /// Number of supports drawn at random.
    pub random: usize,
    /// Number of supports built column by column, adding the worst column each time, and then improved by exchanging
    /// columns.
    pub greedy: usize,
}

/// Lower bound of the restricted isometry constant δ_S of `a` with columns scaled to unit length: the smallest δ with
/// (1 − δ)‖x‖² ≤ ‖A x‖² ≤ (1 + δ)‖x‖² for every x with S = `sparsity` non-zeros. The constant is the largest |λ − 1|
/// over the eigenvalues λ of all S × S blocks of AᵀA; this function searches some of the blocks.
/// Source: E. J. Candès, T. Tao, IEEE Trans. Inf. Theory 51 (2005) 4203; C. Dossal, G. Peyré, J. Fadili, "A numerical
/// exploration of compressed sampling recovery", Linear Algebra Appl. 432 (2010) 1663.
///
/// ```
/// use spts_recon::Matrix;
/// use spts_recon::coherence::{IsometrySearch, restricted_isometry};
///
/// let identity = Matrix::from_rows(2, 2, vec![1.0, 0.0, 0.0, 1.0])?;
/// let alike = Matrix::from_rows(2, 2, vec![1.0, 1.0, 0.0, 0.1])?;
/// let search = IsometrySearch { random: 10, greedy: 1 };
/// let mut rng = rand::SeedableRng::seed_from_u64(1);
/// let mut delta = |a: &Matrix| restricted_isometry(a.view(), 2, search, &mut rng).map(|found| found.delta);
/// assert!(delta(&identity)? < 1e-12 && delta(&alike)? > 0.9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`columns`], and [`CoherenceError::Range`] unless `sparsity` is in [1, N].
pub fn restricted_isometry(
    a: MatrixView<'_>,
    sparsity: usize,
    search: IsometrySearch,
    rng: &mut ChaCha8Rng,
) -> Result<Isometry, CoherenceError> {
    let gram = Gram::of_columns(&scaled(a)?);
    let n = a.ncols();
    within("sparsity", sparsity as f64, 1.0, n as f64)?;
    let mut best = Isometry {
        delta: f64::NEG_INFINITY,
        support: Vec::new(),
    };
    let mut keep = |support: &[usize]| {
        let delta = gram.deviation(support);
        if delta > best.delta {
            best.delta = delta;
            best.support = support.to_vec();
        }
    };
    let mut order: Vec<usize> = (0..n).collect();
    for _ in 0..search.random.max(1) {
        for place in 0..sparsity {
            order.swap(place, rng.random_range(place..n));
        }
        keep(&order[..sparsity]);
    }
    for _ in 0..search.greedy {
        let mut support = vec![rng.random_range(0..n)];
        while support.len() < sparsity {
            support.push(0);
            gram.exchange(&mut support, usize::MAX);
        }
        // each column in turn against the best other one, until no exchange helps
        let mut unchanged = 0;
        for place in (0..sparsity).cycle().take(EXCHANGES * sparsity) {
            let improved = gram.exchange(&mut support, place);
            unchanged = if improved { 0 } else { unchanged + 1 };
            if unchanged == sparsity {
                break;
            }
        }
        keep(&support);
    }
    Ok(best)
}

/// Most rounds of exchanges: each one that goes on has found something worse, and a few find the end.
const EXCHANGES: usize = 20;

/// `a` over the power of two next to its largest magnitude, so that squares neither overflow nor vanish.
fn scaled(a: MatrixView<'_>) -> Result<DMatrix<f64>, CoherenceError> {
    let (rows, cols) = (a.nrows(), a.ncols());
    if rows == 0 || cols == 0 {
        return Err(CoherenceError::Empty { rows, cols });
    }
    if let Some(index) = a.values().iter().position(|v| !v.is_finite()) {
        return Err(CoherenceError::NotFinite {
            row: index / cols,
            col: index % cols,
            value: a.values()[index],
        });
    }
    let scale = power_of_two(a.values());
    Ok(DMatrix::from_row_slice(rows, cols, a.values()) / scale)
}

/// Cosines of the angles between vectors.
struct Gram {
    cosines: DMatrix<f64>,
    zeros: Vec<bool>,
}

impl Gram {
    fn of_columns(a: &DMatrix<f64>) -> Self {
        let mut unit = a.clone();
        let mut zeros = Vec::with_capacity(a.ncols());
        for mut column in unit.column_iter_mut() {
            // twice: a column far shorter than the longest has no square before it is scaled
            let max = column.amax();
            zeros.push(max == 0.0);
            if max > 0.0 {
                column /= max;
                let length = column.norm();
                column /= length;
            }
        }
        Self {
            cosines: unit.tr_mul(&unit),
            zeros,
        }
    }

    /// Largest |λ − 1| of the block of `support`.
    fn deviation(&self, support: &[usize]) -> f64 {
        let s = support.len();
        let block = DMatrix::from_fn(s, s, |i, j| self.cosines[(support[i], support[j])]);
        let values = SymmetricEigen::new(block).eigenvalues;
        (values.max() - 1.0).max(1.0 - values.min())
    }

    /// Puts the column that deviates most into `place` of the support, or into its last one, whatever is there. Returns
    /// whether the deviation grew by more than rounding.
    fn exchange(&self, support: &mut [usize], place: usize) -> bool {
        let n = self.cosines.ncols();
        let last = place >= support.len();
        let place = place.min(support.len() - 1);
        let (mut best, before) = if last {
            ((f64::NEG_INFINITY, 0), f64::NEG_INFINITY)
        } else {
            let delta = self.deviation(support);
            ((delta, support[place]), delta)
        };
        for column in 0..n {
            let elsewhere = support.iter().enumerate().any(|(i, &c)| i != place && c == column);
            if elsewhere {
                continue;
            }
            support[place] = column;
            let delta = self.deviation(support);
            if delta > best.0 + f64::EPSILON * n as f64 {
                best = (delta, column);
            }
        }
        support[place] = best.1;
        best.0 > before
    }
}

fn coherence(gram: &Gram) -> Coherence {
    let n = gram.cosines.ncols();
    let (mut max, mut squares) = (0.0_f64, 0.0);
    for i in 0..n {
        for j in 0..i {
            let cosine = if gram.zeros[i] || gram.zeros[j] {
                1.0
            } else {
                gram.cosines[(i, j)].abs().min(1.0)
            };
            max = max.max(cosine);
            squares += cosine * cosine;
        }
    }
    let pairs = (n * n.saturating_sub(1) / 2).max(1) as f64;
    Coherence {
        max,
        rms: (squares / pairs).sqrt(),
    }
}

#[cfg(test)]
mod tests;
