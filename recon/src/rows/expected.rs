//! Expected images, their tolerances, and the limit that they set to the sums of rows.

use crate::checks::within;
use crate::kernels::{adjoint, axpy, dot};
use crate::matrix::Matrix;
use crate::recover::Gaussian;
use crate::rows::RowTask;
use crate::rows::headroom_unreachable;
use crate::rows::other_grid;
use crate::rows::too_many_rows;
use spts_input::Refusal;

/// Second moments of the images that rows are designed for.
///
/// ```
/// use spts_recon::recover::Gaussian;
/// use spts_recon::rows::{Expected, Tolerances};
///
/// let prior = Gaussian::white(12, 1.0)?;
/// let images = Expected::like(&prior, [3, 4], Tolerances { gain_log_sd: 0.3, shift: 1 })?;
/// assert_eq!((images.shape(), images.taxels()), ([3, 4], 12));
/// assert!(Expected::like(&prior, [4, 4], Tolerances::default()).is_err(), "12 taxels do not fill 4 × 4");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Expected {
    pub(super) shape: [usize; 2],
    pub(super) moments: Moments,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Moments {
    /// Covariance C and second moments S = C + μ μᵀ, each N × N.
    Dense { covariance: Matrix, second: Matrix },
    /// Covariances along the rows and along the columns of the grid: C = A ⊗ B, mean 0.
    Separable { rows: Matrix, cols: Matrix },
}

/// How much the images on the skin may differ from those for which rows are designed: by unknown gains and by shifts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tolerances {
    /// Standard deviation of the logarithm of a taxel's gain, in [0, 3].
    pub gain_log_sd: f64,
    /// Largest shift of the images, taxels, at most 64, and less on sheets of thousands of taxels; all shifts are
    /// equally likely.
    pub shift: usize,
}

/// Length that a covariance's diagonal is raised by, as a share of its mean: keeps factors positive.
const FLOOR: f64 = 1e-9;
/// Largest gain spread and shift.
const MOST: (f64, usize) = (3.0, 64);
/// Most products in an average over shifts, some ten seconds: a shift adds up all pairs of taxels.
const MOST_PRODUCTS: f64 = 2e10;

impl Expected {
    /// Smooth images on a grid of `shape` = [rows, columns]: Cᵢⱼ = exp(−dᵢⱼ²/2ℓ²) with the distance d in taxels, and
    /// mean 0. The covariance is separable, so two small matrices describe grids of any size.
    ///
    /// # Errors
    /// [`Refusal`] unless `length` ℓ is in [0.01, 1000] taxels, [`Refusal`] for an empty grid.
    pub fn smooth(shape: [usize; 2], length: f64) -> Result<Self, Refusal> {
        within("length", length, 0.01, 1000.0)?;
        check_shape(shape, shape[0] * shape[1])?;
        let axis = |n: usize| {
            let mut c = Matrix::zeros(n, n);
            for i in 0..n {
                for (j, v) in c.row_mut(i).iter_mut().enumerate() {
                    let d = i.abs_diff(j) as f64 / length;
                    *v = (-0.5 * d * d).exp();
                }
            }
            c
        };
        Ok(Self { shape, moments: Moments::Separable { rows: axis(shape[0]), cols: axis(shape[1]) } })
    }

    /// Images of `prior` on a grid of `shape` = [rows, columns], with `tolerances`. Gains g with mean 1 and variance v
    /// = e^{σ²} − 1 multiply the second moments entry by entry by E[g gᵀ] = 1 + v I. Moments are averaged over all
    /// shifts, with zeros moving in.
    ///
    /// # Errors
    /// [`Refusal`] if the prior does not fit the grid, [`Refusal`] for tolerances out of range.
    pub fn like(prior: &Gaussian, shape: [usize; 2], tolerances: Tolerances) -> Result<Self, Refusal> {
        check_shape(shape, prior.mean().len())?;
        within("gain_log_sd", tolerances.gain_log_sd, 0.0, MOST.0)?;
        within("shift", tolerances.shift as f64, 0.0, most_shift(shape) as f64)?;
        let n = prior.mean().len();
        let mean = prior.mean().to_vec();
        let mut second = prior.covariance().clone();
        for i in 0..n {
            second.row_mut(i).iter_mut().zip(&mean).for_each(|(s, m)| *s += mean[i] * m);
        }
        let (mean, mut second) =
            if tolerances.shift > 0 { moved(shape, tolerances.shift, &mean, &second) } else { (mean, second) };
        let spread = tolerances.gain_log_sd.powi(2).exp_m1();
        let floor = FLOOR * (0..n).map(|i| second.row(i)[i]).sum::<f64>() / n as f64;
        for i in 0..n {
            let row = second.row_mut(i);
            row[i] += spread * row[i] + floor;
        }
        let mut covariance = second.clone();
        for i in 0..n {
            let row = covariance.row_mut(i);
            row.iter_mut().zip(&mean).for_each(|(c, m)| *c -= mean[i] * m);
        }
        Ok(Self { shape, moments: Moments::Dense { covariance, second } })
    }

