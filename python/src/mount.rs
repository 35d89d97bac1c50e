//! A skin on a link of somebody's MuJoCo model, by the arrays of its data.

use crate::args::Array1;
use crate::body::Body;
use crate::common::refuse;
use crate::skin::{Placed, Skin, Touch};
use numpy::{PyArray1, PyArray2, PyArrayMethods as _, PyReadonlyArray2, PyUntypedArrayMethods as _};
use pyo3::prelude::*;
use spts::contact::Wrench;
use std::sync::{Mutex, PoisonError};

type Vector = [f64; 3];
type Rotation = [Vector; 3];
/// Force and torque on bodies, by their numbers.
type Loads = Vec<(usize, [f64; 6])>;

/// A skin on a link, and the bodies that may touch it. It reads and writes the arrays of an `mjData`, whatever MuJoCo
/// they come from.
#[pyclass(frozen, module = "spts._spts")]
pub(crate) struct Mount {
    skin: Py<Skin>,
    link: usize,
    /// Origin of the skin's frame in the link's, m, and how it is turned there.
    place: (Vector, Rotation),
    bodies: Vec<usize>,
    shapes: Vec<Py<Body>>,
    /// Root of the tree of every body.
    roots: Vec<usize>,
    arrays: Arrays,
    /// Rows of `xfrc_applied` as they were before `apply`.
    before: Mutex<Vec<(usize, [f64; 6])>>,
}

/// Arrays of `mjData`, which stay where they are as long as it lives.
#[derive(FromPyObject)]
struct Arrays {
    xpos: Py<PyArray2<f64>>,
    xmat: Py<PyArray2<f64>>,
    xipos: Py<PyArray2<f64>>,
    cvel: Py<PyArray2<f64>>,
    subtree_com: Py<PyArray2<f64>>,
    xfrc_applied: Py<PyArray2<f64>>,
}

#[pymethods]
impl Mount {
    /// `frame` is the skin's in the link's: origin, m, then the rotation matrix by rows. `bodies` are numbers of bodies
    /// of the model and their shapes; `roots` the root of every body's tree.
    #[new]
    fn new(
        py: Python<'_>,
        skin: Py<Skin>,
        link: usize,
        frame: [f64; 12],
        bodies: Vec<(usize, Py<Body>)>,
        roots: Vec<usize>,
        data: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let arrays: Arrays = data.extract()?;
        let count = roots.len();
        let body_arrays =
            [&arrays.xpos, &arrays.xmat, &arrays.xipos, &arrays.cvel, &arrays.subtree_com, &arrays.xfrc_applied];
        let fits = body_arrays.iter().zip([3, 9, 3, 6, 3, 6]).all(|(a, cols)| a.bind(py).shape() == [count, cols]);
        let numbers = bodies.iter().map(|(body, _)| *body).chain([link]).chain(roots.iter().copied());
        if !fits || numbers.max().is_some_and(|most| most >= count) {
            bail!("`data` is not of this model");
        }
        let (bodies, shapes) = bodies.into_iter().unzip();
        let [x, y, z, turn @ ..] = frame;
        let place = ([x, y, z], std::array::from_fn(|i| std::array::from_fn(|j| turn[3 * i + j])));
        Ok(Self { skin, link, place, bodies, shapes, roots, arrays, before: Mutex::default() })
    }

    /// Lets the bodies touch the skin, `dt` s after the last time, and adds the wrenches to `xfrc_applied`: on every
    /// body, and the opposite on the skin's link.
    fn apply(&self, py: Python<'_>, dt: f64) -> PyResult<Touch> {
        let (touch, loads) = self.felt(py, dt)?;
        let mut before = self.before.lock().unwrap_or_else(PoisonError::into_inner);
        before.clear();
        let mut applied = self.arrays.xfrc_applied.bind(py).try_readwrite().map_err(refuse)?;
        let mut applied = applied.as_array_mut();
        for (body, load) in loads {
            let mut row = applied.row_mut(body);
            before.push((body, std::array::from_fn(|k| row[k])));
            row.iter_mut().zip(load).for_each(|(sum, v)| *sum += v);
        }
        Ok(touch)
    }

    /// Lets the bodies touch the skin, `dt` s after the last time; the touch, and for every body and the skin's link
    /// its number, and force and torque about its centre of mass in the world's frame (6,).
    fn loads<'py>(&self, py: Python<'py>, dt: f64) -> PyResult<(Touch, Vec<(usize, Array1<'py>)>)> {
        let (touch, loads) = self.felt(py, dt)?;
        let loads = loads.into_iter().map(|(body, load)| (body, PyArray1::from_slice(py, &load)));
        Ok((touch, loads.collect()))
    }

    /// What the skin feels, `dt` s after the last time, of bodies that the engine's contact carries. A load has the
    /// number of its body in the model; its normal force, N; where that acts; and force and torque on the body about
    /// its origin, all in the world's frame.
    fn read(&self, py: Python<'_>, dt: f64, loads: Vec<(usize, f64, Vector, Vector, Vector)>) -> PyResult<Touch> {
        let (placed, frame, origin) = self.placed(py)?;
        let mut known = Vec::with_capacity(loads.len());
        for (body, normal_n, centre, force, torque) in loads {
            let Some(at) = self.bodies.iter().position(|known| *known == body) else {
                bail!("body {body} is none of those that may touch the skin");
            };
            let wrench = Wrench { force_n: into(&frame, force), torque_nm: into(&frame, torque) };
            known.push((at, normal_n, into(&frame, minus(centre, origin)), wrench));
        }
        self.skin.get().carried(py, &self.shapes, &placed, dt, &known)
    }

    /// Puts the rows of `xfrc_applied` back to what they were before `apply`.
    fn restore(&self, py: Python<'_>) -> PyResult<()> {
        let mut before = self.before.lock().unwrap_or_else(PoisonError::into_inner);
        let mut applied = self.arrays.xfrc_applied.bind(py).try_readwrite().map_err(refuse)?;
        let mut applied = applied.as_array_mut();
        // the last first: a body may be there twice
        for (body, old) in before.drain(..).rev() {
            applied.row_mut(body).iter_mut().zip(old).for_each(|(v, old)| *v = old);
        }
        Ok(())
    }

    /// Stiffness and damping of the foam where it is touched, N/m and N s/m.
    #[getter]
    fn stiffness(&self) -> [f64; 2] {
        self.skin.get().stiffness()
    }
}

