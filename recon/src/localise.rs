//! Localisation of contacts.
//!
//! ```
//! use spts_recon::localise::{Localiser, centre_of_mass};
//!
//! // of an image: 2 × 3 taxels, threshold 0.23 of the largest
//! assert_eq!(centre_of_mass(&[0.0, 1.0, 1.0, 0.0, 1.0, 1.0], 3, 0.23), Some([0.5, 1.5]));
//!
//! // of the measurements themselves: one taxel of 4 × 4 is pressed, and every row of weights marks one taxel
//! let localiser = Localiser::new([4, 4])?;
//! let (mut evidence, mut projected) = (localiser.evidence(), Vec::new());
//! for taxel in 0..16 {
//!     let mut weights = [0.0; 16];
//!     weights[taxel] = 1.0;
//!     localiser.project(&weights, &mut projected)?;
//!     evidence.observe(&projected, if taxel == 6 { 2.0 } else { 0.0 })?;
//! }
//! let [row, col] = localiser.estimate(&mut evidence).position_px;
//! assert!((row - 1.0).abs() < 0.5 && (col - 2.0).abs() < 0.5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::amplitude::Moments;
use crate::checks::{measurement, within};
use multiversion::multiversion;
use spts_input::Refusal;

/// Centre of mass of an image, as (row, col) in taxels: Σ vᵢ rᵢ / Σ vᵢ over the positive values above `threshold` ·
/// max. `None` if there are none. The threshold keeps noise from shifting the centre.
///
/// ```
/// use spts_recon::localise::{centre_of_mass, distance};
///
/// let image = [0.1, 0.0, 0.0, 0.0, 2.0, 2.0]; // 2 rows, 3 columns, noise in a corner
/// let centre = centre_of_mass(&image, 3, 0.23).expect("a contact");
/// assert!(distance(centre, [1.0, 1.5]) < 1e-12);
/// ```
pub fn centre_of_mass(image: &[f64], cols: usize, threshold: f64) -> Option<[f64; 2]> {
    let max = image.iter().copied().fold(0.0_f64, f64::max);
    let floor = (threshold * max).max(0.0);
    let (mut sum, mut row, mut col) = (0.0, 0.0, 0.0);
    for (i, &v) in image.iter().enumerate().filter(|(_, v)| **v > floor) {
        sum += v;
        row += v * (i / cols) as f64;
        col += v * (i % cols) as f64;
    }
    (sum > 0.0).then(|| [row / sum, col / sum])
}

/// Euclidean distance between two positions, in taxels.
pub fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Spacing of the centres, taxels. Centres extend from the first taxel's centre to the last one's.
const STEP_PX: f64 = 0.25;
/// Widths w of blobs, taxels: those of a ball.
pub const WIDTHS_PX: [f64; 4] = [0.5, 0.7, 0.9, 1.2];
/// Standard deviation of a measurement's noise relative to s·‖b‖. It also covers everything that a blob does not
/// describe.
const NOISE: f64 = 0.35;

/// Profiles of all centres along one axis: a blob is the product of a row's and a column's profile.
#[derive(Debug, Clone)]
struct Axis {
    centres: Vec<f64>,
    /// One row for every centre, one column for every taxel.
    profiles: Vec<f64>,
    /// The same transposed.
    transposed: Vec<f64>,
    /// Σ of the squares of each profile.
    squares: Vec<f64>,
}

impl Axis {
    #[expect(clippy::cast_possible_truncation, reason = "counts and coordinates of a grid")]
    fn new(taxels: usize, width: f64) -> Self {
        // the little more keeps a last centre that rounding would lose
        let count = ((taxels - 1) as f64 / STEP_PX + 1e-9) as usize + 1;
        let centres: Vec<f64> = (0..count).map(|k| k as f64 * STEP_PX).collect();
        let value = |c: f64, i: usize| (-(i as f64 - c).powi(2) / (2.0 * width * width)).exp();
        let profile = |c: f64| (0..taxels).map(move |i| value(c, i));
        Self {
            profiles: centres.iter().flat_map(|&c| profile(c)).collect(),
            transposed: (0..taxels).flat_map(|i| centres.iter().map(move |&c| value(c, i))).collect(),
            squares: centres.iter().map(|&c| profile(c).map(|v| v * v).sum()).collect(),
            centres,
        }
    }
}

/// Blobs of one width.
#[derive(Debug, Clone)]
struct Width {
    width: f64,
    rows: Axis,
    cols: Axis,
}

