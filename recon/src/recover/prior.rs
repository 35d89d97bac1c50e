//! Gaussian priors of images, noises and penalties, checked for their valid ranges.

use crate::kernels::{dot, norm};
use crate::matrix::{Matrix, shifted};
use nalgebra::DMatrix;
use spts_input::Refusal;

/// Gaussian prior x ~ N(μ, C) of N unknowns.
///
/// ```
/// use spts_recon::Matrix;
/// use spts_recon::recover::Gaussian;
///
/// let covariance = Matrix::from_rows(2, 2, vec![1.0, 0.8, 0.8, 1.0])?; // neighbours are alike
/// let prior = Gaussian::new(vec![0.0; 2], covariance)?;
/// assert!((prior.precision().row(0)[0] - 1.0 / 0.36).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Gaussian {
    mean: Vec<f64>,
    covariance: Matrix,
    precision: Matrix,
    /// C⁻¹ μ
    natural: Vec<f64>,
}

/// Rounding that a symmetric matrix may show across its diagonal, as a share of the entry's bound √(Cᵢᵢ Cⱼⱼ): sums of
/// some 10⁵ terms in different order.
const ASYMMETRY: f64 = 1e-10;

impl Gaussian {
    /// A prior with `mean` (length N) and `covariance` (N × N, positive definite).
    ///
    /// # Errors
    /// [`Refusal`] if they do not define a Gaussian.
    pub fn new(mean: Vec<f64>, covariance: Matrix) -> Result<Self, Refusal> {
        let n = mean.len();
        if n == 0 || covariance.nrows() != n || covariance.ncols() != n {
            return Err(Refusal::new(format!(
                "covariance has shape {rows} × {cols} but `mean` has {len} entries",
                rows = covariance.nrows(),
                cols = covariance.ncols(),
                len = n
            )));
        }
        let values = covariance.view().values();
        for (field, values) in [("mean", mean.as_slice()), ("covariance", values)] {
            if !values.iter().all(|v| v.is_finite()) {
                return Err(Refusal::new(format!("`{field}` holds a value that is not finite")));
            }
        }
        check_symmetry(&covariance)?;
        let dense = DMatrix::from_row_slice(n, n, values);
        let inverse = dense
            .cholesky()
            .ok_or(Refusal::new("covariance is not positive definite; a positive `floor` or noise makes it so"))?
            .inverse();
        if !inverse.iter().all(|v| v.is_finite()) {
            return Err(Refusal::new("covariance is not positive definite; a positive `floor` or noise makes it so"));
        }
        let precision = Matrix::from(&inverse);
        let natural = (0..n).map(|i| dot(precision.row(i), &mean)).collect();
        Ok(Self { mean, covariance, precision, natural })
    }

    /// A prior of `n` independent unknowns with mean 0 and standard deviation `deviation`.
    ///
    /// # Errors
    /// [`Refusal`] if `n` is 0, or `deviation` is outside (0, ∞).
    pub fn white(n: usize, deviation: f64) -> Result<Self, Refusal> {
        let mut covariance = Matrix::zeros(n, n);
        for i in 0..n {
            covariance.row_mut(i)[i] = deviation * deviation;
        }
        Self::new(vec![0.0; n], covariance)
    }

    /// Number of unknowns, N.
    pub(super) fn len(&self) -> usize {
        self.mean.len()
    }

    /// Mean μ, length N.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Covariance C, N × N.
    pub fn covariance(&self) -> &Matrix {
        &self.covariance
    }

    /// C⁻¹ μ, length N: what the mean adds to the normal equations.
    pub(super) fn natural(&self) -> &[f64] {
        &self.natural
    }

    /// Inverse of the covariance, N × N.
    pub fn precision(&self) -> &Matrix {
        &self.precision
    }
}

fn check_symmetry(covariance: &Matrix) -> Result<(), Refusal> {
    for row in 0..covariance.nrows() {
        for col in 0..row {
            let (value, mirror) = (covariance.row(row)[col], covariance.row(col)[row]);
            let bound = (covariance.row(row)[row].abs() * covariance.row(col)[col].abs()).sqrt();
            if (value - mirror).abs() > ASYMMETRY * bound {
                return Err(Refusal::new(format!(
                    "covariance[{row}, {col}] = {value} but its mirror image is {mirror}"
                )));
            }
        }
    }
    Ok(())
}

