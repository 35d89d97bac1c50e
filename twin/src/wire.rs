//! The one wire of a skin, live: pressure in, measurements out.

use crate::chain::{Chain, SkinSession, of_conductance, of_readout};
use spts_circuit::{Constant, Mode, Patterns, Readout, RecordingInfo, WeightRows};
use spts_input::Refusal;
use spts_models::{ConductanceMap, PressureMap, Snapshot};
use spts_recon::metrics::median;

/// Measurements of the untouched skin from which its output is known; of a pattern whole rounds.
const IDLE: usize = 2000;

/// A touch of a skin: the taxels that are pressed, in order, with the pressure on their electrodes, Pa; and for how
/// long, s.
pub type Pressed<'a> = (&'a [(u32, f64)], f64);

/// The one wire of a skin: transducer and electronics with their state, fed with one pressure after the other.
///
/// Transducer and clocks keep running between calls, so the result does not depend on how measurements are divided
/// among calls. [`Wire::new`] measures the untouched skin in both modes, which gives [`Wire::idle_v`].
///
/// ```
/// use spts::{Chain, ChainConfig, Mode, PressureMap, SkinLayout, Wire};
///
/// let chain = Chain::new(&ChainConfig::default(), &SkinLayout::default(), 0, ".".as_ref())?;
/// let mut wire = Wire::new(&chain, 0)?;
/// wire.feel(&PressureMap::from_values(10, 10, vec![1e4; 100]), 0.1)?;
/// let (mut volts, mut phi) = (vec![0.0; 20], vec![0.0; 20 * 100]);
/// wire.rows(Mode::Compressive, 20).fill(&mut phi);
/// wire.measure(Mode::Compressive, &mut volts)?;
/// # Ok::<(), spts::Refusal>(())
/// ```
pub struct Wire {
    skins: Vec<Worn>,
    felt: Constant,
    /// Scratch: places that conduct.
    conducting: Vec<u32>,
    /// Compressive, then raster.
    lines: Vec<Line>,
}

/// A skin on the wire.
struct Worn {
    skin: SkinSession,
    /// Place on the wire of each of its taxels.
    places: Vec<u32>,
    /// Taxels that conduct, and some that did before the last touch: number and conductance, S.
    conductance_s: Vec<(u32, f64)>,
}

/// The readout in one mode.
struct Line {
    readout: Readout,
    idle_v: f64,
}

impl Wire {
    /// The wire of the skin of `chain`, in session number `session`.
    ///
    /// # Errors
    /// [`Refusal`] if the source of the weights cannot provide them.
    pub fn new(chain: &Chain, session: u64) -> Result<Self, Refusal> {
        let taxels = (0..).take(chain.skin().taxels()).collect();
        Self::over(vec![(chain.skin_session(session), taxels)], chain, session)
    }

    /// One wire over several skins, by the readout of `chain`. Each of `skins` has the place on the wire of each of its
    /// taxels; the layout of `chain` has as many taxels as there are places.
    ///
    /// # Errors
    /// As [`Wire::new`].
    ///
    /// # Panics
    /// If the places are not all those of the layout.
    pub fn over(skins: Vec<(SkinSession, Vec<u32>)>, chain: &Chain, session: u64) -> Result<Self, Refusal> {
        let layout = chain.skin();
        if chain.wires() > 1 {
            let wires = chain.wires();
            return Err(Refusal::new(format!("`wires`: the skin has {wires}; what is read live is one wire")));
        }
        let bare = ConductanceMap::zeros(layout.rows(), layout.cols());
        let worn = |(skin, places)| Worn { skin, places, conductance_s: Vec::new() };
        let skins: Vec<Worn> = skins.into_iter().map(worn).collect();
        let placed: usize = skins.iter().map(|worn| worn.places.len()).sum();
        assert_eq!(placed, layout.taxels(), "one place a taxel");
        let felt = Constant::new(bare).map_err(of_conductance)?;
        let mut wire = Self { skins, felt, conducting: Vec::new(), lines: Vec::new() };
        wire.feel_touched(&vec![Some((&[][..], 0.0)); wire.skins.len()])?;
        for mode in [Mode::Compressive, Mode::Raster] {
            let mut readout = chain.readout_of_touches(mode, session)?;
            // whole rounds of a pattern, so that what follows begins with its first row
            let period = readout.weights().patterns().map_or(1, Patterns::period);
            let idle = readout.measure(&mut wire.felt, IDLE.next_multiple_of(period)).map_err(of_readout)?;
            wire.lines.push(Line { idle_v: median(&idle).unwrap_or_default(), readout });
        }
        Ok(wire)
    }

