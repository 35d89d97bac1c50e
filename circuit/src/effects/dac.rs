//! The cells' converters from code to drive voltage.

use crate::batch::{Batch, Scratch};
use crate::effect::{Effect, EffectSession, Span, parsed};
use crate::weights::{ANALOG_SCALE, FULL_SCALE, NEUTRAL, WeightMode, code_of, finalise};
use rand::RngExt as _;
use serde::Deserialize;
use spts_input::Refusal;
use spts_models::within;

/// What each cell's eight-bit converter makes of its code c, in steps of `reference_v`/256 at its output:
///
/// max(floor, c + offset + gain·c/255 + INL·4u(1 − u) + DNL·n(c)), u = c/255.
///
/// A converter is a part of its cell: it is the same in every session and mode of a device.
///
/// The integral nonlinearity is the parabola of a resistor string with a linear gradient; n(c), fixed for a cell, lies
/// within ± 1/2 and is 0 at both ends, so that no step errs by more than DNL + 4·INL/255. A level changes by the error
/// over 127.5 steps; codes 0 and 255 are levels −1 and 1, and 126 is the neutral one. Noise and late updates keep the
/// nominal levels: an error of an error.
///
/// Microchip, *tinyAVR 1-series data sheet*, DAC characteristics: INL 0.3 LSB (at most 1.2), DNL 0.25 (1), offset −10
/// mV (−40 to 0) at 4.3 V, gain −1 LSB (±10) with the reference, output from 0.2 V.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Output at code 256, V. Range [0.5, 5.5]; the device has 4.34.
    reference_v: f64,
    /// Lowest output, V. Range [0, 0.5·`reference_v`]; the device has 0.2.
    floor_v: f64,
    /// Error at code 0, V, drawn once for each cell. Range [−0.5, 0.5].
    offset_v: Span,
    /// Error of the slope at code 255, steps, drawn once for each cell. Range [−64, 64].
    gain_lsb: Span,
    /// INL at mid-scale, steps, drawn once for each cell. Range [−8, 8].
    inl_lsb: Span,
    /// DNL: largest error of a step, steps. Range [0, 1].
    dnl_lsb: f64,
}

/// Converter of one cell; all but the key in steps.
struct Converter {
    offset: f64,
    gain: f64,
    inl: f64,
    /// Key of the pseudorandom n(c).
    key: u32,
}

struct Dac {
    floor: f64,
    dnl: f64,
    converters: Vec<Converter>,
    /// Error of a level w, one of the two levels of the binary or raster mode: mean + half·w.
    means: Vec<f64>,
    halves: Vec<f64>,
    scratch: Scratch,
}

pub(super) fn build(table: toml::Table, session: &EffectSession) -> Result<Box<dyn Effect>, Refusal> {
    let c: Config = parsed(table)?;
    within("reference_v", c.reference_v, 0.5, 5.5, "[0.5, 5.5]")?;
    within("floor_v", c.floor_v, 0.0, 0.5 * c.reference_v, "[0, 0.5·reference_v]")?;
    within("dnl_lsb", c.dnl_lsb, 0.0, 1.0, "[0, 1]")?;
    let offset_v = c.offset_v.within("offset_v", -0.5, 0.5, "[−0.5, 0.5]")?;
    let gain_lsb = c.gain_lsb.within("gain_lsb", -64.0, 64.0, "[−64, 64]")?;
    let inl_lsb = c.inl_lsb.within("inl_lsb", -8.0, 8.0, "[−8, 8]")?;
    let lsb_v = c.reference_v / 256.0;
    let mut rng = session.device.rng("dac", 0);
    let converters = (0..session.weights.taxels()).map(|_| Converter {
        offset: offset_v.draw(&mut rng) / lsb_v,
        gain: gain_lsb.draw(&mut rng),
        inl: inl_lsb.draw(&mut rng),
        key: rng.random(),
    });
    let mut dac = Dac {
        floor: c.floor_v / lsb_v,
        dnl: c.dnl_lsb,
        converters: converters.collect(),
        means: Vec::new(),
        halves: Vec::new(),
        scratch: Scratch::default(),
    };
    dac.set_two_levels(session.weights.mode());
    Ok(Box::new(dac))
}

impl Dac {
    /// Error of the level of `code` from cell `k`.
    #[inline]
    fn error(&self, k: usize, code: u8) -> f64 {
        let cell = &self.converters[k];
        let steps = f64::from(code);
        let u = steps / f64::from(FULL_SCALE);
        let noise = match code {
            0 | FULL_SCALE => 0.0,
            _ => f64::from(finalise(cell.key.wrapping_add(u32::from(code)))) / 4_294_967_296.0 - 0.5,
        };
        let output = steps + cell.offset + cell.gain * u + cell.inl * 4.0 * u * (1.0 - u) + self.dnl * noise;
        (output.max(self.floor) - steps) / ANALOG_SCALE
    }

    fn set_two_levels(&mut self, mode: WeightMode) {
        for k in 0..self.converters.len() {
            let high = self.error(k, FULL_SCALE);
            let (mean, half) = match mode {
                WeightMode::Analog => (0.0, 0.0),
                WeightMode::Binary => {
                    let low = self.error(k, 0);
                    (0.5 * (high + low), 0.5 * (high - low))
                }
                WeightMode::Raster => {
                    let neutral = self.error(k, NEUTRAL);
                    (neutral, high - neutral)
                }
            };
            self.means.push(mean);
            self.halves.push(half);
        }
    }

    /// Every level on its own.
    fn add_each(&self, batch: &mut Batch<'_>) {
        for k in batch.skin.places() {
            let cell = batch.cells.get(k);
            for (i, output_v) in batch.output_v.iter_mut().enumerate() {
                let (level, gain) =
                    cell.map_or_else(|| (batch.rows.level(k, i), 1.0), |cell| (cell.level(i), cell.gain(i)));
                let x = batch.skin.at(k, i) * batch.volts_per_siemens;
                *output_v += self.error(k, code_of(level)) * gain * x;
            }
        }
    }

    /// The levels that the mode does not have, of cells whose codes come from outside.
    fn add_odd(&self, batch: &mut Batch<'_>) {
        for i in batch.rows.odd() {
            for k in batch.skin.places() {
                let level = batch.rows.level(k, i);
                let replaced = batch.cells.get(k).is_some_and(|cell| cell.differs(i, level));
                if !replaced {
                    let taken = self.means[k] + self.halves[k] * level;
                    let error = self.error(k, code_of(level)) - taken;
                    batch.output_v[i] += error * batch.taxel_v(k, i);
                }
            }
        }
    }

    /// The cells that do not put out their own two levels.
    fn add_faulty(&self, batch: &mut Batch<'_>) {
        for cell in batch.cells.iter() {
            let k = cell.taxel;
            for (i, output_v) in batch.output_v.iter_mut().enumerate() {
                let level = batch.rows.level(k, i);
                // two roundings of one error would tell that the cell is in the batch
                if !cell.differs(i, level) {
                    continue;
                }
                let sound = self.means[k] + self.halves[k] * level;
                let faulty = self.error(k, code_of(cell.level(i))) * cell.gain(i);
                let x = batch.skin.at(k, i) * batch.volts_per_siemens;
                *output_v += (faulty - sound) * x;
            }
        }
    }
}

impl Effect for Dac {
    fn apply(&mut self, batch: &mut Batch<'_>) {
        if batch.mode() == WeightMode::Analog {
            self.add_each(batch);
        } else {
            batch.add_errors(&self.means, &self.halves, &mut self.scratch);
            self.add_odd(batch);
            self.add_faulty(batch);
        }
    }
}
