//! Files and figures of `spts circuit`.

use crate::figures::{Chart, Series, Style, save_charts};
use crate::{ReportError, write_all_or_none};
use serde::Serialize;
use spts::output::{OutputFolder, write_csv, write_json};
use spts_circuit::amplifier::{Budget, Remedied, Remedy};
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
        save_charts(&charts(report), &out.folder("figures")?, "circuit")?;
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

/// Ink of every remedy, in the order of [`Remedy::ALL`].
const STYLES: [(Style, u8); 4] = [(Style::Real, 0), (Style::Raster, 0), (Style::Twin, 0), (Style::Twin, 1)];
/// Ink of what must not be passed.
const BOUND: Style = Style::Baseline;

/// Settling, sum, ratio to the noise, and parts needed, over the number of taxels.
fn charts(report: &ElectronicsReport) -> Vec<Chart> {
    let rows = report.rows.as_slice();
    let range_v = rows.first().map_or(f64::NAN, |r| r.budget.range_v);
    let panel = |title: &str, y_label: &str, y_log: bool, get: &dyn Fn(&Remedied) -> f64| Chart {
        title: title.to_owned(),
        x_label: "taxels".to_owned(),
        y_label: y_label.to_owned(),
        x_log: true,
        y_log,
        series: Remedy::ALL
            .into_iter()
            .zip(STYLES)
            .map(|(remedy, (style, variant))| {
                let of = rows.iter().filter(|r| r.remedy == remedy);
                let points = of.map(|r| (f64::from(r.taxels), get(r))).collect();
                Series::new(remedy.name(), style, variant, points)
            })
            .collect(),
        ..Chart::default()
    };
    let with = |mut chart: Chart, name: &str, level: f64| {
        let ends = [rows.first(), rows.last()].into_iter().flatten();
        let points = ends.map(|r| (f64::from(r.taxels), level)).collect();
        chart.series.push(Series::new(name, BOUND, 0, points));
        chart
    };
    vec![
        with(
            panel(
                "Settling to half a step of the converter",
                "settling and slewing, µs",
                true,
                &|r| (r.budget.settle_s + r.budget.slew_s) * 1e6,
            ),
            "time there is",
            report.available_s * 1e6,
        ),
        with(
            panel("Sum of all taxels at the converter", "4σ of the sum, V", true, &|r| {
                r.budget.excursion_v
            }),
            "range of amplifier and converter",
            range_v,
        ),
        with(
            panel(
                "One pressed taxel over all noise",
                "SNR with the converter's step, dB",
                false,
                &|r| r.budget.snr_adc_db,
            ),
            "one step of the converter",
            step_db(rows),
        ),
        sources(rows),
    ]
}

/// Ratio at which a taxel's signal is one step of the converter, dB: step over step/√12.
fn step_db(rows: &[Remedied]) -> f64 {
    rows.first().map_or(f64::NAN, |r| {
        let Budget {
            adc_step_v,
            adc_noise_v,
            ..
        } = r.budget;
        20.0 * (adc_step_v / adc_noise_v).log10()
    })
}

/// Noise by source with one wire as built.
fn sources(rows: &[Remedied]) -> Chart {
    let of = |name: &str, style: Style, variant: u8, get: fn(&Budget) -> f64| {
        let as_built = rows.iter().filter(|r| r.remedy == Remedy::AsBuilt);
        let points = as_built.map(|r| (f64::from(r.taxels), get(&r.budget) * 1e3)).collect();
        Series::new(name, style, variant, points)
    };
    Chart {
        title: "Noise by source, one wire, as built".to_owned(),
        x_label: "taxels".to_owned(),
        y_label: "noise at the output, mV rms".to_owned(),
        x_log: true,
        y_log: true,
        series: vec![
            of("amplifier's voltage", Style::Real, 0, |b| b.noise_v.voltage),
            of("taxels", Style::Twin, 0, |b| b.noise_v.taxels),
            of("feedback", Style::Raster, 0, |b| b.noise_v.feedback),
            of("amplifier's current", Style::Twin, 1, |b| b.noise_v.current),
            of("converter's step", BOUND, 0, |b| b.adc_noise_v),
        ],
        ..Chart::default()
    }
}
