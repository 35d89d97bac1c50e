//! A skin on a link of somebody's MuJoCo model, by the arrays of its data.

use crate::args::Array2;
use crate::body::Body;
use crate::common::refuse;
use crate::skin::{Load, Placed, Skin, Touch};
use numpy::ndarray::{ArrayView1, ArrayView2};
use numpy::{
    IntoPyArray as _, PyArray2, PyArrayMethods as _, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods as _,
};
use pyo3::prelude::*;
use spts::contact::{Support, Wrench};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

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
    shapes: Arc<[Py<Body>]>,
    /// Root of the tree of every body.
    roots: Vec<usize>,
    arrays: Arrays,
    friction: Mutex<Friction>,
    clock: Mutex<Clock>,
}

/// The arrays of an `mjData` with poses and velocities of bodies, by those names: of each a row a body.
#[derive(Clone, Copy, FromPyObject)]
struct Bodies<T> {
    xpos: T,
    xmat: T,
    cvel: T,
    subtree_com: T,
}

/// They stay where they are as long as the data lives.
type Arrays = Bodies<Py<PyArray2<f64>>>;
type Poses<'a> = Bodies<ArrayView2<'a, f64>>;

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

/// Bodies that are near, and the normal force of the foam on each, N.
type Near = Vec<(usize, f64)>;

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
        let (bodies, shapes): (Vec<_>, Vec<_>) = bodies.into_iter().unzip();
        let [x, y, z, turn @ ..] = frame;
        let place = ([x, y, z], std::array::from_fn(|i| std::array::from_fn(|j| turn[3 * i + j])));
        Ok(Self {
            skin,
            link,
            place,
            bodies,
            shapes: shapes.into(),
            roots,
            arrays,
            friction: Mutex::default(),
            clock: Mutex::default(),
        })
    }

    /// The foam under all bodies but those of `passed`, for a step of `step` s, as springs for the engine, about the
    /// velocities that the data has. `lined` are bodies that wear foam themselves.
    ///
    /// Returns an array (n, 22): place, m; frame by rows (normal on the body, and two tangents); force on a body that
    /// does not move, N; stiffness, N/m; and, for up to four rows of its constraint each, D and aref + J v/step:
    /// MuJoCo's force D (aref − J a) then is that of `Support` and of friction that stretches the foam. Then the body
    /// of every spring, and the normal force, N, of every body that is near.
    #[pyo3(signature = (step, elliptic, passed = Vec::new(), lined = Vec::new()))]
    fn supports<'py>(
        &self,
        py: Python<'py>,
        step: f64,
        elliptic: bool,
        passed: Vec<usize>,
        lined: Vec<Lining>,
    ) -> PyResult<(Array2<'py>, Vec<usize>, Near)> {
        let (mut supports, mut carried) = (Vec::new(), Vec::new());
        let (frame, origin) = self.arrays.look(py, |poses| {
            let standing = self.standing(&poses);
            for (body, shape) in self.bodies.iter().zip(&*self.shapes) {
                if passed.contains(body) {
                    continue;
                }
                let placed = self.placed(&poses, &standing, *body);
                if !placed.is_finite() {
                    bail!("body {body} has a pose or velocity that is not finite");
                }
                let lining = lining(&lined, *body);
                let mut found = Vec::new();
                if let Some(force_n) = self.skin.get().supports(py, shape.get(), &placed, lining, step, &mut found) {
                    carried.push((*body, force_n));
                    supports.extend(found.into_iter().map(|support| Sheared {
                        body: *body,
                        support,
                        shear_n: [0.0; 3],
                    }));
                }
            }
            Ok(standing)
        })?;
        let mut friction = self.friction.lock().unwrap_or_else(PoisonError::into_inner);
        let (damping, (_, coefficient)) = (self.skin.get().damping(), self.skin.get().foam());
        share(&friction.held, coefficient, elliptic, &mut supports);
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

    /// Begins anew, with nothing touched and nothing held.
    fn release(&self) {
        *self.clock() = Clock::default();
        *self.friction.lock().unwrap_or_else(PoisonError::into_inner) = Friction::default();
    }

    /// What the skin feels now if nothing has touched it since `last`; `None` if that is known already.
    fn catch_up(&self, py: Python<'_>, last: Option<Bound<'_, Touch>>) -> PyResult<Option<Touch>> {
        let idle_s = std::mem::take(&mut self.clock().idle_s);
        if idle_s <= 0.0 {
            return Ok(None);
        }
        let skin = self.skin.get();
        let idle = last.and_then(|last| skin.idle(py, idle_s, last.get()));
        idle.map_or_else(|| skin.carried(py, &self.shapes, idle_s, &[]), Ok).map(Some)
    }
}