/// Finds the centre of a small round contact in the samples of a window. It compares them with Gaussian blobs at all
/// centres of a grid and in several widths, [`WIDTHS_PX`], which are numbered by width, then row, then column. Blobs
/// are x = s·b, bᵢ = exp(−|pᵢ − c|²/2w²), with centre c and width w; a measurement is y = s·(φᵀb + e), e ~ N(0,
/// σ²‖b‖²).
#[derive(Debug, Clone)]
pub struct Localiser {
    rows: usize,
    cols: usize,
    widths: Vec<Width>,
    /// Variance of a measurement at amplitude 1 for every template, and its logarithm.
    variances: Vec<f64>,
    log_variances: Vec<f64>,
    /// Variance of a uniform distribution over one step of the centres, taxels².
    cell: f64,
}

/// Where a contact is, how uncertain its place is, and the strength and width of the blob that fits best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Posterior mean of the centre, (row, col), taxels.
    pub position_px: [f64; 2],
    /// Posterior covariance of the centre, taxels².
    pub covariance_px2: [[f64; 2]; 2],
    /// Least-squares amplitude of the most probable blob, φᵀb·y / ‖φᵀb‖², in units of y; 0 without a signal.
    pub amplitude: f64,
    /// Width of the most probable blob, taxels.
    pub width_px: f64,
}

/// What the samples of a window say so far about where the skin is touched: for every blob (a centre and a width) of a
/// [`Localiser`], the sums from which [`Localiser::estimate`] computes how well that blob explains all samples. Made
/// empty by [`Localiser::evidence`]; [`BlobEvidence::observe`] adds a sample.
#[derive(Debug, Clone, PartialEq)]
pub struct BlobEvidence {
    count: f64,
    yy: f64,
    yt: Vec<f64>,
    tt: Vec<f64>,
    weights: Vec<f64>,
}

impl Localiser {
    /// Blobs on a sheet of rows × columns, each in [1, 10000].
    ///
    /// # Errors
    /// [`Refusal`] if a number is out of range.
    pub fn new([rows, cols]: [usize; 2]) -> Result<Self, Refusal> {
        within("rows", rows as f64, 1.0, 1e4)?;
        within("cols", cols as f64, 1.0, 1e4)?;
        let mut widths = Vec::new();
        let mut variances = Vec::new();
        for width in WIDTHS_PX {
            let [rows, cols] = [rows, cols].map(|taxels| Axis::new(taxels, width));
            let squares = rows.squares.iter().flat_map(|r| cols.squares.iter().map(move |c| r * c));
            variances.extend(squares.map(|s| NOISE.powi(2) * s));
            widths.push(Width { width, rows, cols });
        }
        Ok(Self {
            rows,
            cols,
            widths,
            log_variances: variances.iter().map(|v| v.ln()).collect(),
            variances,
            cell: STEP_PX.powi(2) / 12.0,
        })
    }

    /// Number of blobs: centres × widths.
    pub fn templates(&self) -> usize {
        self.variances.len()
    }

    /// Computes which sample every blob of amplitude 1 would give with one row φ of the sensing matrix: φᵀb for each
    /// blob b, written into `projected`. `weights` is that row: `rows · cols` values, row-major. No sample is needed,
    /// so that it can be done before the sample arrives. Blobs are separable, so the cost for each width is O(centres a
    /// column · (rows · cols + centres a row · cols)).
    ///
    /// # Errors
    /// [`Refusal`] if `weights` has another length, or a value that is not finite or beyond ±1e12.
    pub fn project(&self, weights: &[f64], projected: &mut Vec<f64>) -> Result<(), Refusal> {
        let taxels = (self.rows * self.cols) as f64;
        within("number of weights", weights.len() as f64, taxels, taxels)?;
        if let Some(&bad) = weights.iter().find(|w| w.is_nan() || w.abs() > 1e12) {
            within("weight", bad, -1e12, 1e12)?;
        }
        projected.clear();
        projected.resize(self.templates(), 0.0);
        let mut rest = projected.as_mut_slice();
        for Width { rows, cols, .. } in &self.widths {
            let (of_width, others) = rest.split_at_mut(rows.centres.len() * cols.centres.len());
            project(&rows.profiles, &cols.transposed, self.cols, weights, of_width);
            rest = others;
        }
        Ok(())
    }

    /// Evidence of no sample, to begin a window with.
    pub fn evidence(&self) -> BlobEvidence {
        let zeros = vec![0.0; self.templates()];
        BlobEvidence { count: 0.0, yy: 0.0, yt: zeros.clone(), tt: zeros.clone(), weights: zeros }
    }

