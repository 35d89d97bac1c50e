//! Evidence of all components at once, measurement by measurement, with the components as SIMD lanes.
//!
//! For one component, y = s·(Φ t + Φ F z + e) with z ~ N(0, I), e ~ N(0, v I), is filtered with the row f = (Φ F)ₘ:
//! w = P f, q = v + fᵀ w, gain g = w/q, innovation ε = yₘ − fᵀ ẑ, ẑ += g ε, P −= w gᵀ. The innovations are independent, so that
//! ln |C| = Σ ln q and ỹᵀỹ = Σ ε²/q, exactly. P, q and g do not depend on the samples, and neither does the same filter run on Φ t:
//! they are prepared before the samples arrive.
//! Source: B. Anderson, J. Moore, *Optimal Filtering* (1979), §5.3 and §10.1 (innovations and likelihood).

use super::component::EvidenceError;
use crate::amplitude::Moments;
use crate::checks::{measurement, within};
use multiversion::multiversion;

/// Sizes shared by everything that belongs to one classifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shape {
    /// Number of components, rounded up to whole SIMD registers.
    pub(super) lanes: usize,
    /// Deformations of a component.
    pub(super) rank: usize,
}

impl Shape {
    /// Numbers in a projected row: means, then every deformation, of all lanes.
    pub(super) fn row(self) -> usize {
        self.lanes * (1 + self.rank)
    }
}

/// Largest value of a projected row; squares and their sums stay finite.
const LARGEST_ROW: f64 = 1e12;

/// A product of variances is turned into its logarithm before it leaves the range of an `f64`.
const LARGEST_PRODUCT: f64 = 1e150;

/// Everything about the rows of a window that needs no sample. Memory is reused after [`Preparation::clear`].
#[derive(Debug, Clone)]
pub struct Preparation {
    shape: Shape,
    noise: Vec<f64>,
    rows: usize,
    /// Per row: the row itself, gains, innovations of Φ t, 1/q.
    projected: Vec<f64>,
    gains: Vec<f64>,
    innovations: Vec<f64>,
    precisions: Vec<f64>,
    /// Per row, after it: t̃ᵀt̃, Π q as mantissa and logarithm, filtered state of Φ t.
    squares: Vec<f64>,
    products: Vec<f64>,
    logarithms: Vec<f64>,
    states: Vec<f64>,
    /// P of all lanes, after the last row.
    covariance: Vec<f64>,
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
            products: Vec::new(),
            logarithms: Vec::new(),
            states: Vec::new(),
            covariance: vec![0.0; shape.rank * shape.rank * shape.lanes],
        };
        out.clear();
        out
    }

    /// Forgets all rows: a new window begins.
    pub fn clear(&mut self) {
        let Shape { lanes, rank } = self.shape;
        self.rows = 0;
        self.covariance.fill(0.0);
        for k in 0..rank {
            self.covariance[(k * rank + k) * lanes..][..lanes].fill(1.0);
        }
    }

    /// Number of rows prepared.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Prepares for a measurement with the weights φ; `row` is φᵀ·[bank](super::EvidenceClassifier::bank).
    ///
    /// # Errors
    /// [`EvidenceError`] when the length differs from the bank's number of columns, or a value is beyond ±1e12 or not finite.
    pub fn push(&mut self, row: &[f64]) -> Result<(), EvidenceError> {
        let Shape { lanes, rank } = self.shape;
        if row.len() != self.shape.row() {
            return Err(EvidenceError::Shape {
                what: "row",
                len: row.len(),
                expected: self.shape.row(),
            });
        }
        if let Some(&bad) = row.iter().find(|v| v.is_nan() || v.abs() > LARGEST_ROW) {
            within("row", bad, -LARGEST_ROW, LARGEST_ROW)?;
        }
        let n = self.rows;
        self.projected.resize((n + 1) * row.len(), 0.0);
        self.projected[n * row.len()..].copy_from_slice(row);
        for of_states in [&mut self.gains, &mut self.states] {
            of_states.resize((n + 1) * rank * lanes, 0.0);
        }
        for of_lanes in [
            &mut self.innovations,
            &mut self.precisions,
            &mut self.squares,
            &mut self.products,
            &mut self.logarithms,
        ] {
            of_lanes.resize((n + 1) * lanes, 0.0);
        }
        if n == 0 {
            self.states.fill(0.0);
            self.squares.fill(0.0);
            self.products.fill(1.0);
            self.logarithms.fill(0.0);
        } else {
            self.states
                .copy_within((n - 1) * rank * lanes..n * rank * lanes, n * rank * lanes);
            for sums in [&mut self.squares, &mut self.products, &mut self.logarithms] {
                sums.copy_within((n - 1) * lanes..n * lanes, n * lanes);
            }
        }
        gain(
            lanes,
            &self.projected[n * row.len() + lanes..],
            &self.noise,
            &mut self.covariance,
            &mut self.gains[n * rank * lanes..],
            &mut self.precisions[n * lanes..],
            &mut self.products[n * lanes..],
        );
        filter(
            lanes,
            &self.projected[n * row.len()..],
            &self.gains[n * rank * lanes..],
            &mut self.states[n * rank * lanes..],
            &mut self.innovations[n * lanes..],
        );
        self.accumulate(n);
        self.rows += 1;
        Ok(())
    }

    fn accumulate(&mut self, n: usize) {
        let lanes = n * self.shape.lanes..(n + 1) * self.shape.lanes;
        let innovations = self.innovations[lanes.clone()]
            .iter()
            .zip(&self.precisions[lanes.clone()]);
        for (sum, (e, p)) in self.squares[lanes.clone()].iter_mut().zip(innovations) {
            *sum += e * e * p;
        }
        let logarithms = self.logarithms[lanes.clone()].iter_mut();
        for (product, logarithm) in self.products[lanes].iter_mut().zip(logarithms) {
            if !(1.0 / LARGEST_PRODUCT..LARGEST_PRODUCT).contains(product) {
                *logarithm += product.ln();
                *product = 1.0;
            }
        }
    }

    /// ln |C| of component `lane` over the first `rows` rows, without the amplitude.
    pub(super) fn log_determinant(&self, lane: usize, rows: usize) -> f64 {
        rows.checked_sub(1).map_or(0.0, |last| {
            let at = last * self.shape.lanes + lane;
            self.logarithms[at] + self.products[at].ln()
        })
    }

    /// Filtered deformations of Φ t after `rows` rows, `rank × lanes`; empty before the first.
    pub(super) fn state(&self, rows: usize) -> &[f64] {
        let size = self.shape.rank * self.shape.lanes;
        rows.checked_sub(1)
            .map_or(&[], |last| &self.states[last * size..][..size])
    }
}