    /// Applies `electrode_pressure` for `dt_s` seconds. It then stays until the next call.
    ///
    /// # Errors
    /// [`Refusal`] for a conductance that cannot be used.
    ///
    /// # Panics
    /// If the wire is over several skins, or the map has another shape than the skin.
    pub fn feel(&mut self, electrode_pressure: &PressureMap, dt_s: f64) -> Result<(), Refusal> {
        let shape = [electrode_pressure.rows(), electrode_pressure.cols()];
        assert_eq!(shape, self.skins[0].skin.shape(), "shape of the pressure");
        let pressed = (0..).zip(electrode_pressure.values().iter().copied()).filter(|(_, pa)| *pa > 0.0);
        self.feel_touched(&[Some((&pressed.collect::<Vec<_>>(), dt_s))])
    }

    /// [`Wire::feel`] for every skin. `None` leaves the taxels of a skin as they are. Taxels that are neither pressed
    /// nor conduct cost nothing.
    ///
    /// # Errors
    /// As [`Wire::feel`].
    ///
    /// # Panics
    /// If there are more or fewer than skins, or a skin does not have one of the taxels.
    pub fn feel_touched(&mut self, felt: &[Option<Pressed<'_>>]) -> Result<(), Refusal> {
        assert_eq!(felt.len(), self.skins.len(), "one touch a skin");
        for (worn, felt) in self.skins.iter_mut().zip(felt) {
            if let Some((pressed, dt_s)) = felt {
                worn.skin.hold_touched(pressed, *dt_s, &mut worn.conductance_s);
            }
        }
        self.conduct()
    }

    /// Gives the wire the conductance of its skins.
    fn conduct(&mut self) -> Result<(), Refusal> {
        let placed =
            self.skins.iter().flat_map(|worn| worn.conductance_s.iter().map(|(k, g)| (worn.places[*k as usize], *g)));
        self.conducting.clear();
        self.conducting.extend(placed.clone().filter(|(_, g)| *g > 0.0).map(|(place, _)| place));
        let values = placed.map(|(place, g)| (place as usize, g));
        self.felt.change(values, self.conducting.iter().copied()).map_err(of_conductance)
    }

    /// Saves or loads everything that it remembers, for a wire that was made with the same arguments.
    ///
    /// # Errors
    /// [`Refusal`] for a conductance that cannot be.
    pub fn exchange(&mut self, state: &mut Snapshot) -> Result<(), Refusal> {
        for worn in &mut self.skins {
            worn.skin.exchange(state);
            let (mut taxels, mut values): (Vec<u32>, Vec<f64>) = worn.conductance_s.iter().copied().unzip();
            state.u32s(&mut taxels);
            values.resize(taxels.len(), 0.0);
            state.f64s(&mut values);
            worn.conductance_s =
                taxels.into_iter().zip(values).filter(|(k, _)| (*k as usize) < worn.places.len()).collect();
        }
        let [rows, cols] = [self.felt.map().rows(), self.felt.map().cols()];
        self.felt = Constant::new(ConductanceMap::zeros(rows, cols)).map_err(of_conductance)?;
        self.conduct()?;
        for line in &mut self.lines {
            line.readout.exchange(state);
        }
        Ok(())
    }

    /// Fills `volts` with consecutive measurements, V.
    ///
    /// # Errors
    /// [`Refusal`] if the cells put out nothing.
    pub fn measure(&mut self, mode: Mode, volts: &mut [f64]) -> Result<(), Refusal> {
        let line = &mut self.lines[index(mode)];
        line.readout.go_on(&mut self.felt, volts).map_err(of_readout)
    }

    /// Lets `frames` frames pass without recording them, counted from the start of the current frame. Clocks and faults
    /// go on. The amplifier forgets the measurement before.
    pub fn pass(&mut self, mode: Mode, frames: u64) {
        if frames > 0 {
            let readout = &mut self.lines[index(mode)].readout;
            readout.skip(frames);
            readout.begin();
        }
    }

    /// The rows of Φ for the next `count` measurements.
    pub fn rows(&self, mode: Mode, count: usize) -> WeightRows<'_> {
        let readout = &self.lines[index(mode)].readout;
        WeightRows::new(readout.weights(), readout.row(), count)
    }

