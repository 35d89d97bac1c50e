//! Reconstructs many small contacts on a large skin.

use crate::checks::{not_finite, other_columns, overflow, shape_mismatch};
use crate::kernels::{axpy, dot, norm};
use crate::operator::{Composition, LinearOperator, SelectColumns};
use spts_input::Refusal;

/// Finds contacts, smooth patches of a few taxels, in measurements y = Φ x + noise of a large image x ≥ 0. It needs
/// only two products with the whole Φ in each round.
///
/// A round correlates the residual with Φ and blobs of several sizes. Places that exceed chance become candidates, with
/// the taxels around them. On the candidates, the image is a sum of small non-negative bumps, found by a non-negative
/// lasso. The next round starts from its support. The method ends when no new place exceeds chance.
/// Based on D. Needell, J. A. Tropp, "CoSaMP", Appl. Comput. Harmon. Anal. 26 (2009) 301, with blobs in place of single
/// columns, the noise level in place of a given sparsity, and x ≥ 0.
///
/// ```
/// use spts_recon::matrix_free::RegionPursuit;
/// use spts_recon::operator::{LinearOperator as _, SignRows};
///
/// // one contact on 20 × 20 taxels, 150 measurements: seven words of 64 signs a row
/// let bits: Vec<u64> = (1..1051_u64).map(|k| (k * k).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29)).collect();
/// let phi = SignRows::new(&bits, 400);
/// let (mut image, mut y) = ([0.0; 400], [0.0; 150]);
/// for (k, pixel) in image.iter_mut().enumerate() {
///     let square = (k as f64 / 20.0).floor() - 8.0;
///     *pixel = (1.0 - (square.powi(2) + ((k % 20) as f64 - 12.0).powi(2)) / 9.0).max(0.0);
/// }
/// phi.apply(&image, &mut y);
/// let found = RegionPursuit::new(20, 20).recover(&phi, &y)?;
/// let distance = image.iter().zip(&found).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
/// assert!(distance < 0.05 * image.iter().map(|a| a * a).sum::<f64>(), "{distance}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RegionPursuit {
    /// Number of rows of the image.
    pub rows: usize,
    /// Number of columns of the image.
    pub cols: usize,
    /// Largest number of rounds; default [`Self::MAX_ROUNDS`].
    pub max_rounds: usize,
}

/// Radii of the blobs that are looked for, taxels.
const RADII_TAXELS: [f64; 4] = [1.0, 1.7, 2.8, 4.0];
/// Standard deviation of the bumps, taxels.
const GRAIN_SD_TAXELS: f64 = 0.6;
/// Taxels around what stands out that become candidates.
const REACH_TAXELS: f64 = 2.3;
/// False detections a round.
const FALSE_ALARMS: f64 = 0.01;
/// Penalty of the lasso, in standard deviations of what chance correlates with a bump.
const PENALTY_SD: f64 = 0.5;
/// Relative duality gap at which a descent stops, and its most iterations.
const DESCENT: (f64, usize) = (1e-5, 120);

impl RegionPursuit {
    /// Default of `max_rounds`.
    pub const MAX_ROUNDS: usize = 20;

    /// A pursuit of contacts with radii of 1 to 4 taxels in images of `rows` × `cols`.
    pub fn new(rows: usize, cols: usize) -> Self {
        Self { rows, cols, max_rounds: Self::MAX_ROUNDS }
    }

    /// Reconstructs the image of `y`, one value ≥ 0 a taxel, row-major.
    ///
    /// # Errors
    /// [`Refusal`] if `y` is not as long as Φ has rows, if Φ has not one column a taxel, for a NaN or an infinity, or
    /// if the image exceeds the range of numbers.
    pub fn recover<A: SelectColumns>(&self, phi: &A, y: &[f64]) -> Result<Vec<f64>, Refusal> {
        check(phi, y)?;
        let taxels = self.rows * self.cols;
        if phi.ncols() != taxels {
            return Err(other_columns(phi.ncols(), taxels));
        }
        // squares of the largest and the smallest numbers there are would not be
        let scale = y.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let scale = if scale.is_normal() { scale } else { 1.0 };
        let y: Vec<f64> = y.iter().map(|v| v / scale).collect();
        let mut search = Search::new(self, phi, &y);
        for _ in 0..self.max_rounds {
            if is_nothing(&search.residual, &y) || !search.look() {
                break;
            }
            search.solve()?;
        }
        let mut image = search.image;
        image.iter_mut().for_each(|v| *v *= scale);
        match image.iter().position(|v| !v.is_finite()) {
            Some(atom) => Err(overflow(atom)),
            None => Ok(image),
        }
    }
}

