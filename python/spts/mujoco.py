"""A skin in somebody's own MuJoCo model: any model, any version of `mujoco` from 3.0 on. Needs `mujoco`.

::

    touch = spts.mujoco.attach(model, data, skin, site="palm")
    for _ in range(1000):
        felt = touch.step()                  # in place of mujoco.mj_step(model, data)
        y, phi = wire.record(felt, 20)
    touch.detach()

The skin's frame is the site's, or a place on a body: z outward, the free surface of a flat skin in the plane z = 0.

Two modes. In mode "sense" MuJoCo's own contact moves everything, as without a skin, and the skin spreads the normal force
of that contact over the foam: the sum of pressure × area is that force, at any step. In mode "foam" the foam itself
carries the bodies, where there is foam, in place of MuJoCo's contact: it gives way and bounces as foam does. Its law is
implicit, and solved by MuJoCo together with all other constraints, so that it is stable at the model's own step. Everywhere
else, for other data and for copies, MuJoCo's contact stays; the model is not changed.
"""

from __future__ import annotations

import ctypes
import difflib
import fnmatch
import math
import time
import warnings

import mujoco
import numpy as np

from ._spts import Body, Mount, Mounts, Skin, Wire
from .decode import MOST_TAXELS, learned_of
from .taxels import Table, areas_of, nearest, places_of, tables

# Most times that a step is solved anew with the foam's law about another velocity, and the share of a force that may be
# off before: what is left is of the order of its square.
_TRIALS, _OFF = 12, 0.05

_ELLIPTIC = int(mujoco.mjtCone.mjCONE_ELLIPTIC)


def attach(
    model,
    data,
    skin,
    *,
    site=None,
    body=None,
    pos=(0, 0, 0),
    quat=(1, 0, 0, 0),
    bodies="all",
    link_geoms=None,
    mode="sense",
    tolerance=None,
):
    """Puts `skin` on a link of a model.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
    skin : spts.Skin
    site : str or int, optional
        Where the skin is: its frame is the site's.
    body : str or int, optional
        In place of a site, the body that the skin is on, with the skin's frame in that body's: `pos` (3,), m, and `quat`
        (4,), w x y z.
    bodies : "all", sequence of str or int, or dict of them to spts.Body
        Bodies that may touch the skin, by their names or that of a geom of theirs. Their shapes are their geoms that
        collide, unless a `spts.Body` is given. "all" are those with such geoms but the skin's own link, what is welded to
        it, and what a joint connects with it.
    link_geoms : sequence of str or int, optional
        Geoms that the skin covers: MuJoCo's contact between them and `bodies` is felt where there is foam, or taken out in
        mode "foam". Default: all geoms of the skin's body and, unless that stands still, of what is welded to it. A skin
        on the world covers those that are not of `bodies`.
    mode : str
        "sense": MuJoCo's contact moves the bodies, and the skin reads its forces. "foam": the foam moves them.
    tolerance : float, optional
        Of the shapes of `bodies`, as of `body_of`.

    Returns
    -------
    Attachment

    Raises
    ------
    ValueError
        For a name that the model does not have, a body without a shape, and what this cannot do (said in the text).
    """
    if (site is None) == (body is None):
        raise ValueError("where is the skin? Either `site` or `body` is needed")
    if site is not None:
        site = _number(model, mujoco.mjtObj.mjOBJ_SITE, "site", site)
        place = int(model.site_bodyid[site]), model.site_pos[site], model.site_quat[site]
    else:
        place = _number(model, mujoco.mjtObj.mjOBJ_BODY, "body", body), pos, quat
    return Attachment(model, data, skin, *place, bodies=bodies, link_geoms=link_geoms, mode=mode, tolerance=tolerance)


