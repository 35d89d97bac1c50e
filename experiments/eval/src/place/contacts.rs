//! Contacts in a recording: touches of a skin, flat or bent, and those of a bouncing ball.

use crate::chunk::Chunk;
use crate::protocol::PUBLISHED_RATE_HZ;
use crate::windows::{MOST_WEIGHTS, Press, Untouched};
use nalgebra::{DMatrix, DVector};
use spts_circuit::{Block, Recording};
use spts_recon::metrics::median;
use std::ops::Range;

/// Frames at the start of a block that are taken to be without a touch.
const QUIET_FRAMES: usize = 20;
/// Touched when the output of a frame, without that of the untouched skin, is this many times as large as in the quiet
/// frames.
const THRESHOLD: f64 = 2.0;
/// What is followed in time begins with the first of the frames before that which are so many times as large: four
/// standard deviations, 1/√200, of a frame of 100 samples of noise.
const BEGINNING: f64 = 1.3;
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
pub fn find_touches(recording: &Recording) -> Vec<RecordedTouch> {
    let blocks = 0..recording.blocks().len();
    blocks.filter_map(|block| touch_of(recording, block)).collect()
}

/// The touch of block `block`.
pub(crate) fn touch_of(recording: &Recording, block: usize) -> Option<RecordedTouch> {
    touch_from(recording, block, THRESHOLD)
}

/// The touch of block `block` from its faint beginning on.
pub(crate) fn beginning_of(recording: &Recording, block: usize) -> Option<RecordedTouch> {
    touch_from(recording, block, BEGINNING)
}

/// The touch of block `block`, from the first frame on whose output is `beginning` times that of the quiet ones, and
/// all up to the sure ones too.
fn touch_from(recording: &Recording, block: usize, beginning: f64) -> Option<RecordedTouch> {
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
        let sure = levels[QUIET_FRAMES..].windows(SHORTEST_FRAMES).position(touched)? + QUIET_FRAMES;
        let before = levels[QUIET_FRAMES..sure].iter().rev();
        let first = sure - before.take_while(|level| **level > beginning / THRESHOLD * limit).count();
        let last = levels.iter().rposition(|level| *level > limit)?;
        found = Some(RecordedTouch { block, start: first * per_frame, end: (last + 1) * per_frame, untouched });
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
    /// The least-squares image of the whole touch, or of the middle of a long one on a large skin, minus the untouched
    /// skin, V.
    pub fn image(&self, recording: &Recording) -> Option<Vec<f64>> {
        let len = (self.end - self.start).min(MOST_WEIGHTS / recording.taxels());
        let start = (self.start + self.end - len) / 2;
        let mut image = Chunk::new(recording, self.block, start, len).fit(0)?.image;
        for (volts, idle) in image.iter_mut().zip(self.untouched.image.iter().flatten()) {
            *volts -= idle;
        }
        Some(image)
    }

    /// The touched taxel: the largest value of [`RecordedTouch::image`].
    pub fn taxel(&self, recording: &Recording) -> Option<usize> {
        let image = self.image(recording)?;
        (0..image.len()).max_by(|a, b| image[*a].total_cmp(&image[*b]))
    }

    /// The middle of the touch as samples with their rows, V: at most `most` measurements. The output of the untouched
    /// skin is subtracted.
    pub fn press(&self, recording: &Recording, most: usize) -> Press {
        let len = (self.end - self.start).min(most);
        let first = (self.start + self.end - len) / 2;
        self.untouched.press(recording, self.block, first..first + len)
    }
}

/// One contact of the ball: measurements `start..end` of a block.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedBounce {
    /// Block of the recording.
    pub block: usize,
    /// First measurement in contact.
    pub start: usize,
    /// One past the last measurement in contact.
    pub end: usize,
    /// The skin with nothing on it.
    pub untouched: Untouched,
}

impl RecordedBounce {
    /// Duration of the contact, s.
    pub fn duration_s(&self, recording: &Recording) -> f64 {
        (self.end - self.start) as f64 / recording.sample_rate_hz()
    }
}

/// Width of the moving root mean square that detects contact, measurements of the published skin.
const ENVELOPE: usize = 16;
/// Contact when the envelope is above this many times its median; the quiet wire stays below 2.4 times.
const BOUNCE_THRESHOLD: f64 = 2.6;
/// Gaps shorter than this belong to the same contact, measurements of the published skin.
const GAP: usize = 100;
/// Shorter events are not contacts of a ball, measurements of the published skin (3 ms).
const SHORTEST: usize = 200;

/// Contacts of the ball in every block, detected by the moving root mean square of the output about that of the
/// untouched skin.
pub fn find_bounces(recording: &Recording) -> Vec<RecordedBounce> {
    let of_block = |(block, samples): (usize, &Block)| {
        let untouched = Untouched::flat(recording, block);
        let above = untouched.without(recording, block, 0..samples.volts.len());
        let of = move |Range { start, end }| RecordedBounce { block, start, end, untouched: untouched.clone() };
        contacts(&above, recording.sample_rate_hz()).into_iter().map(of)
    };
    recording.blocks().iter().enumerate().flat_map(of_block).collect()
}

/// Contacts in a block whose output, without that of the untouched skin, is `above`, V: ranges of measurements.
fn contacts(above: &[f64], rate_hz: f64) -> Vec<Range<usize>> {
    #[expect(clippy::cast_possible_truncation, reason = "casts saturate")]
    let own = |measurements: usize| (measurements as f64 * rate_hz / PUBLISHED_RATE_HZ).round().max(1.0) as usize;
    let (width, gap, shortest) = (own(ENVELOPE).max(2), own(GAP), own(SHORTEST));
    let square: Vec<f64> = above.iter().map(|v| if v.is_finite() { v.powi(2) } else { 0.0 }).collect();
    let half = width / 2;
    let mut envelope = vec![0.0; square.len()];
    let mut sum = 0.0;
    for i in 0..square.len() + half {
        sum += square.get(i).unwrap_or(&0.0);
        if i >= width {
            sum -= square[i - width];
        }
        if i >= half {
            envelope[i - half] = sum.max(0.0).sqrt();
        }
    }
    let Some(quiet) = median(&envelope) else {
        return Vec::new();
    };
    let mut found: Vec<Range<usize>> = Vec::new();
    for (i, _) in envelope.iter().enumerate().filter(|(_, e)| **e > BOUNCE_THRESHOLD * quiet) {
        match found.last_mut() {
            Some(last) if i - last.end < gap => last.end = i + 1,
            _ => found.push(i..i + 1),
        }
    }
    found.retain(|b| b.end - b.start >= shortest);
    found
}

/// Least-squares image of a whole contact: min ‖Φ x − (y − idle)‖₂ with the recording's Φ, negative values set to zero.
/// `None` if a sample is lost, the normal equations are singular, or they would take more than 1 GiB.
pub fn contact_image(recording: &Recording, bounce: &RecordedBounce) -> Option<Vec<f64>> {
    let (n, m) = (recording.taxels(), bounce.end - bounce.start);
    // fewer measurements than taxels are singular
    if m < n || m.saturating_mul(n) > MOST_WEIGHTS {
        return None;
    }
    let rows = recording.rows(bounce.block, bounce.start..bounce.end).to_vec();
    let phi = DMatrix::from_row_slice(m, n, &rows);
    let y = DVector::from_vec(bounce.untouched.without(recording, bounce.block, bounce.start..bounce.end));
    if y.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let image = phi.tr_mul(&phi).cholesky()?.solve(&phi.tr_mul(&y));
    Some(image.iter().map(|v| v.max(0.0)).collect())
}
