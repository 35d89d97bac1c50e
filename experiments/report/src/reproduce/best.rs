//! The decoders that do best, beside the published ones.

use spts_eval::decoders::{TrainedDecoder, find};
use spts_eval::training::{LearnError, TrainingData, TrainingPresses};
use spts_models::Streams;

/// The best in both tasks, images and classes of objects that were learned; and the best image of any object.
pub(super) const BEST: [&str; 2] = ["evidence", "nn_lmmse"];
/// The one in the pictures.
pub(super) const SHOWN: &str = BEST[0];

/// The decoders of [`BEST`], each beside its name, after they have learned from `presses` of a sheet of `cols` columns;
/// none without presses.
///
/// # Errors
/// [`LearnError`] when the presses cannot be learned from.
pub(super) fn best<'a>(
    presses: impl Iterator<Item = TrainingPresses<'a>>,
    cols: usize,
    streams: Streams,
) -> Result<Vec<(&'static str, TrainedDecoder)>, LearnError> {
    let presses: Vec<_> = presses.filter(|p| !p.is_empty()).collect();
    if presses.is_empty() {
        return Ok(Vec::new());
    }
    let data = TrainingData::new(&presses, cols, Vec::new(), streams)?;
    let specs = BEST.iter().filter_map(|name| find(name));
    specs
        .map(|spec| Ok((spec.name, TrainedDecoder::new(spec, &data)?)))
        .collect()
}
