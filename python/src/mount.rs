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
    /// Returns an array (n, 22): place, m; frame by rows (normal on the body, and two tangents); force on a body that does
    /// not move, N; stiffness, N/m; and, for up to four rows of its constraint each, D and aref + J v/step: MuJoCo's force
    /// D (aref − J a) then is that of `Support` and of friction that stretches the foam. Then the body of every spring,
    /// and the normal force, N, of every body that is near.
    #[pyo3(signature = (step, elliptic, passed = Vec::new(), lined = Vec::new()))]
    fn supports<'py>(
        &self,
        py: Python<'py>,
        step: f64,
        elliptic: bool,
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
        let (damping, (_, coefficient)) = (self.skin.get().damping(), self.skin.get().foam());
        let mut rows = Vec::with_capacity(22 * supports.len());
        for s in &supports {
            let (support, axes) = (&s.support, tangents(s.support.normal));
            rows.extend(plus(origin, turned(&frame, support.place_m)));
            rows.extend(axes.map(|axis| turned(&frame, axis)).into_iter().flatten());
            rows.extend([support.force_n, support.stiffness_n_per_m]);
            let inertia = support.stiffness_n_per_m * (step + damping) * step;
            let shear = [dot(s.shear_n, axes[1]), dot(s.shear_n, axes[2])];
            let [weights, forces] = if elliptic {
                cone(inertia, support.force_n, shear)
            } else {
                pyramid(inertia, support.force_n, shear, coefficient)
            };
            rows.extend(weights);
            rows.extend(std::array::from_fn::<_, 4, _>(|k| forces[k] / weights[k]));
        }
        let bodies = supports.iter().map(|s| s.body).collect();
        let rows = rows.into_pyarray(py).reshape([supports.len(), 22])?;
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

    /// What the skin feels, `dt` s after the last time, of contacts of the engine. Each of `loads` is the number of a
    /// contact, the body that it presses on the skin, and the sign with which the contact's force is on that body.
    /// `places`, `frames` and `forces` are of all contacts: (n, 3), m, (n, 9) by rows, and (n, 6), N and N m, along those.
    /// The pressures of contacts of number `foamed` and above are those of the foam as vectors, as `supports` has them.
    #[pyo3(signature = (dt, loads, places, frames, forces, foamed, lined = Vec::new()))]
    #[expect(clippy::too_many_arguments, reason = "one a thing that a contact has")]
    fn read(
        &self,
        py: Python<'_>,
        dt: f64,
        loads: Vec<(usize, usize, f64)>,
        places: PyReadonlyArray2<'_, f64>,
        frames: PyReadonlyArray2<'_, f64>,
        forces: PyReadonlyArray2<'_, f64>,
        foamed: usize,
        lined: Vec<Lining>,
    ) -> PyResult<Touch> {
        let (placed, frame, origin) = self.placed(py)?;
        let xpos = read(py, &self.arrays.xpos)?;
        let mut known: Vec<Load> = Vec::new();
        for (number, body, sign) in loads {
            let Some(at) = self.bodies.iter().position(|known| *known == body) else {
                bail!("body {body} is none of those that may touch the skin");
            };
            let (place, axes, force) = (row(&places, number), rotation(&frames, number), row::<6>(&forces, number));
            let normal_n = force[0];
            if normal_n <= 0.0 {
                continue;
            }
            // by the rows of the contact's frame
            let along = |v: &[f64]| scaled(into(&axes, [v[0], v[1], v[2]]), sign);
            let push = along(&force[..3]);
            let twist = plus(along(&force[3..]), cross(minus(place, row(&xpos, body)), push));
            let centre_m = into(&frame, minus(place, origin));
            let wrench = Wrench { force_n: into(&frame, push), torque_nm: into(&frame, twist) };
            let normal = (number >= foamed).then(|| into(&frame, scaled(axes[0], sign)));
            let lining = lined.iter().find(|(lined, ..)| *lined == body).map_or((0.0, f64::INFINITY), |l| (l.1, l.2));
            match known.iter_mut().find(|load| load.body == at && load.along == normal) {
                Some(load) => {
                    let share = normal_n / (load.normal_n + normal_n);
                    load.centre_m = plus(load.centre_m, scaled(minus(centre_m, load.centre_m), share));
                    load.normal_n += normal_n;
                    load.wrench.force_n = plus(load.wrench.force_n, wrench.force_n);
                    load.wrench.torque_nm = plus(load.wrench.torque_nm, wrench.torque_nm);
                }
                None => known.push(Load { body: at, normal_n, centre_m, wrench, along: normal, lining }),
            }
        }
        self.skin.get().carried(py, &self.shapes, &placed, dt, &known)
    }
}

/// Stiffness of foam along its surface, relative to that across it: G/(K h) of an open foam with Poisson's ratio 0.25.
const SHEAR: f64 = 0.4;

/// D and the force at rest, N, of the rows of a contact with an elliptic cone: normal, and two tangents.
fn cone(inertia: f64, force_n: f64, [x, y]: [f64; 2]) -> [[f64; 4]; 2] {
    [[inertia, SHEAR * inertia, SHEAR * inertia, 1.0], [force_n, x, y, 0.0]]
}

/// D and the force at rest, N, of the rows of a contact with a pyramidal cone: its edges, of which all push as long as
/// friction is inside it. Along the surface that is the stiffness μ²/2.
fn pyramid(inertia: f64, force_n: f64, shear: [f64; 2], friction: f64) -> [[f64; 4]; 2] {
    if friction <= 0.0 {
        return cone(inertia, force_n, shear);
    }
    let [x, y] = shear.map(|s| s / friction);
    let within = (force_n.max(0.0) / (x.abs() + y.abs()).max(f64::MIN_POSITIVE)).min(1.0);
    let (x, y) = (within * x, within * y);
    let even = 0.25 * (force_n - x.abs() - y.abs());
    [[0.25 * inertia; 4], [x, -x, y, -y].map(|edge| even + edge.max(0.0))]
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
