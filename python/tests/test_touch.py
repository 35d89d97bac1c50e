"""Pressures and wrenches: balance, frames, closed forms."""

import numpy as np
import pytest
import spts
from conftest import UPRIGHT, turned


def balance(skin, touch, body):
    """Force that the taxels carry, as a share of that on the body by which it misses it. Without friction."""
    carried = (touch.pressure.ravel() * skin.areas) @ skin.normals
    force, _ = touch.wrenches[body]
    return np.linalg.norm(carried - force) / np.linalg.norm(force)


def test_the_six_lines():
    skin = spts.Skin(rows=10, cols=10, pitch=0.015)
    cup = spts.Body.cylinder(radius=0.03, length=0.08)
    wire = spts.Wire(skin, readout="as_built", seeds="mixed", seed=1)
    pose, twist = ((0.0, 0.0, 0.0385), UPRIGHT), (0.0,) * 6
    touch = skin.touch({cup: pose}, {cup: twist}, 0.05)
    y, phi = wire.record(touch, 20)
    image = spts.decode(phi, y, shape=(10, 10), decoder="nn_lmmse")
    assert touch.pressure.shape == image.shape == (10, 10)
    assert y.shape == (20,) and phi.shape == (20, 100) and set(np.unique(phi)) == {-1.0, 1.0}
    # 16 taxels are pressed; an image that knows nothing has 0.09 in common with them
    assert spts.iou(image[None], touch.pressure[None])[0] > 0.25


def test_what_taxels_carry_is_what_the_body_feels(skin, ball):
    """To 1e-9: flat, for shapes, turned and off the middle."""
    rng = np.random.default_rng(1)
    for body, height in [
        (ball, 0.029),
        (spts.Body.box((0.04, 0.05, 0.03)), 0.014),
        (spts.Body.capsule(0.02, 0.05), 0.019),
    ]:
        for _ in range(5):
            pose = (np.append(rng.uniform(-0.04, 0.04, 2), height), turned((0, 0, 1), rng.uniform(0, 6)))
            if body is not ball and height == 0.019:
                pose = (pose[0], turned((0, 1, 0), np.pi / 2))
            touch = skin.touch({body: pose})
            assert balance(skin, touch, body) < 1e-9
            # and about the body's origin: every taxel's force at a lever of less than a pitch from its middle
            force, torque = touch.wrenches[body]
            lever = np.cross(
                skin.positions - pose[0], (touch.pressure.ravel() * skin.areas)[:, None] * skin.normals
            ).sum(0)
            assert np.linalg.norm(lever - torque) < 0.5 * 0.015 * np.linalg.norm(force)


def test_the_frame_of_a_flat_skin(skin, ball):
    """x along columns, row 0 at the largest y."""
    assert np.allclose(skin.positions[0], (-0.0675, 0.0675, 0)) and np.allclose(skin.positions[9], (0.0675, 0.0675, 0))
    for taxel in (0, 9, 42, 90):
        touch = skin.touch({ball: (skin.positions[taxel] + (0, 0, 0.0295), UPRIGHT)})
        assert np.argmax(touch.pressure) == taxel


def test_a_sphere_on_a_flat_skin_is_winkler():
    """F = π K R d² for a paraboloid of radius R at the depth d; a sphere's gap is d/2R = 1 % from it, the foam's
    densification d/h, quadrature and facets 1 %."""
    depth, radius, stiffness, thickness = 0.5e-3, 0.03, 2e6, 0.1
    skin = spts.Skin(20, 20, 0.005, cells=20, stiffness=stiffness, thickness=thickness)
    ball = spts.Body.sphere(radius)
    force, torque = skin.touch({ball: ((0, 0, radius - depth), UPRIGHT)}).wrenches[ball]
    assert force[2] == pytest.approx(np.pi * stiffness * radius * depth**2, rel=0.03)
    assert np.abs(force[:2]).max() < 1e-3 * force[2] and np.abs(torque).max() < 1e-4 * force[2]


def test_a_sphere_on_a_cylinder_is_winkler():
    """F = π K d² √(A B), A = R along the axis, 1/B = 1/R + 1/S around it (Johnson, Contact Mechanics, §4.3)."""
    depth, radius, around, stiffness = 0.3e-3, 0.03, 0.02, 2e6
    skin = spts.Skin.cylinder(
        around, 40, 40, span=(-0.02, 0.02), arc=(-0.6, 0.6), points=8, stiffness=stiffness, thickness=0.05
    )
    ball = spts.Body.sphere(radius)
    touch = skin.touch({ball: ((around + radius - depth, 0, 0), UPRIGHT)})
    both = 1 / (1 / radius + 1 / around)
    assert touch.wrenches[ball][0][0] == pytest.approx(np.pi * stiffness * depth**2 * np.sqrt(radius * both), rel=0.03)
    assert balance(skin, touch, ball) < 0.01


