//! Consecutive measurements of a block, and images fitted to them.

use crate::windows::{compressive_wires, wire_means};
use spts_circuit::{Recording, WeightRows};
use spts_recon::operator::SignRows;
use spts_recon::recover::LeastSquares;
use spts_recon::{LinearOperator as _, MatrixView, SignTables};

/// Steps of the conjugate gradients. L rows of N = L/4 random signs have a condition number of 9, so that a step halves
/// the error.
const STEPS: usize = 14;

/// Measurements of a chunk for every taxel.
const MEASUREMENTS_PER_TAXEL: usize = 4;
/// Least measurements of a chunk: with fewer, the rows of a small skin agree with others by chance.
const LEAST: usize = 300;

/// Measurements of a chunk of `recording`.
pub(crate) fn chunk_len(recording: &Recording) -> usize {
    (MEASUREMENTS_PER_TAXEL * recording.taxels()).max(LEAST)
}

/// Volts from one code of the recording's converter to the next; `None` without a converter.
pub(crate) fn converter_step_v(recording: &Recording) -> Option<f64> {
    let converter = recording.converter()?;
    let codes = converter.max_code();
    Some((converter.volts(0) - converter.volts(codes)) / f64::from(codes))
}

/// Measurements `start..start + y.len()` of a block. Lost samples count for nothing.
pub(crate) struct Chunk<'a> {
    recording: &'a Recording,
    /// Row of the first measurement according to the recording.
    first_row: u64,
    /// Output minus the mean of its wire, V; 0 for a lost sample.
    pub(crate) y: Vec<f64>,
    lost: Vec<bool>,
    /// Mean output of every wire, V.
    means_v: Vec<f64>,
    /// Σ y².
    pub(crate) energy: f64,
}

/// An image fitted to a chunk.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    /// Number of rows by which the chunk was assumed to lag.
    pub(crate) rows: i64,
    /// Image, V.
    pub(crate) image: Vec<f64>,
    /// Output of every wire without load on any taxel, V.
    pub(crate) offsets_v: Vec<f64>,
    /// Root mean square of the residual divided by that of the output.
    pub(crate) residual: f64,
}

impl<'a> Chunk<'a> {
    pub(crate) fn new(recording: &'a Recording, block: usize, start: usize, len: usize) -> Self {
        let volts = &recording.blocks()[block].volts[start..start + len];
        let lost: Vec<bool> = volts.iter().map(|v| !v.is_finite()).collect();
        let rows = recording.rows(block, start..start + len);
        let means_v = wire_means(recording, block, start..start + len);
        let above = |(k, v): (usize, &f64)| if v.is_finite() { v - means_v[rows.wire(k)] } else { 0.0 };
        let y: Vec<f64> = volts.iter().enumerate().map(above).collect();
        Self {
            recording,
            first_row: recording.first_row(block, 0) + start as u64,
            energy: y.iter().map(|v| v * v).sum(),
            y,
            lost,
            means_v,
        }
    }

    /// Standard deviation of the output, V.
    pub(crate) fn sd(&self) -> f64 {
        let count = self.lost.iter().filter(|lost| !**lost).count().max(1);
        (self.energy / count as f64).sqrt()
    }