class Attachment:
    """A skin on a link of a model: what `attach` returns."""

    def __init__(
        self, model, data, skin, link, pos, quat, *, bodies="all", link_geoms=None, mode="sense", tolerance=None
    ):
        if mode not in ("sense", "foam"):
            raise ValueError(f'`mode` = "{mode}"; valid: "sense", "foam"')
        self.mode = mode
        if mode == "foam":
            if model.opt.enableflags & getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0):
                raise ValueError(
                    "`model.opt.enableflags` has `sleep`: foam does not wake what sleeps; clear it, or let the bodies stay awake"
                )
            if model.opt.disableflags & (mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_CONTACT):
                raise ValueError('`model.opt.disableflags` turns contact off, and with it foam; use mode "sense"')
        pos, quat = (np.asarray(v, np.float64) for v in (pos, quat))
        if pos.shape != (3,) or quat.shape != (4,) or not (np.isfinite(pos).all() and np.linalg.norm(quat) > 1e-9):
            raise ValueError(
                f"`pos` = {pos}, `quat` = {quat}: three finite numbers, and four that are not all 0, are needed"
            )
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, quat / np.linalg.norm(quat))
        self.model, self.data, self.skin = model, data, skin
        self._friction = skin.foam[1]
        if isinstance(bodies, str):
            if bodies != "all":
                raise ValueError(
                    f'`bodies` = "{bodies}"; valid: "all", a list of bodies, or a dict of bodies to `spts.Body`'
                )
            bodies = _all(model, link)
        given = bodies if isinstance(bodies, dict) else {body: None for body in bodies}
        if not given:
            raise ValueError("`bodies` is empty: which bodies may touch the skin?")
        #: The `spts.Body` of every body of the model that may touch the skin, by its number: the keys of `wrenches`.
        self.bodies = {}
        for name, shape in given.items():
            number = _of_geom(model, name)
            if number is None:
                number = _number(model, mujoco.mjtObj.mjOBJ_BODY, "bodies", name)
            if number == link or model.body_weldid[number] == model.body_weldid[link] != 0:
                raise ValueError(f'`bodies`: "{name}" is a part of the skin\'s own link')
            self.bodies[number] = body_of(model, number, tolerance) if shape is None else shape
        # MuJoCo has no contact between what stands still and what is led by mocap: there the foam has its law's
        # pressure
        still = model.body_dofnum[model.body_weldid] == 0
        self._led = [body for body in self.bodies if still[link] and still[body]]
        others = np.isin(model.geom_bodyid, list(self.bodies))
        if link_geoms is None:
            own = _covered(model, link) & ~others
        else:
            own = np.zeros(model.ngeom, bool)
            own[[_number(model, mujoco.mjtObj.mjOBJ_GEOM, "link_geoms", geom) for geom in link_geoms]] = True
        if (own & others).any():
            raise ValueError(
                f"geoms {np.flatnonzero(own & others).tolist()} are of the skin's link and of a body at once"
            )
        self._own, self._others = own, others
        frame = (*pos.tolist(), *rotation.tolist())
        self._mount = Mount(skin, link, frame, list(self.bodies.items()), model.body_rootid.tolist(), _Arrays(data))
        self._link, self._place = link, (pos, rotation.reshape(3, 3))
        # geoms that stand for the link and the bodies in contacts
        self._geoms = {body: _a_geom(model, body, others) for body in self.bodies}
        self._link_geom = _a_geom(model, link, own)
        if mode == "foam" and None in (self._link_geom, *self._geoms.values()):
            raise ValueError(
                f'body "{model.body(link).name}" or one of `bodies` has no geom, which foam needs; give it one'
            )
        self._last = self._failed = None
        self._felt_at = None
        self._each = None
        self._group = None
        # whether `hook` is on
        self._hooks = False

    @property
    def last(self):
        """The last touch; None before the first step. An error in a step of others is raised here."""
        if self._hooks:
            self._look()
        # what nothing touches is not read at every step
        idle = self._mount.catch_up(self._last)
        if idle is not None:
            self._last = idle
        return self._last

    def _look(self):
        """Brings what `hook` has asked for up to date."""
        if self._failed is not None:
            failed, self._failed = self._failed, None
            raise failed
        if self.mode == "sense":
            if self._hooks and self.data.time != self._felt_at:
                elapsed = self._elapsed()
                (self._group or self._alone()).read(elapsed)
        elif self in _hooked(self.data) and mujoco.get_mjcb_control() is not _control:
            raise RuntimeError("another `mjcb_control` has been set after `hook()`: set it before, or use `step`")

    @property
    def pressure(self):
        """Mean pressure over every taxel, Pa, (rows, cols)."""
        return np.zeros(self.skin.shape) if self.last is None else self._last.pressure

    def step(self, steps=1):
        """Steps the model, in place of `mujoco.mj_step`; the last `spts.Touch`."""
        for _ in range(steps):
            step(self)
        return self.last

    def reset(self):
        """Takes every body off the skin and begins its time anew, as after `mujoco.mj_resetData`."""
        self.skin.reset()
        self._mount.release()
        self._last = self._felt_at = None

    def hook(self, each=None):
        """Lets every `mujoco.mj_step` of the data feel the skin, whoever calls it: environments and viewers that step
        by themselves. `step` is not needed then. Ends with `detach`.

        Parameters
        ----------
        each : callable, optional
            Called with every touch, in mode "foam".

        In mode "sense", `last` then is what the skin feels at the present moment of the data. In mode "foam" the foam
        comes into every step by MuJoCo's callback `mjcb_control`, for this data alone; one that is set already is called
        first.
        """
        if self.mode == "sense":
            if each is not None:
                raise ValueError(
                    '`each` needs mode "foam": in mode "sense" nothing is called in a step; look at `last` after it'
                )
            self._hooks = True
            return
        if self.model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_ACTUATION:
            raise ValueError("`model.opt.disableflags` turns actuation off, and with it `mjcb_control`; use `step`")
        if not _HOOKED:
            _BEFORE.append(mujoco.get_mjcb_control())
            mujoco.set_mjcb_control(_control)
        hooked = _hooked(self.data)
        if self not in hooked:
            _HOOKED[self.data._address] = _Group([*hooked, self])
        self._each, self._hooks = each, True

    def detach(self):
        """Ends the skin: MuJoCo's contact acts everywhere again, and `hook` has ended."""
        self._hooks = self._failed is not None
        hooked = _hooked(self.data)
        if self in hooked:
            hooked.remove(self)
            if hooked:
                _HOOKED[self.data._address] = _Group(hooked)
            else:
                del _HOOKED[self.data._address]
            if not _HOOKED:
                mujoco.set_mjcb_control(_BEFORE.pop())

    def draw(self, scene, most=2e4):
        """Draws the taxels into a scene of MuJoCo's viewer or renderer, those under pressure in colour.

        Parameters
        ----------
        scene : mujoco.MjvScene
            `viewer.user_scn` or `renderer.scene`.
        most : float
            Pressure of the brightest colour, Pa.
        """
        pos, turn = self._place
        link = self.data.xmat[self._link].reshape(3, 3)
        frame = link @ turn
        places = self.skin.positions @ frame.T + (link @ pos + self.data.xpos[self._link])
        normals = self.skin.normals @ frame.T
        sides = 0.45 * np.sqrt(self.skin.areas)
        shares = np.clip(self.pressure.ravel() / most, 0.0, 1.0)
        for place, normal, side, share in zip(places, normals, sides, shares):
            if scene.ngeom >= scene.maxgeom:
                warnings.warn(f"the scene has room for {scene.maxgeom} geoms: not all taxels are drawn", stacklevel=2)
                return
            across = np.eye(3)[np.argmin(np.abs(normal))]
            x = np.cross(across, normal)
            x /= np.linalg.norm(x)
            mujoco.mjv_initGeom(
                scene.geoms[scene.ngeom],
                mujoco.mjtGeom.mjGEOM_BOX,
                np.array([side, side, 0.1 * side]),
                place,
                np.stack([x, np.cross(normal, x), normal], axis=1).ravel(),
                np.array([0.15 + 0.85 * share, 0.2 + 0.4 * share, 0.35 * (1.0 - share), 1.0], np.float32),
            )
            scene.ngeom += 1

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.detach()

    def __reduce_ex__(self, protocol):
        raise TypeError(
            "an attachment is on one data and does not copy: copy the skin, and attach that to the other data"
        )

    def _alone(self):
        self._group = _Group([self])
        return self._group

    def _elapsed(self):
        """Time since the last touch, s. It runs only when the data's does: `mj_forward` repeats a moment."""
        time, before = self.data.time, self._felt_at
        if before is not None and time < before:
            # the data was reset
            self.reset()
            before = None
        self._felt_at = time
        return 0.0 if before is None else time - before


def _a_geom(model, body, among):
    """A geom of `body`, or of what is welded to it, for contacts; one of `among` if there is one, (geoms,) of bool."""
    weld = model.body_weldid
    for geoms in (
        among & (model.geom_bodyid == body),
        model.geom_bodyid == body,
        weld[model.geom_bodyid] == weld[body],
    ):
        found = np.flatnonzero(geoms)
        if len(found):
            return int(found[0])
    return None


