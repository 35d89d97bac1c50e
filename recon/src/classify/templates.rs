//! Gaussian classes from images on a grid.

use crate::checks::{no_contact, other_length, within};
use crate::classify::Library;
use crate::classify::evidence::Component;
use crate::matrix::{Matrix, shifted};
use crate::recover::Gaussian;
use nalgebra::DMatrix;
use spts_input::Refusal;

/// Builds Gaussian classes from images: u ~ N(t, Σ), where t is the image scaled to a maximum of 1, a the blurred
/// image, and
///
/// Σᵢⱼ = m² aᵢ aⱼ (ρ exp(−dᵢⱼ²/2ℓ²) + (1 − ρ) δᵢⱼ) + θ² tᵢ tⱼ (uᵢ uⱼ + vᵢ vⱼ) + γᵢ² tᵢ² δᵢⱼ + f² δᵢⱼ,
///
/// where d is the distance of two taxels, u and v, from −1 to 1, are a taxel's place along the rows and the columns of
/// the sheet, and γᵢ is 0 for images of the same skin. θ is the tilt between two mountings of the skin. Of the smooth
/// part, the tilt and the gains' part only the `rank` largest eigenvectors are kept. The rest, the other independent
/// parts and the noise of a measurement are treated as white (see [`Component`]).
///
/// ```
/// use spts_recon::Matrix;
/// use spts_recon::classify::{Library, TemplateModel};
///
/// let image = [0.0, 1.0, 0.0, 0.0, 3.0, 0.0, 0.0, 1.0, 0.0];
/// let library = Library::new(&Matrix::from_columns(9, 1, &image)?, &[4])?;
/// let model = TemplateModel { reach: 1, ..TemplateModel::new(3) };
/// let classes = model.classes(&library)?;
/// assert_eq!(classes.len(), 9, "one component for each place within one taxel");
/// assert!(classes.iter().all(|class| class.label == Some(4)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct TemplateModel {
    /// Number of columns of the grid.
    pub cols: usize,
    /// γ: relative standard deviation of every taxel's gain compared with that in the images, one value a taxel in [0,
    /// 10]; empty for images of the same skin.
    pub gains: Vec<f64>,
    /// θ: standard deviation of the slopes of a plane in the logarithm of the gains, from the middle of the sheet to
    /// its edge, by which two mountings of the skin differ, [0, 10].
    pub tilt: f64,
    /// Standard deviation of the noise of one measurement, relative to the image's maximum, [1e-6, 1e5].
    pub noise: f64,
    /// Number of eigenvectors of the smooth part that are kept.
    pub rank: usize,
    /// Largest shift, in rows and columns, at which every image is also expected; all shifts are equally likely.
    pub reach: usize,
}

/// θ of the skin's mountings: √2 times the slopes' deviation of one, .20 (`spts calibrate --skin`).
const TILT: f64 = 0.28;
/// m: standard deviation of an image's values relative to the blurred image.
const MISMATCH: f64 = 0.22;
/// Standard deviation of the blur, taxels.
const BLUR_PX: f64 = 0.7;
/// ρ: share of the variance that is smooth.
const SMOOTH_SHARE: f64 = 0.8;
/// ℓ: correlation length of the smooth part, taxels.
const LENGTH_PX: f64 = 2.0;
/// f: standard deviation of every taxel, relative to the maximum.
const FLOOR: f64 = 0.025;

impl TemplateModel {
    /// Values for presses that are repeated accurately. `noise` also covers the differences between sessions.
    pub fn new(cols: usize) -> Self {
        Self { cols, gains: Vec::new(), tilt: TILT, noise: 0.4, rank: 8, reach: 0 }
    }

    /// Values for a classifier with the outcome "unknown". Its classes are so wide that an unusual press of an object
    /// is still closer to its class than to "unknown". Chosen on windows computed from raster images, leaving each
    /// object in turn out of classes and "unknown".
    pub fn open(cols: usize) -> Self {
        Self {
            noise: 0.8,
            // beside that much noise more make no difference
            rank: 4,
            ..Self::new(cols)
        }
    }