/// When a skin was read last.
#[derive(Default)]
struct Clock {
    /// Time since then, s.
    idle_s: f64,
    /// Whether it was touched then, and whether it has been read at all.
    pressed: bool,
    read: bool,
}

impl Mount {
    fn clock(&self) -> MutexGuard<'_, Clock> {
        self.clock.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What the skin feels of `loads`, `dt` s after the last time; `None` as long as nothing touches it.
    fn read(
        &self,
        py: Python<'_>,
        dt: f64,
        loads: &[(usize, usize, f64)],
        solved: &Solved<'_, '_>,
        lined: &[Lining],
        still: &[(usize, [f64; 14])],
    ) -> PyResult<Option<Touch>> {
        let mut clock = self.clock();
        clock.idle_s += dt;
        if clock.read && !clock.pressed && loads.is_empty() && still.is_empty() {
            return Ok(None);
        }
        let known = self.loads(loads, solved, lined, still)?;
        let touch = self.skin.get().carried(py, &self.shapes, clock.idle_s, &known)?;
        *clock = Clock { idle_s: 0.0, pressed: touch.area > 0.0, read: true };
        Ok(Some(touch))
    }

    /// Contacts as loads in the skin's frame. Each of `loads` is the number of a contact, the body that it presses on
    /// the skin, and the sign with which the contact's force is on that body.
    fn loads(
        &self,
        loads: &[(usize, usize, f64)],
        solved: &Solved<'_, '_>,
        lined: &[Lining],
        still: &[(usize, [f64; 14])],
    ) -> PyResult<Vec<Load>> {
        let mut known: Vec<Load> = Vec::new();
        if loads.is_empty() && still.is_empty() {
            return Ok(known);
        }
        let poses = &solved.poses;
        let standing = self.standing(poses);
        let (frame, origin) = standing;
        let engine = loads.iter().map(|&(number, body, sign)| {
            let Contact { place, axes, .. } = solved.contacts[number];
            (body, place, axes, sign, solved.of(number), number >= solved.foamed)
        });
        let law = still.iter().map(|(body, row)| {
            let axes = std::array::from_fn(|i| std::array::from_fn(|j| row[3 + 3 * i + j]));
            (*body, [row[0], row[1], row[2]], axes, 1.0, [row[12], 0.0, 0.0, 0.0, 0.0, 0.0], true)
        });
        for (body, place, axes, sign, force, is_foam) in engine.chain(law) {
            let Some(at) = self.bodies.iter().position(|known| *known == body) else {
                bail!("body {body} is none of those that may touch the skin");
            };
            let normal_n = force[0];
            if normal_n <= 0.0 {
                continue;
            }
            // by the rows of the contact's frame
            let along = |v: &[f64]| scaled(into(&axes, [v[0], v[1], v[2]]), sign);
            let push = along(&force[..3]);
            let twist = plus(along(&force[3..]), cross(minus(place, row(&poses.xpos, body)), push));
            let centre_m = into(&frame, minus(place, origin));
            let wrench = Wrench { force_n: into(&frame, push), torque_nm: into(&frame, twist) };
            let normal = is_foam.then(|| into(&frame, scaled(axes[0], sign)));
            match known.iter_mut().find(|load| load.body == at && load.along == normal) {
                Some(load) => {
                    let share = normal_n / (load.normal_n + normal_n);
                    load.centre_m = plus(load.centre_m, scaled(minus(centre_m, load.centre_m), share));
                    load.normal_n += normal_n;
                    load.wrench.force_n = plus(load.wrench.force_n, wrench.force_n);
                    load.wrench.torque_nm = plus(load.wrench.torque_nm, wrench.torque_nm);
                }
                None => {
                    let (placed, lining) = (self.placed(poses, &standing, body), lining(lined, body));
                    known.push(Load { body: at, placed, normal_n, centre_m, wrench, along: normal, lining });
                }
            }
        }
        Ok(known)
    }

