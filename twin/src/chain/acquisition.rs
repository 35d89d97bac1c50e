//! How a session is acquired.

use spts_circuit::Mode;

/// How a session is recorded: in which mode, as which session of the skin, and with how many frames before and between
/// its blocks. A block is one press or drop; a frame is as many measurements as there are taxels.
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
    /// Frames from the loading of the cells' seeds to the first block. They are not recorded.
    pub lead_frames: u64,
    /// Frames after each block that are not recorded.
    pub gap_frames: u64,
    /// Whether nothing touches the skin in the first 0.233 s of every block (15,000 measurements at 64.3 kHz).
    pub starts_idle: bool,
    /// Number of presses that condition the sheet before the recording. The session's own presses are used, repeated
    /// from the first as often as needed.
    pub conditioning_presses: usize,
}

impl Acquisition {
    /// The way in which the published device records presses: 57 frames are not recorded after each block, while the
    /// arm returns, and a block begins with an untouched skin.
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

    /// The way in which the published device records touches by a finger: block follows block without a gap, as for
    /// [`Acquisition::drops`], and nothing says when in a block the skin is touched.
    #[must_use]
    pub fn touches(mode: Mode, session: u64) -> Self {
        Self::drops(mode, session)
    }

    /// The way in which the published device records drops of a ball: block follows block without a gap, and nothing
    /// says when in a block the ball lands.
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
