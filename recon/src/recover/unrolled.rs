//! Images by a small neural network that has been trained on many simulated ones. The network is an unrolled iteration:
//! each of its steps compares its image with the samples and corrects it.

use crate::checks::{other_columns, overflow};
use crate::cholesky::{factor, solve_lower};
use crate::kernels::{adjoint, column_squares, dot, norm};
use crate::matrix::{Matrix, MatrixView};
use crate::metrics::SUPPORT_THRESHOLD;
use crate::problem::{Problem, Recover, Solution, Workspace, divide_into, operator_scale, power_of_two};
use crate::sign_tables::SignTables;
use multiversion::multiversion;
use spts_input::Refusal;
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
/// # Ok::<(), Box<dyn std::error::Error>>(())
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
    pub fn new(weights: UnrolledWeights) -> Self {
        let tables = SignTables::new(weights.prior.view());
        Self { model: Arc::new(Model { weights, tables }) }
    }

    /// N, taxels.
    pub fn taxels(&self) -> usize {
        self.model.weights.taxels()
    }

    /// Computes the image of `problem` into `image`, in units of `y`, and into `probabilities` the probability that
    /// each taxel exceeds .23 of the image's maximum. Both are zero if `y` or all rows are zero.
    ///
    /// # Errors
    /// [`Refusal`] if the rows have another number of taxels or an entry that is not finite, or a taxel exceeds
    /// the range of numbers.
    pub fn estimate(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        image: &mut Vec<f64>,
        probabilities: &mut Vec<f64>,
    ) -> Result<Touched, Refusal> {
        let work = workspace.scratch::<Scratch>();
        let found = self.decode(problem, work)?;
        image.clear();
        image.extend_from_slice(&work.x);
        probabilities.clear();
        probabilities.extend_from_slice(&work.touched);
        Ok(found)
    }

    /// Image and probabilities into `work`.
    fn decode(&self, problem: &Problem<'_>, work: &mut Scratch) -> Result<Touched, Refusal> {
        let (a, n) = (problem.matrix(), self.taxels());
        if a.ncols() != n {
            return Err(other_columns(a.ncols(), n));
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
            return Ok(Touched { taxels: 0, expected_iou: 0.0 });
        }
        let s = self.linear(work);
        self.unroll(work);
        let (taxels, expected_iou) = best_support(&work.touched, &mut work.order);
        agree(&mut work.x, &work.order, taxels);
        for (atom, x) in work.x.iter_mut().enumerate() {
            // two products: the scales lie up to 10^600 apart
            *x = *x * s * y_scale / size;
            if !x.is_finite() {
                return Err(overflow(atom));
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
        for (i, (row, gains)) in work.lower.chunks_exact_mut(m).zip(work.gains.chunks_exact(n)).enumerate() {
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
            work.white.extend(work.y.iter().zip(rows).map(|(y, row)| y - dot(row, &work.x)));
            solve_lower(&work.lower, m, &mut work.white);
            adjoint(&work.gains, &work.white, &mut work.step);
            let error = single(norm(&work.white) / (m as f64).sqrt());
            let size = single(libm::log(m as f64 / 20.0));
            let inputs = &mut work.inputs;
            inputs.clear();
            let all = work.x.iter().chain(&work.step).map(|v| single(*v));
            let all = all.chain(work.linear.iter().chain(&work.left).chain(&work.memory).copied());
            push(inputs, all.chain([size, error]));
            apply(&step.hidden, inputs, &mut work.hidden);
            inputs.clear();
            push(inputs, work.hidden.iter().map(|v| v.max(0.0)));
            apply(&step.change, inputs, &mut work.change);
            let (image, memory) = work.change.split_at(n);
            work.x.iter_mut().zip(image).for_each(|(x, z)| *x = (*x + f64::from(*z)).max(0.0));
            work.memory.iter_mut().zip(memory).for_each(|(h, z)| *h = libm::tanhf(*z));
        }
        work.inputs.clear();
        let x = work.x.iter().map(|v| single(*v));
        push(&mut work.inputs, work.memory.iter().copied().chain(x));
        apply(&weights.output, &work.inputs, &mut work.change);
        let logits = work.change.iter().map(|z| f64::from(*z));
        work.touched.clear();
        work.touched.extend(logits.map(|z| 1.0 / (1.0 + libm::exp(-z))));
    }
}

impl Scratch {
    /// The rows, scaled to a root mean square of 1, and their signs where all are ±1; returns what they were divided
    /// by, 0 for rows that are all zero.
    fn scale_rows(&mut self, power: f64, problem: &Problem<'_>) -> Result<f64, Refusal> {
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
    ) -> Result<(), Refusal> {
        let work = workspace.scratch::<Scratch>();
        self.decode(problem, work)?;
        let n = self.taxels();
        let rows = problem.matrix().values().chunks_exact(n);
        work.white.clear();
        work.white.extend(problem.y().iter().zip(rows).map(|(y, row)| y - dot(row, &work.x)));
        let left = norm(&work.white);
        solution.set_dense(&work.x, 1.0, if left.is_finite() { left } else { f64::MAX })
    }
}

/// A dense layer of a neural network: out = W u + b for the inputs u.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layer {
    /// W in tiles of outputs, each inputs × width, so that a decode reads it sequentially.
    pub(super) weights: Vec<f32>,
    /// b, one an output.
    pub(super) bias: Vec<f32>,
}

