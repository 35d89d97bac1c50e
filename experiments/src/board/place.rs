//! Where the ball is: the localisation part of the board.

use super::rows::PlaceRow;
use crate::score::{Arm, find_bounces, localise, localise_blobs};
use spts_recon::RangeError;

/// Rows of every decoder at every M of `measurements`; none without a recording of the ball.
///
/// # Errors
/// [`RangeError`] when the sheet is no grid of the arm's columns.
pub(super) fn places(arm: &Arm, measurements: &[usize]) -> Result<Vec<PlaceRow>, RangeError> {
    let Some(recording) = &arm.bounces else {
        return Ok(Vec::new());
    };
    let bounces = find_bounces(recording);
    let published = localise(recording, &bounces, &arm.learned.shifted, measurements, arm.cols);
    let mut rows: Vec<PlaceRow> = Vec::new();
    for row in published {
        rows.push(PlaceRow {
            decoder: row.decode.to_owned(),
            m: row.m,
            relabelled: false,
            mean_px: row.mean_px,
            share_under_1px: row.share_under_1px,
        });
    }
    for relabelled in [false, true] {
        for row in localise_blobs(recording, &bounces, measurements, arm.cols, relabelled)? {
            rows.push(PlaceRow {
                decoder: "blob".to_owned(),
                m: row.m,
                relabelled,
                mean_px: row.mean_px,
                share_under_1px: row.share_under_1px,
            });
        }
    }
    Ok(rows)
}
