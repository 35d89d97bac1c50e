//! Reconstructs many small contacts on a large skin.

use super::detect::{Detection, Detector, dilate, is_nothing};
use super::fista::{Descent, NnFista, check, subtract};
use super::grain::Grains;
use crate::kernels::norm;
use crate::operator::{Atom, Composition, LinearOperator, SelectColumns};
use crate::problem::RecoverError;

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
/// use spts_recon::operator::{LinearOperator as _, SignGenerator, SignOperator};
///
/// // one contact on 20 × 20 taxels, 150 measurements
/// let seeds = (1..401_u32).map(|k| (k * k).wrapping_mul(2_654_435_761)).collect();
/// let phi = SignOperator::new(SignGenerator::NUMERICAL_RECIPES, seeds, 0, 150);
/// let (mut image, mut y) = ([0.0; 400], [0.0; 150]);
/// for (k, pixel) in image.iter_mut().enumerate() {
///     let square = (k as f64 / 20.0).floor() - 8.0;
///     *pixel = (1.0 - (square.powi(2) + ((k % 20) as f64 - 12.0).powi(2)) / 9.0).max(0.0);
/// }
/// phi.apply(&image, &mut y);
/// let found = RegionPursuit::new(20, 20).recover(&phi, &y, None)?;
/// let distance = image.iter().zip(&found.image).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
/// assert!(distance < 0.05 * image.iter().map(|a| a * a).sum::<f64>(), "{distance}");
/// # Ok::<(), spts_recon::RecoverError>(())
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

/// The image that a [`RegionPursuit`] has found, and what it took.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The image, row-major, ≥ 0.
    pub image: Vec<f64>,
    /// ‖y − Φ x‖.
    pub residual_norm: f64,
    /// Number of rounds with a reconstruction.
    pub rounds: usize,
    /// Number of candidate places in the last round.
    pub candidates: usize,
    /// Descent of the last round.
    pub descent: Descent,
    /// Largest memory held at once, bytes: images, correlations, filters and candidates, without Φ.
    pub bytes: usize,
}

impl RegionPursuit {
    /// Default of `max_rounds`.
    pub const MAX_ROUNDS: usize = 20;

    /// A pursuit of contacts with radii of 1 to 4 taxels in images of `rows` × `cols`.
    #[must_use]
    pub fn new(rows: usize, cols: usize) -> Self {
        Self {
            rows,
            cols,
            max_rounds: Self::MAX_ROUNDS,
        }
    }

