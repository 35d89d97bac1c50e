//! Real two-dimensional Fourier transforms of zero-padded images.

use realfft::num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner};
use std::sync::Arc;

/// Smallest number ≥ `n` without a prime factor above 5: lengths for which transforms are fast.
fn fast_length(n: usize) -> usize {
    let smooth = |mut n: usize| {
        for p in [2, 3, 5] {
            while n.is_multiple_of(p) {
                n /= p;
            }
        }
        n == 1
    };
    (n.max(1)..).find(|&n| smooth(n)).unwrap_or(n)
}

/// Transforms of images of a fixed size, padded with zeros.
pub(super) struct Fft2 {
    rows: usize,
    cols: usize,
    forward_rows: Arc<dyn RealToComplex<f64>>,
    inverse_rows: Arc<dyn ComplexToReal<f64>>,
    forward_cols: Arc<dyn Fft<f64>>,
    inverse_cols: Arc<dyn Fft<f64>>,
}

impl Fft2 {
    /// Transforms with room for `rows` × `cols`.
    pub(super) fn new(rows: usize, cols: usize) -> Self {
        let (rows, cols) = (fast_length(rows), fast_length(cols));
        let (mut real, mut complex) = (RealFftPlanner::new(), FftPlanner::new());
        Self {
            rows,
            cols,
            forward_rows: real.plan_fft_forward(cols),
            inverse_rows: real.plan_fft_inverse(cols),
            forward_cols: complex.plan_fft_forward(rows),
            inverse_cols: complex.plan_fft_inverse(rows),
        }
    }

    /// Frequencies of a row.
    fn half(&self) -> usize {
        self.cols / 2 + 1
    }

    /// Rows of the padded image.
    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    /// Columns of the padded image.
    pub(super) fn cols(&self) -> usize {
        self.cols
    }

    /// Spectrum of a padded image, column after column of frequencies; destroys the image.
    pub(super) fn forward(&self, padded: &mut [f64]) -> Vec<Complex64> {
        let (rows, half) = (self.rows, self.half());
        let mut spectrum = vec![Complex64::default(); rows * half];
        let mut line = self.forward_rows.make_output_vec();
        let mut scratch = self.forward_rows.make_scratch_vec();
        for (r, row) in padded.chunks_exact_mut(self.cols).enumerate() {
            self.forward_rows
                .process_with_scratch(row, &mut line, &mut scratch)
                .expect("the plan's own lengths");
            for (k, v) in line.iter().enumerate() {
                spectrum[k * rows + r] = *v;
            }
        }
        self.forward_cols.process(&mut spectrum);
        spectrum
    }

    /// Padded image of a spectrum, scaled so that it undoes [`Self::forward`]; destroys the spectrum.
    pub(super) fn inverse(&self, spectrum: &mut [Complex64]) -> Vec<f64> {
        let (rows, half) = (self.rows, self.half());
        self.inverse_cols.process(spectrum);
        let mut padded = vec![0.0; rows * self.cols];
        let mut line = vec![Complex64::default(); half];
        let mut scratch = self.inverse_rows.make_scratch_vec();
        let scale = 1.0 / (rows * self.cols) as f64;
        for (r, row) in padded.chunks_exact_mut(self.cols).enumerate() {
            for (k, v) in line.iter_mut().enumerate() {
                *v = spectrum[k * rows + r] * scale;
            }
            // what rounding leaves of the imaginary parts that are zero for a real image
            line[0].im = 0.0;
            if self.cols.is_multiple_of(2) {
                line[half - 1].im = 0.0;
            }
            self.inverse_rows
                .process_with_scratch(&mut line, row, &mut scratch)
                .expect("the plan's own lengths, real ends");
        }
        padded
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_smooth() {
        for (n, expected) in [(0, 1), (1, 1), (7, 8), (11, 12), (486, 486), (487, 500)] {
            assert_eq!(fast_length(n), expected);
        }
    }
}