    /// These moments, of which there were `images` images of N taxels, drawn towards those of `pooled` images, as those
    /// of few images need to be: (n X + N Y) / (n + N), with X = C, S of these images and Y those of the pooled ones at
    /// the same tr S. So the mean of the posterior of a covariance is, if its prior is an inverse Wishart distribution
    /// about Y with as many degrees of freedom as N images would give it (A. Gelman et al., *Bayesian Data Analysis*,
    /// 3rd ed., §3.6).
    ///
    /// # Errors
    /// [`Refusal`] if the grids differ.
    pub fn drawn_towards(&self, pooled: &Self, images: usize) -> Result<Self, Refusal> {
        if pooled.shape != self.shape {
            return Err(other_grid(pooled.taxels(), self.shape[0], self.shape[1]));
        }
        let n = self.taxels() as f64;
        let own = images as f64 / (images as f64 + n);
        let other = (1.0 - own) * self.random_square() / pooled.random_square();
        let mixed = |mut own_moments: Matrix, others: &Matrix| {
            for i in 0..own_moments.nrows() {
                let each = own_moments.row_mut(i).iter_mut().zip(others.row(i));
                each.for_each(|(x, y)| *x = own * *x + other * y);
            }
            own_moments
        };
        let covariance = mixed(self.covariance(), &pooled.covariance());
        let second = mixed(self.second(), &pooled.second());
        Ok(Self { shape: self.shape, moments: Moments::Dense { covariance, second } })
    }

    /// Rows and columns of the grid.
    pub fn shape(&self) -> [usize; 2] {
        self.shape
    }

    /// Number of taxels, N.
    pub fn taxels(&self) -> usize {
        self.shape[0] * self.shape[1]
    }

    /// Covariance, N × N.
    pub(super) fn covariance(&self) -> Matrix {
        match &self.moments {
            Moments::Dense { covariance, .. } => covariance.clone(),
            Moments::Separable { rows, cols } => kronecker(rows, cols),
        }
    }

    /// C a → `out`.
    pub(super) fn times_covariance(&self, a: &[f64], out: &mut [f64]) {
        match &self.moments {
            // C is symmetric
            Moments::Dense { covariance, .. } => adjoint(covariance.view().values(), a, out),
            // A X B, X the row as a grid
            Moments::Separable { rows, cols } => {
                let width = cols.nrows();
                let along = along_rows(rows, a, width);
                for (out, part) in out.chunks_exact_mut(width).zip(along.chunks_exact(width)) {
                    out.iter_mut().enumerate().for_each(|(c, out)| *out = dot(cols.row(c), part));
                }
            }
        }
    }

    /// tr C.
    pub(super) fn variance(&self) -> f64 {
        let trace = |m: &Matrix| (0..m.nrows()).map(|i| m.row(i)[i]).sum::<f64>();
        match &self.moments {
            Moments::Dense { covariance, .. } => trace(covariance),
            Moments::Separable { rows, cols } => trace(rows) * trace(cols),
        }
    }

    /// Second moments S, N × N.
    pub(super) fn second(&self) -> Matrix {
        match &self.moments {
            Moments::Dense { second, .. } => second.clone(),
            Moments::Separable { .. } => self.covariance(),
        }
    }

    /// tr S: mean square of the sum of a row of independent random signs.
    pub(super) fn random_square(&self) -> f64 {
        let trace = |m: &Matrix| (0..m.nrows()).map(|i| m.row(i)[i]).sum::<f64>();
        match &self.moments {
            Moments::Dense { second, .. } => trace(second),
            Moments::Separable { rows, cols } => trace(rows) * trace(cols),
        }
    }

    /// aᵀS a: mean square of the sum of the row `a`.
    pub(super) fn square_of_sum(&self, a: &[f64]) -> f64 {
        match &self.moments {
            Moments::Dense { second, .. } => (0..a.len()).map(|i| a[i] * dot(second.row(i), a)).sum(),
            // Σ over the grid of X ∘ (A X B), X the row as a grid
            Moments::Separable { rows, cols } => {
                let width = cols.nrows();
                let ax = along_rows(rows, a, width);
                let each = a.chunks_exact(width).zip(ax.chunks_exact(width));
                each.map(|(x, ax)| (0..width).map(|c| x[c] * dot(cols.row(c), ax)).sum::<f64>()).sum()
            }
        }
    }

