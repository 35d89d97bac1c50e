//! The one wire: transducer and electronics, with their state.

use crate::args::{Array1, Array2, one_of, whole};
use crate::common::{of_toml, refuse, table, to_toml};
use crate::skin::{Skin, Touch, pressure_of};
use numpy::{AllowTypeChange, IntoPyArray as _, PyArrayLike2, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PySequence, PyTuple};
use serde::{Deserialize, Serialize};
use spts::chain::{RowsConfig, SkinSession};
use spts::circuit::{CompressiveWeights, Patterns, Profile, Seeding, WeightMode};
use spts::models::{Snapshot, Streams};
use spts::{Chain, ChainConfig, Mode, SkinLayout, Wire as Line};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Time for which an array of pressures has been on the skin unless that is said, s.
const HELD_S: f64 = 0.1;

/// Most measurements of a call, and most weights that it returns.
const MOST: usize = 1 << 27;

/// How far a level that is given may be from one of the cells: it was printed with six digits.
const LEVEL: f64 = 1e-6;

/// Most measurements between two looks at whether Ctrl-C was pressed.
const SLICE: usize = 1 << 16;

/// The one wire of a skin, or of several: what its taxels conduct, and what the converter reads of their sum.
///
/// Parameters
/// ----------
/// skin : Skin or sequence of Skin
///     With a sequence, the taxels of the wire are those of the skins one after the other, and a touch is a sequence of
///     one a skin.
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
///     Parameters of the transducer. A wire over a sequence of skins, or over some of the taxels, has no tilt of the
///     mounting (`session_tilt_log_sd` = 0).
/// faults : list of dict, optional
///     Faulty cells: `name`, `taxel` and the fault's own parameters.
/// taxels : sequence of int, optional
///     The taxels of the skin that are on this wire, row by row from 0; default all. Several wires share a skin. Of
///     several skins, the numbers go on from one to the next.
/// rows : array (R, taxels) or str, optional
///     The rows of Φ, which the cells repeat, in place of seeds: levels ±1, or the levels k/127.5 − 1, k = 0, 1, … 255,
///     of "analog" weights. A text is a file of them, as `spts design` writes it. Default: the profile's.
///
/// A copy (`copy.deepcopy`, `pickle`) goes on with the same measurements as its original, and changes nothing of it.
#[pyclass(frozen, module = "spts")]
pub(crate) struct Wire {
    state: Mutex<State>,
    made: Made,
    /// Rows and columns of the taxels on this wire.
    #[pyo3(get)]
    shape: (usize, usize),
    /// Measurements a second, Hz.
    #[pyo3(get)]
    sample_rate: f64,
}

struct State {
    line: Line,
    skins: Vec<Felt>,
}

/// What was felt last of a skin.
struct Felt {
    /// Taxels that were pressed, in order, and their pressure, Pa.
    pressed: Vec<(u32, f64)>,
    /// Time of the touch, s, and its number.
    time_s: f64,
    number: u64,
}

/// What a wire is made from.
#[derive(Serialize, Deserialize)]
struct Made {
    /// As signed numbers of the same bits, which TOML has.
    seed: i64,
    session: i64,
    transducer: String,
    /// Whether a touch is a sequence.
    several: bool,
    skin: SkinLayout,
    skins: Vec<Part>,
    parameters: toml::Table,
    profile: Profile,
}

/// The taxels of a skin on a wire.
#[derive(Serialize, Deserialize)]
struct Part {
    /// Which skin, by the bits of its number.
    id: i64,
    /// Taxels of the skin, in order, with their number here; `None` for all of them.
    taxels: Option<Vec<(u32, u32)>>,
    /// Their places on the wire.
    places: Vec<u32>,
    layout: SkinLayout,
}