class _Group:
    """Skins that step together, on one model and data."""

    def __init__(self, attachments):
        model, data = attachments[0].model, attachments[0].data
        if any(a.model is not model or a.data is not data for a in attachments):
            raise ValueError("`attachments` are of several models or data; one step moves one of them")
        self.model, self.data, self.attachments = model, data, attachments
        self.foams = [k for k, a in enumerate(attachments) if a.mode == "foam"]
        # skins that are pressed by what mocap leads
        self._leading = [k for k, a in enumerate(attachments) if a._led]
        # foam on foam: two layers, one behind the other, which one of the two skins carries
        self._worn = {k: [] for k in range(len(attachments))}
        self._passed = {k: list(a._led) for k, a in enumerate(attachments)}
        for k in self.foams:
            for other in self.foams:
                a, b = attachments[k], attachments[other]
                if b._link in a.bodies and a._link in b.bodies:
                    self._worn[k].append((b._link, b.skin.thickness, b.skin.foam[0]))
                    if k > other:
                        self._passed[k].append(b._link)
        self._mounts = Mounts(
            [a._mount for a in attachments],
            [a._own.tolist() for a in attachments],
            [a._others.tolist() for a in attachments],
            model.geom_bodyid.tolist(),
            [self._worn[k] for k in range(len(attachments))],
        )
        # contacts that stand for foam from this number on; of each its skin, its body, and its row of `Mount.supports`
        self._first, self._springs = 0, []
        self._contact = _blank()

    def step(self):
        model, data = self.model, self.data
        if not self.foams or all(self.attachments[k] in _hooked(data) for k in self.foams):
            mujoco.mj_step(model, data)
        elif model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
            raise ValueError(
                "`model.opt.integrator` = RK4; valid: Euler, implicit, implicitfast; with RK4 use `hook()` and `mj_step`"
            )
        else:
            mujoco.mj_step1(model, data)
            self.press()
            mujoco.mj_step2(model, data)
            self._hold(model.opt.timestep)
        self.read(model.opt.timestep)

    def press(self, always=False):
        """Puts foam in place of MuJoCo's contacts, as contacts of its own, between `mj_step1` and `mj_step2`.

        The law of a contact is about the velocity at the end of the step. That is the present one where forces hardly
        depend on it; else the step is tried. With `always` the forces are solved for in either case.
        """
        model, data = self.model, self.data
        dt, taken = model.opt.timestep, []
        elliptic = self._elliptic()
        if data.ncon:
            contact = data.contact
            taken = self._mounts.foamed(contact, self.foams)
            if taken:
                contact.exclude[taken], contact.efc_address[taken] = 1, -1
        self._first, qvel, last = data.ncon, None, {}
        for trial in range(_TRIALS):
            self._springs, carried, rest = [], {}, {}
            for k in self.foams:
                attachment = self.attachments[k]
                rows, bodies, near = attachment._mount.supports(dt, elliptic, self._passed[k], self._worn[k])
                carried.update({(k, body): force for body, force in near})
                for row, body in zip(rows, bodies):
                    self._springs.append((k, body, row))
                    rest[k, body] = rest.get((k, body), 0.0) + row[12]
            if qvel is not None:
                data.qvel[:] = qvel
                mujoco.mj_comVel(model, data)
            if self._springs or taken or trial:
                self._put()
            # what does not touch has springs that may come to push, about the law's first slope
            calm = all(abs(rest.get(key, 0.0) - force) <= _OFF * force for key, force in carried.items() if force > 0.0)
            if not self._springs or (trial == 0 and calm and not always):
                return
            if trial == 0:
                mujoco.mj_fwdActuation(model, data)
                mujoco.mj_fwdAcceleration(model, data)
            mujoco.mj_fwdConstraint(model, data)
            if trial == 0 and calm:
                return
            data.qacc_warmstart[:] = data.qacc
            found = dict.fromkeys(carried, 0.0)
            for (k, body, _), force in zip(self._springs, self._forces()):
                found[k, body] += force[0]
            if all(_settled(found[key], force, last.get(key)) for key, force in carried.items()):
                return
            last = found
            qvel = data.qvel.copy()
            data.qvel += dt * data.qacc
            mujoco.mj_comVel(model, data)
        data.qvel[:] = qvel
        mujoco.mj_comVel(model, data)

    def _put(self):
        """Makes the constraints anew with a contact for every spring."""
        model, data = self.model, self.data
        first, count = self._first, len(self._springs)
        data.ncon = first
        for _ in self._springs:
            if mujoco.mj_addContact(model, data, self._contact):
                raise RuntimeError("the data has no room for more contacts: `<size memory=…/>` of the model")
        contacts = data.contact
        if count:
            values = np.array([row for *_, row in self._springs])
            skins = [self.attachments[k] for k, *_ in self._springs]
            friction = np.array([skin._friction for skin in skins])
            geoms = [(skin._link_geom, skin._geoms[body]) for skin, (_, body, _) in zip(skins, self._springs)]
            contacts.pos[first:], contacts.frame[first:] = values[:, :3], values[:, 3:12]
            contacts.dist[first:] = np.minimum(-values[:, 12] / values[:, 13], 0.0)
            contacts.geom[first:] = geoms
            contacts.geom1[first:], contacts.geom2[first:] = contacts.geom[first:].T
            for name in ("flex", "elem", "vert"):
                if hasattr(contacts, name):
                    getattr(contacts, name)[first:] = -1
            contacts.dim[first:] = np.where(friction > 0.0, 3, 1)
            contacts.friction[first:] = 1e-5
            contacts.friction[first:, :2] = np.maximum(friction, 1e-5)[:, None]
        mujoco.mj_makeConstraint(model, data)
        contacts = data.contact
        elliptic = self._elliptic()
        if count and elliptic:
            # MuJoCo's cone wants the square of μ/mu as the stiffness along the surface, relative to that across it
            mu = np.maximum(friction, 1e-5) / np.sqrt(values[:, 15] / values[:, 14])
            contacts.mu[first:] = mu.reshape(contacts.mu[first:].shape)
        sizes = np.where(friction > 0.0, 3 if elliptic else 4, 1) if count else ()
        for size in set(sizes):
            mine = (sizes == size) & (contacts.efc_address[first:] >= 0)
            rows = contacts.efc_address[first:][mine][:, None] + np.arange(size)
            weights, pushes = values[mine, 14 : 14 + size], values[mine, 18 : 18 + size]
            data.efc_D[rows], data.efc_R[rows] = weights, 1.0 / weights
            # aref = −J v/dt − (pos − margin)
            data.efc_KBIP[rows] = (1.0, 1.0 / model.opt.timestep, 1.0, 0.0)
            data.efc_pos[rows] = data.efc_margin[rows] - pushes
        if hasattr(mujoco, "mj_island"):
            mujoco.mj_island(model, data)
        mujoco.mj_projectConstraint(model, data)
        mujoco.mj_referenceConstraint(model, data)

    def _forces(self):
        """Forces of the springs, (springs, 3), N, along their frames."""
        forces = np.zeros((len(self._springs), 6))
        for number, force in enumerate(forces, self._first):
            mujoco.mj_contactForce(self.model, self.data, number, force)
        return forces[:, :3]

    def _hold(self, elapsed):
        """Lets friction stretch the foam by what the step was solved to."""
        forces = self._forces()
        for k in self.foams:
            mine = [number for number, spring in enumerate(self._springs) if spring[0] == k]
            self.attachments[k]._mount.hold(elapsed, forces[mine])

    def read(self, dt):
        """Lets the skins feel the contacts that the data has, `dt` s after the last time."""
        model, data, contact = self.model, self.data, self.data.contact
        springs = [spring[:2] for spring in self._springs]
        foamed = self._first if springs else data.ncon
        still = []
        for k in self._leading:
            attachment = self.attachments[k]
            others = [body for body in attachment.bodies if body not in attachment._led]
            rows, bodies, _ = attachment._mount.supports(model.opt.timestep, self._elliptic(), others)
            still += [(k, body, row[:14].tolist()) for row, body in zip(rows, bodies)]
        for k, touch in self._mounts.read(dt, contact, data.efc_force, self._elliptic(), foamed, springs, still):
            self.attachments[k]._last = touch

    def _elliptic(self):
        return int(self.model.opt.cone) == _ELLIPTIC


def _settled(now, expected, before):
    """Whether a force is the one that the law was taken about, or has not changed since the step was tried before."""
    off = min(abs(now - expected), np.inf if before is None else abs(now - before))
    return max(now, expected) <= 0.0 or off <= _OFF * max(now, expected)


def _blank():
    """A contact with nothing in it but what MuJoCo wants of all."""
    contact = mujoco.MjContact()
    contact.dim, contact.solref, contact.solimp = 1, (-1.0, -1.0), (0.9, 0.95, 0.001, 0.5, 2.0)
    return contact


