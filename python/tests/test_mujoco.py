"""Skins on MuJoCo models: balance, energy, and that everything else stays as it was."""

import concurrent.futures
import copy

import mujoco
import numpy as np
import pytest
import spts
import spts.mujoco

TABLE = """
<mujoco>
  <option timestep="0.0005" integrator="{integrator}"/>
  <worldbody>
    <geom name="floor" type="plane" size="2 2 .1" pos="0 0 -.3"/>
    <body name="table" pos="0.3 0.1 0.2" euler="{tilt}">
      {joint}
      <geom name="top" type="box" size=".1 .1 .05" pos="0 0 -.05" mass="20"/>
      {sites}
    </body>
    <body name="thing" pos="0.31 0.12 {height}" euler="{lying}">
      <freejoint/>
      <geom name="shape" type="{kind}" size="{size}" mass="{mass}"/>
    </body>
    {other}
  </worldbody>
</mujoco>"""
SITE = '<site name="skin"/>'
OTHER = '<body name="other" pos="0.26 0.05 0.2098"><freejoint/><geom name="otherbox" type="box" size=".01 .01 .01" mass=".05"/></body>'


OF_FOAM = -1.0


def table(
    kind="box",
    size=".03 .02 .02",
    mass=0.5,
    height=0.2199,
    lying="0 0 0",
    tilt="0 0 0",
    joint="",
    other="",
    integrator="Euler",
    sites=SITE,
):
    """A table with a skin on it, and a thing just above."""
    model = mujoco.MjModel.from_xml_string(TABLE.format(**locals()))
    return model, mujoco.MjData(model)


def touching(model, data):
    """Names of the geoms between which MuJoCo's own contact acts: with the solref that no contact of foam has."""
    own = (c for c in data.contact if not c.exclude and c.solref[0] != OF_FOAM)
    return {frozenset((model.geom(c.geom1).name, model.geom(c.geom2).name)) for c in own}


@pytest.mark.parametrize(
    "kind, size, lying, integrator",
    [
        ("box", ".03 .02 .02", "0 0 0", "Euler"),
        ("cylinder", ".03 .02 0", "0 0 0", "implicitfast"),
        ("sphere", ".02 0 0", "0 0 0", "implicitfast"),
        ("capsule", ".02 .03 0", "0 90 0", "Euler"),
    ],
)
def test_a_body_that_rests_is_carried(kind, size, lying, integrator):
    """Σ p·A = m g within 0.1 %, and MuJoCo's own contact is out."""
    model, data = table(kind, size, lying=lying, integrator=integrator)
    skin = spts.Skin(10, 10, 0.015)
    with spts.mujoco.attach(model, data, skin, site="skin", bodies=["thing"], mode="foam") as touch:
        for _ in range(8000):
            felt = touch.step()
            # round bodies would roll away
            data.qvel[3:6] *= 0.99
        assert not touching(model, data)
        assert (felt.pressure * 0.015**2).sum() == pytest.approx(0.5 * 9.81, rel=1e-3)
        assert felt.wrenches[touch.bodies[model.body("thing").id]][0][2] == pytest.approx(0.5 * 9.81, rel=1e-3)
        assert not data.xfrc_applied.any()