#[pymethods]
impl Wire {
    #[new]
    #[pyo3(signature = (skin, readout = "as_built", seeds = None, seed = 0, *, session = 0, levels = None, transducer = "velostat", parameters = None, faults = None, taxels = None, rows = None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn new(
        py: Python<'_>,
        skin: &Bound<'_, PyAny>,
        readout: &str,
        seeds: Option<Bound<'_, PyAny>>,
        seed: i128,
        session: i128,
        levels: Option<&str>,
        transducer: &str,
        parameters: Option<&Bound<'_, PyDict>>,
        faults: Option<&Bound<'_, PyList>>,
        taxels: Option<Vec<i128>>,
        rows: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let (seed, session): (u64, u64) = (whole("seed", seed)?, whole("session", session)?);
        let taxels =
            taxels.map(|taxels| taxels.into_iter().map(|k| whole("taxels", k)).collect::<PyResult<Vec<usize>>>());
        let (several, skins) = skins(skin)?;
        let (layout, skins) = parts(several, &skins, taxels.transpose()?)?;
        let faults = faults.map(|faults| {
            let one = |(k, fault): (usize, Bound<'_, PyAny>)| {
                let fault = fault.cast_into::<PyDict>()?;
                table(&format!("faults[{k}]"), &fault)
            };
            faults.iter().enumerate().map(one).collect::<PyResult<_>>()
        });
        let mut parameters = parameters.map(|p| table("parameters", p)).transpose()?.unwrap_or_default();
        if transducer == "velostat" && skins.iter().any(|part| part.taxels.is_some()) {
            // the taxels are in a row here, which no mounting tilts as a sheet
            let tilt = parameters.entry("session_tilt_log_sd").or_insert(0.0.into());
            if tilt.as_float().or(tilt.as_integer().map(|k| k as f64)).is_some_and(|tilt| tilt != 0.0) {
                bail!(
                    "`parameters.session_tilt_log_sd` = {tilt}: the taxels of several skins, or some of one, are no \
                     sheet that tilts; valid: 0"
                );
            }
        }
        let config = ChainConfig {
            transducer: Some(transducer.to_owned()),
            transducer_parameters: parameters,
            readout: Some(readout.to_owned()),
            rows: rows_of(seeds, levels, rows)?,
            faults: faults.transpose()?.unwrap_or_default(),
            ..ChainConfig::default()
        };
        let chain = py.detach(|| Chain::new(&config, &layout, seed, Path::new("")));
        let chain = chain.map_err(|error| {
            // under the name that they have here
            refuse(error.to_string().replace("`rows.patterns_file`", "`rows`").replace("`rows.patterns`", "`rows`"))
        })?;
        let made = Made {
            seed: seed.cast_signed(),
            session: session.cast_signed(),
            transducer: transducer.to_owned(),
            several,
            skin: layout,
            skins,
            parameters: config.transducer_parameters,
            profile: chain.profile().clone(),
        };
        Self::of(py, made, &chain)
    }

    /// Lets the taxels feel a touch without measuring: the transducer remembers what it felt, and for how long.
    ///
    /// Parameters
    /// ----------
    /// touch : Touch, or sequence of Touch or None
    ///     Of this wire's skin, not before the one that it felt last. It has been on the skin since then. Of a wire
    ///     over several skins one of each, in their order; None for a skin without a touch since then: its taxels stay
    ///     as they are. An array (rows, cols), Pa, is a touch where the wire is over one whole skin; touches
    ///     of `Skin.touch` do not follow it, as the skin has not felt it (`Touch.from_array`).
    /// dt : float, optional
    ///     Time for which an array has been on the skin, s, [0, 1e9]; default 0.1. A touch has its own.
    #[pyo3(signature = (touch, dt = None))]
    fn feel(&self, py: Python<'_>, touch: &Bound<'_, PyAny>, dt: Option<f64>) -> PyResult<()> {
        let touches = self.touches(touch, dt)?;
        py.detach(|| self.felt(&mut self.locked(), &touches))
    }

    /// Measures a touch.
    ///
    /// Parameters
    /// ----------
    /// touch : Touch, or sequence of Touch or None
    ///     What the skin feels now; it has been on the skin since the touch that this wire felt last. Of a wire over
    ///     several skins one of each, as for `feel`, which also says what an array is.
    /// measurements : int, optional
    ///     Number of measurements, M; default for a raster scan: one a taxel.
    /// raster : bool
    ///     A raster scan in place of sums: one taxel after the other.
    /// raw : bool
    ///     The output of the amplifier as it is, V, in place of its difference from the untouched skin's.
    /// weights : bool
    ///     Whether Φ is returned; without it, the second value is None.
    /// dt : float, optional
    ///     As for `feel`.
    ///
    /// Returns
    /// -------
    /// y : ndarray (M,)
    ///     Output of the summing amplifier without that of the untouched skin, V.
    /// phi : ndarray (M, taxels)
    ///     The rows of the sensing matrix Φ: the weights of the cells at each measurement.
    #[pyo3(signature = (touch, measurements = None, *, raster = false, raw = false, weights = true, dt = None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn record<'py>(
        &self,
        py: Python<'py>,
        touch: &Bound<'py, PyAny>,
        measurements: Option<i128>,
        raster: bool,
        raw: bool,
        weights: bool,
        dt: Option<f64>,
    ) -> PyResult<(Array1<'py>, Option<Array2<'py>>)> {
        let touches = self.touches(touch, dt)?;
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
                    self.felt(&mut state, &touches)?;
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

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, own) = (slf.py(), slf.get());
        let mut saving = Snapshot::saving();
        own.locked().exchange(&mut saving).map_err(refuse)?;
        let words = saving.finish().map_err(refuse)?;
        let bytes: Vec<u8> = words.into_iter().flat_map(u64::to_le_bytes).collect();
        let arguments = (to_toml(&own.made)?, PyBytes::new(py, &bytes)).into_pyobject(py)?;
        Ok((slf.get_type().getattr("_restored")?, arguments))
    }

    /// The wire that was pickled.
    #[staticmethod]
    fn _restored(py: Python<'_>, made: &str, state: &[u8]) -> PyResult<Self> {
        let made: Made = of_toml(made)?;
        let config = ChainConfig { profile: Some(made.profile.clone()), ..made.config() };
        let seed = made.seed.cast_unsigned();
        let chain = py.detach(|| Chain::new(&config, &made.skin, seed, Path::new(""))).map_err(refuse)?;
        let wire = Self::of(py, made, &chain)?;
        let words = state.as_chunks().0.iter().map(|bytes| u64::from_le_bytes(*bytes));
        let mut loading = Snapshot::loading(words.collect());
        wire.locked().exchange(&mut loading).map_err(refuse)?;
        loading.finish().map_err(refuse)?;
        Ok(wire)
    }

    fn __repr__(&self) -> String {
        format!("<spts.Wire of {} x {} taxels>", self.shape.0, self.shape.1)
    }
}

