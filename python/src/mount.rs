//! A skin on a link of somebody's MuJoCo model, by the arrays of its data.

use crate::args::Array2;
use crate::body::Body;
use crate::common::refuse;
use crate::skin::{Load, Placed, Skin, Touch};
use numpy::{IntoPyArray as _, PyArray2, PyArrayMethods as _, PyReadonlyArray2, PyUntypedArrayMethods as _};
use pyo3::prelude::*;
use spts::contact::{Support, Wrench};
use std::sync::{Mutex, PoisonError};

type Vector = [f64; 3];
type Rotation = [Vector; 3];

/// A skin on a link, and the bodies that may touch it. It reads the arrays of an `mjData`, whatever MuJoCo they come
/// from.
#[pyclass(frozen, module = "spts")]
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
    friction: Mutex<Friction>,
}

/// Arrays of `mjData`, which stay where they are as long as it lives.
#[derive(FromPyObject)]
struct Arrays {
    xpos: Py<PyArray2<f64>>,
    xmat: Py<PyArray2<f64>>,
    cvel: Py<PyArray2<f64>>,
    subtree_com: Py<PyArray2<f64>>,
}

/// What friction holds, and the supports of the present step.
#[derive(Default)]
struct Friction {
    held: Vec<Held>,
    supports: Vec<Sheared>,
}

/// Friction between the foam and one side of a body, as the force of its stretched surface.
#[derive(Clone, Copy)]
struct Held {
    body: usize,
    /// Direction in which that side is pushed.
    normal: Vector,
    /// Force on the body, N, in the skin's frame.
    shear_n: Vector,
    /// Moment about the normal, N m.
    torsion_nm: f64,
}

/// A support, with what friction holds there at first.
#[derive(Clone, Copy)]
struct Sheared {
    body: usize,
    support: Support,
    shear_n: Vector,
}

/// A load on a skin: number of the body; normal force, N, and where it acts; force and torque on the body about its
/// origin; and, in mode "foam", the direction of the normal force. All in the world's frame.
type LoadIn = (usize, f64, Vector, Vector, Vector, Option<Vector>);

/// What a body wears: its number, the thickness of its foam, m, and its stiffness, Pa/m.
type Lining = (usize, f64, f64);

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
        let body_arrays = [&arrays.xpos, &arrays.xmat, &arrays.cvel, &arrays.subtree_com];
        let fits = body_arrays.iter().zip([3, 9, 6, 3]).all(|(a, cols)| a.bind(py).shape() == [count, cols]);
        let numbers = bodies.iter().map(|(body, _)| *body).chain([link]).chain(roots.iter().copied());
        if !fits || numbers.max().is_some_and(|most| most >= count) {
            bail!("`data` is not of this model");
        }
        let (bodies, shapes) = bodies.into_iter().unzip();
        let [x, y, z, turn @ ..] = frame;
        let place = ([x, y, z], std::array::from_fn(|i| std::array::from_fn(|j| turn[3 * i + j])));
        Ok(Self { skin, link, place, bodies, shapes, roots, arrays, friction: Mutex::default() })
    }

    /// The foam under all bodies but those of `passed`, for a step of `step` s, as springs for the engine, about the
    /// velocities that the data has. `lined` are bodies that wear foam themselves.
    ///
    /// Returns an array (n, 16): place, m, frame by rows (normal on the body, and two tangents), force on a body that
    /// does not move, N, stiffness, N/m, and friction that is held along the tangents, N; then the body of every spring;
    /// and the normal force, N, of every body that is near.
    #[pyo3(signature = (step, passed = Vec::new(), lined = Vec::new()))]
    fn supports<'py>(
        &self,
        py: Python<'py>,
        step: f64,
        passed: Vec<usize>,
        lined: Vec<Lining>,
    ) -> PyResult<(Array2<'py>, Vec<usize>, Vec<(usize, f64)>)> {
        let (placed, frame, origin) = self.placed(py)?;
        let (mut supports, mut carried) = (Vec::new(), Vec::new());
        for ((body, shape), placed) in self.bodies.iter().zip(&self.shapes).zip(&placed) {
            if passed.contains(body) {
                continue;
            }
            if !placed.is_finite() {
                bail!("body {body} has a pose or velocity that is not finite");
            }
            let lining = lined.iter().find(|(lined, ..)| lined == body).map_or((0.0, f64::INFINITY), |l| (l.1, l.2));
            let mut found = Vec::new();
            if let Some(force_n) = self.skin.get().supports(py, shape.get(), placed, lining, step, &mut found) {
                carried.push((*body, force_n));
                supports.extend(found.into_iter().map(|support| Sheared { body: *body, support, shear_n: [0.0; 3] }));
            }
        }
        let mut friction = self.friction.lock().unwrap_or_else(PoisonError::into_inner);
        share(&friction.held, &mut supports);
        let mut rows = Vec::with_capacity(16 * supports.len());
        for s in &supports {
            let axes = tangents(s.support.normal);
            rows.extend(plus(origin, turned(&frame, s.support.place_m)));
            rows.extend(axes.map(|axis| turned(&frame, axis)).into_iter().flatten());
            rows.extend([s.support.force_n, s.support.stiffness_n_per_m]);
            rows.extend([dot(s.shear_n, axes[1]), dot(s.shear_n, axes[2])]);
        }
        let bodies = supports.iter().map(|s| s.body).collect();
        let rows = rows.into_pyarray(py).reshape([supports.len(), 16])?;
        friction.supports = supports;
        Ok((rows, bodies, carried))
    }

    /// Tells what the engine made of the supports: forces on the bodies (n, 3), N, along the rows of each one's frame.
    /// The surface of the foam stretches by its share of them in a step of `step` s.
    fn hold(&self, step: f64, forces: PyReadonlyArray2<'_, f64>) -> PyResult<()> {
        let mut state = self.friction.lock().unwrap_or_else(PoisonError::into_inner);
        let forces = forces.as_array();
        if forces.shape() != [state.supports.len(), 3] {
            bail!("`forces` has shape {:?}; ({}, 3) is needed", forces.shape(), state.supports.len());
        }
        let (damping, (_, friction)) = (self.skin.get().damping(), self.skin.get().foam());
        let stretch = if step > 0.0 { step / (step + damping) } else { 0.0 };
        let supports = std::mem::take(&mut state.supports);
        let mut held: Vec<Held> = Vec::new();
        for side in supports.iter().zip(forces.rows()).collect::<Vec<_>>().chunk_by(|(a, _), (b, _)| together(a, b)) {
            let middle = middle(side.iter().map(|(s, _)| s.support.place_m));
            let (body, normal) = (side[0].0.body, side[0].0.support.normal);
            let mut sum = Held { body, normal, shear_n: [0.0; 3], torsion_nm: 0.0 };
            for (s, force) in side {
                let [_, x, y] = tangents(normal);
                let now = plus(scaled(x, force[1]), scaled(y, force[2]));
                let mut shear = plus(s.shear_n, scaled(minus(now, s.shear_n), stretch));
                let (most, length) = (friction * force[0].max(0.0), dot(shear, shear).sqrt());
                if length > most {
                    shear = scaled(shear, most / length);
                }
                sum.shear_n = plus(sum.shear_n, shear);
                sum.torsion_nm += dot(normal, cross(minus(s.support.place_m, middle), shear));
            }
            held.push(sum);
        }
        state.held = held;
        Ok(())
    }

    /// Forgets what friction holds.
    fn release(&self) {
        *self.friction.lock().unwrap_or_else(PoisonError::into_inner) = Friction::default();
    }

    /// What the skin feels, `dt` s after the last time, of `loads` that the engine's contacts are. `lined` are bodies
    /// that wear foam themselves.
    #[pyo3(signature = (dt, loads, lined = Vec::new()))]
    fn read(&self, py: Python<'_>, dt: f64, loads: Vec<LoadIn>, lined: Vec<Lining>) -> PyResult<Touch> {
        let (placed, frame, origin) = self.placed(py)?;
        let mut known = Vec::with_capacity(loads.len());
        for (body, normal_n, centre, force, torque, along) in loads {
            let Some(at) = self.bodies.iter().position(|known| *known == body) else {
                bail!("body {body} is none of those that may touch the skin");
            };
            let lining = lined.iter().find(|(lined, ..)| *lined == body).map_or((0.0, f64::INFINITY), |l| (l.1, l.2));
            known.push(Load {
                body: at,
                normal_n,
                centre_m: into(&frame, minus(centre, origin)),
                wrench: Wrench { force_n: into(&frame, force), torque_nm: into(&frame, torque) },
                along: along.map(|along| into(&frame, along)),
                lining,
            });
        }
        self.skin.get().carried(py, &self.shapes, &placed, dt, &known)
    }
}

