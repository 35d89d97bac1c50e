//! The one wire: transducer and electronics, with their state.

use crate::args::{Array1, Array2, one_of, whole};
use crate::common::{refuse, table};
use crate::skin::{Skin, Touch};
use numpy::{IntoPyArray as _, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use spts::chain::RowsConfig;
use spts::circuit::{CompressiveWeights, Seeding};
use spts::{Chain, ChainConfig, Mode, PressureMap, SkinLayout, Wire as Line};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Most measurements of a call, and most weights that it returns.
const MOST: usize = 1 << 27;

/// Most measurements between two looks at whether Ctrl-C was pressed.
const SLICE: usize = 1 << 16;

/// The one wire of a skin: what its taxels conduct, and what the converter reads of their sum.
///
/// Parameters
/// ----------
/// skin : Skin
/// readout : str
///     Profile of the electronics: "ideal", "as_built", "as_published", "as_designed", or a file that ends in .toml.
/// seeds : str or sequence of int, optional
///     Seeds of the cells: "mixed" or "address" for a rule, or one number a taxel, [0, 2**32). Default: the profile's.
/// seed : int
///     Everything random: which specimen of the skin it is, and its noise.
/// session : int
///     Number of the session: another one has other noise on the same skin.
/// levels : str, optional
///     Weights of the cells: "binary", ±1, or "analog", eight bits. Default: the profile's.
/// transducer : str
///     "velostat" or "linear".
/// parameters : dict, optional
///     Parameters of the transducer.
/// faults : list of dict, optional
///     Faulty cells: `name`, `taxel` and the fault's own parameters.
/// taxels : sequence of int, optional
///     The taxels of the skin that are on this wire, row by row from 0; default all. Several wires share a skin.
#[pyclass(frozen, module = "spts")]
pub(crate) struct Wire {
    state: Mutex<State>,
    /// Which skin, by its number.
    skin: u64,
    /// Taxels of the skin on this wire; `None` for all of them.
    taxels: Option<Vec<usize>>,
    /// Rows and columns of the taxels on this wire.
    #[pyo3(get)]
    shape: (usize, usize),
    /// Measurements a second, Hz.
    #[pyo3(get)]
    sample_rate: f64,
}

struct State {
    line: Line,
    felt: PressureMap,
    /// Time of the touch that was felt last, s, and its number.
    time_s: f64,
    number: u64,
}

#[pymethods]
impl Wire {
    #[new]
    #[pyo3(signature = (skin, readout = "as_built", seeds = None, seed = 0, *, session = 0, levels = None, transducer = "velostat", parameters = None, faults = None, taxels = None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn new(
        py: Python<'_>,
        skin: &Skin,
        readout: &str,
        seeds: Option<Bound<'_, PyAny>>,
        seed: i128,
        session: i128,
        levels: Option<&str>,
        transducer: &str,
        parameters: Option<&Bound<'_, PyDict>>,
        faults: Option<&Bound<'_, PyList>>,
        taxels: Option<Vec<i128>>,
    ) -> PyResult<Self> {
        let (seed, session) = (whole("seed", seed)?, whole("session", session)?);
        let taxels =
            taxels.map(|taxels| taxels.into_iter().map(|k| whole("taxels", k)).collect::<PyResult<Vec<usize>>>());
        let taxels = taxels.transpose()?;
        let whole = skin.layout();
        let layout = match &taxels {
            Some(taxels) => part(&whole, taxels)?,
            None => whole,
        };
        let faults = faults.map(|faults| {
            let one = |(k, fault): (usize, Bound<'_, PyAny>)| {
                let fault = fault.cast_into::<PyDict>()?;
                table(&format!("faults[{k}]"), &fault)
            };
            faults.iter().enumerate().map(one).collect::<PyResult<_>>()
        });
        let config = ChainConfig {
            transducer: Some(transducer.to_owned()),
            transducer_parameters: parameters.map(|p| table("parameters", p)).transpose()?.unwrap_or_default(),
            readout: Some(readout.to_owned()),
            rows: rows(seeds, levels)?,
            weights: None,
            faults: faults.transpose()?.unwrap_or_default(),
        };
        let line = py.detach(|| {
            let chain = Chain::new(&config, &layout, seed, Path::new(""))?;
            Ok::<_, spts::Refusal>((chain.sample_rate_hz(), Line::new(&chain, session)?))
        });
        let (sample_rate, line) = line.map_err(refuse)?;
        Ok(Self {
            state: Mutex::new(State {
                line,
                felt: PressureMap::zeros(layout.rows(), layout.cols()),
                time_s: 0.0,
                number: 0,
            }),
            skin: skin.id(),
            taxels,
            shape: (layout.rows(), layout.cols()),
            sample_rate,
        })
    }

    /// Lets the taxels feel a touch without measuring: the transducer remembers what it felt, and for how long.
    ///
    /// Parameters
    /// ----------
    /// touch : Touch
    ///     Of this wire's skin, not before the one that it felt last. It has been on the skin since then.
    fn feel(&self, py: Python<'_>, touch: &Touch) -> PyResult<()> {
        py.detach(|| self.felt(&mut self.locked(), touch))
    }

    /// Measures a touch.
    ///
    /// Parameters
    /// ----------
    /// touch : Touch
    ///     What the skin feels now; it has been on the skin since the touch that this wire felt last.
    /// measurements : int, optional
    ///     Number of measurements, M; default for a raster scan: one a taxel.
    /// raster : bool
    ///     A raster scan in place of sums: one taxel after the other.
    /// raw : bool
    ///     The output of the amplifier as it is, V, in place of its difference from the untouched skin's.
    /// weights : bool
    ///     Whether Φ is returned; without it, the second value is None.
    ///
    /// Returns
    /// -------
    /// y : ndarray (M,)
    ///     Output of the summing amplifier without that of the untouched skin, V.
    /// phi : ndarray (M, taxels)
    ///     The rows of the sensing matrix Φ: the weights of the cells at each measurement.
    #[pyo3(signature = (touch, measurements = None, *, raster = false, raw = false, weights = true))]
    fn record<'py>(
        &self,
        py: Python<'py>,
        touch: &Touch,
        measurements: Option<i128>,
        raster: bool,
        raw: bool,
        weights: bool,
    ) -> PyResult<(Array1<'py>, Option<Array2<'py>>)> {
        let taxels = self.shape.0 * self.shape.1;
        let count = match measurements {
            Some(count) => whole("measurements", count)?,
            None if raster => taxels,
            None => bail!("`measurements` is missing: how many?"),
        };
        if !(1..=MOST).contains(&count) {
            bail!("`measurements` = {count} is outside [1, 2^27]");
        }
        let most = if weights { MOST / taxels } else { MOST };
        if count > most {
            bail!(
                "`measurements` = {count} is outside [1, {most}] with Φ of {taxels} columns; `weights=False` leaves Φ out"
            );
        }
        let mode = if raster { Mode::Raster } else { Mode::Compressive };
        let (mut volts, mut phi) = (vec![0.0; count], vec![0.0; if weights { count * taxels } else { 0 }]);
        let mut slices = volts.chunks_mut(SLICE);
        let mut idle_v = 0.0;
        let mut filled = false;
        while slices.len() > 0 {
            let ended: PyResult<()> = py.detach(|| {
                let mut state = self.locked();
                if !filled {
                    self.felt(&mut state, touch)?;
                    if weights {
                        state.line.rows(mode, count).fill(&mut phi);
                    }
                    idle_v = if raw { 0.0 } else { state.line.idle_v(mode) };
                    filled = true;
                }
                if let Some(slice) = slices.next() {
                    state.line.measure(mode, slice).map_err(refuse)?;
                }
                Ok(())
            });
            ended?;
            py.check_signals()?;
        }
        if !raw {
            volts.iter_mut().for_each(|v| *v -= idle_v);
        }
        let phi = weights.then(|| phi.into_pyarray(py).reshape([count, taxels])).transpose()?;
        Ok((volts.into_pyarray(py), phi))
    }

    /// Conductance of the taxels as they are, S, (rows, cols).
    #[getter]
    fn conductance<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let values = self.locked().line.conductance_s().to_vec();
        values.into_pyarray(py).reshape([self.shape.0, self.shape.1])
    }

    /// Output of the untouched skin, V: its median over 2,000 measurements.
    #[getter]
    fn idle(&self) -> f64 {
        self.locked().line.idle_v(Mode::Compressive)
    }

    fn __repr__(&self) -> String {
        format!("<spts.Wire of {} x {} taxels>", self.shape.0, self.shape.1)
    }
}