def dress(
    model,
    data,
    links="all",
    pitch=None,
    thickness=0.003,
    wires="link",
    *,
    taxels=None,
    sites=None,
    unit="m",
    mode="sense",
    tolerance=None,
    readout="as_built",
    seed=0,
    **foam,
):
    """Puts skins on links of a robot.

    They cover the surface of the links' geoms with a taxel about every `pitch`, or have their taxels where a file or
    the model's sites say.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
        Taxels inside the geoms of other links, as they stand in this data, are left out.
    links : "all" or sequence of str or int
        Bodies; "all" are those with a geom that collides, but the world, what is welded to it, and loose objects:
        bodies on a free joint that have no child, such as a ball. With `taxels` or `sites` "all" are those that they name.
    pitch : float, optional
        Distance between taxels, m, [1e-4, 1]; default 0.01. With `taxels` or `sites`, those without an area have the
        square of it; by default, their share of the surface among their neighbours.
    thickness : float
        Thickness of the foam, m. It lies on the surface of the geoms.
    wires : "link", "limb", int or None
        "link": a wire a link. "limb": a wire a limb; the links up to the first body from the root that branches are
        one, and those that hang on one child of that body are another. n: the taxels of all links over n wires of
        nearly equal numbers, [1, taxels]; an end of a wire is that of a link where it moves by a tenth of a wire at
        most. None: no wires. A column `wire` of `taxels` overrides the others: the taxels of an entry are a wire, in
        the order in which the entries first come.
    taxels : path, sequence of paths, dict of links to them or to arrays, optional
        Where the taxels are, a row each: x, y, z, and their outward normals nx, ny, nz, in the frame of the link.

        CSV: with a header of these names, and maybe `area`, `wire`, and one of `link`, `body`, `site`, `geom`, which name
        the frame of the place (a geom with a mesh has that of the mesh's file; a link is a body, or else a site or a
        geom); or three or six columns without one. JSON: a list of objects with these fields, or ``{"links": {name:
        {"points": [[x, y, z], ...], "normals": ..., "areas": ..., "wires": ...}}}``. The iCub's files of
        `skinGui/conf/positions`, whose `name` is the link unless a dict names another. Rows of zeros have no taxel. A
        file that names no link belongs to the only one of `links`. Arrays are of shape (n, 3) or (n, 6).

        A taxel is put onto the surface of its link's geoms if it is within 20 mm of it; without a normal, it has that of
        the surface.
    sites : str, optional
        In place of `taxels`, a pattern of names, such as "skin_*": a taxel at every such site, with the site's z axis as
        its normal. A box, an ellipsoid or a cylinder gives the area.
    unit : "m", "cm" or "mm"
        Unit of the lengths in `taxels`; areas are in its square.
    mode, tolerance
        As of `attach`.
    readout, seed
        As of `spts.Wire`; wire k has the seed `seed` + k.
    foam
        `stiffness`, `damping` and `friction`, as of `spts.Skin`.

    Returns
    -------
    Dress

    Raises
    ------
    ValueError
        For a name that the model does not have, a link without a surface, numbers outside their ranges, and files with
        what is no taxel, or two at one place, by their lines.

    Warns
    -----
    UserWarning
        For taxels that have no surface of their link near them that looks their way, and for links without skin.

    ::

        robot = spts.mujoco.dress(model, data)      # or: dress(model, data, taxels={"palm": "palm.csv"}, unit="mm")
        for _ in range(1000):
            touches = robot.step()           # in place of mujoco.mj_step(model, data)
        print(robot.taxels, sum(t.pressure.ravel() @ s.areas for t, s in zip(touches, robot.skins)))
    """
    if pitch is not None and not 1e-4 <= pitch <= 1.0:
        raise ValueError(f"`pitch` = {pitch} is outside [1e-4, 1] m")
    counted = isinstance(wires, (int, np.integer)) and not isinstance(wires, bool)
    if not (wires is None or counted or wires in ("link", "limb")):
        raise ValueError(f'`wires` = {wires!r}; valid: "link", "limb", a number of wires, None')
    every = isinstance(links, str)
    if every:
        if links != "all":
            raise ValueError(f'`links` = "{links}"; valid: "all" or a list of bodies')
        moving = (b for b in range(1, model.nbody) if model.body_weldid[b] != 0 and not _loose(model, b))
        links = [b for b in moving if _colliding(model, np.flatnonzero(model.geom_bodyid == b))]
    links = [_number(model, mujoco.mjtObj.mjOBJ_BODY, "links", link) for link in links]
    placed = None
    if taxels is not None or sites is not None:
        placed = _placed(model, taxels, sites, unit, None if every else links)
        links = list(placed)
    if not links:
        raise ValueError(
            "`links` is empty: no moving body but loose objects has a geom that collides. "
            "A loose object wears skin if it is named"
        )
    if data.time == 0.0 and not data.xmat.any():
        mujoco.mj_kinematics(model, data)
    shapes, meshes, bare, dressed = {}, {}, [], []
    for link in links:
        if placed is None:
            surface = _surface(model, data, link, 0.01 if pitch is None else pitch, meshes)
        else:
            surface = placed[link].lay(model, data, link, pitch, thickness, meshes)
        bodies = _all(model, link)
        if surface is None or not bodies:
            bare.append(model.body(link).name)
            continue
        positions, normals, areas = surface
        skin = Skin.from_points(positions + thickness * normals, normals, areas, thickness=thickness, **foam)
        dressed.append((link, skin, bodies))
        for body in bodies:
            if body not in shapes:
                shapes[body] = _body(model, body, meshes, tolerance)
    if bare:
        text = f"links that lie inside others, or that nothing may touch, wear no skin: {', '.join(bare)}"
        if not every or not dressed:
            raise ValueError(f"`links`: {text}")
        warnings.warn(text, stacklevel=2)
    links, skins = [link for link, *_ in dressed], [skin for _, skin, _ in dressed]
    attachments = [
        Attachment(
            model,
            data,
            skin,
            link,
            (0, 0, 0),
            (1, 0, 0, 0),
            bodies={body: shapes[body] for body in bodies},
            link_geoms=np.flatnonzero(model.geom_bodyid == link),
            mode=mode,
        )
        for link, skin, bodies in dressed
    ]
    placed = [] if placed is None else [placed[link] for link in links]
    made, wired = _wires(model, links, skins, wires, readout, seed, [part.wires for part in placed])
    names = [model.body(link).name for link in links]
    return Dress(attachments, made, names, wired, [part.rows for part in placed])


class _Placed:
    """Taxels of a link, in its axes, as they were written."""

    def __init__(self, parts):
        self.places, self.normals, self.areas = (np.concatenate(values) for values in list(zip(*parts))[:3])
        #: Tables and the numbers of their taxels.
        self._of = [part[3:] for part in parts]
        self.rows = np.concatenate([table.rows[taken] for table, taken in self._of])
        wires = [table.wires[taken] for table, taken in self._of if table.wires is not None]
        self.wires = np.concatenate(wires) if wires else None

    def where(self, k):
        for table, taken in self._of:
            if k < len(taken):
                return table.where(taken[k])
            k -= len(taken)

    def lay(self, model, data, link, pitch, thickness, meshes):
        """Positions, normals and areas on the surface of the link."""
        places, normals, areas = self.places, self.normals, self.areas
        name, count = model.body(link).name, len(places)
        place, counts = places_of(places)
        if counts.max() > 1:
            first = int(np.argmax(counts[place] > 1))
            second = int(np.flatnonzero(place == place[first])[1])
            text = f'two taxels are at one place, {places[first]} m of "{name}": {self.where(first)} and {self.where(second)}'
            if not all(table.shared for table, _ in self._of):
                raise ValueError(f"{text}; is the unit right?")
            many = int((counts[place] > 1).sum())
            warnings.warn(f"{text}; {many} of {count} share their places, and so their areas", stacklevel=3)
        on, facing, _ = _shell(model, data, link, _SPACING, meshes, 1000, alone=True)
        near = ((on > places.min(axis=0) - _NEAR) & (on < places.max(axis=0) + _NEAR)).all(axis=1)
        on, facing = (on[near], facing[near]) if near.any() else (on, facing)
        bare = np.flatnonzero(np.isnan(normals[:, 0]))
        if len(bare):
            found, away = nearest(places[bare], on, 1, _NEAR)
            if np.isinf(away).any():
                k = bare[np.argmax(away[:, 0])]
                raise ValueError(
                    f'{self.where(k)}: no normal, and no surface of "{name}" within {_NEAR:g} m to take it from'
                )
            normals[bare] = facing[found[:, 0]]
        found, away = (v[:, 0] for v in nearest(places, on, 1, _NEAR, (normals, facing)))
        lost = np.isinf(away)
        if lost.any():
            warnings.warn(
                f'{lost.sum()} of {count} taxels of "{name}" have no surface of its geoms within {_NEAR:g} m that looks '
                f"their way, and may feel nothing, such as {self.where(int(np.argmax(lost)))}: are unit, frame, link and "
                "the sign of the normals right?",
                stacklevel=3,
            )
        off = np.where(lost, 0.0, np.einsum("ij,ij->i", places - on[found], facing[found]))
        off[np.abs(off) <= thickness / 3.0] = 0.0
        places -= off[:, None] * facing[found]
        unknown = np.isnan(areas)
        if pitch is not None:
            areas[unknown] = pitch**2
        elif unknown.any():
            # a share of what its place has
            kept = np.unique(place, return_index=True)[1]
            shares = areas_of(places[kept], normals[kept]) / counts
            areas[unknown] = shares[place][unknown]
            if np.isnan(areas).any():
                k = int(np.argmax(np.isnan(areas)))
                raise ValueError(
                    f"{self.where(k)}: no area, and fewer than two taxels near it to tell it from; give `area` or `pitch`"
                )
        return places, normals, areas


