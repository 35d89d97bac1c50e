//! How a session is acquired.

use spts_circuit::Mode;

/// How a session is recorded: mode, session number, and the time before and between its blocks.
///
/// ```
/// use spts::{Acquisition, Mode};
///
/// let presses = Acquisition::presses(Mode::Compressive, 3);
/// let drops = Acquisition::drops(Mode::Compressive, 3);
/// assert_eq!((presses.gap_frames, drops.gap_frames), (57, 0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Acquisition {
    /// Raster scan or compressive.
    pub mode: Mode,
    /// Number of the session. Sessions of one skin differ in their noise and, if the transducer varies between
    /// sessions, in their gains.
    pub session: u64,
    /// Frames between loading the seeds and the first block.
    pub lead_frames: u64,
    /// Unrecorded frames after each block.
    pub gap_frames: u64,
    /// Whether nothing touches the skin in the first 0.233 s of every block (15,000 measurements at 64.3 kHz).
    pub starts_idle: bool,
    /// Number of presses that condition the sheet before the recording. The session's own presses are used, repeated
    /// from the first as often as needed.
    pub conditioning_presses: usize,
}

impl Acquisition {
    /// Presses as the published device records them: the arm needs about 57 frames to return.
    #[must_use]
    pub fn presses(mode: Mode, session: u64) -> Self {
        Self {
            mode,
            session,
            lead_frames: 243,
            gap_frames: 57,
            starts_idle: true,
            conditioning_presses: 0,
        }
    }

    /// Touches as the published device records them, at unknown times; the same gaps as [`Acquisition::drops`].
    #[must_use]
    pub fn touches(mode: Mode, session: u64) -> Self {
        Self::drops(mode, session)
    }

    /// Drops as the published device records them: blocks without gaps between them. The recording does not know when
    /// the ball is released.
    #[must_use]
    pub fn drops(mode: Mode, session: u64) -> Self {
        Self {
            lead_frames: 0,
            gap_frames: 0,
            starts_idle: false,
            ..Self::presses(mode, session)
        }
    }
}

/// No press touches the skin in the first so many measurements at [`IDLE_RATE_HZ`], 0.233 s: the earliest begins at
/// 0.25 s.
const IDLE_MEASUREMENTS: f64 = 15_000.0;
/// Rate of [`IDLE_MEASUREMENTS`], Hz.
const IDLE_RATE_HZ: f64 = 64_300.0;

/// Frames at the start of a block in which no press touches the skin, of `frame` measurements each at `rate_hz`.
pub(super) fn idle_frames(rate_hz: f64, frame: usize) -> usize {
    #[expect(clippy::cast_possible_truncation, reason = "casts saturate")]
    let frames = (IDLE_MEASUREMENTS * rate_hz / IDLE_RATE_HZ / frame as f64) as usize;
    frames
}
