//! Amplifier, clock and converter of a wire.

use crate::electronics::ElectronicsStudy;
use crate::wiring::{amplifier, bisected, pressed_skin, profile};
use serde::{Deserialize, Serialize};
use spts_circuit::amplifier::{Budget, Setting};
use spts_circuit::{Patterns, Profile, Seeding, WeightMode, WeightRows, Weights, WireConfig, Wires};
use spts_input::Refusal;
use spts_models::{SkinLayout, parsed};
use spts_recon::matrix_free::SheetPrior;
use spts_recon::rows::{Expected, RowTask, designer};
use std::ops::Range;
use toml::Table;

/// Share of the range that the sums of the touches use that were drawn: others press harder.
const HEADROOM: f64 = 0.7;
/// A feedback is looked for down to this share of the one that uses the range.
const SMALLEST_FEEDBACK: f64 = 1e-3;
/// Halvings of the search, on a logarithmic scale.
const HALVINGS: usize = 40;

/// What keeps the feedback resistance of a designed skin's amplifier from being larger.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FeedbackLimit {
    /// The sum of the strongest touch uses the whole range of amplifier and converter.
    Range,
    /// With a larger one the output would not settle within the clock's period.
    Settling,
    /// With no feedback does the output settle within the period of the published clock; the clock is slower.
    SlowerClock,
}

/// Electronics of one wire. All wires are alike; the values are for the wire with the most taxels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WireDesign {
    /// Number of taxels on it.
    pub taxels: usize,
    /// Operational amplifier: that of the profile as_designed.
    pub amplifier: String,
    /// Measurements a second, Hz.
    pub rate_hz: f64,
    /// Duration of a measurement, s.
    pub period_s: f64,
    /// Part of the measurement in which the output settles, s.
    pub available_s: f64,
    /// Settling time of the output to half a step of the converter, including slewing, s.
    pub settle_s: f64,
    /// Feedback resistance, Ω.
    pub feedback_ohm: f64,
    /// What determined it.
    pub feedback_limit: FeedbackLimit,
    /// 1 + Rf ΣG under the strongest touch.
    pub noise_gain: f64,
    /// Sum that has to fit, V: four standard deviations for random signs, or all signs alike for designed rows.
    pub excursion_v: f64,
    /// Largest output within the ranges of amplifier and converter, V.
    pub range_v: f64,
    /// Resolution of the converter, bits.
    pub adc_bits: u32,
    /// Step of the converter, V at the amplifier's output.
    pub adc_step_v: f64,
    /// Signal of a pressed taxel in the strongest touch, in steps of the converter.
    pub steps_per_taxel: f64,
    /// Limit that the amplifier's closed forms show as exceeded; `None` if there is none.
    pub limit: Option<String>,
}

/// The name of the amplifier in the profile as_designed.
pub(super) const AMPLIFIER: &str = "TLV9362";