impl Layer {
    /// A layer whose `weights` are the matrix W (inputs × outputs, row-major), with one `bias` b for each output.
    /// [`super::UnrolledWeights::new`] checks that layers fit together.
    pub fn new(weights: Vec<f32>, bias: Vec<f32>) -> Self {
        let (outputs, inputs) = (bias.len(), weights.len() / bias.len().max(1));
        let mut tiles = Vec::with_capacity(weights.len());
        let mut first = 0;
        while first < outputs {
            let width = WIDTHS.into_iter().find(|width| first + width <= outputs).unwrap_or(1);
            tiles.extend((0..inputs).flat_map(|i| &weights[i * outputs + first..][..width]));
            first += width;
        }
        // what is no whole number of rows is refused by its length
        tiles.extend_from_slice(&weights[inputs * outputs..]);
        Self { weights: tiles, bias }
    }

    fn check(&self, name: &str, inputs: usize, outputs: usize) -> Result<(), Refusal> {
        for (what, len, expected) in
            [("weights", self.weights.len(), inputs * outputs), ("biases", self.bias.len(), outputs)]
        {
            if len != expected {
                return Err(other_count(&format!("{what} of {name}"), len, expected));
            }
        }
        if self.weights.iter().chain(&self.bias).all(|w| w.is_finite()) { Ok(()) } else { Err(not_finite(name)) }
    }
}

/// The error of what has a number that is NaN or infinite.
fn not_finite(what: &str) -> Refusal {
    Refusal::new(format!("{what} has a number that is not finite"))
}

/// Parameters of one step of an [`super::Unrolled`] network, by which the step corrects the image: two dense layers,
/// with max(0, ·) between them. The documentation there has the formulas. N is the number of taxels, P that of the
/// values handed from step to step (`memory`), and H that of the hidden values, which is free.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct UnrolledStep {
    /// W₁ and b₁: from 4 N + P + 2 inputs (x, Vᵀ e, Vᵀ w/s, v, h, ln(M/20), |e|/√M, in this order) to H hidden values.
    pub hidden: Layer,
    /// W₂ and b₂: from H hidden values to N + P outputs, which are the correction of the N taxels, and then the P
    /// values for the next step.
    pub change: Layer,
}

/// All numbers that training finds for an [`super::Unrolled`] network, whose documentation has the formulas. None of
/// them is a weight of a taxel: those are the rows Φ of the problem.
#[derive(Debug, Clone, PartialEq)]
pub struct UnrolledWeights {
    /// K, second moments of images of length 1, N × N.
    pub(super) prior: Matrix,
    /// ν
    pub(super) noise_variance: f64,
    pub(super) steps: Vec<UnrolledStep>,
    pub(super) output: Layer,
    pub(super) memory: usize,
}

/// Most taxels: the moments of their images take O(N²).
const MOST_TAXELS: usize = 4096;
/// Steps of [`UnrolledWeights::plain`].
const PLAIN_STEPS: usize = 30;
/// Slope of the logarithm of the odds of [`UnrolledWeights::plain`].
const STEEP: f32 = 100.0;
/// Smallest and largest sum of the variances of images of length 1, and of their noise; both are 1 and .01 or so.
const MOMENTS: [f64; 2] = [1e-3, 1e3];