# Distance between samples of surfaces that taxels are put onto, and farthest that a taxel may be from one, m.
_SPACING, _NEAR = 0.003, 0.02


def _placed(model, taxels, sites, unit, links):
    """Taxels by the numbers of their links; those of `links` alone, unless that is None."""
    if taxels is not None and sites is not None:
        raise ValueError("`taxels` and `sites` are both given; one of them says where the taxels are")
    found = [(None, _sites(model, sites))] if taxels is None else tables(taxels, unit)
    wired = [table.wires is not None for _, table in found]
    if any(wired) and not all(wired):
        raise ValueError(f"{found[wired.index(False)][1].source}: no column `wire`, which others have")
    parts = {}
    for link, table in found:
        frames = table.frames
        if link is not None or not frames:
            if link is not None and frames:
                raise ValueError(f'{table.source}: it has a column `{frames[0][0]}`, and is given for "{link}" too')
            link = table.link if link is None else link
            if link is None:
                if links is None or len(links) != 1:
                    raise ValueError(f"{table.source}: of which link? `taxels={{link: path}}` tells, or one of `links`")
                link = links[0]
        kind, named = frames[0] if frames else ("link", None)
        for name, taken in [(link, np.arange(len(table.rows)))] if named is None else _groups(named):
            body, pos, turn = _frame(model, f"{table.where(taken[0])}: `{kind}`", kind, name)
            places, normals = (turn @ table.places[taken].T).T + pos, (turn @ table.normals[taken].T).T
            parts.setdefault(body, []).append((places, normals, table.areas[taken], table, taken))
    if links is not None:
        missing = [model.body(link).name for link in links if link not in parts]
        if missing:
            raise ValueError(f"`links`: no taxel is on {', '.join(missing)}")
    return {link: _Placed(parts[link]) for link in (sorted(parts) if links is None else links)}


def _groups(labels):
    """Every label, in the order in which they first come, with the numbers of its entries."""
    seen = {}
    of = np.fromiter((seen.setdefault(label, len(seen)) for label in labels.tolist()), np.intp, len(labels))
    return zip(seen, np.split(np.argsort(of, kind="stable"), np.cumsum(np.bincount(of))[:-1]))


def _frame(model, field, kind, name):
    """Body, position and rotation of the frame that is called `name`, in that body's; a number is a body's."""
    if not isinstance(name, str):
        return _number(model, mujoco.mjtObj.mjOBJ_BODY, "taxels", name), np.zeros(3), np.eye(3)
    obj = mujoco.mjtObj
    known = {"body": obj.mjOBJ_BODY, "site": obj.mjOBJ_SITE, "geom": obj.mjOBJ_GEOM}
    kinds = list(known) if kind == "link" else [kind]
    numbers = {kind: mujoco.mj_name2id(model, known[kind], name) for kind in kinds}
    found = next((kind for kind in kinds if numbers[kind] >= 0), None)
    if found is None:
        names = (mujoco.mj_id2name(model, known[k], n) for k in kinds for n in range(_count(model, known[k])))
        names = list(filter(None, names))
        close = difflib.get_close_matches(name, names, 5, 0.5) or sorted(set(names))[:20]
        raise ValueError(f'{field}: the model has none called "{name}"; it has, among others: {", ".join(close)}')
    number = numbers[found]
    if found == "body":
        return number, np.zeros(3), np.eye(3)
    body = int(getattr(model, f"{found}_bodyid")[number])
    pos, turn = getattr(model, f"{found}_pos")[number].copy(), _rotation(getattr(model, f"{found}_quat")[number])
    if found == "geom" and model.geom_type[number] == mujoco.mjtGeom.mjGEOM_MESH:
        # MuJoCo moves a mesh to its middle and turns it to its axes
        mesh = model.geom_dataid[number]
        turn = turn @ _rotation(model.mesh_quat[mesh]).T
        pos -= turn @ model.mesh_pos[mesh]
    return body, pos, turn


def _rotation(quat):
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, quat)
    return rotation.reshape(3, 3)


def _sites(model, pattern):
    """The sites whose names a pattern has, as a table."""
    names = [model.site(k).name for k in range(model.nsite)]
    found = np.array([k for k, name in enumerate(names) if name and fnmatch.fnmatchcase(name, pattern)], int)
    if len(found) == 0:
        close = ", ".join(sorted(filter(None, names))[:20]) or "none with a name"
        raise ValueError(f'`sites` = "{pattern}": no site of the model has such a name; it has: {close}')
    columns = dict(zip(("x", "y", "z", "nx", "ny", "nz"), np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (len(found), 1)).T))
    columns["site"] = [names[k] for k in found]
    table = Table("`sites`", columns, word="site", numbers=columns["site"])
    # what a sphere or a capsule is drawn with says nothing of an area
    sizes, types = model.site_size[found], mujoco.mjtGeom
    across = {types.mjGEOM_BOX: (4.0, 1), types.mjGEOM_ELLIPSOID: (np.pi, 1), types.mjGEOM_CYLINDER: (np.pi, 0)}
    for shape, (factor, second) in across.items():
        of = model.site_type[found] == shape
        table.areas[of] = factor * sizes[of, 0] * sizes[of, second]
    return table


def _wires(model, links, skins, wires, readout, seed, labels=()):
    """Wires over the skins of links. Of each also the numbers of its links (one number: a touch is no sequence), and
    its taxels among theirs, None for all. `labels` are the wires of all taxels, an array a link, where a file says them.
    """
    if wires is None:
        return [], []
    if labels and labels[0] is not None:
        counts = np.array([len(part) for part in labels])
        link = np.repeat(np.arange(len(links)), counts)
        made, wired = [], []
        for _, numbers in _groups(np.concatenate(labels)):
            group, of = np.unique(link[numbers], return_inverse=True)
            # among the taxels of the wire's links
            skipped = (np.cumsum(counts) - counts)[group] - (np.cumsum(counts[group]) - counts[group])
            taxels = (numbers - skipped[of]).tolist()
            made.append(Wire([skins[k] for k in group], readout, seed=seed + len(made), taxels=taxels))
            wired.append((group.tolist(), taxels))
        return made, wired
    if isinstance(wires, str) and wires == "link":
        made = [Wire(skin, readout, seed=seed + k) for k, skin in enumerate(skins)]
        return made, [(k, None) for k in range(len(skins))]
    counts = np.array([skin.shape[0] * skin.shape[1] for skin in skins])
    ends = np.cumsum(counts)
    if isinstance(wires, str):
        groups = [(limb, None) for limb in _limbs(model, links)]
    else:
        if not 1 <= wires <= ends[-1]:
            raise ValueError(f"`wires` = {wires} is outside [1, {ends[-1]}], the number of taxels")
        share = ends[-1] / wires
        cuts = np.round(share * np.arange(1, wires)).astype(int)
        near = ends[np.abs(ends - cuts[:, None]).argmin(axis=1)]
        cuts = np.where(np.abs(near - cuts) <= 0.1 * share, near, cuts)
        groups = []
        for first, stop in zip([0, *cuts], [*cuts, ends[-1]]):
            group = np.flatnonzero((ends > first) & (ends - counts < stop)).tolist()
            skipped = ends[group[0]] - counts[group[0]]
            groups.append((group, range(first - skipped, stop - skipped)))
    made = [
        Wire([skins[k] for k in group], readout, seed=seed + wire, taxels=taxels)
        for wire, (group, taxels) in enumerate(groups)
    ]
    return made, groups


def _places(links, among, attachments):
    """Link and number there of every taxel of a wire: `among` are its taxels among those of `links`, None for all."""
    links = [links] if np.isscalar(links) else links
    counts = [len(attachments[k].skin.areas) for k in links]
    every = np.repeat(links, counts), np.concatenate([np.arange(n) for n in counts])
    return every if among is None else tuple(part[np.asarray(among)] for part in every)


