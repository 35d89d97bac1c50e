//! Finds blocks whose cells have missed clock edges, and realigns them with their rows.
//!
//! A recording states the row of weights of every measurement. If all cells miss an edge, the samples lag behind these
//! rows from then on, also in later blocks. A chunk of a few hundred measurements of a contact reveals this: the
//! residual of an image fitted to it is 0.1 to 0.5 of the output if the rows are correct. If they are not, it is √(1 −
//! N/L) of the output, as for N free parameters and L random numbers. [`find_slips`] follows every block chunk by
//! chunk, searches other rows where the fit fails, and finds the measurement at which the rows change. An untouched
//! skin gives no information: a slip there is found at the next contact.
//!
//! The contacts of a ball are shorter than such a chunk. Each is fitted as a whole ([`contact_slips`]), without values
//! below zero, and compared with fits at rows that are certainly wrong: how much these leave depends on the length of
//! the contact. A contact that no rows fit better is not scored.
//!
//! ```
//! use spts_circuit::{Block, Recording, RecordingInfo, Seeding, Slip, WeightMode, Weights};
//! use spts_eval::find_slips;
//! use spts_models::SkinLayout;
//!
//! // taxel 3 is touched for 2000 measurements, and the samples are 34 behind their rows
//! let weights = Weights::new(WeightMode::Binary, Seeding::Mixed, 16);
//! let info = RecordingInfo::new(SkinLayout::new(4, 4, 5e-3, 3e-3)?, weights.clone(), 64_300.0);
//! let touched = |m: u64| if (1000..3000).contains(&m) { weights.level(3, 16_000 + m - 34) } else { 0.0 };
//! let block = Block { frame_position: 1250, idle_frames: None, volts: (0..4000).map(touched).collect() };
//! let recording = Recording::new(info, vec![block])?;
//! let slips = find_slips(&recording);
//! assert_eq!(slips, [Slip { block: 0, from: 0, rows: 34 }]);
//! assert_eq!(find_slips(&recording.realigned(&slips)), []);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::chunk::{Chunk, Fit, chunk_len, converter_step_v};
use crate::place::{RecordedBounce, find_bounces};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spts::Session;
use spts::data::SessionSet;
use spts::session::Event;
use spts_circuit::{Mode, Recording, Slip};
use spts_fft::{Complex, Planner};
use spts_recon::metrics::median;
use spts_recon::statistics::Sample;
use std::ops::{Range, RangeInclusive};

/// Most taxels of a skin whose recordings are checked: the search takes time with the square of their number.
const MOST_TAXELS: usize = 1024;

/// A place in a session from which on the samples lag behind the rows that the recording states.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SessionSlip {
    /// Name of the session.
    pub session: String,
    /// Where its samples begin to lag, and by how many rows.
    #[serde(flatten)]
    pub slip: Slip,
}

/// A contact of a ball whose samples fit no rows. It is not scored: its samples count as lost.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnalignedContact {
    /// Name of the session.
    pub session: String,
    /// Block of the recording, from 0.
    pub block: usize,
    /// First measurement of the contact.
    pub from: usize,
    /// One past its last measurement.
    pub to: usize,
}

/// What was found of the rows of a set of sessions.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Alignment {
    /// Where samples lag behind their rows; they have been realigned.
    pub slips: Vec<SessionSlip>,
    /// Contacts that fit no rows.
    pub unaligned: Vec<UnalignedContact>,
}

/// The slips of `recording`, in order of block and measurement; empty if there are none. If a block lags at its first
/// contact, the lag is assumed from its first measurement on. Raster scans, skins of more than 1024 taxels or on
/// several wires, and blocks shorter than a chunk are not checked.
pub fn find_slips(recording: &Recording) -> Vec<Slip> {
    let wires = recording.weights().wire_count();
    if recording.mode() != Mode::Compressive || recording.taxels() > MOST_TAXELS || wires > 1 {
        return Vec::new();
    }
    let mut tracker = Tracker::new(recording);
    (0..recording.blocks().len()).for_each(|block| tracker.follow(block));
    tracker.slips
}

/// Realigns the compressive recordings of `set` where they slip, and returns the slips. Contacts of drops that fit no
/// rows are returned, too; their samples count as lost.
pub fn follow_slips(set: &mut SessionSet) -> Alignment {
    let follow = |session: &mut Session| {
        let Some(recorded) = &mut session.compressive else {
            return Alignment::default();
        };
        let (slips, unaligned) = match session.event {
            Event::Drop => contact_slips(&recorded.recording),
            Event::Press | Event::Touch => (find_slips(&recorded.recording), Vec::new()),
        };
        if !unaligned.is_empty() {
            recorded.recording = recorded.recording.without(&unaligned);
        }
        if !slips.is_empty() {
            recorded.recording = recorded.recording.realigned(&slips);
        }
        let name = &session.name;
        let slips = slips.into_iter().map(|slip| SessionSlip { session: name.clone(), slip });
        let unaligned = unaligned.into_iter().map(|(block, range)| UnalignedContact {
            session: name.clone(),
            block,
            from: range.start,
            to: range.end,
        });
        Alignment { slips: slips.collect(), unaligned: unaligned.collect() }
    };
    let found: Vec<Alignment> = set.sessions.par_iter_mut().map(follow).collect();
    let mut all = Alignment::default();
    for one in found {
        all.slips.extend(one.slips);
        all.unaligned.extend(one.unaligned);
    }
    all
}

