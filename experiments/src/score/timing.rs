//! How long a decode takes.

use super::decode::{Decode, Projected};
use super::session::Learned;
use spts_recon::metrics::median;
use spts_recon::{Problem, Recover as _, Workspace};
use std::hint::black_box;
use std::time::Instant;

/// Median time of one matched decode of `m` measurements, µs, forming the image included and Φ·D given, over up to
/// `decodes` windows of the press on one thread. `None` when the press is shorter than one window.
#[must_use]
pub fn decode_us_median(projected: &Projected, learned: &Learned, m: usize, decodes: usize) -> Option<f64> {
    let pursuit = Decode::Matched.pursuit(m);
    let mut work = Workspace::default();
    let mut image = vec![0.0; learned.dictionary.nrows()];
    let times: Vec<f64> = (0..projected.len().checked_sub(m)?)
        .step_by(m.max(1))
        .take(decodes)
        .filter_map(|start| {
            let (a, y) = projected.window(Decode::Matched, start, m);
            let begin = Instant::now();
            let solution = pursuit.recover(&Problem::new(a, y).ok()?, &mut work).ok()?;
            solution.synthesise(learned.dictionary.view(), &mut image);
            black_box(&image);
            Some(begin.elapsed().as_secs_f64() * 1e6)
        })
        .collect();
    median(&times)
}
