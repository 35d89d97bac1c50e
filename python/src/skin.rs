//! Skins: how they are made, what can be asked of them, and touches: what they feel of bodies.

use crate::args::{Array1, Array2, PoseIn, checked_twist, one_of, triples, triples_out, whole};
use crate::body::Body;
use crate::common::{of_toml, refuse, to_toml};
use numpy::{AllowTypeChange, IntoPyArray as _, PyArray1, PyArray2, PyArrayLike1, PyArrayLike2, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use spts::contact::{Carried, Foam, PosedMesh, Support, SurfacePoints, TouchSkin, Winding, Wrench};
use spts::{PressureMap, SkinLayout};
use std::f64::consts::TAU;
use std::hash::{BuildHasher as _, RandomState};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// A tactile skin: taxels, and the foam on them.
///
/// Frame of a flat skin: origin in the middle of its surface, z outward, x along columns, and row 0 has the largest y.
/// A skin that is not flat has the frame of the points that it is made from.
///
/// Parameters
/// ----------
/// rows, cols : int
///     Taxels.
/// pitch : float
///     Distance between taxels, m.
/// electrode : float, optional
///     Side of a taxel's electrode, m; default two thirds of the pitch.
/// cells : int
///     Sample points along each side of a taxel, [1, 64].
/// stiffness : float, optional
///     Initial stiffness of the foam, Pa/m, [1e4, 1e9].
/// thickness : float, optional
///     Thickness of the foam, m.
/// damping : float, optional
///     Damping time of the foam, s, [0, 0.02].
/// friction : float, optional
///     Friction coefficient, [0, 5].
///
/// A copy (`copy.deepcopy`, `pickle`) is the same specimen at the same moment, and goes on apart: touching it changes
/// nothing of the original. A wire of one feels touches of the other, too, as long as their time does not run back.
#[pyclass(frozen, module = "spts")]
pub(crate) struct Skin {
    id: u64,
    state: Mutex<State>,
}

#[derive(Clone)]
struct State {
    skin: TouchSkin,
    touches: u64,
    time_s: f64,
}

/// Velocity of a body at rest.
const REST: ([f64; 3], [f64; 3]) = ([0.0; 3], [0.0; 3]);

#[pymethods]
impl Skin {
    #[new]
    #[pyo3(signature = (rows = 10, cols = 10, pitch = 0.015, *, electrode = None, cells = 6, stiffness = None, thickness = None, damping = None, friction = None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn new(
        rows: i128,
        cols: i128,
        pitch: f64,
        electrode: Option<f64>,
        cells: i128,
        stiffness: Option<f64>,
        thickness: Option<f64>,
        damping: Option<f64>,
        friction: Option<f64>,
    ) -> PyResult<Self> {
        let layout = SkinLayout::new(
            whole("rows", rows)?,
            whole("cols", cols)?,
            pitch,
            electrode.unwrap_or(SkinLayout::usual_electrode_m(pitch)),
        )
        .map_err(refuse)?;
        let default = Foam::default();
        let config = Foam {
            stiffness_pa_per_m: stiffness.unwrap_or(default.stiffness_pa_per_m),
            thickness_m: thickness.unwrap_or(default.thickness_m),
            damping_s: damping.unwrap_or(default.damping_s),
            friction: friction.unwrap_or(default.friction),
            cells_per_taxel: whole("cells", cells)?,
            ..default
        };
        Ok(Self::of(TouchSkin::flat(layout, config).map_err(refuse)?))
    }

    /// Skin of `rows` x `cols` taxels around an axis of a cylinder.
    ///
    /// Parameters
    /// ----------
    /// radius : float
    ///     Radius of the skin's free surface, m.
    /// rows, cols : int
    ///     Taxels along the axis and around it. Row 0 is the highest along the axis, columns run with the angle.
    /// axis : str
    ///     "x", "y" or "z". The angle is 0 along x and pi/2 along y for "z"; for "x" it is 0 along y, for "y" along z.
    /// arc : (float, float), optional
    ///     First and last angle, rad; default all around.
    /// span : (float, float)
    ///     Lowest and highest coordinate along the axis, m.
    /// centre : (float, float, float)
    ///     A point of the axis, m.
    /// points : int
    ///     Sample points along each side of a taxel, [1, 64].
    /// stiffness, thickness, damping, friction : float, optional
    ///     The foam's, as of a flat skin.
    #[staticmethod]
    #[pyo3(signature = (radius, rows, cols, *, span, axis = "z", arc = (0.0, TAU), centre = [0.0; 3], points = 2, stiffness = None, thickness = None, damping = None, friction = None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn cylinder(
        radius: f64,
        rows: i128,
        cols: i128,
        span: [f64; 2],
        axis: &str,
        arc: (f64, f64),
        centre: [f64; 3],
        points: i128,
        stiffness: Option<f64>,
        thickness: Option<f64>,
        damping: Option<f64>,
        friction: Option<f64>,
    ) -> PyResult<Self> {
        let winding = winding([rows, cols], points, axis, centre, arc, span)?;
        let points = SurfacePoints::on_cylinder(&winding, radius).map_err(refuse)?;
        Self::curved(points, winding.shape, surface(stiffness, thickness, damping, friction))
    }

    /// Skin of `rows` x `cols` taxels on a mesh: where rays towards an axis meet it first.
    ///
    /// Parameters
    /// ----------
    /// mesh : Body
    ///     The surface; its axes are the skin's frame.
    /// rows, cols : int
    ///     Taxels along the axis and around it, as of `Skin.cylinder`.
    /// axis, arc, centre, points, stiffness, thickness, damping, friction
    ///     As of `Skin.cylinder`.
    /// span : (float, float), optional
    ///     Lowest and highest coordinate along the axis, m; default the mesh's own.
    #[staticmethod]
    #[pyo3(signature = (mesh, rows, cols, *, span = None, axis = "z", arc = (0.0, TAU), centre = [0.0; 3], points = 2, stiffness = None, thickness = None, damping = None, friction = None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn wrap(
        py: Python<'_>,
        mesh: &Body,
        rows: i128,
        cols: i128,
        span: Option<[f64; 2]>,
        axis: &str,
        arc: (f64, f64),
        centre: [f64; 3],
        points: i128,
        stiffness: Option<f64>,
        thickness: Option<f64>,
        damping: Option<f64>,
        friction: Option<f64>,
    ) -> PyResult<Self> {
        let mut winding = winding([rows, cols], points, axis, centre, arc, span.unwrap_or_default())?;
        if span.is_none() {
            let (low, high) = mesh.body.mesh.bounds().unwrap_or_default();
            winding.span_m = [low[winding.axis], high[winding.axis]];
        }
        let points = py.detach(|| SurfacePoints::wrapped(&winding, &mesh.body.mesh)).map_err(refuse)?;
        Self::curved(points, winding.shape, surface(stiffness, thickness, damping, friction))
    }

    /// Puts bodies on the skin and takes all others off.
    ///
    /// Parameters
    /// ----------
    /// poses : dict of Body to pose
    ///     A pose is (position (3,) m, unit quaternion (4,) w x y z), in the skin's frame.
    /// twists : dict of Body to twist, optional
    ///     Velocity (6,): linear, of the body's origin, m/s, then angular, rad/s, in the skin's frame. A body without
    ///     one is at rest.
    /// dt : float
    ///     Time since the touch before, s.
    ///
    /// Returns
    /// -------
    /// Touch
    ///     Pressure, wrenches on the bodies and the area that is pressed.
    #[pyo3(signature = (poses, twists = None, dt = 0.0))]
    fn touch(
        &self,
        py: Python<'_>,
        poses: &Bound<'_, PyDict>,
        twists: Option<&Bound<'_, PyDict>>,
        dt: f64,
    ) -> PyResult<Touch> {
        let (mut keys, mut placed) = (Vec::with_capacity(poses.len()), Vec::with_capacity(poses.len()));
        for (key, pose) in poses {
            let body: Bound<'_, Body> = key.cast_into()?;
            let (position_m, rotation) = PoseIn::of(&pose)?.checked()?;
            let twist = twists.map(|twists| twists.get_item(&body)).transpose()?.flatten();
            let (velocity_m_per_s, spin_rad_per_s) = twist.map_or(Ok(REST), |twist| checked_twist(&twist))?;
            keys.push(body.unbind());
            placed.push(Placed { position_m, rotation, velocity_m_per_s, spin_rad_per_s });
        }
        if let Some(twists) = twists
            && let Some(stray) = twists.keys().iter().find(|body| !poses.contains(body).unwrap_or(false))
        {
            bail!("`twists` has {stray}, which has no pose");
        }
        self.touched(py, &keys.into(), &placed, dt)
    }

    /// Rows and columns of taxels.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        let layout = self.layout();
        (layout.rows(), layout.cols())
    }

    /// Middle of every taxel on the free surface, m, (taxels, 3).
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let centres = self.locked().skin.taxel_centres();
        triples_out(py, centres.into_iter().map(|(place, _)| place))
    }

    /// Outward normal of every taxel, of length 1, (taxels, 3).
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let centres = self.locked().skin.taxel_centres();
        triples_out(py, centres.into_iter().map(|(_, normal)| normal))
    }

    /// Area of every taxel, m², (taxels,).
    #[getter]
    fn areas<'py>(&self, py: Python<'py>) -> Array1<'py> {
        self.locked().skin.taxel_areas_m2().into_pyarray(py)
    }

    /// Time of the last touch, s.
    #[getter]
    fn time(&self) -> f64 {
        self.locked().time_s
    }

    /// Thickness of the foam, m.
    #[getter]
    fn thickness(&self) -> f64 {
        self.locked().skin.foam().thickness_m
    }

    /// Initial stiffness of the foam, Pa/m, and its friction coefficient.
    #[getter]
    pub(crate) fn foam(&self) -> (f64, f64) {
        let state = self.locked();
        let foam = state.skin.foam();
        (foam.stiffness_pa_per_m, foam.friction)
    }

    /// Damping time of the foam, s.
    #[getter]
    pub(crate) fn damping(&self) -> f64 {
        self.locked().skin.foam().damping_s
    }

    /// Whether `place` (3,), m, in the skin's frame, lies in the foam or within half a thickness of it.
    fn covers(&self, place: [f64; 3]) -> bool {
        self.locked().skin.covers(place, None)
    }

    /// Takes every body off and begins the time anew. A wire that has felt this skin stays behind: make a new one.
    fn reset(&self, py: Python<'_>) {
        py.detach(|| {
            let mut state = self.locked();
            state.skin.touch(&[], &mut Vec::new());
            state.touches += 1;
            state.time_s = 0.0;
        });
    }

    /// Skin of any shape from sample points.
    ///
    /// Parameters
    /// ----------
    /// positions : ndarray (P, 3)
    ///     Places on the free surface, m.
    /// normals : ndarray (P, 3)
    ///     Outward normals, of any length but 0.
    /// areas : ndarray (P,)
    ///     Area that each point stands for, m², (0, 1].
    /// taxels : ndarray (P,) of int, optional
    ///     The taxel of every point, row by row from 0; default every point is a taxel.
    /// rows, cols : int, optional
    ///     Shape of the images; default one row.
    /// stiffness, thickness, damping, friction : float, optional
    ///     The foam's, as of a flat skin.
    #[staticmethod]
    #[pyo3(signature = (positions, normals, areas, *, taxels = None, rows = None, cols = None, stiffness = None, thickness = None, damping = None, friction = None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn from_points(
        positions: PyArrayLike2<'_, f64, AllowTypeChange>,
        normals: PyArrayLike2<'_, f64, AllowTypeChange>,
        areas: PyArrayLike1<'_, f64, AllowTypeChange>,
        taxels: Option<PyArrayLike1<'_, i64, AllowTypeChange>>,
        rows: Option<i128>,
        cols: Option<i128>,
        stiffness: Option<f64>,
        thickness: Option<f64>,
        damping: Option<f64>,
        friction: Option<f64>,
    ) -> PyResult<Self> {
        let (positions, normals) = (triples("positions", &positions)?, triples("normals", &normals)?);
        let number = |k: i64| u32::try_from(k).map_err(|_| refuse(format!("`taxels` = {k} is outside [0, 2^32)")));
        let taxels: Vec<u32> = match taxels {
            Some(taxels) => taxels.as_array().iter().map(|k| number(*k)).collect::<PyResult<_>>()?,
            None => (0..positions.len() as i64).map(number).collect::<PyResult<_>>()?,
        };
        let points = SurfacePoints::new(positions, normals, areas.as_array().to_vec(), taxels).map_err(refuse)?;
        let taxels = points.taxels();
        let rows: Option<usize> = rows.map(|rows| whole("rows", rows)).transpose()?;
        let cols: Option<usize> = cols.map(|cols| whole("cols", cols)).transpose()?;
        let shape = match (rows, cols) {
            (Some(rows), Some(cols)) => [rows, cols],
            (Some(rows), None) => [rows, taxels / rows.max(1)],
            (None, cols) => {
                let cols = cols.unwrap_or(taxels);
                [taxels / cols.max(1), cols]
            }
        };
        Self::curved(points, shape, surface(stiffness, thickness, damping, friction))
    }

    fn __copy__(&self) -> Self {
        Self { id: self.id, state: Mutex::new(self.locked().clone()) }
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.__copy__()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, id) = (slf.py(), slf.get().id);
        let State { skin, touches, time_s } = slf.get().locked().clone();
        let points = skin.points().map(|points| {
            let normals = triples_out(py, points.normals().iter().copied())?;
            let places = triples_out(py, points.positions_m().iter().copied())?;
            let taxels = PyArray1::from_iter(py, points.taxel_of_points().iter().map(|k| i64::from(*k)));
            Ok::<_, PyErr>((places, normals, PyArray1::from_slice(py, points.areas_m2()), taxels))
        });
        let (layout, foam) = (to_toml(skin.layout())?, to_toml(skin.foam())?);
        let arguments = (layout, foam, points.transpose()?, id, touches, time_s).into_pyobject(py)?;
        Ok((slf.get_type().getattr("_restored")?, arguments))
    }

    /// The skin that was pickled.
    #[staticmethod]
    fn _restored(
        layout: &str,
        foam: &str,
        points: Option<Points<'_>>,
        id: u64,
        touches: u64,
        time_s: f64,
    ) -> PyResult<Self> {
        let (layout, foam) = (of_toml(layout)?, of_toml(foam)?);
        let skin = match points {
            None => TouchSkin::flat(layout, foam),
            Some((places, normals, areas, taxels)) => {
                let (places, normals) = (triples("positions", &places)?, triples("normals", &normals)?);
                let taxels =
                    taxels.as_array().iter().map(|k| u32::try_from(*k).map_err(refuse)).collect::<PyResult<_>>()?;
                SurfacePoints::new(places, normals.clone(), areas.as_array().to_vec(), taxels)
                    .and_then(|points| points.with_unit_normals(normals))
                    .and_then(|points| TouchSkin::curved(layout, points, foam))
            }
        };
        Ok(Self { id, state: Mutex::new(State { skin: skin.map_err(refuse)?, touches, time_s }) })
    }

    fn __repr__(&self) -> String {
        let (rows, cols) = self.shape();
        format!("<spts.Skin of {rows} x {cols} taxels>")
    }
}