/// One line that lists contacts that fit no rows; `None` without one.
pub fn unaligned_text(contacts: &[UnalignedContact]) -> Option<String> {
    let each = contacts.iter().map(|UnalignedContact { session, block, from, to }| {
        format!("{session} (measurements {from} to {to} of block {block})")
    });
    let each: Vec<String> = each.collect();
    (!each.is_empty()).then(|| format!("contacts whose samples fit no rows are not scored: {}", each.join(", ")))
}

/// One line that lists the sessions that slip, by how many rows, and from where; `None` without slips.
///
/// ```
/// use spts_circuit::Slip;
/// use spts_eval::{SessionSlip, slips_text};
///
/// assert_eq!(slips_text(&[]), None);
/// let slip = SessionSlip { session: "cup".to_owned(), slip: Slip { block: 2, from: 4100, rows: 1 } };
/// assert!(slips_text(&[slip]).expect("a line").contains("cup"));
/// ```
pub fn slips_text(slips: &[SessionSlip]) -> Option<String> {
    /// Places of a session that are named.
    const NAMED: usize = 3;
    let sessions = crate::unique(slips.iter().map(|slip| slip.session.as_str()));
    let each = sessions.iter().map(|name| {
        let of_session: Vec<&Slip> = slips.iter().filter(|s| s.session == *name).map(|s| &s.slip).collect();
        let places = of_session.iter().take(NAMED).map(|slip| {
            let Slip { block, from, rows } = slip;
            format!("{rows} rows from measurement {from} of block {block} on")
        });
        let more = of_session.len().saturating_sub(NAMED);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("{name} ({}{more})", places.collect::<Vec<_>>().join(", "))
    });
    let each: Vec<String> = each.collect();
    (!each.is_empty())
        .then(|| format!("clock edges were missed; samples are put back on their rows: {}", each.join("; ")))
}

/// Candidates that are fitted.
const FITTED: usize = 4;

/// The best fit of `chunk` for any lag of `lags`; `None` when there is no such row.
///
/// The candidates are the lags with the largest ‖Φᵀy‖². With wrong rows it is ‖y‖² times N on average, with a standard
/// deviation of √(2N), and with the right ones ‖y‖² times N + L for what an image explains: at N = 100 and L = 400
/// more than twenty standard deviations apart. A fit decides between the best of them; of equal ones, that nearest
/// to `expected`.
fn search(chunk: &Chunk<'_>, lags: RangeInclusive<i64>, expected: i64) -> Option<Fit> {
    let far = |lag: i64| (lag - expected).abs();
    let fits = candidates(chunk, lags, expected).into_iter().take(FITTED).filter_map(|lag| chunk.fit(lag));
    fits.min_by(|a, b| a.residual.total_cmp(&b.residual).then(far(a.rows).cmp(&far(b.rows))))
}

/// The lags by ‖Φᵀy‖², the largest first; of equal ones that nearest to `expected`.
fn candidates(chunk: &Chunk<'_>, lags: RangeInclusive<i64>, expected: i64) -> Vec<i64> {
    let (least, most) = (*lags.start(), *lags.end());
    // rows from that of the largest lag on; before the first row of all there are none
    let Some(most) = (least..=most).rev().find(|lag| chunk.rows(*lag, 0).is_some()) else { return Vec::new() };
    let more = usize::try_from(most - least).unwrap_or(0);
    let Some(rows) = chunk.rows(most, more) else { return Vec::new() };
    let energies = correlation_energies(&rows.to_vec(), rows.taxels(), &chunk.y);
    let mut scores: Vec<(f64, i64)> = energies.into_iter().zip((least..=most).rev()).collect();
    let far = |lag: i64| (lag - expected).abs();
    scores.sort_by(|a, b| b.0.total_cmp(&a.0).then(far(a.1).cmp(&far(b.1))));
    scores.into_iter().map(|(_, lag)| lag).collect()
}