def _limbs(model, links):
    """Numbers of the links of every limb, in the order of their first links."""
    paths = []
    for link in links:
        path = [link]
        while model.body_parentid[path[0]] != 0:
            path.insert(0, int(model.body_parentid[path[0]]))
        paths.append(path)
    limbs = {}
    for k, path in enumerate(paths):
        depth = 1
        # down the trunk: as long as all links below hang on one child
        while len({other[depth] for other in paths if other[:depth] == path[:depth] and len(other) > depth}) == 1:
            if len(path) == depth:
                break
            depth += 1
        # the trunk of a tree goes by its root
        limb = path[0] if len(path) <= depth else path[depth]
        limbs.setdefault(limb, []).append(k)
    return list(limbs.values())


class Dress:
    """Skins on the links of a robot: what `dress` returns."""

    def __init__(self, attachments, wires, names, wired=(), rows=()):
        #: A skin a link: what `attach` returns, in the order of the links.
        self.attachments = attachments
        #: The wires: one a link in the same order, one a limb, or as many as were asked for; empty without wires.
        self.wires = wires
        #: Where the taxels of every wire are, in its order: numbers of the links (taxels,), and of the taxels there.
        self.places = [_places(group, taxels, attachments) for group, taxels in wired]
        self._wired = [group for group, *_ in wired]
        self._decoders, self._spent = {}, {}
        #: Names of the links.
        self.names = names
        #: Numbers of the rows of the file that the taxels of every link come from, (taxels,) of int; empty by pitch.
        self.rows = rows
        self.model, self.data = attachments[0].model, attachments[0].data
        self._group = _Group(attachments)

    @property
    def skins(self):
        """A `spts.Skin` a link."""
        return [attachment.skin for attachment in self.attachments]

    @property
    def taxels(self):
        """Number of taxels of all links."""
        return sum(skin.shape[0] * skin.shape[1] for skin in self.skins)

    @property
    def touches(self):
        """The last touch of every link; None before the first step."""
        return [attachment.last for attachment in self.attachments]

    def record(self, measurements, weights=True):
        """Measures the last touches with every wire.

        Parameters
        ----------
        measurements : int
            Number of measurements of each wire, M.
        weights : bool
            As of `spts.Wire.record`: without them a touched taxel costs time, and an untouched one does not.

        Returns
        -------
        list of (ndarray (M,), ndarray (M, taxels) or None)
            As `spts.Wire.record` gives them, a pair a wire. `places` says where the taxels of a wire are.

        Raises
        ------
        ValueError
            For a robot that was dressed without wires.
        """
        if not self.wires:
            raise ValueError('`wires` = None: `dress(..., wires="link")` gives wires that can be recorded')
        # before the first step nothing has touched it
        touches = [skin.touch({}) if last is None else last for skin, last in zip(self.skins, self.touches)]
        felt = [touches[group] if np.isscalar(group) else [touches[i] for i in group] for group in self._wired]
        return [wire.record(touch, measurements, weights=weights) for wire, touch in zip(self.wires, felt)]

    def decode(self, measured, deadline=None, decoder="auto"):
        """Images of what the wires have measured: the best that there are after `deadline` seconds.

        At first every wire has the image max(0, Φᵀy/M). Then the wires are decoded, those with the largest signals
        first, as long as the time is likely to suffice: a wire takes as long as it took before. The first call learns
        the decoders, which may take seconds a wire: make it before the loop, without a deadline. With one, which wires
        are decoded depends on the machine.

        Parameters
        ----------
        measured : list of (ndarray (M,), ndarray (M, taxels))
            As `record` gives it.
        deadline : float, optional
            Time that the call may take, s; default: until all wires are decoded.
        decoder : str
            As of `spts.decode`.

        Returns
        -------
        list of (ndarray (taxels,), bool)
            A wire's image in the unit of its measurements, and whether it is the decoder's.

        Raises
        ------
        ValueError
            For another number of wires, and for a wire of more than 2,048 taxels: more wires have fewer.

        ::

            robot.decode(robot.record(40))                       # learns
            for _ in range(1000):
                robot.step()
                images = robot.decode(robot.record(40), deadline=5e-4)
        """
        begin = time.perf_counter()
        if len(measured) != len(self.wires):
            raise ValueError(f"`measured` has {len(measured)} entries; {len(self.wires)} are needed, one a wire")
        if deadline is not None and not deadline >= 0.0:
            raise ValueError(f"`deadline` = {deadline} is outside [0, inf) s")
        if any(phi is None for _, phi in measured):
            raise ValueError("`measured` has no rows of Φ: `record(...)` gives them, unless `weights=False`")
        images = [(np.maximum(y @ phi / len(y), 0.0), False) for y, phi in measured]
        order = sorted(range(len(measured)), key=lambda k: -float(measured[k][0] @ measured[k][0]))
        for k in order:
            left = math.inf if deadline is None else deadline - (time.perf_counter() - begin)
            if self._spent.get((k, decoder), 0.0) > left or left <= 0.0:
                if (k, decoder) in self._spent and left > 0.0:
                    # it may have been an exception
                    self._spent[k, decoder] *= 0.9
                continue
            learned, now = self._decoder(k, decoder), time.perf_counter()
            y, phi = measured[k]
            images[k] = learned.decode(phi, y).ravel(), True
            self._spent[k, decoder] = time.perf_counter() - now
        return images

    def _decoder(self, wire, name):
        """The decoder of a wire, which has learned from touches anywhere on one of its links."""
        if (wire, name) not in self._decoders:
            links, taxels = self.places[wire]
            if len(links) > MOST_TAXELS:
                raise ValueError(
                    f"wire {wire} has {len(links)} taxels; decoders know the places of {MOST_TAXELS} at most: more `wires`"
                )
            parts = [(np.flatnonzero(links == k), self.skins[k]) for k in np.unique(links)]
            parts = [(of, skin.positions[taxels[of]], skin.normals[taxels[of]]) for of, skin in parts]
            self._decoders[wire, name] = learned_of(name, parts)
        return self._decoders[wire, name]

    def step(self, steps=1):
        """Steps the model, in place of `mujoco.mj_step`; what every link feels."""
        for _ in range(steps):
            self._group.step()
        return self.touches

    def draw(self, scene, most=2e4):
        """Draws all taxels; as `Attachment.draw`."""
        for attachment in self.attachments:
            attachment.draw(scene, most)

    def reset(self):
        """Takes every body off all skins, as after `mujoco.mj_resetData`."""
        for attachment in self.attachments:
            attachment.reset()

    def detach(self):
        """Ends all skins."""
        for attachment in self.attachments:
            attachment.detach()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.detach()


# Samples along a pitch, from which taxels are made, most taxels of a geom, and neighbours that a rim may go to.
_SAMPLES, _MOST, _RIVALS = 5, 1_000_000, 10


def _surface(model, data, link, pitch, meshes):
    """Taxels on the surface of a link, in its axes: positions (n, 3), m, outward normals (n, 3) and areas (n,), m².
    None where all of it lies inside other geoms. `meshes` keeps the meshes of its geoms.

    Samples a fifth of the pitch apart on every geom, without those inside other geoms, are gathered by the cells of a grid
    of the pitch and by the side that they look to.
    """
    place, normal, area = _shell(model, data, link, pitch / _SAMPLES, meshes)
    if len(place) == 0:
        return None
    side = np.abs(normal).argmax(axis=1)
    side = 2 * side + (np.take_along_axis(normal, side[:, None], 1)[:, 0] > 0.0)
    at = np.floor(place / pitch + 0.5).astype(np.int64)
    at -= at.min(axis=0)
    wide = at.max(axis=0) + 1
    _, cell = np.unique(((at[:, 0] * wide[1] + at[:, 1]) * wide[2] + at[:, 2]) * 6 + side, return_inverse=True)
    whole, middle, mean = _gathered(cell, place, normal, area)
    # rims of cells go to their neighbour that looks the same way
    small = whole < 0.3 * pitch**2
    if small.any() and not small.all():
        kept = np.flatnonzero(~small)
        mean /= np.linalg.norm(mean, axis=1, keepdims=True)
        near, away = nearest(middle[small], middle[kept], min(_RIVALS, len(kept)))
        near = kept[near]
        away += pitch * (1.0 - np.einsum("ijk,ik->ij", mean[near], mean[small]))
        of = np.arange(len(whole))
        of[small] = np.take_along_axis(near, away.argmin(axis=1)[:, None], 1)[:, 0]
        cell = np.searchsorted(kept, of)[cell]
        whole, middle, mean = _gathered(cell, place, normal, area)
    # the sample nearest to the middle lies on the surface
    away = np.linalg.norm(place - middle[cell], axis=1)
    least = np.full(len(whole), np.inf)
    np.minimum.at(least, cell, away)
    best = np.flatnonzero(away == least[cell])[::-1]
    first = np.empty(len(whole), np.intp)
    first[cell[best]] = best
    return place[first], mean / np.linalg.norm(mean, axis=1, keepdims=True), whole


