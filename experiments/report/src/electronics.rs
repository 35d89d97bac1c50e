//! Files and figures of `spts circuit`.

use crate::figures::{Chart, Curve, Plot, Series, Style, save_charts};
use crate::write_all_or_none;
use spts::output::{OutputFolder, write_json};
use spts_circuit::amplifier::{Budget, Remedied, Remedy};
use spts_eval::{Cell, Table};
use spts_input::Refusal;
use spts_studies::electronics::{ElectronicsReport, ElectronicsStudy};

/// Writes `circuit.csv`, `parameters.json` and `figures/circuit` into the folder `out`: all of them, or none.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub fn write(study: &ElectronicsStudy, report: &ElectronicsReport, out: OutputFolder) -> Result<(), Refusal> {
    write_all_or_none(out, |out| {
        table(&report.rows).write(out)?;
        write_json(&out.path("parameters.json"), study)?;
        save_charts(&charts(report), &out.folder("figures")?, "circuit")?;
        Ok(())
    })
}

/// Sizes of the printed table.
pub const TABLE_TAXELS: [u32; 5] = [100, 1000, 10_000, 100_000, 1_000_000];

/// Skins of all sizes as a text table.
pub fn text(rows: &[Remedied], available_s: f64) -> String {
    format!(
        "to settle in: {:.2} µs; SNR: one pressed taxel over the amplifier's noise, and with the converter's step\n\n{}",
        available_s * 1e6,
        table(rows).text()
    )
}

fn table(rows: &[Remedied]) -> Table<'_, &Remedied> {
    Table::new("circuit", rows)
        .column("taxels", "taxels", |r| r.taxels)
        .file("remedy", |r| Cell::name_of(r.remedy))
        .shown("readout", |r| r.remedy.name())
        .column("wires", "wires", |r| r.wires)
        .column("amplifiers", "amps", |r| r.amplifiers)
        .file("levels", |r| r.levels)
        .file("feedback_ohm", |r| r.feedback_ohm)
        .file("gain", |r| r.gain)
        .column("noise_gain", "noise gain", |r| r.budget.noise_gain)
        .digits(4)
        .file("bandwidth_hz", |r| r.budget.bandwidth_hz)
        .shown("bandwidth", |r| scaled(r.budget.bandwidth_hz, "Hz"))
        .file("quality", |r| r.budget.quality)
        .file("settle_s", |r| r.budget.settle_s)
        .file("slew_s", |r| r.budget.slew_s)
        .shown("settle", |r| scaled(r.budget.settle_s + r.budget.slew_s, "s"))
        .file("noise_taxels_v", |r| r.budget.noise_v.taxels)
        .file("noise_feedback_v", |r| r.budget.noise_v.feedback)
        .file("noise_voltage_v", |r| r.budget.noise_v.voltage)
        .file("noise_current_v", |r| r.budget.noise_v.current)
        .column("noise_v_rms", "noise", |r| r.budget.noise_v_rms)
        .unit("mV", 1e3)
        .digits(4)
        .file("adc_step_v", |r| r.budget.adc_step_v)
        .file("adc_noise_v", |r| r.budget.adc_noise_v)
        .column("signal_v", "signal", |r| r.budget.signal_v)
        .unit("mV", 1e3)
        .digits(4)
        .column("snr_db", "SNR, dB", |r| r.budget.snr_db)
        .digits(1)
        .column("snr_adc_db", "with ADC", |r| r.budget.snr_adc_db)
        .digits(1)
        .file("sum_rms_v", |r| r.budget.sum_rms_v)
        .file("sum_worst_v", |r| r.budget.sum_worst_v)
        .file("range_v", |r| r.budget.range_v)
        .shown("4σ sum, V", |r| r.budget.excursion_v)
        .digits(3)
        .file("saturates", |r| r.budget.saturates)
        .file("limit", |r| r.budget.limit.map_or("none", |l| l.name()))
        .shown("limit", |r| r.budget.limit.map(|l| l.name()))
}