/// What the samples of a window said so far.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    shape: Shape,
    count: usize,
    yy: Vec<f64>,
    yt: Vec<f64>,
    state: Vec<f64>,
    innovation: Vec<f64>,
    /// Log evidence of every outcome from windows before this one.
    pub(super) carried: Vec<f64>,
}

impl Evidence {
    pub(super) fn new(shape: Shape, outcomes: usize) -> Self {
        Self {
            shape,
            count: 0,
            yy: vec![0.0; shape.lanes],
            yt: vec![0.0; shape.lanes],
            state: vec![0.0; shape.rank * shape.lanes],
            innovation: vec![0.0; shape.lanes],
            carried: vec![0.0; outcomes],
        }
    }

    /// Number of samples of this window.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Forgets everything, earlier windows included.
    pub fn clear(&mut self) {
        self.carried.fill(0.0);
        self.begin_window();
    }

    pub(super) fn begin_window(&mut self) {
        self.count = 0;
        for values in [&mut self.yy, &mut self.yt, &mut self.state, &mut self.innovation] {
            values.fill(0.0);
        }
    }

    /// Takes the next sample `y` of the window whose rows are in `preparation`.
    ///
    /// # Errors
    /// [`EvidenceError`] when `y` is not finite or beyond ±1e80, its row has not been prepared, or the preparation is another classifier's.
    /// The evidence is then as before.
    pub fn observe(&mut self, preparation: &Preparation, y: f64) -> Result<(), EvidenceError> {
        let (Shape { lanes, rank }, n) = (self.shape, self.count);
        if preparation.shape != self.shape {
            return Err(EvidenceError::Shape {
                what: "preparation",
                len: preparation.shape.row(),
                expected: self.shape.row(),
            });
        }
        if n >= preparation.rows {
            return Err(EvidenceError::NotPrepared {
                index: n,
                prepared: preparation.rows,
            });
        }
        let y = measurement(y)?;
        self.innovation.fill(y);
        innovate(
            lanes,
            &preparation.projected[n * self.shape.row() + lanes..],
            &preparation.gains[n * rank * lanes..],
            &mut self.state,
            &mut self.innovation,
        );
        let prepared = preparation.innovations[n * lanes..]
            .iter()
            .zip(&preparation.precisions[n * lanes..]);
        let sums = self.yy.iter_mut().zip(self.yt.iter_mut());
        for (((yy, yt), e), (t, precision)) in sums.zip(&self.innovation).zip(prepared) {
            let scaled = e * precision;
            *yy += e * scaled;
            *yt += t * scaled;
        }
        self.count += 1;
        Ok(())
    }