    /// Reconstructs the image of `y`. `start` may be a similar image, such as the previous one of a series.
    ///
    /// # Errors
    /// [`RecoverError::ShapeMismatch`] if the length of `y` differs from the rows of Φ, [`RecoverError::Columns`] if Φ
    /// does not have one column a taxel or the size of `start` differs, [`RecoverError::NotFinite`] for a NaN or an
    /// infinity, [`RecoverError::Overflow`] if the image exceeds the range of numbers.
    pub fn recover<A: SelectColumns>(&self, phi: &A, y: &[f64], start: Option<&[f64]>) -> Result<Found, RecoverError> {
        check(phi, y)?;
        let taxels = self.rows * self.cols;
        for columns in [phi.ncols(), start.map_or(taxels, <[f64]>::len)] {
            if columns != taxels {
                return Err(RecoverError::Columns {
                    cols: columns,
                    expected: taxels,
                });
            }
        }
        // squares of the largest and the smallest numbers there are would not be
        let scale = y.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let scale = if scale.is_normal() { scale } else { 1.0 };
        let scaled = |values: &[f64]| -> Vec<f64> { values.iter().map(|v| v / scale).collect() };
        let (y, start) = (scaled(y), start.map(scaled));
        let mut search = Search::new(self, phi, &y, start.as_deref());
        for _ in 0..self.max_rounds {
            if is_nothing(&search.residual, &y) || !search.look() {
                break;
            }
            search.solve()?;
        }
        let mut found = search.found;
        found.image.iter_mut().for_each(|v| *v *= scale);
        found.residual_norm *= scale;
        match found.image.iter().position(|v| !v.is_finite()) {
            Some(atom) => Err(RecoverError::Overflow { atom }),
            None => Ok(found),
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
    found: Found,
}

impl<'a, A: SelectColumns> Search<'a, A> {
    fn new(pursuit: &'a RegionPursuit, phi: &'a A, y: &'a [f64], start: Option<&[f64]>) -> Self {
        let taxels = pursuit.rows * pursuit.cols;
        let detector = Detector::new(pursuit.rows, pursuit.cols, &RADII_TAXELS.map(Atom::cap));
        let mut weights = vec![0.0; taxels];
        let mut residual = y.to_vec();
        if let Some(start) = start {
            weights.iter_mut().zip(start).for_each(|(w, s)| *w = s.max(0.0));
            subtract(phi, &weights, &mut residual);
        }
        let mut search = Self {
            pursuit,
            phi,
            y,
            threshold: detector.threshold(FALSE_ALARMS),
            detector,
            candidates: vec![false; taxels],
            variance: vec![0.0; taxels],
            found: Found {
                image: weights.clone(),
                residual_norm: norm(&residual),
                rounds: 0,
                candidates: 0,
                descent: Descent {
                    iterations: 0,
                    gap: 0.0,
                    converged: true,
                },
                bytes: 0,
            },
            weights,
            residual,
        };
        search.grow(&[]);
        search
    }

    /// Looks for contacts in the residual; true when there is something to solve for: new candidates, or a start that
    /// was not solved for.
    fn look(&mut self) -> bool {
        let mut correlation = vec![0.0; self.weights.len()];
        self.phi.apply_adjoint(&self.residual, &mut correlation);
        self.phi.chance_variance(&self.residual, &mut self.variance);
        let detections = self.detector.detect(&correlation, &self.variance, self.threshold);
        let unsolved = self.found.rounds == 0 && self.candidates.contains(&true);
        self.grow(&self.strongest(detections)) || unsolved
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
        let support: Vec<usize> = (0..self.weights.len())
            .filter(|&k| self.weights[k] > 1e-3 * largest)
            .collect();
        for marked in [&support[..], new] {
            dilate(shape, marked, REACH_TAXELS, &mut self.candidates);
        }
        !new.is_empty() && self.candidates.iter().zip(&before).any(|(now, before)| *now && !before)
    }

    /// The image on the candidates.
    fn solve(&mut self) -> Result<(), RecoverError> {
        let places: Vec<usize> = (0..self.candidates.len()).filter(|&k| self.candidates[k]).collect();
        let grains = Grains::new((self.pursuit.rows, self.pursuit.cols), places, GRAIN_SD_TAXELS);
        let columns = self.phi.select_columns(grains.taxels());
        let mut x: Vec<f64> = grains.places().iter().map(|&k| self.weights[k]).collect();
        let descent = NnFista {
            penalty: PENALTY_SD * self.chance_sd(grains.taxels()) * Grains::length(GRAIN_SD_TAXELS),
            tol: DESCENT.0,
            max_iter: DESCENT.1,
        }
        .descend(&Composition::new(&columns, &grains), self.y, &mut x)?;

        self.weights.fill(0.0);
        grains.places().iter().zip(&x).for_each(|(&k, x)| self.weights[k] = *x);
        let mut part = vec![0.0; grains.taxels().len()];
        grains.apply(&x, &mut part);
        self.found.image.fill(0.0);
        grains
            .taxels()
            .iter()
            .zip(&part)
            .for_each(|(&k, v)| self.found.image[k] = *v);
        self.residual.copy_from_slice(self.y);
        subtract(&columns, &part, &mut self.residual);
        self.found.residual_norm = norm(&self.residual);
        self.found.rounds += 1;
        self.found.candidates = x.len();
        self.found.descent = descent;
        self.found.bytes = self.found.bytes.max(self.bytes(&grains));
        Ok(())
    }

    /// Standard deviation of what the residual, were it noise, would correlate with a taxel; the root mean square over
    /// `taxels`.
    fn chance_sd(&self, taxels: &[usize]) -> f64 {
        let sum: f64 = taxels.iter().map(|&k| self.variance[k]).sum();
        (sum / taxels.len().max(1) as f64).sqrt()
    }

    /// Bytes that are held while `grains` are solved for: five states of the descent beside what the search keeps.
    fn bytes(&self, grains: &Grains) -> usize {
        let numbers = 4 * self.weights.len() + 2 * self.y.len();
        let descent = 5 * (grains.ncols() + grains.nrows() + self.y.len());
        self.detector.bytes() + grains.bytes() + (numbers + descent) * size_of::<f64>() + 2 * self.candidates.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
    use crate::operator::{ShiftedDictionary, SignGenerator, SignOperator, SubArrays};
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    const SIDE: usize = 60;

    /// Caps at places that do not touch.
    fn scene(places: &[(usize, usize, f64)]) -> Vec<f64> {
        let dictionary = ShiftedDictionary::new(SIDE, SIDE, &[Atom::cap(2.0)]);
        let (mut x, mut image) = (vec![0.0; SIDE * SIDE], vec![0.0; SIDE * SIDE]);
        places.iter().for_each(|&(r, c, peak)| x[r * SIDE + c] = peak);
        dictionary.apply(&x, &mut image);
        image
    }

    fn signs(n: usize, m: usize, rng: &mut ChaCha8Rng) -> SignOperator {
        let seeds = (0..n).map(|_| rng.random()).collect();
        SignOperator::new(SignGenerator::new(1_664_525, 1_013_904_223, 31).unwrap(), seeds, 0, m)
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

    /// Four contacts, 3600 taxels, 8 % of them measured with 5 % noise: far above what 16 unknowns need. The bound is
    /// the IoU that large skins are asked for.
    #[test]
    fn contacts_are_found_on_one_wire_and_on_several() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let truth = scene(&PLACES);
        let whole = signs(SIDE * SIDE, 288, &mut rng);
        let parts = SubArrays::new((0..3).map(|_| signs(SIDE * SIDE / 3, 96, &mut rng)).collect());
        let pursuit = RegionPursuit::new(SIDE, SIDE);
        let mut noisy = |phi: &dyn LinearOperator| -> Vec<f64> {
            let mut y = vec![0.0; 288];
            phi.apply(&truth, &mut y);
            let sd = 0.05 * norm(&truth);
            // uniform noise of that deviation
            y.iter_mut()
                .for_each(|v| *v += sd * 3_f64.sqrt() * rng.random_range(-1.0..1.0));
            y
        };
        let (y, y_parts) = (noisy(&whole), noisy(&parts));
        for found in [
            pursuit.recover(&whole, &y, None).unwrap(),
            pursuit.recover(&parts, &y_parts, None).unwrap(),
            pursuit.recover(&whole, &y, Some(&truth)).unwrap(),
        ] {
            let iou = iou(&found.image, &truth);
            assert!(iou >= 0.8, "IoU {iou} after {} rounds", found.rounds);
        }
    }

    #[test]
    fn extremes_are_images_or_errors() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let phi = signs(SIDE * SIDE, 200, &mut rng);
        let pursuit = RegionPursuit {
            max_rounds: 3,
            ..RegionPursuit::new(SIDE, SIDE)
        };
        let nothing = pursuit.recover(&phi, &[0.0; 200], None).unwrap();
        assert!(nothing.image.iter().all(|v| *v == 0.0) && nothing.rounds == 0);
        let truth = scene(&PLACES);
        for scale in [1e-300, 1e300] {
            let mut y = vec![0.0; 200];
            phi.apply(&truth, &mut y);
            y.iter_mut().for_each(|v| *v *= scale);
            let image = pursuit.recover(&phi, &y, None).unwrap().image;
            let (iou, positive) = (iou(&image, &truth), image.iter().all(|v| v.is_finite() && *v >= 0.0));
            assert!(iou > 0.8 && positive, "scale {scale:e}: IoU {iou}");
        }
        let mut y = vec![1.0; 200];
        y[7] = f64::INFINITY;
        assert!(matches!(
            pursuit.recover(&phi, &y, None),
            Err(RecoverError::NotFinite { index: 7, .. })
        ));
        assert!(matches!(
            pursuit.recover(&phi, &[1.0; 3], None),
            Err(RecoverError::ShapeMismatch { .. })
        ));
        let other = RegionPursuit::new(SIDE, 2);
        assert!(matches!(
            other.recover(&phi, &[1.0; 200], None),
            Err(RecoverError::Columns { .. })
        ));
        let single = signs(SIDE * SIDE, 1, &mut rng);
        assert!(
            pursuit
                .recover(&single, &[1.0], None)
                .unwrap()
                .image
                .iter()
                .all(|v| v.is_finite())
        );
    }
}