impl Mount {
    /// The touch, and the load on every body and on the link about its centre of mass, world's frame.
    fn felt(&self, py: Python<'_>, dt: f64) -> PyResult<(Touch, Loads)> {
        let (placed, frame, _) = self.placed(py)?;
        let (touch, wrenches) = self.skin.get().touched(py, &self.shapes, &placed, dt)?;
        let xipos = read(py, &self.arrays.xipos)?;
        let xpos = read(py, &self.arrays.xpos)?;
        let mut loads = Vec::with_capacity(self.bodies.len() + 1);
        let (link_com, mut reaction) = (row(&xipos, self.link), [0.0; 6]);
        for (body, wrench) in self.bodies.iter().zip(&wrenches) {
            let force = turned(&frame, wrench.force_n);
            let about_origin = turned(&frame, wrench.torque_nm);
            if !force.iter().chain(&about_origin).all(|v| v.is_finite()) {
                bail!("body {body} has a pose or velocity that is not finite");
            }
            let at = row(&xpos, *body);
            let about = |centre: Vector| plus(about_origin, cross(minus(at, centre), force));
            loads.push((*body, joined(force, about(row(&xipos, *body)))));
            let torque = about(link_com);
            for (sum, v) in reaction.iter_mut().zip(joined(force, torque)) {
                *sum -= v;
            }
        }
        loads.push((self.link, reaction));
        Ok((touch, loads))
    }

    /// The bodies in the skin's frame, and how that frame is turned and where it is in the world's.
    fn placed(&self, py: Python<'_>) -> PyResult<(Vec<Placed>, Rotation, Vector)> {
        let a = &self.arrays;
        let (xpos, xmat, cvel) = (read(py, &a.xpos)?, read(py, &a.xmat)?, read(py, &a.cvel)?);
        let centres = read(py, &a.subtree_com)?;
        let (carrier, (at, turn)) = (rotation(&xmat, self.link), self.place);
        let origin = plus(row(&xpos, self.link), turned(&carrier, at));
        let columns: [Vector; 3] = std::array::from_fn(|j| turned(&carrier, turn.map(|row| row[j])));
        let frame: Rotation = std::array::from_fn(|i| columns.map(|column| column[i]));
        // velocity of what moves with `body` at `at`: `cvel` is about the centre of mass of its tree, spin first
        let velocity = |body: usize, at: Vector| {
            let v: [f64; 6] = row(&cvel, body);
            let spin = [v[0], v[1], v[2]];
            let arm = minus(at, row(&centres, self.roots[body]));
            (plus([v[3], v[4], v[5]], cross(spin, arm)), spin)
        };
        let placed = self.bodies.iter().map(|&body| {
            let at = row(&xpos, body);
            let (linear, spin) = velocity(body, at);
            let (carried, turning) = velocity(self.link, at);
            let own = rotation(&xmat, body);
            Placed {
                position_m: into(&frame, minus(at, origin)),
                rotation: std::array::from_fn(|i| {
                    std::array::from_fn(|j| (0..3).map(|k| frame[k][i] * own[k][j]).sum())
                }),
                velocity_m_per_s: into(&frame, minus(linear, carried)),
                spin_rad_per_s: into(&frame, minus(spin, turning)),
            }
        });
        Ok((placed.collect(), frame, origin))
    }
}

fn read<'py>(py: Python<'py>, array: &Py<PyArray2<f64>>) -> PyResult<PyReadonlyArray2<'py, f64>> {
    array.bind(py).try_readonly().map_err(refuse)
}

fn row<const N: usize>(array: &PyReadonlyArray2<'_, f64>, index: usize) -> [f64; N] {
    let array = array.as_array();
    std::array::from_fn(|k| array[[index, k]])
}

fn rotation(array: &PyReadonlyArray2<'_, f64>, index: usize) -> Rotation {
    let flat: [f64; 9] = row(array, index);
    std::array::from_fn(|i| std::array::from_fn(|j| flat[3 * i + j]))
}

/// R v.
fn turned(r: &Rotation, v: Vector) -> Vector {
    r.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// Rᵀ v.
fn into(r: &Rotation, v: Vector) -> Vector {
    std::array::from_fn(|j| r[0][j] * v[0] + r[1][j] * v[1] + r[2][j] * v[2])
}

fn plus(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k] + b[k])
}

fn minus(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k] - b[k])
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn joined(a: Vector, b: Vector) -> [f64; 6] {
    [a[0], a[1], a[2], b[0], b[1], b[2]]
}
