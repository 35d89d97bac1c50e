//! Rows of the localisation tables.

use crate::sensing::Sensing;
use serde::{Deserialize, Serialize};
use spts_recon::metrics::median;

/// The contact of rows that do not say it.
pub(super) const BALL: &str = "ball";

fn ball() -> String {
    BALL.to_owned()
}

/// How well one decoder at one M finds the place of a bouncing ball or of touches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlaceRow {
    /// Kind of contact: "ball", or the name of a session of touches.
    #[serde(default = "ball")]
    pub contact: String,
    /// Algorithm.
    pub decoder: String,
    /// Number of measurements, M.
    pub m: usize,
    /// Whether the taxels were relabelled cyclically, so that the contact may be anywhere. As recorded, all drops fall
    /// near the middle.
    pub relabelled: bool,
    /// How the rows of a window are obtained.
    #[serde(default)]
    pub sensing: Sensing,
    /// Mean distance from the true centre, taxels.
    pub mean_px: f64,
    /// Share of windows within one taxel.
    pub share_under_1px: f64,
}

/// How well one variant of the published decoder at one M finds the place of the bouncing ball.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LocalisationRow {
    /// Decoding variant.
    pub decode: &'static str,
    /// Number of measurements.
    pub m: usize,
    /// Mean distance between the estimated and the true centre, taxels.
    pub mean_px: f64,
    /// Median distance, taxels.
    pub median_px: f64,
    /// Share of windows within one taxel.
    pub share_under_1px: f64,
}

/// Distances from the true centre, taxels.
pub(super) struct Located {
    pub(super) locator: &'static str,
    pub(super) m: usize,
    pub(super) relabelled: bool,
    pub(super) sensing: Sensing,
    pub(super) errors_px: Vec<f64>,
}

impl Located {
    /// Mean distance and share of windows within one taxel; `None` without a window.
    fn mean(&self) -> Option<(f64, f64)> {
        let count = self.errors_px.len() as f64;
        let near = self.errors_px.iter().filter(|e| **e < 1.0).count() as f64;
        (count > 0.0).then(|| (self.errors_px.iter().sum::<f64>() / count, near / count))
    }

    pub(super) fn place_row(&self, contact: &str) -> Option<PlaceRow> {
        let (mean_px, share_under_1px) = self.mean()?;
        Some(PlaceRow {
            contact: contact.to_owned(),
            decoder: self.locator.to_owned(),
            m: self.m,
            relabelled: self.relabelled,
            sensing: self.sensing,
            mean_px,
            share_under_1px,
        })
    }

    pub(super) fn localisation_row(&self) -> Option<LocalisationRow> {
        let (mean_px, share_under_1px) = self.mean()?;
        Some(LocalisationRow {
            decode: self.locator,
            m: self.m,
            mean_px,
            median_px: median(&self.errors_px)?,
            share_under_1px,
        })
    }
}
