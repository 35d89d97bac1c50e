//! A readout on codes that come from outside.

use crate::effects::assert_close;
use crate::readout::{press_v, profile, skin, start, strip};
use spts_circuit::{
    Block, CellCodes, CompressiveWeights, Interpolated, Jump, Mode, PROFILES, Profile, Readout, Seeding, WeightMode,
    Weights,
};
use spts_input::Refusal;
use spts_models::{ConductanceMap, Streams};

/// Cells whose code is a function of row and taxel.
struct Cells<F> {
    taxels: usize,
    code: F,
}

impl<F: Fn(u64, u32) -> u8 + Send> CellCodes for Cells<F> {
    fn taxels(&self) -> usize {
        self.taxels
    }

    fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), Refusal> {
        for (row, out) in (first_row..).zip(out.chunks_exact_mut(self.taxels)) {
            for (taxel, code) in (0..).zip(out) {
                *code = (self.code)(row, taxel);
            }
        }
        Ok(())
    }
}

fn generator(seed: u32, row: u64) -> u32 {
    Jump::new(row + 1).apply(seed)
}

/// What the cell of `taxel` puts out, by the words of its firmware.
fn sound(mode: WeightMode, seed: u32, taxels: u32, row: u64, taxel: u32) -> u8 {
    let [.., top] = generator(seed, row).to_le_bytes();
    match mode {
        WeightMode::Raster if row % u64::from(taxels) == u64::from(taxel) => 255,
        WeightMode::Raster => 126,
        WeightMode::Analog => top,
        WeightMode::Binary if top < 128 => 0,
        WeightMode::Binary => 255,
    }
}

fn sound_cells(profile: &Profile, mode: Mode, taxels: u32) -> Box<dyn CellCodes> {
    let weights = profile.weights(mode, taxels).unwrap();
    let mode = weights.mode();
    let code = move |row, taxel| sound(mode, weights.seed(taxel as usize).unwrap(), taxels, row, taxel);
    Box::new(Cells { taxels: taxels as usize, code })
}

/// Any code anywhere.
fn any_code(row: u64, taxel: u32) -> u8 {
    let [_, code, ..] = generator(Seeding::Mixed.seed(taxel), 7 * row).to_le_bytes();
    code
}

/// Presses that ramp up and down, some taxels not touched.
fn presses(taxels: usize) -> [Interpolated; 2] {
    let map = |k: usize| {
        let values = (0..taxels).map(|t| 1e-6 * ((t * 7 + k * 13) % 50) as f64 * ((t + k) % 3) as f64);
        ConductanceMap::from_values(1, taxels, values.collect())
    };
    [0, 5].map(|start| {
        let times_s = vec![0.001, 0.0012, 0.004, 0.0213];
        Interpolated::new(times_s, (start..start + 4).map(map).collect()).unwrap()
    })
}

fn record(readout: &mut Readout, taxels: usize) -> Vec<Vec<u64>> {
    readout.skip(3);
    let blocks = readout.record(&mut presses(taxels), 20 * taxels, 57).unwrap();
    let bits = |block: &Block| block.volts.iter().map(|v| v.to_bits()).collect();
    blocks.blocks().iter().map(bits).collect()
}

/// All that a profile may hold: both kinds of weights, both ways of seeding, faults and missed clocks.
fn variants() -> Vec<Profile> {
    let mut all = Vec::new();
    for (name, text) in PROFILES {
        let plain = Profile::named(name).unwrap();
        let faults = "[[faults]]\nname = \"mis_seeded\"\ntaxel = 1\n[[faults]]\nname = \"drifting\"\ntaxel = 2\n\
                      [[faults]]\nname = \"skipping_clocks\"\ntaxel = 0\nprobability = 0.01\n";
        let mut faulty = Profile::from_toml(&format!("{text}\n{faults}")).unwrap();
        faulty.seeding = Some(Seeding::Mixed);
        for effects in [&mut faulty.compressive, &mut faulty.raster] {
            let missed = toml::from_str("probability = [0.0, 0.01]").unwrap();
            effects.insert("missed_clocks".to_owned(), toml::Value::Table(missed));
            // the converter would hide the last bits
            effects.remove("adc");
            effects.remove("clamp");
        }
        for weights in [CompressiveWeights::Binary, CompressiveWeights::Analog] {
            all.extend([&plain, &faulty].map(|p| Profile { weights, ..p.clone() }));
        }
    }
    all
}

/// Codes that are the generator's give the generator's recording: every effect, fault, mode and number of taxels, bit
/// for bit.
#[test]
fn sound_cells_do_not_show() {
    for profile in variants() {
        for mode in [Mode::Raster, Mode::Compressive] {
            for taxels in [3, 6, 100, 131] {
                let readout = || Readout::new(&profile, mode, &strip(taxels), Streams::new(8), 1).unwrap();
                let cells = |_: &Weights| Ok(sound_cells(&profile, mode, taxels));
                let with_cells = record(&mut readout().with_codes(cells).unwrap(), taxels as usize);
                let without = record(&mut readout(), taxels as usize);
                assert!(with_cells == without, "{taxels} taxels, {mode:?}: {profile:?}");
            }
        }
    }
}

/// Level of a code, in words of its own.
fn level(mode: WeightMode, code: u8) -> f64 {
    match (mode, code) {
        (WeightMode::Raster | WeightMode::Binary, 126) => 0.0,
        _ => (f64::from(code) - 127.5) / 127.5,
    }
}