/// A recovery on its way.
struct Search<'a, A> {
    pursuit: &'a RegionPursuit,
    phi: &'a A,
    y: &'a [f64],
    detector: Detector,
    threshold: f64,
    /// Coefficient of the bump at every place.
    weights: Vec<f64>,
    /// Places that may have a bump.
    candidates: Vec<bool>,
    /// Residual of y.
    residual: Vec<f64>,
    /// Variance that chance gives the correlations of the residual.
    variance: Vec<f64>,
    image: Vec<f64>,
}

impl<'a, A: SelectColumns> Search<'a, A> {
    fn new(pursuit: &'a RegionPursuit, phi: &'a A, y: &'a [f64]) -> Self {
        let taxels = pursuit.rows * pursuit.cols;
        let detector = Detector::new([pursuit.rows, pursuit.cols], &RADII_TAXELS);
        Self {
            pursuit,
            phi,
            y,
            threshold: detector.threshold(FALSE_ALARMS),
            detector,
            weights: vec![0.0; taxels],
            candidates: vec![false; taxels],
            residual: y.to_vec(),
            variance: vec![0.0; taxels],
            image: vec![0.0; taxels],
        }
    }

    /// Looks for contacts in the residual; true when there are new candidates.
    fn look(&mut self) -> bool {
        let mut correlation = vec![0.0; self.weights.len()];
        self.phi.apply_adjoint(&self.residual, &mut correlation);
        self.phi.chance_variance(&self.residual, &mut self.variance);
        let detections = self.detector.detect(&correlation, &self.variance, self.threshold);
        self.grow(&self.strongest(detections))
    }

    /// The detections outside the candidates, the strongest of them if they are too many for the measurements to tell
    /// apart.
    fn strongest(&self, detections: Vec<Detection>) -> Vec<usize> {
        let mut new: Vec<Detection> = detections.into_iter().filter(|d| !self.candidates[d.place]).collect();
        new.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.place.cmp(&b.place)));
        new.truncate((self.y.len() / 8).max(1));
        new.iter().map(|d| d.place).collect()
    }

    /// Makes the support and the `new` places, with what is around them, the candidates. True when a place was not one
    /// before.
    fn grow(&mut self, new: &[usize]) -> bool {
        let shape = (self.pursuit.rows, self.pursuit.cols);
        let before = std::mem::replace(&mut self.candidates, vec![false; self.weights.len()]);
        let largest = self.weights.iter().copied().fold(0.0, f64::max);
        let support: Vec<usize> = (0..self.weights.len()).filter(|&k| self.weights[k] > 1e-3 * largest).collect();
        for marked in [&support[..], new] {
            dilate(shape, marked, REACH_TAXELS, &mut self.candidates);
        }
        !new.is_empty() && self.candidates.iter().zip(&before).any(|(now, before)| *now && !before)
    }

    /// The image on the candidates.
    fn solve(&mut self) -> Result<(), Refusal> {
        let places: Vec<usize> = (0..self.candidates.len()).filter(|&k| self.candidates[k]).collect();
        let grains = Grains::new((self.pursuit.rows, self.pursuit.cols), places, GRAIN_SD_TAXELS);
        let columns = self.phi.select_columns(grains.taxels());
        let mut x: Vec<f64> = grains.places().iter().map(|&k| self.weights[k]).collect();
        NnFista {
            penalty: PENALTY_SD * self.chance_sd(grains.taxels()) * Grains::length(GRAIN_SD_TAXELS),
            tol: DESCENT.0,
            max_iter: DESCENT.1,
        }
        .descend(&Composition::new(&columns, &grains), self.y, &mut x)?;

        self.weights.fill(0.0);
        grains.places().iter().zip(&x).for_each(|(&k, x)| self.weights[k] = *x);
        let mut part = vec![0.0; grains.taxels().len()];
        grains.apply(&x, &mut part);
        self.image.fill(0.0);
        grains.taxels().iter().zip(&part).for_each(|(&k, v)| self.image[k] = *v);
        self.residual.copy_from_slice(self.y);
        subtract(&columns, &part, &mut self.residual);
        Ok(())
    }

    /// Standard deviation of what the residual, were it noise, would correlate with a taxel; the root mean square over
    /// `taxels`.
    fn chance_sd(&self, taxels: &[usize]) -> f64 {
        let sum: f64 = taxels.iter().map(|&k| self.variance[k]).sum();
        (sum / taxels.len().max(1) as f64).sqrt()
    }
}

