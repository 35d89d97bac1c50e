//! Where the ball is: the localisation part of the board.

use super::rows::PlaceRow;
use crate::score::{find_bounces, localise, localise_blobs};
use spts_circuit::Recording;
use spts_recon::{Matrix, RangeError};

/// Rows of every decoder at every M of `measurements`: the published pursuits on the dictionary `shifted`, and blobs.
///
/// # Errors
/// [`RangeError`] when the sheet is no grid of `cols` columns.
pub(super) fn places(
    recording: &Recording,
    shifted: &Matrix,
    cols: usize,
    measurements: &[usize],
) -> Result<Vec<PlaceRow>, RangeError> {
    let bounces = find_bounces(recording);
    let published = localise(recording, &bounces, shifted, measurements, cols);
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
        for row in localise_blobs(recording, &bounces, measurements, cols, relabelled)? {
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