/// Sample points of a skin that was pickled: places, normals, areas and taxels.
type Points<'py> = (
    PyArrayLike2<'py, f64, AllowTypeChange>,
    PyArrayLike2<'py, f64, AllowTypeChange>,
    PyArrayLike1<'py, f64, AllowTypeChange>,
    PyArrayLike1<'py, i64, AllowTypeChange>,
);

/// What tells skins apart, those of other processes too: a copy has the number of its original.
fn new_id() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    // keys are random, but a forked process has those of its parent
    RandomState::new().hash_one((std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed)))
}

impl Skin {
    /// Puts `bodies` on the skin.
    fn touched(&self, py: Python<'_>, bodies: &Arc<[Py<Body>]>, placed: &[Placed], dt: f64) -> PyResult<Touch> {
        let pairs: Vec<_> = bodies.iter().map(Py::get).zip(placed).collect();
        self.felt(py, bodies, dt, |skin| {
            let posed: Vec<_> = pairs.iter().map(|(body, placed)| (&body.body, placed.of(body))).collect();
            let mut wrenches = Vec::with_capacity(posed.len());
            skin.touch(&posed, &mut wrenches);
            wrenches.into_iter().enumerate().collect()
        })
    }

    /// What the skin feels of loads by those of `bodies` that something else carries.
    pub(crate) fn carried(&self, py: Python<'_>, bodies: &Arc<[Py<Body>]>, dt: f64, loads: &[Load]) -> PyResult<Touch> {
        let pressing: Vec<_> = loads.iter().map(|load| bodies[load.body].get()).collect();
        self.felt(py, bodies, dt, |skin| {
            let carried = loads.iter().zip(pressing).map(|(load, body)| {
                let (lining_m, lining_pa_per_m) = load.lining;
                let mut posed = load.placed.of(body);
                posed.stiffness_pa_per_m = in_series(posed.stiffness_pa_per_m, lining_pa_per_m);
                let (normal_n, centre_m, along) = (load.normal_n, load.centre_m, load.along);
                Carried { body: &body.body, posed, normal_n, centre_m, along, lining_m }
            });
            skin.read(&carried.collect::<Vec<_>>());
            let mut wrenches: Vec<(usize, Wrench)> = Vec::with_capacity(loads.len());
            for load in loads {
                match wrenches.iter_mut().find(|(body, _)| *body == load.body) {
                    Some((_, sum)) => {
                        let (forces, torques) = (sum.force_n.iter_mut(), sum.torque_nm.iter_mut());
                        let more = load.wrench.force_n.into_iter().chain(load.wrench.torque_nm);
                        forces.chain(torques).zip(more).for_each(|(sum, v)| *sum += v);
                    }
                    None => wrenches.push((load.body, load.wrench)),
                }
            }
            wrenches
        })
    }

