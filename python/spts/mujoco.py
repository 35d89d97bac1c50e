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
carries the bodies, where there is foam, in place of MuJoCo's contact: it gives way and bounces as foam does, and needs a
short step. Everywhere else, for other data and for copies, MuJoCo's contact stays; the model is not changed.
"""

from __future__ import annotations

import ctypes
import math
import warnings

import mujoco
import numpy as np

from ._spts import Body, Mount

# Courant-like number of a foam and the mass on it above which the step is called too long. With semi-implicit steps the
# two are stable as long as k dt²/m + 2 c dt/m < 4.
_LONG = 1.0


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
        collide, unless a `spts.Body` is given. "all"
        are those with such geoms but the skin's own link, what is welded to it, and what a joint connects with it.
    link_geoms : sequence of str or int, optional
        Geoms that the skin covers: MuJoCo's contact between them and `bodies` is felt where there is foam, or taken out in
        mode "foam". Default: all geoms of the skin's body and, unless that stands still, of what is welded to it. A skin
        on the world covers those that are not of `bodies`.
    mode : str
        "sense": MuJoCo's contact moves the bodies, and the skin reads its forces. "foam": the foam moves them.

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
    return Attachment(model, data, skin, *place, bodies=bodies, link_geoms=link_geoms, mode=mode)


class Attachment:
    """A skin on a link of a model: what `attach` returns."""

    def __init__(self, model, data, skin, link, pos, quat, *, bodies="all", link_geoms=None, mode="sense"):
        if mode not in ("sense", "foam"):
            raise ValueError(f'`mode` = "{mode}"; valid: "sense", "foam"')
        self.mode = mode
        if mode == "foam" and model.opt.enableflags & getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0):
            raise ValueError(
                "`model.opt.enableflags` has `sleep`: foam does not wake what sleeps; clear it, or let the bodies stay awake"
            )
        pos, quat = (np.asarray(v, np.float64) for v in (pos, quat))
        if pos.shape != (3,) or quat.shape != (4,) or not (np.isfinite(pos).all() and np.linalg.norm(quat) > 1e-9):
            raise ValueError(
                f"`pos` = {pos}, `quat` = {quat}: three finite numbers, and four that are not all 0, are needed"
            )
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, quat / np.linalg.norm(quat))
        self.model, self.data, self.skin = model, data, skin
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
            self.bodies[number] = body_of(model, number) if shape is None else shape
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
        # what a load moves at the least: inverse masses of the body and of the link add up
        inverse = model.body_invweight0[:, 0]
        self._mass = min(1.0 / max(inverse[b] + inverse[link], 1e-12) for b in self.bodies)
        self._link, self._place = link, (pos, rotation.reshape(3, 3))
        self._last = self._failed = None
        self._warned = False
        self._felt_at = None
        self._each = None
        # whether every look is at the present moment of the data
        self._follows = False

    @property
    def last(self):
        """The last touch; None before the first step. An error in a step of others is raised here."""
        if self._failed is not None:
            failed, self._failed = self._failed, None
            raise failed
        if self._follows and self.data.time != self._felt_at:
            self._read(self._elapsed())
        return self._last

    @property
    def pressure(self):
        """Mean pressure over every taxel, Pa, (rows, cols)."""
        return np.zeros(self.skin.shape) if self.last is None else self._last.pressure

    def step(self, steps=1):
        """Steps the model, in place of `mujoco.mj_step`; the last `spts.Touch`."""
        for _ in range(steps):
            step(self)
        return self._last

    def reset(self):
        """Takes every body off the skin and begins its time anew, as after `mujoco.mj_resetData`."""
        self.skin.reset()
        self._last = self._felt_at = None

    def hook(self, each=None):
        """Lets every `mujoco.mj_step` of the data feel the skin, whoever calls it: environments and viewers that step
        by themselves. `step` is not needed then. Ends with `detach`.

        Parameters
        ----------
        each : callable, optional
            Called with every touch, in mode "foam".

        In mode "sense", `last` then is what the skin feels at the present moment of the data. In mode "foam" the forces go into `qfrc_passive` by MuJoCo's callback `mjcb_passive`, for this data alone; one that is set already
        is called first.
        """
        if self.mode == "sense":
            if each is not None:
                raise ValueError(
                    '`each` needs mode "foam": in mode "sense" nothing is called in a step; look at `last` after it'
                )
            self._follows = True
            return
        off = self.model.opt.disableflags
        if all(off & flag for flag in _PASSIVE_OFF):
            raise ValueError("`model.opt.disableflags` turns passive forces off, and with them the skin; use `step`")
        if not _HOOKED:
            _BEFORE.append(mujoco.get_mjcb_passive())
            mujoco.set_mjcb_passive(_passive)
        hooked = _HOOKED.setdefault(self.data._address, [])
        if self not in hooked:
            hooked.append(self)
        self._each = each

    def detach(self):
        """Ends the skin: MuJoCo's contact acts everywhere again, and `hook` has ended."""
        self._follows = False
        hooked = _HOOKED.get(self.data._address, [])
        if self in hooked:
            hooked.remove(self)
            if not hooked:
                del _HOOKED[self.data._address]
            if not _HOOKED:
                mujoco.set_mjcb_passive(_BEFORE.pop())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.detach()

    def _apply(self, dt):
        self._last = self._mount.apply(dt)
        self._warn(dt)

    def _read(self, dt):
        """Feels the forces of MuJoCo's contact that the data has."""
        model, data, contact = self.model, self.data, self.data.contact
        loads, force = {}, np.empty(6)
        for k in np.flatnonzero(self._foamed(contact)) if data.ncon else ():
            if contact.efc_address[k] < 0:
                continue
            mujoco.mj_contactForce(model, data, k, force)
            geoms, pos = contact.geom[k], contact.pos[k]
            first = self._others[geoms[0]]
            body = int(model.geom_bodyid[geoms[0 if first else 1]])
            # the contact's normal points from its first geom to its second, and the force is on the second
            frame = contact.frame[k].reshape(3, 3)
            sign = -1.0 if first else 1.0
            push = sign * (force[:3] @ frame)
            twist = sign * (force[3:] @ frame) + np.cross(pos - data.xpos[body], push)
            normal, at, pushed, twisted = loads.get(body, (0.0, 0.0, 0.0, 0.0))
            loads[body] = normal + force[0], at + force[0] * pos, pushed + push, twisted + twist
        found = [
            (body, float(normal), (at / normal).tolist(), push.tolist(), twist.tolist())
            for body, (normal, at, push, twist) in loads.items()
            if normal > 0.0
        ]
        self._last = self._mount.read(dt, found)

    def _foamed(self, contact):
        """Which contacts are between the link and the bodies, where there is foam: (contacts,) of bool."""
        geoms = contact.geom
        own, others = self._own[geoms], self._others[geoms]
        # a flex has no geom
        found = (geoms >= 0).all(axis=1) & (own[:, 0] & others[:, 1] | others[:, 0] & own[:, 1])
        for k in np.flatnonzero(found):
            pos, rotation = self._place
            turn = self.data.xmat[self._link].reshape(3, 3)
            at = rotation.T @ (turn.T @ (contact.pos[k] - self.data.xpos[self._link]) - pos)
            found[k] = self.skin.covers(at)
        return found

    def _elapsed(self):
        """Time since the last touch, s. It runs only when the data's does: `mj_forward` repeats a moment."""
        time, before = self.data.time, self._felt_at
        if before is not None and time < before:
            # the data was reset
            self.reset()
            before = None
        self._felt_at = time
        return 0.0 if before is None else time - before

    def _passive(self):
        """Adds the forces to `qfrc_passive`."""
        data = self.data
        self._last, loads = self._mount.loads(self._elapsed())
        for body, load in loads:
            mujoco.mj_applyFT(self.model, data, load[:3], load[3:], data.xipos[body], body, data.qfrc_passive)
        if self._each is not None:
            self._each(self._last)
        self._warn(self.model.opt.timestep)

    def _warn(self, dt):
        if not self._warned and self._last.area > 0.0:
            stiffness, damping = self._mount.stiffness
            number = (stiffness * dt + 2.0 * damping) * dt / self._mass
            if number > _LONG:
                self._warned = True
                longest = (math.sqrt(damping**2 + _LONG * stiffness * self._mass) - damping) / stiffness
                warnings.warn(
                    f"`model.opt.timestep` = {dt:g} s is long for the foam: {stiffness:.3g} N/m and {damping:.3g} N s/m on "
                    f"{self._mass:.3g} kg need {longest:.2g} s or less",
                    RuntimeWarning,
                    stacklevel=5,
                )