    fn check(&self, taxels: usize) -> Result<(), Refusal> {
        within("noise", self.noise, 1e-6, 1e5)?;
        within("tilt", self.tilt, 0.0, 10.0)?;
        if !self.gains.is_empty() && self.gains.len() != taxels {
            return Err(other_length("gains", self.gains.len(), taxels));
        }
        for &gain in &self.gains {
            within("gains", gain, 0.0, 10.0)?;
        }
        if self.cols == 0 || taxels == 0 || !taxels.is_multiple_of(self.cols) {
            return Err(other_length("image", taxels, self.cols));
        }
        Ok(())
    }

    /// One component for every image of `library` and every shift.
    ///
    /// # Errors
    /// [`Refusal`] if a parameter is out of range, the images do not fit the grid, or an image has no value above
    /// zero.
    pub fn classes(&self, library: &Library) -> Result<Vec<Component>, Refusal> {
        let places = self.places(library, self.reach)?;
        Ok(places.into_iter().map(|(label, mean)| self.component(label, mean)).collect())
    }

    /// The components of [`Self::classes`] as full Gaussians, in the same order, for [`super::ImageEstimator`].
    ///
    /// # Errors
    /// As [`Self::classes`].
    pub fn image_priors(&self, library: &Library) -> Result<Vec<Gaussian>, Refusal> {
        let places = self.places(library, self.reach)?.into_iter();
        places
            .map(|(_, mean)| {
                let (mut covariance, independent) = self.covariance(&mean);
                for (i, variance) in independent.iter().enumerate() {
                    covariance[(i, i)] += variance;
                }
                Gaussian::new(mean, Matrix::from(&covariance))
            })
            .collect()
    }

    /// Every image of `library` with its label, scaled to a maximum of 1, at every place in `reach`.
    fn places(&self, library: &Library, reach: usize) -> Result<Vec<(usize, Vec<f64>)>, Refusal> {
        self.check(library.images().nrows())?;
        let mut out = Vec::new();
        for (index, &label) in library.labels().iter().enumerate() {
            let image = peak_one(&library.images().column(index)).ok_or(no_contact(index))?;
            let places = shifted(&Matrix::from_column_slices(image.len(), &[&image]), self.cols, reach);
            out.extend((0..places.ncols()).map(|k| (label, places.column(k))));
        }
        Ok(out)
    }

    fn component(&self, label: usize, mean: Vec<f64>) -> Component {
        let (smooth, independent) = self.covariance(&mean);
        let (factors, rest) = principal(smooth, self.rank);
        Component {
            label: Some(label),
            weight: 1.0,
            mean,
            factors,
            noise_variance: self.noise.powi(2) + independent.iter().sum::<f64>() + rest,
        }
    }

    /// A component for objects of no class: mean and sample covariance of all images of `library`, each scaled to a
    /// maximum of 1, unshifted and shifted by one taxel in every direction, and tilted as by a mounting.
    ///
    /// # Errors
    /// As [`Self::classes`].
    pub fn unknown(&self, library: &Library) -> Result<Component, Refusal> {
        let (mean, mut covariance) = self.moments(library)?;
        let n = mean.len();
        covariance += DMatrix::from_fn(n, n, |i, j| self.tilt(i, j, n) * (covariance[(i, j)] + mean[i] * mean[j]));
        let (factors, rest) = principal(covariance, self.rank);
        let independent = mean.len() as f64 * FLOOR.powi(2);
        Ok(Component {
            label: None,
            weight: 1.0,
            mean,
            factors,
            noise_variance: self.noise.powi(2) + independent + rest,
        })
    }

    /// Mean and covariance of all images, each at its place and one taxel to every side.
    fn moments(&self, library: &Library) -> Result<(Vec<f64>, DMatrix<f64>), Refusal> {
        let all = self.places(library, 1)?;
        let (n, count) = (library.images().nrows(), all.len() as f64);
        let mean: Vec<f64> = (0..n).map(|i| all.iter().map(|(_, image)| image[i]).sum::<f64>() / count).collect();
        let centred = DMatrix::from_fn(n, all.len(), |i, k| all[k].1[i] - mean[i]);
        Ok((mean, &centred * centred.transpose() / count))
    }
}