/// Matched filters: blobs at every place.
struct Detector {
    shape: [usize; 2],
    blobs: Vec<Vec<f64>>,
}

/// A place, and how far its correlation stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Detection {
    place: usize,
    /// Value in standard deviations of what chance gives.
    score: f64,
}

impl Detector {
    /// Filters for [`cap`]s of these radii in images of this shape.
    fn new(shape: [usize; 2], radii_taxels: &[f64]) -> Self {
        let blobs = radii_taxels.iter().map(|radius| cap(*radius)).collect();
        Self { shape, blobs }
    }

    /// Number of places and blobs.
    fn filters(&self) -> usize {
        self.blobs.len() * self.taxels()
    }

    fn taxels(&self) -> usize {
        self.shape[0] * self.shape[1]
    }

    /// Score that chance reaches `false_alarms` times in all places and blobs together: the z of a normal tail,
    /// P(Z > z) ≤ e^(−z²/2)/2.
    fn threshold(&self, false_alarms: f64) -> f64 {
        (2.0 * (0.5 * self.filters() as f64 / false_alarms).ln()).max(0.0).sqrt()
    }

    /// Places whose best blob scores more than `threshold`, in increasing order. `correlation` is Φᵀ r of a residual,
    /// `variance` what chance gives its entries
    /// ([`SelectColumns::chance_variance`](crate::operator::SelectColumns::chance_variance)).
    fn detect(&self, correlation: &[f64], variance: &[f64], threshold: f64) -> Vec<Detection> {
        let taxels = self.taxels().max(1);
        let (mut scores, mut variances) = (vec![0.0; self.filters()], vec![0.0; self.filters()]);
        let outputs = scores.chunks_exact_mut(taxels).zip(variances.chunks_exact_mut(taxels));
        for (blob, (scores, variances)) in self.blobs.iter().zip(outputs) {
            let squares: Vec<f64> = blob.iter().map(|v| v * v).collect();
            correlate(self.shape, correlation, blob, scores);
            correlate(self.shape, variance, &squares, variances);
        }
        let largest = variances.iter().copied().fold(0.0, f64::max);
        let mut best = vec![0.0_f64; self.taxels()];
        for (scores, variances) in scores.chunks_exact(taxels).zip(variances.chunks_exact(taxels)) {
            for (best, (score, variance)) in best.iter_mut().zip(scores.iter().zip(variances)) {
                // where the edge leaves next to nothing of a blob, or a wire next to nothing of the residual
                if *variance > ROUNDING * largest {
                    *best = best.max(score / variance.sqrt());
                }
            }
        }
        let above = best.iter().enumerate().filter(|(_, score)| **score > threshold);
        above.map(|(place, &score)| Detection { place, score }).collect()
    }
}

/// Variance over the largest one below which a score says nothing.
const ROUNDING: f64 = 1e-10;

/// Half an ellipsoid of unit height, √(1 − d²/(`radius_taxels` + ½)²), as a square image: the pressure under a ball. It
/// extends by the radius, rounded up to whole taxels, to each side of its middle.
#[expect(clippy::cast_possible_truncation, reason = "a radius is a few taxels")]
fn cap(radius_taxels: f64) -> Vec<f64> {
    let reach = radius_taxels.ceil() as usize;
    let side = 2 * reach + 1;
    let off = |i: usize| i as f64 - reach as f64;
    let height = |k: usize| {
        let square = off(k / side).powi(2) + off(k % side).powi(2);
        (1.0 - square / (radius_taxels + 0.5).powi(2)).max(0.0).sqrt()
    };
    (0..side * side).map(height).collect()
}