impl Made {
    /// The transducer, of the default readout.
    fn config(&self) -> ChainConfig {
        ChainConfig {
            transducer: Some(self.transducer.clone()),
            transducer_parameters: self.parameters.clone(),
            ..ChainConfig::default()
        }
    }
}

impl Part {
    /// The pressed taxels of a touch, by their place in the part, in order, and the pressure on their electrodes, Pa.
    fn pressed(&self, touch: &Touch) -> Vec<(u32, f64)> {
        let pressed = touch.felt.electrodes().filter(|(_, pa)| *pa > 0.0);
        let Some(taxels) = &self.taxels else {
            return pressed.collect();
        };
        let place = |(taxel, pa): (u32, f64)| {
            let at = taxels.binary_search_by_key(&taxel, |(taxel, _)| *taxel).ok()?;
            Some((taxels[at].1, pa))
        };
        let mut own: Vec<(u32, f64)> = pressed.filter_map(place).collect();
        own.sort_unstable_by_key(|(place, _)| *place);
        own
    }
}

impl State {
    fn exchange(&mut self, state: &mut Snapshot) -> Result<(), spts::Refusal> {
        for felt in &mut self.skins {
            let (mut taxels, mut values): (Vec<u32>, Vec<f64>) = felt.pressed.iter().copied().unzip();
            state.u32s(&mut taxels);
            values.resize(taxels.len(), 0.0);
            state.f64s(&mut values);
            felt.pressed = taxels.into_iter().zip(values).collect();
            state.f64(&mut felt.time_s);
            state.u64(&mut felt.number);
        }
        self.line.exchange(state)
    }
}