    /// Springs that stand for the foam under a body for a step of `step_s`, with what it wears: how thick, m, and how
    /// stiff, Pa/m. The foam's force at the velocity of `placed`, N; `None` if the body is nowhere near.
    pub(crate) fn supports(
        &self,
        py: Python<'_>,
        body: &Body,
        placed: &Placed,
        (lining_m, lining_pa_per_m): (f64, f64),
        step_s: f64,
        out: &mut Vec<Support>,
    ) -> Option<f64> {
        py.detach(|| {
            let mut posed = placed.of(body);
            posed.stiffness_pa_per_m = in_series(posed.stiffness_pa_per_m, lining_pa_per_m);
            self.locked().skin.supports(&body.body, &posed, lining_m, step_s, out)
        })
    }

    /// What the skin feels after `act`, which returns the wrenches on those of `bodies` that have one.
    fn felt(
        &self,
        py: Python<'_>,
        bodies: &Arc<[Py<Body>]>,
        dt: f64,
        act: impl FnOnce(&mut TouchSkin) -> Vec<(usize, Wrench)> + Send,
    ) -> PyResult<Touch> {
        if !(0.0..=1e9).contains(&dt) {
            bail!("`dt` = {dt} is outside [0, 1e9] s");
        }
        let (wrenches, felt, [area, time], (number, bottomed)) = py.detach(|| {
            let mut state = self.locked();
            let wrenches = act(&mut state.skin);
            state.touches += 1;
            state.time_s += dt;
            let [means, electrodes] = [state.skin.pressure(), state.skin.electrode_pressure()];
            #[expect(clippy::cast_possible_truncation, reason = "a layout has fewer than 2^32 taxels")]
            let of = |k: &usize| (*k as u32, [means.values()[*k], electrodes.values()[*k]]);
            let felt =
                Pressures { shape: [means.rows(), means.cols()], pa: state.skin.touched().iter().map(of).collect() };
            let scalars = [state.skin.touched_m2(), state.time_s];
            (wrenches, felt, scalars, (state.touches, state.skin.bottomed()))
        });
        Ok(Touch {
            pressure: OnceLock::new(),
            wrenches: OnceLock::new(),
            loads: Arc::new((bodies.clone(), wrenches)),
            // an empty sum is -0
            area: area + 0.0,
            time,
            number,
            bottomed,
            felt: Arc::new(felt),
            skin: self.id,
        })
    }