impl Wire {
    fn locked(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Brings the transducer to the time of `touch`.
    fn felt(&self, state: &mut State, touch: &Touch) -> PyResult<()> {
        let felt = touch.felt.values();
        if touch.skin != self.skin {
            bail!("`touch` is of another skin than this wire");
        }
        let dt_s = touch.time - state.time_s;
        if dt_s < 0.0 || touch.number < state.number {
            bail!(
                "`touch` is of {} s; this wire has felt one of {} s: time does not run back",
                touch.time,
                state.time_s
            );
        }
        if touch.number == state.number {
            return Ok(());
        }
        match &self.taxels {
            Some(taxels) => {
                let own = state.felt.values_mut().iter_mut();
                own.zip(taxels).for_each(|(own, taxel)| *own = felt[*taxel]);
            }
            None => state.felt.values_mut().copy_from_slice(felt),
        }
        let State { line, felt, .. } = state;
        line.feel(felt, dt_s).map_err(refuse)?;
        (state.time_s, state.number) = (touch.time, touch.number);
        Ok(())
    }
}

/// A wire with these taxels of `skin`: a row of them.
fn part(skin: &SkinLayout, taxels: &[usize]) -> PyResult<SkinLayout> {
    let count = skin.taxels();
    let mut seen = vec![false; count];
    for (k, taxel) in taxels.iter().enumerate() {
        match seen.get_mut(*taxel) {
            None => bail!("`taxels[{k}]` = {taxel} is outside [0, {}]", count - 1),
            Some(seen) if *seen => bail!("`taxels[{k}]` = {taxel} is there twice"),
            Some(seen) => *seen = true,
        }
    }
    SkinLayout::new(1, taxels.len(), skin.pitch_m(), skin.electrode_m()).map_err(refuse)
}

fn rows(seeds: Option<Bound<'_, PyAny>>, levels: Option<&str>) -> PyResult<RowsConfig> {
    let mut rows = RowsConfig::default();
    match seeds {
        None => {}
        Some(seeds) => match seeds.extract::<String>() {
            Ok(rule) => {
                rows.seeding = Some(match rule.as_str() {
                    "mixed" => Seeding::Mixed,
                    "address" => Seeding::Address,
                    _ => {
                        bail!("`seeds` = \"{rule}\"; valid: \"mixed\", \"address\", or a number a taxel");
                    }
                });
            }
            Err(_) => {
                let list = seeds.extract::<Vec<u32>>();
                rows.seeds =
                    Some(list.map_err(|_| refuse("`seeds`: whole numbers in [0, 2**32) are needed, one a taxel"))?);
            }
        },
    }
    let known = [("binary", CompressiveWeights::Binary), ("analog", CompressiveWeights::Analog)];
    rows.levels = levels.map(|levels| one_of("levels", levels, &known)).transpose()?;
    Ok(rows)
}
