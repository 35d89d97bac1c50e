//! Images by a small neural network that has been trained on many simulated ones. The network is an unrolled iteration
//! whose weights are shared over the grid: one network serves sheets of any rows and columns.

use crate::checks::{other_columns, overflow};
use crate::cholesky::{factor, solve_lower, solve_upper};
use crate::kernels::{dot, norm};
use crate::kernels32::{
    LANES, LONG, Side, add_weighted, affine, apply, around, blur, explain, outer_sums, products, single, span_squares,
    transpose, weigh,
};
use crate::matrix::MatrixView;
use crate::metrics::SUPPORT_THRESHOLD;
use crate::problem::{ORDINARY, Problem, Recover, Solution, Workspace, divide_into, operator_scale, power_of_two};
use nalgebra::DMatrix;
use spts_input::Refusal;
use std::sync::Arc;

/// Decodes an image on a grid with a small neural network, which has been trained on many simulated images before.
///
/// Input: M samples y, and their rows Φ of the sensing matrix (M × N for N = rows × cols taxels). Output: the image,
/// N values in the units of y; and for each taxel the probability p that it is touched, which means above 23 % of the
/// image's maximum. The image gets the smallest change after which the touched taxels are those with the largest
/// expected intersection over union under p.
///
/// The formulas, for rows of ±1 (others are scaled to a root mean square of 1 first); max, √ and exp act on each value.
/// A covariance of images of length 1 is the sum of two Gaussians G₁, G₂ of the distance, a constant and independent
/// taxels, with weights w_k for each of K kinds of contacts:
///
/// K_k = (w_k1 G₁ + w_k2 G₂ + w_k3 1 1ᵀ + w_k4 I) / N, S_k = Φ K_k Φᵀ + ν I = L Lᵀ, e = L⁻¹ y, s_k = |e|/√M.
///
/// The share of a kind is its evidence, ∏ L_ii⁻¹ s_k^−M, normalised; s = exp Σ share ln s_k. The linear estimate is
/// l = Σ share K_k Φᵀ S_k⁻¹ y. With b = (Σ q)² / Σ q², q = (max(l, 0)/s + 10⁻⁴)², the number of taxels that take part,
/// all is divided by a = s/√b, so that a touched taxel is near 1.
///
/// Rectangles Q are tried as contacts: their sides are 1, 2, 3, 4, 5, 6, 8, 12, 16, 24, 32, 48 or 64 taxels, and they
/// lie a quarter of a side apart (at least a taxel). With A taxels, s = Φ 1_Q and c = .25 + ν, one explains the share e
/// = (.75/A) max(s·y, 0)² / ((c + .75 |s|²/A) |y|²) of the samples. Its weight is p ∝ (1 − e)^(−M/2) (c + .75
/// |s|²/A)^(−1/2), the evidence of a contact whose taxels have ¾ of their energy in common, with A I in place of Φ_Q
/// Φ_Qᵀ. Of all come two maps, the probability Σ p 1_Q that a taxel is in the contact and the height Σ p 1_Q (.75/A)
/// max(s·y, 0) / (c + .75 |s|²/A), and two numbers, ē = Σ p e and Σ p ln A.
///
/// From x = d = l, m = max(l, 0), g = Φᵀu/|u| (u: Σ share S_k⁻¹ y), q₁ = √(b/N), q₂ = 0, h = 0 and r = 1, every block
/// but the last computes, with x⁺ = max(x, 0) and a hidden image z of C channels:
///
/// t = [ln M/N, ln M/20, ln b/10, ln b/N, ē, Σ p ln A − 2, shares, r − 1, ln(max x⁺ + .1), ln(|x⁺|²/b + .01),
///      ln(((Σ x⁺)² + .1)/(|x⁺|² + .1)/b), mean of h], the two first within [−3.7, 0] and [−1.5, 1.7];
/// z = max(0, W₁ᵀ [x, d, .3 g, l, m, q₁, q₂, in a rectangle, its height, where, h] + G₁ᵀ t + b₁);
/// z = max(0, D ∗ z + b₂), D 3 × 3 in every channel; o = W₃ᵀ z + b₃;
/// m = max(0, x⁺ + o₀), q₁ = .01 + max(0, o₁), q₂ = max(0, o₂), h ← h + o₃…;
/// u = (Φ q₁² Φᵀ + B q₂² Bᵀ + b ν exp(n·t + n₀) I)⁻¹ (y − Φ m), the exponent within [−3, 3];
/// d = q₁² Φᵀu + blur(q₂² Bᵀu), x = m + d, g = Φᵀu/|u|, r = √(uᵀ(y − Φ m)/M).
///
/// B are the rows of Φ blurred by (1 2 1)/4 along both axes. So the network says what it expects of every taxel (m) and
/// how sure it is (q₁, and q₂ of neighbours together), and the exact Gaussian estimate under that goes to the next
/// block. After the last one, which stops at h, the image is a m and p = 1/(1 + exp(−h₀)). `where` are three maps of
/// the grid: max |u|, |u|² and exp(−e/1.5) with u ∈ [−1, 1]² the place of a taxel and e its distance from the edge.
///
/// The maps use single precision, the solves of M × M double precision.
///
/// Sources: K. Gregor, Y. LeCun, "Learning fast approximations of sparse coding", ICML 2010, for unrolling; M. Tipping,
/// "Sparse Bayesian learning and the relevance vector machine", JMLR 1 (2001), for variances that are found and solved
/// with in turn.
///
/// ```
/// use spts_recon::recover::{Unrolled, UnrolledWeights};
///
/// // an untrained network on a sheet of 10 × 12 taxels
/// let network = Unrolled::new(UnrolledWeights::plain(1e-3)?, [10, 12])?;
/// assert_eq!(network.taxels(), 120);
/// assert!(UnrolledWeights::plain(-1.0).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Unrolled {
    weights: Arc<UnrolledWeights>,
    grid: Arc<Grid>,
}

/// What follows from the rows and columns of a sheet.
#[derive(Debug)]
struct Grid {
    rows: usize,
    cols: usize,
    /// Both Gaussians, along the rows and along the columns.
    near: [[Vec<f32>; 2]; WIDTHS],
    /// F of the wide one, Fᵀ F being the Gaussian, along both; and the rows of F.
    factors: [Vec<f32>; 2],
    factor_rows: [usize; 2],
    /// Sides of rectangles along a row, and the spans of taxels along a column and along a row that they may have.
    sides: Vec<Side>,
    spans: [Vec<[usize; 2]>; 2],
    /// .75/A of every rectangle; those of the same rows are together, with zeros up to whole lanes.
    shares: Vec<f32>,
    /// Logarithms of the lengths of both spans, those along a row with zeros up to whole lanes.
    logs: [Vec<f32>; 2],
    /// Maps of where a taxel lies.
    places: Vec<[f32; PLACES]>,
}

/// Maps of where a taxel lies.
const PLACES: usize = 3;
/// Gaussians of the prior; and with the constant and the independent taxels, its parts.
const WIDTHS: usize = 2;
const PARTS: usize = WIDTHS + 2;
/// Values of a taxel that are no memory, and values of the whole image that are neither shares nor memory.
const TAXEL: usize = 9 + PLACES;
const WHOLE: usize = 10;
/// Outputs of a block before the memory.
const OUTPUTS: usize = 3;
/// Gaussians end where they are smaller, and parts of one that have less of its largest eigenvalue are left out.
const LEAST: f64 = 1e-6;
/// Sides of the rectangles that are tried, taxels; they lie a quarter of a side apart.
const SIDES: [usize; 13] = [1, 2, 3, 4, 5, 6, 8, 12, 16, 24, 32, 48, 64];
/// Shares of the energy of a contact in its mean and in what taxels differ by.
const EVEN: f32 = 0.75;
const UNEVEN: f32 = 0.25;
/// Rectangles of a smaller weight, the largest being near 1, are left out.
const LEAST_WEIGHT: f32 = 1e-6;
/// q₁ where no contact is expected.
const FLOOR: f32 = 0.01;

