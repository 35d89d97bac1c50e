//! How long a decode takes.

use super::algorithm::{Algorithm, Answer, DecodeError};
use super::window::{Press, Window};
use spts_recon::metrics::median;
use std::hint::black_box;
use std::time::Instant;

/// Windows that are timed.
const WINDOWS: usize = 200;

/// Median time from a window to its answer, µs, on this thread; the mean for algorithms that answer many at a time. `None` when the press is shorter than one window.
pub(super) fn median_us(algorithm: &mut dyn Algorithm, press: &Press, m: usize) -> Result<Option<f64>, DecodeError> {
    let starts = (0..press.len()).step_by(m.max(1));
    let windows: Vec<Window<'_>> = starts.filter_map(|s| press.window(s, m)).take(WINDOWS).collect();
    if algorithm.batched() {
        let begin = Instant::now();
        black_box(algorithm.decode_all(&windows)?);
        let each_us = begin.elapsed().as_secs_f64() * 1e6 / windows.len() as f64;
        return Ok((!windows.is_empty()).then_some(each_us));
    }
    let mut answer = Answer::default();
    let mut times = Vec::with_capacity(windows.len());
    for window in &windows {
        let begin = Instant::now();
        let outcome = algorithm.decode(black_box(window), &mut answer);
        let elapsed = begin.elapsed();
        black_box(&answer);
        match outcome {
            Err(error @ DecodeError::External(_)) => return Err(error),
            _ => times.push(elapsed.as_secs_f64() * 1e6),
        }
    }
    Ok(median(&times))
}
