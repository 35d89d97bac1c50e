//! The control: the raster session, reduced to M pixels a frame and interpolated.
//!
//! Some images of the published library are frames that are scored here, so the classification of the real control is
//! not held out. That of the twin is, and so are all compressive scores. Evenly spaced pixels of a square array admit
//! several Delaunay triangulations with different diagonals; other libraries differ by a few hundredths at small M.

use crate::protocol::Truth;
use crate::session::ScoredSession;
use crate::tally::{Tally, pool};
use crate::training::Learned;
use crate::validation::ScoreRow;
use rayon::prelude::*;
use spts_recon::Workspace;
use spts_recon::raster::Interpolation;

/// Name of the control on the board.
pub const RASTER: &str = "raster";

/// Scores the raster recording of an object at every M.
#[must_use]
pub fn score_raster(session: &ScoredSession, learned: &Learned, measurements: &[usize]) -> Vec<ScoreRow> {
    let Some(recording) = &session.raster else {
        return Vec::new();
    };
    let protocol = &session.raster_protocol;
    let truth = Truth::new(recording, protocol);
    let cols = learned.cols;
    let rows = recording.taxels() / cols.max(1);
    measurements
        .par_iter()
        .filter_map(|&m| {
            let interpolation = Interpolation::evenly_spaced(rows, cols, m);
            let mut image = vec![0.0; recording.taxels()];
            let mut work = Workspace::default();
            let presses: Vec<Tally> = protocol
                .presses_of(recording)
                .map(|block| {
                    let (mut tally, mut decisions) = (Tally::default(), Vec::new());
                    let last = (protocol.first_frame + protocol.frames).min(recording.frames());
                    for frame in protocol.first_frame..last {
                        interpolation.apply(recording.volts(block, frame), &mut image);
                        tally.image(&image, &truth.support);
                        let decision = learned.classifier.classify(&image, &mut work);
                        decisions.push(decision.unwrap_or_default());
                    }
                    tally.decisions(&decisions, session.label, protocol.vote);
                    tally
                })
                .collect();
            ScoreRow::new(session, RASTER, m, &pool(&presses))
        })
        .collect()
}
