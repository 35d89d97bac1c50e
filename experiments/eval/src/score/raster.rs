//! The control: the raster session, down-sampled to M pixels a frame and interpolated.
//!
//! Some of the published library's images are frames that are scored here, so the real control's classification is not held out; the
//! twin's is, and so are all compressive scores. Evenly spaced pixels of a square array leave the Delaunay triangulation free to choose
//! diagonals: other libraries differ by a few hundredths at small M.

use super::protocol::Truth;
use super::scored::ScoredSession;
use super::session::{Learned, Partial, ScoreRow, score_row};
use rayon::prelude::*;
use spts_recon::Workspace;
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
use spts_recon::raster::Interpolation;

/// Name of the control on the board.
pub const RASTER: &str = "raster";

/// Scores the raster session of an object at every M. The array is `rows × cols` taxels.
#[must_use]
pub fn score_raster(session: &ScoredSession, learned: &Learned, measurements: &[usize], cols: usize) -> Vec<ScoreRow> {
    let Some(recording) = &session.raster else {
        return Vec::new();
    };
    let protocol = &session.raster_protocol;
    let truth = Truth::new(recording, protocol);
    let rows = recording.taxels() / cols.max(1);
    measurements
        .par_iter()
        .filter_map(|&m| {
            let interpolation = Interpolation::evenly_spaced(rows, cols, m);
            let mut image = vec![0.0; recording.taxels()];
            let (mut mask, mut work) = (Vec::new(), Workspace::default());
            let presses: Vec<Partial> = protocol
                .presses_of(recording)
                .map(|block| {
                    let mut partial = Partial::default();
                    let last = (protocol.first_frame + protocol.frames).min(recording.frames());
                    for frame in protocol.first_frame..last {
                        interpolation.apply(recording.volts(block, frame), &mut image);
                        support(&image, SUPPORT_THRESHOLD, &mut mask);
                        partial.support.push(SupportScore::new(&mask, &truth.support));
                        let decision = learned.classifier.classify(&image, &mut work);
                        partial.decisions.push(decision.unwrap_or_default());
                    }
                    partial
                })
                .collect();
            score_row(session, RASTER, m, &presses.iter().collect::<Vec<_>>(), protocol.vote)
        })
        .collect()
}