    /// Posterior of the centre. Every blob is weighted by its evidence, integrated over the amplitude ([Laplace], flat
    /// in ln s); all centres and widths are equally likely a priori. Without a signal the result is the whole sheet.
    ///
    /// [Laplace]: https://en.wikipedia.org/wiki/Laplace%27s_method
    pub fn estimate(&self, evidence: &mut BlobEvidence) -> Estimate {
        self.weigh(evidence);
        let weights = &mut evidence.weights;
        let mut best = 0;
        for (k, w) in weights.iter().enumerate() {
            if *w > weights[best] {
                best = k;
            }
        }
        let peak = weights[best];
        let (mut sum, mut first, mut second) = (0.0, [0.0; 2], [0.0; 3]);
        let (mut width, mut k) = (0.0, 0);
        for of_width in &self.widths {
            for row in &of_width.rows.centres {
                for col in &of_width.cols.centres {
                    let w = (weights[k] - peak).exp();
                    sum += w;
                    first = [first[0] + w * row, first[1] + w * col];
                    second = [second[0] + w * row * row, second[1] + w * row * col, second[2] + w * col * col];
                    if k == best {
                        width = of_width.width;
                    }
                    k += 1;
                }
            }
        }
        let [row, col] = first.map(|v| v / sum);
        let [rr, rc, cc] = second.map(|v| v / sum);
        Estimate {
            position_px: [row, col],
            // the centre is spread over the cell of its grid point
            covariance_px2: [
                [(rr - row * row).max(0.0) + self.cell, rc - row * col],
                [rc - row * col, (cc - col * col).max(0.0) + self.cell],
            ],
            amplitude: if evidence.tt[best] > 0.0 { (evidence.yt[best] / evidence.tt[best]).max(0.0) } else { 0.0 },
            width_px: width,
        }
    }

    /// Log evidence of every blob, into the weights; 0 without a signal.
    fn weigh(&self, evidence: &mut BlobEvidence) {
        evidence.weights.fill(0.0);
        if evidence.yy > 0.0 {
            let moments = [evidence.count, evidence.yy];
            let (yt, tt) = (&evidence.yt, &evidence.tt);
            weigh(moments, [yt, tt, &self.variances, &self.log_variances], &mut evidence.weights);
        }
    }
}

/// φᵀb of the blobs of one width: `weights` folded with every row profile, then with all column profiles at once.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn project(rows: &[f64], cols: &[f64], taxels: usize, weights: &[f64], out: &mut [f64]) {
    let (height, centres) = (weights.len() / taxels, cols.len() / taxels);
    for (profile, out) in rows.chunks_exact(height).zip(out.chunks_exact_mut(centres)) {
        for (col, along) in cols.chunks_exact(centres).enumerate() {
            let column = weights[col..].iter().step_by(taxels);
            let folded: f64 = profile.iter().zip(column).map(|(a, w)| a * w).sum();
            out.iter_mut().zip(along).for_each(|(o, a)| *o += folded * a);
        }
    }
}

/// Adds the log evidence of every blob to `out`; `yt` and `tt` are those of amplitude 1.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn weigh([count, yy]: [f64; 2], [yt, tt, variances, log_variances]: [&[f64]; 4], out: &mut [f64]) {
    let sums = yt.iter().zip(tt).zip(variances.iter().zip(log_variances));
    for (((yt, tt), (variance, log_variance)), out) in sums.zip(out) {
        let moments = Moments { count, yy: yy / variance, yt: yt / variance, tt: tt / variance };
        *out += moments.laplace() - 0.5 * count * log_variance;
    }
}

impl BlobEvidence {
    /// Takes one more sample `y` into account. `projected` is what [`Localiser::project`] makes of the sample's row of
    /// the sensing matrix: one number for each blob.
    ///
    /// # Errors
    /// [`Refusal`] if `y` is not finite or beyond ±1e80, or `projected` belongs to other blobs. The evidence is then
    /// unchanged.
    pub fn observe(&mut self, projected: &[f64], y: f64) -> Result<(), Refusal> {
        let expected = self.yt.len() as f64;
        within("number of projections", projected.len() as f64, expected, expected)?;
        let y = measurement(y)?;
        self.count += 1.0;
        self.yy += y * y;
        for ((yt, tt), t) in self.yt.iter_mut().zip(&mut self.tt).zip(projected) {
            *yt += t * y;
            *tt += t * t;
        }
        Ok(())
    }