    /// What the skin feels `dt` s after `last`, in which nothing touched it, if nothing has since.
    pub(crate) fn idle(&self, py: Python<'_>, dt: f64, last: &Touch) -> Option<Touch> {
        let mut state = self.locked();
        if last.area > 0.0 || (last.skin, last.number) != (self.id, state.touches) {
            return None;
        }
        state.touches += 1;
        state.time_s += dt;
        Some(Touch {
            pressure: last.pressure.get().map_or_else(OnceLock::new, |known| known.clone_ref(py).into()),
            wrenches: OnceLock::new(),
            loads: last.loads.clone(),
            time: state.time_s,
            number: state.touches,
            felt: last.felt.clone(),
            ..*last
        })
    }

    /// Whether the foam has a place where a body is pushed along a direction.
    pub(crate) fn pushes(&self, place_m: [f64; 3], along: [f64; 3]) -> bool {
        self.locked().skin.covers(place_m, Some(along))
    }

    fn of(skin: TouchSkin) -> Self {
        Self { id: new_id(), state: Mutex::new(State { skin, touches: 0, time_s: 0.0 }) }
    }

    /// Skin at `points`; a taxel's electrode has the usual share of a square of their mean area.
    fn curved(points: SurfacePoints, [rows, cols]: [usize; 2], config: Foam) -> PyResult<Self> {
        let mean_area_m2 = points.taxel_areas_m2().iter().sum::<f64>() / points.taxels() as f64;
        let layout = SkinLayout::with_pitch(rows, cols, mean_area_m2.sqrt()).map_err(refuse)?;
        Ok(Self::of(TouchSkin::curved(layout, points, config).map_err(refuse)?))
    }

