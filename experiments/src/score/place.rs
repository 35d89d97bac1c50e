//! Localisation of the bouncing ball by the evidence of blobs, as recorded and relabelled.

use super::bounce::{Bounce, LocalisationRow, contact_image};
use rayon::prelude::*;
use spts_circuit::{Recording, Seeding, WeightMode, Weights};
use spts_recon::RangeError;
use spts_recon::localise::{BlobConfig, Localiser, centre_of_mass, distance};
use spts_recon::metrics::{SUPPORT_THRESHOLD, median};

/// A relabelled contact's centre keeps this distance from the outer taxels, taxels.
const MARGIN_PX: f64 = 1.2;

/// Localises every contact from every window of M consecutive measurements by [`Localiser::estimate`]. The truth is the one of
/// [`super::localise`]. With `relabelled`, every contact is tried at each cyclic shift of the taxels that leaves its centre
/// 1.2 taxels or more from the edge: as recorded, all drops fall on the middle of the sheet, which a guess finds too.
///
/// # Errors
/// [`RangeError`] when the sheet is no grid of `cols` columns.
pub fn localise_blobs(
    recording: &Recording,
    bounces: &[Bounce],
    measurements: &[usize],
    cols: usize,
    relabelled: bool,
) -> Result<Vec<LocalisationRow>, RangeError> {
    let rows = recording.taxels() / cols.max(1);
    let localiser = Localiser::new(&BlobConfig::new(rows, cols))?;
    let per_bounce: Vec<Vec<Vec<f64>>> = bounces
        .par_iter()
        .filter_map(|bounce| {
            let centre = centre_of_mass(&contact_image(recording, bounce)?, cols, SUPPORT_THRESHOLD)?;
            let contact = Contact::new(recording, bounce, [rows, cols], centre);
            let shifts = if relabelled { contact.shifts() } else { vec![[0, 0]] };
            let errors = |&m: &usize| shifts.iter().flat_map(|&s| contact.errors(&localiser, s, m)).collect();
            Some(measurements.iter().map(errors).collect())
        })
        .collect();
    let rows = measurements.iter().enumerate().filter_map(|(i, &m)| {
        let errors: Vec<f64> = per_bounce.iter().flat_map(|b| b[i].iter().copied()).collect();
        #[expect(clippy::cast_precision_loss, reason = "some thousand windows")]
        let share = |part: f64| part / errors.len() as f64;
        Some(LocalisationRow {
            decode: if relabelled { "blob_relabelled" } else { "blob" },
            m,
            mean_px: share(errors.iter().sum()),
            median_px: median(&errors)?,
            share_under_1px: share(errors.iter().map(|e| f64::from(u8::from(*e < 1.0))).sum()),
        })
    });
    Ok(rows.collect())
}

/// One contact: its rows of weights, samples and true centre.
struct Contact {
    shape: [usize; 2],
    centre: [f64; 2],
    weights: Vec<f64>,
    y: Vec<f64>,
}

impl Contact {
    fn new(recording: &Recording, bounce: &Bounce, shape: [usize; 2], centre: [f64; 2]) -> Self {
        let samples = &recording.blocks()[bounce.block].volts[bounce.start..bounce.end];
        #[expect(clippy::cast_possible_truncation, reason = "a skin has at most 2^24 taxels")]
        let generator = Weights::new(WeightMode::Binary, Seeding::Address, recording.taxels() as u32);
        let mut weights = vec![0.0; samples.len() * recording.taxels()];
        generator.fill_rows(recording.first_row(bounce.block, 0) + bounce.start as u64, &mut weights);
        Self {
            shape,
            centre,
            weights,
            y: samples.iter().map(|v| v - bounce.idle).collect(),
        }
    }

    /// The centre after a cyclic shift by whole taxels.
    #[expect(clippy::cast_precision_loss, reason = "coordinates of a grid")]
    fn moved(&self, shift: [usize; 2]) -> [f64; 2] {
        [0, 1].map(|k| (self.centre[k] + shift[k] as f64) % self.shape[k] as f64)
    }

    /// Shifts that leave the centre far enough from the edge.
    #[expect(clippy::cast_precision_loss, reason = "coordinates of a grid")]
    fn shifts(&self) -> Vec<[usize; 2]> {
        let all = (0..self.shape[0]).flat_map(|r| (0..self.shape[1]).map(move |c| [r, c]));
        let inside = |k: usize, at: f64| (MARGIN_PX..=self.shape[k] as f64 - 1.0 - MARGIN_PX).contains(&at);
        all.filter(|&s| {
            let [r, c] = self.moved(s);
            inside(0, r) && inside(1, c)
        })
        .collect()
    }

    fn errors(&self, localiser: &Localiser, shift: [usize; 2], m: usize) -> Vec<f64> {
        let ([rows, cols], truth) = (self.shape, self.moved(shift));
        let mut evidence = localiser.evidence();
        let (mut relabelled, mut projected) = (vec![0.0; rows * cols], Vec::new());
        let weights = self.weights.chunks_exact(rows * cols * m.max(1));
        weights
            .zip(self.y.chunks_exact(m.max(1)))
            .filter_map(|(window, y)| {
                evidence.clear();
                for (row, &y) in window.chunks_exact(rows * cols).zip(y) {
                    for (i, w) in row.iter().enumerate() {
                        relabelled[(i / cols + shift[0]) % rows * cols + (i % cols + shift[1]) % cols] = *w;
                    }
                    localiser.project(&relabelled, &mut projected).ok()?;
                    evidence.observe(&projected, y).ok()?;
                }
                Some(distance(localiser.estimate(&mut evidence).position_px, truth))
            })
            .collect()
    }
}
