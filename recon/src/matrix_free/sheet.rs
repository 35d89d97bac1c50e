//! Gaussian estimates of large sheets.

use crate::checks::{not_finite, not_positive_definite, shape_mismatch, within};
use crate::kernels::{adjoint, axpy, dot};
use crate::matrix::Matrix;
use crate::problem::{Problem, Recover as _, Solution, Workspace};
use crate::recover::{Gaussian, NnLmmse, Noise, no_images};
use rayon::prelude::*;
use spts_input::Refusal;
use std::ops::Range;
use std::sync::Arc;

/// Share of the variance that every taxel has for itself at least: keeps factors of the covariance positive.
const FLOOR: f64 = 1e-3;

/// Gaussian prior x ~ N(0, A ⊗ B) of images on a grid of R × C taxels: A (R × R) along rows and B (C × C) along
/// columns, both with 1 on the diagonal. The scale of the images is not specified.
///
/// ```
/// use spts_recon::matrix_free::SheetPrior;
///
/// let prior = SheetPrior::smooth([100, 200], 3.0)?;
/// assert_eq!(prior.taxels(), 20_000);
/// assert!((prior.covariance(0, 3) - (-0.5_f64).exp()).abs() < 1e-3, "3 taxels apart in a row");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SheetPrior {
    rows: Matrix,
    cols: Matrix,
}

impl SheetPrior {
    /// Prior of images on a grid of `shape` = [rows, columns] that are smooth over `length` taxels: the covariance of
    /// two taxels at distance d is exp(−d²/2ℓ²).
    ///
    /// # Errors
    /// [`Refusal`] for an empty grid, or if `length` is outside [0.01, 1000].
    pub fn smooth(shape: [usize; 2], length: f64) -> Result<Self, Refusal> {
        if !(0.01..=1000.0).contains(&length) {
            return Err(Refusal::range("length", length, "[0.01, 1000]"));
        }
        check_shape(shape, 1)?;
        let lags = |n: usize| (0..n).map(|d| (-0.5 * (d as f64 / length).powi(2)).exp()).collect();
        Ok(Self::stationary(shape.map(lags)))
    }

    /// Prior of images on a grid of `shape` = [rows, columns] that resemble `images` (row-major), at any position. The
    /// covariance along an axis is the mean product of two taxels at a distance, divided by the mean square. Every
    /// image counts equally, whatever its scale; images that are zero are ignored.
    ///
    /// # Errors
    /// [`Refusal`] if every image is zero, or one does not fit the grid.
    pub fn like<'a>(images: impl IntoIterator<Item = &'a [f64]>, shape: [usize; 2]) -> Result<Self, Refusal> {
        let [rows, cols] = shape;
        check_shape(shape, 0)?;
        let mut sums = shape.map(|n| vec![0.0; n]);
        let mut count = 0;
        for image in images {
            if image.len() != rows * cols {
                return Err(no_images(count, image.len(), cols));
            }
            let square: f64 = image.iter().map(|v| v * v).sum();
            if !(square > 0.0 && square.is_finite()) {
                continue;
            }
            count += 1;
            let touched: Vec<usize> = (0..image.len()).filter(|k| image[*k] != 0.0).collect();
            for &k in &touched {
                let (r, c) = (k / cols, k % cols);
                for d in 0..rows - r {
                    sums[0][d] += image[k] * image[k + d * cols] / square;
                }
                for d in 0..cols - c {
                    sums[1][d] += image[k] * image[k + d] / square;
                }
            }
        }
        if count == 0 {
            return Err(no_images(0, rows * cols, cols));
        }
        Ok(Self::stationary(sums))
    }

    /// Covariances that depend on the distance alone, from their values at all distances.
    fn stationary(lags: [Vec<f64>; 2]) -> Self {
        let [rows, cols] = lags.map(|lags| {
            let n = lags.len();
            let mut c = Matrix::zeros(n, n);
            for i in 0..n {
                for (j, v) in c.row_mut(i).iter_mut().enumerate() {
                    *v = if i == j { 1.0 } else { (1.0 - FLOOR) * lags[i.abs_diff(j)] / lags[0] };
                }
            }
            c
        });
        Self { rows, cols }
    }

    /// Rows and columns of the grid.
    pub fn shape(&self) -> [usize; 2] {
        [self.rows.nrows(), self.cols.nrows()]
    }

    /// Number of taxels, N.
    pub fn taxels(&self) -> usize {
        self.rows.nrows() * self.cols.nrows()
    }

    /// Covariance of two taxels.
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        let cols = self.cols.nrows();
        self.rows.row(i / cols)[j / cols] * self.cols.row(i % cols)[j % cols]
    }

    /// C x, as A X B with the image X as a grid; O(N (R + C)), and rows of X that are zero cost nothing.
    fn apply(&self, x: &[f64]) -> Vec<f64> {
        let cols = self.cols.nrows();
        let mut out = vec![0.0; x.len()];
        let mut along = vec![0.0; cols];
        for (r, part) in x.chunks_exact(cols).enumerate() {
            if part.iter().all(|v| *v == 0.0) {
                continue;
            }
            along.fill(0.0);
            for (c, v) in part.iter().enumerate().filter(|(_, v)| **v != 0.0) {
                axpy(*v, self.cols.row(c), &mut along);
            }
            for (share, out) in self.rows.row(r).iter().zip(out.chunks_exact_mut(cols)) {
                axpy(*share, &along, out);
            }
        }
        out
    }
}