    fn locked(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn layout(&self) -> SkinLayout {
        *self.locked().skin.layout()
    }

    pub(crate) fn id(&self) -> u64 {
        self.id
    }
}

/// All bodies, and the wrenches on those that have one, by their places in the list.
type Loads = (Arc<[Py<Body>]>, Vec<(usize, Wrench)>);

/// What the skin feels at one moment.
#[pyclass(frozen, module = "spts")]
pub(crate) struct Touch {
    /// The pressures as an array, once somebody has asked for it.
    pressure: OnceLock<Py<PyArray2<f64>>>,
    /// The wrenches, once somebody has asked for them.
    wrenches: OnceLock<Py<PyDict>>,
    loads: Arc<Loads>,
    /// Area that is pressed, m².
    #[pyo3(get)]
    pub(crate) area: f64,
    /// Time of the touch, s: the sum of every `dt` up to it.
    #[pyo3(get)]
    pub(crate) time: f64,
    /// Number of the touch, from 1.
    #[pyo3(get)]
    pub(crate) number: u64,
    /// Whether a body has gone through the foam, down to the link: the pressure there is no measured one.
    #[pyo3(get)]
    bottomed: bool,
    pub(crate) felt: Arc<Pressures>,
    /// Which skin.
    pub(crate) skin: u64,
}

/// The pressures of a skin.
pub(crate) struct Pressures {
    /// Rows and columns.
    shape: [usize; 2],
    /// Taxels that may have a pressure, in their order: number, and mean pressure over its area and its electrode, Pa.
    pa: Vec<(u32, [f64; 2])>,
}

impl Pressures {
    /// Pressures over areas and electrodes, row by row.
    fn of(shape: [usize; 2], means: &[f64], electrodes: &[f64]) -> Self {
        let all = (0..).zip(means.iter().zip(electrodes).map(|(p, electrode)| [*p, *electrode]));
        Self { shape, pa: all.filter(|(_, pa)| pa.iter().any(|p| *p != 0.0)).collect() }
    }

