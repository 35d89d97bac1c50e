//! Median raster images, and single reconstructions for the picture sheets.

use spts_circuit::Recording;
use spts_eval::decoders::TrainedDecoder;
use spts_eval::protocol::PLATEAU;
use spts_eval::{Press, ScoredSession, Scorer, idle_mean};
use spts_recon::metrics::median;

/// Step between the frames that enter the median.
const STRIDE: usize = 10;

/// Median raster image over the plateau frames of all presses but the first, which conditions the foam (a single press
/// is taken as it is), V.
#[must_use]
pub(super) fn median_image(raster: &Recording) -> Vec<f64> {
    let presses = raster.blocks().len();
    let first = usize::from(presses > 1);
    let frames: Vec<&[f64]> = (first..presses)
        .flat_map(|press| PLATEAU.step_by(STRIDE).map(move |frame| (press, frame)))
        .filter(|(_, frame)| *frame < raster.frames())
        .map(|(press, frame)| raster.volts(press, frame))
        .collect();
    (0..raster.taxels())
        .map(|taxel| median(&frames.iter().map(|f| f[taxel]).collect::<Vec<_>>()).unwrap_or(0.0))
        .collect()
}

/// A window of measurements and the images reconstructed from its first M, for several M.
#[derive(Debug, Clone)]
pub(super) struct ProgressiveImages {
    /// Measurements less the idle mean, V.
    pub(super) y: Vec<f64>,
    /// M and image.
    pub(super) images: Vec<(usize, Vec<f64>)>,
}

/// Reconstructs the first M measurements of frame `frame` of press `block`, for every M, as `decoder` decodes them.
#[must_use]
pub(super) fn progressive(
    decoder: &TrainedDecoder,
    session: &ScoredSession,
    block: usize,
    frame: usize,
    measurements: &[usize],
) -> Option<ProgressiveImages> {
    let recording = session.compressive.as_ref().filter(|r| block < r.blocks().len())?;
    let longest = measurements.iter().copied().max()?;
    let start = frame * recording.measurements_per_frame();
    if start + longest > recording.blocks()[block].volts.len() {
        return None;
    }
    let press = Press::within(recording, block, start..start + longest, idle_mean(recording, block));
    let mut scorer = Scorer::new(decoder);
    let mut images = Vec::new();
    for &m in measurements {
        let answer = scorer.answers(&[press.window(0, m)?]).ok()?.pop()?;
        images.push((m, answer.image));
    }
    let y = press.window(0, longest)?.y.to_vec();
    Some(ProgressiveImages { y, images })
}