    /// Keeps those of `loads` that the foam has. Where a body lies flat, an engine puts contacts at the corners of the
    /// surface that is shared, which may be beside the foam: one is felt if it has four fifths of the way to there from
    /// the middle of the body's contacts.
    fn keep_felt(&self, solved: &Solved<'_, '_>, loads: &mut Vec<(usize, usize, f64)>) {
        if loads.is_empty() {
            return;
        }
        let standing = self.standing(&solved.poses);
        let felt = |&(number, body, sign): &(usize, usize, f64)| {
            let contact = &solved.contacts[number];
            let (at, along) = (contact.on(sign), scaled(contact.axes[0], sign));
            if self.pushes(&standing, at, along) {
                return true;
            }
            let same = loads.iter().filter(|(_, other, _)| *other == body);
            let (sum, middle) = same.fold((0.0, [0.0; 3]), |(sum, middle), &(other, _, sign)| {
                let force_n = solved.of(other)[0].max(0.0);
                (sum + force_n, plus(middle, scaled(solved.contacts[other].on(sign), force_n)))
            });
            let middle = scaled(middle, 1.0 / sum);
            sum > 0.0 && self.pushes(&standing, plus(middle, scaled(minus(at, middle), 0.8)), along)
        };
        *loads = loads.iter().copied().filter(felt).collect();
    }

    /// Whether the foam has a place in the world where a body is pushed along a direction.
    fn pushes(&self, (frame, origin): &(Rotation, Vector), place: Vector, along: Vector) -> bool {
        self.skin.get().pushes(into(frame, minus(place, *origin)), into(frame, along))
    }

    /// How the skin's frame is turned, and where it is, in the world's.
    fn standing(&self, poses: &Poses<'_>) -> (Rotation, Vector) {
        let (carrier, (at, turn)) = (rotation(&poses.xmat, self.link), self.place);
        let columns: [Vector; 3] = std::array::from_fn(|j| turned(&carrier, turn.map(|row| row[j])));
        let origin = plus(row(&poses.xpos, self.link), turned(&carrier, at));
        (std::array::from_fn(|i| columns.map(|column| column[i])), origin)
    }

    /// A body in the skin's frame.
    fn placed(&self, poses: &Poses<'_>, (frame, origin): &(Rotation, Vector), body: usize) -> Placed {
        // velocity of what moves with `body` at `at`: `cvel` is about the centre of mass of its tree, spin first
        let velocity = |body: usize, at: Vector| {
            let v: [f64; 6] = row(&poses.cvel, body);
            let spin = [v[0], v[1], v[2]];
            let arm = minus(at, row(&poses.subtree_com, self.roots[body]));
            (plus([v[3], v[4], v[5]], cross(spin, arm)), spin)
        };
        let at = row(&poses.xpos, body);
        let (linear, spin) = velocity(body, at);
        let (carried, turning) = velocity(self.link, at);
        let own = rotation(&poses.xmat, body);
        Placed {
            position_m: into(frame, minus(at, *origin)),
            rotation: std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| frame[k][i] * own[k][j]).sum())),
            velocity_m_per_s: into(frame, minus(linear, carried)),
            spin_rad_per_s: into(frame, minus(spin, turning)),
        }
    }
}