def test_a_curved_skin_that_is_flat_is_the_flat_one(skin):
    """The same points, so the same pressures but for round-off, under a body whose rims are beside the skin."""
    n, pitch = 60, 0.0025
    at = (np.arange(n) - n / 2 + 0.5) * pitch
    y, x = np.meshgrid(-at, at, indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), np.zeros(n * n)], axis=1)
    taxels = (np.arange(n)[:, None] // 6 * 10 + np.arange(n)[None, :] // 6).ravel()
    normals, areas = np.tile((0.0, 0.0, 1.0), (n * n, 1)), np.full(n * n, pitch**2)
    curved = spts.Skin.from_points(points, normals, areas, taxels=taxels, rows=10, cols=10)
    body = spts.Body.box((0.4, 0.4, 0.02))
    pose, twist = ((0.011, 0.002, 0.0125), turned((0.1, 0.2, 1.0), 0.3)), (0.01, 0.0, -0.02, 0.1, 0.2, 0.3)
    a, b = (s.touch({body: pose}, {body: twist}) for s in (skin, curved))
    assert a.pressure.max() > 1e4
    assert np.abs(a.pressure - b.pressure).max() < 1e-9 * a.pressure.max()
    for k in range(2):
        assert np.allclose(a.wrenches[body][k], b.wrenches[body][k], rtol=1e-9, atol=1e-12)


def test_a_wrapped_mesh_is_its_cylinder():
    tube = spts.Body.cylinder(0.04, 0.3)
    span = (-0.1, 0.1)
    wrapped = spts.Skin.wrap(tube, 12, 24, span=span)
    wound = spts.Skin.cylinder(0.04, 12, 24, span=span)
    # a prism of 96 sides lies within R (1 − cos(π/96)) = 2e-5 m of its cylinder
    assert np.abs(wrapped.positions - wound.positions).max() < 3e-5
    assert wrapped.areas.sum() == pytest.approx(2 * np.pi * 0.04 * 0.2, rel=2e-3)
    assert wrapped.positions[0, 2] > wrapped.positions[-1, 2]


def test_bodies_add_up_and_leave(skin, ball):
    other = ball.copy()
    left, right = ((-0.03, 0, 0.028), UPRIGHT), ((0.03, 0, 0.028), UPRIGHT)
    both = skin.touch({ball: left, other: right}, dt=0.01)
    alone = [skin.touch({b: p}, dt=0.01) for b, p in ((ball, left), (other, right))]
    assert np.allclose(both.pressure, alone[0].pressure + alone[1].pressure, rtol=1e-12)
    assert both.area == pytest.approx(alone[0].area + alone[1].area)
    assert np.allclose(both.wrenches[other][0], alone[1].wrenches[other][0])
    nothing = skin.touch({}, dt=0.01)
    assert nothing.area == 0 and not nothing.pressure.any() and nothing.wrenches == {}
    assert nothing.time == pytest.approx(0.04) and nothing.number == 4


def test_foam_resists_motion(skin, ball):
    """Kelvin–Voigt: more force on the way in, less on the way out; friction against sliding."""
    pose = ((0, 0, 0.028), UPRIGHT)
    still, faster, slower, sliding = (
        skin.touch({ball: pose}, {ball: twist}).wrenches[ball][0]
        for twist in ((0,) * 6, (0, 0, -0.1, 0, 0, 0), (0, 0, 0.1, 0, 0, 0), (0.1, 0, 0, 0, 0, 0))
    )
    assert slower[2] < still[2] < faster[2]
    assert sliding[0] < 0 and sliding[2] == pytest.approx(still[2])


def test_a_soft_body_presses_less(skin):
    poses = ((0, 0, 0.028), UPRIGHT)
    hard, soft = spts.Body.sphere(0.03), spts.Body.sphere(0.03, stiffness=1e6)
    assert skin.touch({soft: poses}).wrenches[soft][0][2] < skin.touch({hard: poses}).wrenches[hard][0][2]


def test_a_hundred_thousand_taxels(ball):
    n = 320
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(n * n)], axis=1) * 0.001
    skin = spts.Skin.from_points(points, np.tile((0.0, 0.0, 1.0), (n * n, 1)), np.full(n * n, 1e-6), rows=n)
    touch = skin.touch({ball: ((0.16, 0.16, 0.029), UPRIGHT)})
    assert touch.pressure.shape == (n, n) and balance(skin, touch, ball) < 1e-9
    y, phi = spts.Wire(skin, readout="ideal").record(touch, 100)
    assert phi.shape == (100, n * n) and np.isfinite(y).all()


def test_lists_and_other_types_are_arrays():
    vertices, faces = spts.Body.box((0.1, 0.1, 0.1)).mesh
    for points, corners in ((vertices.tolist(), faces.tolist()), (vertices.astype(np.float32), faces.astype(np.int32))):
        assert spts.Body.from_vertices(points, corners).triangles == 12
    skin = spts.Skin.from_points([[0, 0, 0], [1, 0, 0]], [[0, 0, 1], [0, 0, 2]], [1e-4, 1e-4])
    assert skin.shape == (1, 2) and np.array_equal(skin.normals, [[0, 0, 1], [0, 0, 1]])


def test_a_body_is_pickled():
    import pickle

    body = pickle.loads(pickle.dumps(spts.Body.sphere(0.03, stiffness=1e6)))
    skin, pose = spts.Skin(), ((0, 0, 0.028), UPRIGHT)
    same = spts.Body.sphere(0.03, stiffness=1e6)
    assert np.array_equal(skin.touch({body: pose}).pressure, skin.touch({same: pose}).pressure)