/// Writes the product of `image` with the square `blob` around every place. Outside the image there is nothing.
fn correlate([rows, cols]: [usize; 2], image: &[f64], blob: &[f64], out: &mut [f64]) {
    let side = blob.len().isqrt();
    let reach = side / 2;
    out.fill(0.0);
    for (r, out) in out.chunks_exact_mut(cols.max(1)).enumerate() {
        for (i, shares) in blob.chunks_exact(side).enumerate() {
            let Some(row) = (r + i).checked_sub(reach).filter(|row| *row < rows) else {
                continue;
            };
            let row = &image[row * cols..(row + 1) * cols];
            for (j, &share) in shares.iter().enumerate().filter(|(_, share)| **share != 0.0) {
                let [to, from] = [reach.saturating_sub(j).min(cols), j.saturating_sub(reach).min(cols)];
                axpy(share, &row[from..], &mut out[to..]);
            }
        }
    }
}

/// Adds every place within `reach` taxels of one that is `marked`; with a reach of 2.5, the 21 places of a rounded
/// square.
fn dilate((rows, cols): (usize, usize), marked: &[usize], reach: f64, out: &mut [bool]) {
    #[expect(clippy::cast_possible_truncation, reason = "a reach is a few taxels")]
    let side = reach.max(0.0).floor() as isize;
    let near = |dr: isize, dc: isize| (dr * dr + dc * dc) as f64 <= reach * reach;
    for &place in marked {
        let (r, c) = (place / cols, place % cols);
        for (dr, dc) in (-side..=side).flat_map(|dr| (-side..=side).map(move |dc| (dr, dc))) {
            if let (Some(r), Some(c)) = (r.checked_add_signed(dr), c.checked_add_signed(dc))
                && r < rows
                && c < cols
                && near(dr, dc)
            {
                out[r * cols + c] = true;
            }
        }
    }
}

/// Length of a residual beyond which it counts as nothing: rounding of the measurements.
fn is_nothing(residual: &[f64], y: &[f64]) -> bool {
    norm(residual) <= 1e-12 * norm(y)
}

/// Bumps reach this many standard deviations: e^−4.5 of the peak.
const REACH_SD: f64 = 3.0;

/// Dictionary of one bump, a Gaussian of unit sum, at some places of an image; its rows are the taxels that the bumps
/// touch.
#[derive(Debug)]
struct Grains {
    /// Places, increasing.
    places: Vec<usize>,
    /// Taxels covered by a bump, in increasing order.
    taxels: Vec<usize>,
    /// For every place, the rows of its taxels and the bump's value there.
    entries: Vec<Vec<(usize, f64)>>,
}

impl Grains {
    /// Bumps with the standard deviation `sd_taxels` ≥ 0 at `places`, in increasing order, of an image of `rows` ×
    /// `cols`. With 0, a bump is a taxel.
    fn new((rows, cols): (usize, usize), places: Vec<usize>, sd_taxels: f64) -> Self {
        let bump = bump(sd_taxels);
        let around = |place: usize| {
            let (r, c) = (place / cols, place % cols);
            let inside = move |&(dr, dc, v): &(isize, isize, f64)| {
                let (r, c) = (r.checked_add_signed(dr)?, c.checked_add_signed(dc)?);
                (r < rows && c < cols).then_some((r * cols + c, v))
            };
            bump.iter().filter_map(inside)
        };
        let mut touched = vec![false; rows * cols];
        places.iter().flat_map(|p| around(*p)).for_each(|(taxel, _)| touched[taxel] = true);
        let taxels: Vec<usize> = (0..rows * cols).filter(|k| touched[*k]).collect();
        let mut row_of = vec![0; rows * cols];
        taxels.iter().enumerate().for_each(|(row, taxel)| row_of[*taxel] = row);
        let entries = places.iter().map(|p| around(*p).map(|(taxel, v)| (row_of[taxel], v)).collect()).collect();
        Self { places, taxels, entries }
    }

    /// Places of the columns.
    fn places(&self) -> &[usize] {
        &self.places
    }

    /// Taxels of the rows.
    fn taxels(&self) -> &[usize] {
        &self.taxels
    }

    /// Length of a bump that no edge cuts.
    fn length(sd_taxels: f64) -> f64 {
        bump(sd_taxels).iter().map(|(_, _, v)| v * v).sum::<f64>().sqrt()
    }
}