/// ‖Φᵀy‖² for every row of `phi` at which Φ can begin, times a constant; `phi` has `taxels` weights a row.
///
/// What one taxel adds is the square of the cross-correlation of its weights with y. By FFT that is the inverse
/// transform of W · conj(Y), W and Y being the transforms of weights and samples. They are as long as `phi` or longer,
/// so that no row wraps around.
fn correlation_energies(phi: &[f64], taxels: usize, y: &[f64]) -> Vec<f64> {
    /// Lengths that are multiples of it are quick.
    const MULTIPLE: usize = 1024;
    let rows = phi.len() / taxels;
    let len = rows.next_multiple_of(MULTIPLE);
    let (forward, inverse) = Planner::<f64>::new().real(len);
    let (mut values, mut spectrum) = (forward.make_input_vec(), forward.make_output_vec());
    let mut scratch = forward.make_scratch_vec();
    scratch.resize(scratch.len().max(inverse.get_scratch_len()), Complex::default());
    let lengths = "buffers of the plan's own lengths";
    let mut output = forward.make_output_vec();
    values[..y.len()].copy_from_slice(y);
    forward.process_with_scratch(&mut values, &mut output, &mut scratch).expect(lengths);
    let mut energies = vec![0.0; rows + 1 - y.len()];
    for taxel in 0..taxels {
        let weights = phi.iter().skip(taxel).step_by(taxels);
        values.iter_mut().zip(weights).for_each(|(value, weight)| *value = *weight);
        values[rows..].fill(0.0);
        forward.process_with_scratch(&mut values, &mut spectrum, &mut scratch).expect(lengths);
        spectrum.iter_mut().zip(&output).for_each(|(w, y)| *w *= y.conj());
        inverse.process_with_scratch(&mut spectrum, &mut values, &mut scratch).expect(lengths);
        energies.iter_mut().zip(&values).for_each(|(energy, part)| *energy += part * part);
    }
    energies
}

/// Wrong rows that a contact is fitted at: how many, from which lag on, and how far apart.
const WRONG: (i64, i64, i64) = (12, -4 * REACH, 61);
/// Rows are the right ones when the fit leaves less than this share of the mean of wrong rows. On the real skin right
/// rows leave .35 to .51 of it in contacts of 500 samples and up to .76 in those of 210, and wrong ones .95 or more.
const RIGHT: f64 = 0.85;
/// It also has to be so many standard deviations below that mean, of the expected rows and of others: of a thousand
/// wrong ones the best lies 3.2 below.
const KEPT_SD: f64 = 3.0;
const FOUND_SD: f64 = 5.0;
/// Lags of a contact whose images are fitted: those with the largest ‖Φᵀy‖².
const CANDIDATES: usize = 12;

/// Slips of a recording of drops, contact by contact, in order, and the contacts that fit no rows, as block and range
/// of measurements. A slip is given from the end of the contact before it on. Contacts of less than 1.5 measurements a
/// taxel fit any rows and are left as they are, as are raster scans, several wires, and skins of more than 1024 taxels.
pub fn contact_slips(recording: &Recording) -> (Vec<Slip>, Vec<(usize, Range<usize>)>) {
    let (mut slips, mut unaligned): (Vec<Slip>, _) = (Vec::new(), Vec::new());
    let (taxels, wires) = (recording.taxels(), recording.weights().wire_count());
    if recording.mode() != Mode::Compressive || taxels > MOST_TAXELS || wires > 1 {
        return (slips, unaligned);
    }
    let mut lag = 0;
    // block and end of the contact before
    let mut before = (usize::MAX, 0);
    for RecordedBounce { block, start, end, .. } in find_bounces(recording) {
        if before.0 != block {
            before = (block, 0);
            if lag != 0 {
                slips.push(Slip { block, from: 0, rows: lag });
            }
        }
        let from = std::mem::replace(&mut before.1, end);
        if 2 * (end - start) < 3 * taxels {
            continue;
        }
        let chunk = Chunk::new(recording, block, start, end - start);
        let (count, first, step) = WRONG;
        let wrong = (0..count).filter_map(|k| chunk.residual(lag + first - step * k));
        let Some(wrong) = Sample::of(&wrong.collect::<Vec<f64>>()) else { continue };
        let limit = |sds: f64| (wrong.mean - sds * wrong.variance.sqrt()).min(RIGHT * wrong.mean);
        let kept = chunk.residual(lag).is_some_and(|left| left < limit(KEPT_SD));
        if !kept {
            let lags = (lag - REACH).min(-REACH)..=(lag + REACH).max(REACH);
            let residuals = candidates(&chunk, lags, lag).into_iter().take(CANDIDATES);
            let residuals = residuals.filter_map(|lag| Some((lag, chunk.residual(lag)?)));
            let found = residuals.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, left)| *left < limit(FOUND_SD));
            match found {
                Some((rows, _)) => {
                    lag = rows;
                    // at the first contact of a block, in place of the one carried over
                    slips.pop_if(|slip| (slip.block, slip.from) == (block, from));
                    slips.push(Slip { block, from, rows });
                }
                None => unaligned.push((block, start..end)),
            }
        }
    }
    (slips, unaligned)
}

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
struct Tracker<'a> {
    recording: &'a Recording,
    len: usize,
    /// Lag found last.
    lag: i64,
    slips: Vec<Slip>,
}