impl WireDesign {
    /// A wire of `taxels` taxels whose ΣG and ΣG², S and S², are `pressing`; `alike` if rows may add up all of a touch
    /// with one sign.
    pub(super) fn new(
        electronics: &ElectronicsStudy,
        taxels: usize,
        pressing: (f64, f64),
        alike: bool,
    ) -> Result<Self, Refusal> {
        let mut setting = Setting {
            skin: pressed_skin(pressing, taxels, electronics),
            adc: electronics.adc,
            available_s: electronics.available_s()?,
        };
        let budget = |feedback_ohm: f64, setting: &Setting| -> Result<Budget, Refusal> {
            let amplifier = amplifier(electronics, feedback_ohm)?;
            Ok(Budget::new(&amplifier, taxels as f64, setting))
        };
        let excursion_of = |b: &Budget| if alike { b.sum_worst_v } else { b.excursion_v };
        let designed_ohm = electronics.network.feedback_ohm;
        let as_designed = budget(designed_ohm, &setting)?;
        // sums are proportional to the feedback
        let most_ohm = designed_ohm * HEADROOM * as_designed.range_v / excursion_of(&as_designed);
        let fits = |feedback_ohm: f64, setting: &Setting| -> Result<bool, Refusal> {
            let b = budget(feedback_ohm, setting)?;
            // a step of the converter that is larger than a taxel costs image and stops nothing, and no feedback
            // changes the current that the sum takes: `limit` names both
            Ok(b.settle_s + b.slew_s <= setting.available_s && !b.saturates)
        };
        let (feedback_ohm, feedback_limit) = if fits(most_ohm, &setting)? {
            (most_ohm, FeedbackLimit::Range)
        } else if fits(SMALLEST_FEEDBACK * most_ohm, &setting)? {
            let ends = [SMALLEST_FEEDBACK.ln(), 0.0];
            let share = bisected(ends, HALVINGS, |log| fits(most_ohm * log.exp(), &setting))?;
            (most_ohm * share.exp(), FeedbackLimit::Settling)
        } else {
            let b = budget(most_ohm, &setting)?;
            setting.available_s = (b.settle_s + b.slew_s) * (1.0 + 1e-9);
            (most_ohm, FeedbackLimit::SlowerClock)
        };
        let b = budget(feedback_ohm, &setting)?;
        let period_s = setting.available_s + electronics.busy_s;
        Ok(Self {
            taxels,
            amplifier: AMPLIFIER.to_owned(),
            rate_hz: 1.0 / period_s,
            period_s,
            available_s: setting.available_s,
            settle_s: b.settle_s + b.slew_s,
            feedback_ohm,
            feedback_limit,
            noise_gain: b.noise_gain,
            excursion_v: excursion_of(&b),
            range_v: b.range_v,
            #[expect(clippy::cast_possible_truncation, reason = "at most 2^24 codes")]
            adc_bits: (electronics.adc.code(f64::MIN) as u32 + 1).ilog2(),
            adc_step_v: b.adc_step_v,
            steps_per_taxel: b.signal_v / b.adc_step_v,
            limit: b.limit.map(|limit| limit.name().to_owned()),
        })
    }

    /// Readout profile of the wire, and its TOML: as_designed with this feedback and clock. What the parts do not
    /// explain is as the recordings of the device show it: contact noise, late updates and idle noise of as_built.
    pub(super) fn profile(&self, mixed: bool) -> Result<(Profile, Table), Refusal> {
        let effects = ["late_updates", "contact_noise", "idle_noise"];
        let mut table = profile(self.feedback_ohm, self.rate_hz, self.available_s, &effects)?;
        table.insert("feedback_scales".to_owned(), false.into());
        if mixed {
            table.insert("seeding".to_owned(), "mixed".into());
        }
        let profile: Profile = parsed(table.clone())?;
        profile.validate(1)?;
        Ok((profile, table))
    }
}

/// Most rows that a cell holds as a pattern.
pub(super) const PATTERN_ROWS: usize = spts_firmware::PATTERN_BITS;
/// `greedy` is asked on wires of so many taxels at most: its time grows with their square.
const GREEDY_TAXELS: usize = 256;

/// Where the rows of a designed skin come from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RowSource {
    /// Pseudorandom signs of the cells' generators, seeded with a 32-bit mix of their addresses.
    Generator,
    /// Rows by the named designer, stored in the cells as a pattern of at most 64 rows.
    Designer(String),
}

impl RowSource {
    /// Name in tables and figures.
    pub fn name(&self) -> &str {
        match self {
            Self::Generator => "random",
            Self::Designer(name) => name,
        }
    }

    /// All sources that are worth a look on wires of `taxels` taxels.
    pub(crate) fn candidates(taxels: usize) -> Vec<Self> {
        let designed = |name: &str| Self::Designer(name.to_owned());
        let mut sources = vec![Self::Generator, designed("cosine_signs")];
        if taxels <= GREEDY_TAXELS {
            sources.push(designed("greedy"));
        }
        sources
    }

    /// Most rows there are, for a wire of `taxels` taxels.
    pub(crate) fn most_rows(&self, taxels: usize) -> usize {
        match self {
            Self::Generator => usize::MAX,
            Self::Designer(_) => PATTERN_ROWS.min(taxels),
        }
    }
}