    /// Mean pressures over the areas of all taxels.
    fn means(&self) -> Vec<f64> {
        self.all(self.pa.iter().map(|(k, pa)| (*k, pa[0])))
    }

    /// Mean pressures over the electrodes of these taxels: what the transducer feels.
    pub(crate) fn electrodes(&self) -> impl Iterator<Item = (u32, f64)> {
        self.pa.iter().map(|(k, pa)| (*k, pa[1]))
    }

    fn all(&self, of: impl Iterator<Item = (u32, f64)>) -> Vec<f64> {
        let mut all = vec![0.0; self.shape[0] * self.shape[1]];
        of.for_each(|(k, pa)| all[k as usize] = pa);
        all
    }
}

impl Touch {
    /// The touch number `number` of a skin with taxels of `cell_m2`, under this pressure at the time `time`.
    pub(crate) fn of_pressure(pressure: &PressureMap, cell_m2: f64, [time, number]: [f64; 2], skin: u64) -> Self {
        let pressed = pressure.values().iter().filter(|p| **p > 0.0).count();
        let shape = [pressure.rows(), pressure.cols()];
        Self {
            pressure: OnceLock::new(),
            wrenches: OnceLock::new(),
            loads: Arc::new((Arc::from([]), Vec::new())),
            area: pressed as f64 * cell_m2,
            time,
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of touches")]
            number: number as u64,
            bottomed: false,
            felt: Arc::new(Pressures::of(shape, pressure.values(), pressure.values())),
            skin,
        }
    }
}

/// The pressure in an array of a skin of rows x cols taxels, which an error calls `name`.
pub(crate) fn pressure_of(name: &str, value: &Bound<'_, PyAny>, [rows, cols]: [usize; 2]) -> PyResult<PressureMap> {
    let Ok(array) = value.extract::<PyArrayLike2<'_, f64, AllowTypeChange>>() else {
        bail!("`{name}`: a touch or an array ({rows}, {cols}), Pa, is needed");
    };
    let array = array.as_array();
    if array.dim() != (rows, cols) {
        bail!("`{name}` has shape {:?}; ({rows}, {cols}) is needed", array.dim());
    }
    let values: Vec<f64> = array.iter().copied().collect();
    if let Some(at) = values.iter().position(|p| !(0.0..=1e9).contains(p)) {
        bail!("`{name}[{}, {}]` = {} is outside [0, 1e9] Pa", at / cols, at % cols, values[at]);
    }
    Ok(PressureMap::from_values(rows, cols, values))
}