/// Settings that turn example images into a Gaussian prior: the moments of the images after cleaning and shifting.
///
/// ```
/// use spts_recon::Matrix;
/// use spts_recon::recover::ImagePrior;
///
/// // one image of 4 × 4 pixels with a bar in its second column
/// let bar: Vec<f64> = (0..16).map(|i| if i % 4 == 1 { 2.0 } else { 0.0 }).collect();
/// let prior = ImagePrior { floor: 0.1, ..ImagePrior::UNSEEN }.learn(&Matrix::from_columns(16, 1, &bar)?, 4)?;
/// let correlation = |i, j| prior.covariance().row(i)[j];
/// assert!(correlation(1, 5) > correlation(1, 2), "neighbours along the bar go together");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePrior {
    /// Largest distance of an image from where similar ones were seen, pixels; see [`shifted`].
    pub reach: usize,
    /// Weight of the unshifted images, in [0, 1]; the rest is spread evenly over all shifts.
    pub stay: f64,
    /// Pixels below this share of their image's maximum, in [0, 1), count as background and are set to zero.
    pub threshold: f64,
    /// Scales all images to the same length ‖x‖₂, their root mean square, so that a hard press counts no more than a
    /// soft one.
    pub equal_length: bool,
    /// Whether moments are about the mean. If not, they are about zero: the mean is zero, and the strength of a contact
    /// stays open.
    pub centred: bool,
    /// Standard deviation added to every pixel, in the unit of the images, in (0, ∞).
    pub floor: f64,
}

impl ImagePrior {
    /// For objects unlike the example images. The middle of the flat top of a search over 972 settings on raster images
    /// of 17 real objects, each left out of its own prior (`tests/priors.rs`). To be used with a noise of 0.12 of the
    /// root mean square of `y`.
    pub const UNSEEN: Self =
        Self { reach: 2, stay: 0.3, threshold: 0.5, equal_length: true, centred: false, floor: 0.01 };

    /// For the same objects at the same places as in the example images: their mean and covariance.
    pub const SEEN: Self =
        Self { reach: 0, stay: 1.0, threshold: 0.0, equal_length: false, centred: true, floor: 0.025 };

    /// Prior of images that resemble `images` (N × number of images, each with `cols` columns, row-major). Images that
    /// are zero everywhere are ignored.
    ///
    /// C = Σ v x xᵀ − μ μᵀ + floor² I with μ = Σ v x, or μ = 0 if not centred. The weights v sum to 1.
    ///
    /// # Errors
    /// [`Refusal`] if every image is zero, one is not finite, the grid does not fit, or a parameter is outside its
    /// range.
    pub fn learn(&self, images: &Matrix, cols: usize) -> Result<Gaussian, Refusal> {
        self.check()?;
        let pixels = images.nrows();
        if !images.view().values().iter().all(|v| v.is_finite()) {
            return Err(Refusal::new(format!("`{field}` holds a value that is not finite", field = "images")));
        }
        let clean = self.clean(images);
        if clean.ncols() == 0 || cols == 0 || !pixels.is_multiple_of(cols) {
            return Err(no_images(clean.ncols(), pixels, cols));
        }
        let (mut mean, mut covariance) = (vec![0.0; pixels], Matrix::zeros(pixels, pixels));
        add_moments(&clean, self.stay, &mut mean, &mut covariance);
        if self.stay < 1.0 {
            let moved = shifted(&clean, cols, self.reach);
            add_moments(&moved, 1.0 - self.stay, &mut mean, &mut covariance);
        }
        if !self.centred {
            mean.fill(0.0);
        }
        for i in 0..pixels {
            let row = covariance.row_mut(i);
            for (c, m) in row.iter_mut().zip(&mean) {
                *c -= mean[i] * m;
            }
            row[i] += self.floor * self.floor;
        }
        Gaussian::new(mean, covariance)
    }

    fn check(&self) -> Result<(), Refusal> {
        non_negative_share("stay", self.stay)?;
        below_one("threshold", self.threshold)?;
        positive("floor", self.floor)?;
        Ok(())
    }