fn check_shape([rows, cols]: [usize; 2], images: usize) -> Result<(), Refusal> {
    if rows.checked_mul(cols).is_none_or(|taxels| taxels == 0) {
        return Err(no_images(images, 0, cols));
    }
    Ok(())
}

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
    prior: SheetPrior,
    noise: SheetNoise,
    /// Number of wires.
    count: usize,
    /// Φ, M × N.
    rows: Vec<f64>,
    /// Φ C, M × N.
    cross: Vec<f64>,
    /// Wire of every row.
    wires: Vec<usize>,
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
    /// [`Refusal`] for a noise level outside its range.
    pub fn new(prior: SheetPrior, noise: SheetNoise, wires: usize) -> Result<Self, Refusal> {
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
    pub fn measurements(&self) -> usize {
        self.wires.len()
    }

    /// Memory of `measurements` rows, their products with the prior, and the factor, bytes.
    pub fn bytes(&self, measurements: usize) -> usize {
        (2 * measurements * self.prior.taxels() + measurements * (measurements + 1) / 2) * size_of::<f64>()
    }

    /// Approximate number of multiplications for an image from `measurements` rows: the linear estimate, the inverse of
    /// the covariance of `most` taxels, and one solution for all of them. The active-set method solves several times,
    /// for fewer taxels.
    pub fn products(&self, measurements: usize, most: usize) -> usize {
        let (m, n) = (measurements, most.min(self.prior.taxels()));
        m * m + m * self.prior.taxels() + m * n + n * n * n + 2 * m * n * n
    }

    /// Adds `rows` (row-major, N values each). `wires` holds the number of each row's wire, from 0.
    ///
    /// # Errors
    /// [`Refusal`] if a row has no valid wire, is not finite, or depends linearly on earlier rows. No row is
    /// added then.
    pub fn extend(&mut self, rows: &[f64], wires: &[usize]) -> Result<(), Refusal> {
        let taxels = self.prior.taxels();
        if rows.len() != wires.len() * taxels || wires.iter().any(|wire| *wire >= self.count) {
            return Err(shape_mismatch(wires.len(), rows.len() / taxels.max(1)));
        }
        if let Some(index) = rows.iter().position(|v| !v.is_finite()) {
            return Err(not_finite(index, rows[index]));
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
            if let Err(error) = self.factorise(system) {
                self.truncate(first);
                return Err(error);
            }
        }
        Ok(())
    }

    /// Forgets all but the first `rows` rows.
    fn truncate(&mut self, rows: usize) {
        let taxels = self.prior.taxels();
        self.rows.truncate(rows * taxels);
        self.cross.truncate(rows * taxels);
        self.wires.truncate(rows);
        self.spans.truncate(rows);
        self.factor.truncate(rows * (rows + 1) / 2);
    }

    /// Adds a row of Φ C Φᵀ to the factor.
    fn factorise(&mut self, mut system: Vec<f64>) -> Result<(), Refusal> {
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
        if !pivot.is_finite() || pivot <= 0.0 {
            return Err(not_positive_definite(i));
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
    /// [`Refusal`] if there are no measurements, more measurements than rows, or one that is not finite.
    pub fn linear(&self, y: &[f64]) -> Result<Vec<f64>, Refusal> {
        let m = y.len();
        if m > self.measurements() || m == 0 {
            return Err(shape_mismatch(self.measurements(), m));
        }
        if let Some(index) = y.iter().position(|v| !v.is_finite()) {
            return Err(not_finite(index, y[index]));
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

impl SheetDecoder {
    /// The non-negative estimate from measurements of the first rows: N values, at most `most` of them positive.
    ///
    /// # Errors
    /// As [`SheetDecoder::linear`], and if the iteration fails because of rounding.
    pub fn non_negative(&self, y: &[f64], most: usize) -> Result<Vec<f64>, Refusal> {
        let linear = self.linear(y)?;
        let taxels = self.prior.taxels();
        let mut places: Vec<usize> = (0..taxels).collect();
        if most < taxels {
            places.sort_by(|a, b| linear[*b].total_cmp(&linear[*a]).then(a.cmp(b)));
            places.truncate(most.max(1));
            places.sort_unstable();
        }
        let values = self.solve(y, &places)?;
        let mut image = vec![0.0; taxels];
        places.iter().zip(&values).for_each(|(k, v)| image[*k] = *v);
        Ok(image)
    }

    /// The non-negative program on `places`.
    fn solve(&self, y: &[f64], places: &[usize]) -> Result<Vec<f64>, Refusal> {
        let (m, n, taxels) = (y.len(), places.len(), self.prior.taxels());
        let scale = y.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        if scale == 0.0 {
            return Ok(vec![0.0; n]);
        }
        let mut a = Matrix::zeros(m, n);
        for i in 0..m {
            let row = &self.rows[i * taxels..(i + 1) * taxels];
            a.row_mut(i).iter_mut().zip(places).for_each(|(v, k)| *v = row[*k]);
        }
        let mut y: Vec<f64> = y.iter().map(|v| v / scale).collect();
        self.whiten(&mut a, &mut y);
        let mut covariance = Matrix::zeros(n, n);
        for (r, i) in places.iter().enumerate() {
            let row = covariance.row_mut(r);
            row.iter_mut().zip(places).for_each(|(v, j)| *v = self.prior.covariance(*i, *j));
        }
        let noise = Noise::Absolute(self.noise.own * (n as f64 / self.count as f64).sqrt());
        let prior = Gaussian::new(vec![0.0; n], covariance)?;
        let estimate = NnLmmse::new(Arc::new(prior), noise)?;
        let mut solution = Solution::default();
        let problem = Problem::new(a.view(), &y)?;
        estimate.recover_into(&problem, &mut Workspace::default(), &mut solution)?;
        let mut values = vec![0.0; n];
        solution.scatter(&mut values);
        values.iter_mut().for_each(|v| *v *= scale);
        Ok(values)
    }

    /// Takes most of what is common to the rows of a wire off all columns: with own noise σ², common noise τ² and m
    /// rows, a share 1 − 1/√(1 + m τ²/σ²) of the mean, which leaves noise of σ² in every direction.
    fn whiten(&self, a: &mut Matrix, y: &mut [f64]) {
        let ratio = (self.noise.common / self.noise.own).powi(2);
        let wires = &self.wires[..y.len()];
        for wire in 0..self.count {
            let members: Vec<usize> = (0..y.len()).filter(|i| wires[*i] == wire).collect();
            let count = members.len() as f64;
            let share = 1.0 - 1.0 / (1.0 + count * ratio).sqrt();
            let mut mean = vec![0.0; a.ncols()];
            for i in &members {
                axpy(share / count, a.row(*i), &mut mean);
            }
            let mean_y = members.iter().map(|i| y[*i]).sum::<f64>() * share / count;
            for i in members {
                axpy(-1.0, &mean, a.row_mut(i));
                y[i] -= mean_y;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn the_product_is_that_of_the_whole_covariance() {
        let prior = SheetPrior::smooth([4, 5], 1.3).unwrap();
        let x: Vec<f64> = (0..20).map(|k| f64::from((k * 7 + 3) % 11) - 5.0).collect();
        let out = prior.apply(&x);
        for (i, found) in out.iter().enumerate() {
            let expected: f64 = (0..20).map(|j| prior.covariance(i, j) * x[j]).sum();
            assert!((found - expected).abs() < 1e-12, "{i}: {found} {expected}");
        }
    }

    /// Two neighbours of equal size in a row: at a distance of one column half of the squares, at any other nothing.
    #[test]
    fn a_prior_is_like_its_images() {
        let mut image = vec![0.0; 12];
        (image[5], image[6]) = (3.0, 3.0);
        let zero = vec![0.0; 12];
        let prior = SheetPrior::like([image.as_slice(), &zero], [3, 4]).unwrap();
        assert!((prior.covariance(0, 1) - 0.5 * (1.0 - FLOOR)).abs() < 1e-15);
        assert!((prior.covariance(5, 5) - 1.0).abs() < 1e-15);
        assert!(prior.covariance(0, 4).abs() + prior.covariance(0, 2).abs() < 1e-15);
    }

    #[test]
    fn what_is_no_prior_is_refused() {
        assert!(SheetPrior::smooth([0, 4], 1.0).is_err() && SheetPrior::smooth([2, 4], f64::NAN).is_err());
        let image = [1.0; 6];
        assert!(SheetPrior::like([image.as_slice()], [2, 2]).is_err());
        assert!(SheetPrior::like([[0.0; 4].as_slice()], [2, 2]).is_err());
        assert!(SheetPrior::like(std::iter::empty(), [2, 2]).is_err());
    }

    fn signs(rows: usize, taxels: usize) -> Vec<f64> {
        let sign = |k: u64| {
            if (k * k).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 63 == 1 { 1.0 } else { -1.0 }
        };
        (1..=(rows * taxels) as u64).map(sign).collect()
    }

    fn decoder(rows: usize, wires: &[usize]) -> SheetDecoder {
        let prior = SheetPrior::smooth([5, 6], 1.2).unwrap();
        let count = wires.iter().max().unwrap() + 1;
        let mut decoder = SheetDecoder::new(prior, SheetNoise::default(), count).unwrap();
        let phi = signs(rows, 30);
        // in two parts
        decoder.extend(&phi[..7 * 30], &wires[..7]).unwrap();
        decoder.extend(&phi[7 * 30..], &wires[7..]).unwrap();
        decoder
    }

    /// Against the formula with dense matrices, for all rows and for the first of them, on one wire and on two.
    #[test]
    fn the_linear_estimate_is_the_formula() {
        for wires in [vec![0; 20], (0..20).map(|i| i % 2).collect::<Vec<_>>()] {
            let decoder = decoder(20, &wires);
            let c = DMatrix::from_fn(30, 30, |i, j| decoder.prior.covariance(i, j));
            for m in [20, 9] {
                let phi = DMatrix::from_row_slice(m, 30, &decoder.rows[..m * 30]);
                let square = 30.0 / if wires[1] == 1 { 2.0 } else { 1.0 };
                let noise = DMatrix::from_fn(m, m, |i, j| {
                    square * (if i == j { 0.01 } else { 0.0 } + if wires[i] == wires[j] { 0.25 } else { 0.0 })
                });
                let y: Vec<f64> = (0..m).map(|i| (i as f64 * 1.7).sin()).collect();
                let system = &phi * &c * phi.transpose() + noise;
                let expected = &c * phi.transpose() * system.try_inverse().unwrap() * DVector::from_vec(y.clone());
                let found = decoder.linear(&y).unwrap();
                for (found, expected) in found.iter().zip(expected.iter()) {
                    assert!((found - expected).abs() < 1e-10, "{found} {expected}");
                }
            }
        }
    }

    /// Where the linear estimate is not negative, both are the same; and an offset of a wire changes hardly anything.
    #[test]
    fn the_non_negative_estimate_goes_with_the_linear_one() {
        let decoder = decoder(24, &[0; 24]);
        let truth: Vec<f64> = (0..30).map(|k| if (13..16).contains(&k) { 2.0 } else { 0.0 }).collect();
        let phi = Matrix::from_rows(24, 30, decoder.rows.clone()).unwrap();
        let y: Vec<f64> = (0..24).map(|i| dot(phi.row(i), &truth)).collect();
        let image = decoder.non_negative(&y, 30).unwrap();
        let strongest = (0..30).max_by(|a, b| image[*a].total_cmp(&image[*b])).unwrap();
        assert!((13..16).contains(&strongest) && image.iter().all(|v| *v >= 0.0));
        let shifted: Vec<f64> = y.iter().map(|v| v + 3.0).collect();
        let other = decoder.non_negative(&shifted, 30).unwrap();
        let far = image.iter().zip(&other).fold(0.0_f64, |far, (a, b)| far.max((a - b).abs()));
        assert!(far < 0.3, "{far}");
        // fewer places than taxels
        let few = decoder.non_negative(&y, 5).unwrap();
        assert!(few.iter().filter(|v| **v > 0.0).count() <= 5);
        assert!(decoder.non_negative(&[0.0; 24], 30).unwrap().iter().all(|v| *v == 0.0));
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let prior = SheetPrior::smooth([2, 2], 1.0).unwrap();
        let noise = SheetNoise { own: f64::NAN, common: 0.0 };
        assert!(SheetDecoder::new(prior.clone(), noise, 1).is_err());
        let mut decoder = SheetDecoder::new(prior, SheetNoise::default(), 1).unwrap();
        assert!(decoder.extend(&[1.0; 5], &[0]).is_err() && decoder.extend(&[f64::NAN; 4], &[0]).is_err());
        decoder.extend(&[1.0; 4], &[0]).unwrap();
        assert!(decoder.linear(&[1.0, 2.0]).is_err() && decoder.linear(&[]).is_err());
        assert!(decoder.linear(&[f64::INFINITY]).is_err());
        // the second of these rows has a square beyond the range of numbers: none of them stays
        let before = decoder.linear(&[1.0]).unwrap();
        assert!(decoder.extend(&[1.0, -1.0, 1.0, -1.0, 1e200, 1e200, 1e200, 1e200], &[0, 0]).is_err());
        assert_eq!((decoder.measurements(), decoder.linear(&[1.0]).unwrap()), (1, before));
        assert!(decoder.linear(&[1.0, 2.0]).is_err());
        decoder.extend(&[1.0, -1.0, 1.0, -1.0], &[0]).unwrap();
        assert!(decoder.linear(&[1.0, 2.0]).is_ok());
    }
}