    /// Covariances along the rows and along the columns: of dense moments, the means over the other axis.
    pub(super) fn axes(&self) -> [Matrix; 2] {
        let [rows, cols] = self.shape;
        match &self.moments {
            Moments::Separable { rows, cols } => [rows.clone(), cols.clone()],
            Moments::Dense { covariance, .. } => {
                let (mut a, mut b) = (Matrix::zeros(rows, rows), Matrix::zeros(cols, cols));
                for i in 0..rows * cols {
                    let (r, c) = (i / cols, i % cols);
                    for k in 0..rows {
                        a.row_mut(r)[k] += covariance.row(i)[k * cols + c] / cols as f64;
                    }
                    for k in 0..cols {
                        b.row_mut(c)[k] += covariance.row(i)[r * cols + k] / rows as f64;
                    }
                }
                [a, b]
            }
        }
    }
}

fn check_shape(shape: [usize; 2], pixels: usize) -> Result<(), Refusal> {
    if pixels == 0 || shape[0].checked_mul(shape[1]) != Some(pixels) {
        return Err(other_grid(pixels, shape[0], shape[1]));
    }
    Ok(())
}

/// A X, X the row `a` as a grid of `width` columns.
fn along_rows(rows: &Matrix, a: &[f64], width: usize) -> Vec<f64> {
    let mut ax = vec![0.0; a.len()];
    for (out, row) in ax.chunks_exact_mut(width).zip(0..) {
        for (part, &weight) in a.chunks_exact(width).zip(rows.row(row)) {
            axpy(weight, part, out);
        }
    }
    ax
}

/// A ⊗ B.
fn kronecker(a: &Matrix, b: &Matrix) -> Matrix {
    let (n, m) = (a.nrows(), b.nrows());
    let mut out = Matrix::zeros(n * m, n * m);
    for i in 0..n * m {
        let (row_a, row_b) = (a.row(i / m), b.row(i % m));
        for (part, a) in out.row_mut(i).chunks_exact_mut(m).zip(row_a) {
            part.iter_mut().zip(row_b).for_each(|(out, b)| *out = a * b);
        }
    }
    out
}

/// Shifts, out of `reach` to either side, that leave something of `side` taxels on the sheet: `reach` is none.
fn shifts(side: usize, reach: usize) -> std::ops::RangeInclusive<usize> {
    (reach + 1).saturating_sub(side)..=(reach + side - 1).min(2 * reach)
}

/// Largest shift of images of `shape` whose average takes [`MOST_PRODUCTS`] at most.
fn most_shift(shape: [usize; 2]) -> usize {
    let square = ((shape[0] * shape[1]) as f64).powi(2);
    let products = |reach: usize| shape.map(|side| shifts(side, reach).count() as f64).iter().product::<f64>() * square;
    (0..=MOST.1).rev().find(|reach| products(*reach) <= MOST_PRODUCTS).unwrap_or(0)
}

/// Mean and second moments of images at all shifts up to `reach`, averaged; zeros move in.
fn moved(shape: [usize; 2], reach: usize, mean: &[f64], second: &Matrix) -> (Vec<f64>, Matrix) {
    let [rows, cols] = shape;
    let n = rows * cols;
    let weight = 1.0 / ((2 * reach + 1) * (2 * reach + 1)) as f64;
    let (mut out_mean, mut out) = (vec![0.0; n], Matrix::zeros(n, n));
    // the places that a shift reaches from the sheet
    let reached =
        |side: usize, shift: usize| shift.saturating_sub(reach)..side.min((side + shift).saturating_sub(reach));
    for (dr, dc) in shifts(rows, reach).flat_map(|dr| shifts(cols, reach).map(move |dc| (dr, dc))) {
        let (down, across) = (reached(rows, dr), reached(cols, dc));
        let from = |r: usize, c: usize| (r + reach - dr) * cols + c + reach - dc;
        for (r, c) in down.clone().flat_map(|r| across.clone().map(move |c| (r, c))) {
            let (to, source) = (r * cols + c, second.row(from(r, c)));
            out_mean[to] += weight * mean[from(r, c)];
            for r in down.clone() {
                let (first, source) = (r * cols + across.start, &source[from(r, across.start)..]);
                axpy(weight, &source[..across.len()], &mut out.row_mut(to)[first..first + across.len()]);
            }
        }
    }
    (out_mean, out)
}