@pytest.mark.parametrize("points, tolerance", [(1, 1e-3), (4, 1e-2)])
def test_a_body_rests_on_a_cylinder(points, tolerance):
    """A slab lies free on a cylinder of skin, which carries its weight to 0.1 %. With one point a taxel, so do Σ p·A·n of
    the taxels; with more, a taxel's one normal stands for those of its points, which costs up to 1 - cos of half its angle.
    """
    model = mujoco.MjModel.from_xml_string("""
    <mujoco><option timestep="0.0005"/><worldbody>
      <body name="arm"><geom name="tube" type="cylinder" size=".05 .1" euler="90 0 0"/><site name="skin"/></body>
      <body name="slab" pos="0 0 .06"><freejoint/><geom type="box" size=".1 .1 .01" mass="1"/></body>
    </worldbody></mujoco>""")
    data = mujoco.MjData(model)
    skin = spts.Skin.cylinder(0.05, 48 // points, 96 // points, axis="y", span=(-0.1, 0.1), points=points)
    touch = spts.mujoco.attach(model, data, skin, site="skin", bodies=["slab"], mode="foam")
    felt = touch.step(6000)
    force, _ = felt.wrenches[touch.bodies[model.body("slab").id]]
    assert force[2] == pytest.approx(9.81, rel=1e-3)
    assert (felt.pressure.ravel() * skin.areas) @ skin.normals[:, 2] == pytest.approx(9.81, rel=tolerance)


@pytest.mark.parametrize("joint", ["", '<joint type="slide" axis="0 0 1" stiffness="1e4" damping="10"/>'])
def test_a_drop_gains_no_energy(joint):
    """A ball on skin, on a table that stands or gives: kinetic and potential energy never rise above where they began."""
    model, data = table("sphere", ".03 0 0", mass=0.06, height=0.33, joint=joint)
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    skin = spts.Skin(10, 10, 0.015)
    touch = spts.mujoco.attach(model, data, skin, site="skin", bodies=["thing"], mode="foam")
    if joint:
        # the table sinks under its own weight first
        model.opt.gravity[:] = 0
    mujoco.mj_forward(model, data)
    first, heights = 0.06 * 9.81 * data.body("thing").xpos[2], []
    for _ in range(4000):
        if joint:
            data.xfrc_applied[model.body("thing").id, 2] = -0.06 * 9.81
        touch.step()
        v = data.body("thing").cvel
        height = data.body("thing").xpos[2]
        energy = 0.5 * 0.06 * (v[3:] @ v[3:]) + 0.06 * 9.81 * height
        assert energy < first * (1 + 1e-4)
        heights.append(height)
    heights = np.array(heights)
    bounced = heights[np.argmin(heights[:600]) :].max()
    # it bounces, and less high than it fell
    assert 0.235 < bounced < 0.32


def test_tilted_and_moving_links_feel_the_same():
    """What is felt does not depend on how the world is turned: a table on its side, gravity along with it."""
    felts = []
    for tilt in ("0 0 0", "90 0 0", "20 30 40"):
        model, data = table(tilt=tilt)
        mujoco.mj_forward(model, data)
        frame = data.site("skin").xmat.reshape(3, 3)
        model.opt.gravity[:] = frame @ (0, 0, -9.81)
        number = model.body("thing").id
        data.qpos[:3] = data.site("skin").xpos + frame @ (0.013, 0.021, 0.0195)
        mujoco.mju_mat2Quat(data.qpos[3:7], frame.ravel())
        touch = spts.mujoco.attach(model, data, spts.Skin(10, 10, 0.015), site="skin", bodies=[number], mode="foam")
        felts.append(touch.step(500).pressure)
    for felt in felts[1:]:
        assert np.abs(felt - felts[0]).max() < 1e-6 * felts[0].max()


def test_the_link_feels_the_opposite():
    """On a table that floats, momentum stays what it is, but for the error of Euler's method, which halves with the step."""
    errors = []
    for dt in (5e-4, 2.5e-4):
        model, data = table(joint="<freejoint/>", mass=0.5)
        model.opt.gravity[:], model.opt.timestep = 0, dt
        first = model.body_dofadr[model.body("thing").id]
        data.qvel[first + 2], data.qvel[first + 3] = -0.5, 2.0
        touch = spts.mujoco.attach(model, data, spts.Skin(10, 10, 0.015), site="skin", bodies=["thing"], mode="foam")
        before = momentum(model, data)
        touch.step(round(0.2 / dt))
        assert abs(data.qvel[first + 2] + 0.5) > 0.1
        errors.append(np.abs(momentum(model, data) - before).max(axis=1))
    assert (errors[0] < (1e-5, 1e-8)).all()
    assert errors[0] == pytest.approx(2 * errors[1], rel=0.2)


def momentum(model, data):
    """Momentum, N s, and angular momentum, N m s, of everything."""
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    return np.array([data.subtree_linvel[0] * model.body_subtreemass[0], data.subtree_angmom[0]])


def test_other_contact_stays_and_comes_back():
    model, data = table(other=OTHER)
    skin = spts.Skin(10, 10, 0.015)
    touch = spts.mujoco.attach(model, data, skin, site="skin", bodies=["thing"], mode="foam")
    touch.step(50)
    # the small box still stands on the table, by MuJoCo
    assert touching(model, data) == {frozenset(("top", "otherbox"))}
    touch.detach()
    touch.detach()
    mujoco.mj_forward(model, data)
    assert touching(model, data) == {frozenset(("top", "otherbox")), frozenset(("top", "shape"))}


def test_forces_of_the_user_stay():
    model, data = table()
    number = model.body("thing").id
    touch = spts.mujoco.attach(model, data, spts.Skin(10, 10, 0.015), site="skin", bodies=["thing"], mode="foam")
    data.xfrc_applied[number, 2] = -3.0
    felt = touch.step(3000)
    assert data.xfrc_applied[number].tolist() == [0, 0, -3.0, 0, 0, 0]
    assert (felt.pressure * 0.015**2).sum() == pytest.approx(0.5 * 9.81 + 3.0, rel=1e-3)


def test_two_skins_step_together():
    """Two halves of a table, each with a skin, carry what one skin does."""
    left, right = spts.Skin(10, 5, 0.015), spts.Skin(10, 5, 0.015)
    model, data = table(
        size=".06 .02 .02", sites='<site name="left" pos="-.0375 0 0"/><site name="right" pos=".0375 0 0"/>'
    )
    a = spts.mujoco.attach(model, data, left, site="left", bodies=["thing"], mode="foam")
    b = spts.mujoco.attach(model, data, right, site="right", bodies=["thing"], mode="foam")
    for _ in range(3000):
        spts.mujoco.step(a, b)
    carried = [(t.pressure * 0.015**2).sum() for t in (a, b)]
    assert min(carried) > 1.0 and sum(carried) == pytest.approx(0.5 * 9.81, rel=1e-3)
    a.detach(), b.detach()


CONES = pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])


@CONES
@pytest.mark.parametrize("dt", [5e-3, 1e-3])
@pytest.mark.parametrize("friction", [None, 0.0])
def test_a_light_finger_under_a_large_force_comes_to_rest(cone, dt, friction):
    """50 g pressed with 40 N, and for a second 1 N sideways, far inside the cone: no chatter, at any step."""
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco><option timestep="{dt}" gravity="0 0 0" cone="{cone}"/><worldbody>
      <geom name="table" type="box" size=".1 .1 .01" pos="0 0 -.01"/><site name="skin"/>
      <body name="tip" pos="0 0 .0118"><joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide" axis="0 0 1"/>
        <geom type="sphere" size=".012" mass=".05"/></body></worldbody>
      <actuator><motor joint="x"/><motor joint="z"/></actuator></mujoco>""")
    data = mujoco.MjData(model)
    skin = spts.Skin(10, 10, 0.005, friction=friction)
    touch = spts.mujoco.attach(model, data, skin, site="skin", bodies=["tip"], mode="foam")
    steps, forces = int(1.0 / dt), []
    for k in range(2 * steps):
        data.ctrl[:] = (1.0 if friction is None and k < steps else 0.0), -40.0 * min(1.0, 4.0 * k / steps)
        felt = touch.step()
        if k > 1.75 * steps:
            forces.append(next(iter(felt.wrenches.values()))[0])
            assert np.abs(data.qvel).max() < 1e-6
    forces = np.array(forces)
    assert forces[:, 2] == pytest.approx(40.0, rel=1e-6) and np.ptp(forces, axis=0).max() < 1e-5
    assert (felt.pressure * 0.005**2).sum() == pytest.approx(40.0, rel=1e-6)


@CONES
def test_a_cup_between_two_fingers_does_not_creep(cone):
    """250 g held with 10 N a finger: less than 1 µm in 2 s at 2 ms; what friction holds is the cup's weight."""
    finger = """<body name="{0}" pos="{1} 0 .2"><joint name="{0}" type="slide" axis="{2} 0 0" damping="5"/>
      <geom type="box" size=".015 .03 .03" mass=".2"/><site name="{0}" pos="{3} 0 0" quat="1 0 {2} 0"/></body>"""
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco><option timestep=".002" cone="{cone}" gravity="0 0 0"/><worldbody>
      {finger.format("l", -0.05, 1, 0.015)}{finger.format("r", 0.05, -1, -0.015)}
      <body name="cup" pos="0 0 .2"><freejoint/><geom type="box" size=".0345 .03 .08" mass=".25"/></body></worldbody>
      <actuator><motor joint="l"/><motor joint="r"/></actuator></mujoco>""")
    data = mujoco.MjData(model)
    data.ctrl[:] = 10.0
    skins = [
        spts.mujoco.attach(model, data, spts.Skin(12, 12, 0.005), site=s, bodies=["cup"], mode="foam") for s in "lr"
    ]
    for _ in range(250):
        spts.mujoco.step(*skins)
    model.opt.gravity[2] = -9.81
    for _ in range(250):
        spts.mujoco.step(*skins)
    height = data.body("cup").xpos[2]
    assert 0.2 - height < 2e-4
    for _ in range(1000):
        felt = spts.mujoco.step(*skins)
    assert abs(data.body("cup").xpos[2] - height) < 1e-6
    held = 0.0
    for skin, touch in zip(skins, felt):
        frame = data.site(skin.model.body(skin._link).name).xmat.reshape(3, 3)
        held += (frame @ touch.wrenches[skin.bodies[model.body("cup").id]][0])[2]
        assert (touch.pressure * 0.005**2).sum() == pytest.approx(10.0, rel=1e-6)
    assert held == pytest.approx(0.25 * 9.81, rel=1e-4)


@CONES
@pytest.mark.parametrize("dt", [2e-3, 5e-3])
@pytest.mark.parametrize("kind, size", [("sphere", ".03"), ("box", ".03 .02 .04"), ("capsule", ".015 .04")])
def test_drops_at_long_steps_gain_no_energy(cone, dt, kind, size):
    """Thrown and spinning, from a little height and at 8 m/s: what a step moves is more than the foam's thickness."""
    for height, speed in ((0.1, 0.0), (0.2, -8.0)):
        model = mujoco.MjModel.from_xml_string(f"""
        <mujoco><option timestep="{dt}" cone="{cone}"><flag energy="enable"/></option><worldbody>
          <geom type="box" size=".15 .15 .05" pos="0 0 -.056"/><site name="skin"/>
          <body name="thing" pos="0 0 {height}" euler="10 20 30"><freejoint/><geom type="{kind}" size="{size}" mass=".1"/></body>
        </worldbody></mujoco>""")
        data = mujoco.MjData(model)
        data.qvel[:] = 0.3, 0.1, speed, 3.0, 1.0, 2.0
        touch = spts.mujoco.attach(model, data, spts.Skin(15, 15, 0.02), site="skin", bodies=["thing"], mode="foam")
        mujoco.mj_forward(model, data)
        first, felt = data.energy.sum(), False
        for _ in range(int(0.6 / dt)):
            felt |= touch.step().area > 0.0
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_crb(model, data)
            mujoco.mj_energyPos(model, data)
            mujoco.mj_energyVel(model, data)
            assert data.energy.sum() < first * (1 + 1e-6)
        assert felt


