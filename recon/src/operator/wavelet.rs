//! Orthonormal wavelet bases of images.

use super::{LinearOperator, check_shape};

/// An orthonormal wavelet, by the number of its vanishing moments.
///
/// Source: I. Daubechies, *Ten Lectures on Wavelets* (1992), table 6.1; A. Haar, Math. Ann. 69 (1910).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wavelet {
    /// One vanishing moment, filters of 2: piecewise constant images.
    Haar,
    /// Two vanishing moments, filters of 4: piecewise linear images.
    Daubechies2,
}

impl Wavelet {
    /// Low-pass filter h; Σh = √2, Σ hᵢ hᵢ₊₂ₖ = δₖ.
    fn low_pass(self) -> Vec<f64> {
        match self {
            Self::Haar => vec![std::f64::consts::FRAC_1_SQRT_2; 2],
            Self::Daubechies2 => {
                let root = 3_f64.sqrt();
                let scale = 4.0 * std::f64::consts::SQRT_2;
                [1.0 + root, 3.0 + root, 3.0 - root, 1.0 - root]
                    .map(|v| v / scale)
                    .to_vec()
            }
        }
    }
}

/// Orthonormal wavelet basis of `rows` × `cols` images, periodic at the edges: `apply` makes an image of its coefficients, `apply_adjoint` the
/// coefficients of an image, the coarse part first in both directions (Mallat's order).
///
/// A level halves the sides of the coarse part; it takes part as long as both sides are even and no shorter than the filter.
/// Source: S. Mallat, IEEE Trans. PAMI 11 (1989) 674.
#[derive(Debug, Clone)]
pub struct Wavelet2 {
    rows: usize,
    cols: usize,
    levels: u32,
    low_pass: Vec<f64>,
}

impl Wavelet2 {
    /// Basis of `rows` × `cols` images with at most `levels` levels.
    #[must_use]
    pub fn new(wavelet: Wavelet, rows: usize, cols: usize, levels: u32) -> Self {
        let low_pass = wavelet.low_pass();
        let divides = |level: u32| {
            [rows, cols].iter().all(|side| {
                let side = side.checked_shr(level).unwrap_or(0);
                side.is_multiple_of(2) && side >= low_pass.len()
            })
        };
        let possible = (0..usize::BITS).take_while(|&level| divides(level)).count();
        Self {
            rows,
            cols,
            levels: levels.min(u32::try_from(possible).unwrap_or(u32::MAX)),
            low_pass,
        }
    }

    /// Levels that the basis has.
    #[must_use]
    pub fn levels(&self) -> u32 {
        self.levels
    }

    /// One level along a line: averages to the first half, differences to the second.
    fn analyse(&self, line: &mut [f64], scratch: &mut Vec<f64>) {
        let n = line.len();
        scratch.clear();
        scratch.resize(n, 0.0);
        for i in 0..n / 2 {
            for (j, (low, high)) in self.filters().enumerate() {
                let v = line[(2 * i + j) % n];
                scratch[i] += low * v;
                scratch[n / 2 + i] += high * v;
            }
        }
        line.copy_from_slice(scratch);
    }

    /// The transpose, and so the inverse, of [`Self::analyse`].
    fn synthesise(&self, line: &mut [f64], scratch: &mut Vec<f64>) {
        let n = line.len();
        scratch.clear();
        scratch.resize(n, 0.0);
        for i in 0..n / 2 {
            for (j, (low, high)) in self.filters().enumerate() {
                scratch[(2 * i + j) % n] += low * line[i] + high * line[n / 2 + i];
            }
        }
        line.copy_from_slice(scratch);
    }

    /// Taps of low pass and high pass; gⱼ = (−1)ʲ h₍L₋₁₋ⱼ₎.
    fn filters(&self) -> impl Iterator<Item = (f64, f64)> {
        let high = self.low_pass.iter().rev().enumerate();
        let high = high.map(|(j, h)| if j % 2 == 0 { *h } else { -h });
        self.low_pass.iter().copied().zip(high)
    }

    /// `line` on every row and every column of the coarse part at `level`.
    fn level(&self, image: &mut [f64], level: u32, line: fn(&Self, &mut [f64], &mut Vec<f64>)) {
        let (rows, cols) = (self.rows >> level, self.cols >> level);
        let mut scratch = Vec::new();
        for row in image.chunks_exact_mut(self.cols).take(rows) {
            line(self, &mut row[..cols], &mut scratch);
        }
        let mut column = vec![0.0; rows];
        for c in 0..cols {
            for (r, v) in column.iter_mut().enumerate() {
                *v = image[r * self.cols + c];
            }
            line(self, &mut column, &mut scratch);
            for (r, v) in column.iter().enumerate() {
                image[r * self.cols + c] = *v;
            }
        }
    }
}

impl LinearOperator for Wavelet2 {
    fn nrows(&self) -> usize {
        self.rows * self.cols
    }

    fn ncols(&self) -> usize {
        self.rows * self.cols
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        check_shape(self, x, y);
        y.copy_from_slice(x);
        for level in (0..self.levels).rev() {
            self.level(y, level, Self::synthesise);
        }
    }

    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
        check_shape(self, x, y);
        x.copy_from_slice(y);
        for level in 0..self.levels {
            self.level(x, level, Self::analyse);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::{check_operator, check_orthonormal};

    #[test]
    fn it_is_orthonormal() {
        for wavelet in [Wavelet::Haar, Wavelet::Daubechies2] {
            for (rows, cols, levels) in [(1, 1, 0), (2, 8, 1), (10, 10, 1), (16, 24, 3), (96, 32, 5)] {
                let basis = Wavelet2::new(wavelet, rows, cols, 10);
                assert!(
                    basis.levels() <= levels,
                    "{wavelet:?} {rows} × {cols}: {}",
                    basis.levels()
                );
                check_operator(&basis);
                check_orthonormal(&basis);
            }
        }
    }

    /// Vanishing moments: constants and, away from the periodic edge, straight lines have no differences.
    #[test]
    fn smooth_images_have_few_coefficients() {
        let n = 16;
        let image: Vec<f64> = (0..n * n).map(|k| (k / n) as f64 + 2.0 * (k % n) as f64).collect();
        let mut c = vec![0.0; n * n];
        Wavelet2::new(Wavelet::Daubechies2, n, n, 1).apply_adjoint(&image, &mut c);
        for r in 0..n / 2 - 1 {
            for k in n / 2..n - 1 {
                // rounding of numbers up to 45
                assert!(c[r * n + k].abs() < 1e-12, "row {r}, column {k}: {}", c[r * n + k]);
            }
        }
        let mut c = vec![0.0; n * n];
        Wavelet2::new(Wavelet::Haar, n, n, 4).apply_adjoint(&vec![1.0; n * n], &mut c);
        assert!((c[0] - 16.0).abs() < 1e-12 && c[1..].iter().all(|v| v.abs() < 1e-12));
    }
}