/// Codes that no sound cell has: y is the plain dot product of their levels and the skin, and the contact noise goes
/// with √Σ(wx)². Two orders of n additions of terms that are at most x differ by less than n roundings of Σx.
#[test]
fn any_codes_give_their_sums() {
    let x = press_v();
    let mut analog = profile("");
    analog.weights = CompressiveWeights::Analog;
    let noise = "\n[compressive.contact_noise]\nfraction = 0.1\n[raster.contact_noise]\nfraction = 0.1";
    for (quiet, mode) in [(profile(""), Mode::Raster), (profile(""), Mode::Compressive), (analog, Mode::Compressive)] {
        let mut noisy = profile(noise);
        noisy.weights = quiet.weights;
        let weights = quiet.weights(mode, 100).unwrap();
        let y = |profile: &Profile, code: fn(u64, u32) -> u8| {
            let readout = start(profile, mode, 3);
            let mut readout = readout.with_codes(|_| Ok(Box::new(Cells { taxels: 100, code }))).unwrap();
            readout.acquire(&mut skin(&x), 2000).unwrap().volts
        };
        for code in [any_code as fn(u64, u32) -> u8, |_, _| 126, |_, taxel| if taxel == 50 { 255 } else { 0 }] {
            let (quiet_v, noisy_v) = (y(&quiet, code), y(&noisy, code));
            let mut sound = start(&noisy, mode, 3);
            let sound_v = sound.acquire(&mut skin(&x), 2000).unwrap().volts;
            for (row, (quiet_v, noisy_v)) in quiet_v.iter().zip(&noisy_v).enumerate() {
                let dot = |w: &dyn Fn(u32) -> f64| {
                    let terms = (0..).zip(&x).map(|(k, x)| w(k) * x);
                    let squares: f64 = terms.clone().map(|t| t * t).sum();
                    (terms.sum::<f64>(), squares.sqrt())
                };
                let (sum, norm) = dot(&|k| level(weights.mode(), code(row as u64, k)));
                let tolerance = 100.0 * f64::EPSILON * x.iter().sum::<f64>();
                assert_close(*quiet_v, sum, tolerance);
                // the normal number of this measurement, from sound cells with the same streams
                let (sound_sum, sound_norm) = dot(&|k| weights.level(k, row as u64));
                if sound_norm > 0.0 {
                    let normal = (sound_v[row] - sound_sum) / sound_norm;
                    assert_close(*noisy_v, sum + norm * normal, tolerance * (1.0 + 10.0 * norm / sound_norm));
                }
            }
        }
    }
}

/// Cells that do what a fault says give the recording of that fault, but for the rounding of other sums: 1e-12 of some
/// volts.
#[test]
fn cells_out_of_order_are_the_faults() {
    const TOLERANCE_V: f64 = 1e-12;
    for (name, mode) in
        [("as_built", Mode::Compressive), ("as_designed", Mode::Compressive), ("as_designed", Mode::Raster)]
    {
        let mut analog = Profile::named(name).unwrap();
        for effects in [&mut analog.compressive, &mut analog.raster] {
            effects.remove("adc");
            effects.remove("clamp");
        }
        for fault in ["dead", "stuck", "mis_seeded"] {
            let mut faulty = analog.clone();
            let list = format!("[[faults]]\nname = \"{fault}\"\ntaxel = 41");
            faulty.faults = Profile::from_toml(&format!("{}\n{list}", PROFILES[0].1)).unwrap().faults;
            let readout = |profile| start(profile, mode, 2);
            let weights = analog.weights(mode, 100).unwrap().mode();
            let code = move |row, taxel| match fault {
                "dead" if taxel == 41 => 126,
                "stuck" if taxel == 41 => 255,
                "mis_seeded" if taxel == 41 => sound(weights, 2, 100, row, taxel),
                _ => sound(weights, taxel + 8, 100, row, taxel),
            };
            let cells = |_: &Weights| Ok(Box::new(Cells { taxels: 100, code }) as Box<dyn CellCodes>);
            let by_cells = readout(&analog).with_codes(cells).unwrap().acquire(&mut skin(&press_v()), 5000).unwrap();
            let by_fault = readout(&faulty).acquire(&mut skin(&press_v()), 5000).unwrap();
            for (a, b) in by_cells.volts.iter().zip(&by_fault.volts) {
                assert_close(*a, *b, TOLERANCE_V);
            }
        }
    }
}

/// Cells that give up at row 300.
struct Tired;

impl CellCodes for Tired {
    fn taxels(&self) -> usize {
        100
    }

    fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), Refusal> {
        out.fill(255);
        if first_row + out.len() as u64 / 100 <= 300 {
            return Ok(());
        }
        Err(Refusal::new(format!("no codes from row {first_row} on: tired")))
    }
}

#[test]
fn codes_that_cannot_be_had_are_an_error() {
    let readout = |taxels| Readout::new(&profile(""), Mode::Compressive, &strip(taxels), Streams::new(0), 0).unwrap();
    let refused = readout(99).with_codes(|_| Ok(Box::new(Tired))).map(drop).unwrap_err();
    let expected = "the codes are those of 100 cells; the readout has 99 taxels";
    assert_eq!(refused.to_string(), expected);
    let mut readout = readout(100).with_codes(|_| Ok(Box::new(Tired))).unwrap();
    assert!(readout.acquire(&mut skin(&press_v()), 200).is_ok());
    let error = readout.acquire(&mut skin(&press_v()), 200).unwrap_err();
    assert!(error.to_string().starts_with("cells: no codes from row 2"), "{error}");
    // the readout can be used on
    readout.seek(0, 1);
    assert!(readout.acquire(&mut skin(&press_v()), 100).is_ok());
}