/// The image divided by its maximum, negative values set to zero; `None` without a value above zero.
fn peak_one(image: &[f64]) -> Option<Vec<f64>> {
    let peak = image.iter().copied().fold(0.0, f64::max);
    (peak > 0.0 && peak.is_finite()).then(|| image.iter().map(|v| v.max(0.0) / peak).collect())
}

impl TemplateModel {
    /// Smooth part of Σ and variances of the independent one, for the template `mean`.
    pub(super) fn covariance(&self, mean: &[f64]) -> (DMatrix<f64>, Vec<f64>) {
        let deviation: Vec<f64> = self.blur(mean).iter().map(|v| MISMATCH * v).collect();
        let smooth = DMatrix::from_fn(mean.len(), mean.len(), |i, j| {
            let d2 = distance_squared(i, j, self.cols);
            let gain = match self.gains.get(i) {
                Some(gain) if i == j => gain * mean[i],
                _ => 0.0,
            };
            SMOOTH_SHARE * deviation[i] * deviation[j] * (-d2 / (2.0 * LENGTH_PX.powi(2))).exp()
                + self.tilt(i, j, mean.len()) * mean[i] * mean[j]
                + gain * gain
        });
        let independent = deviation.iter().map(|a| (1.0 - SMOOTH_SHARE) * a * a + FLOOR.powi(2));
        (smooth, independent.collect())
    }

    /// θ² (uᵢ uⱼ + vᵢ vⱼ) of two taxels on a sheet of so many.
    fn tilt(&self, i: usize, j: usize, taxels: usize) -> f64 {
        let along = |index: usize, count: usize| (2 * index + 1) as f64 / count as f64 - 1.0;
        let place = |k: usize| [along(k / self.cols, taxels / self.cols), along(k % self.cols, self.cols)];
        let ([u, v], [u_j, v_j]) = (place(i), place(j));
        self.tilt.powi(2) * (u * u_j + v * v_j)
    }

    /// Gaussian blur with zeros around the image.
    fn blur(&self, image: &[f64]) -> Vec<f64> {
        let kernel = |d2: f64| (-d2 / (2.0 * BLUR_PX.powi(2))).exp();
        // the sum of the kernel over all taxels of the plane; beyond 40 deviations nothing is left in double precision
        let (mut line, mut d) = (1.0, 1.0);
        while d <= 40.0 * BLUR_PX + 1.0 {
            line += 2.0 * kernel(d * d);
            d += 1.0;
        }
        let near = |i: usize| -> f64 {
            let terms = image.iter().enumerate();
            terms.map(|(j, v)| v * kernel(distance_squared(i, j, self.cols))).sum()
        };
        (0..image.len()).map(|i| near(i) / (line * line)).collect()
    }
}

/// Square of the distance of two taxels of a grid with `cols` columns.
fn distance_squared(i: usize, j: usize, cols: usize) -> f64 {
    let rows = (i / cols).abs_diff(j / cols) as f64;
    let columns = (i % cols).abs_diff(j % cols) as f64;
    rows * rows + columns * columns
}

