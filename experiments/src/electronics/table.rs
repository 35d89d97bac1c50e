//! Sizes and remedies as a table.

use crate::cli::CliError;
use serde::Serialize;
use spts_circuit::Adc;
use spts_circuit::amplifier::{Amplifier, Network, OpAmp, Remedied, Remedy, Setting, Skin, fewest_wires, remedied};

/// Sizes of the printed table.
pub const TABLE_TAXELS: [u32; 5] = [100, 1000, 10_000, 100_000, 1_000_000];
/// Sizes of the file and of the picture.
const SWEEP_TAXELS: [u32; 13] = [
    100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000, 100_000, 200_000, 500_000, 1_000_000,
];

/// Largest capacitance of a bus, F, as [`Network`] says.
const LARGEST_BUS_F: f64 = 1.0;

/// What is asked.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Study {
    /// Operational amplifier of every stage.
    pub op_amp: OpAmp,
    /// What is around the first one.
    pub network: Network,
    /// Capacitance that every taxel adds to its bus, F. Range [0, 1e-6], and 1 F for all on one bus.
    pub taxel_f: f64,
    /// Skin.
    pub skin: Skin,
    /// Measurements a second, Hz.
    pub rate_hz: f64,
    /// Part of every period in which the output cannot settle, s: before the drives change, and after it is sampled.
    pub busy_s: f64,
    /// Taxels, or amplifiers of the level below, on one amplifier of a tree.
    pub sub_array: u32,
    /// Converter.
    #[serde(skip)]
    pub adc: Adc,
}

impl Study {
    /// Time in which the output has to settle, s.
    ///
    /// # Errors
    /// [`CliError::Usage`] when the rate leaves none, or is no rate.
    pub fn available_s(&self) -> Result<f64, CliError> {
        let available_s = 1.0 / self.rate_hz - self.busy_s;
        if self.rate_hz >= 1.0 && available_s > 0.0 {
            return Ok(available_s);
        }
        Err(CliError::Usage(format!(
            "`rate-hz` = {} is outside [1, {:.0}): {:.3} µs of every period are spent before the drives change and after the sampling",
            self.rate_hz,
            1.0 / self.busy_s,
            self.busy_s * 1e6,
        )))
    }

    /// A skin of `taxels` taxels, read in every way.
    ///
    /// # Errors
    /// [`CliError::Usage`] that names the number outside its range.
    pub fn of(&self, taxels: u32) -> Result<Vec<Remedied>, CliError> {
        let setting = Setting {
            skin: self.skin,
            adc: self.adc,
            available_s: self.available_s()?,
        };
        let bus_f = self.bus_f(taxels);
        if !(0.0..=LARGEST_BUS_F).contains(&bus_f) {
            return Err(CliError::Usage(format!(
                "`--bus-pf` + {taxels} · `--taxel-pf` = {:.3e} pF is outside [0, {:e}] pF",
                bus_f * 1e12,
                LARGEST_BUS_F * 1e12
            )));
        }
        let ways = Remedy::ALL.into_iter().map(|remedy| {
            // a bus has the capacitance of its own taxels: fewer on a sub-array and on each of several wires
            let on_bus = match remedy {
                Remedy::AsBuilt | Remedy::FeedbackScaled => taxels,
                Remedy::SubArrays => taxels.min(self.sub_array),
                Remedy::Wires => {
                    return fewest_wires(taxels, &setting, &|wires| self.amplifier(taxels.div_ceil(wires)));
                }
            };
            remedied(&self.amplifier(on_bus)?, taxels, self.sub_array, remedy, &setting)
        });
        let ways = ways.collect::<Result<_, spts_models::ConfigError>>();
        ways.map_err(|error| CliError::Usage(error.to_string()))
    }

    /// Capacitance of a bus with `taxels` taxels, F.
    fn bus_f(&self, taxels: u32) -> f64 {
        self.network.bus_f + f64::from(taxels) * self.taxel_f
    }

    /// Amplifier of a bus with `taxels` taxels.
    fn amplifier(&self, taxels: u32) -> Result<Amplifier, spts_models::ConfigError> {
        let network = Network {
            bus_f: self.bus_f(taxels),
            ..self.network
        };
        Amplifier::new(self.op_amp, network)
    }

    /// All sizes from 100 to a million, in every way.
    ///
    /// # Errors
    /// As [`Study::of`].
    pub fn sweep(&self) -> Result<Vec<Remedied>, CliError> {
        let sizes = SWEEP_TAXELS.into_iter().map(|taxels| self.of(taxels));
        Ok(sizes.collect::<Result<Vec<_>, _>>()?.concat())
    }
}