def _gathered(cell, place, normal, area):
    """Areas, middles and sums of the normals of cells."""
    whole = np.bincount(cell, area)
    sums = [np.bincount(cell, area * values) for values in (*place.T, *normal.T)]
    return whole, np.stack(sums[:3], 1) / whole[:, None], np.stack(sums[3:], 1)


def _shell(model, data, link, spacing, meshes, least=12, alone=False):
    """Places, normals and areas of samples on the geoms of a link, in its axes, at least `least` a geom. They lie in no
    other geom; with `alone`, in none of the link."""
    geoms = _colliding(model, np.flatnonzero(model.geom_bodyid == link))
    no_surface = (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD))
    geoms = [g for g in geoms if model.geom_type[g] not in no_surface]
    if not geoms:
        raise ValueError(f'`links`: "{model.body(link).name}" has no geom with a surface that collides')
    others = model.geom_bodyid == link
    if not alone:
        others |= model.body_weldid[model.geom_bodyid] != 0
    others = _colliding(model, np.flatnonzero(others))
    turn, origin = data.xmat[link].reshape(3, 3), data.xpos[link]
    places, normals, areas = [], [], []
    for geom in geoms:
        vertices, faces = meshes[geom] = _mesh(model, geom)
        place, normal, area = _samples(vertices[faces], spacing, least)
        # faster than place @ turn.T, by 30 times
        at = (turn @ place.T).T + origin
        # a sample on the surface of its own geom is not inside it
        inside = np.zeros(len(at), bool)
        for other in others:
            apart = np.linalg.norm(data.geom_xpos[other] - data.geom_xpos[geom])
            if other != geom and apart < model.geom_rbound[other] + model.geom_rbound[geom]:
                to = at - data.geom_xpos[other]
                near = np.flatnonzero(np.einsum("ij,ij->i", to, to) < model.geom_rbound[other] ** 2)
                inside[near] |= _inside(model, data, other, at[near])
        places.append(place[~inside]), normals.append(normal[~inside]), areas.append(area[~inside])
    return tuple(np.concatenate(part) for part in (places, normals, areas))


def _samples(corners, spacing, least):
    """Places, normals and areas of samples about `spacing` apart on triangles (n, 3, 3)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    cross = np.cross(b - a, c - a)
    double = np.linalg.norm(cross, axis=1)
    corners, cross, double = corners[double > 0.0], cross[double > 0.0], double[double > 0.0]
    # as many as the area asks for, evenly along the sum of the areas, in an order that has no rows of triangles
    order = np.argsort(np.arange(len(double)) * 0.6180339887498949 % 1.0)
    corners, cross, double = corners[order], cross[order], double[order]
    ends = np.cumsum(0.5 * double)
    if ends[-1] > _MOST * (_SAMPLES * spacing) ** 2:
        raise ValueError(
            f"`pitch` = {_SAMPLES * spacing:g} m makes {ends[-1] / (_SAMPLES * spacing) ** 2:.3g} taxels of one geom; at most {_MOST}"
        )
    count = max(least, math.ceil(ends[-1] / spacing**2))
    number = np.arange(count)
    of = np.minimum(np.searchsorted(ends, (number + 0.5) * (ends[-1] / count)), len(ends) - 1)
    # the R2 sequence of M. Roberts (2018), folded into the triangle
    u, v = (0.5 + 0.7548776662466927 * (number + 1)) % 1.0, (0.5 + 0.5698402909980532 * (number + 1)) % 1.0
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    a, ab, ac = (
        np.ascontiguousarray(side) for side in (corners[:, 0], *(corners[:, 1:] - corners[:, :1]).swapaxes(0, 1))
    )
    place = a[of]
    place += u[:, None] * ab[of]
    place += v[:, None] * ac[of]
    return place, (cross / double[:, None])[of], np.full(count, ends[-1] / count)


def _inside(model, data, geom, places):
    """Which places, in the world, are inside a geom; of meshes, inside their box of half the size."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    at = (data.geom_xmat[geom].reshape(3, 3).T @ (places - data.geom_xpos[geom]).T).T
    types = mujoco.mjtGeom
    along = np.abs(at[:, 2])
    across = np.hypot(at[:, 0], at[:, 1])
    if kind == types.mjGEOM_SPHERE:
        return np.linalg.norm(at, axis=1) < size[0]
    if kind == types.mjGEOM_CAPSULE:
        return np.hypot(across, np.maximum(along - size[1], 0.0)) < size[0]
    if kind == types.mjGEOM_CYLINDER:
        return (across < size[0]) & (along < size[1])
    if kind == types.mjGEOM_ELLIPSOID:
        return np.linalg.norm(at / size, axis=1) < 1.0
    if kind == types.mjGEOM_BOX:
        return (np.abs(at) < size).all(axis=1)
    if kind == types.mjGEOM_MESH:
        half = model.geom_aabb[geom, 3:]
        return (np.abs(at - model.geom_aabb[geom, :3]) < 0.5 * half).all(axis=1)
    return np.zeros(len(places), bool)


# Skins in mode "foam" that every step feels, by the address of their data, and the callback that was set before them.
_HOOKED, _BEFORE = {}, []


def _hooked(data):
    group = _HOOKED.get(data._address)
    return [] if group is None else list(group.attachments)


# By addresses: MuJoCo also calls it for models that it is compiling, which have no object in Python.
@ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
def _control(model, data):
    group = _HOOKED.get(data)
    before = _BEFORE[-1] if _BEFORE else None
    if isinstance(before, ctypes._CFuncPtr):
        before(model, data)
    elif before is not None and group is not None:
        before(group.model, group.data)
    if group is None:
        return
    try:
        elapsed = [attachment._elapsed() for attachment in group.attachments]
        group.press(always=True)
        group._hold(max(elapsed))
        group.read(max(elapsed))
        for attachment in group.attachments:
            if attachment._each is not None:
                attachment._each(attachment._last)
    except Exception as error:
        # a step of others cannot raise it
        group.attachments[0]._failed = error


def step(*attachments):
    """Steps a model with several skins once, in place of `mujoco.mj_step`.

    Parameters
    ----------
    attachments : Attachment
        Of one model and data.

    Returns
    -------
    list of spts.Touch
        What each feels, in the order of `attachments`.
    """
    group = attachments[0]._group
    if (
        group is None
        or len(group.attachments) != len(attachments)
        or any(a is not b for a, b in zip(group.attachments, attachments))
    ):
        group = attachments[0]._group = _Group(list(attachments))
    group.step()
    return [attachment.last for attachment in attachments]


def body_of(model, body, tolerance=None):
    """`spts.Body` of a body of a model: its geoms that collide, or all of them when none does.

    Parameters
    ----------
    model : mujoco.MjModel
    body : str or int
    tolerance : float, optional
        By how much the surface of meshes may err, m, for a faster touch; default 0. A body of planes, spheres,
        capsules, cylinders, boxes and ellipsoids alone does not err.

    Raises
    ------
    ValueError
        For a body without a geom, and for SDFs, which have no mesh.
    """
    return _body(model, _number(model, mujoco.mjtObj.mjOBJ_BODY, "body", body), {}, tolerance)