def test_what_cannot_be_attached():
    model, data = table()
    skin = spts.Skin(10, 10, 0.015)
    for text, arguments in [
        ("site", {"site": "palm", "bodies": ["thing"]}),
        ("bodies", {"site": "skin", "bodies": ["cup"]}),
        ("bodies", {"site": "skin", "bodies": [99]}),
        ("bodies", {"site": "skin", "bodies": []}),
        ("own link", {"site": "skin", "bodies": ["table"]}),
        ("link_geoms", {"site": "skin", "bodies": ["thing"], "link_geoms": ["none"]}),
        ("of a body at once", {"site": "skin", "bodies": ["thing"], "link_geoms": ["shape"]}),
    ]:
        with pytest.raises(ValueError, match=text):
            spts.mujoco.attach(model, data, skin, **arguments)
    with pytest.raises(ValueError, match="where is the skin"):
        spts.mujoco.attach(model, data, skin, bodies=["thing"], mode="foam")
    with pytest.raises(ValueError, match="quat"):
        spts.mujoco.attach(model, data, skin, body="table", quat=(0, 0, 0, 0))
    other = mujoco.MjData(mujoco.MjModel.from_xml_string("<mujoco/>"))
    with pytest.raises(ValueError, match="data"):
        spts.mujoco.attach(model, other, skin, site="skin", bodies=["thing"], mode="foam")
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    with pytest.raises(ValueError, match="RK4"):
        spts.mujoco.attach(model, data, skin, site="skin", bodies=["thing"], mode="foam").step()


def test_shapes_of_geoms():
    """Volumes of what geoms become: those of MuJoCo's masses."""
    for kind, size, volume in [
        ("sphere", ".02 0 0", 4 / 3 * np.pi * 0.02**3),
        ("ellipsoid", ".01 .02 .03", 4 / 3 * np.pi * 0.01 * 0.02 * 0.03),
        ("box", ".01 .02 .03", 8 * 0.01 * 0.02 * 0.03),
        ("cylinder", ".02 .03 0", np.pi * 0.02**2 * 0.06),
        ("capsule", ".02 .03 0", np.pi * 0.02**2 * 0.06 + 4 / 3 * np.pi * 0.02**3),
    ]:
        model, _ = table(kind, size)
        vertices, faces = spts.mujoco.body_of(model, "thing").mesh
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(volume, rel=1e-3), kind


SOLE = """
<mujoco><option timestep="0.0005"/>{asset}<worldbody>{floor}
  <body name="foot" pos="0 0 {height}"><freejoint/><geom type="box" size=".1 .05 .02" mass="5"/>
    <site name="sole" pos="0 0 -.02" quat="0 1 0 0"/></body>
</worldbody></mujoco>"""
FLAT = '<asset><hfield name="h" nrow="3" ncol="4" size="1 1 .1 .1" elevation="0 0 0 0 0 0 0 0 0 0 0 0"/></asset>'


@pytest.mark.parametrize(
    "asset, floor, bodies",
    [
        ("", '<geom name="floor" type="plane" size="0 0 .1"/>', ["floor"]),
        ("", '<geom name="floor" type="plane" size="0 0 .1"/>', "all"),
        ("", '<geom name="floor" type="box" size="1 1 .1" pos="0 0 -.1"/>', ["world"]),
        ("", '<body name="ground"><geom type="plane" size="0 0 .1"/></body>', ["ground"]),
        (FLAT, '<geom name="floor" type="hfield" hfield="h"/>', "all"),
    ],
)
@pytest.mark.parametrize("mode", ["sense", "foam"])
def test_a_foot_stands_on_any_floor(asset, floor, bodies, mode):
    model = mujoco.MjModel.from_xml_string(SOLE.format(asset=asset, floor=floor, height=0.0205))
    data = mujoco.MjData(model)
    touch = spts.mujoco.attach(model, data, spts.Skin(8, 16, 0.0125), site="sole", bodies=bodies, mode=mode)
    felt = touch.step(3000)
    # MuJoCo's contact with a height field is never quite at rest
    tolerance = 2e-2 if asset and mode == "sense" else 1e-3
    assert felt.pressure.ravel() @ touch.skin.areas == pytest.approx(5 * 9.81, rel=tolerance)
    assert not felt.bottomed


