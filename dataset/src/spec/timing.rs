//! When the windows of a press are recorded.

use super::config::{RecordKind, SpecConfig};
use super::error::SpecError;
use spts_models::{ConfigError, in_range, within};
use spts_sim::mechanics::PressConfig as ArmConfig;

/// Most windows of a press.
const MOST_WINDOWS: u64 = 10_000;
/// Default number of windows of a drop: with 1 ms between them they cover the contact of a tennis ball, 8 ms.
const DROP_WINDOWS: u64 = 16;
/// Default time between the windows of a course and of a drop, s.
const INTERVALS_S: [f64; 2] = [0.02, 0.001];
/// Default time from the first window to the touch, of a course and of a drop, s.
const BEFORE_S: [f64; 2] = [0.1, 0.004];
/// Time after the force is gone that the default number of windows of a course covers, s.
const AFTER_S: f64 = 0.1;

/// When the windows of a press are recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Timing {
    pub(crate) what: RecordKind,
    pub(crate) windows: u64,
    /// Time from window to window, s; `None` if they follow each other without a gap.
    pub(crate) interval_s: Option<f64>,
    /// Time from the first window to the touch, s; 0 for holds.
    pub(crate) before_s: f64,
    measurements: u64,
    /// Measurements a second, Hz; unknown until the readout is built.
    pub(crate) rate_hz: f64,
}

impl Timing {
    /// The timing of `config`, of which the rate is not known yet.
    pub(super) fn of(config: &SpecConfig) -> Result<Self, SpecError> {
        let record = &config.record;
        let [interval_s, before_s] = match record.what {
            RecordKind::Hold => [None, None],
            RecordKind::Course => [Some(INTERVALS_S[0]), Some(BEFORE_S[0])],
            RecordKind::Drop => [Some(INTERVALS_S[1]), Some(BEFORE_S[1])],
        };
        if record.what == RecordKind::Hold && record.before_s.is_some() {
            return Err(SpecError::Choice(
                "`record.before_s` is not for `record.what` = \"hold\", which begins `press.hold_s` after the touch"
                    .to_owned(),
            ));
        }
        let interval_s = record.interval_s.or(interval_s);
        if let Some(interval_s) = interval_s {
            in_range(
                "record.interval_s",
                interval_s,
                interval_s > 0.0 && interval_s <= 10.0,
                "(0, 10] s",
            )?;
        }
        let before_s = record.before_s.or(before_s).unwrap_or(0.0);
        within("record.before_s", before_s, 0.0, 10.0, "[0, 10] s")?;
        let windows = record
            .windows
            .unwrap_or_else(|| default_windows(config, interval_s, before_s));
        in_range(
            "record.windows",
            windows as f64,
            (1..=MOST_WINDOWS).contains(&windows),
            "[1, 10000]",
        )?;
        Ok(Self {
            what: record.what,
            windows,
            interval_s,
            before_s,
            measurements: record.measurements as u64,
            rate_hz: f64::NAN,
        })
    }

    /// The same with the rate of the readout.
    pub(super) fn at_rate(self, rate_hz: f64) -> Result<Self, ConfigError> {
        let shortest_s = self.measurements as f64 / rate_hz;
        if let Some(interval_s) = self.interval_s {
            in_range(
                "record.interval_s",
                interval_s,
                // a rounding of the quotient must not cost the shortest one
                interval_s >= shortest_s * (1.0 - 1e-12),
                "[record.measurements / sample rate, 10] s",
            )?;
        }
        Ok(Self { rate_hz, ..self })
    }

    /// Measurements from the beginning of window 0 to that of `window`.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "10,000 windows of 10 s at 1 GHz are 1e14"
    )]
    pub(crate) fn row_of(&self, window: u64) -> u64 {
        match self.interval_s {
            None => window * self.measurements,
            Some(interval_s) => (window as f64 * interval_s * self.rate_hz).round() as u64,
        }
    }

    /// Measurements from the beginning of window 0 to the end of the last one.
    pub(crate) fn span(&self) -> u64 {
        self.row_of(self.windows - 1) + self.measurements
    }

    /// The same, s.
    pub(crate) fn span_s(&self) -> f64 {
        self.span() as f64 / self.rate_hz
    }
}

fn default_windows(config: &SpecConfig, interval_s: Option<f64>, before_s: f64) -> u64 {
    match (config.record.what, interval_s) {
        (RecordKind::Course, Some(interval_s)) => {
            let [_, hold_s] = config.press.hold_s.range();
            let [_, fall_s] = config.press.fall_s.range();
            let whole_s = before_s + hold_s + ArmConfig::ramp_s(fall_s) + AFTER_S;
            super::whole((whole_s / interval_s).ceil()) as u64
        }
        (RecordKind::Drop, _) => DROP_WINDOWS,
        _ => 1,
    }
}

/// Truths and images of a press that are kept: one for all windows of an object at rest that follow each other.
pub(super) fn most_states(timing: &Timing, moving: bool) -> u64 {
    if timing.interval_s.is_none() && !moving {
        1
    } else {
        timing.windows
    }
}