/// Rows of a skin whose wires each read a band of its rows.
#[derive(Debug, Clone)]
pub(crate) struct BandRows {
    /// Weights of all taxels on their wires.
    pub(crate) weights: Weights,
}

/// The skin's rows of each of `wires` wires: bands whose heights differ by one at most, the highest first.
pub(super) fn bands(rows: usize, wires: usize) -> Vec<Range<usize>> {
    let (height, rest) = (rows / wires, rows % wires);
    let start = |wire: usize| wire * height + wire.min(rest);
    (0..wires).map(|wire| start(wire)..start(wire + 1)).collect()
}

impl BandRows {
    /// `measurements` rows of `source` for every wire; a generator has as many as are asked for.
    pub(crate) fn new(
        source: &RowSource,
        prior: &SheetPrior,
        wires: usize,
        measurements: usize,
        seed: u64,
    ) -> Result<Self, Refusal> {
        let [rows, cols] = prior.shape();
        let RowSource::Designer(name) = source else {
            let taxels = u32::try_from(rows * cols).map_err(|e| Refusal::from_error(e).at("taxels"))?;
            return Self::on_bands(Weights::new(WeightMode::Binary, Seeding::Mixed, taxels), [rows, cols], wires);
        };
        let bands = bands(rows, wires);
        let height = bands.first().map_or(0, Range::len);
        let expected = Expected::smooth([height, cols], length(prior))?;
        let task = RowTask { seed, ..RowTask::new(measurements, &expected) };
        let found = designer(name).ok_or_else(|| Refusal::new(format!("rows: no designer {name:?}")))?;
        let matrix = &(found.build)().design(&task)?;
        // every wire has the pattern of the highest band; one that is a row lower has its first taxels
        let codes = (0..matrix.nrows()).flat_map(|row| {
            let own = move |band: &Range<usize>| matrix.row(row)[..band.len() * cols].iter();
            bands.iter().flat_map(own).map(|v| if *v > 0.0 { u8::MAX } else { 0 })
        });
        Self::pattern(Patterns::new(matrix.nrows(), codes.collect())?, [rows, cols], wires)
    }

    /// The skin's `pattern`, on so many wires.
    pub(super) fn pattern(pattern: Patterns, shape: [usize; 2], wires: usize) -> Result<Self, Refusal> {
        Self::on_bands(Weights::with_patterns(WeightMode::Binary, pattern)?, shape, wires)
    }

    fn on_bands(weights: Weights, [rows, cols]: [usize; 2], wires: usize) -> Result<Self, Refusal> {
        let layout = SkinLayout::with_pitch(rows, cols, SkinLayout::default().pitch_m())?;
        Ok(Self { weights: weights.wired(Wires::new(&[WireConfig::bands(wires)], &layout)?)? })
    }

    /// Number of wires.
    pub(crate) fn wires(&self) -> usize {
        self.weights.wire_count()
    }

    /// The pattern of the skin, if it is one.
    pub(super) fn text(&self) -> Option<String> {
        self.weights.patterns().map(Patterns::to_text)
    }

    /// Measurements `range` of every wire, those of one measurement after another.
    pub(crate) fn rows(&self, range: Range<usize>) -> WeightRows<'_> {
        WeightRows::new(&self.weights, (range.start * self.wires()) as u64, range.len() * self.wires())
    }
}

/// Length over which images are smooth whose neighbours have the prior's covariance, taxels: that of exp(−d²/2ℓ²).
fn length(prior: &SheetPrior) -> f64 {
    let [rows, cols] = prior.shape();
    let neighbour = if cols > 1 {
        1
    } else if rows > 1 {
        cols
    } else {
        return SHORTEST;
    };
    let covariance = prior.covariance(0, neighbour).clamp(0.0, 0.999);
    (-0.5 / covariance.ln()).sqrt().max(SHORTEST)
}