/// Offsets and values of a bump of unit sum.
fn bump(sd_taxels: f64) -> Vec<(isize, isize, f64)> {
    #[expect(clippy::cast_possible_truncation, reason = "a bump is a few taxels wide")]
    let reach = (REACH_SD * sd_taxels).floor() as isize;
    let height = |d: isize| match d {
        0 => 1.0,
        _ => (-0.5 * (d as f64 / sd_taxels).powi(2)).exp(),
    };
    let line = || -reach..=reach;
    let mut bump: Vec<_> = line().flat_map(|r| line().map(move |c| (r, c, height(r) * height(c)))).collect();
    let sum: f64 = bump.iter().map(|(_, _, v)| v).sum();
    bump.iter_mut().for_each(|(_, _, v)| *v /= sum);
    bump
}

impl LinearOperator for Grains {
    fn nrows(&self) -> usize {
        self.taxels.len()
    }

    fn ncols(&self) -> usize {
        self.places.len()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        for (entries, x) in self.entries.iter().zip(x) {
            entries.iter().for_each(|&(row, v)| y[row] += v * x);
        }
    }

    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
        for (entries, x) in self.entries.iter().zip(x) {
            *x = entries.iter().map(|&(row, v)| v * y[row]).sum();
        }
    }
}

/// Iterations between two looks at the duality gap, which costs half an iteration.
const BETWEEN_LOOKS: usize = 8;

/// Largest number of times that a step is halved: 2⁻⁶⁰ of the first guess.
const HALVINGS: usize = 60;

/// min ½ ‖y − A x‖² + λ Σ x subject to x ≥ 0, with products of A alone: one with A and one with Aᵀ an iteration.
///
/// The step is found by halving, so that nothing has to be known of A; the momentum starts anew whenever it points
/// uphill. Stops when the duality gap is `tol` of ½ ‖y‖².
/// Source: A. Beck, M. Teboulle, SIAM J. Imaging Sci. 2 (2009) 183; B. O'Donoghue, E. Candès, Found. Comput. Math. 15
/// (2015) 715.
#[derive(Debug, Clone, Copy, PartialEq)]
struct NnFista {
    /// λ, in units of y·A. Range (0, ∞); at 0 the duality gap says nothing.
    penalty: f64,
    /// Duality gap over ½ ‖y‖². Range (0, 1].
    tol: f64,
    /// Largest number of iterations.
    max_iter: usize,
}

/// Where the descent is.
struct State {
    x: Vec<f64>,
    /// A x.
    ax: Vec<f64>,
}

impl State {
    fn at(a: &impl LinearOperator, x: Vec<f64>) -> Self {
        let mut ax = vec![0.0; a.nrows()];
        a.apply(&x, &mut ax);
        Self { x, ax }
    }

    /// `self` + `momentum` · (`self` − `before`): linear, so that no product is needed.
    fn beyond(&self, before: &Self, momentum: f64) -> Self {
        let beyond =
            |now: &[f64], before: &[f64]| now.iter().zip(before).map(|(n, b)| n + momentum * (n - b)).collect();
        Self { x: beyond(&self.x, &before.x), ax: beyond(&self.ax, &before.ax) }
    }

    /// Aᵀ (y − A x).
    fn slope(&self, a: &impl LinearOperator, y: &[f64]) -> Vec<f64> {
        let residual: Vec<f64> = y.iter().zip(&self.ax).map(|(y, v)| y - v).collect();
        let mut slope = vec![0.0; a.ncols()];
        a.apply_adjoint(&residual, &mut slope);
        slope
    }
}

