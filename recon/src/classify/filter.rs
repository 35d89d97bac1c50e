//! Evidence of all components, measurement by measurement, with the components as SIMD lanes.
//!
//! For one component, y = s·(Φ t + Φ F z + e) with z ~ N(0, I) and e ~ N(0, v I). The filter for the row f = (Φ F)ₘ is:
//! w = P f, q = v + fᵀ w, gain g = w/q, innovation ε = yₘ − fᵀ ẑ, ẑ += g ε, P −= w gᵀ. The innovations are independent,
//! so ln |C| = Σ ln q and ỹᵀỹ = Σ ε²/q hold exactly. P, q, g and the same filter applied to Φ t do not depend on the
//! samples and are computed before they arrive.
//! Source: B. Anderson, J. Moore, *Optimal Filtering* (1979), §5.3 and §10.1 (innovations and likelihood).

use crate::amplitude::{AmplitudeRange, Marginals};
use crate::checks::{measurement, other_length, within};
use crate::kernels::ln;
use multiversion::multiversion;
use spts_input::Refusal;

/// Sizes shared by everything that belongs to one classifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shape {
    /// Number of blocks of [`LANES`] components.
    pub(super) blocks: usize,
    /// Number of deformations of a component.
    pub(super) rank: usize,
}

impl Shape {
    /// Components, rounded up to whole blocks.
    pub(super) fn lanes(self) -> usize {
        self.blocks * LANES
    }

    /// Numbers in a projected row: block after block, the means and then every deformation of its lanes.
    pub(super) fn row(self) -> usize {
        self.lanes() * (1 + self.rank)
    }

    /// Place in a projected row of component `lane`: 0 is its mean, k + 1 its deformation k.
    pub(super) fn column(self, lane: usize, part: usize) -> usize {
        (lane / LANES * (1 + self.rank) + part) * LANES + lane % LANES
    }
}

/// Largest value of a projected row; squares and their sums stay finite.
const LARGEST_ROW: f64 = 1e12;

/// Everything about the rows of a window that can be computed before a sample is there. [`Preparation::clear`] removes
/// the rows and keeps the memory.
#[derive(Debug, Clone)]
pub struct Preparation {
    shape: Shape,
    noise: Vec<f64>,
    rows: usize,
    /// For every row: the row itself, gains, innovations of Φ t, 1/q.
    projected: Vec<f64>,
    gains: Vec<f64>,
    innovations: Vec<f64>,
    precisions: Vec<f64>,
    /// For every row, after it: t̃ᵀt̃ and ln |C|, without the amplitude.
    squares: Vec<f64>,
    log_determinants: Vec<f64>,
    /// P of all lanes, and the filtered state of Φ t, after the last row.
    covariance: Vec<f64>,
    state: Vec<f64>,
}

impl Preparation {
    pub(super) fn new(shape: Shape, noise: &[f64]) -> Self {
        let mut out = Self {
            shape,
            noise: noise.to_vec(),
            rows: 0,
            projected: Vec::new(),
            gains: Vec::new(),
            innovations: Vec::new(),
            precisions: Vec::new(),
            squares: Vec::new(),
            log_determinants: Vec::new(),
            covariance: vec![0.0; shape.rank * shape.rank * shape.lanes()],
            state: vec![0.0; shape.rank * shape.lanes()],
        };
        out.clear();
        out
    }

    /// Removes all rows, for a new window.
    pub fn clear(&mut self) {
        let rank = self.shape.rank;
        self.rows = 0;
        self.state.fill(0.0);
        self.covariance.fill(0.0);
        for block in self.covariance.chunks_exact_mut((rank * rank).max(1) * LANES) {
            for k in 0..rank {
                block[(k * rank + k) * LANES..][..LANES].fill(1.0);
            }
        }
    }