impl UnrolledWeights {
    /// A network of `steps` and an `output` layer. `prior` (N × N) holds the second moments of the images and
    /// `noise_variance` the variance of the noise, both for images of length 1.
    ///
    /// # Errors
    /// [`Refusal`] if the layers do not fit together, a number is not finite, or the prior is not valid.
    pub fn new(prior: Matrix, noise_variance: f64, steps: Vec<UnrolledStep>, output: Layer) -> Result<Self, Refusal> {
        let n = prior.nrows();
        let range = |field, value, valid, range| {
            if valid { Ok(()) } else { Err(Refusal::range(field, value, range)) }
        };
        range("taxels", n as f64, (1..=MOST_TAXELS).contains(&n) && prior.ncols() == n, "[1, 4096]")?;
        range("steps", steps.len() as f64, steps.len() <= 100, "[0, 100]")?;
        if !prior.view().values().iter().all(|v| v.is_finite()) {
            return Err(not_finite("the prior"));
        }
        let trace: f64 = (0..n).map(|i| prior.row(i)[i]).sum();
        let [least, most] = MOMENTS;
        range("trace of the prior", trace, (least..=most).contains(&trace), "[1e-3, 1e3]")?;
        range("noise_variance", noise_variance, (1e-5..=most).contains(&noise_variance), "[1e-5, 1e3]")?;
        let memory = (output.weights.len() / n)
            .checked_sub(n)
            .ok_or_else(|| other_count("weights of the output", output.weights.len(), n * n))?;
        for (t, step) in steps.iter().enumerate() {
            let hidden = step.hidden.bias.len();
            step.hidden.check(&format!("step {t}, hidden"), 4 * n + memory + 2, hidden)?;
            step.change.check(&format!("step {t}, change"), hidden, n + memory)?;
        }
        output.check("the output", memory + n, n)?;
        Ok(Self { prior, noise_variance, steps, output, memory })
    }

    /// An untrained network for `taxels` that are independent and alike. Every step adds the linear estimate from the
    /// residual and sets negative values to zero; taxels above a quarter of the image's length count as touched.
    ///
    /// # Errors
    /// [`Refusal`] if the number of taxels or the noise is out of range.
    pub fn plain(taxels: usize, noise_variance: f64) -> Result<Self, Refusal> {
        let n = taxels;
        let mut prior = Matrix::zeros(n, n);
        let (mut weights, mut hidden, mut change) =
            (vec![0.0; n * n], vec![0.0; (4 * n + 2) * 2 * n], vec![0.0; 2 * n * n]);
        for i in 0..n {
            prior.row_mut(i)[i] = 1.0 / n as f64;
            weights[i * n + i] = STEEP;
            // what is added, above zero and below
            hidden[(n + i) * 2 * n + i] = 1.0;
            hidden[(n + i) * 2 * n + n + i] = -1.0;
            change[i * n + i] = 1.0;
            change[(n + i) * n + i] = -1.0;
        }
        let step =
            UnrolledStep { hidden: Layer::new(hidden, vec![0.0; 2 * n]), change: Layer::new(change, vec![0.0; n]) };
        let output = Layer::new(weights, vec![-STEEP / 4.0; n]);
        Self::new(prior, noise_variance, vec![step; PLAIN_STEPS], output)
    }

    /// N, taxels.
    pub fn taxels(&self) -> usize {
        self.prior.nrows()
    }
}

/// Outputs that are summed in registers at a time.
const BLOCK: usize = 64;

/// Widths of tiles, widest first.
pub(super) const WIDTHS: [usize; 4] = [BLOCK, 16, 4, 1];

/// Adds Σᵢ uᵢ wᵢ over the `B` outputs of a tile (inputs × B), in the order of the inputs.
#[inline(always)]
fn block<const B: usize>(mut sums: [f32; B], tile: &[f32], inputs: &[(u32, f32)]) -> [f32; B] {
    let rows = tile.as_chunks::<B>().0;
    for &(i, value) in inputs {
        if let Some(row) = rows.get(i as usize) {
            for (sum, &w) in sums.iter_mut().zip(row) {
                *sum += value * w;
            }
        }
    }
    sums
}