/// The `rank` largest eigenvectors of a covariance, each times the root of its eigenvalue, and the trace of what is
/// left.
pub(super) fn principal(covariance: DMatrix<f64>, rank: usize) -> (Vec<Vec<f64>>, f64) {
    let eigen = covariance.symmetric_eigen();
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    // rounding may leave a zero eigenvalue a little below zero
    let value = |k: usize| eigen.eigenvalues[k].max(0.0);
    let (kept, left) = order.split_at(rank.min(order.len()));
    let factors = kept.iter().map(|&k| eigen.eigenvectors.column(k).iter().map(|v| v * value(k).sqrt()).collect());
    (factors.collect(), left.iter().map(|&k| value(k)).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The priors are the stated Σ, independent part included, in the order of the classes.
    #[test]
    fn image_priors_are_the_stated_covariance() {
        let model = TemplateModel { reach: 1, ..TemplateModel::new(4) };
        let library = library();
        let (classes, priors) = (model.classes(&library).unwrap(), model.image_priors(&library).unwrap());
        // nine shifts
        assert_eq!((classes.len(), priors.len()), (9, 9));
        for (class, prior) in classes.iter().zip(&priors) {
            assert_eq!(class.mean, prior.mean());
            let trace: f64 = (0..12).map(|i| prior.covariance().row(i)[i]).sum();
            let factors: f64 = class.factors.iter().flatten().map(|v| v * v).sum();
            assert!((trace + model.noise.powi(2) - factors - class.noise_variance).abs() < 1e-13);
        }
    }

    fn library() -> Library {
        let image: Vec<f64> = (0..12).map(|i| if i % 3 == 0 { 2.0 } else { 0.0 }).collect();
        Library::new(&Matrix::from_column_slices(12, &[&image]), &[5]).unwrap()
    }

    /// With every eigenvector kept, F Fᵀ is the smooth part and the rest is white: together the stated Σ's trace.
    #[test]
    fn covariance_is_the_stated_one() {
        let model = TemplateModel { rank: 12, tilt: 0.3, ..TemplateModel::new(4) };
        let c = &model.classes(&library()).unwrap()[0];
        let (t, a) = (&c.mean, model.blur(&c.mean));
        assert!((t.iter().copied().fold(0.0, f64::max) - 1.0).abs() < 1e-15);
        for i in 0..12 {
            for j in 0..12 {
                let got: f64 = c.factors.iter().map(|f| f[i] * f[j]).sum();
                // three rows and four columns
                let place = |k: usize| [(k / 4) as f64 * 2.0 / 3.0 - 2.0 / 3.0, (k % 4) as f64 / 2.0 - 0.75];
                let tilt = 0.09 * t[i] * t[j] * (place(i)[0] * place(j)[0] + place(i)[1] * place(j)[1]);
                let smooth = 0.22_f64.powi(2) * 0.8 * a[i] * a[j] * (-distance_squared(i, j, 4) / 8.0).exp();
                let expected = smooth + tilt;
                // an eigendecomposition of a matrix of norm below 1
                assert!((got - expected).abs() < 1e-14, "({i}, {j}): {got}, expected {expected}");
            }
        }
        let square: f64 = a.iter().map(|v| v * v).sum();
        let white = 0.16 + 0.2 * 0.22_f64.powi(2) * square + 12.0 * 0.025_f64.powi(2);
        assert!((c.noise_variance - white).abs() < 1e-14, "{} for {white}", c.noise_variance);
        let fewer = TemplateModel { rank: 2, ..model.clone() }.classes(&library()).unwrap();
        let trace = |c: &Component| c.factors.iter().flatten().map(|v| v * v).sum::<f64>() + c.noise_variance;
        assert!((trace(&fewer[0]) - trace(c)).abs() < 1e-14);
    }

    /// Gains of a skin that was not seen add γᵢ² tᵢ² to the variance of taxel i, and nothing between taxels.
    #[test]
    fn gains_of_another_skin_are_independent() {
        let same = TemplateModel { rank: 12, ..TemplateModel::new(4) };
        let gains: Vec<f64> = (0..12).map(|i| 0.1 * f64::from(i)).collect();
        let other = TemplateModel { gains: gains.clone(), ..same.clone() };
        let [a, b] = [same, other].map(|model| model.classes(&library()).unwrap().remove(0));
        for i in 0..12 {
            for j in 0..12 {
                let product = |c: &Component| c.factors.iter().map(|f| f[i] * f[j]).sum::<f64>();
                let expected = if i == j { (gains[i] * a.mean[i]).powi(2) } else { 0.0 };
                // eigendecompositions of matrices of norm below 1
                assert!((product(&b) - product(&a) - expected).abs() < 1e-14, "({i}, {j})");
            }
        }
        assert!((a.noise_variance - b.noise_variance).abs() < 1e-14);
    }

    #[test]
    fn blur_keeps_the_sum_of_an_image_far_from_the_edge() {
        let model = TemplateModel::new(15);
        let mut image = vec![0.0; 225];
        image[112] = 1.0;
        let sum: f64 = model.blur(&image).iter().sum();
        // 7 taxels are 10 deviations
        assert!((sum - 1.0).abs() < 1e-12, "{sum}");
    }
}