/// Result of a decode beside the image: its support, the taxels that count as touched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touched {
    /// Number of taxels in the support.
    pub taxels: usize,
    /// Expected intersection over union of the support with the true one, [0, 1].
    pub expected_iou: f64,
}

/// Weights of one block; [`Unrolled`] has the formulas. C is the number of channels, H that of the memory.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct UnrolledBlock {
    /// W₁, (12 + H) × C.
    pub taxel: Vec<f32>,
    /// G₁, (10 + kinds + H) × C.
    pub whole: Vec<f32>,
    /// b₁, C.
    pub bias: Vec<f32>,
    /// D, 9 × C.
    pub near: Vec<f32>,
    /// b₂, C.
    pub near_bias: Vec<f32>,
    /// W₃, C × (3 + H).
    pub output: Vec<f32>,
    /// b₃, 3 + H.
    pub output_bias: Vec<f32>,
    /// n and n₀, 11 + kinds + H.
    pub noise: Vec<f32>,
}

/// All numbers that training finds for an [`Unrolled`] network, whose documentation has the formulas, and those of its
/// prior.
#[derive(Debug, Clone, PartialEq)]
pub struct UnrolledWeights {
    /// Widths of the Gaussians: standard deviations, taxels.
    widths: [f64; WIDTHS],
    /// w of every kind.
    kinds: Vec<[f64; PARTS]>,
    /// ν
    noise_variance: f64,
    /// With as many channels and outputs as are computed side by side.
    blocks: Vec<UnrolledBlock>,
    memory: usize,
    channels: usize,
    /// Outputs of a block, 3 + H and more up to whole lanes.
    outputs: usize,
}

impl UnrolledWeights {
    /// Most blocks, channels, values of memory and kinds.
    const MOST: usize = 256;
    /// Blocks of [`UnrolledWeights::plain`].
    const PLAIN: usize = 30;
    /// Slope of the logarithm of the odds of [`UnrolledWeights::plain`].
    const STEEP: f32 = 100.0;

    /// A network of `blocks`. The prior has Gaussians of these `widths`, taxels, and for every kind the weights of
    /// both, of the constant and of independent taxels; `noise_variance` is that of a sample, all for images of length
    /// 1.
    ///
    /// # Errors
    /// [`Refusal`] if the blocks do not fit together, or a number is not finite or out of range.
    pub fn new(
        widths: [f64; 2],
        kinds: Vec<[f64; 4]>,
        noise_variance: f64,
        mut blocks: Vec<UnrolledBlock>,
    ) -> Result<Self, Refusal> {
        let range = |field: &str, value: f64, valid: bool, range: &str| match valid {
            true => Ok(()),
            false => Err(Refusal::range(field, value, range)),
        };
        let most = Self::MOST;
        range("blocks", blocks.len() as f64, (1..=most).contains(&blocks.len()), "[1, 256]")?;
        range("kinds", kinds.len() as f64, (1..=most).contains(&kinds.len()), "[1, 256]")?;
        range("noise_variance", noise_variance, (1e-6..=1e3).contains(&noise_variance), "[1e-6, 1e3]")?;
        for width in widths {
            range("widths", width, (0.1..=1e3).contains(&width), "[0.1, 1000]")?;
        }
        for weight in kinds.iter().flatten() {
            range("priors", *weight, (0.0..=1e3).contains(weight), "[0, 1000]")?;
        }
        let (channels, outputs) = (blocks[0].bias.len(), blocks[0].output_bias.len());
        range("channels", channels as f64, (1..=most).contains(&channels), "[1, 256]")?;
        range("outputs", outputs as f64, (OUTPUTS + 1..=most).contains(&outputs), "[4, 256]")?;
        let memory = outputs - OUTPUTS;
        let whole = WHOLE + kinds.len() + memory;
        for (t, block) in blocks.iter_mut().enumerate() {
            let expected = [
                ("w1", &mut block.taxel, TAXEL + memory, channels),
                ("g1", &mut block.whole, whole, channels),
                ("b1", &mut block.bias, 1, channels),
                ("dw", &mut block.near, 9, channels),
                ("b2", &mut block.near_bias, 1, channels),
                ("w3", &mut block.output, channels, outputs),
                ("b3", &mut block.output_bias, 1, outputs),
                ("nu", &mut block.noise, 1, whole + 1),
            ];
            for (name, values, inputs, count) in expected {
                let what = format!("blocks.{t}.{name}");
                if values.len() != inputs * count {
                    let found = values.len();
                    return Err(Refusal::new(format!("{what} has {found} numbers, expected {}", inputs * count)));
                }
                if !values.iter().all(|v| v.is_finite()) {
                    return Err(Refusal::new(format!("{what} has a number that is not finite")));
                }
                if name != "nu" {
                    *values = padded(values, count);
                }
            }
            // channels that were added give nothing on
            block.output.resize(channels.next_multiple_of(LANES) * outputs.next_multiple_of(LANES), 0.0);
        }
        let (channels, outputs) = (channels.next_multiple_of(LANES), outputs.next_multiple_of(LANES));
        Ok(Self { widths, kinds, noise_variance, blocks, memory, channels, outputs })
    }

    /// An untrained network for independent taxels. Every block sets what is below zero to zero and solves anew; taxels
    /// above a quarter of a touched one's height count as touched.
    ///
    /// # Errors
    /// [`Refusal`] if the noise is out of range.
    pub fn plain(noise_variance: f64) -> Result<Self, Refusal> {
        let (channels, memory, kinds) = (LANES, 1, vec![[0.0, 0.0, 0.0, 1.0]]);
        let (outputs, whole) = (OUTPUTS + memory, WHOLE + kinds.len() + memory);
        let mut block = UnrolledBlock {
            taxel: vec![0.0; (TAXEL + memory) * channels],
            whole: vec![0.0; whole * channels],
            bias: vec![0.0; channels],
            near: vec![0.0; 9 * channels],
            near_bias: vec![0.0; channels],
            output: vec![0.0; channels * outputs],
            output_bias: vec![0.0, 1.0, 0.0, 0.0],
            noise: vec![0.0; whole + 1],
        };
        // the last block turns its image into odds: the first channel is the image
        let blocks = vec![block.clone(); Self::PLAIN];
        (block.taxel[0], block.near[4 * channels], block.output[OUTPUTS]) = (1.0, 1.0, Self::STEEP);
        block.output_bias[OUTPUTS] = -0.25 * Self::STEEP;
        Self::new([1.0, 4.0], kinds, noise_variance, [blocks, vec![block]].concat())
    }
}

/// A matrix of `cols` columns with columns of zeros up to whole lanes.
fn padded(values: &[f32], cols: usize) -> Vec<f32> {
    let wide = cols.next_multiple_of(LANES);
    let rows = values.chunks_exact(cols);
    rows.flat_map(|row| row.iter().copied().chain(std::iter::repeat_n(0.0, wide - cols))).collect()
}