#[inline(always)]
fn apply_of(weights: &[f32], inputs: &[(u32, f32)], out: &mut [f32]) {
    let count = weights.len() / out.len().max(1);
    let mut left = weights;
    let mut tile = |width: usize| {
        let (tile, rest) = left.split_at(count * width);
        left = rest;
        tile
    };
    let (wide, rest) = out.as_chunks_mut::<BLOCK>();
    for out in wide {
        *out = block(*out, tile(BLOCK), inputs);
    }
    let (sixteens, rest) = rest.as_chunks_mut::<16>();
    for out in sixteens {
        *out = block(*out, tile(16), inputs);
    }
    let (fours, rest) = rest.as_chunks_mut::<4>();
    for out in fours {
        *out = block(*out, tile(4), inputs);
    }
    for out in rest {
        [*out] = block([*out], tile(1), inputs);
    }
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn sums(weights: &[f32], inputs: &[(u32, f32)], out: &mut [f32]) {
    apply_of(weights, inputs, out);
}

/// `out` = W u + b for the inputs that are not zero, each with its number. The order of sums is that of the inputs: the
/// same bits whichever instruction set is chosen, because no product is fused with a sum.
pub(super) fn apply(layer: &Layer, inputs: &[(u32, f32)], out: &mut Vec<f32>) {
    out.clear();
    out.extend_from_slice(&layer.bias);
    sums(&layer.weights, inputs, out);
}

/// Share of the largest value that the weakest taxel of a support has at least, and that the strongest outside it has
/// at most: on either side of [`SUPPORT_THRESHOLD`].
const INSIDE: f64 = SUPPORT_THRESHOLD + 0.01;
const OUTSIDE: f64 = SUPPORT_THRESHOLD - 0.01;

/// Chooses the support of largest expected intersection over union for taxels that are touched with the probabilities
/// `touched`: the k most probable ones, with the k that maximises
///
/// E\[IoU\] ≈ Σ_{i ∈ S} pᵢ / (|S| + Σ_{i ∉ S} pᵢ),
///
/// the ratio of the expectations. `order` becomes the taxels, most probable first, the first of equals; returned are k,
/// at least 1, and the expected value.
pub(super) fn best_support(touched: &[f64], order: &mut Vec<usize>) -> (usize, f64) {
    order.clear();
    order.extend(0..touched.len());
    order.sort_by(|&a, &b| touched[b].total_cmp(&touched[a]));
    let total: f64 = touched.iter().sum();
    let (mut inside, mut best) = (0.0, (1, 0.0));
    for (k, &taxel) in order.iter().enumerate() {
        inside += touched[taxel];
        let expected = inside / ((k + 1) as f64 + (total - inside).max(0.0));
        if expected > best.1 {
            best = (k + 1, expected);
        }
    }
    best
}

/// Changes `image` (no value below zero) least so that its support, the taxels above [`SUPPORT_THRESHOLD`] of its
/// maximum, is the first `count` of `order`.
pub(super) fn agree(image: &mut [f64], order: &[usize], count: usize) {
    let (inside, outside) = order.split_at(count);
    let most = inside.iter().fold(0.0_f64, |m, &i| m.max(image[i]));
    // a support without a value has the same one everywhere
    let peak = if most > 0.0 { most } else { 1.0 };
    for &i in inside {
        image[i] = if most > 0.0 { image[i].max(INSIDE * peak) } else { peak };
    }
    for &i in outside {
        image[i] = image[i].min(OUTSIDE * peak);
    }
}

fn other_count(what: &str, len: usize, expected: usize) -> Refusal {
    Refusal::new(format!("{what} have {len} numbers, expected {expected}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checks::says;
    use crate::metrics::support;
    use nalgebra::{DMatrix, DVector};
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    /// Numbers of outputs that fill blocks of every size, against sums as they are written. Integers have no rounding.
    #[test]
    fn layers_of_any_width_are_sums_of_products() {
        for outputs in [1_u16, 3, 5, 16, 67, 148] {
            let weights: Vec<f32> = (0..4 * outputs).map(|k| f32::from(k % 11) - 5.0).collect();
            let outputs = usize::from(outputs);
            let layer = Layer::new(weights.clone(), vec![1.0; outputs]);
            let mut out = vec![9.0; 2];
            apply(&layer, &[(0, 2.0), (3, -3.0)], &mut out);
            for (o, found) in out.iter().enumerate() {
                let expected = 1.0 + 2.0 * weights[o] - 3.0 * weights[3 * outputs + o];
                assert!((found - expected).abs() < 1e-6, "{outputs}: {o}");
            }
        }
    }

    /// Against all subsets of six taxels.
    #[test]
    fn no_other_support_is_expected_to_be_better() {
        for touched in [[0.9, 0.8, 0.3, 0.2, 0.05, 0.6], [0.1, 0.1, 0.05, 0.2, 0.02, 0.1], [1.0; 6]] {
            let mut order = Vec::new();
            let (count, expected) = best_support(&touched, &mut order);
            let total: f64 = touched.iter().sum();
            for set in 1..64_u32 {
                let inside: f64 = (0..6).filter(|i| set >> i & 1 == 1).map(|i| touched[i]).sum();
                let other = inside / (f64::from(set.count_ones()) + total - inside);
                assert!(other <= expected + 1e-12, "{set:b}: {other} of {expected} for {count}");
            }
        }
    }

    #[test]
    fn the_image_has_the_support() {
        for image in [[0.0; 5], [1.0, 0.1, 0.5, 0.0, 0.2], [0.0, 0.0, 0.0, 3.0, 1.0]] {
            let mut image = image;
            let order = [1, 2, 4, 0, 3];
            agree(&mut image, &order, 3);
            let mut mask = Vec::new();
            support(&image, SUPPORT_THRESHOLD, &mut mask);
            assert_eq!(mask, [false, true, true, false, true], "{image:?}");
        }
    }

    const N: usize = 12;
    const HIDDEN: usize = 20;
    const MEMORY: usize = 5;
    const STEPS: usize = 2;
    const NOISE: f64 = 0.02;

    fn layer(rng: &mut ChaCha8Rng, inputs: usize, outputs: usize) -> Layer {
        let scale = 1.0 / (inputs as f32).sqrt();
        let mut draw = |count: usize| (0..count).map(|_| scale * rng.random_range(-1.5..1.5_f32)).collect();
        Layer::new(draw(inputs * outputs), draw(outputs))
    }

    fn weights(rng: &mut ChaCha8Rng) -> UnrolledWeights {
        let factor = DMatrix::from_fn(N, N, |_, _| rng.random_range(-0.2..0.3_f64));
        let prior = &factor * factor.transpose() / 1.5 + DMatrix::identity(N, N) * 1e-3;
        let steps = (0..STEPS).map(|_| UnrolledStep {
            hidden: layer(rng, 4 * N + MEMORY + 2, HIDDEN),
            change: layer(rng, HIDDEN, N + MEMORY),
        });
        let steps = steps.collect();
        UnrolledWeights::new(Matrix::from(&prior), NOISE, steps, layer(rng, MEMORY + N, N)).unwrap()
    }

    fn dense(layer: &Layer, inputs: &DVector<f64>) -> DVector<f64> {
        let outputs = layer.bias.len();
        // tiles of 64, 16, 4 outputs and one, each inputs × width
        let mut w = DMatrix::zeros(outputs, inputs.len());
        let (mut first, mut left) = (0, layer.weights.iter());
        while first < outputs {
            let width = [64, 16, 4, 1].into_iter().find(|w| first + w <= outputs).unwrap();
            for i in 0..inputs.len() {
                (first..first + width).for_each(|o| w[(o, i)] = f64::from(*left.next().unwrap()));
            }
            first += width;
        }
        w * inputs + DVector::from_iterator(outputs, layer.bias.iter().map(|b| f64::from(*b)))
    }

    /// Image before it is made to agree with the support, and probabilities, as the documentation of [`Unrolled`] has
    /// them.
    fn formula(w: &UnrolledWeights, phi: &DMatrix<f64>, y: &DVector<f64>) -> (DVector<f64>, DVector<f64>) {
        let m = phi.nrows();
        let k = DMatrix::from_row_slice(N, N, w.prior.view().values());
        let s = phi * &k * phi.transpose() + DMatrix::identity(m, m) * NOISE;
        let l = s.cholesky().unwrap().l();
        let white = |b: &DVector<f64>| l.solve_lower_triangular(b).unwrap();
        let v = l.solve_lower_triangular(&(phi * &k)).unwrap();
        let scale = white(y).norm() / (m as f64).sqrt();
        let y = y / scale;
        let linear = v.transpose() * white(&y);
        let left = DVector::from_fn(N, |i, _| (k[(i, i)] - v.column(i).norm_squared()).max(0.0).sqrt());
        let mut x = linear.map(|v| v.max(0.0));
        let mut h = DVector::zeros(MEMORY);
        for step in &w.steps {
            let e = white(&(&y - phi * &x));
            let inputs: Vec<f64> = [&x, &(v.transpose() * &e), &linear, &left, &h]
                .into_iter()
                .flat_map(|part| part.iter().copied().collect::<Vec<_>>())
                .chain([(m as f64 / 20.0).ln(), e.norm() / (m as f64).sqrt()])
                .collect();
            let z = dense(&step.change, &dense(&step.hidden, &DVector::from_vec(inputs)).map(|v| v.max(0.0)));
            x = DVector::from_fn(N, |i, _| (x[i] + z[i]).max(0.0));
            h = DVector::from_fn(MEMORY, |i, _| z[N + i].tanh());
        }
        let all = DVector::from_iterator(N + MEMORY, h.iter().chain(x.iter()).copied());
        (x * scale, dense(&w.output, &all).map(|z| 1.0 / (1.0 + (-z).exp())))
    }

    /// Single precision in the network leaves 24 bits of numbers near 1 that add up a hundred at a time: 1e-5 is ten
    /// times what that leaves.
    #[test]
    fn the_network_is_its_formula() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for m in [1, 5, 9, 30] {
            let weights = weights(&mut rng);
            let phi = DMatrix::from_fn(m, N, |_, _| if rng.random() { 1.0 } else { -1.0 });
            let y = DVector::from_fn(m, |_, _| rng.random_range(-2.0..2.0));
            let (expected, touched) = formula(&weights, &phi, &y);
            let rows = Matrix::from(&phi);
            let (mut image, mut probabilities) = (Vec::new(), Vec::new());
            let problem = Problem::new(rows.view(), y.as_slice()).unwrap();
            let network = Unrolled::new(weights);
            let found = network.estimate(&problem, &mut Workspace::default(), &mut image, &mut probabilities);
            let found = found.unwrap();
            for (p, expected) in probabilities.iter().zip(&touched) {
                assert!((p - expected).abs() < 1e-5, "M = {m}: {p}, expected {expected}");
            }
            // the support is that of the probabilities, so that the image is compared where both agree about it
            let mut order = Vec::new();
            let (count, iou) = best_support(touched.as_slice(), &mut order);
            assert_eq!(found.taxels, count, "M = {m}");
            assert!((found.expected_iou - iou).abs() < 1e-5);
            let mut expected = expected.as_slice().to_vec();
            agree(&mut expected, &order, count);
            let largest = expected.iter().fold(0.0_f64, |most, v| most.max(*v));
            for (x, expected) in image.iter().zip(&expected) {
                assert!((x - expected).abs() < 1e-5 * largest, "M = {m}: {x}, expected {expected}");
            }
        }
    }

    /// Rows that are not ±1 are scaled to a root mean square of 1: those of another size give the same image, as large
    /// as y and they say.
    #[test]
    fn the_size_of_rows_and_samples_is_taken_out() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let network = Unrolled::new(weights(&mut rng));
        let values: Vec<f64> = (0..6 * N).map(|_| if rng.random() { 1.0 } else { -1.0 }).collect();
        let y: Vec<f64> = (0..6).map(|_| rng.random_range(-1.0..1.0)).collect();
        let solve = |rows: f64, samples: f64| {
            let scaled: Vec<f64> = values.iter().map(|v| v * rows).collect();
            let y: Vec<f64> = y.iter().map(|v| v * samples).collect();
            let (mut image, mut touched) = (Vec::new(), Vec::new());
            let problem = Problem::new(MatrixView::new(6, N, &scaled).unwrap(), &y).unwrap();
            network.estimate(&problem, &mut Workspace::default(), &mut image, &mut touched).map(|_| image)
        };
        let one = solve(1.0, 1.0).unwrap();
        for (rows, samples) in [(0.3, 1.0), (1e-150, 1e-150), (1e150, 7.0), (1e300, 1e300)] {
            for (other, x) in solve(rows, samples).unwrap().iter().zip(&one) {
                let expected = x * (samples / rows);
                // another size of the rows goes past the look-ups, which are in single precision
                assert!(
                    (other - expected).abs() <= 1e-5 * (samples / rows),
                    "{rows:e}, {samples:e}: {other} {expected}"
                );
            }
        }
        assert!(says(&solve(1e-300, 1e300), "the coefficient of atom"));
        assert!(solve(1.0, 0.0).unwrap().iter().all(|x| *x == 0.0));
        assert!(solve(0.0, 1.0).unwrap().iter().all(|x| *x == 0.0));
    }
}
