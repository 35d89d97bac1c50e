//! Non-negative least squares for one image from many measurements, some of which can be taken out again.

use super::nnqp::{Buffers, Lowered, minimise};
use crate::cholesky::factor;
use crate::kernels::{add_gram, adjoint, axpy};
use crate::matrix::MatrixView;
use spts_input::Refusal;

/// Rows whose products are added at a time.
const BATCH: usize = 256;

/// Least squares for an image of N values, none below zero, and a constant for every wire:
///
/// min Σ (yᵢ − φᵢ x − c_wire(i))² subject to x ≥ 0.
///
/// Only the sums ΦᵀΦ, Φᵀy and those of every wire are kept, so that measurements are added and taken out in O(N²) each.
/// The constants are eliminated: of rows and samples the means of their wire are subtracted. The program is solved
/// exactly by block principal pivoting.
///
/// ```
/// use spts_recon::{Matrix, recover::LeastSquares};
///
/// let rows = Matrix::from_rows(4, 2, vec![1.0, 1.0, 1.0, -1.0, -1.0, 1.0, -1.0, -1.0])?;
/// let mut fit = LeastSquares::new(2, 1);
/// // x = (2, 0) on a wire with an output of 5
/// fit.add(rows.view(), &[], &[7.0, 7.0, 3.0, 3.0]);
/// let image = fit.solve()?;
/// assert!((image[0] - 2.0).abs() < 1e-12 && image[1].abs() < 1e-12);
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone)]
pub struct LeastSquares {
    /// ΦᵀΦ, N × N, of which the upper triangle is kept.
    gram: Vec<f64>,
    /// Φᵀy
    linear: Vec<f64>,
    wires: Vec<WireSums>,
}

/// Sums over the measurements of one wire.
#[derive(Debug, Clone)]
struct WireSums {
    rows: Vec<f64>,
    samples: f64,
    count: f64,
}

impl LeastSquares {
    /// Sums of no measurement, for images of `taxels` values on `wires` wires.
    pub fn new(taxels: usize, wires: usize) -> Self {
        let none = WireSums { rows: vec![0.0; taxels], samples: 0.0, count: 0.0 };
        Self { gram: vec![0.0; taxels * taxels], linear: vec![0.0; taxels], wires: vec![none; wires.max(1)] }
    }

    /// Adds the measurements `y` with their `rows` (M × N) and the wire of every row; none for one wire. What is not
    /// finite is left out.
    pub fn add(&mut self, rows: MatrixView<'_>, wires: &[u16], y: &[f64]) {
        self.update(rows, wires, y, 1.0);
    }

    /// Takes measurements out that were added before.
    pub fn remove(&mut self, rows: MatrixView<'_>, wires: &[u16], y: &[f64]) {
        self.update(rows, wires, y, -1.0);
    }

    /// Adds the sums of `other`, which has as many taxels and wires.
    pub fn merge(&mut self, other: &Self) {
        axpy(1.0, &other.gram, &mut self.gram);
        axpy(1.0, &other.linear, &mut self.linear);
        for (own, other) in self.wires.iter_mut().zip(&other.wires) {
            axpy(1.0, &other.rows, &mut own.rows);
            own.samples += other.samples;
            own.count += other.count;
        }
    }

    fn update(&mut self, rows: MatrixView<'_>, wires: &[u16], y: &[f64], sign: f64) {
        let n = self.linear.len();
        let row = |i: usize| &rows.values()[i * n..(i + 1) * n];
        let there: Vec<usize> = (0..y.len().min(rows.nrows())).filter(|&i| y[i].is_finite()).collect();
        let (mut batch, mut columns, mut sums) = (Vec::new(), Vec::new(), vec![0.0; n]);
        for part in there.chunks(BATCH) {
            batch.clear();
            part.iter().for_each(|&i| batch.extend_from_slice(row(i)));
            columns.clear();
            (0..n).for_each(|j| columns.extend(batch.chunks_exact(n).map(|row| sign * row[j])));
            add_gram(&batch, &columns, n, &mut self.gram);
            let samples: Vec<f64> = part.iter().map(|&i| sign * y[i]).collect();
            adjoint(&batch, &samples, &mut sums);
            axpy(1.0, &sums, &mut self.linear);
        }
        let last = self.wires.len() - 1;
        for i in there {
            let wire = &mut self.wires[wires.get(i).map_or(0, |&wire| usize::from(wire)).min(last)];
            axpy(sign, row(i), &mut wire.rows);
            wire.samples += sign * y[i];
            wire.count += sign;
        }
    }

    /// Number of measurements.
    pub fn count(&self) -> f64 {
        self.wires.iter().map(|wire| wire.count).sum()
    }

    /// ΦᵀΦ (whole) and Φᵀy, the means of every wire subtracted.
    fn centred(&self) -> (Vec<f64>, Vec<f64>) {
        let n = self.linear.len();
        let (mut gram, mut linear) = (self.gram.clone(), self.linear.clone());
        for wire in self.wires.iter().filter(|wire| wire.count > 0.5) {
            for (i, row) in gram.chunks_exact_mut(n.max(1)).enumerate() {
                axpy(-wire.rows[i] / wire.count, &wire.rows[i..], &mut row[i..]);
            }
            axpy(-wire.samples / wire.count, &wire.rows, &mut linear);
        }
        for i in 0..n {
            for j in 0..i {
                gram[i * n + j] = gram[j * n + i];
            }
        }
        (gram, linear)
    }