impl Grid {
    fn new([rows, cols]: [usize; 2], widths: [f64; WIDTHS]) -> Self {
        let near = |size: usize, width: f64| {
            let at = |k: usize| libm::exp(-((k / size).abs_diff(k % size) as f64 / width).powi(2) / 2.0);
            (0..size * size).map(at).map(|v| if v > LEAST { v } else { 0.0 }).collect::<Vec<f64>>()
        };
        let place = |k: usize| {
            let (row, col) = (k / cols, k % cols);
            let from_middle = |at: usize, size: usize| (2 * at + 1).abs_diff(size) as f64 / size as f64;
            let (u, v) = (from_middle(row, rows), from_middle(col, cols));
            let edge = row.min(rows - 1 - row).min(col).min(cols - 1 - col) as f64;
            [u.max(v), u * u + v * v, libm::exp(-edge / 1.5)].map(single)
        };
        let places = (0..rows * cols).map(place).collect();
        let near = widths.map(|width| [near(rows, width), near(cols, width)]);
        let wide = &near[WIDTHS - 1];
        let factors = [factored(&wide[0], rows), factored(&wide[1], cols)];
        let factor_rows = [factors[0].len() / rows, factors[1].len() / cols];
        let near = near.map(|axes| axes.map(|values| values.into_iter().map(single).collect()));
        let spans = [rows, cols].map(|size| {
            let sides = sides(size);
            let of_side =
                |&Side { length, step }: &Side| (0..=size - length).step_by(step).map(move |at| [at, at + length]);
            sides.iter().flat_map(of_side).collect::<Vec<[usize; 2]>>()
        });
        let lengths = spans.each_ref().map(|spans| spans.iter().map(|[first, end]| end - first));
        let [down, along] = lengths.clone();
        let whole = along.len().next_multiple_of(LANES);
        let share = |d: usize, a: usize| EVEN / (d as f32 * a as f32);
        let line = |d: usize| along.clone().map(move |a| share(d, a)).chain(std::iter::repeat(0.0)).take(whole);
        let shares = down.flat_map(line).collect();
        let mut logs =
            lengths.map(|lengths| lengths.map(|length| single(libm::log(length as f64))).collect::<Vec<f32>>());
        logs[1].resize(whole, 0.0);
        Self { rows, cols, near, factors, factor_rows, sides: sides(cols), spans, shares, logs, places }
    }

    fn taxels(&self) -> usize {
        self.rows * self.cols
    }
}

/// Sides of rectangles that fit into `size` taxels.
fn sides(size: usize) -> Vec<Side> {
    let fitting = SIDES.into_iter().filter(|length| *length <= size);
    fitting.map(|length| Side { length, step: (length / 4).max(1) }).collect()
}

/// F with Fᵀ F = `covariance` (`size` × `size`, positive semidefinite), but for eigenvalues below [`LEAST`] of the
/// largest.
fn factored(covariance: &[f64], size: usize) -> Vec<f32> {
    let parts = DMatrix::from_row_slice(size, size, covariance).symmetric_eigen();
    let most = parts.eigenvalues.max();
    let kept = parts.eigenvalues.iter().zip(parts.eigenvectors.column_iter()).filter(|(v, _)| **v > LEAST * most);
    kept.flat_map(|(v, column)| column.iter().map(|x| single(v.sqrt() * x)).collect::<Vec<f32>>()).collect()
}

/// Memory of a decode. Maps have the taxels one after the other; what belongs to the samples has for every taxel one
/// value a sample, and zeros up to whole lanes.
#[derive(Debug, Default)]
struct Scratch {
    /// Φ, M × N, if it has to be scaled; as N × samples, and blurred.
    rows: Vec<f64>,
    phi: Vec<f32>,
    wider: Vec<f32>,
    smooth: Vec<f32>,
    passed: Vec<f32>,
    /// Columns of Φ and of the blurred rows times q, where q is above its floor.
    active: Vec<f32>,
    /// y, and y over a.
    y: Vec<f64>,
    /// Φ G₁ Φᵀ, Φ G₂ Φᵀ and Φ Φᵀ, and what a block expects: samples × samples, upper triangle.
    parts: [Vec<f32>; WIDTHS + 1],
    expected: Vec<f32>,
    sums: Vec<f32>,
    /// L of every kind and e, then S⁻¹ y.
    lower: Vec<f64>,
    solved: Vec<Vec<f64>>,
    length: Vec<f64>,
    share: Vec<f64>,
    rest: Vec<f64>,
    u: Vec<f64>,
    u32: Vec<f32>,
    back: Vec<f32>,
    back_wide: Vec<f32>,
    linear: Vec<f32>,
    /// Sums of Φ over the taxels above and left, and between two rows; samples in single precision.
    integral: Vec<f32>,
    line: Vec<f32>,
    found: Vec<f32>,
    /// The same sums of Φᵀy, and those between two rows.
    integral_y: Vec<f64>,
    line_y: Vec<f64>,
    /// Of the rectangles between two rows: c + .75 |s|²/A, then the heights, then e.
    rectangles: Vec<f32>,
    /// What both maps of the rectangles change by at each row, for every span along the row; and the maps, first as
    /// changes at the corners of rectangles.
    changes: [Vec<f32>; 2],
    maps: [Vec<f64>; 2],
    mean: Vec<f32>,
    /// q₁ less its floor, and q₂.
    alone: Vec<f32>,
    together: Vec<f32>,
    /// x, d, .3 g, l, m, q₁, q₂, rectangles, where and h of every taxel, and the values of the whole image.
    inputs: Vec<f32>,
    whole: Vec<f32>,
    bordered: Vec<f32>,
    mixed: Vec<f32>,
    out: Vec<f32>,
    bias: Vec<f32>,
    image: Vec<f64>,
    touched: Vec<f64>,
    order: Vec<usize>,
}

impl Unrolled {
    /// Most rows, and most columns, of a sheet.
    pub const MOST_SIDE: usize = 2048;
    /// Most taxels of a sheet.
    pub const MOST_TAXELS: usize = 1 << 14;

    /// The network with the numbers that its training has found, on a sheet of `[rows, cols]` taxels.
    ///
    /// # Errors
    /// [`Refusal`] if the sheet has no row or column, or more of them or of taxels than are allowed.
    pub fn new(weights: impl Into<Arc<UnrolledWeights>>, shape: [usize; 2]) -> Result<Self, Refusal> {
        let weights = weights.into();
        for (side, size) in ["rows", "cols"].into_iter().zip(shape) {
            if !(1..=Self::MOST_SIDE).contains(&size) {
                return Err(Refusal::range(side, size as f64, "[1, 2048]"));
            }
        }
        if shape[0] * shape[1] > Self::MOST_TAXELS {
            return Err(Refusal::range("taxels", (shape[0] * shape[1]) as f64, "[1, 16384]"));
        }
        let grid = Arc::new(Grid::new(shape, weights.widths));
        Ok(Self { weights, grid })
    }

    /// N, taxels.
    pub fn taxels(&self) -> usize {
        self.grid.taxels()
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
        image.extend_from_slice(&work.image);
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
        let size = work.scale_rows(a, self.grid.cols)?;
        let y_scale = power_of_two(problem.y());
        divide_into(problem.y(), y_scale, &mut work.y);
        work.image.clear();
        work.image.resize(n, 0.0);
        work.touched.clear();
        work.touched.resize(n, 0.0);
        if size == 0.0 || work.y.iter().all(|y| *y == 0.0) {
            return Ok(Touched { taxels: 0, expected_iou: 0.0 });
        }
        let (height, wide) = self.linear(work);
        self.unroll(work, wide);
        let (taxels, expected_iou) = best_support(&work.touched, &mut work.order);
        agree(&mut work.image, &work.order, taxels);
        for (atom, x) in work.image.iter_mut().enumerate() {
            // two products: the scales lie up to 10^600 apart
            *x = *x * height * y_scale / size;
            if !x.is_finite() {
                return Err(overflow(atom));
            }
        }
        Ok(Touched { taxels, expected_iou })
    }