    /// Removes all samples, for a new window.
    pub fn clear(&mut self) {
        self.count = 0.0;
        self.yy = 0.0;
        self.yt.fill(0.0);
        self.tt.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn centre_of_a_symmetric_cross() {
        let mut image = vec![0.0; 25];
        for i in [7, 11, 12, 13, 17] {
            image[i] = 2.0;
        }
        image[0] = 0.1; // below the threshold
        assert_eq!(centre_of_mass(&image, 5, 0.23), Some([2.0, 2.0]));
        assert_eq!(centre_of_mass(&[0.0; 25], 5, 0.23), None);
    }

    fn signs(rng: &mut ChaCha8Rng, n: usize) -> Vec<f64> {
        (0..n).map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 }).collect()
    }

    fn blob(rows: usize, cols: usize, centre: [f64; 2], width: f64) -> Vec<f64> {
        (0..rows * cols)
            .map(|i| {
                let d = distance([(i / cols) as f64, (i % cols) as f64], centre);
                (-d * d / (2.0 * width * width)).exp()
            })
            .collect()
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(x, y)| x * y).sum()
    }

    #[test]
    fn projection_is_the_product_with_the_blobs() {
        let localiser = Localiser::new([4, 7]).unwrap();
        assert_eq!(localiser.templates(), 4 * 13 * 25);
        let weights = signs(&mut ChaCha8Rng::seed_from_u64(1), 28);
        let mut projected = Vec::new();
        localiser.project(&weights, &mut projected).unwrap();
        let mut k = 0;
        for width in WIDTHS_PX {
            for r in 0..13 {
                for c in 0..25 {
                    let b = blob(4, 7, [f64::from(r) * 0.25, f64::from(c) * 0.25], width);
                    // 28 products of numbers below 1
                    assert!((projected[k] - dot(&weights, &b)).abs() < 28.0 * 8.0 * f64::EPSILON);
                    assert!((localiser.variances[k] - 0.35_f64.powi(2) * dot(&b, &b)).abs() < 1e-13);
                    k += 1;
                }
            }
        }
    }

    /// Planted blobs between the grid's centres are found, and the stated covariance is the error's: the mean squared
    /// Mahalanobis distance of a two-dimensional Gaussian is 2.
    #[test]
    fn finds_planted_blobs_and_knows_how_well() {
        let localiser = Localiser::new([10, 10]).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut projected = Vec::new();
        let (trials, mut mahalanobis) = (200, 0.0);
        for _ in 0..trials {
            let centre = [rng.random_range(1.5..7.5), rng.random_range(1.5..7.5)];
            let image = blob(10, 10, centre, 0.9);
            let sd = 0.35 * dot(&image, &image).sqrt();
            let mut evidence = localiser.evidence();
            for _ in 0..40 {
                let weights = signs(&mut rng, 100);
                // twelve uniform numbers less 6: mean 0, variance 1
                let normal: f64 = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
                localiser.project(&weights, &mut projected).unwrap();
                evidence.observe(&projected, 1.7 * (dot(&weights, &image) + sd * normal)).unwrap();
            }
            let e = localiser.estimate(&mut evidence);
            assert!(distance(e.position_px, centre) < 0.5, "{e:?} for {centre:?}");
            // a width one step off changes the amplitude by up to (.9/.7)² at the same volume, noise some 10 % more
            assert!((0.9..3.2).contains(&e.amplitude), "{e:?}");
            let [[a, b], [_, c]] = e.covariance_px2;
            let d = [e.position_px[0] - centre[0], e.position_px[1] - centre[1]];
            mahalanobis += (c * d[0] * d[0] - 2.0 * b * d[0] * d[1] + a * d[1] * d[1]) / (a * c - b * b);
        }
        // 200 draws have a mean of 2 ± .14 if the posterior were a Gaussian; the cells of the grid are as wide as it,
        // which may change either's variance by half
        let mean = mahalanobis / f64::from(trials);
        assert!((1.0..4.0).contains(&mean), "{mean}");
    }

    #[test]
    fn nothing_measured_is_the_whole_sheet() {
        let localiser = Localiser::new([9, 5]).unwrap();
        let (mut evidence, mut projected) = (localiser.evidence(), Vec::new());
        for y in [None, Some(0.0), Some(1e-300)] {
            if let Some(y) = y {
                localiser.project(&[1.0; 45], &mut projected).unwrap();
                evidence.observe(&projected, y).unwrap();
            }
            let e = localiser.estimate(&mut evidence);
            // n cells of a quarter of a taxel, spread evenly: n²/12 of their squares, for 33 and 17 of them
            assert!(distance(e.position_px, [4.0, 2.0]) < 1e-12, "{e:?}");
            assert!((e.covariance_px2[0][0] - 33.0 * 33.0 / 192.0).abs() < 1e-9, "{e:?}");
            assert!((e.covariance_px2[1][1] - 17.0 * 17.0 / 192.0).abs() < 1e-9, "{e:?}");
            assert!(e.amplitude.abs() < 1e-300);
        }
        evidence.observe(&projected, 1e79).unwrap();
        assert!(localiser.estimate(&mut evidence).position_px[0].is_finite());
    }
}
