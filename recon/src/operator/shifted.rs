//! Small atoms at every place of an image, by Fourier transforms.

use crate::matrix::matrix_shape;
use crate::operator::{LinearOperator, check_shape};
use realfft::num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner};
use spts_input::Refusal;
use std::sync::Arc;

/// A small image, row-major, from which an image is composed by placing copies of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Atom {
    rows: usize,
    cols: usize,
    values: Vec<f64>,
}

impl Atom {
    /// Atom from row-major values.
    ///
    /// # Errors
    /// [`Refusal`] if `values` does not hold `rows · cols` numbers.
    pub fn new(rows: usize, cols: usize, values: Vec<f64>) -> Result<Self, Refusal> {
        let len = values.len();
        if rows.checked_mul(cols) == Some(len) {
            Ok(Self { rows, cols, values })
        } else {
            Err(matrix_shape(rows, cols, len))
        }
    }

    /// Half an ellipsoid of unit height, √(1 − d²/(`radius_taxels` + ½)²): the pressure under a ball. The atom extends
    /// by the radius, rounded to whole taxels, to each side of its middle.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        reason = "an atom is small, and a negative radius counts as 0"
    )]
    pub fn cap(radius_taxels: f64) -> Self {
        let reach = radius_taxels.ceil() as usize;
        let side = 2 * reach + 1;
        let off = |i: usize| i as f64 - reach as f64;
        let height = |k: usize| {
            let square = off(k / side).powi(2) + off(k % side).powi(2);
            (1.0 - square / (radius_taxels + 0.5).powi(2)).max(0.0).sqrt()
        };
        Self {
            rows: side,
            cols: side,
            values: (0..side * side).map(height).collect(),
        }
    }

    /// The atom with squared values.
    #[must_use]
    pub fn squared(&self) -> Self {
        Self {
            values: self.values.iter().map(|v| v * v).collect(),
            ..*self
        }
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    #[must_use]
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// Values, row-major.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }
}

/// Dictionary with every atom at every place of a `rows` × `cols` image. Column (k·rows + r)·cols + c is atom k with
/// its middle (⌊rows/2⌋, ⌊cols/2⌋) at row r, column c. Parts outside the image are cut off.
///
/// A product costs one Fourier transform for each atom instead of one multiplication for each place and value.
/// Zero-padding prevents the convolution from wrapping around. Memory: the spectra, about 8 bytes for each taxel and
/// atom.
///
/// ```
/// use spts_recon::operator::{Atom, LinearOperator as _, ShiftedDictionary};
///
/// let atom = Atom::new(1, 3, vec![1.0, 2.0, 1.0])?;
/// let dictionary = ShiftedDictionary::new(4, 5, &[atom]);
/// let (mut place, mut image) = ([0.0; 20], [0.0; 20]);
/// place[2 * 5 + 3] = 10.0; // row 2, column 3
/// dictionary.apply(&place, &mut image);
/// assert!((image[2 * 5 + 3] - 20.0).abs() < 1e-9 && (image[2 * 5 + 4] - 10.0).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct ShiftedDictionary {
    rows: usize,
    cols: usize,
    fft: Fft2,
    /// Spectrum of every atom, its middle at (0, 0).
    spectra: Vec<Vec<Complex64>>,
}

impl ShiftedDictionary {
    /// The dictionary of `atoms` in `rows` × `cols` images.
    #[must_use]
    pub fn new(rows: usize, cols: usize, atoms: &[Atom]) -> Self {
        let reach = |side: fn(&Atom) -> usize| atoms.iter().map(side).max().unwrap_or(0);
        let fft = Fft2::new(rows + reach(Atom::rows), cols + reach(Atom::cols));
        let spectra = atoms.iter().map(|atom| spectrum(&fft, atom)).collect();
        Self {
            rows,
            cols,
            fft,
            spectra,
        }
    }

    fn forward(&self, image: &[f64]) -> Vec<Complex64> {
        let cols = self.fft.cols();
        let mut padded = vec![0.0; self.fft.rows() * cols];
        for (to, from) in padded.chunks_exact_mut(cols).zip(image.chunks_exact(self.cols.max(1))) {
            to[..from.len()].copy_from_slice(from);
        }
        self.fft.forward(&mut padded)
    }

