//! Images by a small neural network that has been trained on many simulated ones. The network is an unrolled iteration:
//! each of its steps compares its image with the samples and corrects it.

mod layer;
mod support;
#[cfg(test)]
mod tests;
mod weights;

pub use weights::{Layer, UnrolledError, UnrolledStep, UnrolledWeights};

use super::cholesky::{factor, solve_lower};
use super::scaling::{divide_into, operator_scale, power_of_two};
use crate::kernels::{adjoint, column_squares, dot, norm};
use crate::matrix::MatrixView;
use crate::problem::{Problem, Recover, RecoverError, Solution};
use crate::sign_rows::SignTables;
use crate::workspace::Workspace;
use std::sync::Arc;

/// Decodes an image with a small neural network, which has been trained on many simulated images before: a decode then
/// takes only a few matrix products.
///
/// Input: M samples y, and their rows Φ of the sensing matrix (M × N for N taxels). Output: the image x, N values in
/// the units of y; and for each taxel the probability p that it is touched, which means above 23 % of the image's
/// maximum.
///
/// The network starts from the linear estimate of the image. Each of its T steps computes the residual e, what the
/// image leaves of the samples, and adds a correction z. The image then gets the smallest change after which the
/// touched taxels are those with the largest expected intersection over union under p.
///
/// The formulas, for rows of ±1 (others are scaled to a root mean square of 1 first); max, tanh and √ act on each
/// value:
///
/// S = Φ K Φᵀ + ν I = L Lᵀ, V = L⁻¹ Φ K, w = L⁻¹ y, s = |w|/√M, v = √(diag K − diag VᵀV);
/// x = max(0, Vᵀ w/s), h = 0; T times: e = L⁻¹ (y/s − Φ x),
/// \[z, g\] = W₂ max(0, W₁ [x, Vᵀ e, Vᵀ w/s, v, h, ln(M/20), |e|/√M] + b₁) + b₂, x ← max(0, x + z), h ← tanh g;
/// p = 1/(1 + exp(−(Wₒ [h, x] + bₒ))); the image is s x.
///
/// K (N × N) are the second moments of the images, all scaled to length 1, and ν is the variance of a sample's noise at
/// that scale. Vᵀ w is the linear estimate (LMMSE), s the length of the image that the samples suggest, and v the
/// standard deviation of each taxel that the linear estimate leaves. h are P values that a step hands to the next one.
/// The numbers that training has found are K, ν, the matrices W and the vectors b, W₁ to b₂ anew for each
/// step: [`UnrolledWeights`]. The matrix
/// products of the network use single precision, all else double precision.
///
/// Source: K. Gregor, Y. LeCun, "Learning fast approximations of sparse coding", ICML 2010, for unrolling.
///
/// ```
/// use spts_recon::recover::UnrolledWeights;
///
/// // an untrained network for 100 taxels
/// let weights = UnrolledWeights::plain(100, 1e-3)?;
/// assert_eq!(weights.taxels(), 100);
/// assert!(UnrolledWeights::plain(100, -1.0).is_err());
/// # Ok::<(), spts_recon::recover::UnrolledError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Unrolled {
    model: Arc<Model>,
}

#[derive(Debug)]
struct Model {
    weights: UnrolledWeights,
    /// Look-ups of rows of Φ K.
    tables: SignTables<f32>,
}

/// Memory of a decode.
#[derive(Debug, Default)]
struct Scratch {
    /// Φ, M × N.
    rows: Vec<f64>,
    signs: Vec<u64>,
    /// Φᵀ, N × M.
    columns: Vec<f64>,
    ones: Vec<f64>,
    /// y, and y over s.
    y: Vec<f64>,
    /// V, M × N.
    gains: Vec<f64>,
    /// L, M × M.
    lower: Vec<f64>,
    /// w or e.
    white: Vec<f64>,
    /// Vᵀ of it.
    step: Vec<f64>,
    x: Vec<f64>,
    linear: Vec<f32>,
    left: Vec<f32>,
    memory: Vec<f32>,
    inputs: Vec<(u32, f32)>,
    hidden: Vec<f32>,
    change: Vec<f32>,
    touched: Vec<f64>,
    order: Vec<usize>,
}

/// Result of a decode beside the image: its support, the taxels that count as touched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touched {
    /// Number of taxels in the support.
    pub taxels: usize,
    /// Expected intersection over union of the support with the true one, [0, 1].
    pub expected_iou: f64,
}

impl Unrolled {
    /// A network with the numbers that its training has found.
    #[must_use]
    pub fn new(weights: UnrolledWeights) -> Self {
        let tables = SignTables::new(weights.prior.view());
        Self {
            model: Arc::new(Model { weights, tables }),
        }
    }