    /// Rows of weights of the chunk if it lags by `rows`, with `more` rows after them; `None` before the first of all.
    pub(crate) fn rows(&self, rows: i64, more: usize) -> Option<WeightRows<'a>> {
        let first = self.first_row.checked_add_signed(rows.checked_neg()?)?;
        Some(WeightRows::new(self.recording.weights(), first, self.y.len() + more))
    }

    /// What `image` gives at the rows of a chunk that lags by `rows`; `None` before the first row of all.
    pub(crate) fn expected(&self, rows: i64, image: &[f64]) -> Option<Vec<f64>> {
        let mut sums = vec![0.0; self.y.len()];
        let first = self.rows(rows, 0)?.first_row();
        self.recording.weights().weighted_sums(first, image, &mut sums);
        Some(sums)
    }

    /// Square of the correlation of the output with what `image` gives, 0 when they have different signs.
    pub(crate) fn agreement(&self, rows: i64, image: &[f64]) -> f64 {
        let Some(expected) = self.expected(rows, image) else {
            return 0.0;
        };
        let kept = || expected.iter().zip(&self.lost).filter(|(_, lost)| !**lost).map(|(e, _)| *e);
        let mean = kept().sum::<f64>() / kept().count().max(1) as f64;
        let (mut both, mut square) = (0.0, 0.0);
        for ((e, y), lost) in expected.iter().zip(&self.y).zip(&self.lost) {
            if !lost {
                both += (e - mean) * y;
                square += (e - mean) * (e - mean);
            }
        }
        let scale = square * self.energy;
        if scale > 0.0 { both.max(0.0).powi(2) / scale } else { 0.0 }
    }

    /// Root mean square that an image without a value below zero leaves of the output if the chunk lags by `rows`,
    /// divided by that of the output, on one wire; `None` before the first row of all, without output, or where no
    /// image is determined.
    pub(crate) fn residual(&self, rows: i64) -> Option<f64> {
        let taxels = self.recording.taxels();
        let phi = self.rows(rows, 0)?.to_vec();
        let mut fit = LeastSquares::new(taxels, 1);
        let y = self.y.iter().zip(&self.lost).map(|(y, lost)| if *lost { f64::NAN } else { *y });
        let y: Vec<f64> = y.collect();
        fit.add(MatrixView::new(y.len(), taxels, &phi).ok()?, &[], &y);
        let image = fit.solve().ok()?;
        let left = phi.chunks_exact(taxels).zip(&y).map(|(row, y)| y - dot(row, &image));
        let left: Vec<f64> = left.filter(|v| v.is_finite()).collect();
        let mean = left.iter().sum::<f64>() / left.len().max(1) as f64;
        let square: f64 = left.iter().map(|v| (v - mean).powi(2)).sum();
        (self.energy > 0.0).then(|| (square / self.energy).sqrt())
    }

    /// Least squares for an image and a constant for every wire, by conjugate gradients, if the chunk lags by `rows`;
    /// `None` before the first row of all or without output.
    pub(crate) fn fit(&self, rows: i64) -> Option<Fit> {
        let (taxels, wires) = (self.recording.taxels(), compressive_wires(self.recording));
        let rows_of = self.rows(rows, 0)?;
        if self.energy <= 0.0 {
            return None;
        }
        // weights of ±1 on one wire are kept as bits, a 64th of the memory
        let bits = rows_of.sign_bits().filter(|_| wires == 1);
        let phi = if bits.is_some() { Vec::new() } else { rows_of.to_vec() };
        let numbers = MatrixView::new(phi.len() / taxels.max(1), taxels, &phi).ok()?;
        let kept = |i: usize| if self.lost[i] { 0.0 } else { 1.0 };
        // after the taxels, an image has the constant of every wire
        let constant: Vec<usize> = (0..self.y.len()).map(|i| taxels + rows_of.wire(i)).collect();
        let apply = |image: &[f64], out: &mut [f64]| {
            let of_taxels = &image[..taxels];
            match (&bits, MatrixView::new(taxels, 1, of_taxels)) {
                (Some(bits), Ok(column)) => SignTables::<f64>::new(column).fill_rows(bits, out),
                _ => numbers.apply(of_taxels, out),
            }
            out.iter_mut().enumerate().for_each(|(i, out)| *out = kept(i) * (*out + image[constant[i]]));
        };
        // `y` has zeros for lost samples, as all that `apply` gives
        let adjoint = |y: &[f64], out: &mut [f64]| {
            let (of_taxels, constants) = out.split_at_mut(taxels);
            match &bits {
                Some(bits) => SignRows::new(bits, taxels).apply_adjoint(y, of_taxels),
                None => numbers.apply_adjoint(y, of_taxels),
            }
            constants.fill(0.0);
            y.iter().zip(&constant).for_each(|(y, constant)| constants[constant - taxels] += y);
        };
        let mut image = vec![0.0; taxels + wires];
        let mut left = self.y.clone();
        let mut gradient = vec![0.0; taxels + wires];
        let mut step = vec![0.0; self.y.len()];
        adjoint(&left, &mut gradient);
        let mut direction = gradient.clone();
        let mut square = dot(&gradient, &gradient);
        for _ in 0..STEPS {
            apply(&direction, &mut step);
            let curvature = dot(&step, &step);
            if square <= 0.0 || curvature <= 0.0 {
                break;
            }
            let length = square / curvature;
            image.iter_mut().zip(&direction).for_each(|(x, d)| *x += length * d);
            left.iter_mut().zip(&step).for_each(|(r, s)| *r -= length * s);
            adjoint(&left, &mut gradient);
            let next = dot(&gradient, &gradient);
            let keep = next / square;
            direction.iter_mut().zip(&gradient).for_each(|(d, g)| *d = g + keep * *d);
            square = next;
        }
        let offsets_v = image[taxels..].iter().zip(&self.means_v).map(|(constant, mean)| mean + constant).collect();
        image.truncate(taxels);
        let residual = (dot(&left, &left) / self.energy).sqrt();
        residual.is_finite().then_some(Fit { rows, image, offsets_v, residual })
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    // eight sums, so that the compiler may use vectors
    let mut sums = [0.0; 8];
    let (a_chunks, b_chunks) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a_chunks.remainder().iter().zip(b_chunks.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a_chunks.zip(b_chunks) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}
