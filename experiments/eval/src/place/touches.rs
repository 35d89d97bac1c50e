//! A touch of a skin, flat or bent: its start and end, and the touched taxel.

use crate::chunk::Chunk;
use crate::untouched::Untouched;
use crate::windows::Press;
use spts_circuit::Recording;
use spts_recon::metrics::median;

/// Frames at the start of a block that are taken to be without a touch.
const QUIET_FRAMES: usize = 20;
/// Touched when the output of a frame, without that of the untouched skin, is this many times as large as in the quiet
/// frames.
const THRESHOLD: f64 = 2.0;
/// A touch lasts for at least as many frames.
const SHORTEST_FRAMES: usize = 5;
/// Frames before a touch that the untouched skin is not estimated from.
const MARGIN_FRAMES: usize = 5;

/// A touch found in a recording that does not say when it is touched: measurements `start..end` of a block.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedTouch {
    /// Block of the recording.
    pub block: usize,
    /// First measurement of the touch, accurate to a frame.
    pub start: usize,
    /// One past its last measurement, accurate to a frame.
    pub end: usize,
    /// Output without a touch, estimated from the frames before it.
    pub untouched: Untouched,
}

/// Finds one touch in every block that has one: from the first to the last frame in which the output differs from that
/// of the untouched skin. A touch lasts for five frames or more. The first 20 frames of a block must be without a
/// touch, because the output of the untouched skin is estimated from them; two touches in a block are found as one.
#[must_use]
pub fn find_touches(recording: &Recording) -> Vec<RecordedTouch> {
    let blocks = 0..recording.blocks().len();
    blocks.filter_map(|block| touch_of(recording, block)).collect()
}

/// The touch of block `block`.
pub(crate) fn touch_of(recording: &Recording, block: usize) -> Option<RecordedTouch> {
    if recording.frames() < QUIET_FRAMES + SHORTEST_FRAMES {
        return None;
    }
    let per_frame = recording.measurements_per_frame();
    let mut quiet = QUIET_FRAMES;
    let mut found = None;
    // the longer the untouched skin is seen, the better it is known
    for _ in 0..2 {
        let untouched = Untouched::in_frames(recording, block, quiet);
        let levels = levels(recording, block, &untouched);
        let limit = THRESHOLD * median(&levels[..quiet])?;
        let touched = |frame: &[f64]| frame.iter().all(|level| *level > limit);
        let first = levels[QUIET_FRAMES..].windows(SHORTEST_FRAMES).position(touched)? + QUIET_FRAMES;
        let last = levels.iter().rposition(|level| *level > limit)?;
        found = Some(RecordedTouch {
            block,
            start: first * per_frame,
            end: (last + 1) * per_frame,
            untouched,
        });
        quiet = first.saturating_sub(MARGIN_FRAMES).max(QUIET_FRAMES);
    }
    found
}

/// Root mean square of every frame without what the untouched skin gives, V.
fn levels(recording: &Recording, block: usize, untouched: &Untouched) -> Vec<f64> {
    let all = 0..recording.blocks()[block].volts.len();
    let y = untouched.without(recording, block, all);
    let rms = |frame: &[f64]| {
        let finite = || frame.iter().filter(|v| v.is_finite());
        (finite().map(|v| v * v).sum::<f64>() / finite().count().max(1) as f64).sqrt()
    };
    y.chunks_exact(recording.measurements_per_frame()).map(rms).collect()
}

impl RecordedTouch {
    /// The least-squares image of the whole touch minus the untouched skin, V.
    #[must_use]
    pub fn image(&self, recording: &Recording) -> Option<Vec<f64>> {
        let mut image = Chunk::new(recording, self.block, self.start, self.end - self.start)
            .fit(0)?
            .image;
        for (volts, idle) in image.iter_mut().zip(self.untouched.image.iter().flatten()) {
            *volts -= idle;
        }
        Some(image)
    }

    /// The touched taxel: the largest value of [`RecordedTouch::image`].
    #[must_use]
    pub fn taxel(&self, recording: &Recording) -> Option<usize> {
        let image = self.image(recording)?;
        (0..image.len()).max_by(|a, b| image[*a].total_cmp(&image[*b]))
    }

    /// The middle of the touch as samples with their rows, V: at most `most` measurements. The output of the untouched
    /// skin is subtracted.
    #[must_use]
    pub fn press(&self, recording: &Recording, most: usize) -> Press {
        let len = (self.end - self.start).min(most);
        let first = (self.start + self.end - len) / 2;
        self.untouched.press(recording, self.block, first..first + len)
    }
}
