//! Gaussian priors of images on a grid.

use super::parameter::{ParameterError, below_one, non_negative_share, positive};
use super::prior::{Gaussian, PriorError};
use crate::kernels::{dot, norm};
use crate::matrix::Matrix;
use crate::shifted::shifted;

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
    pub const UNSEEN: Self = Self {
        reach: 2,
        stay: 0.3,
        threshold: 0.5,
        equal_length: true,
        centred: false,
        floor: 0.01,
    };

    /// For the same objects at the same places as in the example images: their mean and covariance.
    pub const SEEN: Self = Self {
        reach: 0,
        stay: 1.0,
        threshold: 0.0,
        equal_length: false,
        centred: true,
        floor: 0.025,
    };

    /// Prior of images that resemble `images` (N × number of images, each with `cols` columns, row-major). Images that
    /// are zero everywhere are ignored.
    ///
    /// C = Σ v x xᵀ − μ μᵀ + floor² I with μ = Σ v x, or μ = 0 if not centred. The weights v sum to 1.
    ///
    /// # Errors
    /// [`PriorError`] if every image is zero, one is not finite, the grid does not fit, or a parameter is outside its
    /// range.
    pub fn learn(&self, images: &Matrix, cols: usize) -> Result<Gaussian, PriorError> {
        self.check()?;
        let pixels = images.nrows();
        if !images.view().values().iter().all(|v| v.is_finite()) {
            return Err(PriorError::NotFinite { field: "images" });
        }
        let clean = self.clean(images);
        if clean.ncols() == 0 || cols == 0 || !pixels.is_multiple_of(cols) {
            return Err(PriorError::Images {
                images: clean.ncols(),
                pixels,
                cols,
            });
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

    fn check(&self) -> Result<(), ParameterError> {
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
        let slices: Vec<&[f64]> = kept.iter().map(Vec::as_slice).collect();
        Matrix::from_column_slices(images.nrows(), &slices)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn pixel(height: f64) -> Matrix {
        Matrix::from_rows(9, 1, vec![0.0, 0.0, 0.0, 0.0, height, 0.0, 0.0, 0.0, 0.0]).unwrap()
    }

    /// One pixel in the middle of 3 × 3, moved by up to one pixel: nine images of one pixel each.
    #[test]
    fn moments_of_a_moving_pixel() {
        let settings = ImagePrior {
            reach: 1,
            stay: 0.0,
            threshold: 0.0,
            equal_length: false,
            centred: true,
            floor: 0.5,
        };
        let prior = settings.learn(&pixel(3.0), 3).unwrap();
        for (i, mean) in prior.mean().iter().enumerate() {
            assert!((mean - 1.0 / 3.0).abs() < 1e-15);
            for j in 0..9 {
                // E x² = 9/9, E xᵢ xⱼ = 0, μ² = 1/9
                let expected = if i == j { 1.0 - 1.0 / 9.0 + 0.25 } else { -1.0 / 9.0 };
                assert!((prior.covariance().row(i)[j] - expected).abs() < 1e-14);
            }
        }
        let about_zero = ImagePrior {
            centred: false,
            stay: 0.5,
            ..settings
        };
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
        let prior = ImagePrior {
            reach: 0,
            ..ImagePrior::UNSEEN
        };
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
        for (images, cols) in [
            (&image, 3),
            (&image, 0),
            (&Matrix::zeros(4, 2), 2),
            (&Matrix::zeros(4, 0), 2),
        ] {
            let refused = ImagePrior::UNSEEN.learn(images, cols);
            assert!(matches!(refused, Err(PriorError::Images { .. })), "{refused:?}");
        }
        let broken = Matrix::from_rows(4, 1, vec![1.0, f64::NAN, 0.0, 0.0]).unwrap();
        let refused = ImagePrior::SEEN.learn(&broken, 2).unwrap_err();
        assert_eq!(refused, PriorError::NotFinite { field: "images" });
        let unseen = ImagePrior::UNSEEN;
        for (prior, field) in [
            (ImagePrior { stay: 1.1, ..unseen }, "stay"),
            (
                ImagePrior {
                    threshold: 1.0,
                    ..unseen
                },
                "threshold",
            ),
            (ImagePrior { floor: 0.0, ..unseen }, "floor"),
        ] {
            let refused = prior.learn(&image, 2).unwrap_err();
            assert!(
                matches!(&refused, PriorError::Parameter(p) if p.field == field),
                "{refused}"
            );
        }
    }
}
