//! Decoding time.

use crate::algorithm::{Answer, DecodeError};
use crate::decoders::TrainedDecoder;
use crate::windows::{Press, Window};
use spts_recon::metrics::median;
use std::hint::black_box;
use std::time::Instant;

/// Median time from a window to its answer, µs, on this thread, over up to `most` windows of the press, including Φ·D;
/// the mean for algorithms that decode in batches. `None` if the press is shorter than one window.
///
/// # Errors
/// [`DecodeError::External`] only.
pub fn decode_us(decoder: &TrainedDecoder, press: &Press, m: usize, most: usize) -> Result<Option<f64>, DecodeError> {
    let mut algorithm = decoder.trained.start();
    let windows = press.windows(0..press.len(), m, m).map(|(_, window)| window);
    let windows: Vec<Window<'_>> = windows.take(most).collect();
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
