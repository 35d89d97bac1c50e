//! Consequences of a design: costs, the limiting constraint, alternatives, and files to simulate it.

use super::search::{Tried, draw, mean};
use super::wire::{FeedbackLimit, RowSource, WireDesign};
use super::{Alternative, Binding, CostDrivers, Design, DesignReport, DesignStudy, Ground, LatencyParts, WireChoice};
use crate::sensing::load_s;
use spts_circuit::WireConfig;
use spts_firmware::{FIRST_ADDRESS, LAST_BUS_ADDRESS, Pattern};
use spts_input::Refusal;
use toml::Value;

/// Multiplications a second of the estimate of the decoder's time: one core, one lane.
const PRODUCTS_PER_S: f64 = 1e9;
/// Cells on a bus.
const BUS_CELLS: usize = (LAST_BUS_ADDRESS - FIRST_ADDRESS) as usize + 1;
/// Bytes that are written to a cell with a generator: mode and four bytes of seed.
const GENERATOR_BYTES: usize = 5;
/// Share of the latency above which the latency binds.
const FULL: f64 = 0.9;
/// How much coarser the other pitch is.
const COARSER: f64 = 1.5;
/// Repetitions that an alternative is looked at with.
const COMPARED: usize = 5;

impl DesignStudy {
    /// The whole answer: `chosen` was promised as `design`, and `others` were looked at before.
    pub(super) fn report(
        &self,
        ground: &Ground,
        chosen: Tried<'_>,
        others: Vec<Tried<'_>>,
        design: Design,
    ) -> Result<DesignReport, Refusal> {
        let reached = chosen.reached.is_some();
        let acquisition_s = design.m_per_wire as f64 * design.wire.period_s;
        let (binding, binding_reason) = self.binding(&design, &chosen, &others, acquisition_s);
        let mut alternatives: Vec<Alternative> = Vec::new();
        for other in &others {
            alternatives.extend(searched(ground, &chosen, other));
        }
        alternatives.extend(self.more_wires(ground, &design)?);
        alternatives.extend(self.coarser(&design)?);
        // a scan of every taxel of every wire at the same clock
        let most = design.sub_arrays.iter().copied().max().unwrap_or_default();
        let what = "a scan of every taxel, without a decoder";
        alternatives.push(alternative(ground, what, design.wires, "raster", most, &design.wire, None));
        let (_, mut profile) = design.wire.profile(design.row_source == RowSource::Generator)?;
        let pattern = chosen.bench.rows.text();
        if let Some(pattern) = &pattern {
            profile.insert("patterns".to_owned(), pattern.clone().into());
        }
        if design.wires > 1 {
            let bands = WireConfig::bands(design.wires);
            let bands = Value::try_from(bands).map_err(|e| Refusal::from_error(e).at("wires"))?;
            profile.insert("wires".to_owned(), vec![bands].into());
        }
        let profile = toml::to_string(&profile).map_err(|e| Refusal::from_error(e).at("profile"))?;
        let scene = scene(&design);
        let mut curves: Vec<_> = others.into_iter().map(|t| t.curve).collect();
        curves.push(chosen.curve);
        curves.sort_by_key(|c| (c.wires, c.rows.name().to_owned()));
        Ok(DesignReport {
            reached,
            iou_wanted: self.iou,
            latency: LatencyParts {
                limit_s: self.latency_s,
                acquisition_s,
                settle_s: design.wire.settle_s,
                decode_estimate_s: design.decoder.products as f64 / PRODUCTS_PER_S,
            },
            cost: cost(&design),
            binding,
            binding_reason,
            one_wire_taxels: ground.electronics.largest_on_one_wire()?,
            alternatives,
            curves,
            profile,
            pattern,
            scene,
            design,
        })
    }