impl<T> Bodies<T> {
    fn each<'a, U>(&'a self, of: impl Fn(&'a T) -> PyResult<U>) -> PyResult<Bodies<U>> {
        Ok(Bodies {
            xpos: of(&self.xpos)?,
            xmat: of(&self.xmat)?,
            cvel: of(&self.cvel)?,
            subtree_com: of(&self.subtree_com)?,
        })
    }
}

impl Arrays {
    /// Calls `look` with the present values.
    fn look<T>(&self, py: Python<'_>, look: impl FnOnce(Poses<'_>) -> PyResult<T>) -> PyResult<T> {
        let read = self.each(|array| array.bind(py).try_readonly().map_err(refuse))?;
        look(read.each(|array| Ok(array.as_array()))?)
    }
}

fn lining(lined: &[Lining], body: usize) -> (f64, f64) {
    lined.iter().find(|(lined, ..)| *lined == body).map_or((0.0, f64::INFINITY), |l| (l.1, l.2))
}

/// The contacts of an `mjData`, and the forces of its constraints: the arrays of those names.
#[derive(FromPyObject)]
struct Contacts<'py> {
    geom: PyReadonlyArray2<'py, i32>,
    pos: PyReadonlyArray2<'py, f64>,
    dist: PyReadonlyArray1<'py, f64>,
    frame: PyReadonlyArray2<'py, f64>,
    friction: PyReadonlyArray2<'py, f64>,
    dim: PyReadonlyArray1<'py, i32>,
    efc_address: PyReadonlyArray1<'py, i32>,
    exclude: PyReadonlyArray1<'py, i32>,
}

impl Contacts<'_> {
    fn all(&self) -> Vec<Contact> {
        let [pos, frame, friction] = [&self.pos, &self.frame, &self.friction].map(|array| array.as_array());
        let [dim, address, exclude] = [&self.dim, &self.efc_address, &self.exclude].map(|array| array.as_array());
        let (geom, dist) = (self.geom.as_array(), self.dist.as_array());
        let contact = |k: usize| Contact {
            geoms: row(&geom, k),
            place: row(&pos, k),
            overlap_m: (-dist[k]).max(0.0),
            axes: rotation(&frame, k),
            friction: row(&friction, k),
            dim: usize::try_from(dim[k]).unwrap_or(0),
            first: usize::try_from(address[k]).ok(),
            excluded: exclude[k] != 0,
        };
        (0..address.len()).map(contact).collect()
    }
}

/// A contact of an `mjData`.
struct Contact {
    geoms: [i32; 2],
    /// In the middle between the surfaces of both geoms, m.
    place: Vector,
    /// How far the geoms are in each other, m.
    overlap_m: f64,
    /// The normal, from the first geom to the second, and two tangents.
    axes: Rotation,
    friction: [f64; 5],
    /// Degrees of freedom in which the constraint acts.
    dim: usize,
    /// Its first row in the constraints, if it has any.
    first: Option<usize>,
    excluded: bool,
}

impl Contact {
    /// Its place on the surface of the geom that pushes the other one along `sign` times the normal, m.
    fn on(&self, sign: f64) -> Vector {
        plus(self.place, scaled(self.axes[0], 0.5 * sign * self.overlap_m))
    }
}

/// Skins that step together.
#[pyclass(frozen, module = "spts._spts")]
pub(crate) struct Mounts {
    mounts: Vec<Py<Mount>>,
    /// Of every geom, the skins whose links have it.
    owners: Vec<Vec<usize>>,
    /// Of every skin, whether it feels a geom.
    others: Vec<Vec<bool>>,
    geom_bodies: Vec<usize>,
    /// What the bodies of every skin wear.
    worn: Vec<Vec<Lining>>,
}

