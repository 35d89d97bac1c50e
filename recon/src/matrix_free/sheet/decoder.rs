//! Reconstructs images of large sheets measured with a fixed sensing matrix.

use super::error::SheetError;
use super::prior::SheetPrior;
use crate::checks::within;
use crate::kernels::{adjoint, axpy, dot};
use crate::problem::RecoverError;
use rayon::prelude::*;
use std::ops::Range;

/// Noise of measurements, relative to the root mean square of a row's sum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SheetNoise {
    /// Standard deviation of the independent noise of a measurement; [1e-6, 1000].
    pub own: f64,
    /// Standard deviation of an offset common to all measurements of a wire, as asymmetric drives cause it; [0, 1000].
    pub common: f64,
}

/// Contact noise, idle noise and what a prior misses; and an asymmetry of the drives of some percent.
impl Default for SheetNoise {
    fn default() -> Self {
        Self { own: 0.1, common: 0.5 }
    }
}

/// Estimates images x of a sheet from measurements y = Φ x + o + n with a fixed sensing matrix Φ (M × N). The prior is
/// x ~ N(0, a² A ⊗ B) with an unknown scale a. Each measurement has its noise n; all measurements of a wire share an
/// offset o.
///
/// Everything that needs no sample is computed when rows are added: C φᵢ = A Xᵢ B, with the row as a grid Xᵢ, and the
/// Cholesky factor of Φ C Φᵀ + noise, row by row. The first m rows are therefore ready at once. Memory is 2 M N
/// numbers. The linear estimate C Φᵀ (Φ C Φᵀ + noise)⁻¹ y then takes M² + M N products. Rows of a wire that reads only
/// a part of the sheet cost proportionally less.
///
/// The non-negative estimate considers only the taxels with the largest linear estimate; all others are zero. Its prior
/// is C of those taxels. Its noise is relative to what touches of those taxels alone would measure.
///
/// ```
/// use spts_recon::matrix_free::{SheetDecoder, SheetNoise, SheetPrior};
///
/// // 12 × 12 taxels, a patch of 3 × 3 is pressed, 60 rows of pseudorandom signs
/// let prior = SheetPrior::smooth([12, 12], 1.5)?;
/// let mut decoder = SheetDecoder::new(prior, SheetNoise::default(), 1)?;
/// let sign = |k: u64| if (k * k).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 63 == 1 { 1.0 } else { -1.0 };
/// let rows: Vec<f64> = (1..=60 * 144).map(sign).collect();
/// decoder.extend(&rows, &[0; 60])?;
/// let pressed = |k: usize| (4..7).contains(&(k / 12)) && (6..9).contains(&(k % 12));
/// let y: Vec<f64> = rows.chunks(144).map(|row| (0..144).filter(|k| pressed(*k)).map(|k| row[k]).sum()).collect();
/// let image = decoder.non_negative(&y, 60)?;
/// let strongest = (0..144).max_by(|a, b| image[*a].total_cmp(&image[*b])).unwrap();
/// assert!(pressed(strongest) && image.iter().all(|v| *v >= 0.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct SheetDecoder {
    pub(super) prior: SheetPrior,
    pub(super) noise: SheetNoise,
    /// Number of wires.
    pub(super) count: usize,
    /// Φ, M × N.
    pub(super) rows: Vec<f64>,
    /// Φ C, M × N.
    cross: Vec<f64>,
    /// Wire of every row.
    pub(super) wires: Vec<usize>,
    /// Range of the taxels that the wire of each row reads.
    spans: Vec<Range<usize>>,
    /// Cholesky factor; row i has i + 1 entries and follows the rows before it.
    factor: Vec<f64>,
}

/// Rows whose products with all others are formed at once.
const BLOCK: usize = 8;

impl SheetDecoder {
    /// A decoder without rows, for a sheet that is divided evenly among `wires` wires.
    ///
    /// # Errors
    /// [`SheetError::Noise`] for a noise level outside its range.
    pub fn new(prior: SheetPrior, noise: SheetNoise, wires: usize) -> Result<Self, SheetError> {
        within("own", noise.own, 1e-6, 1e3)?;
        within("common", noise.common, 0.0, 1e3)?;
        Ok(Self {
            prior,
            noise,
            count: wires.max(1),
            rows: Vec::new(),
            cross: Vec::new(),
            wires: Vec::new(),
            spans: Vec::new(),
            factor: Vec::new(),
        })
    }

    /// Number of rows so far.
    #[must_use]
    pub fn measurements(&self) -> usize {
        self.wires.len()
    }

    /// Memory of `measurements` rows, their products with the prior, and the factor, bytes.
    #[must_use]
    pub fn bytes(&self, measurements: usize) -> usize {
        (2 * measurements * self.prior.taxels() + measurements * (measurements + 1) / 2) * size_of::<f64>()
    }

    /// Approximate number of multiplications for an image from `measurements` rows: the linear estimate, the inverse of
    /// the covariance of `most` taxels, and one solution for all of them. The active-set method solves several times,
    /// for fewer taxels.
    #[must_use]
    pub fn products(&self, measurements: usize, most: usize) -> usize {
        let (m, n) = (measurements, most.min(self.prior.taxels()));
        m * m + m * self.prior.taxels() + m * n + n * n * n + 2 * m * n * n
    }

