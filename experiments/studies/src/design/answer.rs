//! Consequences of a design: costs, the limiting constraint, alternatives, and files to simulate it.

use super::search::{Bench, Tried, draw, mean};
use super::wire::{BandRows, FeedbackLimit, RowSource};
use super::{Alternative, Binding, CostDrivers, Design, DesignReport, DesignStudy, Ground, LatencyParts, WireChoice};
use crate::sensing::load_s;
use spts_firmware::{FIRST_ADDRESS, LAST_BUS_ADDRESS, Pattern};
use spts_input::Refusal;
use spts_models::SkinLayout;

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
        chosen: Tried,
        others: Vec<Tried>,
        design: Design,
    ) -> Result<DesignReport, Refusal> {
        let reached = chosen.reached.is_some();
        let acquisition_s = design.m_per_wire as f64 * design.wire.period_s;
        let (binding, binding_reason) = self.binding(&design, &chosen, &others, reached, acquisition_s);
        let mut alternatives: Vec<Alternative> = Vec::new();
        for other in &others {
            alternatives.extend(searched(ground, &chosen, other));
        }
        alternatives.extend(self.more_wires(ground, &design)?);
        alternatives.extend(self.coarser(&design)?);
        alternatives.push(raster(&design));
        let profile = design.wire.profile(design.row_source == RowSource::Generator)?;
        let pattern = chosen.bench.rows.text();
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
        chosen: &Tried,
        others: &[Tried],
        reached: bool,
        acquisition_s: f64,
    ) -> (Binding, String) {
        let latency_ms = 1e3 * self.latency_s;
        let (iou, wires) = (self.iou, design.wires);
        if design.wire.feedback_limit == FeedbackLimit::SlowerClock {
            let reason = format!(
                "the output takes {:.1} µs to settle, so that the clock is slowed to {:.1} kHz",
                1e6 * design.wire.settle_s,
                1e-3 * design.wire.rate_hz
            );
            return (Binding::AmplifierSettling, reason);
        }
        if !reached {
            let most = chosen.most;
            if chosen.by_latency {
                let wires_in_words = match self.wires {
                    WireChoice::Exactly(1) => "one wire was asked for".to_owned(),
                    WireChoice::Exactly(wires) => format!("{wires} wires were asked for"),
                    WireChoice::UpTo(most) => format!("no more than {most} are allowed"),
                };
                let reason = format!(
                    "{most} measurements a wire fit into {latency_ms} ms, and {wires_in_words}: that is not enough for an IoU of {iou}"
                );
                return (Binding::Latency, reason);
            }
            let reason = format!(
                "an IoU of {iou} is not reached with {most} measurements a wire, the most that there are rows, taxels and memory of the decoder for"
            );
            return (Binding::Measurements, reason);
        }
        if wires > 1 && matches!(self.wires, WireChoice::UpTo(_)) {
            let fewer = others.iter().filter(|t| t.curve.wires < wires);
            let best = fewer.max_by(|a, b| a.iou().total_cmp(&b.iou()));
            if let Some(best) = best {
                let reason = format!(
                    "with {} an IoU of {:.2} is reached within {latency_ms} ms, and {iou} is asked for",
                    counted(best.curve.wires, "wire"),
                    best.iou()
                );
                return (
                    if best.by_latency {
                        Binding::Latency
                    } else {
                        Binding::Measurements
                    },
                    reason,
                );
            }
        }
        let used = acquisition_s / self.latency_s;
        if used > FULL {
            let reason = format!(
                "{} measurements a wire fill {:.0} % of the {latency_ms} ms",
                design.m_per_wire,
                100.0 * used
            );
            return (Binding::Latency, reason);
        }
        let reason = format!(
            "an IoU of {iou} takes {} measurements a wire, which are {:.0} % of the {latency_ms} ms",
            design.m_per_wire,
            100.0 * used
        );
        (Binding::Iou, reason)
    }

    /// Twice the wires, half the measurements.
    fn more_wires(&self, ground: &Ground, design: &Design) -> Result<Option<Alternative>, Refusal> {
        let wires = 2 * design.wires;
        if wires > design.rows || design.m_per_wire < 8 {
            return Ok(None);
        }
        let m = design.m_per_wire.div_ceil(2);
        self.simulated(
            ground,
            "twice the wires, half the measurements each",
            wires,
            &design.row_source,
            m,
        )
    }

    /// A coarser pitch, the same measurements.
    fn coarser(&self, design: &Design) -> Result<Option<Alternative>, Refusal> {
        let coarse = Self {
            pitch_m: COARSER * self.pitch_m,
            ..self.clone()
        };
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
        let rows = BandRows::new(source, &ground.prior, wires, m, self.seed)?;
        let places = self.objects.places(&ground.layout);
        let mut bench = Bench::new(ground.layout, rows, wired.profile, ground.prior.clone(), places)?;
        bench.prepare(m)?;
        let drawn = draw(&self.objects, &ground.layout, "design/compared", self.seed, COMPARED)?;
        let scores = bench.score(&bench.measure(drawn, m)?, m, None)?;
        Ok(Some(Alternative {
            what: what.to_owned(),
            taxels: ground.layout.taxels(),
            pitch_m: ground.layout.pitch_m(),
            wires,
            rows: source.name().to_owned(),
            m_per_wire: m,
            acquisition_s: m as f64 * wired.wire.period_s,
            iou: Some(mean(&scores, |s| s.iou)),
            place_mm: Some(1e3 * ground.layout.pitch_m() * mean(&scores, |s| s.place_px)),
        }))
    }
}

