//! A design and its check as text.

use super::Alternative;
use super::DesignReport;
use super::answer::counted;
use super::check::CheckReport;
use super::wire::FeedbackLimit;
use super::wire::RowSource;
use crate::electronics::ElectronicsStudy;
use spts_recon::statistics::Band;

impl DesignReport {
    /// The design as text.
    #[must_use]
    pub fn text(&self) -> String {
        let (d, w) = (&self.design, &self.design.wire);
        let mut out = format!(
            "{}\n\n",
            if self.reached {
                format!(
                    "an IoU of {} is expected within {} ms",
                    self.iou_wanted,
                    ms(self.latency.limit_s)
                )
            } else {
                format!(
                    "NOT REACHABLE: an IoU of {} within {} ms; this is the best there is",
                    self.iou_wanted,
                    ms(self.latency.limit_s)
                )
            }
        );
        let mut line = |what: &str, says: String| out.push_str(&format!("{what:<16} {says}\n"));
        line(
            "skin",
            format!(
                "{} × {} = {} taxels, pitch {} mm, electrodes {} mm",
                d.rows,
                d.cols,
                d.taxels,
                mm(d.pitch_m),
                mm(d.electrode_m)
            ),
        );
        let least = d.sub_arrays.iter().min().copied().unwrap_or_default();
        let most = d.sub_arrays.iter().max().copied().unwrap_or_default();
        let each = if least == most {
            most.to_string()
        } else {
            format!("{least} or {most}")
        };
        line(
            "wires",
            format!(
                "{}, {each} taxels each, read at the same time",
                counted(d.wires, "wire")
            ),
        );
        line(
            "clock",
            format!(
                "{:.1} kHz; the output settles in {:.2} of {:.2} µs",
                1e-3 * w.rate_hz,
                1e6 * w.settle_s,
                1e6 * w.available_s
            ),
        );
        line(
            "amplifier",
            format!(
                "{} with {:.0} Ω of feedback, which the {}; noise gain {:.1}, sums up to {:.1} of {:.1} V",
                w.amplifier,
                w.feedback_ohm,
                match w.feedback_limit {
                    FeedbackLimit::Range => "range decides",
                    FeedbackLimit::Settling => "time to settle decides",
                    FeedbackLimit::SlowerClock => "range decides, at a slower clock",
                },
                w.noise_gain,
                w.excursion_v,
                w.range_v
            ),
        );
        line(
            "converter",
            format!(
                "{} bits, steps of {:.1} mV; a pressed taxel is worth {:.1} of them",
                w.adc_bits,
                1e3 * w.adc_step_v,
                w.steps_per_taxel
            ),
        );
        if let Some(limit) = &w.limit {
            line("", format!("beyond its closed form: {limit}"));
        }
        line(
            "rows",
            match &d.row_source {
                RowSource::Generator => {
                    "random: the cells' generators, seeded with a mix of their addresses".to_owned()
                }
                RowSource::Designer(name) => format!("designed: {name}, a pattern of {} bits a cell", d.m_per_wire),
            },
        );
        line(
            "measurements",
            if d.wires == 1 {
                format!("M = {}", d.m)
            } else {
                format!("M = {}: {} on each of {} wires", d.m, d.m_per_wire, d.wires)
            },
        );
        line(
            "decoder",
            format!(
                "{}: separable Gaussian prior, non-negative on {} taxels at most; {}",
                d.decoder.name,
                d.decoder.places,
                bytes(d.decoder.bytes)
            ),
        );
        let e = &d.expected;
        line("expected IoU", promise(&e.iou, 3));
        line("expected place", format!("{} taxels", promise(&e.place_px, 2)));
        line("", format!("{} mm", promise(&e.place_mm, 2)));
        line(
            "expected class",
            match (&e.class, &e.no_class) {
                (Some(class), _) => promise(class, 3),
                (None, why) => format!("not said: {}", why.as_deref().unwrap_or_default()),
            },
        );
        line(
            "",
            format!(
                "means of {} repetitions of {} touches; in brackets the band for a check of as many, {:.0} % of which lie outside",
                e.repetitions,
                e.touches,
                100.0 * e.outside
            ),
        );
        line(
            "latency",
            format!(
                "{} ms of acquisition; about {} ms of decoding beside it, at 10⁹ multiplications a second",
                ms(self.latency.acquisition_s),
                ms(self.latency.decode_estimate_s)
            ),
        );
        let c = &self.cost;
        line(
            "cost drivers",
            format!(
                "{} cells, {}, {}, {}; {} bytes a cell over {}, {} ms",
                c.cells,
                counted(c.wires, "wire"),
                counted(c.amplifiers, "amplifier"),
                counted(c.converters, "converter"),
                c.bytes_a_cell,
                if c.buses == 1 {
                    "1 bus".to_owned()
                } else {
                    format!("{} buses", c.buses)
                },
                ms(c.load_s)
            ),
        );
        line("binding", format!("{}: {}", self.binding.name(), self.binding_reason));
        if let Ok(designed) = ElectronicsStudy::as_designed() {
            line(
                "",
                format!("as designed, {}", designed.one_wire_text(self.one_wire_taxels)),
            );
        }
        out.push_str(&table(&self.alternatives));
        out
    }
}

/// Other ways to build it.
fn table(alternatives: &[Alternative]) -> String {
    let mut out = String::from(
        "\n| alternative                                        | taxels | pitch mm | wires | rows         | M a wire | acquisition ms | IoU  | place mm |\n\
         |----------------------------------------------------|-------:|---------:|------:|--------------|---------:|---------------:|-----:|---------:|\n",
    );
    let or = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |v| format!("{v:.2}"));
    for a in alternatives {
        out.push_str(&format!(
            "| {:<50} | {:>6} | {:>8.2} | {:>5} | {:<12} | {:>8} | {:>14} | {:>4} | {:>8} |\n",
            a.what,
            a.taxels,
            1e3 * a.pitch_m,
            a.wires,
            a.rows,
            a.m_per_wire,
            ms(a.acquisition_s),
            or(a.iou),
            or(a.place_mm)
        ));
    }
    out
}

impl CheckReport {
    /// The check as text.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = format!(
            "{} repetitions of {} touches with seed {}, none of which the design has seen\n",
            self.repetitions, self.touches, self.seed
        );
        for q in &self.quantities {
            out.push_str(&format!(
                "{:<20} {:.3}, promised {}: {}\n",
                q.quantity,
                q.found,
                promise(&q.promised, 3),
                if q.agrees { "agrees" } else { "DOES NOT AGREE" }
            ));
        }
        out
    }
}

/// A mean and its band.
fn promise(p: &Band, digits: usize) -> String {
    format!("{:.digits$} [{:.digits$}, {:.digits$}]", p.mean, p.low, p.high)
}

/// Millimetres, to a thousandth.
fn mm(metres: f64) -> f64 {
    (1e6 * metres).round() / 1e3
}

/// Milliseconds with three digits.
fn ms(seconds: f64) -> String {
    let ms = 1e3 * seconds;
    if ms >= 100.0 {
        format!("{ms:.0}")
    } else if ms >= 10.0 {
        format!("{ms:.1}")
    } else {
        format!("{ms:.2}")
    }
}

/// Bytes with a prefix.
fn bytes(count: usize) -> String {
    let count = count as f64;
    if count >= 1e6 {
        format!("{:.1} MB", count * 1e-6)
    } else {
        format!("{:.0} kB", count * 1e-3)
    }
}