    /// What binds, and why.
    fn binding(
        &self,
        design: &Design,
        chosen: &Tried<'_>,
        others: &[Tried<'_>],
        acquisition_s: f64,
    ) -> (Binding, String) {
        let latency_ms = 1e3 * self.latency_s;
        let (iou, most, wires, wire) = (self.iou, chosen.wired.most, design.wires, &design.wire);
        if wire.feedback_limit == FeedbackLimit::SlowerClock {
            let (settle_us, rate_khz) = (1e6 * wire.settle_s, 1e-3 * wire.rate_hz);
            let slower = format!("so that the clock is slowed to {rate_khz:.1} kHz");
            let reason = format!("the output takes {settle_us:.1} µs to settle, {slower}");
            return (Binding::AmplifierSettling, reason);
        }
        let of_limit = |tried: &Tried<'_>| match tried.wired.by_latency {
            true => Binding::Latency,
            false => Binding::Measurements,
        };
        if chosen.reached.is_none() {
            let reason = if chosen.wired.by_latency {
                let wires_in_words = match self.wires {
                    WireChoice::Exactly(1) => "one wire was asked for".to_owned(),
                    WireChoice::Exactly(wires) => format!("{wires} wires were asked for"),
                    WireChoice::UpTo(most) => format!("no more than {most} are allowed"),
                };
                let fit = format!("{most} measurements a wire fit into {latency_ms} ms");
                format!("{fit}, and {wires_in_words}: that is not enough for an IoU of {iou}")
            } else {
                let limits = "the most that there are rows, taxels and memory of the decoder for";
                format!("an IoU of {iou} is not reached with {most} measurements a wire, {limits}")
            };
            return (of_limit(chosen), reason);
        }
        let fewer = others.iter().filter(|t| t.curve.wires < wires);
        let best = fewer.max_by(|a, b| a.iou().total_cmp(&b.iou()));
        if let (WireChoice::UpTo(_), Some(best)) = (self.wires, best) {
            let (wires, reached) = (counted(best.curve.wires, "wire"), best.iou());
            let reason = format!(
                "with {wires} an IoU of {reached:.2} is reached within {latency_ms} ms, and {iou} is asked for"
            );
            return (of_limit(best), reason);
        }
        let (m, used) = (design.m_per_wire, acquisition_s / self.latency_s);
        let percent = 100.0 * used;
        if used > FULL {
            let reason = format!("{m} measurements a wire fill {percent:.0} % of the {latency_ms} ms");
            return (Binding::Latency, reason);
        }
        let which = format!("which are {percent:.0} % of the {latency_ms} ms");
        (Binding::Iou, format!("an IoU of {iou} takes {m} measurements a wire, {which}"))
    }

    /// Twice the wires, half the measurements.
    fn more_wires(&self, ground: &Ground, design: &Design) -> Result<Option<Alternative>, Refusal> {
        let wires = 2 * design.wires;
        if wires > design.rows || design.m_per_wire < 8 {
            return Ok(None);
        }
        let m = design.m_per_wire.div_ceil(2);
        self.simulated(ground, "twice the wires, half the measurements each", wires, &design.row_source, m)
    }

    /// A coarser pitch, the same measurements.
    fn coarser(&self, design: &Design) -> Result<Option<Alternative>, Refusal> {
        let coarse = Self { pitch_m: COARSER * self.pitch_m, ..self.clone() };
        let Ok(layout) = coarse.layout() else { return Ok(None) };
        if design.wires > layout.rows() || design.m_per_wire * design.wires > layout.taxels() {
            return Ok(None);
        }
        let ground = coarse.ground(layout)?;
        let what = "a pitch half as large again, the same measurements";
        coarse.simulated(&ground, what, design.wires, &design.row_source, design.m_per_wire)
    }

    /// Another design, simulated with a few touches.
    fn simulated(
        &self,
        ground: &Ground,
        what: &str,
        wires: usize,
        source: &RowSource,
        m: usize,
    ) -> Result<Option<Alternative>, Refusal> {
        let wired = self.wired(ground, wires, source)?;
        if m > wired.most {
            return Ok(None);
        }
        let mut bench = self.bench(ground, &wired, source, wires, m)?;
        bench.prepare(m)?;
        let drawn = draw(&self.objects, &ground.layout, "design/compared", self.seed, COMPARED)?;
        let scores = bench.score(&bench.measure(drawn, m)?, m, None)?;
        let found = (mean(&scores, |s| s.iou), mean(&scores, |s| s.place_px));
        let rows = source.name();
        Ok(Some(alternative(ground, what, wires, rows, m, &wired.wire, Some(found))))
    }
}

/// What the search found beside the design: the other rows, and fewer wires.
fn searched(ground: &Ground, chosen: &Tried<'_>, other: &Tried<'_>) -> Option<Alternative> {
    let (at, wires, rows) = (other.chosen(), other.curve.wires, other.curve.rows.name());
    let point = other.curve.points.iter().find(|p| p.m_per_wire == at)?;
    let what = if wires < chosen.curve.wires {
        format!("{}, all the time there is", counted(wires, "wire"))
    } else {
        format!("{rows} rows")
    };
    let found = (point.iou.mean, point.place_px);
    Some(alternative(ground, &what, wires, rows, at, &other.wired.wire, Some(found)))
}

