//! The one wire of a skin, live: pressure in, measurements out.

use crate::chain::{Chain, SkinSession, of_conductance, of_readout};
use spts_circuit::{Constant, Mode, Readout, RecordingInfo, WeightRows};
use spts_input::Refusal;
use spts_models::PressureMap;
use spts_recon::metrics::median;

/// Measurements of the untouched skin from which its output is known.
const IDLE: usize = 2000;

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
    skin: SkinSession,
    felt: Constant,
    shape: [usize; 2],
    lines: [Line; 2],
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
        let layout = chain.skin();
        let shape = [layout.rows(), layout.cols()];
        let mut skin = chain.skin_session(session);
        let mut felt =
            Constant::new(skin.hold(&PressureMap::zeros(shape[0], shape[1]), 0.0)).map_err(of_conductance)?;
        let mut line = |mode| {
            let mut readout = chain.readout(mode, session)?;
            let idle = readout.measure(&mut felt, IDLE).map_err(of_readout)?;
            Ok::<_, Refusal>(Line { idle_v: median(&idle).unwrap_or_default(), readout })
        };
        let lines = [line(Mode::Compressive)?, line(Mode::Raster)?];
        Ok(Self { skin, felt, shape, lines })
    }

    /// Applies `electrode_pressure` for `dt_s` seconds. It then stays until the next call.
    ///
    /// # Errors
    /// [`Refusal`] for a conductance that cannot be used.
    ///
    /// # Panics
    /// If the map has another shape than the skin.
    pub fn feel(&mut self, electrode_pressure: &PressureMap, dt_s: f64) -> Result<(), Refusal> {
        let found = [electrode_pressure.rows(), electrode_pressure.cols()];
        assert_eq!(found, self.shape, "shape of the pressure");
        self.felt = Constant::new(self.skin.hold(electrode_pressure, dt_s)).map_err(of_conductance)?;
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

    /// Median of 2000 samples of the untouched skin, taken in [`Wire::new`], V.
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
    use spts_models::SkinLayout;

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