    /// The images that are not zero, without background, of equal length if wanted.
    fn clean(&self, images: &Matrix) -> Matrix {
        let mut kept: Vec<Vec<f64>> = Vec::new();
        for k in 0..images.ncols() {
            let mut image = images.column(k);
            let background = self.threshold * image.iter().copied().fold(0.0, f64::max);
            if background > 0.0 {
                image.iter_mut().filter(|v| **v < background).for_each(|v| *v = 0.0);
            }
            if image.iter().any(|v| *v != 0.0) {
                kept.push(image);
            }
        }
        if self.equal_length {
            let lengths: Vec<f64> = kept.iter().map(|image| norm(image)).collect();
            let common = norm(&lengths) / (lengths.len().max(1) as f64).sqrt();
            for (image, length) in kept.iter_mut().zip(&lengths) {
                image.iter_mut().for_each(|v| *v *= common / length);
            }
        }
        Matrix::from_column_slices(images.nrows(), &kept)
    }
}

/// Adds `weight` times the mean and the second moments of the columns.
fn add_moments(columns: &Matrix, weight: f64, mean: &mut [f64], second: &mut Matrix) {
    let each = weight / columns.ncols() as f64;
    for (i, mean) in mean.iter_mut().enumerate() {
        *mean += each * columns.row(i).iter().sum::<f64>();
        for j in 0..=i {
            let value = each * dot(columns.row(i), columns.row(j));
            second.row_mut(i)[j] += value;
            if j < i {
                second.row_mut(j)[i] += value;
            }
        }
    }
}

/// `value` when it is finite and above zero.
pub(super) fn positive(field: &'static str, value: f64) -> Result<f64, Refusal> {
    within(field, value, value > 0.0 && value.is_finite(), "(0, ∞)")
}

/// `value` when it is in (0, 1].
pub(super) fn share(field: &'static str, value: f64) -> Result<f64, Refusal> {
    within(field, value, value > 0.0 && value <= 1.0, "(0, 1]")
}

/// `value` when it is in [0, 1].
pub(super) fn non_negative_share(field: &'static str, value: f64) -> Result<f64, Refusal> {
    within(field, value, (0.0..=1.0).contains(&value), "[0, 1]")
}

/// `value` when it is in [0, 1).
pub(super) fn below_one(field: &'static str, value: f64) -> Result<f64, Refusal> {
    within(field, value, (0.0..1.0).contains(&value), "[0, 1)")
}

fn within(field: &'static str, value: f64, ok: bool, range: &'static str) -> Result<f64, Refusal> {
    if ok { Ok(value) } else { Err(Refusal::range(field, value, range)) }
}

/// How strongly a recovery penalises its unknowns, in place of fitting the samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Penalty {
    /// As given, in (0, ∞).
    Absolute(f64),
    /// Relative to the largest correlation of a column with `y`, maxₖ aₖᵀ y / M; in (0, 1]. The solution then scales
    /// with `y`. At 1 the solution of the lasso is zero.
    Relative(f64),
}

impl Penalty {
    /// The penalty when it is in its range.
    ///
    /// # Errors
    /// [`Refusal`] when it is not.
    pub(super) fn checked(self) -> Result<Self, Refusal> {
        match self {
            Self::Absolute(value) => positive("alpha", value)?,
            Self::Relative(value) => share("alpha", value)?,
        };
        Ok(self)
    }
}

/// Standard deviation of the noise of a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Noise {
    /// In the unit of `y`, in (0, ∞).
    Absolute(f64),
    /// Relative to the root mean square of `y`, in (0, ∞). Contact noise grows with the contact.
    Relative(f64),
}

impl Noise {
    /// The noise when it is in its range.
    ///
    /// # Errors
    /// [`Refusal`] when it is not.
    pub(super) fn checked(self) -> Result<Self, Refusal> {
        match self {
            Self::Absolute(value) | Self::Relative(value) => positive("noise", value)?,
        };
        Ok(self)
    }

    /// Standard deviation for the measurements `y`.
    pub(super) fn deviation(self, y: &[f64]) -> f64 {
        match self {
            Self::Absolute(value) => value,
            Self::Relative(share) => share * norm(y) / (y.len().max(1) as f64).sqrt(),
        }
    }
}

/// Stopping criterion of an iteration: it ends when its error, as the method defines it, is at most `tol`, or fails
/// with a refusal after `max_iter` iterations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stopping {
    /// Largest error, in (0, ∞). If the method cannot reach it, as with 0 or NaN, it fails.
    pub tol: f64,
    /// Largest number of iterations.
    pub max_iter: usize,
}