# Skins that every step feels, by the address of their data, and the callback that was set before them.
_HOOKED, _BEFORE = {}, []
_PASSIVE_OFF = [
    getattr(mujoco.mjtDisableBit, name)
    for name in ("mjDSBL_PASSIVE", "mjDSBL_SPRING", "mjDSBL_DAMPER")
    if hasattr(mujoco.mjtDisableBit, name)
]


# By addresses: MuJoCo also calls it for models that it is compiling, which have no object in Python.
@ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
def _passive(model, data):
    hooked = _HOOKED.get(data, ())
    before = _BEFORE[-1] if _BEFORE else None
    if isinstance(before, ctypes._CFuncPtr):
        before(model, data)
    elif before is not None and hooked:
        before(hooked[0].model, hooked[0].data)
    if hooked:
        try:
            _take_out(hooked)
        except Exception as error:
            hooked[0]._failed = error
    for attachment in hooked:
        try:
            attachment._passive()
        except Exception as error:
            # a step of others cannot raise it
            attachment._failed = error


def _take_out(attachments):
    """Takes MuJoCo's contacts out of this step where there is foam. Computes the constraints again without them."""
    model, data = attachments[0].model, attachments[0].data
    if data.ncon == 0:
        return
    contact = data.contact
    found = np.logical_or.reduce([attachment._foamed(contact) for attachment in attachments])
    found &= contact.exclude == 0
    if found.any():
        contact.exclude[found] = 1
        mujoco.mj_makeConstraint(model, data)
        if hasattr(mujoco, "mj_island"):
            mujoco.mj_island(model, data)
        mujoco.mj_projectConstraint(model, data)


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
    model, data = attachments[0].model, attachments[0].data
    if any(a.model is not model or a.data is not data for a in attachments):
        raise ValueError("`attachments` are of several models or data; one step moves one of them")
    foams = [attachment for attachment in attachments if attachment.mode == "foam"]
    if not foams:
        mujoco.mj_step(model, data)
    elif model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
        raise ValueError(
            "`model.opt.integrator` = RK4; valid: Euler, implicit, implicitfast; with RK4 use `hook()` and `mj_step`"
        )
    else:
        mujoco.mj_step1(model, data)
        _take_out(foams)
        mujoco.mj_referenceConstraint(model, data)
        done = []
        try:
            for attachment in foams:
                attachment._apply(model.opt.timestep)
                done.append(attachment)
            mujoco.mj_step2(model, data)
        finally:
            for attachment in reversed(done):
                attachment._mount.restore()
    for attachment in attachments:
        if attachment.mode == "sense":
            attachment._read(model.opt.timestep)
    return [attachment._last for attachment in attachments]


