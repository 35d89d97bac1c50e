//! Results as text.

use super::study::ImageTiming;
use super::verify::Verification;
use spts_firmware::FIRST_ADDRESS;

/// What `spts firmware verify` prints: codes that differ, one line for each mode.
#[must_use]
pub fn verification_text(v: &Verification) -> String {
    let mut out = format!(
        "image {}: {} cells, {} edges a mode at {:.1} kHz\n",
        v.image,
        v.cells,
        v.edges,
        v.edge_hz / 1e3
    );
    for m in &v.modes {
        out.push_str(&format!(
            "{:<10} {} mismatches, {} of {} cells read back wrong\n",
            m.task.name(),
            m.mismatches,
            m.read_back_mismatches,
            v.cells
        ));
    }
    if let Some(m) = v.first_mismatch {
        out.push_str(&format!(
            "first mismatch: {}, edge {}, taxel {} (address {}): code {}, level {:.3} for {:.3}\n",
            m.task.name(),
            m.edge,
            m.taxel,
            m.taxel + usize::from(FIRST_ADDRESS),
            m.code,
            m.level,
            m.expected_level,
        ));
        if v.modes.iter().all(|mode| mode.read_back_mismatches == 0) {
            out.push_str("all cells are in step: these codes came after the sample\n");
        }
    }
    let millions = v.instructions as f64 / 1e6;
    out.push_str(&format!(
        "{millions:.0} million instructions, {:.0} million a second",
        v.instructions_per_s / 1e6
    ));
    out
}

/// What `spts firmware timing` prints: a Markdown table with latency, shortest period and largest clock rate for every
/// image and mode, then a line about the late updates of each image.
#[must_use]
pub fn timing_text(images: &[ImageTiming]) -> String {
    let mut out = String::from(
        "| image   | mode       | edge to DAC, cycles | least period, cycles | largest clock, kHz | margin at 72 kHz |\n\
         |---------|------------|--------------------:|---------------------:|-------------------:|-----------------:|\n",
    );
    for timing in images {
        for m in &timing.modes {
            let latency = if m.latency_cycles_min == m.latency_cycles {
                m.latency_cycles.to_string()
            } else {
                format!("{} – {}", m.latency_cycles_min, m.latency_cycles)
            };
            out.push_str(&format!(
                "| {:<7} | {:<10} | {:>19} | {:>20} | {:>18.1} | {:>14.0} % |\n",
                timing.image,
                m.task.name(),
                latency,
                m.least_period_cycles,
                m.max_edge_hz / 1e3,
                m.margin_at_72_khz * 100.0,
            ));
        }
    }
    for ImageTiming { image, late, .. } in images {
        let period = late.period_measurements.map_or_else(
            || "no period".to_owned(),
            |period| format!("period {period:.2} measurements"),
        );
        out.push_str(&format!(
            "\nimage {}, binary at {:.1} kHz, sampled {:.1} µs after the edge: {} of {} flips late ({:.3} %), {period}",
            image,
            late.edge_hz / 1e3,
            late.sample_delay_s * 1e6,
            late.late,
            late.flips,
            late.late_share * 100.0,
        ));
    }
    out
}