/// Mean square aᵀS a of the sum of a row a over the expected images, kept up to date while single levels change.
#[derive(Debug, Clone)]
pub(super) struct Headroom {
    second: Matrix,
    limit: f64,
    sa: Vec<f64>,
    square: f64,
}

impl Headroom {
    /// The limit of `task`, if it has one.
    pub(super) fn of(task: &RowTask<'_>) -> Option<Self> {
        Some(Self {
            limit: task.largest_square()?,
            second: task.expected.second(),
            sa: vec![0.0; task.expected.taxels()],
            square: 0.0,
        })
    }

    pub(super) fn start(&mut self, row: &[f64]) {
        adjoint(self.second.view().values(), row, &mut self.sa);
        self.square = dot(row, &self.sa);
    }

    /// Mean square after level i has changed by `delta`.
    pub(super) fn after(&self, i: usize, delta: f64) -> f64 {
        self.square + delta * (2.0 * self.sa[i] + delta * self.second.row(i)[i])
    }

    pub(super) fn change(&mut self, i: usize, delta: f64) {
        self.square = self.after(i, delta);
        crate::kernels::axpy(delta, self.second.row(i), &mut self.sa);
    }

    pub(super) fn square(&self) -> f64 {
        self.square
    }

    pub(super) fn limit(&self) -> f64 {
        self.limit
    }

    pub(super) fn kept(&self) -> bool {
        self.square <= self.limit
    }
}

/// Largest root mean square of a row's sum over the expected images, among `rows` (M × N), relative to that of a random
/// row. It is compared with the limit [`RowTask::largest_sum`].
///
/// # Panics
/// If the rows have another number of taxels than the images.
pub fn largest_sum(expected: &Expected, rows: &Matrix) -> f64 {
    assert_eq!(rows.ncols(), expected.taxels(), "taxels");
    let squares = (0..rows.nrows()).map(|r| expected.square_of_sum(rows.row(r)));
    (squares.fold(0.0, f64::max) / expected.random_square()).sqrt()
}