def body_of(model, body):
    """`spts.Body` of a body of a model: its geoms that collide, or all of them when none does.

    Parameters
    ----------
    model : mujoco.MjModel
    body : str or int

    Raises
    ------
    ValueError
        For a body without a geom, and for SDFs, which have no mesh.
    """
    body = _number(model, mujoco.mjtObj.mjOBJ_BODY, "body", body)
    geoms = np.flatnonzero(model.geom_bodyid == body)
    parts = [_mesh(model, int(g)) for g in (_colliding(model, geoms) or geoms)]
    if not parts:
        raise ValueError(f'body "{model.body(body).name}" has no geom; give its shape: bodies={{name: spts.Body}}')
    vertices, faces, first = [], [], 0
    for points, triangles in parts:
        vertices.append(points)
        faces.append(triangles + first)
        first += len(points)
    return Body.from_vertices(np.concatenate(vertices), np.concatenate(faces))


def _of_geom(model, name):
    """The body with the geom called `name`, if no body is called so: a floor often is a geom of the world."""
    if not isinstance(name, str) or mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name) >= 0:
        return None
    geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name)
    return int(model.geom_bodyid[geom]) if geom >= 0 else None


def _colliding(model, geoms):
    return [int(g) for g in geoms if model.geom_contype[g] or model.geom_conaffinity[g]]


def _all(model, link):
    """Bodies with geoms that collide, but the kinematic neighbours of `link`."""
    weld = model.body_weldid
    near = {weld[link], weld[model.body_parentid[weld[link]]]}
    below = (
        {b for b in range(1, model.nbody) if weld[model.body_parentid[weld[b]]] == weld[link]} if weld[link] else set()
    )
    excluded = set(model.exclude_signature.tolist())
    bodies = []
    for body in range(model.nbody):
        # what stands still is one: a link of the world is touched by all that moves, and one that moves by the world
        if weld[body] in near - {0} or body in below or weld[body] == weld[link]:
            continue
        if (min(body, link) << 16) + max(body, link) in excluded:
            continue
        if _colliding(model, np.flatnonzero(model.geom_bodyid == body)):
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
            # inside out: MuJoCo keeps such meshes as they are
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
        for name in ("xpos", "xmat", "xipos", "cvel", "subtree_com", "xfrc_applied"):
            setattr(self, name, getattr(data, name))


def _number(model, kind, field, name):
    """Number of what is called `name`."""
    if isinstance(name, str):
        number = mujoco.mj_name2id(model, kind, name)
        if number < 0:
            every = (mujoco.mj_id2name(model, kind, k) for k in range(_count(model, kind)))
            known = ", ".join(sorted(n for n in every if n))
            raise ValueError(f'`{field}`: the model has none called "{name}"; it has: {known}')
        return number
    number, count = int(name), _count(model, kind)
    if not 0 <= number < count:
        raise ValueError(f"`{field}` = {number} is outside [0, {count - 1}]")
    return number


def _count(model, kind):
    counts = {mujoco.mjtObj.mjOBJ_SITE: model.nsite, mujoco.mjtObj.mjOBJ_BODY: model.nbody}
    return counts.get(kind, model.ngeom)