    /// The linear estimate; y is divided by the height a of a touched taxel, which is returned with b, the number of
    /// taxels that take part.
    fn linear(&self, work: &mut Scratch) -> (f64, f64) {
        let (weights, grid) = (&*self.weights, &*self.grid);
        let (m, n) = (work.y.len(), grid.taxels());
        let lanes = m.next_multiple_of(LANES);
        work.parts.iter_mut().for_each(|part| part.resize(lanes * lanes, 0.0));
        // Φ G Φᵀ: of the narrow Gaussian as (Φ G) Φᵀ, of the wide one as (Φ Fᵀ)(Φ Fᵀ)ᵀ with fewer columns
        smooth(&work.phi, grid, &grid.near[0], lanes, &mut work.passed, &mut work.smooth);
        outer_sums(&work.smooth, &work.phi, lanes, &mut work.parts[0]);
        let [down, along] = grid.factor_rows;
        let passed = sized(&mut work.passed, down * grid.cols * lanes);
        apply(&work.phi, &grid.factors[0], [grid.rows, grid.cols * lanes], passed);
        let reduced = sized(&mut work.smooth, down * along * lanes);
        for (from, to) in passed.chunks_exact(grid.cols * lanes).zip(reduced.chunks_exact_mut(along * lanes)) {
            apply(from, &grid.factors[1], [grid.cols, lanes], to);
        }
        outer_sums(reduced, reduced, lanes, &mut work.parts[1]);
        outer_sums(&work.phi, &work.phi, lanes, &mut work.parts[2]);
        let sums = zeros(&mut work.sums, lanes);
        for column in work.phi.chunks_exact(lanes) {
            sums.iter_mut().zip(column).for_each(|(sum, v)| *sum += v);
        }
        // S of every kind, its evidence and S⁻¹ y
        work.length.clear();
        work.share.clear();
        work.solved.resize(weights.kinds.len(), Vec::new());
        let scale = 1.0 / n as f64;
        for (kind, solved) in weights.kinds.iter().zip(&mut work.solved) {
            let kind = kind.map(|w| w * scale);
            let [narrow, wide, alone] = &work.parts;
            fill_upper(&mut work.lower, m, |i, row| {
                let own = i * lanes + i..i * lanes + m;
                let constant = kind[2] * f64::from(work.sums[i]);
                let parts = narrow[own.clone()].iter().zip(&wide[own.clone()]).zip(&alone[own]).zip(&work.sums[i..]);
                for (value, (((narrow, wide), alone), sum)) in row.iter_mut().zip(parts) {
                    *value = kind[0] * f64::from(*narrow)
                        + kind[1] * f64::from(*wide)
                        + constant * f64::from(*sum)
                        + kind[3] * f64::from(*alone);
                }
                row[0] += weights.noise_variance;
            });
            // the noise keeps it positive definite
            let _ = factor(&mut work.lower, m);
            solved.clear();
            solved.extend_from_slice(&work.y);
            solve_lower(&work.lower, m, solved);
            let length = norm(solved) / (m as f64).sqrt();
            let volume: f64 = (0..m).map(|i| libm::log(work.lower[i * m + i])).sum();
            work.share.push(-(m as f64) * libm::log(length.max(f64::MIN_POSITIVE)) - volume);
            work.length.push(length);
            solve_upper(&work.lower, m, solved);
        }
        let most = work.share.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        work.share.iter_mut().for_each(|share| *share = libm::exp(*share - most));
        let total: f64 = work.share.iter().sum();
        work.share.iter_mut().for_each(|share| *share /= total);
        let logs = work.share.iter().zip(&work.length).map(|(share, s)| share * libm::log(s.max(f64::MIN_POSITIVE)));
        let s = libm::exp(logs.sum());
        // Σ share K Φᵀ S⁻¹ y, part by part
        zeros(&mut work.linear, n);
        work.u.clear();
        work.u.resize(m, 0.0);
        for part in 0..PARTS {
            work.rest.clear();
            work.rest.resize(m, 0.0);
            for ((kind, share), solved) in weights.kinds.iter().zip(&work.share).zip(&work.solved) {
                let w = kind[part] * share * scale;
                work.rest.iter_mut().zip(solved).for_each(|(sum, v)| *sum += w * v);
            }
            singles(work.rest.iter().copied(), lanes, &mut work.u32);
            products(&work.phi, &work.u32, sized(&mut work.back, n));
            match grid.near.get(part) {
                Some(near) => {
                    smooth(&work.back, grid, near, 1, &mut work.passed, &mut work.smooth);
                    work.linear.iter_mut().zip(&work.smooth).for_each(|(l, v)| *l += v);
                }
                None if part == WIDTHS => {
                    let sum: f32 = work.back.iter().sum();
                    work.linear.iter_mut().for_each(|l| *l += sum);
                }
                None => work.linear.iter_mut().zip(&work.back).for_each(|(l, v)| *l += v),
            }
        }
        for (share, solved) in work.share.iter().zip(&work.solved) {
            work.u.iter_mut().zip(solved).for_each(|(sum, v)| *sum += share * v);
        }
        let (mut sum, mut square) = (0.0, 0.0);
        for l in &work.linear {
            let part = (f64::from(l.max(0.0)) / s + 1e-4).powi(2);
            sum += part;
            square += part * part;
        }
        let wide = sum * sum / square;
        let height = s / wide.sqrt();
        work.y.iter_mut().for_each(|y| *y /= height);
        let inverse = single(1.0 / height);
        work.linear.iter_mut().for_each(|l| *l *= inverse);
        (height, wide)
    }

