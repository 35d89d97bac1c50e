//! Checks a design with other touches.

use super::search::{Bench, TOUCHES, draw, mean};
use super::wire::{AMPLIFIER, BandRows, RowSource, bands};
use super::{Design, DesignStudy, MOST_SIDE, WireChoice, decoder_name};
use rand::RngExt as _;
use serde::Serialize;
use spts::progress::Progress;
use spts_circuit::{Profile, parse_patterns};
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams, in_interval, within};
use spts_recon::rows::{DESIGNERS, designer};
use spts_recon::statistics::Band;

/// A design, its files, and the seed of the check.
#[derive(Debug, Clone)]
pub struct DesignCheck {
    /// The design with its promise.
    pub design: Design,
    /// Readout profile of a wire.
    pub profile: Profile,
    /// Text of the pattern, if rows are designed.
    pub pattern: Option<String>,
    /// Seed of all random numbers of the check.
    pub seed: u64,
}

/// One quantity that a design promises, such as the IoU, and its value in the check.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CheckedQuantity {
    /// Name.
    pub quantity: &'static str,
    /// Promised value and band.
    pub promised: Band,
    /// Value in the check.
    pub found: f64,
    /// Whether the value lies in the band.
    pub agrees: bool,
}

/// Results of `spts design check`: whether new simulated touches find what the design promised.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckReport {
    /// Whether all quantities lie in their bands.
    pub agrees: bool,
    /// Quantities.
    pub quantities: Vec<CheckedQuantity>,
    /// Number of repetitions.
    pub repetitions: usize,
    /// Number of touches in each repetition.
    pub touches: usize,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Most repetitions of a design that is checked: more than any design has.
const MOST_REPETITIONS: usize = 1000;
/// Most measurements of a wire.
const MOST_MEASUREMENTS: usize = 1 << 16;

impl Design {
    /// Checks that numbers and names can be those of a design, those too on which its check does not depend.
    ///
    /// # Errors
    /// [`Refusal`] for the first one outside its range.
    pub fn check(&self) -> Result<(), Refusal> {
        let expected = &self.expected;
        let touches = TOUCHES[usize::from(self.objects.seventeen)];
        for (field, side) in [("rows", self.rows), ("cols", self.cols)] {
            within(field, side as f64, 2.0, MOST_SIDE, "[2, 256]")?;
        }
        let counts = [
            ("taxels", self.taxels, self.rows * self.cols, self.rows * self.cols),
            ("wires", self.wires, 1, self.rows),
            ("m_per_wire", self.m_per_wire, 1, MOST_MEASUREMENTS),
            ("m", self.m, self.m_per_wire.saturating_mul(self.wires), self.m_per_wire.saturating_mul(self.wires)),
            ("decoder.places", self.decoder.places, 1, self.taxels),
            ("expected.repetitions", expected.repetitions, 2, MOST_REPETITIONS),
            ("expected.touches", expected.touches, touches, touches),
        ];
        for (field, value, least, most) in counts {
            if !(least..=most).contains(&value) {
                return Err(Refusal::range(field, value, format!("[{least}, {most}]")));
            }
        }
        let sizes: Vec<usize> = bands(self.rows, self.wires).iter().map(|band| band.len() * self.cols).collect();
        if self.sub_arrays != sizes {
            let range = format!("{{{sizes:?}}}, the bands of {} rows on {} wires", self.rows, self.wires);
            return Err(Refusal::range("sub_arrays", format!("{:?}", self.sub_arrays), range));
        }
        for (field, name, known) in [
            ("wire.amplifier", &self.wire.amplifier, AMPLIFIER),
            ("decoder.name", &self.decoder.name, decoder_name(self.taxels, self.objects.contacts)),
        ] {
            if name != known {
                return Err(Refusal::range(field, name, format!("{{{known}}}")));
            }
        }
        if let RowSource::Designer(name) = &self.row_source
            && designer(name).is_none()
        {
            let known: Vec<&str> = DESIGNERS.iter().map(|d| d.name).collect();
            return Err(Refusal::range("row_source.designer", name, format!("{{{}}}", known.join(", "))));
        }
        let wire = &self.wire;
        let electronics = [
            ("wire.period_s", wire.period_s, "(0, 1] s"),
            ("wire.available_s", wire.available_s, "(0, 1] s"),
            ("wire.settle_s", wire.settle_s, "(0, 1] s"),
            ("wire.feedback_ohm", wire.feedback_ohm, "(0, 1e9] Ω"),
            ("wire.noise_gain", wire.noise_gain, "[1, 1e9]"),
            ("wire.excursion_v", wire.excursion_v, "(0, 1e9] V"),
            ("wire.range_v", wire.range_v, "(0, 1e3] V"),
            ("wire.adc_step_v", wire.adc_step_v, "(0, 1e3] V"),
            ("wire.steps_per_taxel", wire.steps_per_taxel, "[0, 1e9]"),
            ("wire.adc_bits", f64::from(wire.adc_bits), "[1, 24]"),
        ];
        for (field, value, interval) in electronics {
            in_interval(field, value, interval)?;
        }
        if (wire.rate_hz * wire.period_s - 1.0).abs() > 1e-9 {
            let range = format!("{{{}}}, one measurement a `wire.period_s`", 1.0 / wire.period_s);
            return Err(Refusal::range("wire.rate_hz", wire.rate_hz, range));
        }
        if wire.taxels != sizes[0] {
            return Err(Refusal::range("wire.taxels", wire.taxels, format!("{{{}}}, the largest band", sizes[0])));
        }
        let farthest = self.rows.max(self.cols) as f64;
        let bands = [
            ("expected.iou", Some(expected.iou), 1.0),
            ("expected.place_px", Some(expected.place_px), farthest),
            ("expected.place_mm", Some(expected.place_mm), 1e3 * farthest * self.pitch_m),
            ("expected.class", expected.class, 1.0),
        ];
        for (field, band, most) in bands {
            let Some(Band { mean, low, high }) = band else { continue };
            if !(0.0 <= low && low <= mean && mean <= high && high <= 2.0 * most) {
                let range = format!("0 ≤ low ≤ mean ≤ high ≤ {}", 2.0 * most);
                return Err(Refusal::range(field, format!("{mean} ({low} to {high})"), range));
            }
        }
        Ok(())
    }
}

