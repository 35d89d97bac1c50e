//! Skins of all sizes as a text table.

use spts_circuit::amplifier::Remedied;

/// Sizes of the printed table.
pub const TABLE_TAXELS: [u32; 5] = [100, 1000, 10_000, 100_000, 1_000_000];

/// The rows as a Markdown table, which is also readable as plain text.
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

    #[test]
    fn numbers_have_three_digits_and_a_prefix() {
        assert_eq!(scaled(2.197e6, "Hz"), "2.20 MHz");
        assert_eq!(scaled(27.6e3, "Hz"), "27.6 kHz");
        assert_eq!(scaled(438e-6, "s"), "438 µs");
    }
}