#[pymethods]
impl Mounts {
    /// `own` and `others` tell which geoms are of the link of a skin, and of the bodies that it may feel; `worn` what
    /// those wear.
    #[new]
    fn new(
        mounts: Vec<Py<Mount>>,
        own: Vec<Vec<bool>>,
        others: Vec<Vec<bool>>,
        geom_bodies: Vec<usize>,
        worn: Vec<Vec<Lining>>,
    ) -> Self {
        let owners = (0..geom_bodies.len()).map(|g| (0..mounts.len()).filter(|k| own[*k][g]).collect());
        Self { owners: owners.collect(), mounts, others, geom_bodies, worn }
    }

    /// Numbers of the contacts that lie in the foam of one of `skins`, of those that are not excluded.
    fn foamed(&self, py: Python<'_>, contact: Contacts<'_>, skins: Vec<usize>) -> PyResult<Vec<usize>> {
        let contacts = contact.all();
        self.arrays().look(py, |poses| {
            let is_foam = |number: &usize| {
                let mut any = false;
                self.felt_by(&poses, &contacts[*number], |k, _, _| any |= skins.contains(&k));
                any
            };
            Ok((0..contacts.len()).filter(|n| !contacts[*n].excluded).filter(is_foam).collect())
        })
    }

    /// What the skins feel of the contacts that act, `dt` s after the last time: number and touch of those that
    /// something touches, or did so the last time. `forces` are those of all constraints. The contacts from `foamed` on
    /// stand for foam: of each its skin, and its body. `still` are supports that the engine does not solve for: skin,
    /// body, and the first numbers of the row that [`Mount::supports`] gives.
    #[expect(clippy::too_many_arguments, reason = "what a step has")]
    fn read(
        &self,
        py: Python<'_>,
        dt: f64,
        contact: Contacts<'_>,
        forces: PyReadonlyArray1<'_, f64>,
        elliptic: bool,
        foamed: usize,
        springs: Vec<(usize, usize)>,
        still: Vec<(usize, usize, [f64; 14])>,
    ) -> PyResult<Vec<(usize, Touch)>> {
        self.arrays().look(py, |poses| {
            let solved = Solved { contacts: contact.all(), forces: forces.as_array(), poses, elliptic, foamed };
            let contacts = &solved.contacts;
            let mut loads = vec![Vec::new(); self.mounts.len()];
            let acts = |number: &usize| contacts[*number].first.is_some() && !contacts[*number].excluded;
            for number in (0..foamed.min(contacts.len())).filter(acts) {
                self.meets(&contacts[number], |k, body, sign| loads[k].push((number, body, sign)));
            }
            for (mount, loads) in self.mounts.iter().zip(&mut loads) {
                mount.get().keep_felt(&solved, loads);
            }
            for (number, (k, body)) in (foamed..contacts.len()).zip(springs).filter(|(n, _)| acts(n)) {
                let link = self.mounts[k].get().link;
                loads[k].push((number, body, 1.0));
                // and that of the body, if it is not of the same link
                self.felt_by(&poses, &contacts[number], |other, _, sign| {
                    if self.mounts[other].get().link != link {
                        loads[other].push((number, link, sign));
                    }
                });
            }
            let mut felt = Vec::with_capacity(self.mounts.len());
            for (k, mount) in self.mounts.iter().enumerate() {
                let still: Vec<_> =
                    still.iter().filter(|(n, ..)| *n == k).map(|(_, body, row)| (*body, *row)).collect();
                if let Some(touch) = mount.get().read(py, dt, &loads[k], &solved, &self.worn[k], &still)? {
                    felt.push((k, touch));
                }
            }
            Ok(felt)
        })
    }
}

impl Mounts {
    /// The arrays of the data that all have.
    fn arrays(&self) -> &Arrays {
        &self.mounts[0].get().arrays
    }

