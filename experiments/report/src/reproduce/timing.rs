//! Decoding times: the only results that depend on the machine; kept out of the tables.

use super::results::SkinResults;
use serde::Serialize;
use spts_eval::{Press, ScoreError, decode_us};

/// Time of a matched decode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct TimingRow {
    /// Number of measurements.
    pub(super) m: usize,
    /// Median time of one decode on one thread, Φ·D and image included, µs.
    pub(super) decode_us_median: f64,
    /// Time to acquire the measurements, µs.
    pub(super) acquire_us: f64,
}

/// Times the matched decode at every M on one press of the twin.
///
/// # Errors
/// [`ScoreError`] when the decoder does not fit the recording.
pub(super) fn timings(
    twin: &SkinResults,
    measurements: &[usize],
    decodes: usize,
) -> Result<Vec<TimingRow>, ScoreError> {
    let Some((recording, block, protocol)) = twin.skin.sessions.iter().find_map(|s| {
        let recording = s.compressive.as_ref()?;
        Some((recording, s.scored().next()?, s.protocol))
    }) else {
        return Ok(Vec::new());
    };
    let press = Press::new(recording, block, &protocol);
    let mut rows = Vec::new();
    for &m in measurements {
        if let Some(decode_us_median) = decode_us(&twin.matched, &press, m, decodes)? {
            rows.push(TimingRow {
                m,
                decode_us_median,
                acquire_us: m as f64 / recording.sample_rate_hz() * 1e6,
            });
        }
    }
    Ok(rows)
}