def test_contacts_at_corners_beside_the_skin():
    """MuJoCo's contacts of a sole are its corners. A skin that has nearly all of the sole feels its weight; one that has
    a quarter or a half of it does not, as the rim carries the foot."""
    model = mujoco.MjModel.from_xml_string(
        SOLE.format(asset="", floor='<geom type="plane" size="0 0 .1"/>', height=0.0205)
    )
    for rows, cols, share in ((7, 15, 1.0), (7, 16, 1.0), (4, 8, 0.0), (8, 8, 0.0)):
        data = mujoco.MjData(model)
        touch = spts.mujoco.attach(model, data, spts.Skin(rows, cols, 0.0125), site="sole")
        felt = touch.step(3000)
        total = felt.pressure.ravel() @ touch.skin.areas
        assert total == pytest.approx(share * 5 * 9.81, rel=1e-3, abs=1e-9), (rows, cols)


def test_what_presses_by_default():
    """All that collides but the link, what is welded to it, its kinematic neighbours and what the model excludes."""
    model = mujoco.MjModel.from_xml_string("""
    <mujoco><worldbody>
      <geom name="floor" type="plane" size="1 1 .1"/>
      <body name="base" pos="0 0 1"><geom size=".05"/>
        <body name="arm"><joint axis="1 0 0"/><geom size=".05"/>
          <body name="plate"><geom size=".05"/></body>
          <body name="hand" pos="0 0 .2"><joint axis="0 1 0"/><geom size=".05"/></body></body></body>
      <body name="cup" pos="1 0 0"><freejoint/><geom size=".05"/></body>
      <body name="ghost" pos="2 0 0"><freejoint/><geom size=".05" contype="0" conaffinity="0"/></body>
      <body name="far" pos="3 0 0"><freejoint/><geom size=".05"/></body>
    </worldbody><contact><exclude body1="arm" body2="far"/></contact></mujoco>""")
    data = mujoco.MjData(model)

    def pressing(link):
        touch = spts.mujoco.attach(model, data, spts.Skin(4, 4, 0.01), body=link)
        return {model.body(b).name for b in touch.bodies}

    assert pressing("arm") == {"world", "base", "cup"}
    assert pressing("hand") == {"world", "base", "cup", "far"}
    assert pressing("cup") == {"world", "base", "arm", "plate", "hand", "far"}
    assert pressing("base") == {"arm", "plate", "hand", "cup", "far"}


def test_a_place_on_a_body_is_as_good_as_a_site():
    felts = []
    for place in ({"site": "skin"}, {"body": "table", "pos": (0.01, 0.02, 0), "quat": (0, 0, 0, 2)}):
        model, data = table(sites='<site name="skin" pos=".01 .02 0" euler="0 0 180"/>', tilt="0 0 30")
        touch = spts.mujoco.attach(model, data, spts.Skin(10, 10, 0.015), bodies=["thing"], mode="foam", **place)
        felts.append(touch.step(300).pressure)
    assert felts[0].max() > 0.0 and np.abs(felts[0] - felts[1]).max() < 1e-6 * felts[0].max()


def test_beside_the_skin_mujoco_carries():
    """A small skin in the middle of a table: what lies beside it lies on the table."""
    model, data = table("sphere", ".03 0 0", height=0.2301, other=OTHER.replace("0.26 0.05", "0.22 0.02"))
    touch = spts.mujoco.attach(model, data, spts.Skin(6, 6, 0.01), site="skin", bodies=["thing", "other"], mode="foam")
    touch.step(2000)
    assert touching(model, data) == {frozenset(("top", "otherbox"))}
    assert data.body("other").xpos[2] == pytest.approx(0.21, abs=1e-3)


@pytest.mark.parametrize("mode", ["sense", "foam"])
@pytest.mark.parametrize("bodies", ["all", ["probe"]])
@pytest.mark.parametrize("spring", [False, True])
def test_a_mocap_body_presses(mode, bodies, spring):
    """What is led presses a table that stands still by the foam's law, and one that gives by MuJoCo's solve."""
    joint = '<joint type="slide" axis="0 0 1" stiffness="1e4" damping="50"/>' if spring else ""
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco><option timestep="0.002" gravity="0 0 0"/><worldbody>
      <body name="table">{joint}<geom type="box" size=".1 .1 .02" pos="0 0 -.02" mass="1"/><site name="skin"/></body>
      <body name="probe" mocap="true" pos="0 0 .1"><geom size=".02"/></body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    touch = spts.mujoco.attach(model, data, spts.Skin(10, 10, 0.01), site="skin", bodies=bodies, mode=mode)
    assert touch.step(10).area == 0.0
    data.mocap_pos[0] = 0.0, 0.0, 0.0185
    felt = touch.step(300)
    pushed = felt.wrenches[touch.bodies[model.body("probe").id]][0][2]
    assert (felt.pressure * 1e-4).sum() == pytest.approx(pushed, rel=1e-6) and pushed > 1.0
    if spring:
        assert pushed == pytest.approx(-1e4 * data.qpos[0], rel=1e-3)
    else:
        skin, ball = spts.Skin(10, 10, 0.01), spts.Body.sphere(0.02)
        law = skin.touch({ball: ((0.0, 0.0, 0.0185), (1.0, 0.0, 0.0, 0.0))})
        assert pushed == pytest.approx(law.wrenches[ball][0][2], rel=1e-2)
    data.mocap_pos[0] = 0.0, 0.0, 0.1
    assert touch.step(100).area == 0.0


def test_other_data_keep_their_contact():
    """The model is as it was: a copy of the data, and a second skin on it, know nothing of the first."""
    model, data = table()
    touch = spts.mujoco.attach(model, data, spts.Skin(10, 10, 0.015), site="skin", bodies=["thing"], mode="foam")
    touch.step(200)
    other = mujoco.MjData(model)
    touch.hook()
    mujoco.mj_step(model, other, nstep=1000)
    touch.detach()
    assert touching(model, other) == {frozenset(("top", "shape"))}
    assert other.body("thing").xpos[2] == pytest.approx(0.22, abs=1e-3)


