"""A skin in somebody's own MuJoCo model: any model, any version of `mujoco` from 3.0 on. Needs `mujoco`.

::

    touch = spts.mujoco.attach(model, data, skin, site="palm", bodies=["cup"])
    for _ in range(1000):
        felt = touch.step()                  # in place of mujoco.mj_step(model, data)
        y, phi = wire.record(felt, 20)
    touch.detach()

The skin's frame is the site's: z outward, the free surface of a flat skin in the plane z = 0. The foam carries the bodies
in place of MuJoCo's own contact between them and the skin's link, which is taken out; every other contact stays.
"""

from __future__ import annotations

import math
import warnings

import mujoco
import numpy as np

from ._spts import Body, Mount

# Courant-like number of a foam and the mass on it above which the step is called too long. With semi-implicit steps the
# two are stable as long as k dt²/m + 2 c dt/m < 4.
_LONG = 1.0


def attach(model, data, skin, *, site, bodies, link_geoms=None):
    """Puts `skin` on a site of a model.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
    skin : spts.Skin
    site : str or int
        Where the skin is: its frame is the site's.
    bodies : sequence of str or int, or dict of them to spts.Body
        Bodies that may touch the skin. Their shapes are their geoms that collide, unless a `spts.Body` is given.
    link_geoms : sequence of str or int, optional
        Geoms that the skin covers: MuJoCo's contact between them and `bodies` is taken out. Default: all geoms of the
        site's body and, unless that stands still, of what is welded to it. A site of the world needs them said.

    Returns
    -------
    Attachment

    Raises
    ------
    ValueError
        For a name that the model does not have, a body without a shape, and what this cannot do (said in the text).
    """
    return Attachment(model, data, skin, site=site, bodies=bodies, link_geoms=link_geoms)


class Attachment:
    """A skin on a site of a model: what `attach` returns."""

    def __init__(self, model, data, skin, *, site, bodies, link_geoms=None):
        self.model, self.data, self.skin = model, data, skin
        site = _number(model, mujoco.mjtObj.mjOBJ_SITE, "site", site)
        link = int(model.site_bodyid[site])
        given = bodies if isinstance(bodies, dict) else {body: None for body in bodies}
        if not given:
            raise ValueError("`bodies` is empty: which bodies may touch the skin?")
        #: The `spts.Body` of every body of the model that may touch the skin, by its number: the keys of `wrenches`.
        self.bodies = {}
        for name, shape in given.items():
            number = _number(model, mujoco.mjtObj.mjOBJ_BODY, "bodies", name)
            if number == link or model.body_weldid[number] == model.body_weldid[link] != 0:
                raise ValueError(f'`bodies`: "{name}" is a part of the skin\'s own link')
            self.bodies[number] = body_of(model, number) if shape is None else shape
        if link_geoms is None:
            own = _covered(model, link)
        else:
            own = [_number(model, mujoco.mjtObj.mjOBJ_GEOM, "link_geoms", geom) for geom in link_geoms]
        others = [int(g) for g in np.flatnonzero(np.isin(model.geom_bodyid, list(self.bodies)))]
        self._mount = Mount(skin, site, link, list(self.bodies.items()), model.body_rootid.tolist(), _Arrays(data))
        self._contact = _Contact(model, own, others)
        # what a load moves at the least: inverse masses of the body and of the link add up
        inverse = model.body_invweight0[:, 0]
        self._mass = min(1.0 / max(inverse[b] + inverse[link], 1e-12) for b in self.bodies)
        self._last = None
        self._warned = False
        self._felt_at = None
        self._each = None

    @property
    def last(self):
        """The last touch; None before the first step."""
        return self._last

    @property
    def pressure(self):
        """Mean pressure over every taxel, Pa, (rows, cols)."""
        return np.zeros(self.skin.shape) if self._last is None else self._last.pressure

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
            Called with every touch.

        The forces go into `qfrc_passive` by MuJoCo's callback `mjcb_passive`; one that is set already is called too.
        """
        if self not in _HOOKED:
            if not _HOOKED:
                _OTHERS.append(mujoco.get_mjcb_passive())
                mujoco.set_mjcb_passive(_passive)
            _HOOKED.append(self)
        self._each = each

    def detach(self):
        """Gives MuJoCo its contact back, and ends `hook`. Everything else stays as it is."""
        self._contact.restore()
        if self in _HOOKED:
            _HOOKED.remove(self)
            if not _HOOKED:
                mujoco.set_mjcb_passive(_OTHERS.pop())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.detach()

    def _apply(self, dt):
        self._last = self._mount.apply(dt)
        self._warn(dt)

    def _passive(self):
        """Adds the forces to `qfrc_passive`. Time runs only when the data's does: `mj_forward` repeats a moment."""
        data = self.data
        elapsed = 0.0 if self._felt_at is None else data.time - self._felt_at
        if elapsed < 0.0:
            # the data was reset
            self.reset()
            elapsed = 0.0
        self._felt_at = data.time
        self._last, loads = self._mount.loads(elapsed)
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


# Skins that every step feels, and the callback that was set before them.
_HOOKED, _OTHERS = [], []


