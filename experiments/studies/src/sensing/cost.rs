//! Cost of rows: the size of their sums, and the errors caused by the readout's effects.

use super::error::SensingError;
use super::rows_for::RowsFor;
use crate::touches::{Touch, TouchWire};
use serde::Serialize;
use spts_circuit::{Mode, Profile, Weights};
use spts_models::{SkinLayout, Streams};
use spts_recon::rows::fewest_flips;

/// Measurements of the pattern whose costs are shown, at most: the usual window.
const PERIOD: usize = 20;
/// Windows a touch.
const WINDOWS: usize = 5;

/// Effects that are taken one by one, their profiles, and what they are called.
const CAUSES: [(&str, &str, &str); 5] = [
    ("as_built", "late_updates", "late updates"),
    ("as_built", "memory", "memory"),
    ("as_built", "contact_noise", "contact noise"),
    ("as_built", "idle_noise", "idle noise"),
    ("as_designed", "amplifier", "settling"),
];

/// What one designer's rows cost in one order: size of the samples, changes of weights, and errors by cause.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CostRow {
    /// Designer of the rows.
    pub designer: &'static str,
    /// "worth", the order of the design, or "fewest flips".
    pub order: &'static str,
    /// Measurements M of the pattern.
    pub m: usize,
    /// Mean share of the cells whose level changes from one row to the next.
    pub flips: f64,
    /// Root mean square of the samples, V.
    pub rms_v: f64,
    /// Largest sample, V.
    pub peak_v: f64,
    /// Root mean square error due to every cause, relative to that of the samples.
    pub errors: Vec<CauseError>,
}

/// Error of the samples due to one cause alone, such as late updates.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CauseError {
    /// Cause.
    pub cause: &'static str,
    /// Root mean square error relative to the root mean square of the samples.
    pub share: f64,
}

/// Costs of every designer's rows, in both orders, on `touches`.
pub(super) fn costs(
    rows: &[RowsFor],
    touches: &[Touch],
    layout: &SkinLayout,
    device: Streams,
) -> Result<Vec<CostRow>, SensingError> {
    let mut all = Vec::new();
    for rows in rows {
        let m = rows.len().min(PERIOD);
        let matrix = rows.matrix(m);
        let flat = fewest_flips(matrix.view(), &vec![1.0; layout.taxels()]);
        for (order, numbers) in [("worth", (0..m).collect()), ("fewest flips", flat)] {
            let weights = rows.ordered(&numbers)?;
            all.push(cost(rows.designer, order, &weights, touches, layout, device)?);
        }
    }
    Ok(all)
}

fn cost(
    designer: &'static str,
    order: &'static str,
    weights: &Weights,
    touches: &[Touch],
    layout: &SkinLayout,
    device: Streams,
) -> Result<CostRow, SensingError> {
    let m = weights.patterns().map_or(1, spts_circuit::Patterns::period);
    let ideal = Profile::named("ideal")?;
    let samples = |profile: &Profile| -> Result<Vec<f64>, SensingError> {
        let mut wire = TouchWire::new(profile, weights, layout, device)?;
        let mut all = Vec::new();
        for (number, touch) in (0..).zip(touches) {
            all.extend(wire.measure(touch, number, 0, WINDOWS * m)?);
        }
        Ok(all)
    };
    let rms = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
        (sum / f64::max(count, 1.0)).sqrt()
    };
    let mut errors = Vec::new();
    let mut level_v = 0.0;
    let mut peak_v = 0.0;
    for (from, effect, cause) in CAUSES {
        let source = Profile::named(from)?;
        // the samples without the effect have the drive and the feedback of the same profile
        let mut bare = Profile {
            drive_v: source.drive_v,
            feedback_ohm: source.feedback_ohm,
            sample_rate_hz: source.sample_rate_hz,
            ..ideal.clone()
        };
        let clean = samples(&bare)?;
        if let Some(table) = source.compressive.get(effect) {
            bare.compressive.insert(effect.to_owned(), table.clone());
        }
        let with = samples(&bare)?;
        let own = rms(&mut clean.iter().copied());
        if from == "as_built" {
            level_v = own;
            peak_v = clean.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        }
        let error = rms(&mut with.iter().zip(&clean).map(|(a, b)| a - b));
        errors.push(CauseError {
            cause,
            share: error / own.max(f64::MIN_POSITIVE),
        });
    }
    Ok(CostRow {
        designer,
        order,
        m,
        flips: flips(weights),
        rms_v: level_v,
        peak_v,
        errors,
    })
}

/// Mean share of the cells whose code changes from one row of a pattern to the next, the first behind the last.
pub(super) fn flips(weights: &Weights) -> f64 {
    let Some(patterns) = weights.patterns() else {
        return 0.0;
    };
    let period = patterns.period() as u64;
    let changes = |row: u64| {
        let pairs = patterns.row(row).iter().zip(patterns.row(row + 1));
        pairs.filter(|(a, b)| a != b).count()
    };
    (0..period).map(changes).sum::<usize>() as f64 / (period as f64 * patterns.taxels() as f64)
}

impl CostRow {
    /// Means over repetitions with the same designers; the largest of all peaks.
    pub(super) fn mean(repetitions: &[&[Self]]) -> Vec<Self> {
        let Some((first, others)) = repetitions.split_first() else {
            return Vec::new();
        };
        let mut mean = first.to_vec();
        let share = 1.0 / repetitions.len() as f64;
        for (k, row) in mean.iter_mut().enumerate() {
            for other in others {
                let other = &other[k];
                row.flips += other.flips;
                row.rms_v += other.rms_v;
                row.peak_v = row.peak_v.max(other.peak_v);
                for (error, more) in row.errors.iter_mut().zip(&other.errors) {
                    error.share += more.share;
                }
            }
            row.flips *= share;
            row.rms_v *= share;
            row.errors.iter_mut().for_each(|e| e.share *= share);
        }
        mean
    }

    /// Headroom: the converter's range in `as_built` divided by the largest sample.
    #[must_use]
    pub fn headroom(&self) -> Option<f64> {
        let rail_v = Profile::named("as_built").ok()?.rail_v(Mode::Compressive).ok()??;
        (self.peak_v > 0.0).then_some(rail_v / self.peak_v)
    }
}