    /// Number of rows prepared for the window so far.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Prepares the next measurement of the window, taken with the weights φ of the taxels. `row` is
    /// φᵀ·[bank](super::EvidenceClassifier::bank): one number for each column of the bank.
    ///
    /// # Errors
    /// [`Refusal`] if the length differs from the bank's number of columns, or a value is not finite or beyond
    /// ±1e12.
    pub fn push(&mut self, row: &[f64]) -> Result<(), Refusal> {
        if row.len() != self.shape.row() {
            return Err(other_length("row", row.len(), self.shape.row()));
        }
        // without a branch a value, which would keep the check from running in SIMD lanes
        if !row.iter().fold(true, |fine, v| fine & (v.abs() <= LARGEST_ROW)) {
            for &v in row {
                within("row", v, -LARGEST_ROW, LARGEST_ROW)?;
            }
        }
        self.grow();
        let (n, lanes) = (self.rows, self.shape.lanes());
        self.projected[n * row.len()..][..row.len()].copy_from_slice(row);
        let gains = self.shape.rank * lanes;
        prepare(
            self.shape.rank,
            &self.noise,
            row,
            &mut self.covariance,
            &mut self.state,
            &mut self.gains[n * gains..][..gains],
            &mut self.innovations[n * lanes..][..lanes],
            &mut self.precisions[n * lanes..][..lanes],
        );
        self.accumulate();
        self.rows += 1;
        Ok(())
    }

    /// Makes room for one more row.
    fn grow(&mut self) {
        let (rows, Shape { rank, .. }, lanes) = (self.rows + 1, self.shape, self.shape.lanes());
        for (values, each) in [
            (&mut self.projected, self.shape.row()),
            (&mut self.gains, rank * lanes),
            (&mut self.innovations, lanes),
            (&mut self.precisions, lanes),
            (&mut self.squares, lanes),
            (&mut self.log_determinants, lanes),
        ] {
            if values.len() < rows * each {
                values.resize(rows * each, 0.0);
            }
        }
    }

    /// Sums over all rows up to this one.
    fn accumulate(&mut self) {
        let lanes = self.shape.lanes();
        let now = self.rows * lanes;
        for sums in [&mut self.squares, &mut self.log_determinants] {
            if self.rows == 0 {
                sums[..lanes].fill(0.0);
            } else {
                sums.copy_within(now - lanes..now, now);
            }
        }
        let this = now..now + lanes;
        accumulate(
            &self.innovations[this.clone()],
            &self.precisions[this.clone()],
            &mut self.squares[this.clone()],
            &mut self.log_determinants[this],
        );
    }

    /// ln |C| of every component over the first `rows` rows, without the amplitude; empty before the first, where it is
    /// 0.
    pub(super) fn log_determinants(&self, rows: usize) -> &[f64] {
        let lanes = self.shape.lanes();
        rows.checked_sub(1).map_or(&[], |last| &self.log_determinants[last * lanes..][..lanes])
    }
}

/// What the samples of a window say so far about each class: sums that every sample updates, and from which the
/// classifier computes the probabilities of the classes.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    shape: Shape,
    count: usize,
    yy: Vec<f64>,
    yt: Vec<f64>,
    state: Vec<f64>,
    /// Log evidence of every outcome from earlier windows.
    pub(super) carried: Vec<f64>,
}

impl Evidence {
    pub(super) fn new(shape: Shape, outcomes: usize) -> Self {
        Self {
            shape,
            count: 0,
            yy: vec![0.0; shape.lanes()],
            yt: vec![0.0; shape.lanes()],
            state: vec![0.0; shape.rank * shape.lanes()],
            carried: vec![0.0; outcomes],
        }
    }

    /// Number of samples of this window.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Removes all evidence, including that of earlier windows.
    pub fn clear(&mut self) {
        self.carried.fill(0.0);
        self.begin_window();
    }

    pub(super) fn begin_window(&mut self) {
        self.count = 0;
        for values in [&mut self.yy, &mut self.yt, &mut self.state] {
            values.fill(0.0);
        }
    }