/// The first `task.rows` of `candidates` that keep to the headroom and are not like one before them but for the sign;
/// `reason` says what limits the number of candidates.
pub(super) fn take(
    task: &RowTask<'_>,
    candidates: impl Iterator<Item = Vec<f64>>,
    reason: &'static str,
) -> Result<Matrix, Refusal> {
    let n = task.expected.taxels();
    let limit = task.largest_square();
    let (mut kept, mut least): (Vec<Vec<f64>>, f64) = (Vec::new(), f64::INFINITY);
    for row in candidates {
        if kept.len() == task.rows {
            break;
        }
        if let Some(limit) = limit {
            let square = task.expected.square_of_sum(&row);
            least = least.min(square);
            if square > limit {
                continue;
            }
        }
        let like = |other: &Vec<f64>| dot(other, &row).abs() >= dot(&row, &row) * (1.0 - 1e-12);
        if !kept.iter().any(like) {
            kept.push(row);
            (task.row_found)();
        }
    }
    if kept.len() < task.rows {
        return Err(match task.largest_sum {
            Some(limit) if kept.is_empty() => {
                headroom_unreachable(limit, (least / task.expected.random_square()).sqrt())
            }
            _ => too_many_rows(task.rows, kept.len(), reason),
        });
    }
    let mut rows = Matrix::zeros(task.rows, n);
    for (r, row) in kept.iter().enumerate() {
        rows.row_mut(r).copy_from_slice(row);
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One taxel of 3 × 3 of value 2, moved by up to one: nine places alike, so that S = 4/9 on the diagonal; then
    /// gains of variance v on top.
    #[test]
    fn tolerances_widen_the_moments() {
        let mut mean = vec![0.0; 9];
        mean[4] = 2.0;
        let mut tiny = Matrix::zeros(9, 9);
        (0..9).for_each(|i| tiny.row_mut(i)[i] = 1e-12);
        let prior = Gaussian::new(mean, tiny).unwrap();
        let tolerances = Tolerances { gain_log_sd: 0.3, shift: 1 };
        let expected = Expected::like(&prior, [3, 3], tolerances).unwrap();
        let second = expected.second();
        let v = 0.09_f64.exp();
        for i in 0..9 {
            for j in 0..9 {
                let want = if i == j { v * 4.0 / 9.0 } else { 0.0 };
                assert!((second.row(i)[j] - want).abs() < 1e-8, "{i} {j}: {}", second.row(i)[j]);
                let centred = want - 4.0 / 81.0;
                assert!((expected.covariance().row(i)[j] - centred).abs() < 1e-8);
            }
        }
    }

    /// Against the average written shift by shift, pair by pair, bit for bit; shifts beyond the sheet leave nothing.
    #[test]
    fn moments_are_averaged_over_all_shifts() {
        for (shape, reach) in [([2_usize, 3_usize], 1), ([3, 2], 2), ([1, 4], 9), ([2, 2], 64)] {
            let n = shape[0] * shape[1];
            let mean: Vec<f64> = (0..n).map(|i| 0.3 + i as f64).collect();
            let second = Matrix::from_rows(n, n, (0..n * n).map(|k| (k as f64).sin()).collect()).unwrap();
            let weight = 1.0 / ((2 * reach + 1) * (2 * reach + 1)) as f64;
            let (mut expected_mean, mut expected) = (vec![0.0; n], vec![0.0; n * n]);
            for (dr, dc) in (0..=2 * reach).flat_map(|dr| (0..=2 * reach).map(move |dc| (dr, dc))) {
                let source = |i: usize| {
                    let (r, c) = ((i / shape[1] + reach).wrapping_sub(dr), (i % shape[1] + reach).wrapping_sub(dc));
                    (r < shape[0] && c < shape[1]).then(|| r * shape[1] + c)
                };
                for (i, from) in (0..n).filter_map(|i| Some((i, source(i)?))) {
                    expected_mean[i] += weight * mean[from];
                    for (j, other) in (0..n).filter_map(|j| Some((j, source(j)?))) {
                        expected[i * n + j] += weight * second.row(from)[other];
                    }
                }
            }
            let found = moved(shape, reach, &mean, &second);
            assert_eq!((found.0, found.1.view().values()), (expected_mean, &expected[..]));
        }
        assert_eq!([[10, 10], [64, 64], [200, 200]].map(most_shift), [64, 16, 1]);
    }

    #[test]
    fn smooth_images_are_separable() {
        let expected = Expected::smooth([3, 4], 1.5).unwrap();
        let c = expected.covariance();
        for i in 0..12 {
            for j in 0..12 {
                let d2 = (i / 4_usize).abs_diff(j / 4).pow(2) + (i % 4_usize).abs_diff(j % 4).pow(2);
                let want = (-0.5 * d2 as f64 / 2.25).exp();
                assert!((c.row(i)[j] - want).abs() < 1e-15);
            }
        }
        assert!((expected.random_square() - 12.0).abs() < 1e-12);
        let dense = Expected { shape: [3, 4], moments: Moments::Dense { covariance: c.clone(), second: c } };
        for (a, b) in dense.axes().iter().zip(&expected.axes()) {
            for (a, b) in a.view().values().iter().zip(b.view().values()) {
                assert!((a - b).abs() < 1e-14);
            }
        }
    }

    /// By hand: 3 images of 9 taxels count a quarter, at the trace of their own.
    #[test]
    fn few_images_are_drawn_towards_all() {
        let like = |deviation: f64, corner: f64| {
            let mut covariance = Gaussian::white(9, deviation).unwrap().covariance().clone();
            (covariance.row_mut(0)[8], covariance.row_mut(8)[0]) = (corner, corner);
            let prior = Gaussian::new(vec![0.0; 9], covariance).unwrap();
            Expected::like(&prior, [3, 3], Tolerances::default()).unwrap()
        };
        let (own, all) = (like(1.0, 0.4), like(2.0, 0.0));
        let drawn = own.drawn_towards(&all, 3).unwrap();
        assert!((drawn.covariance().row(0)[8] - 0.1).abs() < 1e-8);
        assert!((drawn.variance() - 9.0).abs() < 1e-7 && (drawn.random_square() - 9.0).abs() < 1e-7);
        assert!(own.drawn_towards(&Expected::smooth([2, 2], 1.0).unwrap(), 3).is_err());
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let prior = Gaussian::white(6, 1.0).unwrap();
        let like = |shape, gain_log_sd, shift| {
            let tolerances = Tolerances { gain_log_sd, shift };
            Expected::like(&prior, shape, tolerances).map(|_| ()).unwrap_err()
        };
        assert!(like([2, 2], 0.0, 0).to_string().contains("images of 6 taxels"));
        assert!(like([2, 3], f64::NAN, 0).to_string().contains("`gain_log_sd` = "));
        assert!(like([2, 3], 0.0, 65).to_string().contains("`shift` = "));
        assert!(Expected::smooth([0, 3], 1.0).is_err() && Expected::smooth([2, 3], 0.0).is_err());
    }
}