    /// N, taxels.
    #[must_use]
    pub fn taxels(&self) -> usize {
        self.model.weights.taxels()
    }

    /// Computes the image of `problem` into `image`, in units of `y`, and into `probabilities` the probability that
    /// each taxel exceeds .23 of the image's maximum. Both are zero if `y` or all rows are zero.
    ///
    /// # Errors
    /// [`RecoverError`] if the rows have another number of taxels or an entry that is not finite, or a taxel exceeds
    /// the range of numbers.
    pub fn estimate(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        image: &mut Vec<f64>,
        probabilities: &mut Vec<f64>,
    ) -> Result<Touched, RecoverError> {
        let work = workspace.scratch::<Scratch>();
        let found = self.decode(problem, work)?;
        image.clear();
        image.extend_from_slice(&work.x);
        probabilities.clear();
        probabilities.extend_from_slice(&work.touched);
        Ok(found)
    }

    /// Image and probabilities into `work`.
    fn decode(&self, problem: &Problem<'_>, work: &mut Scratch) -> Result<Touched, RecoverError> {
        let (a, n) = (problem.matrix(), self.taxels());
        if a.ncols() != n {
            return Err(RecoverError::Columns {
                cols: a.ncols(),
                expected: n,
            });
        }
        let size = work.scale_rows(operator_scale(a)?, problem)?;
        let y_scale = power_of_two(problem.y());
        divide_into(problem.y(), y_scale, &mut work.y);
        let zero = size == 0.0 || work.y.iter().all(|y| *y == 0.0);
        work.x.clear();
        work.x.resize(n, 0.0);
        work.touched.clear();
        work.touched.resize(n, 0.0);
        if zero {
            return Ok(Touched {
                taxels: 0,
                expected_iou: 0.0,
            });
        }
        let s = self.linear(work);
        self.unroll(work);
        let (taxels, expected_iou) = support::best_support(&work.touched, &mut work.order);
        support::agree(&mut work.x, &work.order, taxels);
        for (atom, x) in work.x.iter_mut().enumerate() {
            // two products: the scales lie up to 10^600 apart
            *x = *x * s * y_scale / size;
            if !x.is_finite() {
                return Err(RecoverError::Overflow { atom });
            }
        }
        Ok(Touched { taxels, expected_iou })
    }

    /// The linear estimate: L, V, Vᵀ w/s and v; y is divided by s, which is returned.
    fn linear(&self, work: &mut Scratch) -> f64 {
        let weights = &self.model.weights;
        let (m, n) = (work.y.len(), weights.taxels());
        work.gains.resize(m * n, 0.0);
        if work.signs.is_empty() {
            let rows = work.rows.chunks_exact(n).zip(work.gains.chunks_exact_mut(n));
            // K is symmetric
            rows.for_each(|(row, out)| adjoint(weights.prior.view().values(), row, out));
        } else {
            self.model.tables.fill_rows(&work.signs, &mut work.gains);
        }
        work.lower.clear();
        work.lower.resize(m * m, 0.0);
        if let Ok(rows) = MatrixView::new(m, n, &work.rows) {
            rows.copy_columns(&mut work.columns);
        }
        for (i, (row, gains)) in work
            .lower
            .chunks_exact_mut(m)
            .zip(work.gains.chunks_exact(n))
            .enumerate()
        {
            adjoint(&work.columns, gains, row);
            row[i] += weights.noise_variance;
        }
        // the noise keeps it positive definite
        let _ = factor(&mut work.lower, m);
        solve_rows(&work.lower, m, n, &mut work.gains);
        work.white.clear();
        work.white.extend_from_slice(&work.y);
        solve_lower(&work.lower, m, &mut work.white);
        let s = norm(&work.white) / (m as f64).sqrt();
        work.y.iter_mut().for_each(|y| *y /= s);
        work.white.iter_mut().for_each(|w| *w /= s);
        work.step.resize(n, 0.0);
        adjoint(&work.gains, &work.white, &mut work.step);
        work.linear.clear();
        work.linear.extend(work.step.iter().map(|v| single(*v)));
        work.ones.resize(m, 1.0);
        column_squares(&work.gains, &work.ones, &mut work.x);
        work.left.clear();
        let variances = work.x.iter().enumerate().map(|(i, sum)| weights.prior.row(i)[i] - sum);
        work.left.extend(variances.map(|v| single(v.max(0.0).sqrt())));
        work.x.iter_mut().zip(&work.step).for_each(|(x, v)| *x = v.max(0.0));
        s
    }