/// Images of single taxels.
const SHORTEST: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;

    /// Twenty taxels of 100 µS: 4 · 3.3 V · Rf · √(20 · (100 µS)²) is 70 % of 14.9 V, by hand; the idle taxels add less
    /// than a thousandth.
    #[test]
    fn the_feedback_uses_the_range() {
        let electronics = ElectronicsStudy::as_designed().unwrap();
        let pressing = (20.0 * 100e-6, 20.0 * 1e-8);
        let wire = WireDesign::new(&electronics, 100, pressing, false).unwrap();
        let by_hand = 0.7 * 14.9 / (4.0 * 3.3 * (20.0 * 1e-8_f64).sqrt());
        assert!((wire.feedback_ohm / by_hand - 1.0).abs() < 1e-3, "{} {by_hand}", wire.feedback_ohm);
        assert_eq!((wire.feedback_limit, wire.adc_bits), (FeedbackLimit::Range, 10));
        assert!(wire.settle_s <= wire.available_s && wire.limit.is_none());
        // all signs alike: ΣG
        let wire = WireDesign::new(&electronics, 100, pressing, true).unwrap();
        assert!((wire.excursion_v - 0.7 * 14.9).abs() < 0.05);
    }

    /// More conductance needs more time: at first a smaller feedback buys it.
    #[test]
    fn a_full_skin_settles_with_a_smaller_feedback() {
        let electronics = ElectronicsStudy::as_designed().unwrap();
        let pressing = (4000.0 * 100e-6, 4000.0 * 1e-8);
        let wire = WireDesign::new(&electronics, 10_000, pressing, false).unwrap();
        assert_eq!(wire.feedback_limit, FeedbackLimit::Settling);
        assert!(wire.settle_s <= wire.available_s * (1.0 + 1e-6) && wire.excursion_v < 0.7 * wire.range_v);
    }

    #[test]
    fn the_profile_says_what_the_wire_is() {
        let electronics = ElectronicsStudy::as_designed().unwrap();
        let wire = WireDesign::new(&electronics, 100, (2e-3, 2e-7), false).unwrap();
        let (profile, _) = wire.profile(true).unwrap();
        assert!((profile.feedback_ohm - wire.feedback_ohm).abs() < 1e-9 * wire.feedback_ohm);
        assert!(!profile.feedback_scales && profile.compressive.contains_key("contact_noise"));
        assert!(profile.compressive.contains_key("idle_noise") && profile.raster.contains_key("idle_noise"));
    }

    #[test]
    fn bands_cover_the_skin() {
        assert_eq!(bands(10, 3), [0..4, 4..7, 7..10]);
        assert_eq!(bands(4, 4).len(), 4);
    }

    /// Rows of a wire are its weights on its own band and nothing elsewhere.
    #[test]
    fn rows_of_wires_do_not_overlap() {
        let prior = SheetPrior::smooth([5, 4], 1.0).unwrap();
        for source in RowSource::candidates(8) {
            let rows = BandRows::new(&source, &prior, 2, 6, 1).unwrap();
            let found = rows.rows(2..4);
            assert_eq!((0..found.len()).map(|row| found.wire(row)).collect::<Vec<_>>(), [0, 1, 0, 1]);
            for (number, row) in found.to_vec().chunks(20).enumerate() {
                for (k, v) in row.iter().enumerate() {
                    let own = (k / 4 < 3) == (number % 2 == 0);
                    assert!((v.abs() - if own { 1.0 } else { 0.0 }).abs() < 1e-15);
                }
            }
            assert_eq!(rows.text().is_some(), source != RowSource::Generator);
            // the shorter band has the first taxels of the higher one's pattern
            let row = found.to_vec();
            assert!(source == RowSource::Generator || row[..8] == row[20 + 12..40]);
        }
    }

    #[test]
    fn lengths_are_those_of_smooth_priors() {
        let prior = SheetPrior::smooth([5, 4], 1.7).unwrap();
        // the floor of the prior takes a thousandth of a covariance of .84
        assert!((length(&prior) - 1.7).abs() < 0.02);
    }
}