def test_any_number_of_skins_in_any_order():
    links = "".join(
        f'<body name="l{k}" pos="{0.3 * k} 0 0"><joint type="slide"/><geom size=".1"/></body>' for k in range(40)
    )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody>{links}<body name="cup" pos="0 0 3"><freejoint/><geom size=".03"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    touches = [
        spts.mujoco.attach(model, data, spts.Skin(4, 4, 0.01), body=f"l{k}", bodies=["cup"], mode="foam")
        for k in range(40)
    ]
    spts.mujoco.step(*touches)
    for touch in touches:
        touch.hook()
    for touch in touches[::2] + touches[1::2]:
        touch.detach()
    assert mujoco.get_mjcb_control() is None
    for _ in range(30):
        # an episode each
        spts.mujoco.attach(model, data, spts.Skin(4, 4, 0.01), body="l0", bodies=["cup"], mode="foam").step()


def test_a_hook_leaves_other_models_alone():
    """Models are compiled, stepped and rolled out while a skin is hooked."""
    model, data = table()
    touch = spts.mujoco.attach(model, data, spts.Skin(10, 10, 0.015), site="skin", bodies=["thing"], mode="foam")
    touch.hook()
    mujoco.mj_step(model, data, nstep=100)
    other, own = table()
    mujoco.mj_step(other, own, nstep=100)
    assert touch.last.area > 0.0 and touching(other, own)
    data.qpos[0] = np.nan
    model.opt.disableflags |= getattr(mujoco.mjtDisableBit, "mjDSBL_AUTORESET", 0)
    touch.detach()
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    with pytest.raises(ValueError, match="contact off"):
        spts.mujoco.attach(model, data, spts.Skin(10, 10, 0.015), site="skin", bodies=["thing"], mode="foam")
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    with pytest.raises(ValueError, match="actuation off"):
        touch.hook()


def test_a_callback_of_the_user_and_a_hook():
    """One that is set before is called; one that is set after takes the skin's place, and that is told."""
    model, data = table()
    calls = []
    mujoco.set_mjcb_control(lambda *_: calls.append(1))
    try:
        touch = spts.mujoco.attach(model, data, spts.Skin(10, 10, 0.015), site="skin", bodies=["thing"], mode="foam")
        touch.hook()
        mujoco.mj_step(model, data, nstep=50)
        assert len(calls) == 50 and touch.last.area > 0.0
        mujoco.set_mjcb_control(None)
        mujoco.mj_step(model, data)
        with pytest.raises(RuntimeError, match="mjcb_control"):
            assert touch.last
        with pytest.raises(TypeError, match="attach"):
            copy.deepcopy(touch)
    finally:
        touch.detach()
        mujoco.set_mjcb_control(None)


@pytest.mark.skipif(not hasattr(mujoco.mjtEnableBit, "mjENBL_SLEEP"), reason="bodies do not sleep before MuJoCo 3.4")
def test_sleeping_bodies_are_refused():
    model, data = table()
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
    with pytest.raises(ValueError, match="sleep"):
        spts.mujoco.attach(model, data, spts.Skin(10, 10, 0.015), site="skin", bodies=["thing"], mode="foam")


def test_cloth_lies_on_the_link():
    """Flexes have no geom: MuJoCo's contact carries them as before."""
    text = """
    <mujoco><option timestep="0.001" solver="CG" tolerance="1e-6"/><worldbody>
      <body name="plate" pos="0 0 .2"><geom type="box" size=".1 .1 .005" pos="0 0 -.005"/><site name="skin"/></body>
      <body name="cup" pos=".3 0 .5"><freejoint/><geom type="sphere" size=".01" mass=".01"/></body>
      <flexcomp name="cloth" type="grid" count="9 9 1" spacing=".02 .02 .02" pos="0 0 .22" radius=".004" mass=".1" dim="2">
        <edge equality="true"/><contact selfcollide="none" solref="0.01"/></flexcomp>
    </worldbody></mujoco>"""
    heights = []
    for skinned in (False, True):
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        touch = spts.mujoco.attach(model, data, spts.Skin(10, 10, 0.015), site="skin", bodies=["cup"], mode="foam")
        for _ in range(300):
            touch.step() if skinned else mujoco.mj_step(model, data)
        heights.append(data.flexvert_xpos[:, 2].min())
    assert heights[0] > 0.2 and heights[1] == pytest.approx(heights[0], abs=1e-6)


TUBE = """
<mujoco><option timestep="0.002" cone="{cone}"/><worldbody>
  <geom name="floor" type="plane" size="2 2 .1"/>
  <body name="arm" pos="0 0 .4" euler="0 85 0"><geom name="tube" type="capsule" size=".05 .1"/><site name="{round}"/></body>
  <body name="table" pos=".5 0 .2"><geom name="top" type="box" size=".1 .1 .02" pos="0 0 -.02"/><site name="{flat}"/></body>
  <body name="slab" pos=".01 .01 .47" euler="0 -5 10"><freejoint/><geom type="box" size=".1 .1 .01" mass="1"/></body>
  <body name="cup" pos=".52 .01 .2199" euler="0 3 0"><freejoint/><geom type="cylinder" size=".03 .02" mass=".5"/></body>
</worldbody></mujoco>"""


@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
def test_sensing_changes_nothing_and_adds_up(cone):
    """Mode "sense" at a step of 2 ms: everything moves as without a skin, bit for bit. At every step Σ p·A is the
    normal force of MuJoCo's contact, flat or round, and the wrenches are those of that contact."""
    text = TUBE.format(cone=cone, round="round", flat="flat")
    model = mujoco.MjModel.from_xml_string(text)
    bare, data = mujoco.MjData(model), mujoco.MjData(model)
    around = spts.Skin.cylinder(0.05, 12, 24, span=(-0.1, 0.1), points=3)
    touches = [
        spts.mujoco.attach(model, data, around, site="round"),
        spts.mujoco.attach(model, data, spts.Skin(12, 12, 0.015), site="flat"),
    ]
    force, seen = np.empty(6), [0, 0]
    for _ in range(400):
        mujoco.mj_step(model, bare)
        felts = spts.mujoco.step(*touches)
        assert np.array_equal(bare.qpos, data.qpos) and np.array_equal(bare.qvel, data.qvel)
        for k, (touch, link, thing) in enumerate(zip(touches, ("tube", "top"), ("slab", "cup"))):
            normal, push = 0.0, np.zeros(3)
            for i, c in enumerate(data.contact):
                if model.geom(link).id in (c.geom1, c.geom2):
                    mujoco.mj_contactForce(model, data, i, force)
                    normal += force[0]
                    push += c.frame.reshape(3, 3).T @ force[:3] * (1 if model.geom(link).id == c.geom1 else -1)
            felt = felts[k]
            assert felt.pressure.ravel() @ touch.skin.areas == pytest.approx(normal, rel=1e-6, abs=1e-12)
            frame = data.site_xmat[k].reshape(3, 3)
            found = frame @ felt.wrenches[touch.bodies[model.body(thing).id]][0]
            assert np.abs(found - push).max() <= 1e-9 * max(np.abs(push).max(), 1.0)
            seen[k] += normal > 0.1
    assert min(seen) > 50
    # at rest the middle of the pressure is the middle of the force: the cup's own
    felt, touch = felts[1], touches[1]
    share = felt.pressure.ravel() * touch.skin.areas
    middle = share @ touch.skin.positions / share.sum()
    assert np.abs(middle[:2] - (data.body("cup").xpos - data.site("flat").xpos)[:2]).max() < 2e-3