    /// Calls `each` with every skin whose foam has the contact, the body that it feels, and the sign with which the
    /// contact's force is on that body: the contact's normal points from its first geom to its second.
    fn felt_by(&self, poses: &Poses<'_>, contact: &Contact, mut each: impl FnMut(usize, usize, f64)) {
        self.meets(contact, |k, body, sign| {
            let mount = self.mounts[k].get();
            if mount.pushes(&mount.standing(poses), contact.on(sign), scaled(contact.axes[0], sign)) {
                each(k, body, sign);
            }
        });
    }

    /// As [`Mounts::felt_by`], wherever on the skin's link the contact is.
    fn meets(&self, contact: &Contact, mut each: impl FnMut(usize, usize, f64)) {
        // a flex has no geom
        let [Ok(one), Ok(other)] = contact.geoms.map(usize::try_from) else { return };
        for (own, pressed, sign) in [(one, other, 1.0), (other, one, -1.0)] {
            for &k in self.owners[own].iter().filter(|k| self.others[**k][pressed]) {
                each(k, self.geom_bodies[pressed], sign);
            }
        }
    }
}

/// Contacts, what the engine made of them, and where the bodies are.
struct Solved<'a, 'b> {
    contacts: Vec<Contact>,
    /// Forces of all constraints.
    forces: ArrayView1<'a, f64>,
    poses: Poses<'b>,
    elliptic: bool,
    /// The first contact that stands for foam.
    foamed: usize,
}

impl Solved<'_, '_> {
    /// Force, N, and torque, N m, along the rows of a contact's frame.
    fn of(&self, number: usize) -> [f64; 6] {
        let Contact { first, dim, friction, .. } = &self.contacts[number];
        let (mut out, Some(at), dim) = ([0.0; 6], *first, *dim) else { return [0.0; 6] };
        if self.elliptic || dim == 1 {
            out.iter_mut().take(dim).enumerate().for_each(|(k, f)| *f = self.forces[at + k]);
            return out;
        }
        for k in 1..dim.min(6) {
            let [one, other] = [self.forces[at + 2 * k - 2], self.forces[at + 2 * k - 1]];
            out[0] += one + other;
            out[k] = (one - other) * friction[k - 1];
        }
        out
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

/// Shares what friction holds among `supports`: of each side, as their normal forces have it. Of the moment it is as
/// much as the cone of every support has room for beside the force.
fn share(held: &[Held], friction: f64, elliptic: bool, supports: &mut [Sheared]) {
    let mut left = held.to_vec();
    for side in supports.chunk_by_mut(together) {
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
        let around = if polar > 0.0 { held.torsion_nm / polar } else { 0.0 };
        let [_, x, y] = tangents(normal);
        let of = |s: &Sheared, part: f64| scaled(plus(shear, scaled(cross(normal, arm(s)), part * around)), weight(s));
        let fits = |part: f64| {
            side.iter().all(|s| {
                let [a, b] = [dot(of(s, part), x), dot(of(s, part), y)];
                let length = if elliptic { a.hypot(b) } else { a.abs() + b.abs() };
                length <= friction * s.support.force_n.max(0.0)
            })
        };
        let (mut part, mut most) = if fits(1.0) { (1.0, 1.0) } else { (0.0, 1.0) };
        while most - part > 1e-3 {
            let middle = 0.5 * (part + most);
            if fits(middle) { part = middle } else { most = middle }
        }
        let shears: Vec<Vector> = side.iter().map(|s| of(s, part)).collect();
        side.iter_mut().zip(shears).for_each(|(s, shear)| s.shear_n = shear);
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

fn row<T: Copy, const N: usize>(array: &ArrayView2<'_, T>, index: usize) -> [T; N] {
    std::array::from_fn(|k| array[[index, k]])
}

fn rotation(array: &ArrayView2<'_, f64>, index: usize) -> Rotation {
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
