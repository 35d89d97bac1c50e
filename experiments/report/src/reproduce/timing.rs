//! Decoding times: the only results that depend on the machine; kept out of the tables.

use super::results::SkinResults;
use serde::Serialize;
use spts_eval::score::{Projected, decode_us_median};

/// Time of a matched decode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct TimingRow {
    /// Number of measurements.
    pub(super) m: usize,
    /// Median time of one decode on one thread, image included, Φ·D given, µs.
    pub(super) decode_us_median: f64,
    /// Time to acquire the measurements, µs.
    pub(super) acquire_us: f64,
}

/// Times the matched decode at every M on one press of the twin.
#[must_use]
pub(super) fn timings(twin: &SkinResults, measurements: &[usize], decodes: usize) -> Vec<TimingRow> {
    let Some((recording, block, protocol)) = twin.arm.sessions.iter().find_map(|s| {
        let recording = s.compressive.as_ref()?;
        Some((recording, s.scored().next()?, s.protocol))
    }) else {
        return Vec::new();
    };
    let projected = Projected::press(recording, block, &protocol, &twin.arm.learned.dictionary);
    let rows = measurements.iter().filter_map(|&m| {
        let acquire_us = m as f64 / recording.sample_rate_hz() * 1e6;
        Some(TimingRow {
            m,
            decode_us_median: decode_us_median(&projected, &twin.arm.learned, m, decodes)?,
            acquire_us,
        })
    });
    rows.collect()
}
