//! The published evaluation's rules: which frames are scored, and against which ground truth. The twin's sheet is
//! conditioned before its session begins, so all its presses are scored.

use spts::session::Recorded;
use spts_circuit::{Mode, Recording};
use spts_recon::metrics::{SUPPORT_THRESHOLD, support};
use std::ops::Range;

/// Numbers of measurements of the published curves.
pub const MEASUREMENTS: [usize; 14] = [2, 3, 5, 7, 10, 13, 15, 20, 25, 30, 40, 50, 75, 100];

/// Frames in which the force of a published press is steady, for any drawn time course.
pub const PLATEAU: Range<usize> = 500..650;

/// Taxels of the published skin, and measurements of one of its frames.
pub const PUBLISHED_TAXELS: usize = 100;
/// Rate to which the published frame numbers refer, measurements a second, Hz.
pub const PUBLISHED_RATE_HZ: f64 = 64_300.0;
/// Span of a published press in which the evaluation treats the contact as steady, s: frames 500 to 700.
pub const PUBLISHED_HOLD_S: [f64; 2] = [50_000.0 / PUBLISHED_RATE_HZ, 70_000.0 / PUBLISHED_RATE_HZ];
/// With fewer presses than this, all of them are scored.
const FEW_PRESSES: usize = 15;

/// Which presses and frames of a session are scored, in which windows, and against which true image. All numbers count
/// from 0.
///
/// ```
/// use spts_eval::protocol::Protocol;
///
/// let published = Protocol::default();
/// assert_eq!((published.first_frame, published.frames), (500, 200));
/// // 20,000 measurements of the hold give whole votes of 20 windows
/// assert_eq!(published.windows(20, 100) % published.vote, 0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Protocol {
    /// First press scored. Earlier presses condition the foam and are used for training.
    pub first_press: usize,
    /// Number of presses scored.
    pub presses: usize,
    /// First frame scored.
    pub first_frame: usize,
    /// Number of frames scored.
    pub frames: usize,
    /// First measurement scored and one beyond the last, where frames are too long to tell the hold from the rest.
    pub span: Option<[usize; 2]>,
    /// Distance between the starts of windows for the support scores, frames.
    pub support_stride: usize,
    /// Largest number of windows of a press for the classification scores; they follow each other without a gap.
    pub max_windows: usize,
    /// Number of decisions in a vote.
    pub vote: usize,
    /// Press and frame of the raster session that is the ground truth.
    pub truth: (usize, usize),
}

impl Default for Protocol {
    fn default() -> Self {
        Self {
            first_press: 5,
            presses: 10,
            first_frame: 500,
            frames: 200,
            span: None,
            support_stride: 10,
            max_windows: 300,
            vote: 20,
            truth: (9, 599),
        }
    }
}

impl Protocol {
    /// The protocol for `recorded`, whose contact is steady during `hold_s`. If there are fewer than 15 presses, all
    /// are scored; otherwise ten after those that condition the skin. Presses that a raster recording marks as
    /// conditioning are never scored, so that they can be used for training. For a recording of the published skin this
    /// is the default.
    pub fn of(recorded: &Recorded, hold_s: Option<[f64; 2]>) -> Self {
        let published = Self::default();
        let recording = &recorded.recording;
        let (blocks, frames) = (recording.blocks().len(), recording.frames());
        let per_frame = recording.measurements_per_frame();
        let in_frames = |measurements: usize| (measurements / per_frame).max(1);
        let [first, end] = match hold_s {
            Some(hold_s) => hold_s.map(|time_s| frame_at(recording, time_s)),
            // a contact of unknown course is looked for in the middle of the block
            None => [2 * frames / 5, 3 * frames / 5],
        };
        let first = first.min(frames - 1);
        let end = end.clamp(first + 1, frames);
        let span = hold_s.map(|hold_s| hold_s.map(|time_s| measurement_at(recording, time_s)));
        // a scan is made of whole frames
        let coarse = recording.mode() == Mode::Compressive && end - first < FEWEST_FRAMES;
        let few = blocks < FEW_PRESSES && (recording.mode() == Mode::Compressive || recorded.conditioning == 0);
        let all = few || blocks <= recorded.conditioning;
        let first_press = if all { 0 } else { recorded.conditioning };
        Self {
            first_press,
            presses: if all { blocks } else { published.presses },
            first_frame: first,
            frames: end - first,
            span: span.filter(|[start, end]| coarse && start < end),
            support_stride: in_frames(published.support_stride * PUBLISHED_TAXELS),
            truth: (
                published.truth.0.max(first_press).min(blocks - 1),
                (first + end) / 2 - usize::from(end > first + 1),
            ),
            ..published
        }
    }

    /// The scored measurements of a block of `recording`.
    pub fn measurements(&self, recording: &Recording) -> Range<usize> {
        let per_frame = recording.measurements_per_frame();
        let first = self.first_frame.min(recording.frames());
        let end = (first + self.frames).min(recording.frames());
        self.span.map_or(first * per_frame..end * per_frame, |[start, end]| start..end)
    }

    /// The scored presses of `recording`.
    pub fn presses_of(&self, recording: &Recording) -> std::ops::Range<usize> {
        let end = (self.first_press + self.presses).min(recording.blocks().len());
        self.first_press.min(end)..end
    }

    /// Number of classification windows of `m` measurements in a press; only complete votes count.
    pub fn windows(&self, m: usize, measurements_per_frame: usize) -> usize {
        let all = self.span.map_or(self.frames * measurements_per_frame, |[start, end]| end - start);
        let fitting = all / m.max(1);
        fitting.min(self.max_windows) / self.vote * self.vote
    }
}

/// Fewest frames of a hold that tell it from the rest of a press.
const FEWEST_FRAMES: usize = 10;

/// Measurement of `recording` at `time_s` since the start of a block.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a block")]
fn measurement_at(recording: &Recording, time_s: f64) -> usize {
    let most = (recording.frames() * recording.measurements_per_frame()) as f64;
    (time_s * recording.sample_rate_hz()).round().clamp(0.0, most) as usize
}

/// Frame of `recording` at `time_s` since the start of a block.
#[expect(clippy::cast_possible_truncation, reason = "clamped to the frames of a block")]
fn frame_at(recording: &Recording, time_s: f64) -> usize {
    let frame = time_s * recording.sample_rate_hz() / recording.measurements_per_frame() as f64;
    frame.round().clamp(0.0, recording.frames() as f64) as usize
}

/// A true image and its support.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Image: V of a raster frame or a fitted image, S of what the taxels of a simulation conduct.
    pub image: Vec<f64>,
    /// Taxels above the threshold.
    pub support: Vec<bool>,
}

impl Truth {
    /// The ground truth from the raster session of the object; from its last press if there are too few.
    pub fn new(raster: &Recording, protocol: &Protocol) -> Self {
        let press = protocol.truth.0.min(raster.blocks().len() - 1);
        let frame = protocol.truth.1.min(raster.frames() - 1);
        let image = raster.volts(press, frame).to_vec();
        Self::of(image)
    }

    /// The truth that is `image`.
    pub(crate) fn of(image: Vec<f64>) -> Self {
        Self { support: mask(&image), image }
    }
}

/// The support of `image`.
pub(crate) fn mask(image: &[f64]) -> Vec<bool> {
    let mut mask = Vec::new();
    support(image, SUPPORT_THRESHOLD, &mut mask);
    mask
}
