//! How long a decode takes.

use super::decode::{Decode, Decoder, Projected};
use super::session::Learned;
use spts_recon::metrics::median;
use std::hint::black_box;
use std::time::Instant;

/// Median time of one matched decode of `m` measurements, µs, forming the image included and Φ·D given, over up to
/// `decodes` windows of the press on one thread. `None` when the press is shorter than one window.
#[must_use]
pub fn decode_us_median(projected: &Projected, learned: &Learned, m: usize, decodes: usize) -> Option<f64> {
    let mut decoder = Decoder::new(&learned.dictionary);
    let times: Vec<f64> = (0..(projected.len() + 1).checked_sub(m)?)
        .step_by(m.max(1))
        .take(decodes)
        .filter_map(|start| {
            let begin = Instant::now();
            black_box(decoder.decode(projected, Decode::Matched, start, m)?);
            Some(begin.elapsed().as_secs_f64() * 1e6)
        })
        .collect();
    median(&times)
}