/// What the search found beside the design: the other rows, and fewer wires.
fn searched(ground: &Ground, chosen: &Tried, other: &Tried) -> Option<Alternative> {
    let at = other.chosen();
    let point = other.curve.points.iter().find(|p| p.m_per_wire == at)?;
    let what = if other.curve.wires < chosen.curve.wires {
        format!("{}, all the time there is", counted(other.curve.wires, "wire"))
    } else {
        format!("{} rows", other.source.name())
    };
    let pitch_m = ground.layout.pitch_m();
    Some(Alternative {
        what,
        taxels: ground.layout.taxels(),
        pitch_m,
        wires: other.curve.wires,
        rows: other.source.name().to_owned(),
        m_per_wire: at,
        acquisition_s: at as f64 * other.wire.period_s,
        iou: Some(point.iou.mean),
        place_mm: Some(1e3 * pitch_m * point.place_px),
    })
}

/// A scan of every taxel of every wire at the same clock: no decoder is needed.
fn raster(design: &Design) -> Alternative {
    let most = design.sub_arrays.iter().copied().max().unwrap_or_default();
    Alternative {
        what: "a scan of every taxel, without a decoder".to_owned(),
        taxels: design.taxels,
        pitch_m: design.pitch_m,
        wires: design.wires,
        rows: "raster".to_owned(),
        m_per_wire: most,
        acquisition_s: most as f64 * design.wire.period_s,
        iou: None,
        place_mm: None,
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

/// A scene of one press on the design's first sub-array, for `spts simulate`.
fn scene(design: &Design) -> String {
    let rows = design.sub_arrays.first().copied().unwrap_or_default() / design.cols.max(1);
    let of = if design.wires > 1 {
        format!(
            "The sub-array of the first of {} wires: a session is of one wire.",
            design.wires
        )
    } else {
        "The whole skin, on its one wire.".to_owned()
    };
    let source = match &design.row_source {
        RowSource::Generator => "kind = \"generator\"\nseeding = \"mixed\"",
        RowSource::Designer(_) => "kind = \"pattern\"\npatterns_file = \"rows.txt\"",
    };
    format!(
        "# {of}\nname = \"design\"\nseed = {}\nreadout = \"profile.toml\"\n\n[skin]\nrows = {rows}\ncols = {}\npitch_m = {:e}\n\
         electrode_m = {:e}\n\n[rows]\n{source}\n\n[contact]\nmodel = \"footprint\"\n\n[press]\nobject = \"eraser\"\n\
         position_share = [0.0, 0.0]\nforce_n = 10.0\npresses = 1\n",
        design.seed, design.cols, design.pitch_m, design.electrode_m
    )
}

/// "1 wire", "2 wires".
pub fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// The layout of a design.
pub(super) fn layout_of(design: &Design) -> Result<SkinLayout, Refusal> {
    SkinLayout::new(design.rows, design.cols, design.pitch_m, design.electrode_m)
}