impl DesignCheck {
    /// Simulates the design with specimens of the skin, device parts, touches and noise other than those on which the
    /// promise is based, and with the same number of them.
    ///
    /// # Errors
    /// [`Refusal`] if the design is not valid, or its files do not belong to it.
    pub fn run(&self, progress: &dyn Progress) -> Result<CheckReport, Refusal> {
        let design = &self.design;
        let layout = SkinLayout::new(design.rows, design.cols, design.pitch_m, design.electrode_m)?;
        let refused = |what: &str, reason: String| Refusal::new(format!("{what}: {reason}"));
        design.check()?;
        let expected = &design.expected;
        progress.stage("preparing", None);
        let study = DesignStudy {
            area_m: layout.extent_m(),
            pitch_m: design.pitch_m,
            latency_s: design.m_per_wire as f64 * design.wire.period_s,
            iou: 0.5,
            wires: WireChoice::Exactly(design.wires),
            objects: design.objects.clone(),
            seed: design.seed,
        };
        let ground = study.ground(layout)?;
        let rows = match (&design.row_source, &self.pattern) {
            (RowSource::Generator, _) => {
                BandRows::new(&design.row_source, &ground.prior, design.wires, design.m_per_wire, design.seed)?
            }
            (RowSource::Designer(_), Some(text)) => {
                let taxels = design.rows * design.cols;
                let pattern = parse_patterns(text).map_err(|e| refused("rows.txt", e.to_string()))?;
                let (found, wanted) = ((pattern.period(), pattern.taxels()), (design.m_per_wire, taxels));
                if found != wanted {
                    let reason =
                        format!("{} rows of {} taxels; the design has {} of {}", found.0, found.1, wanted.0, wanted.1);
                    return Err(refused("rows.txt", reason));
                }
                BandRows::pattern(pattern, [design.rows, design.cols], design.wires)?
            }
            (RowSource::Designer(_), None) => {
                return Err(refused("rows.txt", "the pattern of the design is missing".to_owned()));
            }
        };
        let classes = match expected.class {
            Some(_) => study.classes(&ground)?,
            None => None,
        };
        let m = design.m_per_wire;
        let mut bench = Bench::new(&ground, rows, self.profile.clone(), design.decoder.places)?;
        bench.prepare(m)?;
        progress.stage("simulating", None);
        let seed = Streams::new(self.seed).rng("design/check", 0).random();
        let drawn = draw(&design.objects, &layout, "design/checked", seed, expected.repetitions)?;
        let scores = bench.score(&bench.measure(drawn, m)?, m, classes.as_ref())?;
        progress.end();
        let quantity = |quantity, promised: Band, found: f64| CheckedQuantity {
            quantity,
            promised,
            found,
            agrees: promised.holds(found),
        };
        let mut quantities = vec![
            quantity("IoU", expected.iou, mean(&scores, |s| s.iou)),
            quantity("place error, taxels", expected.place_px, mean(&scores, |s| s.place_px)),
        ];
        if let Some(promised) = expected.class {
            let found = mean(&scores, |s| s.class.unwrap_or_default());
            quantities.push(quantity("objects recognised", promised, found));
        }
        Ok(CheckReport {
            agrees: quantities.iter().all(|q| q.agrees),
            quantities,
            repetitions: expected.repetitions,
            touches: expected.touches,
            seed: self.seed,
        })
    }
}