/// A number with a prefix of the SI, to three digits.
fn scaled(value: f64, unit: &str) -> String {
    let prefixes = [(1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n")];
    let found = prefixes.into_iter().find(|(scale, _)| value >= *scale);
    let (scale, prefix) = found.unwrap_or((1e-9, "n"));
    let lead = value / scale;
    let decimals = if lead < 10.0 { 2 } else { usize::from(lead < 100.0) };
    format!("{lead:.decimals$} {prefix}{unit}")
}

/// Ink of every remedy, in the order of [`Remedy::ALL`].
const STYLES: [(Style, u8); 4] = [(Style::Real, 0), (Style::Raster, 0), (Style::Twin, 0), (Style::Twin, 1)];
/// Ink of what must not be passed.
const BOUND: Style = Style::Baseline;

/// Settling, sum, ratio to the noise, and the sources of the noise, over the number of taxels.
fn charts(report: &ElectronicsReport) -> Vec<Chart> {
    let rows = report.rows.as_slice();
    let of = |get: fn(&Budget) -> f64| rows.first().map_or(f64::NAN, |r| get(&r.budget));
    let over_taxels = || Plot::new(rows).x("taxels", |r| f64::from(r.taxels)).log_x();
    let by_remedy = || {
        over_taxels().by(|r| {
            let place = Remedy::ALL.iter().position(|remedy| *remedy == r.remedy).unwrap_or(0);
            Curve::new(r.remedy.name(), STYLES[place].0, STYLES[place].1)
        })
    };
    let with = |mut chart: Chart, name: &str, level: f64| {
        let ends = [rows.first(), rows.last()].into_iter().flatten();
        let points = ends.map(|r| (f64::from(r.taxels), level)).collect();
        chart.series.push(Series::new(name, BOUND, 0, points));
        chart
    };
    let settling = by_remedy().log_y().y("settling and slewing, µs", |r| (r.budget.settle_s + r.budget.slew_s) * 1e6);
    let sum = by_remedy().log_y().y("4σ of the sum, V", |r| r.budget.excursion_v);
    let ratio = by_remedy().y("SNR with the converter's step, dB", |r| r.budget.snr_adc_db);
    type Source = (Curve, fn(&Budget) -> f64);
    let sources: [Source; 5] = [
        (Curve::new("amplifier's voltage", Style::Real, 0), |b| b.noise_v.voltage),
        (Curve::new("taxels", Style::Twin, 0), |b| b.noise_v.taxels),
        (Curve::new("feedback", Style::Raster, 0), |b| b.noise_v.feedback),
        (Curve::new("amplifier's current", Style::Twin, 1), |b| b.noise_v.current),
        (Curve::new("converter's step", BOUND, 0), |b| b.adc_noise_v),
    ];
    let as_built: Vec<&Remedied> = rows.iter().filter(|r| r.remedy == Remedy::AsBuilt).collect();
    let noise = sources.iter().flat_map(|source| as_built.iter().map(move |r| (source, *r)));
    let noise = Plot::new(noise)
        .x("taxels", |(_, r)| f64::from(r.taxels))
        .log_x()
        .y("noise at the output, mV rms", |((_, get), r)| get(&r.budget) * 1e3)
        .log_y()
        .by(|((curve, _), _)| curve.clone());
    vec![
        with(settling.chart("Settling to half a step of the converter"), "time there is", report.available_s * 1e6),
        with(sum.chart("Sum of all taxels at the converter"), "range of amplifier and converter", of(|b| b.range_v)),
        with(
            ratio.chart("One pressed taxel over all noise"),
            "one step of the converter",
            // the signal is one step, over step/√12
            of(|b| 20.0 * (b.adc_step_v / b.adc_noise_v).log10()),
        ),
        noise.chart("Noise by source, one wire, as built"),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits_and_a_prefix() {
        assert_eq!(scaled(2.197e6, "Hz"), "2.20 MHz");
        assert_eq!(scaled(27.6e3, "Hz"), "27.6 kHz");
        assert_eq!(scaled(438e-6, "s"), "438 µs");
    }
}