def test_a_look_in_mode_sense_is_at_the_present():
    model, data = table()
    touch = spts.mujoco.attach(model, data, spts.Skin(10, 10, 0.015), site="skin")
    touch.hook()
    mujoco.mj_step(model, data, nstep=2000)
    felt = touch.last
    assert felt is touch.last and felt.time == 0.0
    assert (felt.pressure * 0.015**2).sum() == pytest.approx(0.5 * 9.81, rel=1e-3)
    mujoco.mj_step(model, data, nstep=100)
    assert touch.last.time == pytest.approx(0.05)
    mujoco.mj_resetData(model, data)
    mujoco.mj_forward(model, data)
    assert touch.last.time == 0.0
    with pytest.raises(ValueError, match="each"):
        touch.hook(print)
    with pytest.raises(ValueError, match="mode"):
        spts.mujoco.attach(model, data, spts.Skin(10, 10, 0.015), site="skin", mode="both")


def leg(name, x, y):
    return f"""<body name="{name}" pos="{x} {y} 0"><joint axis="0 1 0" stiffness="200" damping="2"/>
      <geom type="capsule" fromto="0 0 -.02 0 0 -.2" size=".02" mass=".3"/>
      <body name="{name}_foot" pos="0 0 -.24"><joint axis="0 1 0" stiffness="100" damping="1"/>
        <geom size=".025" mass=".1"/></body></body>"""


DOG = f"""
<mujoco><option timestep="0.002"/><worldbody><geom name="floor" type="plane" size="2 2 .1"/>
  <body name="trunk" pos="0 0 .266"><freejoint/><geom type="box" size=".2 .1 .04" mass="8"/>
    {leg("fl", 0.17, 0.13)}{leg("fr", 0.17, -0.13)}{leg("bl", -0.17, 0.13)}{leg("br", -0.17, -0.13)}
  </body>
</worldbody></mujoco>"""


@pytest.fixture(scope="module")
def dog():
    model = mujoco.MjModel.from_xml_string(DOG)
    data = mujoco.MjData(model)
    return model, data, spts.mujoco.dress(model, data, pitch=0.02)


def test_a_dog_is_dressed_and_stands(dog):
    """At the model's own step of 2 ms it moves as a bare one, bit for bit; its feet feel its weight within 0.5 %."""
    model, data, robot = dog
    bare = mujoco.MjData(model)
    assert len(robot.names) == len(robot.skins) == len(robot.wires) == 9 and robot.touches == [None] * 9
    sums = []
    for _ in range(1500):
        mujoco.mj_step(model, bare)
        touches = robot.step()
        sums.append(sum(t.pressure.ravel() @ s.areas for t, s in zip(touches, robot.skins)))
    assert np.array_equal(bare.qpos, data.qpos) and bare.qpos[2] > 0.24
    weight = 9.81 * model.body_subtreemass[0]
    assert np.mean(sums[-200:]) == pytest.approx(weight, rel=5e-3)
    # the wrenches are on the floor, in the frames of the feet
    down = 0.0
    for attachment, touch in zip(robot.attachments, touches):
        frame = data.body(attachment._link).xmat.reshape(3, 3)
        down -= sum((frame @ force)[2] for force, _ in touch.wrenches.values())
    assert down == pytest.approx(weight, rel=5e-3)
    assert [t.area > 0.0 for t in touches] == [n.endswith("foot") for n in robot.names]
    assert len({round(t.time, 9) for t in touches}) == 1
    y, phi = robot.wires[robot.names.index("fl_foot")].record(touches[robot.names.index("fl_foot")], 5)
    assert y.shape == (5,) and phi.shape[0] == 5


@CONES
def test_a_dog_stands_on_foam(cone):
    """On foam under its feet, at its own step of 2 ms, for 10 s: as high as on MuJoCo's contact but for the foam, its
    weight within 0.5 %, and no chatter."""
    model = mujoco.MjModel.from_xml_string(DOG.replace('timestep="0.002"', f'timestep="0.002" cone="{cone}"'))
    data, bare = mujoco.MjData(model), mujoco.MjData(model)
    feet = [f"{name}_foot" for name in ("fl", "fr", "bl", "br")]
    robot = spts.mujoco.dress(model, data, links=feet, pitch=0.01, wires=None, mode="foam")
    forces = []
    for _ in range(5000):
        mujoco.mj_step(model, bare)
        touches = robot.step()
        forces.append([sum(np.linalg.norm(f) for f, _ in touch.wrenches.values()) for touch in touches])
    forces = np.array(forces[2500:])
    assert data.qpos[2] == pytest.approx(bare.qpos[2], abs=4e-3) and np.abs(data.qvel).max() < 1e-2
    assert (forces.std(axis=0) < 0.02 * forces.mean(axis=0)).all()
    down = 0.0
    for attachment, touch, skin in zip(robot.attachments, touches, robot.skins):
        frame = data.body(attachment._link).xmat.reshape(3, 3)
        force = sum(force for force, _ in touch.wrenches.values())
        down -= (frame @ force)[2]
        # the pressures push the other way with what of it is normal
        pushed = (touch.pressure.ravel() * skin.areas) @ skin.normals
        assert np.linalg.norm(pushed) == pytest.approx(np.linalg.norm(force), rel=0.05)
    assert down == pytest.approx(9.81 * model.body_subtreemass[0], rel=5e-3)