def _passive(model, data):
    if _OTHERS and _OTHERS[-1] is not None:
        _OTHERS[-1](model, data)
    for attachment in _HOOKED:
        if attachment.data is data:
            attachment._passive()


def step(*attachments):
    """Steps a model with several skins once, in place of `mujoco.mj_step`.

    Parameters
    ----------
    attachments : Attachment
        Of one model and data.
    """
    model, data = attachments[0].model, attachments[0].data
    if any(a.model is not model or a.data is not data for a in attachments):
        raise ValueError("`attachments` are of several models or data; one step moves one of them")
    if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
        raise ValueError(
            "`model.opt.integrator` = RK4; valid: Euler, implicit, implicitfast; with RK4 use `hook()` and `mj_step`"
        )
    mujoco.mj_step1(model, data)
    done = []
    try:
        for attachment in attachments:
            attachment._apply(model.opt.timestep)
            done.append(attachment)
        mujoco.mj_step2(model, data)
    finally:
        for attachment in reversed(done):
            attachment._mount.restore()


def body_of(model, body):
    """`spts.Body` of a body of a model: its geoms that collide, or all of them when none does.

    Parameters
    ----------
    model : mujoco.MjModel
    body : str or int

    Raises
    ------
    ValueError
        For a body without a geom, and for planes, height fields and SDFs, which have no mesh.
    """
    body = _number(model, mujoco.mjtObj.mjOBJ_BODY, "body", body)
    geoms = np.flatnonzero(model.geom_bodyid == body)
    collide = [g for g in geoms if model.geom_contype[g] or model.geom_conaffinity[g]]
    parts = [_mesh(model, int(g)) for g in (collide or geoms)]
    if not parts:
        raise ValueError(f'body "{model.body(body).name}" has no geom; give its shape: bodies={{name: spts.Body}}')
    vertices, faces, first = [], [], 0
    for points, triangles in parts:
        vertices.append(points)
        faces.append(triangles + first)
        first += len(points)
    return Body.from_vertices(np.concatenate(vertices), np.concatenate(faces))


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
    """Geoms of a link."""
    if link == 0:
        raise ValueError("`link_geoms` is missing: the site is in the world; which of its geoms does the skin cover?")
    weld = model.body_weldid[link]
    owners = model.geom_bodyid if weld == 0 else model.body_weldid[model.geom_bodyid]
    return [int(g) for g in np.flatnonzero(owners == (link if weld == 0 else weld))]


class _Arrays:
    """The arrays of an mjData that a mount reads and writes."""

    def __init__(self, data):
        for name in ("xpos", "xmat", "xipos", "cvel", "subtree_com", "site_xpos", "site_xmat", "xfrc_applied"):
            setattr(self, name, getattr(data, name))


class _Contact:
    """Takes the contact between two sets of geoms out, and nothing else, with one free collision bit.

    Geoms a and b collide when contype(a) & conaffinity(b) or contype(b) & conaffinity(a). The link's geoms get contype 0
    and a bit of their own as conaffinity; what collided with them, and is not one of the bodies, gets that bit as contype.
    """

    def __init__(self, model, link, bodies):
        joined = set(link) & set(bodies)
        if joined:
            raise ValueError(f"geoms {sorted(joined)} are of the skin's link and of a body at once")
        pairs = zip(model.pair_geom1.tolist(), model.pair_geom2.tolist())
        for a, b in pairs:
            if {a, b} & set(link) and {a, b} & set(bodies):
                raise ValueError(
                    f"geoms {a} and {b} are a <pair> of the model, which collides whatever its bits; take it out"
                )
        self.model = model
        contype, conaffinity = model.geom_contype, model.geom_conaffinity
        self.before = [(g, int(contype[g]), int(conaffinity[g])) for g in link]
        self.bits = 0
        self.given = []
        kinds = {(c, a) for _, c, a in self.before if c or a}
        for c, a in sorted(kinds):
            used = int(np.bitwise_or.reduce(contype) | np.bitwise_or.reduce(conaffinity)) & 0xFFFFFFFF
            free = next((1 << k for k in range(31) if not used >> k & 1), None)
            if free is None:
                self.restore()
                raise ValueError("the geoms of the model use all collision bits; one has to be free")
            own = [g for g, c_own, a_own in self.before if (c_own, a_own) == (c, a)]
            out = set(bodies) | set(link)
            for g in range(model.ngeom):
                if g not in out and (int(contype[g]) & a or c & int(conaffinity[g])):
                    contype[g] |= free
                    self.given.append((g, free))
            for g in own:
                contype[g], conaffinity[g] = 0, free
        self._bodies()

    def restore(self):
        contype, conaffinity = self.model.geom_contype, self.model.geom_conaffinity
        for g, bit in self.given:
            contype[g] &= ~bit
        for g, c, a in self.before:
            contype[g], conaffinity[g] = c, a
        self.given, self.before = [], []
        self._bodies()

    def _bodies(self):
        """The bits of bodies, which MuJoCo looks at first, are those of their geoms together."""
        model = self.model
        if hasattr(model, "body_contype"):
            for bits, own in (
                (model.body_contype, model.geom_contype),
                (model.body_conaffinity, model.geom_conaffinity),
            ):
                bits[:] = 0
                np.bitwise_or.at(bits, model.geom_bodyid, own)


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