    /// Takes the next sample `y` into account, in the units of the templates times the amplitude. Samples come in the
    /// order of the rows in `preparation`: the k-th call belongs to the k-th prepared row. The cost is one step of a
    /// Kalman filter for each class.
    ///
    /// # Errors
    /// [`Refusal`] if `y` is not finite or beyond ±1e80, its row has not been prepared, or the preparation
    /// belongs to another classifier. The evidence is then unchanged.
    pub fn observe(&mut self, preparation: &Preparation, y: f64) -> Result<(), Refusal> {
        let (n, lanes) = (self.count, self.shape.lanes());
        if preparation.shape != self.shape {
            return Err(other_length("preparation", preparation.shape.row(), self.shape.row()));
        }
        if n >= preparation.rows {
            return Err(Refusal::new(format!(
                "measurement {index} arrived, but only {prepared} rows are prepared",
                index = n,
                prepared = preparation.rows
            )));
        }
        let y = measurement(y)?;
        let (row, gains) = (self.shape.row(), self.shape.rank * lanes);
        observe(
            self.shape.rank,
            y,
            &preparation.projected[n * row..][..row],
            &preparation.gains[n * gains..][..gains],
            &preparation.innovations[n * lanes..][..lanes],
            &preparation.precisions[n * lanes..][..lanes],
            &mut self.state,
            &mut self.yy,
            &mut self.yt,
        );
        self.count += 1;
        Ok(())
    }

    /// Integrates the amplitudes of all components out.
    pub(super) fn marginalise(&self, preparation: &Preparation, range: AmplitudeRange, marginals: &mut Marginals) {
        let lanes = self.shape.lanes();
        let last = self.count.checked_sub(1).map(|last| last * lanes);
        // before the first sample all sums are zero, these too
        let squares = last.map_or(&*self.yy, |at| &preparation.squares[at..at + lanes]);
        marginals.compute(range, self.count as f64, &self.yy, &self.yt, squares);
    }
}

/// Components side by side in a block.
pub(super) const LANES: usize = 4;

type Lanes = [f64; LANES];

/// `sum` += a·b, lane by lane.
#[inline(always)]
fn add_product(sum: &mut Lanes, a: &Lanes, b: &Lanes) {
    for ((s, a), b) in sum.iter_mut().zip(a).zip(b) {
        *s += a * b;
    }
}

/// `sum` −= a·b, lane by lane.
#[inline(always)]
fn subtract_product(sum: &mut Lanes, a: &Lanes, b: &Lanes) {
    for ((s, a), b) in sum.iter_mut().zip(a).zip(b) {
        *s -= a * b;
    }
}

#[inline(always)]
fn product(a: &Lanes, b: &Lanes) -> Lanes {
    std::array::from_fn(|l| a[l] * b[l])
}

/// Gains g = P f/q of one block with the covariance lowered by them; returns 1/q.
#[inline(always)]
fn gain(noise: &Lanes, factors: &[Lanes], covariance: &mut [Lanes], gains: &mut [Lanes]) -> Lanes {
    let rank = factors.len().max(1);
    let mut variance = *noise;
    for ((w, row), f) in gains.iter_mut().zip(covariance.chunks_exact(rank)).zip(factors) {
        let mut sum = [0.0; LANES];
        for (p, f) in row.iter().zip(factors) {
            add_product(&mut sum, p, f);
        }
        *w = sum;
        add_product(&mut variance, &sum, f);
    }
    // rounding must not take q below the noise
    let precision: Lanes = std::array::from_fn(|l| 1.0 / variance[l].max(noise[l]));
    for (i, row) in covariance.chunks_exact_mut(rank).enumerate() {
        let scaled = product(&gains[i], &precision);
        for (p, w) in row.iter_mut().zip(&*gains) {
            subtract_product(p, &scaled, w);
        }
    }
    for w in gains {
        *w = product(w, &precision);
    }
    precision
}

