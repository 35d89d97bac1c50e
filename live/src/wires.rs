//! The wire of the skin, once for every kind of rows that is shown.

use crate::error::LiveError;
use crate::options::NOISES;
use crate::settings::Settings;
use crate::shelf::{Made, Shelf, first_rows};
use spts::chain::RowsConfig;
use spts::{Chain, ChainConfig, Mode, Profile, Wire};
use spts_circuit::Patterns;
use spts_eval::{Press, PressRows};
use spts_models::PressureMap;
use std::path::Path;
use std::sync::Arc;

/// Measurements of every update: those that are decoded come first.
const RECORDED: usize = crate::options::MEASUREMENTS[1];

/// Measurements before those that are shown, so that the amplifier knows the one before.
const SETTLING: usize = 8;

/// A wire with one kind of rows.
pub(crate) struct Line {
    /// Name of the rows.
    pub(crate) rows: &'static str,
    wire: Wire,
    idle_v: f64,
    sample_rate_hz: f64,
    /// Time that the skin has felt so far, s.
    felt_s: f64,
    /// Measurements in that time, those that nobody looks at included.
    passed: u64,
    recorded: Option<Press>,
    volts: Vec<f64>,
}

impl Line {
    fn new(rows: &'static str, chain: &Chain) -> Result<Self, LiveError> {
        let wire = Wire::new(chain, 0)?;
        Ok(Self {
            rows,
            idle_v: wire.idle_v(Mode::Compressive),
            sample_rate_hz: chain.sample_rate_hz(),
            wire,
            felt_s: 0.0,
            passed: 0,
            recorded: None,
            volts: Vec::new(),
        })
    }

    /// Lets the skin feel the pressure for `dt_s`, and measures it.
    pub(crate) fn record(&mut self, electrode_pressure: &PressureMap, dt_s: f64) -> Result<(), LiveError> {
        self.wire.feel(electrode_pressure, dt_s)?;
        self.catch_up(dt_s);
        self.wire.measure(Mode::Compressive, &mut [0.0; SETTLING])?;
        let rows = PressRows::new(self.wire.rows(Mode::Compressive, RECORDED));
        self.volts.resize(RECORDED, 0.0);
        self.wire.measure(Mode::Compressive, &mut self.volts)?;
        self.passed += (SETTLING + RECORDED) as u64;
        self.recorded = Some(Press::on(Arc::new(rows), self.volts.clone(), self.idle_v));
        Ok(())
    }

    /// Lets the measurements pass that the wire takes in `dt_s` and nobody looks at, in whole frames.
    fn catch_up(&mut self, dt_s: f64) {
        self.felt_s += dt_s;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "casts saturate")]
        let due = (self.felt_s * self.sample_rate_hz) as u64;
        let frame = self.wire.info(Mode::Compressive).measurements_per_frame as u64;
        let frames = (due / frame).saturating_sub(self.passed / frame);
        if frames > 0 {
            self.wire.pass(Mode::Compressive, frames);
            self.passed = (self.passed / frame + frames) * frame;
        }
    }

    /// What was measured last.
    pub(crate) fn recorded(&self) -> Option<&Press> {
        self.recorded.as_ref()
    }

    /// Output of the amplifier, V.
    pub(crate) fn volts(&self) -> &[f64] {
        &self.volts
    }

    pub(crate) fn idle_v(&self) -> f64 {
        self.idle_v
    }

    pub(crate) fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }
}

/// The wires that `settings` need, in the order of the panels, each of the same specimen of the skin. Wires that are
/// `there` go on. Those whose rows are not designed yet are left out, and then the second value is false.
pub(crate) fn wires(
    settings: &Settings,
    shelf: &Arc<Shelf>,
    seed: u64,
    mut there: Vec<Line>,
) -> Result<(Vec<Line>, bool), LiveError> {
    let mut lines: Vec<Line> = Vec::new();
    let mut complete = true;
    for panel in &settings.panels {
        let name = panel.rows_name();
        if lines.iter().any(|line| line.rows == name) {
            continue;
        }
        if let Some(k) = there.iter().position(|line| line.rows == name) {
            lines.push(there.swap_remove(k));
            continue;
        }
        let patterns = match panel.rows.map(|designer| shelf.design(designer)) {
            None => None,
            Some(Made::Ready(design)) => Some(first_rows(&design, settings.measurements)?),
            Some(Made::Waiting) => {
                complete = false;
                continue;
            }
            Some(Made::Refused(_)) => continue,
        };
        lines.push(Line::new(name, &chain(settings, patterns, shelf, seed)?)?);
    }
    Ok((lines, complete))
}