    fn inverse(&self, mut spectrum: Vec<Complex64>, image: &mut [f64]) {
        let padded = self.fft.inverse(&mut spectrum);
        let rows = padded.chunks_exact(self.fft.cols());
        for (to, from) in image.chunks_exact_mut(self.cols.max(1)).zip(rows) {
            to.copy_from_slice(&from[..to.len()]);
        }
    }
}

/// Spectrum of an atom whose middle is at (0, 0), the rest of it wrapped around.
fn spectrum(fft: &Fft2, atom: &Atom) -> Vec<Complex64> {
    let (rows, cols) = (fft.rows(), fft.cols());
    let mut padded = vec![0.0; rows * cols];
    for (r, row) in atom.values.chunks_exact(atom.cols.max(1)).enumerate() {
        for (c, v) in row.iter().enumerate() {
            let (r, c) = (r + rows - atom.rows / 2, c + cols - atom.cols / 2);
            padded[r % rows * cols + c % cols] = *v;
        }
    }
    fft.forward(&mut padded)
}

impl LinearOperator for ShiftedDictionary {
    fn nrows(&self) -> usize {
        self.rows * self.cols
    }

    fn ncols(&self) -> usize {
        self.spectra.len() * self.rows * self.cols
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        check_shape(self, x, y);
        let mut sum: Option<Vec<Complex64>> = None;
        for (spectrum, coefficients) in self.spectra.iter().zip(x.chunks_exact(self.nrows().max(1))) {
            let mut product = self.forward(coefficients);
            product.iter_mut().zip(spectrum).for_each(|(p, s)| *p *= s);
            match &mut sum {
                None => sum = Some(product),
                Some(sum) => sum.iter_mut().zip(&product).for_each(|(s, p)| *s += p),
            }
        }
        match sum {
            None => y.fill(0.0),
            Some(sum) => self.inverse(sum, y),
        }
    }

    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
        check_shape(self, x, y);
        let image = self.forward(y);
        for (spectrum, x) in self.spectra.iter().zip(x.chunks_exact_mut(self.nrows().max(1))) {
            let product = image.iter().zip(spectrum).map(|(i, s)| i * s.conj()).collect();
            self.inverse(product, x);
        }
    }
}

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
    use crate::operator::check_operator;
    use proptest::prelude::*;

    /// The image with atom `atom` at (r, c), place by place.
    fn placed(atom: &Atom, (rows, cols): (usize, usize), (r, c): (usize, usize)) -> Vec<f64> {
        let mut image = vec![0.0; rows * cols];
        for (i, v) in atom.values.iter().enumerate() {
            let (ir, ic) = (i / atom.cols, i % atom.cols);
            let (tr, tc) = (
                (r + ir).wrapping_sub(atom.rows / 2),
                (c + ic).wrapping_sub(atom.cols / 2),
            );
            if tr < rows && tc < cols {
                image[tr * cols + tc] = *v;
            }
        }
        image
    }

    proptest! {
        #[test]
        fn columns_are_the_atoms_at_their_places(rows in 1_usize..9, cols in 1_usize..9, place in 0_usize..1000,
                                                 values in prop::collection::vec(-1.0..1.0, 15)) {
            let atoms = [Atom::new(3, 5, values.clone()).unwrap(), Atom::new(1, 2, values[..2].to_vec()).unwrap()];
            let dictionary = ShiftedDictionary::new(rows, cols, &atoms);
            check_operator(&dictionary);
            let column = place % dictionary.ncols();
            let (atom, at) = (column / (rows * cols), column % (rows * cols));
            let mut x = vec![0.0; dictionary.ncols()];
            x[column] = 1.0;
            let mut image = vec![f64::NAN; rows * cols];
            dictionary.apply(&x, &mut image);
            let expected = placed(&atoms[atom], (rows, cols), (at / cols, at % cols));
            for (got, expected) in image.iter().zip(&expected) {
                // transforms of at most 15 × 15 numbers below 1
                prop_assert!((got - expected).abs() < 1e-13, "{got} against {expected}");
            }
        }
    }

    #[test]
    fn lengths_are_smooth() {
        for (n, expected) in [(0, 1), (1, 1), (7, 8), (11, 12), (486, 486), (487, 500)] {
            assert_eq!(fast_length(n), expected);
        }
    }
}
