//! Comparison of images with touches.

use super::scene::Touch;
use spts_models::SkinLayout;
use spts_recon::localise::{centre_of_mass, distance};
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
use spts_recon::statistics::{Band, Sample};

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

/// Probability outside of a [`band`].
const OUTSIDE: f64 = 0.1;

/// Mean of independent repetitions, each with its own skin, noise and touches, and its 90 % confidence interval. The
/// band of a single one has no width. `None` without repetitions.
#[must_use]
pub fn band(repetitions: &[f64]) -> Option<Band> {
    Sample::of(repetitions).map(|sample| sample.band(OUTSIDE))
}