fn chain(settings: &Settings, patterns: Option<Patterns>, shelf: &Shelf, seed: u64) -> Result<Chain, LiveError> {
    let fault = |(taxel, name): (&u32, &&'static str)| -> toml::Table {
        let entries = [("name", toml::Value::from(*name)), ("taxel", i64::from(*taxel).into())];
        entries
            .map(|(key, value)| (key.to_owned(), value))
            .into_iter()
            .collect()
    };
    let config = ChainConfig {
        readout: Some(settings.readout.to_owned()),
        rows: RowsConfig {
            patterns,
            ..RowsConfig::default()
        },
        faults: settings.faults.iter().map(fault).collect(),
        ..ChainConfig::default()
    };
    let chain = Chain::new(&config, shelf.layout(), seed, Path::new(""))?;
    let louder = with_noise(chain.profile().clone(), settings.noise);
    Ok(chain.with_profile(louder)?)
}

/// `profile` with `factor` times the noise.
fn with_noise(mut profile: Profile, factor: f64) -> Profile {
    for (effect, parameter) in NOISES {
        let value = profile
            .compressive
            .get_mut(effect)
            .and_then(|effect| effect.get_mut(parameter));
        match value {
            Some(toml::Value::Float(value)) => *value *= factor,
            Some(toml::Value::Array(ends)) => {
                for end in ends {
                    if let toml::Value::Float(value) = end {
                        *value *= factor;
                    }
                }
            }
            _ => {}
        }
    }
    profile
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The wire's clock goes on with the skin's: a cell that loses 1 % of its output a second has lost a tenth of it
    /// after ten seconds of updates. The ideal readout has no noise, and both wires feel the same.
    #[test]
    fn a_drifting_cell_drifts_in_the_time_of_the_skin() {
        let shelf = Arc::new(Shelf::new());
        let line = |faulty: bool| {
            let mut settings = Settings::usual().unwrap();
            settings.panels[1].rows = None;
            settings.read_out("ideal", 1.0).unwrap();
            if faulty {
                settings.fault(44, Some("drifting"), 100).unwrap();
            }
            wires(&settings, &shelf, 3, Vec::new()).unwrap().0.swap_remove(0)
        };
        let mut pressure = PressureMap::zeros(10, 10);
        pressure.values_mut()[44] = 2e4;
        let [mut sound, mut drifting] = [line(false), line(true)];
        for _ in 0..400 {
            sound.record(&pressure, 0.025).unwrap();
            drifting.record(&pressure, 0.025).unwrap();
        }
        let size = |line: &Line| line.volts().iter().map(|v| v.abs()).sum::<f64>();
        let lost = 1.0 - size(&drifting) / size(&sound);
        // 2000 idle measurements come before, .03 s; a window begins within a frame, .0016 s, of its time
        assert!((0.0995..0.1010).contains(&lost), "{lost}");
    }

    /// The scatter of an untouched wire is the noise that was asked for, converter and late updates aside.
    #[test]
    fn the_factor_is_on_the_noise() {
        let shelf = Arc::new(Shelf::new());
        let sd = |noise: f64| {
            let mut settings = Settings::usual().unwrap();
            settings.panels[1].rows = None;
            settings.noise = noise;
            let (mut lines, complete) = wires(&settings, &shelf, 3, Vec::new()).unwrap();
            assert!(complete && lines.len() == 1);
            let mut squares = 0.0;
            for _ in 0..20 {
                lines[0].record(&PressureMap::zeros(10, 10), 0.025).unwrap();
                squares += lines[0]
                    .volts()
                    .iter()
                    .map(|v| (v - lines[0].idle_v()).powi(2))
                    .sum::<f64>();
            }
            (squares / 2000.0).sqrt()
        };
        let (none, one, ten) = (sd(0.0), sd(1.0), sd(10.0));
        assert!(none < one && one < ten, "{none} {one} {ten}");
        // ten times as loud; a step of the converter, 63 mV, is a third of the loudest and all of the quiet ones
        assert!((3.0..11.0).contains(&(ten / one)), "{ten} / {one}");
    }
}