#[pymethods]
impl Touch {
    /// A touch of which the pressure is known, of any origin: what `Wire.record` takes.
    ///
    /// The foam of the skin has no part in it, and there are no bodies. Taxels that electrodes cover in part are under
    /// the same pressure all over.
    ///
    /// Parameters
    /// ----------
    /// skin : Skin
    ///     Its time goes on by `dt`.
    /// pressure : ndarray (rows, cols)
    ///     Mean pressure over every taxel, Pa, [0, 1e9].
    /// dt : float
    ///     Time since the touch before, s, [0, 1e9].
    #[staticmethod]
    #[pyo3(signature = (skin, pressure, dt = 0.1))]
    fn from_array(skin: &Skin, pressure: &Bound<'_, PyAny>, dt: f64) -> PyResult<Self> {
        if !(0.0..=1e9).contains(&dt) {
            bail!("`dt` = {dt} is outside [0, 1e9] s");
        }
        let mut state = skin.locked();
        let layout = *state.skin.layout();
        let pressure = pressure_of("pressure", pressure, [layout.rows(), layout.cols()])?;
        state.touches += 1;
        state.time_s += dt;
        Ok(Self::of_pressure(&pressure, layout.cell_area_m2(), [state.time_s, state.touches as f64], skin.id))
    }

    /// Mean pressure over every taxel, Pa, (rows, cols).
    #[getter]
    fn pressure<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        if let Some(known) = self.pressure.get() {
            return Ok(known.bind(py).clone());
        }
        let found = self.felt.means().into_pyarray(py).reshape(self.felt.shape)?;
        Ok(self.pressure.get_or_init(|| found.unbind()).bind(py).clone())
    }

    /// Wrench on every body about its origin, in the skin's frame: (force (3,) N, torque (3,) N m).
    #[getter]
    fn wrenches<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        if let Some(known) = self.wrenches.get() {
            return Ok(known.bind(py).clone());
        }
        let (found, (bodies, wrenches)) = (PyDict::new(py), &*self.loads);
        for (k, key) in bodies.iter().enumerate() {
            let wrench = wrenches.iter().find(|(body, _)| *body == k).map_or(Wrench::NONE, |(_, wrench)| *wrench);
            let pair = [wrench.force_n, wrench.torque_nm].map(|v| PyArray1::from_slice(py, &v));
            found.set_item(key, PyTuple::new(py, pair)?)?;
        }
        Ok(self.wrenches.get_or_init(|| found.unbind()).bind(py).clone())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, touch) = (slf.py(), slf.get());
        let felt = touch.felt.all(touch.felt.electrodes()).into_pyarray(py);
        let scalars = (touch.area, touch.time, touch.number, touch.bottomed, touch.skin);
        let arguments = (touch.pressure(py)?, touch.wrenches(py)?, felt, scalars).into_pyobject(py)?;
        Ok((slf.get_type().getattr("_restored")?, arguments))
    }

    /// The touch that was pickled.
    #[staticmethod]
    fn _restored(
        pressure: Bound<'_, PyArray2<f64>>,
        wrenches: Bound<'_, PyDict>,
        felt: PyArrayLike1<'_, f64, AllowTypeChange>,
        scalars: (f64, f64, u64, bool, u64),
    ) -> PyResult<Self> {
        let (area, time, number, bottomed, skin) = scalars;
        let (felt, (rows, cols)) = (felt.as_array().to_vec(), pressure.readonly().as_array().dim());
        if felt.len() != rows * cols {
            bail!("a touch of {rows} x {cols} taxels with {} pressures", felt.len());
        }
        let means: Vec<f64> = pressure.readonly().as_array().iter().copied().collect();
        let felt = Arc::new(Pressures::of([rows, cols], &means, &felt));
        let (pressure, wrenches, loads) = (pressure.unbind().into(), wrenches.unbind().into(), Default::default());
        Ok(Self { pressure, wrenches, loads, area, time, number, bottomed, felt, skin })
    }
}