def test_taxels_cover_links_once(dog):
    """The areas add up to the surfaces: a trunk is a box without what the legs cover, a foot a ball."""
    _, _, robot = dog
    areas = {name: skin.areas.sum() for name, skin in zip(robot.names, robot.skins)}
    box = 2 * (0.4 * 0.2 + 0.4 * 0.08 + 0.2 * 0.08)
    assert areas["trunk"] == pytest.approx(box, rel=0.02)
    # the leg's end is in it
    assert 0.9 < areas["fl_foot"] / (4 * np.pi * 0.025**2) < 1.0
    tube = 2 * np.pi * 0.02 * 0.18 + 4 * np.pi * 0.02**2
    assert 0.9 * tube < areas["fl"] < tube
    for skin in robot.skins:
        assert np.allclose(np.linalg.norm(skin.normals, axis=1), 1.0) and skin.areas.max() < 3 * 0.02**2
    # the skin of a ball is where the foam's surface is, and looks away from its middle
    foot = robot.skins[robot.names.index("fl_foot")]
    assert np.allclose(np.linalg.norm(foot.positions, axis=1), 0.028, atol=1e-3)
    assert (np.einsum("ij,ij->i", foot.positions, foot.normals) > 0.9 * 0.028).all()


def test_taxels_are_drawn(dog):
    model, _, robot = dog
    scene = mujoco.MjvScene(model, maxgeom=10_000)
    robot.draw(scene)
    assert scene.ngeom == robot.taxels == sum(len(skin.areas) for skin in robot.skins)
    with pytest.warns(UserWarning, match="room for 10"):
        robot.draw(mujoco.MjvScene(model, maxgeom=10))


def test_a_wire_a_limb(dog):
    model, _, each = dog
    data = mujoco.MjData(model)
    robot = spts.mujoco.dress(model, data, pitch=0.02, wires="limb")
    taxels = dict(zip(each.names, (len(skin.areas) for skin in each.skins)))
    limbs = ["trunk"], *([leg, f"{leg}_foot"] for leg in ("fl", "fr", "bl", "br"))
    assert [w.shape for w in robot.wires] == [(1, sum(taxels[name] for name in limb)) for limb in limbs]
    # before the first step nothing has touched it
    assert [y.shape for y, _ in robot.record(7)] == [(7,)] * 5
    robot.step(200)
    found = robot.record(40)
    assert [phi.shape for _, phi in found] == [(40, w.shape[1]) for w in robot.wires]
    touched = [(w.conductance > 1e-9).any() for w in robot.wires]
    assert touched == [False, True, True, True, True]
    assert [phi for _, phi in robot.record(4, weights=False)] == [None] * 5
    # a limb's taxels are those of its links one after the other
    foot = robot.skins[robot.names.index("bl_foot")]
    pressed = robot.touches[robot.names.index("bl_foot")].pressure.ravel() > 0.0
    assert np.array_equal(robot.wires[3].conductance[0, -len(foot.areas) :] > 1e-9, pressed)
    robot.detach()


@pytest.mark.parametrize("count", [1, 2, 3, 9, 40])
def test_any_number_of_wires(dog, count):
    model, _, each = dog
    robot = spts.mujoco.dress(model, mujoco.MjData(model), pitch=0.02, wires=count)
    sizes = [w.shape[1] for w in robot.wires]
    every = {(link, taxel) for places in robot.places for link, taxel in zip(*(part.tolist() for part in places))}
    assert len(every) == robot.taxels and [len(links) for links, _ in robot.places] == sizes
    assert len(sizes) == count and sum(sizes) == robot.taxels == each.taxels
    share = robot.taxels / count
    # both ends of a wire may go to the ends of a link
    assert max(abs(n - share) for n in sizes) <= 0.2 * share + 1
    robot.step()
    assert [phi.shape for _, phi in robot.record(3)] == [(3, n) for n in sizes]
    robot.detach()


def test_wires_are_decoded_in_time(dog):
    model, data, _ = dog
    data = mujoco.MjData(model)
    robot = spts.mujoco.dress(model, data, pitch=0.03, wires=6, readout="ideal")
    robot.step(200)
    measured = robot.record(60)
    whole = robot.decode(measured)
    assert [done for _, done in whole] == [True] * 6
    touched = [k for k, wire in enumerate(robot.wires) if wire.conductance.max() > 1e-6]
    assert touched
    for k in touched:
        assert np.corrcoef(whole[k][0], robot.wires[k].conductance.ravel())[0, 1] > 0.8
    # no time: what the sums say at once; and the strongest wire is the first
    at_once = robot.decode(measured, deadline=0.0)
    assert [done for _, done in at_once] == [False] * 6
    for (image, _), (y, phi) in zip(at_once, measured):
        assert np.array_equal(image, np.maximum(y @ phi / 60, 0.0))
    robot._spent = {key: 0.0 if key[0] == touched[-1] else 1e9 for key in robot._spent}
    some = robot.decode(measured, deadline=60.0)
    assert [k for k, (_, done) in enumerate(some) if done] == [touched[-1]]
    assert np.array_equal(some[touched[-1]][0], whole[touched[-1]][0])
    with pytest.raises(ValueError, match="6 are needed"):
        robot.decode(measured[:2])
    with pytest.raises(ValueError, match="deadline"):
        robot.decode(measured, deadline=float("nan"))
    with pytest.raises(ValueError, match="rows"):
        robot.decode(robot.record(5, weights=False))
    many = spts.mujoco.dress(model, data, pitch=0.006, wires=1)
    with pytest.raises(ValueError, match="2048 at most"):
        many.decode(many.record(2))
    robot.detach()


@pytest.mark.parametrize("mode", ["sense", "foam"])
def test_threads_do_not_change_what_is_felt(dog, mode):
    model, *_ = dog

    def felt(seed):
        data = mujoco.MjData(model)
        robot = spts.mujoco.dress(model, data, pitch=0.02, wires="limb", mode=mode, seed=seed)
        data.qvel[0] = 0.1 * seed
        robot.step(50)
        found = [t.pressure for t in robot.touches] + [y for y, _ in robot.record(30, weights=False)]
        robot.detach()
        return b"".join(part.tobytes() for part in found)

    alone = [felt(seed) for seed in (1, 2)]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        assert list(pool.map(felt, (1, 2))) == alone