/// No image, or images that do not fit the grid.
pub(crate) fn no_images(images: usize, pixels: usize, cols: usize) -> Refusal {
    Refusal::new(format!("{images} images of {pixels} pixels do not make a prior on a grid of {cols} columns"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checks::says;

    #[test]
    fn what_is_no_gaussian_is_refused() {
        let matrix = |v: [f64; 4]| Matrix::from_rows(2, 2, v.to_vec()).unwrap();
        let new = |mean: &[f64], v| Gaussian::new(mean.to_vec(), matrix(v));
        let unit = [1.0, 0.0, 0.0, 1.0];
        assert!(says(&new(&[0.0], unit), "`mean` has 1 entries"));
        assert!(says(&new(&[f64::NAN, 0.0], unit), "`mean` holds"));
        assert!(says(&new(&[0.0; 2], [1.0, 0.5, 0.4, 1.0]), "covariance[1, 0]"));
        assert!(says(&new(&[0.0; 2], [1.0, 2.0, 2.0, 1.0]), "covariance is not positive definite"));
        assert!(says(&Gaussian::white(2, 0.0), "covariance is not positive definite"));
    }

    fn pixel(height: f64) -> Matrix {
        Matrix::from_rows(9, 1, vec![0.0, 0.0, 0.0, 0.0, height, 0.0, 0.0, 0.0, 0.0]).unwrap()
    }

    /// One pixel in the middle of 3 × 3, moved by up to one pixel: nine images of one pixel each.
    #[test]
    fn moments_of_a_moving_pixel() {
        let settings =
            ImagePrior { reach: 1, stay: 0.0, threshold: 0.0, equal_length: false, centred: true, floor: 0.5 };
        let prior = settings.learn(&pixel(3.0), 3).unwrap();
        for (i, mean) in prior.mean().iter().enumerate() {
            assert!((mean - 1.0 / 3.0).abs() < 1e-15);
            for j in 0..9 {
                // E x² = 9/9, E xᵢ xⱼ = 0, μ² = 1/9
                let expected = if i == j { 1.0 - 1.0 / 9.0 + 0.25 } else { -1.0 / 9.0 };
                assert!((prior.covariance().row(i)[j] - expected).abs() < 1e-14);
            }
        }
        let about_zero = ImagePrior { centred: false, stay: 0.5, ..settings };
        let prior = about_zero.learn(&pixel(3.0), 3).unwrap();
        assert_eq!(prior.mean(), [0.0; 9]);
        // half of the weight stays in the middle, the other half is spread over nine places
        for (i, expected) in [(4, 0.5 * 9.0 + 0.5 * 1.0 + 0.25), (0, 0.5 * 1.0 + 0.25)] {
            assert!((prior.covariance().row(i)[i] - expected).abs() < 1e-14);
        }
    }

    /// A weak and a strong image, each with a background of a tenth of its peak.
    #[test]
    fn backgrounds_go_and_lengths_become_equal() {
        let images = Matrix::from_rows(2, 2, vec![1.0, 0.7, 0.1, 7.0]).unwrap();
        let prior = ImagePrior { reach: 0, ..ImagePrior::UNSEEN };
        let learned = prior.learn(&images, 2).unwrap();
        // √((1² + 7²)/2) = 5 is the common length, and each image has half of the weight
        let expected = 0.5 * 25.0 + 0.01 * 0.01;
        for i in 0..2 {
            assert!((learned.covariance().row(i)[i] - expected).abs() < 1e-12);
            assert!(learned.covariance().row(i)[1 - i].abs() < 1e-12);
        }
    }

    #[test]
    fn what_makes_no_prior_is_refused() {
        let image = Matrix::from_rows(4, 1, vec![1.0; 4]).unwrap();
        for (images, cols) in [(&image, 3), (&image, 0), (&Matrix::zeros(4, 2), 2), (&Matrix::zeros(4, 0), 2)] {
            let refused = ImagePrior::UNSEEN.learn(images, cols);
            assert!(says(&refused, "do not make a prior"), "{refused:?}");
        }
        let broken = Matrix::from_rows(4, 1, vec![1.0, f64::NAN, 0.0, 0.0]).unwrap();
        let refused = ImagePrior::SEEN.learn(&broken, 2).unwrap_err();
        assert!(refused.to_string().contains("`images` holds"));
        let unseen = ImagePrior::UNSEEN;
        for (prior, field) in [
            (ImagePrior { stay: 1.1, ..unseen }, "stay"),
            (ImagePrior { threshold: 1.0, ..unseen }, "threshold"),
            (ImagePrior { floor: 0.0, ..unseen }, "floor"),
        ] {
            let refused = prior.learn(&image, 2);
            assert!(says(&refused, &format!("`{field}` = ")), "{refused:?}");
        }
    }
}