impl<'a> Tracker<'a> {
    fn new(recording: &'a Recording) -> Self {
        Self { recording, len: chunk_len(recording), lag: 0, slips: Vec::new() }
    }

    /// Finds the slips of block `block`.
    fn follow(&mut self, block: usize) {
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
            let sums = (all.expected(before.rows, &before.image), all.expected(after.rows, &after.image));
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

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::{Interpolated, Profile, Readout};
    use spts_models::{ConductanceMap, SkinLayout, Streams};

    /// Frames of a block, and its contact: as long a press as in the published recordings, in a shorter block.
    const FRAMES: usize = 600;
    const PRESSED: [f64; 4] = [0.2, 0.4, 0.7, 0.8];

    /// Presses of a blob at places of their own, through the readout as it was built, with `faults` of the clock.
    fn record(blocks: usize, faults: &str) -> Recording {
        let mut profile = Profile::named("as_built").unwrap();
        let faults: toml::Table = toml::from_str(faults).unwrap();
        profile.compressive.insert("missed_clocks".to_owned(), toml::Value::Table(faults));
        let mut readout =
            Readout::new(&profile, Mode::Compressive, &SkinLayout::default(), Streams::new(3), 0).unwrap();
        let mut sources: Vec<Interpolated> = (0..blocks).map(press).collect();
        readout.record(&mut sources, FRAMES * 100, 57).unwrap()
    }

    /// A press that rises, creeps while it is held, and is lifted.
    fn press(block: usize) -> Interpolated {
        let (row, col) = (2.0 + (block % 5) as f64, 7.0 - (block % 4) as f64);
        let map = |scale: f64| {
            let taxel = |k: usize| {
                let (r, c) = ((k / 10) as f64 - row, (k % 10) as f64 - col);
                1e-3 * scale * (-(r * r + c * c) / 3.0).exp() * (1.0 + 0.3 * (k as f64 * 1.7).sin())
            };
            ConductanceMap::from_values(10, 10, (0..100).map(taxel).collect())
        };
        let [touch, held, lift, away] = PRESSED;
        let times = vec![0.0, touch, held, lift, away, 10.0];
        Interpolated::new(times, [0.0, 0.0, 1.0, 1.04, 0.0, 0.0].map(map).to_vec()).unwrap()
    }

    /// Edges that are missed by chance, as often as in the published sessions that slip: one in 10 000 edges, one or
    /// two a press. The lag never falls, and it ends at as many as were missed; each press of the realigned recording
    /// is where it says.
    #[test]
    fn edges_missed_by_chance_are_followed() {
        assert_eq!(find_slips(&record(4, "probability = 0.0")), []);
        const BLOCKS: usize = 8;
        let recording = record(BLOCKS, "probability = 0.0\nall_probability = 1e-4");
        let slips = find_slips(&recording);
        assert!(slips.is_sorted_by_key(|slip| slip.rows), "{slips:?}");
        let last = slips.last().map_or(0, |slip| slip.rows) as f64;
        let expected = 1e-4 * recording.first_row(BLOCKS - 1, FRAMES) as f64;
        assert!((last - expected).abs() < 5.0 * expected.sqrt(), "{last}, expected {expected}");
        assert_eq!(find_slips(&recording.realigned(&slips)), []);
    }

    /// The sums that define them; a transform of 2048 values errs by some 1e-15 of the largest.
    #[test]
    fn energies_are_those_of_the_sums() {
        let (taxels, rows, samples) = (7, 1100, 300);
        let phi: Vec<f64> = (0..taxels * rows).map(|k| ((k * k * 31) % 17) as f64 - 8.0).collect();
        let y: Vec<f64> = (0..samples).map(|k| ((k * 7) % 23) as f64 - 11.0).collect();
        let found = correlation_energies(&phi, taxels, &y);
        assert_eq!(found.len(), rows + 1 - samples);
        let direct = |first: usize| -> f64 {
            let sum = |taxel: usize| -> f64 {
                let at = |k: usize| phi[(first + k) * taxels + taxel] * y[k];
                (0..samples).map(at).sum()
            };
            (0..taxels).map(|taxel| sum(taxel).powi(2)).sum()
        };
        let scale = found[0] / direct(0);
        let most = (0..found.len()).map(direct).fold(0.0, f64::max);
        for (first, energy) in found.iter().enumerate() {
            let error = (energy / scale - direct(first)).abs() / most;
            assert!(error < 1e-12, "{first}: {error}");
        }
    }
}
