//! Files and figures of `spts circuit`.

mod picture;

use super::{ReportError, write_all_or_none};
use crate::figures::save_charts;
use serde::Serialize;
use spts::output::{OutputFolder, write_csv, write_json};
use spts_circuit::amplifier::Remedied;
use spts_studies::electronics::{ElectronicsReport, ElectronicsStudy};

/// Files outside of folders of their own.
pub const FILES: &[&str] = &["circuit.csv", "parameters.json"];

/// Writes `circuit.csv`, `parameters.json` and `figures/circuit` into the folder `out`: all of them, or none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write(study: &ElectronicsStudy, report: &ElectronicsReport, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        write_csv(&out.path("circuit.csv"), &COLUMNS, report.rows.iter().map(line))?;
        write_json(&out.path("parameters.json"), study)?;
        save_charts(&picture::charts(report), &out.folder("figures")?, "circuit")?;
        Ok(())
    })
}

/// Columns of `circuit.csv`.
const COLUMNS: [&str; 27] = [
    "taxels",
    "remedy",
    "wires",
    "amplifiers",
    "levels",
    "feedback_ohm",
    "gain",
    "noise_gain",
    "bandwidth_hz",
    "quality",
    "settle_s",
    "slew_s",
    "noise_taxels_v",
    "noise_feedback_v",
    "noise_voltage_v",
    "noise_current_v",
    "noise_v_rms",
    "adc_step_v",
    "adc_noise_v",
    "signal_v",
    "snr_db",
    "snr_adc_db",
    "sum_rms_v",
    "sum_worst_v",
    "range_v",
    "saturates",
    "limit",
];

/// A line of `circuit.csv`.
fn line(r: &Remedied) -> impl Serialize + use<> {
    let b = &r.budget;
    (
        (r.taxels, r.remedy, r.wires, r.amplifiers, r.levels),
        [r.feedback_ohm, r.gain, b.noise_gain, b.bandwidth_hz, b.quality],
        [b.settle_s, b.slew_s],
        [
            b.noise_v.taxels,
            b.noise_v.feedback,
            b.noise_v.voltage,
            b.noise_v.current,
        ],
        [
            b.noise_v_rms,
            b.adc_step_v,
            b.adc_noise_v,
            b.signal_v,
            b.snr_db,
            b.snr_adc_db,
        ],
        [b.sum_rms_v, b.sum_worst_v, b.range_v],
        (b.saturates, b.limit.map_or("none", |l| l.name())),
    )
}