/// Whether two supports are of the same side of a body.
fn together(a: &Sheared, b: &Sheared) -> bool {
    a.body == b.body && a.support.normal == b.support.normal
}

/// Shares what friction holds among `supports`: of each side, as their normal forces have it.
fn share(held: &[Held], supports: &mut [Sheared]) {
    let mut left = held.to_vec();
    for side in supports.chunk_by_mut(|a, b| together(a, b)) {
        let (body, normal) = (side[0].body, side[0].support.normal);
        let near = |h: &Held| h.body == body && dot(h.normal, normal) > 0.7;
        let best = left.iter().enumerate().filter(|(_, h)| near(h));
        let best = best.max_by(|(_, a), (_, b)| dot(a.normal, normal).total_cmp(&dot(b.normal, normal)));
        let Some(held) = best.map(|(k, _)| k).map(|k| left.swap_remove(k)) else { continue };
        let sum: f64 = side.iter().map(|s| s.support.force_n.max(0.0)).sum();
        if sum <= 0.0 {
            continue;
        }
        let weight = |s: &Sheared| s.support.force_n.max(0.0) / sum;
        let middle = side.iter().fold([0.0; 3], |at, s| plus(at, scaled(s.support.place_m, weight(s))));
        let arm = |s: &Sheared| minus(s.support.place_m, middle);
        let polar: f64 = side.iter().map(|s| weight(s) * dot(arm(s), arm(s))).sum();
        // along the plane that the side has now
        let shear = minus(held.shear_n, scaled(normal, dot(held.shear_n, normal)));
        for s in side {
            let around = if polar > 0.0 { held.torsion_nm / polar } else { 0.0 };
            s.shear_n = scaled(plus(shear, scaled(cross(normal, arm(s)), around)), weight(s));
        }
    }
}

fn middle(places: impl ExactSizeIterator<Item = Vector>) -> Vector {
    let count = places.len() as f64;
    scaled(places.fold([0.0; 3], plus), 1.0 / count)
}

/// `normal` and two axes across it, of length 1.
fn tangents(normal: Vector) -> Rotation {
    let axis = if normal[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let x = minus(axis, scaled(normal, dot(axis, normal)));
    let x = scaled(x, 1.0 / dot(x, x).sqrt());
    [normal, x, cross(normal, x)]
}

impl Mount {
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

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn scaled(a: Vector, by: f64) -> Vector {
    a.map(|v| v * by)
}
