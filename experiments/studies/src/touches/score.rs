//! Comparison of images with touches.

use super::scene::Touch;
use crate::budget::student::two_sided;
use serde::Serialize;
use spts_models::SkinLayout;
use spts_recon::localise::{centre_of_mass, distance};
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};

/// How well a decoded image shows a simulated touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchScore {
    /// Intersection over union of the supports.
    pub iou: f64,
    /// Distance of the centres, taxels; `None` if the image or the touch is empty.
    pub place_px: Option<f64>,
}

impl TouchScore {
    /// The scores of `image`, one value a taxel, in any unit.
    ///
    /// # Panics
    /// If image and touch have different numbers of taxels.
    #[must_use]
    pub fn of(image: &[f64], touch: &Touch, layout: &SkinLayout) -> Self {
        assert_eq!(image.len(), touch.support.len(), "taxels");
        let mut found = Vec::new();
        support(image, SUPPORT_THRESHOLD, &mut found);
        let centre = centre_of_mass(image, layout.cols(), SUPPORT_THRESHOLD);
        Self {
            iou: SupportScore::new(&found, &touch.support).iou,
            place_px: centre.zip(touch.centre_px).map(|(a, b)| distance(a, b)),
        }
    }
}

/// A mean over independent repetitions, each with its own skin, noise and touches, and its 90 % confidence interval.
///
/// ```
/// use spts_studies::touches::band;
///
/// let iou = band(&[0.78, 0.80, 0.82]).expect("three repetitions");
/// assert!((iou.mean - 0.80).abs() < 1e-12 && iou.low < 0.78 && iou.high > 0.82);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Band {
    /// Mean of the repetitions.
    pub mean: f64,
    /// Lower end: mean − t s/√R, with Student's t of 90 % and R − 1 degrees of freedom.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Probability outside of a band.
const OUTSIDE: f64 = 0.1;
/// The largest quantile of a band is 6.314, with one degree of freedom; and halvings that find it to rounding.
const QUANTILE: (f64, usize) = (7.0, 60);

/// t with P(|T| > t) = [`OUTSIDE`] for Student's t with `freedom` degrees of freedom, by bisection.
fn quantile(freedom: u32) -> f64 {
    let (mut low, mut high) = (0.0, QUANTILE.0);
    for _ in 0..QUANTILE.1 {
        let middle = 0.5 * (low + high);
        if two_sided(middle, freedom) > OUTSIDE {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// Mean and band of `repetitions`. The band of a single one has no width. `None` without repetitions.
#[must_use]
pub fn band(repetitions: &[f64]) -> Option<Band> {
    let count = repetitions.len();
    if count == 0 {
        return None;
    }
    let mean = repetitions.iter().sum::<f64>() / count as f64;
    let square: f64 = repetitions.iter().map(|v| (v - mean).powi(2)).sum();
    let half = match count {
        1 => 0.0,
        _ => {
            let freedom = u32::try_from(count - 1).unwrap_or(u32::MAX);
            quantile(freedom) * (square / (count - 1) as f64 / count as f64).sqrt()
        }
    };
    Some(Band {
        mean,
        low: mean - half,
        high: mean + half,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_by_hand() {
        // mean 2, s = 1; t = 2.920 as tabulated, to half a unit of its last digit
        let b = band(&[1.0, 2.0, 3.0]).unwrap();
        assert!((b.mean - 2.0).abs() < 1e-12 && (b.high - 2.0 - 2.920 / 3.0_f64.sqrt()).abs() < 5e-4);
        assert!((quantile(1) - 6.314).abs() < 5e-4);
        assert!((b.high + b.low - 4.0).abs() < 1e-12);
        let one = band(&[0.5]).unwrap();
        assert_eq!(
            (one.low.to_bits(), one.high.to_bits()),
            (0.5_f64.to_bits(), 0.5_f64.to_bits())
        );
        assert_eq!(band(&[]), None);
    }
}