    /// The maps of the rectangles, on a grid with one more column; returned are Σ p e and Σ p ln A.
    fn rectangles(&self, work: &mut Scratch) -> [f64; 2] {
        let grid = &*self.grid;
        let (m, n, wide, width) = (work.y.len(), grid.taxels(), grid.cols + 1, line_width(grid.cols));
        singles(work.y.iter().copied(), m.next_multiple_of(LANES), &mut work.u32);
        let back = sized(&mut work.back_wide, n);
        products(&work.phi, &work.u32, back);
        work.integral_y.clear();
        work.integral_y.resize(wide, 0.0);
        for row in back.chunks_exact(grid.cols) {
            let mut sum = 0.0;
            work.integral_y.push(0.0);
            for v in row {
                sum += f64::from(*v);
                work.integral_y.push(work.integral_y[work.integral_y.len() - wide] + sum);
            }
        }
        let [down, along] = &grid.spans;
        let count = along.len().next_multiple_of(LANES);
        let rectangles = sized(&mut work.rectangles, down.len() * 3 * count);
        let between = sized(&mut work.line, m * width + LONG);
        let found = sized(&mut work.found, grid.sides.len() * grid.cols.next_multiple_of(LANES));
        let c = UNEVEN + single(self.weights.noise_variance);
        let scale = single(1.0 / dot(&work.y, &work.y));
        let mut most = 0.0_f32;
        let own = rectangles.chunks_exact_mut(3 * count).zip(grid.shares.chunks_exact(count));
        for ([top, bottom], (own, shares)) in down.iter().zip(own) {
            let [above, below] = [top, bottom].map(|row| &work.integral[row * m * width..][..m * width]);
            span_squares([above, below], between, width, grid.cols, &grid.sides, found);
            let [above, below] = [top, bottom].map(|row| &work.integral_y[row * wide..][..wide]);
            work.line_y.clear();
            work.line_y.extend(below.iter().zip(above).map(|(below, above)| below - above));
            most = most.max(explain(found, &work.line_y, &grid.sides, shares, [c, scale], own));
        }
        let [changes, heights] = work.changes.each_mut().map(|list| zeros(list, (grid.rows + 1) * count));
        let (mut total, mut explained, mut extent) = (0.0, 0.0, 0.0);
        let [log_down, log_along] = &grid.logs;
        for (([top, bottom], log), own) in down.iter().zip(log_down).zip(work.rectangles.chunks_exact(3 * count)) {
            let [of_changes, of_heights] = [&mut *changes, heights].map(|list| list.split_at_mut(bottom * count));
            let at = top * count..(top + 1) * count;
            let tops = [&mut of_changes.0[at.clone()], &mut of_heights.0[at]];
            let bottoms = [&mut of_changes.1[..count], &mut of_heights.1[..count]];
            let [p, e, ln] = weigh(own, log_along, [most, LEAST_WEIGHT], m, tops, bottoms).map(f64::from);
            total += p;
            explained += e;
            extent += ln + p * f64::from(*log);
        }
        for (map, changes) in work.maps.iter_mut().zip(&work.changes) {
            map.clear();
            map.resize((grid.rows + 1) * wide, 0.0);
            for (map, changes) in map.chunks_exact_mut(wide).zip(changes.chunks_exact(count)) {
                for ([left, right], change) in along.iter().zip(changes) {
                    map[*left] += f64::from(*change);
                    map[*right] -= f64::from(*change);
                }
            }
        }
        for map in &mut work.maps {
            for row in 0..=grid.rows {
                let mut sum = 0.0;
                for at in row * wide..(row + 1) * wide {
                    sum += map[at];
                    map[at] = sum / total + if row > 0 { map[at - wide] } else { 0.0 };
                }
            }
        }
        [explained / total, extent / total]
    }

    /// The blocks from the linear estimate on, and the probabilities.
    fn unroll(&self, work: &mut Scratch, wide: f64) {
        let (weights, grid) = (&*self.weights, &*self.grid);
        let (m, n) = (work.y.len(), grid.taxels());
        let lanes = m.next_multiple_of(LANES);
        let length = (norm(&work.u).powi(2) + 1e-300).sqrt();
        singles(work.u.iter().map(|u| 0.3 * u / length), lanes, &mut work.u32);
        products(&work.phi, &work.u32, sized(&mut work.back, n));
        let width = TAXEL + weights.memory;
        let spread = single((wide / n as f64).sqrt());
        let rectangles = self.rectangles(work);
        let inputs = zeros(&mut work.inputs, n * width).chunks_exact_mut(width);
        for (k, input) in inputs.enumerate() {
            let l = work.linear[k];
            let at = k / grid.cols * (grid.cols + 1) + k % grid.cols;
            let [inside, height] = [0, 1].map(|map: usize| single(work.maps[map][at]));
            input[..9].copy_from_slice(&[l, l, work.back[k], l, l.max(0.0), spread, 0.0, inside, height]);
            input[9..TAXEL].copy_from_slice(&grid.places[k]);
        }
        blurred(&work.phi, grid, lanes, &mut work.passed, &mut work.wider);
        for map in [&mut work.mean, &mut work.alone, &mut work.together] {
            sized(map, n);
        }
        // a border of zeros, which stays
        zeros(&mut work.bordered, (grid.rows + 2) * (grid.cols + 2) * weights.channels);
        let mut left = 1.0;
        let last = weights.blocks.len() - 1;
        for (t, block) in weights.blocks.iter().enumerate() {
            self.block(block, work, wide, left, rectangles);
            let maps = work.mean.iter_mut().zip(&mut work.alone).zip(&mut work.together);
            let taxels = work.inputs.chunks_exact_mut(width).zip(work.out.chunks_exact(weights.outputs));
            for (((mean, alone), together), (input, out)) in maps.zip(taxels) {
                *mean = (input[0].max(0.0) + out[0]).max(0.0);
                *alone = out[1].max(0.0);
                *together = out[2].max(0.0);
                input[TAXEL..].iter_mut().zip(&out[OUTPUTS..]).for_each(|(h, change)| *h += change);
            }
            if t == last {
                break;
            }
            let (slopes, offset) = block.noise.split_at(work.whole.len());
            let log: f32 = slopes.iter().zip(&work.whole).map(|(w, v)| w * v).sum::<f32>() + offset[0];
            let noise = wide * weights.noise_variance * libm::exp(f64::from(log.clamp(-3.0, 3.0)));
            left = self.solve(work, noise);
        }
        work.image.clear();
        work.image.extend(work.mean.iter().map(|v| f64::from(*v)));
        let odds = work.inputs.chunks_exact(width).map(|input| f64::from(input[TAXEL]));
        work.touched.clear();
        work.touched.extend(odds.map(|z| 1.0 / (1.0 + libm::exp(-z))));
    }

    /// The outputs of `block`, and the values of the whole image.
    fn block(&self, block: &UnrolledBlock, work: &mut Scratch, wide: f64, left: f64, rectangles: [f64; 2]) {
        let (weights, grid) = (&*self.weights, &*self.grid);
        let (m, n) = (work.y.len() as f64, grid.taxels());
        let (channels, width) = (weights.channels, TAXEL + weights.memory);
        let (mut most, mut sum, mut square) = (0.0_f64, 0.0, 0.0);
        let whole = &mut work.whole;
        whole.clear();
        whole.resize(WHOLE + weights.kinds.len() + weights.memory, 0.0);
        let (known, memory) = whole.split_at_mut(WHOLE + weights.kinds.len());
        for input in work.inputs.chunks_exact(width) {
            let x = f64::from(input[0].max(0.0));
            most = most.max(x);
            sum += x;
            square += x * x;
            memory.iter_mut().zip(&input[TAXEL..]).for_each(|(mean, h)| *mean += h);
        }
        memory.iter_mut().for_each(|mean| *mean /= n as f32);
        let ratios = [m / n as f64, m / 20.0, wide / 10.0, wide / n as f64].map(|v| single(libm::log(v)));
        let [of_taxels, of_twenty, of_ten, part] = ratios;
        let (before, after) = known.split_at_mut(6);
        let [explained, extent] = rectangles.map(single);
        let limited = [of_taxels.clamp(-3.7, 0.0), of_twenty.clamp(-1.5, 1.7)];
        before.copy_from_slice(&[limited[0], limited[1], of_ten, part, explained, extent - 2.0]);
        let (shares, after) = after.split_at_mut(weights.kinds.len());
        shares.iter_mut().zip(&work.share).for_each(|(value, share)| *value = single(*share));
        let logs = [most + 0.1, square / wide + 0.01, (sum * sum + 0.1) / (square + 0.1) / wide];
        let [peak, energy, count] = logs.map(|v| single(libm::log(v)));
        after.copy_from_slice(&[single(left - 1.0), peak, energy, count]);
        work.bias.clear();
        work.bias.extend_from_slice(&block.bias);
        add_weighted(&block.whole, whole, &mut work.bias);
        let bordered = (grid.cols + 2) * channels;
        let lines = work.bordered.chunks_exact_mut(bordered).skip(1);
        for (inputs, hidden) in work.inputs.chunks_exact(grid.cols * width).zip(lines) {
            let inside = &mut hidden[channels..][..grid.cols * channels];
            affine(inputs, &block.taxel, &work.bias, 0.0, inside);
        }
        let mixed = sized(&mut work.mixed, grid.cols * channels);
        let out = sized(&mut work.out, n * weights.outputs);
        for (row, out) in out.chunks_exact_mut(grid.cols * weights.outputs).enumerate() {
            around(&work.bordered[row * bordered..][..3 * bordered], &block.near, &block.near_bias, mixed);
            affine(mixed, &block.output, &block.output_bias, f32::NEG_INFINITY, out);
        }
    }

