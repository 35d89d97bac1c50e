//! Follows a recording block by block.

use super::search::search;
use crate::chunk::{Chunk, Fit, chunk_len, converter_step_v};
use spts_circuit::{Recording, Slip};
use spts_recon::metrics::median;

/// Lags that are searched: as far as this from none and from the one that was last found.
const REACH: i64 = 500;
/// The expected rows are the right ones when a fit leaves less than this share of what wrong rows leave, √(1 − N/L):
/// .69 of the output at N = 100. Recordings of the real skin leave .1 to .5.
const KEPT: f64 = 0.8;
/// Other rows are the right ones when a fit leaves less than this share. The best of a thousand wrong ones leaves .94.
const FOUND: f64 = 0.75;
/// An image that explains this share of a later chunk is still the image, and its rows are the right ones: no fit is
/// needed. Wrong rows explain 1/L.
const STILL: f64 = 0.6;
/// The skin is touched where the output varies this many times as much as in the quiet chunks of the block...
const TOUCHED: f64 = 3.0;
/// ... or by this many steps of the converter: a skin under preload is never quiet.
const STEPS: f64 = 6.0;
/// ... or, where neither tells, this share of the most in the block.
const STRONG: f64 = 0.7;
/// Share of the chunks of a block that are quiet at least, where something is pressed now and then.
const QUIET: f64 = 0.1;
/// Searches of a block that find nothing before it is given up.
const FAILURES: usize = 8;
/// Rounds of moving the place where two lags meet and fitting the images on both sides of it again.
const ROUNDS: usize = 3;

/// Follows the blocks of a recording in order.
pub(super) struct Tracker<'a> {
    recording: &'a Recording,
    len: usize,
    /// Lag found last.
    lag: i64,
    slips: Vec<Slip>,
}

impl<'a> Tracker<'a> {
    pub(super) fn new(recording: &'a Recording) -> Self {
        Self {
            recording,
            len: chunk_len(recording),
            lag: 0,
            slips: Vec::new(),
        }
    }

    pub(super) fn into_slips(self) -> Vec<Slip> {
        self.slips
    }

    /// Finds the slips of block `block`.
    pub(super) fn follow(&mut self, block: usize) {
        let samples = self.recording.blocks()[block].volts.len();
        if samples < self.len {
            return;
        }
        let starts: Vec<usize> = (0..=samples - self.len).step_by(self.len / 2).collect();
        let chunks: Vec<Chunk<'a>> = starts.iter().map(|&start| self.chunk(block, start)).collect();
        let touched = self.least_sd(&chunks);
        // chunk of the last fit, and the fit; none before the first contact
        let mut last: Option<(usize, Fit)> = None;
        let (mut failures, mut wait) = (0_usize, 0_usize);
        for (&start, chunk) in starts.iter().zip(&chunks).filter(|(_, chunk)| chunk.sd() > touched) {
            if let Some((seen, fit)) = &mut last
                && chunk.agreement(self.lag, &fit.image) > STILL
            {
                *seen = start;
                continue;
            }
            let right = 1.0 - (self.recording.taxels() + 1) as f64 / self.len as f64;
            let kept = chunk.fit(self.lag).filter(|fit| fit.residual < KEPT * right.sqrt());
            if let Some(fit) = kept {
                if last.is_none() && self.lag != 0 {
                    self.push(block, 0);
                }
                last = Some((start, fit));
                continue;
            }
            if failures >= FAILURES || wait > 0 {
                wait = wait.saturating_sub(1);
                continue;
            }
            let lags = (self.lag - REACH).min(-REACH)..=(self.lag + REACH).max(REACH);
            let found = search(chunk, lags, self.lag).filter(|fit| fit.residual < FOUND * right.sqrt());
            let Some(fit) = found else {
                // chunks with a change in them overlap two others, and noise is not searched over and over
                failures += 1;
                wait = 1 << failures;
                wait -= 2;
                continue;
            };
            failures = 0;
            let from = last.map_or(0, |(seen, before)| self.meeting(block, seen, &before, start, &fit));
            self.lag = fit.rows;
            self.push(block, from);
            last = Some((start, fit));
        }
    }

    fn push(&mut self, block: usize, from: usize) {
        let rows = self.lag;
        self.slips.push(Slip { block, from, rows });
    }

    fn chunk(&self, block: usize, start: usize) -> Chunk<'a> {
        Chunk::new(self.recording, block, start, self.len)
    }

    /// Least standard deviation of a chunk in which something touches the skin, V.
    fn least_sd(&self, chunks: &[Chunk<'_>]) -> f64 {
        let mut sds: Vec<f64> = chunks.iter().map(Chunk::sd).collect();
        sds.sort_by(f64::total_cmp);
        #[expect(clippy::cast_possible_truncation, reason = "a share of a length")]
        let quiet = &sds[..((sds.len() as f64 * QUIET) as usize).max(1)];
        let most = sds.last().copied().unwrap_or(0.0);
        let by_noise = TOUCHED * median(quiet).unwrap_or(0.0);
        let by_step = converter_step_v(self.recording).map(|step_v| STEPS * step_v);
        by_noise.min(by_step.unwrap_or(STRONG * most))
    }

    /// Measurement at which the lag of `before`, fitted at or before measurement `seen`, becomes that of `after`,
    /// fitted from measurement `found` on: where the samples before it leave least of the one image and those after it
    /// least of the other.
    fn meeting(&self, block: usize, seen: usize, before: &Fit, found: usize, after: &Fit) -> usize {
        let samples = self.recording.blocks()[block].volts.len();
        let end = (found + self.len).min(samples);
        let all = Chunk::new(self.recording, block, seen, end - seen);
        let (mut before, mut after) = (before.clone(), after.clone());
        let mut place = found;
        for _ in 0..ROUNDS {
            let sums = (
                all.expected(before.rows, &before.image),
                all.expected(after.rows, &after.image),
            );
            let (Some(old), Some(new)) = sums else { return place };
            let (mut gain, mut best, mut at) = (0.0, 0.0, 0);
            for (i, y) in all.y.iter().enumerate() {
                gain += (y - new[i]).powi(2) - (y - old[i]).powi(2);
                if gain > best {
                    (best, at) = (gain, i + 1);
                }
            }
            let again = seen + at;
            if again == place {
                break;
            }
            place = again;
            // images of the samples next to the place fit best
            let refit = |fit: &mut Fit, start: usize| {
                let near = self.chunk(block, start).fit(fit.rows);
                if let Some(near) = near.filter(|near| near.residual < fit.residual.max(FOUND)) {
                    *fit = near;
                }
            };
            if let Some(start) = place.checked_sub(self.len) {
                refit(&mut before, start);
            }
            if place + self.len <= samples {
                refit(&mut after, place);
            }
        }
        place
    }
}