/// Where a body is and how it moves, in the skin's frame.
#[derive(Clone, Copy)]
pub(crate) struct Placed {
    pub(crate) position_m: [f64; 3],
    pub(crate) rotation: [[f64; 3]; 3],
    /// Velocity of its origin.
    pub(crate) velocity_m_per_s: [f64; 3],
    pub(crate) spin_rad_per_s: [f64; 3],
}

impl Placed {
    pub(crate) fn is_finite(&self) -> bool {
        let vectors = [self.position_m, self.velocity_m_per_s, self.spin_rad_per_s];
        self.rotation.iter().chain(&vectors).flatten().all(|v| v.is_finite())
    }

    fn of<'a>(&self, body: &'a Body) -> PosedMesh<'a> {
        PosedMesh {
            rotation: self.rotation,
            velocity_m_per_s: self.velocity_m_per_s,
            angular_velocity_rad_per_s: self.spin_rad_per_s,
            stiffness_pa_per_m: body.stiffness_pa_per_m,
            ..PosedMesh::at_rest(&body.body.mesh, self.position_m)
        }
    }
}

/// A load on a skin, in its frame.
pub(crate) struct Load {
    /// Place of the body in the list, and where it is.
    pub(crate) body: usize,
    pub(crate) placed: Placed,
    /// Normal force, N, and where it acts, m.
    pub(crate) normal_n: f64,
    pub(crate) centre_m: [f64; 3],
    /// On the body, about its origin.
    pub(crate) wrench: Wrench,
    pub(crate) along: Option<[f64; 3]>,
    /// Thickness, m, and stiffness, Pa/m, of the foam that the body wears.
    pub(crate) lining: (f64, f64),
}

/// Stiffness of two springs one behind the other.
fn in_series(a: f64, b: f64) -> f64 {
    1.0 / (1.0 / a + 1.0 / b)
}

/// The foam of a curved skin; what is not given is the default.
fn surface(stiffness: Option<f64>, thickness: Option<f64>, damping: Option<f64>, friction: Option<f64>) -> Foam {
    let default = Foam::default();
    Foam {
        stiffness_pa_per_m: stiffness.unwrap_or(default.stiffness_pa_per_m),
        thickness_m: thickness.unwrap_or(default.thickness_m),
        damping_s: damping.unwrap_or(default.damping_s),
        friction: friction.unwrap_or(default.friction),
        ..default
    }
}

/// How the taxels of a skin wind around an axis.
fn winding(
    [rows, cols]: [i128; 2],
    points: i128,
    axis: &str,
    centre_m: [f64; 3],
    arc: (f64, f64),
    span_m: [f64; 2],
) -> PyResult<Winding> {
    Ok(Winding {
        shape: [whole("rows", rows)?, whole("cols", cols)?],
        points_per_side: whole("points", points)?,
        axis: one_of("axis", axis, &[("x", 0), ("y", 1), ("z", 2)])?,
        centre_m,
        arc_rad: [arc.0, arc.1],
        span_m,
    })
}