impl NnFista {
    /// Moves `x` from where it starts to the minimiser, as near as `tol` and `max_iter` allow; entries below 0 start at
    /// 0. Whether the gap came to `tol`.
    ///
    /// # Errors
    /// [`Refusal`] when `y` is not as long as A has rows, or for a NaN or an infinity.
    ///
    /// # Panics
    /// When `x` is not as long as A has columns.
    fn descend(&self, a: &impl LinearOperator, y: &[f64], x: &mut [f64]) -> Result<bool, Refusal> {
        check(a, y)?;
        assert_eq!(x.len(), a.ncols(), "a start for every column");
        let mut now = State::at(a, x.iter().map(|v| v.max(0.0)).collect());
        let mut ahead = State { x: now.x.clone(), ax: now.ax.clone() };
        let (mut curvature, mut pace) = (first_curvature(a, y), 1.0_f64);
        let mut converged = false;
        for iteration in 0..=self.max_iter {
            if iteration.is_multiple_of(BETWEEN_LOOKS) || iteration == self.max_iter {
                converged = self.gap(&now, &now.slope(a, y), y) <= self.tol;
            }
            if converged || iteration == self.max_iter {
                break;
            }
            let slope = ahead.slope(a, y);
            let next = self.step(a, &ahead, &slope, &mut curvature);
            // uphill: the gradient of the step and the way that was gone point alike
            let uphill: f64 = (ahead.x.iter().zip(&next.x).zip(&now.x))
                .map(|((ahead, next), now)| (ahead - next) * (next - now))
                .sum();
            let faster = if uphill > 0.0 { 1.0 } else { 0.5 * (1.0 + (1.0 + 4.0 * pace * pace).sqrt()) };
            let momentum = if uphill > 0.0 { 0.0 } else { (pace - 1.0) / faster };
            pace = faster;
            ahead = next.beyond(&now, momentum);
            now = next;
        }
        x.copy_from_slice(&now.x);
        Ok(converged)
    }

    /// max(0, x + (slope − λ)/L) with L doubled until ‖A Δ‖² ≤ L ‖Δ‖².
    fn step(&self, a: &impl LinearOperator, from: &State, slope: &[f64], curvature: &mut f64) -> State {
        let mut halvings = 0;
        loop {
            let moved = |(x, s): (&f64, &f64)| (x + (s - self.penalty) / *curvature).max(0.0);
            let next = State::at(a, from.x.iter().zip(slope).map(moved).collect());
            let square =
                |now: &[f64], before: &[f64]| -> f64 { now.iter().zip(before).map(|(n, b)| (n - b).powi(2)).sum() };
            if halvings == HALVINGS || square(&next.ax, &from.ax) <= *curvature * square(&next.x, &from.x) {
                return next;
            }
            *curvature *= 2.0;
            halvings += 1;
        }
    }

    /// Primal minus dual objective over ½ ‖y‖², with the residual, shrunk until it is feasible, as the dual point.
    fn gap(&self, now: &State, slope: &[f64], y: &[f64]) -> f64 {
        let whole = 0.5 * dot(y, y);
        if whole <= 0.0 {
            return 0.0;
        }
        let steepest = slope.iter().copied().fold(0.0, f64::max);
        let shrink = if steepest > self.penalty { self.penalty / steepest } else { 1.0 };
        let residual: Vec<f64> = y.iter().zip(&now.ax).map(|(y, v)| y - v).collect();
        let rest: f64 = y.iter().zip(&residual).map(|(y, r)| (y - shrink * r).powi(2)).sum();
        let primal = 0.5 * dot(&residual, &residual) + self.penalty * now.x.iter().sum::<f64>();
        ((primal - (whole - 0.5 * rest)) / whole).max(0.0)
    }
}

/// ‖A g‖² / ‖g‖² along the first gradient g = Aᵀ y: not above the largest curvature, and of its order.
fn first_curvature(a: &impl LinearOperator, y: &[f64]) -> f64 {
    let (mut gradient, mut image) = (vec![0.0; a.ncols()], vec![0.0; a.nrows()]);
    a.apply_adjoint(y, &mut gradient);
    a.apply(&gradient, &mut image);
    let curvature = dot(&image, &image) / dot(&gradient, &gradient);
    if curvature.is_normal() { curvature } else { 1.0 }
}

/// Shapes and values that a recovery can work with.
fn check(a: &impl LinearOperator, y: &[f64]) -> Result<(), Refusal> {
    if y.len() != a.nrows() {
        return Err(shape_mismatch(a.nrows(), y.len()));
    }
    match y.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(not_finite(index, y[index])),
        None => Ok(()),
    }
}