    /// Median of 2000 samples of the untouched skin, taken in [`Wire::new`], V; of a pattern as many more as make whole
    /// rounds.
    pub fn idle_v(&self, mode: Mode) -> f64 {
        self.lines[index(mode)].idle_v
    }

    /// Conductance of the taxels in row-major order, S.
    pub fn conductance_s(&self) -> &[f64] {
        self.felt.values()
    }

    /// Metadata of a recording of this wire.
    pub fn info(&self, mode: Mode) -> &RecordingInfo {
        self.lines[index(mode)].readout.info()
    }
}

fn index(mode: Mode) -> usize {
    match mode {
        Mode::Compressive => 0,
        Mode::Raster => 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::ChainConfig;
    use spts_models::{SkinLayout, Streams};

    fn wire() -> Wire {
        let chain = Chain::new(&ChainConfig::default(), &SkinLayout::default(), 3, ".".as_ref()).unwrap();
        Wire::new(&chain, 0).unwrap()
    }

    fn pressed() -> PressureMap {
        PressureMap::from_values(10, 10, (0..100).map(|k| if k % 7 == 0 { 2e4 } else { 0.0 }).collect())
    }

    #[test]
    fn the_cut_into_calls_does_not_show() {
        for mode in [Mode::Compressive, Mode::Raster] {
            let taken = |cuts: &[usize]| {
                let mut wire = wire();
                wire.feel(&pressed(), 0.1).unwrap();
                let mut volts = vec![0.0; cuts.iter().sum()];
                let mut rest = &mut volts[..];
                for cut in cuts {
                    let (now, later) = rest.split_at_mut(*cut);
                    wire.measure(mode, now).unwrap();
                    rest = later;
                }
                volts
            };
            assert_eq!(taken(&[400]), taken(&[1, 19, 20, 60, 300]), "{mode:?}");
        }
    }

    /// Two skins on one wire conduct as each on its own, and a copy by the saved state goes on with the same bits.
    #[test]
    fn skins_share_a_wire() {
        let config = ChainConfig::default();
        let (small, all) = (SkinLayout::new(2, 3, 0.01, 0.005).unwrap(), SkinLayout::new(1, 12, 0.01, 0.005).unwrap());
        let chain = Chain::new(&config, &all, 3, ".".as_ref()).unwrap();
        let skin = |seed| SkinSession::new(&config, &small, Streams::new(seed), 0).unwrap();
        let make = || {
            let places = |first: u32| (0..6).map(|k| 2 * k + first).collect();
            Wire::over(vec![(skin(3), places(0)), (skin(4), places(1))], &chain, 0).unwrap()
        };
        let pressure = PressureMap::from_values(2, 3, vec![2e4, 0.0, 1e4, 3e4, 0.0, 5e3]);
        let mut wire = make();
        let pressed: Vec<(u32, f64)> = (0..).zip(pressure.values().iter().copied()).collect();
        wire.feel_touched(&[Some((&pressed, 0.1)), None]).unwrap();
        wire.feel_touched(&[None, Some((&pressed, 0.2))]).unwrap();
        for (seed, dt_s) in [(3, 0.1), (4, 0.2)] {
            let alone = skin(seed).hold(&pressure, dt_s);
            let own = wire.conductance_s().iter().skip(usize::from(seed == 4)).step_by(2);
            assert!(own.eq(alone.values()), "skin {seed}");
        }
        wire.measure(Mode::Compressive, &mut [0.0; 333]).unwrap();
        let (mut copy, mut saving) = (make(), Snapshot::saving());
        wire.exchange(&mut saving).unwrap();
        // what a wire has felt before it loads a state is gone
        copy.feel_touched(&[Some((&[(1, 3e4)], 0.1)), Some((&[(5, 1e4)], 0.1))]).unwrap();
        let mut loading = Snapshot::loading(saving.finish().unwrap());
        copy.exchange(&mut loading).unwrap();
        loading.finish().unwrap();
        assert_eq!(copy.conductance_s(), wire.conductance_s());
        for wire in [&mut wire, &mut copy] {
            wire.feel_touched(&[Some((&pressed, 0.7)), None]).unwrap();
        }
        for mode in [Mode::Compressive, Mode::Raster] {
            let [goes_on, same] = [&mut wire, &mut copy].map(|wire| {
                let mut volts = [0.0; 500];
                wire.measure(mode, &mut volts).unwrap();
                volts.map(f64::to_bits)
            });
            assert!(goes_on == same, "{mode:?}");
        }
    }

    /// Without an effect, a measurement is Σ w·R·G of the rows that it says.
    #[test]
    fn an_ideal_wire_is_the_sum_of_its_rows() {
        let config = ChainConfig { readout: Some("ideal".to_owned()), ..ChainConfig::default() };
        let chain = Chain::new(&config, &SkinLayout::default(), 3, ".".as_ref()).unwrap();
        let mut wire = Wire::new(&chain, 0).unwrap();
        wire.feel(&pressed(), 0.1).unwrap();
        let gain = chain.profile().volts_per_siemens();
        for mode in [Mode::Compressive, Mode::Raster] {
            let rows = wire.rows(mode, 30).to_vec();
            let mut volts = [0.0; 30];
            wire.measure(mode, &mut volts).unwrap();
            for (row, v) in rows.chunks_exact(100).zip(volts) {
                let sum: f64 = row.iter().zip(wire.conductance_s()).map(|(w, g)| w * g).sum();
                assert!((v - gain * sum).abs() < 1e-12 * gain, "{mode:?}: {v} ≠ {}", gain * sum);
            }
        }
    }

    /// What the wire says of a box, 40 measurements and a raster scan as hexadecimal bytes. The Python package has to
    /// say the same (`python/tests/test_wire.py`).
    #[test]
    fn the_bytes_of_a_press() -> Result<(), Box<dyn std::error::Error>> {
        use spts_contact::mesh::cuboid;
        use spts_contact::{Foam, PosedMesh, PreparedMesh, TouchBody, TouchSkin};

        let layout = SkinLayout::new(10, 10, 0.015, 0.01)?;
        let mut skin = TouchSkin::flat(layout, Foam::default())?;
        let mesh = cuboid([0.04, 0.05, 0.03]).translated([0.0, 0.0, -0.015]);
        let block = TouchBody::from(PreparedMesh::from(mesh));
        let chain = Chain::new(&ChainConfig::default(), &layout, 7, ".".as_ref())?;
        let mut wire = Wire::new(&chain, 0)?;
        let mut wrenches = Vec::new();
        for k in 0..3 {
            let position_m = [0.01, -0.02, 0.014 - 1e-3 * f64::from(k)];
            let posed =
                PosedMesh { velocity_m_per_s: [0.0, 0.0, -0.01], ..PosedMesh::at_rest(&block.mesh, position_m) };
            skin.touch(&[(&block, posed)], &mut wrenches);
            wire.feel(skin.electrode_pressure(), 0.1)?;
        }
        let mut expected = include_str!("../assets/wire_bytes.txt").lines();
        for (mode, count) in [(Mode::Compressive, 40), (Mode::Raster, 100)] {
            let mut volts = vec![0.0; count];
            wire.measure(mode, &mut volts)?;
            let bytes = volts.iter().flat_map(|v| v.to_le_bytes());
            let hex: String = bytes.map(|b| format!("{b:02x}")).collect();
            assert_eq!(Some(hex.as_str()), expected.next());
        }
        Ok(())
    }
}