impl Wire {
    /// The wire that `made` says, with the readout of `chain`.
    fn of(py: Python<'_>, made: Made, chain: &Chain) -> PyResult<Self> {
        let config = made.config();
        let (seed, session) = (made.seed.cast_unsigned(), made.session.cast_unsigned());
        let line = py.detach(|| {
            let specimen = |k: usize| match k {
                0 => Streams::new(seed),
                // specimens of one wire differ
                _ => Streams::new(seed).child("wire/skin", k as u64),
            };
            let skins = made.skins.iter().enumerate().map(|(k, part)| {
                let session = SkinSession::new(&config, &part.layout, specimen(k), session);
                session.map(|session| (session, part.places.clone()))
            });
            Line::over(skins.collect::<Result<_, _>>()?, chain, session)
        });
        let felt = made.skins.iter().map(|_| Felt { pressed: Vec::new(), time_s: 0.0, number: 0 });
        Ok(Self {
            state: Mutex::new(State { line: line.map_err(refuse)?, skins: felt.collect() }),
            shape: (made.skin.rows(), made.skin.cols()),
            sample_rate: chain.sample_rate_hz(),
            made,
        })
    }

    fn locked(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// One touch a skin.
    fn touches(&self, touch: &Bound<'_, PyAny>, dt: Option<f64>) -> PyResult<Vec<Option<Py<Touch>>>> {
        if let Some(dt) = dt.filter(|dt| !(0.0..=1e9).contains(dt)) {
            bail!("`dt` = {dt} is outside [0, 1e9] s");
        }
        if !self.made.several {
            return Ok(vec![Some(self.touch(0, touch, dt)?)]);
        }
        let skins = self.made.skins.len();
        let Ok(given) = touch.cast::<PySequence>() else {
            bail!(
                "`touch` is a {}; this wire is over {skins} skins: a sequence of a touch a skin, or None",
                kind(touch)
            );
        };
        if given.len()? != skins {
            bail!("`touch` has {} entries; this wire is over {skins} skins: a touch a skin, or None", given.len()?);
        }
        let one = |(k, touch): (usize, PyResult<Bound<'_, PyAny>>)| {
            let touch = touch?;
            if touch.is_none() { Ok(None) } else { self.touch(k, &touch, dt).map(Some) }
        };
        given.try_iter()?.enumerate().map(one).collect()
    }

    /// A touch of skin number `skin`, which may be an array of pressures that has been there for `dt` s.
    fn touch(&self, skin: usize, touch: &Bound<'_, PyAny>, dt: Option<f64>) -> PyResult<Py<Touch>> {
        let name = if self.made.several { format!("touch[{skin}]") } else { "touch".to_owned() };
        if let Ok(touch) = touch.cast::<Touch>() {
            if dt.is_some() {
                bail!("`dt` is for arrays; `{name}` has its own time");
            }
            return Ok(touch.clone().unbind());
        }
        let part = &self.made.skins[skin];
        let is_array =
            touch.hasattr("__array__")? || touch.is_instance_of::<PyList>() || touch.is_instance_of::<PyTuple>();
        if !is_array {
            let of = if self.made.several {
                format!(" of skin {skin}, an array, or None")
            } else {
                " or an array".to_owned()
            };
            bail!("`{name}` is a {}; valid: a touch{of}", kind(touch));
        }
        if part.taxels.is_some() {
            bail!(
                "`{name}`: an array is for a wire with all taxels of its skin; `spts.Touch.from_array` makes a touch of it"
            );
        }
        let pressure = pressure_of(&name, touch, [part.layout.rows(), part.layout.cols()])?;
        let now = {
            let state = self.locked();
            let last = &state.skins[skin];
            [last.time_s + dt.unwrap_or(HELD_S), last.number as f64 + 1.0]
        };
        let made = Touch::of_pressure(&pressure, part.layout.cell_area_m2(), now, part.id.cast_unsigned());
        Py::new(touch.py(), made)
    }

    /// Brings the transducer to the time of `touches`, one a skin. None is felt when one is refused.
    fn felt(&self, state: &mut State, touches: &[Option<Py<Touch>>]) -> PyResult<()> {
        let mut news = Vec::with_capacity(touches.len());
        let parts = self.made.skins.iter().zip(&state.skins);
        for (k, ((part, last), touch)) in parts.zip(touches).enumerate() {
            let Some(touch) = touch.as_ref().map(Py::get) else {
                news.push(None);
                continue;
            };
            let name = if self.made.several { format!("`touch[{k}]`") } else { "`touch`".to_owned() };
            if touch.skin.cast_signed() != part.id {
                let skin = if self.made.several { format!("skin {k} of this wire") } else { "this wire".to_owned() };
                bail!("{name} is of another skin than {skin}");
            }
            let dt_s = touch.time - last.time_s;
            if dt_s < 0.0 || touch.number < last.number {
                bail!(
                    "{name} is of {} s; this wire has felt one of {} s: time does not run back",
                    touch.time,
                    last.time_s
                );
            }
            let pressed = part.pressed(touch);
            if touch.number > last.number {
                news.push(Some((pressed, dt_s, touch)));
            } else if dt_s > 0.0 || pressed != last.pressed {
                bail!(
                    "{name} is of a copy of the skin: this wire has felt another touch of the number {}",
                    touch.number
                );
            } else {
                news.push(None);
            }
        }
        let each = news.iter().map(|new| new.as_ref().map(|(pressed, dt_s, _)| (&pressed[..], *dt_s)));
        let each: Vec<_> = each.collect();
        if each.iter().any(Option::is_some) {
            state.line.feel_touched(&each).map_err(refuse)?;
        }
        for (last, new) in state.skins.iter_mut().zip(news) {
            if let Some((pressed, _, touch)) = new {
                *last = Felt { pressed, time_s: touch.time, number: touch.number };
            }
        }
        Ok(())
    }
}

/// What a value is, for messages.
fn kind(value: &Bound<'_, PyAny>) -> String {
    value.get_type().name().map_or_else(|_| "value".to_owned(), |name| name.to_string())
}

/// The skins, and whether they were given as a sequence.
fn skins<'py>(skin: &Bound<'py, PyAny>) -> PyResult<(bool, Vec<Bound<'py, Skin>>)> {
    if let Ok(skin) = skin.cast::<Skin>() {
        return Ok((false, vec![skin.clone()]));
    }
    let needed = || refuse(format!("`skin` is a {}; valid: a skin, or a sequence of skins", kind(skin)));
    let given = skin.cast::<PySequence>().map_err(|_| needed())?;
    let mut skins: Vec<Bound<'py, Skin>> = Vec::new();
    for (k, skin) in given.try_iter()?.enumerate() {
        let skin = skin?;
        let Ok(skin) = skin.cast_into::<Skin>() else {
            bail!("`skin[{k}]` is no skin");
        };
        if skins.iter().any(|other| other.get().id() == skin.get().id()) {
            bail!("`skin[{k}]` is there twice, or a copy of another: copies are one specimen");
        }
        skins.push(skin);
    }
    if skins.is_empty() {
        bail!("`skin` is empty: one skin at least is needed");
    }
    Ok((true, skins))
}