    /// What the evidence of component `lane` depends on.
    #[expect(clippy::cast_precision_loss, reason = "windows stay far below 2^52 samples")]
    pub(super) fn moments(&self, preparation: &Preparation, lane: usize) -> Moments {
        let tt = self
            .count
            .checked_sub(1)
            .map_or(0.0, |last| preparation.squares[last * self.shape.lanes + lane]);
        Moments {
            count: self.count as f64,
            yy: self.yy[lane],
            yt: self.yt[lane],
            tt,
        }
    }

    /// Filtered deformations of the samples, `rank × lanes`.
    pub(super) fn state(&self) -> &[f64] {
        &self.state
    }
}

/// Gains and variances of one row; lowers the covariance and multiplies the products by q.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn gain(
    lanes: usize,
    factors: &[f64],
    noise: &[f64],
    covariance: &mut [f64],
    gains: &mut [f64],
    precisions: &mut [f64],
    products: &mut [f64],
) {
    let rank = factors.len() / lanes;
    precisions[..lanes].copy_from_slice(noise);
    for ((w, row), f) in gains
        .chunks_exact_mut(lanes)
        .zip(covariance.chunks_exact(rank.max(1) * lanes))
        .zip(factors.chunks_exact(lanes))
    {
        w.fill(0.0);
        for (p, f) in row.chunks_exact(lanes).zip(factors.chunks_exact(lanes)) {
            for ((w, p), f) in w.iter_mut().zip(p).zip(f) {
                *w += p * f;
            }
        }
        for ((q, w), f) in precisions.iter_mut().zip(&*w).zip(f) {
            *q += w * f;
        }
    }
    for ((q, product), least) in precisions.iter_mut().zip(products).zip(noise) {
        // rounding must not take q below the noise
        let variance = q.max(*least);
        *product *= variance;
        *q = 1.0 / variance;
    }
    for (i, row) in covariance.chunks_exact_mut(rank.max(1) * lanes).enumerate() {
        let wi = &gains[i * lanes..][..lanes];
        for (p, wj) in row.chunks_exact_mut(lanes).zip(gains.chunks_exact(lanes)) {
            for (((p, wi), wj), precision) in p.iter_mut().zip(wi).zip(wj).zip(&*precisions) {
                *p -= wi * wj * precision;
            }
        }
    }
    for w in gains.chunks_exact_mut(lanes).take(rank) {
        for (w, precision) in w.iter_mut().zip(&*precisions) {
            *w *= precision;
        }
    }
}

/// Filters Φ t, the first lanes of `row`, with the gains of the row.
fn filter(lanes: usize, row: &[f64], gains: &[f64], state: &mut [f64], innovation: &mut [f64]) {
    let (means, factors) = row.split_at(lanes);
    innovation.copy_from_slice(means);
    innovate(lanes, factors, gains, state, innovation);
}

/// `innovation` −= fᵀ ẑ, then ẑ += g·innovation.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn innovate(lanes: usize, factors: &[f64], gains: &[f64], state: &mut [f64], innovation: &mut [f64]) {
    for (f, z) in factors.chunks_exact(lanes).zip(state.chunks_exact(lanes)) {
        for ((e, f), z) in innovation.iter_mut().zip(f).zip(z) {
            *e -= f * z;
        }
    }
    for (g, z) in gains.chunks_exact(lanes).zip(state.chunks_exact_mut(lanes)) {
        for ((z, g), e) in z.iter_mut().zip(g).zip(&*innovation) {
            *z += g * e;
        }
    }
}