/// `what` differs from the design: `m` measurements of every wire, where IoU and place error, taxels, were `found`.
fn alternative(
    ground: &Ground,
    what: &str,
    wires: usize,
    rows: &str,
    m: usize,
    wire: &WireDesign,
    found: Option<(f64, f64)>,
) -> Alternative {
    let pitch_m = ground.layout.pitch_m();
    Alternative {
        what: what.to_owned(),
        taxels: ground.layout.taxels(),
        pitch_m,
        wires,
        rows: rows.to_owned(),
        m_per_wire: m,
        acquisition_s: m as f64 * wire.period_s,
        iou: found.map(|(iou, _)| iou),
        place_mm: found.map(|(_, place_px)| 1e3 * pitch_m * place_px),
    }
}

fn cost(design: &Design) -> CostDrivers {
    let designed = design.row_source != RowSource::Generator;
    let bytes_a_cell = if designed {
        Pattern::new(design.m_per_wire, 0).map_or(GENERATOR_BYTES, |pattern| pattern.message().len())
    } else {
        GENERATOR_BYTES
    };
    CostDrivers {
        cells: design.taxels,
        wires: design.wires,
        amplifiers: design.wires,
        converters: design.wires,
        buses: design.taxels.div_ceil(BUS_CELLS),
        pattern_bits: designed.then_some(design.m_per_wire),
        bytes_a_cell,
        load_s: load_s(bytes_a_cell, design.taxels),
    }
}

/// A scene of one press on the design's skin with all of its wires, for `spts simulate`.
fn scene(design: &Design) -> String {
    let rows = design.rows;
    let of = format!("The whole skin, on its {}.", counted(design.wires, "wire"));
    let source = match &design.row_source {
        RowSource::Generator => "kind = \"generator\"\nseeding = \"mixed\"",
        RowSource::Designer(_) => "kind = \"pattern\"\npatterns_file = \"rows.txt\"",
    };
    format!(
        "# {of}\nname = \"design\"\nseed = {}\nreadout = \"profile.toml\"\n\n[skin]\nrows = {rows}\ncols = {}\npitch_m = {:e}\n\
         electrode_m = {:e}\n\n[rows]\n{source}\n\n[contact]\nmodel = \"footprint\"\n\n[press]\nforce_n = {:.1}\npresses = 1\n{}",
        design.seed,
        design.cols,
        design.pitch_m,
        design.electrode_m,
        FORCE_N * design.objects.contacts as f64,
        pressed(design)
    )
}

/// Force on each object of the scene, N.
const FORCE_N: f64 = 10.0;
/// Objects lie within this share of the sheet's width and height, from the middle to both sides.
const WITHIN: f64 = 0.35;

/// The objects of the scene, as entries of `press.objects`: as many as the design is for, spread over the sheet. The
/// ball's contact is small, and the eraser's is large; where the sheet is no larger than the eraser, it is the ball.
fn pressed(design: &Design) -> String {
    let side_m = design.rows.min(design.cols) as f64 * design.pitch_m;
    let large = design.objects.size_m[1] > SMALL_M && side_m > ERASER_M;
    let name = if large { "eraser" } else { "tennis" };
    let count = design.objects.contacts as f64;
    // on a spiral whose points are as far apart as they can be; a single one is in the middle
    let place = |k: usize| {
        let radius =
            if count > 1.0 { WITHIN * ((k as f64 + 0.5) / count).sqrt() * std::f64::consts::SQRT_2 } else { 0.0 };
        let (y, x) = (GOLDEN_RAD * k as f64).sin_cos();
        [x, y].map(|v| (radius * v).clamp(-WITHIN, WITHIN))
    };
    let entry = |k: usize| {
        let [x, y] = place(k);
        format!("\n[[press.objects]]\nobject = \"{name}\"\nposition_share = [{x:.3}, {y:.3}]\n")
    };
    (0..design.objects.contacts).map(entry).collect()
}

/// Largest extent of small objects, m.
const SMALL_M: f64 = 0.05;
/// Longer side of the eraser, m.
const ERASER_M: f64 = 0.087;
/// The golden angle, π(3 − √5).
const GOLDEN_RAD: f64 = 2.399_963_229_728_653;

/// "1 wire", "2 wires".
pub fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}