/// The layout of a wire over `skins`, all of them or `taxels`, and what it has of each skin.
fn parts(several: bool, skins: &[Bound<'_, Skin>], taxels: Option<Vec<usize>>) -> PyResult<(SkinLayout, Vec<Part>)> {
    let layouts: Vec<SkinLayout> = skins.iter().map(|skin| skin.get().layout()).collect();
    let id = |k: usize| skins[k].get().id().cast_signed();
    if !several && taxels.is_none() {
        let places = (0..).take(layouts[0].taxels()).collect();
        return Ok((layouts[0], vec![Part { id: id(0), taxels: None, places, layout: layouts[0] }]));
    }
    // the skin of every taxel, and its number there
    let all: Vec<(usize, usize)> =
        layouts.iter().enumerate().flat_map(|(k, layout)| (0..layout.taxels()).map(move |taxel| (k, taxel))).collect();
    let mut seen = vec![false; all.len()];
    let mut on_wire = vec![(Vec::new(), Vec::new()); skins.len()];
    for (place, taxel) in taxels.unwrap_or_else(|| (0..all.len()).collect()).into_iter().enumerate() {
        match seen.get_mut(taxel) {
            None => bail!("`taxels[{place}]` = {taxel} is outside [0, {}]", all.len() - 1),
            Some(seen) if *seen => bail!("`taxels[{place}]` = {taxel} is there twice"),
            Some(seen) => *seen = true,
        }
        let (skin, taxel) = all[taxel];
        let (taxels, places) = &mut on_wire[skin];
        taxels.push((whole("taxels", taxel as i128)?, whole("taxels", taxels.len() as i128)?));
        places.push(whole("taxels", place as i128)?);
    }
    let mut parts = Vec::with_capacity(skins.len());
    for (k, (mut taxels, places)) in on_wire.into_iter().enumerate() {
        taxels.sort_unstable();
        if several && taxels.is_empty() {
            bail!("`taxels` has none of skin {k}: leave it out of `skin`");
        }
        let whole = &layouts[k];
        let layout = SkinLayout::new(1, taxels.len(), whole.pitch_m(), whole.electrode_m()).map_err(refuse)?;
        parts.push(Part { id: id(k), taxels: Some(taxels), places, layout });
    }
    Ok((joined(&parts)?, parts))
}

/// The layout of a wire with these taxels: a row of them. Its electrodes are as large as theirs on average.
fn joined(parts: &[Part]) -> PyResult<SkinLayout> {
    let total: usize = parts.iter().map(|part| part.layout.taxels()).sum();
    let mean = |of: fn(&SkinLayout) -> f64| {
        let first = of(&parts[0].layout);
        if parts.iter().all(|part| of(&part.layout).to_bits() == first.to_bits()) {
            return first;
        }
        let sum: f64 = parts.iter().map(|part| part.layout.taxels() as f64 * of(&part.layout).powi(2)).sum();
        (sum / total as f64).sqrt()
    };
    let (pitch_m, electrode_m) = (mean(SkinLayout::pitch_m), mean(SkinLayout::electrode_m));
    SkinLayout::new(1, total, pitch_m, electrode_m.min(pitch_m)).map_err(refuse)
}

/// The rows that are asked for in place of the profile's.
pub(crate) fn rows_of(
    seeds: Option<Bound<'_, PyAny>>,
    levels: Option<&str>,
    given: Option<Bound<'_, PyAny>>,
) -> PyResult<RowsConfig> {
    if seeds.is_some() && given.is_some() {
        bail!("`seeds` and `rows`: only one of them may be given");
    }
    let mut rows = RowsConfig::default();
    match given {
        None => {}
        Some(given) => match given.extract::<String>() {
            Ok(file) => rows.patterns_file = Some(file),
            Err(_) => rows.patterns = Some(patterns(&given)?),
        },
    }
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

/// The pattern whose rows are those of an array of levels.
fn patterns(given: &Bound<'_, PyAny>) -> PyResult<Patterns> {
    let Ok(levels) = given.extract::<PyArrayLike2<'_, f64, AllowTypeChange>>() else {
        bail!("`rows`: an array (R, taxels) of levels, or a file of rows, is needed");
    };
    let levels = levels.as_array();
    let (count, taxels) = levels.dim();
    if count == 0 || taxels == 0 {
        bail!("`rows` has shape ({count}, {taxels}); (R, taxels) with R > 0 is needed");
    }
    let values: Vec<f64> = levels.iter().copied().collect();
    let found = Patterns::of_levels(count, &values).map_err(refuse)?;
    for (row, levels) in (0_u64..).zip(values.chunks_exact(taxels)) {
        for (taxel, (level, code)) in levels.iter().zip(found.row(row)).enumerate() {
            let nearest = WeightMode::Analog.code_level(*code);
            let off = (level - nearest).abs();
            if off.is_nan() || off > LEVEL {
                bail!("`rows[{row}, {taxel}]` = {level} is no level; the nearest is {nearest:.6}, of the code {code}");
            }
        }
    }
    Ok(found)
}