    /// Whether the measurements determine every taxel: at least the share `least` of the square of its column is left
    /// when those before it are taken out.
    pub fn determines(&self, least: f64) -> bool {
        let n = self.linear.len();
        let (mut gram, _) = self.centred();
        let diagonal: Vec<f64> = (0..n).map(|i| gram[i * n + i]).collect();
        let factored = factor(&mut gram, n).is_ok();
        factored && diagonal.iter().enumerate().all(|(i, d)| gram[i * n + i].powi(2) >= least * d)
    }

    /// The image.
    ///
    /// # Errors
    /// [`Refusal`] if the measurements do not determine it.
    pub fn solve(&self) -> Result<Vec<f64>, Refusal> {
        let (gram, linear) = self.centred();
        let mut image = linear.clone();
        let hessian = Lowered { matrix: &gram, rows: &[], shares: &[] };
        minimise(&hessian, &linear, &mut image, &mut Buffers::default())?;
        Ok(image)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Matrix;
    use nalgebra::{DMatrix, DVector};
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    fn drawn(rng: &mut ChaCha8Rng, m: usize, n: usize) -> (Matrix, Vec<u16>, Vec<f64>, Vec<f64>) {
        let rows: Vec<f64> = (0..m * n).map(|_| if rng.random() { 1.0 } else { -1.0 }).collect();
        let image: Vec<f64> = (0..n).map(|_| rng.random_range(0.1..1.0)).collect();
        let wires: Vec<u16> = (0..m).map(|i| u16::from(i % 2 == 1)).collect();
        let sum = |i: usize| rows[i * n..(i + 1) * n].iter().zip(&image).map(|(w, x)| w * x).sum::<f64>();
        let y = (0..m).map(|i| sum(i) + [3.0, -2.0][usize::from(wires[i])] + rng.random_range(-0.01..0.01)).collect();
        (Matrix::from_rows(m, n, rows).unwrap(), wires, y, image)
    }

    /// Where no taxel is at zero, against nalgebra's least squares by the singular value decomposition, with a column
    /// for the constant of every wire.
    #[test]
    fn an_image_above_zero_is_that_of_least_squares() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for (m, n) in [(60, 7), (700, 30)] {
            let (rows, wires, y, _) = drawn(&mut rng, m, n);
            let mut fit = LeastSquares::new(n, 2);
            fit.add(rows.view(), &wires, &y);
            let found = fit.solve().unwrap();
            let all = DMatrix::from_fn(m, n + 2, |i, j| match j.checked_sub(n) {
                None => rows.row(i)[j],
                Some(wire) => f64::from(u8::from(usize::from(wires[i]) == wire)),
            });
            let expected = all.svd(true, true).solve(&DVector::from_column_slice(&y), 1e-12).unwrap();
            assert!(found.iter().zip(expected.iter()).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?} {expected}");
        }
    }

    /// Measurements that were taken out leave what the others give, to rounding; a lost sample is in neither.
    #[test]
    fn measurements_are_taken_out_again() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let (rows, wires, mut y, _) = drawn(&mut rng, 900, 20);
        y[17] = f64::NAN;
        let part = |range: std::ops::Range<usize>| {
            let rows = MatrixView::new(range.len(), 20, &rows.view().values()[range.start * 20..range.end * 20]);
            (rows.unwrap(), &wires[range.clone()], &y[range])
        };
        let of = |range: std::ops::Range<usize>| {
            let mut fit = LeastSquares::new(20, 2);
            let (rows, wires, y) = part(range);
            fit.add(rows, wires, y);
            fit
        };
        let mut less = of(0..900);
        let (taken, on, samples) = part(10..60);
        less.remove(taken, on, samples);
        let mut others = of(0..10);
        others.merge(&of(60..900));
        assert!((less.count() - 850.0).abs() < 1e-9);
        let (a, b) = (less.solve().unwrap(), others.solve().unwrap());
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-9), "{a:?} {b:?}");
    }

    /// With noise about an image of zeros, half of the taxels are at zero, and the conditions of the minimum hold:
    /// no gradient where a taxel is above zero, none that would lower the residual where it is zero.
    #[test]
    fn no_taxel_is_below_zero() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let (rows, _, _, _) = drawn(&mut rng, 400, 25);
        let y: Vec<f64> = (0..400).map(|_| rng.random_range(-1.0..1.0)).collect();
        let mut fit = LeastSquares::new(25, 1);
        fit.add(rows.view(), &[], &y);
        let image = fit.solve().unwrap();
        assert!(image.iter().all(|x| *x >= 0.0) && image.iter().filter(|x| **x > 0.0).count() > 3);
        let left: Vec<f64> =
            (0..400).map(|i| y[i] - rows.row(i).iter().zip(&image).map(|(w, x)| w * x).sum::<f64>()).collect();
        let mean = left.iter().sum::<f64>() / 400.0;
        for (k, x) in image.iter().enumerate() {
            let gradient: f64 = (0..400).map(|i| rows.row(i)[k] * (left[i] - mean)).sum();
            assert!(gradient < 1e-9 && (*x <= 0.0 || gradient.abs() < 1e-9), "{k}: {x}, {gradient}");
        }
    }

    #[test]
    fn rows_that_determine_nothing_are_told() {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let (rows, _, y, _) = drawn(&mut rng, 10, 20);
        let mut fit = LeastSquares::new(20, 1);
        (0..40).for_each(|_| fit.add(rows.view(), &[], &y));
        assert!(!fit.determines(0.05));
        let (rows, _, y, _) = drawn(&mut rng, 80, 20);
        fit.add(rows.view(), &[], &y);
        assert!(fit.determines(0.05));
        assert!(!LeastSquares::new(3, 1).determines(0.0) || LeastSquares::new(3, 1).solve().is_err());
    }
}