    /// The steps from the linear estimate on, and the probabilities.
    fn unroll(&self, work: &mut Scratch) {
        let weights = &self.model.weights;
        let (m, n) = (work.y.len(), weights.taxels());
        work.memory.clear();
        work.memory.resize(weights.memory, 0.0);
        for step in &weights.steps {
            work.white.clear();
            let rows = work.rows.chunks_exact(n);
            work.white
                .extend(work.y.iter().zip(rows).map(|(y, row)| y - dot(row, &work.x)));
            solve_lower(&work.lower, m, &mut work.white);
            adjoint(&work.gains, &work.white, &mut work.step);
            let error = single(norm(&work.white) / (m as f64).sqrt());
            let size = single(libm::log(m as f64 / 20.0));
            let inputs = &mut work.inputs;
            inputs.clear();
            let all = work.x.iter().chain(&work.step).map(|v| single(*v));
            let all = all.chain(work.linear.iter().chain(&work.left).chain(&work.memory).copied());
            push(inputs, all.chain([size, error]));
            layer::apply(&step.hidden, inputs, &mut work.hidden);
            inputs.clear();
            push(inputs, work.hidden.iter().map(|v| v.max(0.0)));
            layer::apply(&step.change, inputs, &mut work.change);
            let (image, memory) = work.change.split_at(n);
            work.x
                .iter_mut()
                .zip(image)
                .for_each(|(x, z)| *x = (*x + f64::from(*z)).max(0.0));
            work.memory
                .iter_mut()
                .zip(memory)
                .for_each(|(h, z)| *h = libm::tanhf(*z));
        }
        work.inputs.clear();
        let x = work.x.iter().map(|v| single(*v));
        push(&mut work.inputs, work.memory.iter().copied().chain(x));
        layer::apply(&weights.output, &work.inputs, &mut work.change);
        let logits = work.change.iter().map(|z| f64::from(*z));
        work.touched.clear();
        work.touched.extend(logits.map(|z| 1.0 / (1.0 + libm::exp(-z))));
    }
}

impl Scratch {
    /// The rows, scaled to a root mean square of 1, and their signs where all are ±1; returns what they were divided
    /// by, 0 for rows that are all zero.
    fn scale_rows(&mut self, power: f64, problem: &Problem<'_>) -> Result<f64, RecoverError> {
        let (a, n) = (problem.matrix(), problem.matrix().ncols());
        divide_into(a.values(), power, &mut self.rows);
        if self.set_signs(n) {
            return Ok(power);
        }
        self.signs.clear();
        let rms = norm(&self.rows) / (self.rows.len() as f64).sqrt();
        if rms > 0.0 {
            self.rows.iter_mut().for_each(|v| *v /= rms);
        }
        Ok(power * rms)
    }

    /// Signs of rows of `n` weights; whether all weights are ±1.
    fn set_signs(&mut self, n: usize) -> bool {
        const SIGN: u64 = 1 << 63;
        self.signs.clear();
        let mut others = 0;
        for row in self.rows.chunks_exact(n) {
            for word in row.chunks(64) {
                let mut bits = 0;
                for (k, w) in word.iter().enumerate() {
                    bits |= (!w.to_bits() >> 63) << k;
                    others |= (w.to_bits() & !SIGN) ^ 1.0_f64.to_bits();
                }
                self.signs.push(bits);
            }
        }
        others == 0
    }
}

/// L⁻¹ B in place, for B of `n` columns.
fn solve_rows(lower: &[f64], m: usize, n: usize, b: &mut [f64]) {
    for i in 0..m {
        let (known, rest) = b.split_at_mut((i + 1) * n);
        let row = &mut known[i * n..];
        let inverse = 1.0 / lower[i * m + i];
        row.iter_mut().for_each(|v| *v *= inverse);
        // the upper triangle holds Lᵀ
        for (j, out) in rest.chunks_exact_mut(n).enumerate() {
            crate::kernels::axpy(-lower[i * m + i + 1 + j], row, out);
        }
    }
}

/// Appends the values that are not zero, each with its number.
fn push(inputs: &mut Vec<(u32, f32)>, values: impl Iterator<Item = f32>) {
    for (i, value) in values.enumerate() {
        if value != 0.0 {
            #[expect(clippy::cast_possible_truncation, reason = "no network has so many inputs")]
            inputs.push((i as u32, value));
        }
    }
}

/// The nearest number of single precision.
#[expect(clippy::cast_possible_truncation, reason = "rounding is what it is for")]
fn single(value: f64) -> f32 {
    value as f32
}

impl Recover for Unrolled {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), RecoverError> {
        let work = workspace.scratch::<Scratch>();
        self.decode(problem, work)?;
        let n = self.taxels();
        let rows = problem.matrix().values().chunks_exact(n);
        work.white.clear();
        work.white
            .extend(problem.y().iter().zip(rows).map(|(y, row)| y - dot(row, &work.x)));
        let left = norm(&work.white);
        solution.set_dense(&work.x, 1.0, if left.is_finite() { left } else { f64::MAX })
    }
}