    /// What the samples make of the mean and the variances: x, d, g, m, q₁ and q₂ of the next block; returned is r.
    fn solve(&self, work: &mut Scratch, noise: f64) -> f64 {
        let (grid, width) = (&*self.grid, TAXEL + self.weights.memory);
        let (m, n) = (work.y.len(), grid.taxels());
        let lanes = m.next_multiple_of(LANES);
        // Φ q₁² Φᵀ is ΦΦᵀ times the square of the floor and the columns where q₁ is above it
        work.active.clear();
        for (column, q) in work.phi.chunks_exact(lanes).zip(&work.alone).filter(|(_, q)| **q > 0.0) {
            let above = (q * (q + 2.0 * FLOOR)).sqrt();
            work.active.extend(column.iter().map(|v| v * above));
        }
        for (column, q) in work.wider.chunks_exact(lanes).zip(&work.together).filter(|(_, q)| **q > 0.0) {
            work.active.extend(column.iter().map(|v| v * q));
        }
        work.expected.resize(lanes * lanes, 0.0);
        outer_sums(&work.active, &work.active, lanes, &mut work.expected);
        fill_upper(&mut work.lower, m, |i, row| {
            let own = i * lanes + i..i * lanes + m;
            let floor = f64::from(FLOOR * FLOOR);
            for ((value, expected), all) in row.iter_mut().zip(&work.expected[own.clone()]).zip(&work.parts[2][own]) {
                *value = f64::from(*expected) + floor * f64::from(*all);
            }
            row[0] += noise;
        });
        add_weighted(&work.phi, &work.mean, zeros(&mut work.u32, lanes));
        work.rest.clear();
        work.rest.extend(work.y.iter().zip(&work.u32).map(|(y, sum)| y - f64::from(*sum)));
        work.u.clear();
        work.u.extend_from_slice(&work.rest);
        // the noise keeps it positive definite
        let _ = factor(&mut work.lower, m);
        solve_lower(&work.lower, m, &mut work.u);
        solve_upper(&work.lower, m, &mut work.u);
        singles(work.u.iter().copied(), lanes, &mut work.u32);
        products(&work.phi, &work.u32, sized(&mut work.back, n));
        blurred(&work.back, grid, 1, &mut work.passed, &mut work.back_wide);
        work.back_wide.iter_mut().zip(&work.together).for_each(|(v, q)| *v *= q * q);
        blurred(&work.back_wide, grid, 1, &mut work.passed, &mut work.smooth);
        let length = single(0.3 / (norm(&work.u).powi(2) + 1e-20).sqrt());
        for (k, input) in work.inputs.chunks_exact_mut(width).enumerate() {
            let (q1, q2) = (FLOOR + work.alone[k], work.together[k]);
            let (mean, change) = (work.mean[k], q1 * q1 * work.back[k] + work.smooth[k]);
            input[..3].copy_from_slice(&[mean + change, change, work.back[k] * length]);
            input[4..7].copy_from_slice(&[mean, q1, q2]);
        }
        (dot(&work.rest, &work.u).max(0.0) / m as f64 + 1e-6).sqrt()
    }
}

/// `values` (taxels × `lanes`) times the Gaussian `near` along rows and columns.
fn smooth(values: &[f32], grid: &Grid, near: &[Vec<f32>; 2], lanes: usize, passed: &mut Vec<f32>, out: &mut Vec<f32>) {
    let line = grid.cols * lanes;
    let (passed, out) = (sized(passed, values.len()), sized(out, values.len()));
    apply(values, &near[0], [grid.rows, line], passed);
    for (from, to) in passed.chunks_exact(line).zip(out.chunks_exact_mut(line)) {
        if lanes == 1 {
            // the Gaussian is symmetric
            to.fill(0.0);
            add_weighted(&near[1], from, to);
        } else {
            apply(from, &near[1], [grid.cols, lanes], to);
        }
    }
}

/// `values` (taxels × `lanes`) blurred by (1 2 1)/4 along rows and columns; nothing lies beyond the edges.
fn blurred(values: &[f32], grid: &Grid, lanes: usize, passed: &mut Vec<f32>, out: &mut Vec<f32>) {
    let line = grid.cols * lanes;
    let (passed, out) = (sized(passed, values.len()), sized(out, values.len()));
    blur(values, line, passed);
    for (from, to) in passed.chunks_exact(line).zip(out.chunks_exact_mut(line)) {
        blur(from, lanes, to);
    }
}

impl Scratch {
    /// The rows, scaled to a root mean square of 1, as N × samples and as sums over the taxels above and left; returns
    /// what they were divided by, 0 for rows that are all zero.
    ///
    /// # Errors
    /// [`Refusal`] for a NaN or an infinity.
    fn scale_rows(&mut self, a: MatrixView<'_>, cols: usize) -> Result<f64, Refusal> {
        let (m, n, mut values, mut power) = (a.nrows(), a.ncols(), a.values(), 1.0);
        let mut square = dot(values, values);
        if !ORDINARY.contains(&square) {
            power = operator_scale(a)?;
            divide_into(values, power, &mut self.rows);
            values = &self.rows;
            square = dot(values, values);
        }
        let rms = (square / values.len() as f64).sqrt();
        let scale = if rms > 0.0 { 1.0 / rms } else { 0.0 };
        transpose(values, n, scale, zeros(&mut self.phi, n * m.next_multiple_of(LANES)));
        let width = line_width(cols);
        let integral = sized(&mut self.integral, (n / cols + 1) * m * width);
        integral[..m * width].fill(0.0);
        for (i, row) in values.chunks_exact(n).enumerate() {
            for (r, values) in row.chunks_exact(cols).enumerate() {
                let (above, own) = integral.split_at_mut((r + 1) * m * width);
                let (above, own) = (&above[(r * m + i) * width..][..cols + 1], &mut own[i * width..][..cols + 1]);
                let mut sum = 0.0;
                own[0] = 0.0;
                for ((own, above), v) in own[1..].iter_mut().zip(&above[1..]).zip(values) {
                    sum += single(scale * v);
                    *own = above + sum;
                }
            }
        }
        Ok(power * rms)
    }
}

/// Numbers in a row of sums over `cols` taxels: one more, and a lane to read on.
fn line_width(cols: usize) -> usize {
    (cols + 1 + LANES).next_multiple_of(LANES)
}

/// `values` in single precision, with zeros up to `lanes`.
fn singles(values: impl Iterator<Item = f64>, lanes: usize, out: &mut Vec<f32>) {
    out.clear();
    out.extend(values.map(single));
    out.resize(lanes, 0.0);
}

/// `map` with `len` numbers, which are to be written.
fn sized(map: &mut Vec<f32>, len: usize) -> &mut [f32] {
    map.resize(len, 0.0);
    map
}

/// `map` as `len` zeros.
fn zeros(map: &mut Vec<f32>, len: usize) -> &mut [f32] {
    map.clear();
    map.resize(len, 0.0);
    map
}