/// Innovation ε = `value` − fᵀ ẑ of one block; the state ẑ moves on by g ε.
#[inline(always)]
fn innovate(value: &Lanes, factors: &[Lanes], gains: &[Lanes], state: &mut [Lanes]) -> Lanes {
    let mut innovation = *value;
    for (f, z) in factors.iter().zip(&*state) {
        subtract_product(&mut innovation, f, z);
    }
    for (g, z) in gains.iter().zip(state) {
        add_product(z, g, &innovation);
    }
    innovation
}

/// One row for all components: lowers `covariance`, moves the `state` of Φ t, and writes the gains, the innovations of
/// Φ t and 1/q. `row` and all other slices go block by block.
#[expect(clippy::too_many_arguments, reason = "the arrays of one step")]
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn prepare(
    rank: usize,
    noise: &[f64],
    row: &[f64],
    covariance: &mut [f64],
    state: &mut [f64],
    gains: &mut [f64],
    innovations: &mut [f64],
    precisions: &mut [f64],
) {
    let row = row.as_chunks::<LANES>().0.chunks_exact(1 + rank);
    let noise = noise.as_chunks::<LANES>().0.iter();
    let outputs = innovations.as_chunks_mut::<LANES>().0.iter_mut();
    let outputs = outputs.zip(precisions.as_chunks_mut::<LANES>().0);
    let (covariance, state) = (covariance.as_chunks_mut::<LANES>().0, state.as_chunks_mut::<LANES>().0);
    let gains = gains.as_chunks_mut::<LANES>().0;
    for (b, ((row, noise), (innovation, precision))) in row.zip(noise).zip(outputs).enumerate() {
        let Some((mean, factors)) = row.split_first() else {
            return;
        };
        let of_block = b * rank..(b + 1) * rank;
        let covariance = &mut covariance[b * rank * rank..(b + 1) * rank * rank];
        let gains = &mut gains[of_block.clone()];
        *precision = gain(noise, factors, covariance, gains);
        *innovation = innovate(mean, factors, gains, &mut state[of_block]);
    }
}

/// One sample for all components: moves the `state` of y and adds to ỹᵀỹ and ỹᵀt̃.
#[expect(clippy::too_many_arguments, reason = "the arrays of one step")]
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn observe(
    rank: usize,
    y: f64,
    row: &[f64],
    gains: &[f64],
    innovations: &[f64],
    precisions: &[f64],
    state: &mut [f64],
    yy: &mut [f64],
    yt: &mut [f64],
) {
    let row = row.as_chunks::<LANES>().0.chunks_exact(1 + rank);
    let templates = innovations.as_chunks::<LANES>().0.iter();
    let templates = templates.zip(precisions.as_chunks::<LANES>().0);
    let sums = yy.as_chunks_mut::<LANES>().0.iter_mut();
    let sums = sums.zip(yt.as_chunks_mut::<LANES>().0);
    let (gains, state) = (gains.as_chunks::<LANES>().0, state.as_chunks_mut::<LANES>().0);
    for (b, ((row, (template, precision)), (yy, yt))) in row.zip(templates).zip(sums).enumerate() {
        let of_block = b * rank..(b + 1) * rank;
        let e = innovate(&[y; LANES], &row[1..], &gains[of_block.clone()], &mut state[of_block]);
        let scaled = product(&e, precision);
        add_product(yy, &e, &scaled);
        add_product(yt, template, &scaled);
    }
}

/// Adds a row's ε²/q and ln q to their sums.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn accumulate(innovations: &[f64], precisions: &[f64], squares: &mut [f64], log_determinants: &mut [f64]) {
    let sums = squares.iter_mut().zip(log_determinants);
    for ((e, p), (square, log_determinant)) in innovations.iter().zip(precisions).zip(sums) {
        *square += e * e * p;
        *log_determinant -= ln(*p);
    }
}
