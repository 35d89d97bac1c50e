//! Files and figures of `spts circuit`.

mod picture;

use super::{ReportError, write_all_or_none};
use crate::figures::save_charts;
use serde::Serialize;
use spts::output::{write_json, write_table};
use spts_circuit::amplifier::{Remedied, Remedy};
use spts_studies::electronics::{ElectronicsReport, ElectronicsStudy};
use std::path::Path;

/// Writes `circuit.csv`, `parameters.json` and `figures/circuit` into the folder `out`: all of them, or none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write(study: &ElectronicsStudy, report: &ElectronicsReport, out: &Path) -> Result<(), ReportError> {
    write_all_or_none(out, |staged| {
        write_table(&staged.path("circuit.csv"), &lines(&report.rows))?;
        write_json(&staged.path("parameters.json"), study)?;
        save_charts(&picture::charts(report), &staged.folder("figures")?, "circuit")?;
        Ok(())
    })
}

/// A line of `circuit.csv`.
#[derive(Debug, Serialize)]
struct Line {
    taxels: u32,
    remedy: Remedy,
    wires: u32,
    amplifiers: u32,
    levels: u32,
    feedback_ohm: f64,
    gain: f64,
    noise_gain: f64,
    bandwidth_hz: f64,
    quality: f64,
    settle_s: f64,
    slew_s: f64,
    noise_taxels_v: f64,
    noise_feedback_v: f64,
    noise_voltage_v: f64,
    noise_current_v: f64,
    noise_v_rms: f64,
    adc_step_v: f64,
    adc_noise_v: f64,
    signal_v: f64,
    snr_db: f64,
    snr_adc_db: f64,
    sum_rms_v: f64,
    sum_worst_v: f64,
    range_v: f64,
    saturates: bool,
    limit: &'static str,
}

/// The rows with one column a number, as a table needs them.
fn lines(rows: &[Remedied]) -> Vec<Line> {
    rows.iter()
        .map(|r| {
            let b = &r.budget;
            Line {
                taxels: r.taxels,
                remedy: r.remedy,
                wires: r.wires,
                amplifiers: r.amplifiers,
                levels: r.levels,
                feedback_ohm: r.feedback_ohm,
                gain: r.gain,
                noise_gain: b.noise_gain,
                bandwidth_hz: b.bandwidth_hz,
                quality: b.quality,
                settle_s: b.settle_s,
                slew_s: b.slew_s,
                noise_taxels_v: b.noise_v.taxels,
                noise_feedback_v: b.noise_v.feedback,
                noise_voltage_v: b.noise_v.voltage,
                noise_current_v: b.noise_v.current,
                noise_v_rms: b.noise_v_rms,
                adc_step_v: b.adc_step_v,
                adc_noise_v: b.adc_noise_v,
                signal_v: b.signal_v,
                snr_db: b.snr_db,
                snr_adc_db: b.snr_adc_db,
                sum_rms_v: b.sum_rms_v,
                sum_worst_v: b.sum_worst_v,
                range_v: b.range_v,
                saturates: b.saturates,
                limit: b.limit.map_or("none", |l| l.name()),
            }
        })
        .collect()
}