/// Entries on and above the diagonal of an m × m matrix, of which `row` gives the i-th from the diagonal on.
fn fill_upper(matrix: &mut Vec<f64>, m: usize, mut row: impl FnMut(usize, &mut [f64])) {
    matrix.resize(m * m, 0.0);
    for (i, values) in matrix.chunks_exact_mut(m.max(1)).enumerate() {
        row(i, &mut values[i..]);
    }
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
        let rows = problem.matrix().values().chunks_exact(self.taxels());
        work.rest.clear();
        work.rest.extend(problem.y().iter().zip(rows).map(|(y, row)| y - dot(row, &work.image)));
        let left = norm(&work.rest);
        solution.set_dense(&work.image, 1.0, if left.is_finite() { left } else { f64::MAX })
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checks::says;
    use crate::matrix::Matrix;
    use crate::metrics::support;
    use nalgebra::{DMatrix, DVector};
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

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

    const ROWS: usize = 4;
    const COLS: usize = 5;
    const N: usize = ROWS * COLS;
    const CHANNELS: usize = 11;
    const MEMORY: usize = 3;
    const KINDS: [[f64; 4]; 2] = [[0.4, 0.1, 0.02, 0.5], [0.2, 0.5, 0.1, 0.2]];
    const SD: [f64; 2] = [0.9, 2.5];
    const NOISE: f64 = 0.02;

    /// Blocks of numbers that are drawn.
    fn drawn(rng: &mut ChaCha8Rng, count: usize) -> Vec<UnrolledBlock> {
        let whole = WHOLE + KINDS.len() + MEMORY;
        let mut draw = |rows: usize, cols: usize| -> Vec<f32> {
            let scale = 0.8 / (rows as f32).sqrt();
            (0..rows * cols).map(|_| scale * rng.random_range(-1.0..1.2_f32)).collect()
        };
        let block = |_| UnrolledBlock {
            taxel: draw(TAXEL + MEMORY, CHANNELS),
            whole: draw(whole, CHANNELS),
            bias: draw(1, CHANNELS),
            near: draw(9, CHANNELS),
            near_bias: draw(1, CHANNELS),
            output: draw(CHANNELS, OUTPUTS + MEMORY),
            output_bias: draw(1, OUTPUTS + MEMORY),
            noise: draw(1, whole + 1),
        };
        (0..count).map(block).collect()
    }

    fn matrix(values: &[f32], cols: usize) -> DMatrix<f64> {
        DMatrix::from_row_iterator(values.len() / cols, cols, values.iter().map(|v| f64::from(*v)))
    }

    /// The image before it is made to agree with the support, and the probabilities, as the documentation of
    /// [`Unrolled`] has them: by matrices over all taxels, in double precision.
    fn formula(blocks: &[UnrolledBlock], phi: &DMatrix<f64>, y: &DVector<f64>) -> (DVector<f64>, Vec<f64>) {
        let (m, positive) = (phi.nrows(), |v: &DVector<f64>| v.map(|v| v.max(0.0)));
        let place = |k: usize| [(k / COLS) as f64, (k % COLS) as f64];
        let of_pairs = |f: &dyn Fn(f64, f64) -> f64| {
            DMatrix::from_fn(N, N, |i, j| f(place(i)[0] - place(j)[0], place(i)[1] - place(j)[1]))
        };
        let gaussians = SD.map(|sd| of_pairs(&|r, c| (-(r * r + c * c) / (2.0 * sd * sd)).exp()));
        let tap = |d: f64| {
            if d.abs() < 0.5 {
                0.5
            } else if d.abs() < 1.5 {
                0.25
            } else {
                0.0
            }
        };
        let blur = of_pairs(&|r, c| tap(r) * tap(c));
        let (mut shares, mut lengths, mut solved) = (Vec::new(), Vec::new(), Vec::new());
        let covariances: Vec<DMatrix<f64>> = KINDS
            .iter()
            .map(|w| {
                let same = DMatrix::from_element(N, N, w[2]) + DMatrix::identity(N, N) * w[3];
                (&gaussians[0] * w[0] + &gaussians[1] * w[1] + same) / N as f64
            })
            .collect();
        for k in &covariances {
            let l = (phi * k * phi.transpose() + DMatrix::identity(m, m) * NOISE).cholesky().unwrap();
            let e = l.l().solve_lower_triangular(y).unwrap();
            let length = e.norm() / (m as f64).sqrt();
            let volume: f64 = l.l().diagonal().iter().map(|v| v.ln()).sum();
            shares.push(-(m as f64) * length.ln() - volume);
            lengths.push(length);
            solved.push(l.solve(y));
        }
        let most = shares.iter().copied().fold(f64::MIN, f64::max);
        let total: f64 = shares.iter().map(|s| (s - most).exp()).sum();
        let shares: Vec<f64> = shares.iter().map(|s| (s - most).exp() / total).collect();
        let s = shares.iter().zip(&lengths).map(|(share, l)| share * l.ln()).sum::<f64>().exp();
        let mut linear = DVector::zeros(N);
        let mut u = DVector::zeros(m);
        for ((k, share), own) in covariances.iter().zip(&shares).zip(&solved) {
            linear += k * phi.transpose() * own * *share;
            u += own * *share;
        }
        let q = linear.map(|l: f64| (l.max(0.0) / s + 1e-4).powi(2));
        let wide = q.sum().powi(2) / q.norm_squared();
        let a = s / wide.sqrt();
        let (y, linear) = (y / a, linear / a);
        let (mut inside, mut height) = (DVector::<f64>::zeros(N), DVector::<f64>::zeros(N));
        let (mut total, mut explained, mut extent) = (0.0, 0.0, 0.0);
        for tall in (1..=ROWS).filter(|h| SIDES.contains(h)) {
            for (broad, top, left) in (1..=COLS)
                .filter(|w| SIDES.contains(w))
                .flat_map(|w| (0..=ROWS - tall).flat_map(move |r| (0..=COLS - w).map(move |c| (w, r, c))))
            {
                let of = |k: usize| {
                    let (r, c) = (k / COLS, k % COLS);
                    f64::from((top..top + tall).contains(&r) && (left..left + broad).contains(&c))
                };
                let own = DVector::from_fn(N, |k, _| of(k));
                let (area, s) = ((tall * broad) as f64, phi * &own);
                let product = s.dot(&y).max(0.0);
                let spread = 0.25 + NOISE + 0.75 * s.norm_squared() / area;
                let e = 0.75 / area * product.powi(2) / spread / y.norm_squared();
                let p = (1.0 - e).powf(-0.5 * m as f64) * spread.powf(-0.5);
                total += p;
                explained += p * e;
                extent += p * area.ln();
                height += &own * (p * 0.75 / area * product / spread);
                inside += own * p;
            }
        }
        let (inside, height, explained, extent) = (inside / total, height / total, explained / total, extent / total);
        let (mut x, mut d, mut mean) = (linear.clone(), linear.clone(), positive(&linear));
        let mut g = phi.transpose() * (&u / u.norm());
        let (mut q1, mut q2) = (DVector::from_element(N, (wide / N as f64).sqrt()), DVector::zeros(N));
        let (mut h, mut left) = (DMatrix::zeros(N, MEMORY), 1.0);
        for (t, block) in blocks.iter().enumerate() {
            let now = positive(&x);
            let square = now.norm_squared();
            let mut whole = vec![(m as f64 / N as f64).ln().clamp(-3.7, 0.0), (m as f64 / 20.0).ln().clamp(-1.5, 1.7)];
            whole.extend([(wide / 10.0).ln(), (wide / N as f64).ln(), explained, extent - 2.0]);
            whole.extend(&shares);
            whole.extend([left - 1.0, (now.max() + 0.1).ln(), (square / wide + 0.01).ln()]);
            whole.push(((now.sum().powi(2) + 0.1) / (square + 0.1) / wide).ln());
            whole.extend(h.row_mean().iter());
            let whole = DVector::from_vec(whole);
            let inputs = DMatrix::from_fn(N, TAXEL + MEMORY, |k, f| {
                let [row, col] = place(k);
                let (r, c) = (ROWS as f64, COLS as f64);
                let (v, w) = ((2.0 * row + 1.0 - r).abs() / r, (2.0 * col + 1.0 - c).abs() / c);
                let edge = row.min(r - 1.0 - row).min(col).min(c - 1.0 - col);
                match f {
                    0 => x[k],
                    1 => d[k],
                    2 => 0.3 * g[k],
                    3 => linear[k],
                    4 => mean[k],
                    5 => q1[k],
                    6 => q2[k],
                    7 => inside[k],
                    8 => height[k],
                    9 => v.max(w),
                    10 => v * v + w * w,
                    11 => (-edge / 1.5).exp(),
                    f => h[(k, f - TAXEL)],
                }
            });
            let bias = matrix(&block.whole, CHANNELS).transpose() * &whole + matrix(&block.bias, 1);
            let mut z = inputs * matrix(&block.taxel, CHANNELS);
            z.row_iter_mut().for_each(|mut row| row += bias.transpose());
            let z = z.map(|v| v.max(0.0));
            let (near, after) = (matrix(&block.near, CHANNELS), matrix(&block.near_bias, 1));
            let mixed = DMatrix::from_fn(N, CHANNELS, |k, c| {
                let sum = (0..N).filter_map(|j| {
                    let row = (j / COLS + 1).checked_sub(k / COLS).filter(|row| *row < 3)?;
                    let col = (j % COLS + 1).checked_sub(k % COLS).filter(|col| *col < 3)?;
                    Some(near[(3 * row + col, c)] * z[(j, c)])
                });
                (sum.sum::<f64>() + after[(c, 0)]).max(0.0)
            });
            let mut out = mixed * matrix(&block.output, OUTPUTS + MEMORY);
            let bias = matrix(&block.output_bias, 1).transpose();
            out.row_iter_mut().for_each(|mut row| row += &bias);
            mean = positive(&(&now + out.column(0)));
            h += out.columns(OUTPUTS, MEMORY);
            if t + 1 == blocks.len() {
                break;
            }
            q1 = out.column(1).map(|v| 0.01 + v.max(0.0));
            q2 = out.column(2).map(|v| v.max(0.0));
            let slopes = matrix(&block.noise, 1);
            let log = slopes.rows(0, whole.len()).dot(&whole) + slopes[(whole.len(), 0)];
            let noise = wide * NOISE * log.clamp(-3.0, 3.0).exp();
            let squares = |q: &DVector<f64>| DMatrix::from_diagonal(&q.map(|v| v * v));
            let b = phi * &blur;
            let covariance = phi * squares(&q1) * phi.transpose() + &b * squares(&q2) * b.transpose();
            let rest = &y - phi * &mean;
            u = (covariance + DMatrix::identity(m, m) * noise).cholesky().unwrap().solve(&rest);
            let back = phi.transpose() * &u;
            d = squares(&q1) * &back + &blur * squares(&q2) * b.transpose() * &u;
            (x, g) = (&mean + &d, &back / (u.norm_squared() + 1e-20).sqrt());
            left = (rest.dot(&u).max(0.0) / m as f64 + 1e-6).sqrt();
        }
        (mean * a, h.column(0).iter().map(|z| 1.0 / (1.0 + (-z).exp())).collect())
    }

    /// Single precision leaves 24 bits of numbers near 1 that pass three solves: 1e-3 is a hundred times what they
    /// lose.
    #[test]
    fn the_network_is_its_formula() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for m in [1, 5, 9, 30] {
            let blocks = drawn(&mut rng, 3);
            let phi = DMatrix::from_fn(m, N, |_, _| if rng.random() { 1.0 } else { -1.0 });
            let y = DVector::from_fn(m, |_, _| rng.random_range(-2.0..2.0));
            let (mut expected, touched) = formula(&blocks, &phi, &y);
            let weights = UnrolledWeights::new(SD, KINDS.to_vec(), NOISE, blocks).unwrap();
            let network = Unrolled::new(weights, [ROWS, COLS]).unwrap();
            let rows = Matrix::from(&phi);
            let (mut image, mut probabilities) = (Vec::new(), Vec::new());
            let problem = Problem::new(rows.view(), y.as_slice()).unwrap();
            let found = network.estimate(&problem, &mut Workspace::default(), &mut image, &mut probabilities).unwrap();
            for (p, expected) in probabilities.iter().zip(&touched) {
                assert!((p - expected).abs() < 1e-3, "M = {m}: {p}, expected {expected}");
            }
            let mut order = Vec::new();
            let (count, iou) = best_support(&touched, &mut order);
            assert!((found.expected_iou - iou).abs() < 1e-3);
            // the support is that of the probabilities, so that the image is compared where both agree about it
            if found.taxels == count && expected.max() > 0.0 {
                agree(expected.as_mut_slice(), &order, count);
                let largest = expected.max();
                for (x, expected) in image.iter().zip(expected.iter()) {
                    assert!((x - expected).abs() < 1e-3 * largest, "M = {m}: {x}, expected {expected}");
                }
            }
        }
    }

    /// Rows that are not ±1 are scaled to a root mean square of 1: those of another size give the same image, as large
    /// as y and they say.
    #[test]
    fn the_size_of_rows_and_samples_is_taken_out() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let weights = UnrolledWeights::new(SD, KINDS.to_vec(), NOISE, drawn(&mut rng, 3)).unwrap();
        let network = Unrolled::new(weights, [ROWS, COLS]).unwrap();
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
                assert!(
                    (other - expected).abs() <= 1e-4 * (samples / rows),
                    "{rows:e}, {samples:e}: {other} {expected}"
                );
            }
        }
        assert!(says(&solve(1e-300, 1e300), "the coefficient of atom"));
        assert!(solve(1.0, 0.0).unwrap().iter().all(|x| *x == 0.0));
        assert!(solve(0.0, 1.0).unwrap().iter().all(|x| *x == 0.0));
    }

    /// Numbers that are missing, not finite or out of range are named.
    #[test]
    fn weights_that_do_not_fit_are_refused() {
        let blocks = drawn(&mut ChaCha8Rng::seed_from_u64(6), 2);
        let with = |change: &dyn Fn(&mut UnrolledBlock)| {
            let mut blocks = blocks.clone();
            change(&mut blocks[1]);
            UnrolledWeights::new(SD, KINDS.to_vec(), NOISE, blocks)
        };
        assert!(with(&|_| ()).is_ok());
        assert!(says(&with(&|b| b.near.truncate(9)), "blocks.1.dw has 9 numbers, expected 99"));
        assert!(says(&with(&|b| b.whole[3] = f32::NAN), "blocks.1.g1 has a number that is not finite"));
        assert!(says(&UnrolledWeights::new(SD, KINDS.to_vec(), 0.0, blocks.clone()), "noise_variance"));
        assert!(says(&UnrolledWeights::new(SD, Vec::new(), NOISE, blocks.clone()), "kinds"));
        assert!(says(&UnrolledWeights::new(SD, KINDS.to_vec(), NOISE, Vec::new()), "blocks"));
    }
}