def test_a_deep_contact_is_felt():
    """The force of MuJoCo's contact is felt however far a soft contact lets the geoms into each other."""
    model = mujoco.MjModel.from_xml_string("""
<mujoco><option timestep=".0005" gravity="0 0 0"/><default><geom condim="1" solref="-2000 -50" solimp=".5 .5 .001"/></default>
<worldbody><body name="arm"><joint type="slide" axis="0 1 0"/><geom type="capsule" fromto="-.2 0 0 .2 0 0" size=".045" mass="3"/>
</body><body name="chest" pos="0 .18 0"><geom type="capsule" size=".13 .2"/></body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    robot = spts.mujoco.dress(model, data, ["arm"], 0.01, wires=None)
    deepest = 0.0
    for k in range(5000):
        data.xfrc_applied[1, 1] = 0.09 * k
        touch = robot.step()[0]
        if data.ncon:
            felt = touch.pressure.ravel() @ robot.skins[0].areas
            # of taxels that look up to 25 degrees aside, the sum of the forces and not of their vectors
            assert 1.0 - 1e-9 <= felt / data.efc_force.sum() < 1.1
            deepest = min(deepest, data.contact[0].dist)
    assert deepest < -0.012


def test_wires_keep_links_whole():
    """Four like links on two wires are two and two."""
    links = "".join(f'<body name="{k}" pos="{k} 0 0"><freejoint/><geom size=".1"/></body>' for k in range(4))
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{links}</worldbody></mujoco>")
    robot = spts.mujoco.dress(model, mujoco.MjData(model), [*"0123"], 0.03, wires=2)
    counts = [len(skin.areas) for skin in robot.skins]
    assert [w.shape[1] for w in robot.wires] == [sum(counts[:2]), sum(counts[2:])]
    # each is a tree of its own, and a limb
    limbs = spts.mujoco.dress(model, mujoco.MjData(model), [*"0123"], 0.03, wires="limb")
    assert [w.shape[1] for w in limbs.wires] == counts
    none = spts.mujoco.dress(model, mujoco.MjData(model), [*"0123"], 0.03, wires=None)
    with pytest.raises(ValueError, match="wires"):
        none.record(5)


def test_limbs_leave_at_the_first_branch():
    """An arm of three links whose last carries two fingers: the arm is one, each finger another."""
    finger = '<body name="{0}1" pos="0 {1} .1"><joint/><geom size=".02"/><body name="{0}2" pos="0 0 .1"><joint/><geom size=".02"/></body></body>'
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco><worldbody><body name="base"><body name="upper" pos="0 0 .1"><joint/><geom size=".03"/>
      <body name="lower" pos="0 0 .1"><joint/><geom size=".03"/><body name="bare" pos="0 .3 0"><joint/><geom size=".01" contype="0" conaffinity="0"/></body>
      <body name="palm" pos="0 0 .1"><joint/><geom size=".03"/>{finger.format("l", 0.1)}{finger.format("r", -0.1)}</body></body>
    </body></body></worldbody></mujoco>""")
    robot = spts.mujoco.dress(model, mujoco.MjData(model), pitch=0.02, wires="limb")
    taxels = dict(zip(robot.names, (len(skin.areas) for skin in robot.skins)))
    limbs = ["upper", "lower", "palm"], ["l1", "l2"], ["r1", "r2"]
    assert [w.shape[1] for w in robot.wires] == [sum(taxels[name] for name in limb) for limb in limbs]


def test_skins_of_two_links_feel_one_force():
    """A hand of two dressed fingers closes on itself: each feels the other, with the same force."""
    model = mujoco.MjModel.from_xml_string("""
    <mujoco><option timestep="0.002" gravity="0 0 0"/><worldbody>
      <body name="l" pos="-.031 0 0"><joint type="slide" axis="1 0 0" damping="5"/><geom size=".03" mass=".1"/></body>
      <body name="r" pos=".031 0 0"><joint type="slide" axis="-1 0 0" damping="5"/><geom size=".03" mass=".1"/></body>
    </worldbody></mujoco>""")
    data = mujoco.MjData(model)
    robot = spts.mujoco.dress(model, data, pitch=0.01, wires=None)
    for _ in range(500):
        data.qfrc_applied[:] = 5.0
        touches = robot.step()
    sums = [t.pressure.ravel() @ s.areas for t, s in zip(touches, robot.skins)]
    assert robot.wires == [] and sums == pytest.approx([5.0, 5.0], rel=1e-2)
    assert sums[0] == pytest.approx(sums[1], rel=1e-9)
    robot.detach()
    # two layers, one behind the other: each feels the force that the other feels, and more gives way
    gaps = []
    for links in (["l"], ["l", "r"]):
        data = mujoco.MjData(model)
        soft = spts.mujoco.dress(model, data, links, pitch=0.005, wires=None, mode="foam")
        for _ in range(500):
            data.qfrc_applied[:] = 5.0
            touches = soft.step()
        # along the slides; across them a patch of few taxels pushes a little
        pushed = [abs(next(iter(t.wrenches.values()))[0][0]) for t in touches]
        assert pushed == pytest.approx([5.0] * len(links), rel=1e-6)
        gaps.append(np.ptp(data.xpos[1:, 0]) - 0.06)
        soft.detach()
    thick = 0.003
    assert 0.0 < gaps[0] < min(thick, gaps[1]) and gaps[1] < 2 * thick
    # between balls a linear foam of half the stiffness gives way by √2 as much, one that stiffens by more
    assert 2**0.5 < (2 * thick - gaps[1]) / (thick - gaps[0]) < 2.0


def test_loose_objects_wear_skin_if_they_are_named(dog):
    """A ball beside the dog is felt, and has taxels only when it is asked for; a free base is a part of the robot."""
    ball = '<body name="ball" pos="0 0 1"><freejoint/><geom size=".05" mass=".1"/></body></worldbody>'
    model = mujoco.MjModel.from_xml_string(DOG.replace("</worldbody>", ball))
    robot = spts.mujoco.dress(model, mujoco.MjData(model), pitch=0.02)
    assert robot.names == dog[2].names and "trunk" in robot.names and robot.taxels == dog[2].taxels
    assert spts.mujoco.dress(model, mujoco.MjData(model), ["trunk", "ball"], 0.02).names == ["trunk", "ball"]
    alone = mujoco.MjModel.from_xml_string(f'<mujoco><worldbody><geom type="plane" size="1 1 1"/>{ball}</mujoco>')
    with pytest.raises(ValueError, match="named"):
        spts.mujoco.dress(alone, mujoco.MjData(alone))


def test_what_cannot_be_dressed(dog):
    model, data, _ = dog
    for text, arguments in [
        ("pitch", {"pitch": 0.0}),
        ("at most 100000", {"pitch": 2e-4}),
        ("links", {"links": ["tail"]}),
        ("links", {"links": []}),
        ("links", {"links": "some"}),
        ("wires", {"wires": "arm"}),
        ("wires", {"wires": 0}),
        ("wires", {"wires": True}),
        ("number of taxels", {"wires": 10**6}),
        ("thickness", {"thickness": -1.0}),
        ("has no geom with a surface", {"links": ["world"]}),
    ]:
        with pytest.raises(ValueError, match=text):
            spts.mujoco.dress(model, data, **arguments)