/// A line of `circuit.csv`.
#[derive(Debug, Serialize)]
pub(super) struct Line {
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
pub(super) fn lines(rows: &[Remedied]) -> Vec<Line> {
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

/// The rows as a Markdown table, which is readable as plain text too.
#[must_use]
pub fn text(rows: &[Remedied], available_s: f64) -> String {
    let mut out = format!(
        "to settle in: {:.2} µs; SNR: one pressed taxel over the amplifier's noise, and with the converter's step\n\n\
         | taxels  | readout            |  wires | amps    | noise gain | bandwidth |   settle | noise, mV | signal, mV | SNR, dB | with ADC | 4σ sum, V | limit             |\n\
         |--------:|--------------------|-------:|--------:|-----------:|----------:|---------:|----------:|-----------:|--------:|---------:|----------:|-------------------|\n",
        available_s * 1e6
    );
    for r in rows {
        let b = &r.budget;
        out.push_str(&format!(
            "| {:>7} | {:<18} | {:>6} | {:>7} | {:>10.4} | {:>9} | {:>8} | {:>9.4} | {:>10.4} | {:>7.1} | {:>8.1} | {:>9.3} | {:<17} |\n",
            r.taxels,
            r.remedy.name(),
            r.wires,
            r.amplifiers,
            b.noise_gain,
            scaled(b.bandwidth_hz, "Hz"),
            scaled(b.settle_s + b.slew_s, "s"),
            b.noise_v_rms * 1e3,
            b.signal_v * 1e3,
            b.snr_db,
            b.snr_adc_db,
            b.excursion_v,
            b.limit.map_or("–", |l| l.name()),
        ));
    }
    out
}

/// A number with a prefix of the SI, to three digits.
fn scaled(value: f64, unit: &str) -> String {
    let prefixes = [
        (1e9, "G"),
        (1e6, "M"),
        (1e3, "k"),
        (1.0, ""),
        (1e-3, "m"),
        (1e-6, "µ"),
        (1e-9, "n"),
    ];
    let (scale, prefix) = prefixes
        .into_iter()
        .find(|(scale, _)| value >= *scale)
        .unwrap_or((1e-9, "n"));
    let lead = value / scale;
    let decimals = if lead < 10.0 { 2 } else { usize::from(lead < 100.0) };
    format!("{lead:.decimals$} {prefix}{unit}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::Profile;
    use spts_circuit::amplifier::Budget;

    /// Every number of wires one by one, against what the search finds. 2 and 20 nF of the bus itself ring for longer with fewer
    /// taxels, 1 nF a taxel is slower with more of them.
    #[test]
    fn no_smaller_number_of_wires_works() {
        let profile = Profile::named("as_designed").unwrap();
        let adc: Adc = profile.compressive["adc"].clone().try_into().unwrap();
        for (taxel_pf, bus_nf, taxels) in [
            (0.0, 0.0, 3000_u32),
            (20.0, 0.0, 3000),
            (20.0, 2.0, 1000),
            (1000.0, 0.0, 500),
            (3.0, 20.0, 400),
        ] {
            let study = Study {
                op_amp: OpAmp::default(),
                network: Network {
                    bus_f: bus_nf * 1e-9,
                    ..Network::default()
                },
                taxel_f: taxel_pf * 1e-12,
                skin: Skin::default(),
                rate_hz: 67e3,
                busy_s: 5e-6,
                sub_array: 100,
                adc,
            };
            let setting = Setting {
                skin: study.skin,
                adc: study.adc,
                available_s: study.available_s().unwrap(),
            };
            let works = |wires: u32| {
                let amplifier = study.amplifier(taxels.div_ceil(wires)).unwrap();
                let budget = Budget::new(&amplifier, f64::from(taxels) / f64::from(wires), &setting);
                budget.limit.is_none()
            };
            let expected = (1..taxels).find(|&wires| works(wires)).unwrap_or(taxels);
            let ways = study.of(taxels).unwrap();
            let found = ways.iter().find(|way| way.remedy == Remedy::Wires).unwrap();
            assert_eq!(found.wires, expected, "{taxel_pf} pF, {bus_nf} nF, {taxels} taxels");
        }
    }

    #[test]
    fn numbers_have_three_digits_and_a_prefix() {
        assert_eq!(scaled(2.197e6, "Hz"), "2.20 MHz");
        assert_eq!(scaled(27.6e3, "Hz"), "27.6 kHz");
        assert_eq!(scaled(438e-6, "s"), "438 µs");
    }
}