def _body(model, body, meshes, tolerance):
    """As `body_of`; `meshes` holds those of geoms that are known."""
    geoms = np.flatnonzero(model.geom_bodyid == body)
    geoms = _colliding(model, geoms) or geoms.tolist()
    parts = [meshes[g] if g in meshes else _mesh(model, g) for g in geoms]
    if not parts:
        raise ValueError(f'body "{model.body(body).name}" has no geom; give its shape: bodies={{name: spts.Body}}')
    vertices, faces, first = [], [], 0
    for points, triangles in parts:
        vertices.append(points)
        faces.append(triangles + first)
        first += len(points)
    shapes = [_shape(model, geom) for geom in geoms]
    shapes = shapes if all(shapes) else []
    vertices, faces = np.concatenate(vertices), np.concatenate(faces)
    return Body.from_vertices(vertices, faces, parts=shapes, tolerance=None if shapes else tolerance)


def _shape(model, geom):
    """A geom as a part of a `spts.Body`; None for what has no closed form."""
    kind = mujoco.mjtGeom(int(model.geom_type[geom])).name[7:].lower()
    if kind not in ("plane", "sphere", "capsule", "ellipsoid", "cylinder", "box"):
        return None
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
    size = np.zeros(3) if kind == "plane" else model.geom_size[geom]
    return kind, size.tolist(), model.geom_pos[geom].tolist(), rotation.tolist()


def _of_geom(model, name):
    """The body with the geom called `name`, if no body is called so: a floor often is a geom of the world."""
    if not isinstance(name, str) or mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name) >= 0:
        return None
    geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name)
    return int(model.geom_bodyid[geom]) if geom >= 0 else None


def _colliding(model, geoms):
    return [int(g) for g in geoms if model.geom_contype[g] or model.geom_conaffinity[g]]


def _loose(model, body):
    """Whether a body is on a free joint and has no child."""
    joint = model.body_jntadr[body]
    free = joint >= 0 and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
    return bool(free) and not (model.body_parentid == body).any()


def _all(model, link):
    """Bodies with geoms that collide, but the kinematic neighbours of `link`."""
    weld = model.body_weldid
    near = {weld[link], weld[model.body_parentid[weld[link]]]}
    below = (
        {b for b in range(1, model.nbody) if weld[model.body_parentid[weld[b]]] == weld[link]} if weld[link] else set()
    )
    excluded = set(model.exclude_signature.tolist())
    # MuJoCo lets two geoms touch if the type of one has a bit in common with the affinity of the other
    own = _colliding(model, np.flatnonzero(_covered(model, link)))
    types = int(np.bitwise_or.reduce(model.geom_contype[own])) if own else -1
    affinities = int(np.bitwise_or.reduce(model.geom_conaffinity[own])) if own else -1
    meets = (model.geom_contype & affinities != 0) | (model.geom_conaffinity & types != 0)
    bodies = []
    for body in range(model.nbody):
        # what stands still is one: a link of the world is touched by all that moves, and one that moves by the world
        if weld[body] in near - {0} or body in below or weld[body] == weld[link]:
            continue
        if (min(body, link) << 16) + max(body, link) in excluded:
            continue
        if meets[_colliding(model, np.flatnonzero(model.geom_bodyid == body))].any():
            bodies.append(body)
    return bodies


# Side of the block that stands for a plane, m.
_WIDE = 200.0


def _field(model, field):
    """Vertices and faces of a height field, as the block under its surface."""
    rows, cols = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    half_x, half_y, high, base = model.hfield_size[field]
    first = model.hfield_adr[field]
    heights = model.hfield_data[first : first + rows * cols].reshape(rows, cols)
    x, y = np.meshgrid(np.linspace(-half_x, half_x, cols), np.linspace(-half_y, half_y, rows))
    top = np.stack([x, y, heights * high], axis=-1).reshape(-1, 3)
    bottom = top * (1.0, 1.0, 0.0) - (0.0, 0.0, base)
    at = np.arange(rows * cols).reshape(rows, cols)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel(), at[1:, :-1].ravel()
    lid = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    rim = np.concatenate([at[0, :], at[1:, -1], at[-1, -2::-1], at[-2:0:-1, 0]])
    after, n = np.roll(rim, -1), rows * cols
    walls = np.concatenate([np.stack([rim, rim + n, after + n], 1), np.stack([rim, after + n, after], 1)])
    return np.concatenate([top, bottom]), np.concatenate([lid, lid[:, ::-1] + n, walls])


def _mesh(model, geom):
    """Vertices and faces of a geom, in its body's axes."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    types = mujoco.mjtGeom
    if kind == types.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        vertices = model.mesh_vert[first : first + count].astype(np.float64)
        first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
        faces = model.mesh_face[first : first + count].astype(np.int64)
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        if np.einsum("ij,ij->", a, np.cross(b, c)) < 0.0:
            # MuJoCo keeps such meshes as they are
            name = model.mesh(mesh).name
            warnings.warn(f'mesh "{name}" of geom {geom} is inside out; it presses as if it were turned', stacklevel=2)
            faces = faces[:, ::-1]
    elif kind == types.mjGEOM_PLANE:
        # MuJoCo's planes press without end, whatever is drawn of them
        vertices, faces = Body.box((1.0, 1.0, 1.0)).mesh
        vertices = (vertices - (0.0, 0.0, 0.5)) * _WIDE
    elif kind == types.mjGEOM_HFIELD:
        vertices, faces = _field(model, model.geom_dataid[geom])
    else:
        if kind == types.mjGEOM_SPHERE:
            shape = Body.sphere(size[0])
        elif kind == types.mjGEOM_ELLIPSOID:
            shape = Body.sphere(1.0)
        elif kind == types.mjGEOM_BOX:
            shape = Body.box(2.0 * size)
        elif kind == types.mjGEOM_CYLINDER:
            shape = Body.cylinder(size[0], 2.0 * size[1])
        elif kind == types.mjGEOM_CAPSULE:
            shape = Body.capsule(size[0], 2.0 * size[1])
        else:
            raise ValueError(
                f"geom {geom} is a {types(int(kind)).name[7:].lower()}, which has no mesh; give its shape: bodies={{name: spts.Body}}"
            )
        vertices, faces = shape.mesh
        if kind == types.mjGEOM_ELLIPSOID:
            vertices = vertices * size
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
    return vertices @ rotation.reshape(3, 3).T + model.geom_pos[geom], faces


def _covered(model, link):
    """Geoms of a link, (geoms,) of bool."""
    weld = model.body_weldid[link]
    return (model.geom_bodyid if weld == 0 else model.body_weldid[model.geom_bodyid]) == (link if weld == 0 else weld)


class _Arrays:
    """The arrays of an mjData that a mount reads and writes."""

    def __init__(self, data):
        for name in ("xpos", "xmat", "cvel", "subtree_com"):
            setattr(self, name, getattr(data, name))


def _number(model, kind, field, name):
    """Number of what is called `name`."""
    if isinstance(name, str):
        number = mujoco.mj_name2id(model, kind, name)
        if number < 0:
            every = (mujoco.mj_id2name(model, kind, k) for k in range(_count(model, kind)))
            known = ", ".join(sorted(n for n in every if n)) or "none with a name"
            raise ValueError(f'`{field}`: the model has none called "{name}"; it has: {known}')
        return number
    number, count = int(name), _count(model, kind)
    if not 0 <= number < count:
        raise ValueError(f"`{field}` = {number} is outside [0, {count - 1}]")
    return number


def _count(model, kind):
    counts = {mujoco.mjtObj.mjOBJ_SITE: model.nsite, mujoco.mjtObj.mjOBJ_BODY: model.nbody}
    return counts.get(kind, model.ngeom)