    /// Adds `rows` (row-major, N values each). `wires` holds the number of each row's wire, from 0.
    ///
    /// # Errors
    /// [`SheetError::Recover`] if a row has no valid wire, is not finite, or depends linearly on earlier rows.
    pub fn extend(&mut self, rows: &[f64], wires: &[usize]) -> Result<(), SheetError> {
        let taxels = self.prior.taxels();
        if rows.len() != wires.len() * taxels || wires.iter().any(|wire| *wire >= self.count) {
            return Err(RecoverError::ShapeMismatch {
                rows: wires.len(),
                len: rows.len() / taxels.max(1),
            }
            .into());
        }
        if let Some(index) = rows.iter().position(|v| !v.is_finite()) {
            return Err(RecoverError::NotFinite {
                index,
                value: rows[index],
            }
            .into());
        }
        let first = self.measurements();
        self.rows.extend_from_slice(rows);
        self.wires.extend_from_slice(wires);
        self.spans.extend(rows.chunks_exact(taxels).map(span));
        let prior = &self.prior;
        let new: Vec<Vec<f64>> = rows.par_chunks_exact(taxels).map(|row| prior.apply(row)).collect();
        new.iter().for_each(|cross| self.cross.extend_from_slice(cross));
        // Φ C Φᵀ of the new rows with all up to them
        let (all, cross, spans) = (&self.rows, &self.cross, &self.spans);
        let last = self.wires.len();
        let systems: Vec<Vec<Vec<f64>>> = (first..last)
            .step_by(BLOCK)
            .collect::<Vec<_>>()
            .into_par_iter()
            .map(|start| {
                let block = start..(start + BLOCK).min(last);
                let mut out: Vec<Vec<f64>> = block.clone().map(|i| Vec::with_capacity(i + 1)).collect();
                for (j, (row, span)) in all.chunks_exact(taxels).zip(spans).enumerate().take(block.end) {
                    for (i, out) in block.clone().zip(&mut out).filter(|(i, _)| *i >= j) {
                        let cross = &cross[i * taxels..(i + 1) * taxels];
                        out.push(dot(&cross[span.clone()], &row[span.clone()]));
                    }
                }
                out
            })
            .collect();
        for system in systems.into_iter().flatten() {
            self.factorise(system)?;
        }
        Ok(())
    }

    /// Adds a row of Φ C Φᵀ to the factor.
    fn factorise(&mut self, mut system: Vec<f64>) -> Result<(), SheetError> {
        let i = system.len() - 1;
        let square = self.square_of_a_sum();
        let common = self.noise.common.powi(2) * square;
        for (s, wire) in system.iter_mut().zip(&self.wires) {
            if *wire == self.wires[i] {
                *s += common;
            }
        }
        system[i] += self.noise.own.powi(2) * square;
        for j in 0..i {
            let row = &self.factor[j * (j + 1) / 2..(j + 1) * (j + 2) / 2];
            system[j] = (system[j] - dot(&system[..j], &row[..j])) / row[j];
        }
        let pivot = system[i] - dot(&system[..i], &system[..i]);
        if pivot.is_nan() || pivot <= 0.0 {
            return Err(RecoverError::NotPositiveDefinite { pivot: i }.into());
        }
        system[i] = pivot.sqrt();
        self.factor.extend_from_slice(&system);
        Ok(())
    }

    /// Mean square of the sum of a row of signs: tr C over a wire's share of the taxels.
    fn square_of_a_sum(&self) -> f64 {
        self.prior.taxels() as f64 / self.count as f64
    }

    /// The linear estimate from measurements of the first rows, N values.
    ///
    /// # Errors
    /// [`SheetError::Recover`] if there are no measurements, more measurements than rows, or one that is not finite.
    pub fn linear(&self, y: &[f64]) -> Result<Vec<f64>, SheetError> {
        let m = y.len();
        if m > self.measurements() || m == 0 {
            return Err(RecoverError::ShapeMismatch {
                rows: self.measurements(),
                len: m,
            }
            .into());
        }
        if let Some(index) = y.iter().position(|v| !v.is_finite()) {
            return Err(RecoverError::NotFinite { index, value: y[index] }.into());
        }
        let row = |i: usize| &self.factor[i * (i + 1) / 2..(i + 1) * (i + 2) / 2];
        let mut shares = y.to_vec();
        for i in 0..m {
            shares[i] = (shares[i] - dot(&shares[..i], &row(i)[..i])) / row(i)[i];
        }
        for i in (0..m).rev() {
            shares[i] /= row(i)[i];
            let (before, own) = shares.split_at_mut(i);
            axpy(-own[0], &row(i)[..i], before);
        }
        let taxels = self.prior.taxels();
        let mut image = vec![0.0; taxels];
        adjoint(&self.cross[..m * taxels], &shares, &mut image);
        Ok(image)
    }
}

/// From the first entry that is not zero to the last.
fn span(row: &[f64]) -> Range<usize> {
    let first = row.iter().position(|v| *v != 0.0).unwrap_or(0);
    let last = row.iter().rposition(|v| *v != 0.0).map_or(first, |last| last + 1);
    first..last
}