/// y −= A x.
fn subtract(a: &impl LinearOperator, x: &[f64], y: &mut [f64]) {
    let mut image = vec![0.0; y.len()];
    a.apply(x, &mut image);
    axpy(-1.0, &image, y);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checks::says;
    use crate::matrix::Matrix;
    use crate::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
    use crate::operator::{SignRows, check_operator};
    use crate::problem::{Problem, Recover as _, Workspace};
    use crate::recover::{NnLasso, Penalty};
    use proptest::prelude::*;
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;

    const SIDE: usize = 60;

    /// Caps at places that do not touch.
    fn scene(places: &[(usize, usize, f64)]) -> Vec<f64> {
        let mut image = vec![0.0; SIDE * SIDE];
        places.iter().for_each(|&(r, c, peak)| place(&mut image, SIDE, 2.0, (r, c), peak));
        image
    }

    /// Adds a [`cap`] of height `peak` with its middle at a row and a column; parts outside are cut off.
    fn place(image: &mut [f64], cols: usize, radius: f64, (r, c): (usize, usize), peak: f64) {
        let blob = cap(radius);
        let side = blob.len().isqrt();
        for (k, v) in image.iter_mut().enumerate() {
            let [i, j] = [(k / cols + side / 2).wrapping_sub(r), (k % cols + side / 2).wrapping_sub(c)];
            if i < side && j < side {
                *v += peak * blob[i * side + j];
            }
        }
    }

    fn bits(m: usize, rng: &mut ChaCha8Rng) -> Vec<u64> {
        (0..m * (SIDE * SIDE).div_ceil(64)).map(|_| rng.random()).collect()
    }

    fn iou(image: &[f64], truth: &[f64]) -> f64 {
        let (mut found, mut mask) = (Vec::new(), Vec::new());
        support(image, SUPPORT_THRESHOLD, &mut found);
        support(truth, SUPPORT_THRESHOLD, &mut mask);
        SupportScore::new(&found, &mask).iou
    }

    /// The outermost taxels of a cap have 0.45 of its peak: 0.36 and more of the largest peak here, well above the
    /// support's threshold of 0.23.
    const PLACES: [(usize, usize, f64); 4] = [(5, 50, 1.0), (20, 9, 0.85), (40, 30, 0.9), (59, 0, 0.8)];

    /// Four contacts, 3600 taxels, 8 % of them measured with 5 % noise: far above what 16 unknowns need. The bound on
    /// the mean over draws of rows and noise is the IoU that large skins are asked for.
    #[test]
    fn contacts_are_found_on_one_wire_and_on_several() {
        const DRAWS: usize = 8;
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let truth = scene(&PLACES);
        let words = (SIDE * SIDE).div_ceil(64);
        // three wires, each for a third of the taxels
        let mut masks = vec![0_u64; 3 * words];
        (0..SIDE * SIDE).for_each(|k| masks[3 * k / (SIDE * SIDE) * words + k / 64] |= 1 << (k % 64));
        let wires: Vec<u16> = (0..288).map(|r| r / 96).collect();
        let (mut one, mut several) = (0.0, 0.0);
        for _ in 0..DRAWS {
            let bits = bits(288, &mut rng);
            let phi = SignRows::new(&bits, SIDE * SIDE);
            for (phi, sum) in [(phi, &mut one), (phi.on_wires(&wires, &masks), &mut several)] {
                let mut y = vec![0.0; 288];
                phi.apply(&truth, &mut y);
                let sd = 0.05 * norm(&truth);
                // uniform noise of that deviation
                y.iter_mut().for_each(|v| *v += sd * 3_f64.sqrt() * rng.random_range(-1.0..1.0));
                *sum += iou(&RegionPursuit::new(SIDE, SIDE).recover(&phi, &y).unwrap(), &truth) / DRAWS as f64;
            }
        }
        assert!(one >= 0.8 && several >= 0.8, "IoU {one} on one wire, {several} on three");
    }

    #[test]
    fn extremes_are_images_or_errors() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let words = bits(200, &mut rng);
        let phi = SignRows::new(&words, SIDE * SIDE);
        let pursuit = RegionPursuit { max_rounds: 3, ..RegionPursuit::new(SIDE, SIDE) };
        let nothing = pursuit.recover(&phi, &[0.0; 200]).unwrap();
        assert!(nothing.iter().all(|v| *v == 0.0));
        let truth = scene(&PLACES);
        for scale in [1e-300, 1e300] {
            let mut y = vec![0.0; 200];
            phi.apply(&truth, &mut y);
            y.iter_mut().for_each(|v| *v *= scale);
            let image = pursuit.recover(&phi, &y).unwrap();
            let (iou, positive) = (iou(&image, &truth), image.iter().all(|v| v.is_finite() && *v >= 0.0));
            assert!(iou > 0.8 && positive, "scale {scale:e}: IoU {iou}");
        }
        let mut y = vec![1.0; 200];
        y[7] = f64::INFINITY;
        assert!(says(&pursuit.recover(&phi, &y), "`y[7]`"));
        assert!(says(&pursuit.recover(&phi, &[1.0; 3]), "rows but `y` has 3 entries"));
        let other = RegionPursuit::new(SIDE, 2);
        assert!(says(&other.recover(&phi, &[1.0; 200]), "the method was built for 120"));
        let words = bits(1, &mut rng);
        let single = SignRows::new(&words, SIDE * SIDE);
        assert!(pursuit.recover(&single, &[1.0]).unwrap().iter().all(|v| v.is_finite()));
    }

    #[test]
    fn a_blob_is_found_where_it_is() {
        let detector = Detector::new([12, 9], &[1.0, 3.0]);
        // in the middle, and cut off by a corner
        for (r, c) in [(4, 5), (0, 8)] {
            let mut image = vec![0.0; 12 * 9];
            place(&mut image, 9, 3.0, (r, c), 2.0);
            let found = detector.detect(&image, &[1.0; 108], 0.5);
            let best = found.iter().max_by(|a, b| a.score.total_cmp(&b.score)).unwrap();
            // the score of the blob itself is its length, times 2
            assert_eq!(best.place, r * 9 + c);
            assert!((best.score - norm(&image)).abs() < 1e-9, "{} against {}", best.score, norm(&image));
        }
    }

    #[test]
    fn chance_stays_below_the_threshold() {
        let detector = Detector::new([100, 100], &[0.0]);
        // P(Z > z) = 1e-2/1e4: z = 4.75; the bound is above it
        let z = detector.threshold(0.01);
        assert!((4.75..5.2).contains(&z), "{z}");
    }

    #[test]
    fn dilation_is_round() {
        let mut out = vec![false; 49];
        dilate((7, 7), &[24], 2.5, &mut out);
        assert_eq!(out.iter().filter(|v| **v).count(), 21);
        let mut out = vec![false; 49];
        dilate((7, 7), &[0], 1.0, &mut out);
        assert_eq!(out.iter().filter(|v| **v).count(), 3);
    }

    #[test]
    fn bumps_have_unit_sum_and_are_cut_at_the_edges() {
        let grains = Grains::new((5, 6), vec![0, 14], 0.6);
        check_operator(&grains);
        // one taxel of reach: 4 taxels in the corner, 9 inside
        assert_eq!(grains.taxels(), [0, 1, 6, 7, 8, 9, 13, 14, 15, 19, 20, 21]);
        let mut image = vec![0.0; 12];
        grains.apply(&[0.0, 1.0], &mut image);
        assert!((image.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        let single = Grains::new((5, 6), vec![3], 0.0);
        assert_eq!((single.taxels(), single.nrows()), (&[3][..], 1));
        assert!((Grains::length(0.0) - 1.0).abs() < 1e-15);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        /// Against coordinate descent with Newton steps on the active set.
        #[test]
        fn it_is_the_non_negative_lasso(values in prop::collection::vec(-1.0..1.0, 12 * 20), y in prop::collection::vec(-1.0..1.0, 12)) {
            let a = Matrix::from_rows(12, 20, values).unwrap();
            // the other program's penalty is a measurement's share
            let penalty = 0.05;
            let fista = NnFista { penalty, tol: 1e-12, max_iter: 200_000 };
            let mut x = vec![0.0; 20];
            prop_assert!(fista.descend(&a, &y, &mut x).unwrap());
            let problem = Problem::new(a.view(), &y).unwrap();
            let lasso = NnLasso::new(Penalty::Absolute(penalty / 12.0)).unwrap();
            let solution = lasso.recover(&problem, &mut Workspace::default()).unwrap();
            let objective = |x: &[f64]| {
                let mut r = y.clone();
                subtract(&a, x, &mut r);
                0.5 * dot(&r, &r) + penalty * x.iter().sum::<f64>()
            };
            let mut exact = vec![0.0; 20];
            solution.scatter(&mut exact);
            // the gaps of both: 1e-12 and 1e-9 of ½ ‖y‖² ≤ 6
            prop_assert!((objective(&x) - objective(&exact)).abs() <= 1e-8, "{} against {}", objective(&x), objective(&exact));
        }
    }
}
