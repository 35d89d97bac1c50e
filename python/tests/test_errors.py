"""What cannot be is a ValueError that says the field, the value and what is valid; nothing panics."""

import subprocess
import sys
import warnings

import numpy as np
import pytest
import spts
from conftest import UPRIGHT

NAN = float("nan")
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)


def outward():
    vertices, faces = spts.Body.box((0.1, 0.1, 0.1)).mesh
    return vertices, faces


def test_skins():
    for text, make in [
        ("rows", lambda: spts.Skin(0, 10, 0.015)),
        ("rows", lambda: spts.Skin(-1, 10, 0.015)),
        ("cols", lambda: spts.Skin(10, 2**70, 0.015)),
        ("pitch", lambda: spts.Skin(10, 10, -1.0)),
        ("pitch", lambda: spts.Skin(10, 10, NAN)),
        ("cells", lambda: spts.Skin(10, 10, 0.015, cells=0)),
        ("stiffness", lambda: spts.Skin(10, 10, 0.015, stiffness=NAN)),
        ("thickness", lambda: spts.Skin(10, 10, 0.015, thickness=0.0)),
        ("damping", lambda: spts.Skin(10, 10, 0.015, damping=-1.0)),
        ("friction", lambda: spts.Skin(10, 10, 0.015, friction=9.0)),
        ("radius", lambda: spts.Skin.cylinder(NAN, 4, 4, span=(0, 0.1))),
        ("span", lambda: spts.Skin.cylinder(0.05, 4, 4, span=(0.1, 0.0))),
        ("arc", lambda: spts.Skin.cylinder(0.05, 4, 4, span=(0, 0.1), arc=(0, 10))),
        ("axis", lambda: spts.Skin.cylinder(0.05, 4, 4, span=(0, 0.1), axis="w")),
        ("points", lambda: spts.Skin.cylinder(0.05, 4, 4, span=(0, 0.1), points=0)),
        ("mesh under taxel", lambda: spts.Skin.wrap(spts.Body.sphere(0.05), 4, 4, span=(0, 0.2))),
    ]:
        with pytest.raises(ValueError, match=text):
            make()


def test_points():
    good = (np.zeros((4, 3)), np.tile((0.0, 0.0, 1.0), (4, 1)), np.ones(4) * 1e-4)
    for text, change in [
        ("positions", {0: np.zeros((4, 2))}),
        ("positions", {0: np.full((4, 3), NAN)}),
        ("normals", {1: np.zeros((4, 3))}),
        ("normals", {1: np.ones((3, 3))}),
        ("areas", {2: np.zeros(4)}),
        ("areas", {2: np.full(4, np.inf)}),
        ("points", {0: np.zeros((0, 3)), 1: np.zeros((0, 3)), 2: np.zeros(0)}),
    ]:
        arrays = [change.get(k, a) for k, a in enumerate(good)]
        with pytest.raises(ValueError, match=text):
            spts.Skin.from_points(*arrays)
    for taxels in ([0, 1, 2, 9], [-1, 0, 1, 2], [0, 0, 0]):
        with pytest.raises(ValueError, match="taxels"):
            spts.Skin.from_points(*good, taxels=np.array(taxels))
    with pytest.raises(ValueError, match="taxels"):
        spts.Skin.from_points(*good, rows=3)


def test_bodies(tmp_path):
    vertices, faces = outward()
    for text, make in [
        ("radius", lambda: spts.Body.sphere(0.0)),
        ("radius", lambda: spts.Body.sphere(NAN)),
        ("size", lambda: spts.Body.box((1, 1, -1))),
        ("length", lambda: spts.Body.capsule(0.1, np.inf)),
        ("stiffness", lambda: spts.Body.sphere(0.1, stiffness=NAN)),
        ("stiffness", lambda: spts.Body.sphere(0.1, stiffness=0.0)),
        ("faces", lambda: spts.Body.from_vertices(vertices, np.zeros((0, 3), np.int64))),
        ("faces", lambda: spts.Body.from_vertices(vertices, faces + 1000)),
        ("faces", lambda: spts.Body.from_vertices(vertices, faces[:, :2].copy())),
        ("vertices", lambda: spts.Body.from_vertices(vertices * NAN, faces)),
        ("vertices", lambda: spts.Body.from_vertices(vertices[:, :2].copy(), faces)),
        ("none.stl", lambda: spts.Body.from_mesh(tmp_path / "none.stl")),
        ("scale", lambda: spts.Body.from_mesh(tmp_path / "none.stl", scale=NAN)),
        ("repair", lambda: spts.Body.from_mesh(tmp_path / "none.stl", repair="far_side")),
    ]:
        with pytest.raises(ValueError, match=text):
            make()
    (tmp_path / "bad.stl").write_bytes(b"solid nothing")
    (tmp_path / "bad.txt").write_text("no mesh")
    for name in ("bad.stl", "bad.txt"):
        with pytest.raises(ValueError, match=name):
            spts.Body.from_mesh(tmp_path / name)


def test_bodies_that_are_mended(tmp_path):
    vertices, faces = outward()
    with pytest.warns(UserWarning, match="clockwise"):
        turned = spts.Body.from_vertices(vertices, faces[:, ::-1].copy())
    a, b, c = (turned.mesh[0][turned.mesh[1][:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) > 0.0
    lines = [f"v {x} {y} {z}" for x, y, z in 0.1 * vertices / np.ptp(vertices)]
    lines += [f"f {a} {b} {c}" for a, b, c in faces[1:] + 1]
    path = tmp_path / "open.obj"
    path.write_text("\n".join(lines))
    with pytest.warns(UserWarning, match="not closed"):
        body = spts.Body.from_mesh(path, repair="near_side", centre=True)
    assert body.triangles == len(faces) - 1
    low, high = body.mesh[0].min(0), body.mesh[0].max(0)
    np.testing.assert_allclose([*(low + high)[:2], low[2]], 0.0, atol=1e-12)


def test_touches(skin, ball):
    at = (0, 0, 0.03)
    for text, poses, twists, dt in [
        ("dt", {ball: (at, UPRIGHT)}, None, -1.0),
        ("dt", {ball: (at, UPRIGHT)}, None, NAN),
        ("pose", {ball: at}, None, 0.0),
        ("pose", {ball: ((0, 0), UPRIGHT)}, None, 0.0),
        ("pose", {ball: ((0, 0, NAN), UPRIGHT)}, None, 0.0),
        ("quaternion", {ball: (at, (0, 0, 0, 0))}, None, 0.0),
        ("quaternion", {ball: (at, (2, 0, 0, 0))}, None, 0.0),
        ("quaternion", {ball: (at, (NAN, 0, 0, 0))}, None, 0.0),
        ("twist", {ball: (at, UPRIGHT)}, {ball: (0, 0, 0)}, 0.0),
        ("twist", {ball: (at, UPRIGHT)}, {ball: (NAN,) * 6}, 0.0),
        ("no pose", {}, {ball: (0,) * 6}, 0.0),
    ]:
        with pytest.raises(ValueError, match=text):
            skin.touch(poses, twists, dt)
    with pytest.raises(TypeError):
        skin.touch({"ball": (at, UPRIGHT)})
    # deep inside, far away, spinning wildly: numbers
    for place in ((0, 0, 0), (0, 0, -5), (1e3, 1e3, 1e3)):
        touch = skin.touch({ball: (place, UPRIGHT)}, {ball: (1e6,) * 6}, 1e9)
        assert np.isfinite(touch.pressure).all()


def test_wires(skin, pressed):
    for text, arguments in [
        ("readout", {"readout": "best"}),
        ("readout", {"readout": "none.toml"}),
        ("seeds", {"seeds": "random"}),
        ("seeds", {"seeds": [1, 2, 3]}),
        ("seeds", {"seeds": [-1] * 100}),
        ("levels", {"levels": "ternary"}),
        ("transducer", {"transducer": "magic"}),
        ("spread_log_sd", {"parameters": {"spread_log_sd": NAN}}),
        ("parameters", {"parameters": {"spread_log_sd": object()}}),
        ("unknown", {"parameters": {"colour": 1.0}}),
        ("faults", {"faults": [{"name": "dead", "taxel": 100}]}),
        ("taxels", {"taxels": [0, 100]}),
        ("taxels", {"taxels": [5, 5]}),
        ("taxels", {"taxels": [-1]}),
        ("seed", {"seed": -1}),
        ("session", {"session": 2**64}),
        ("cols", {"taxels": []}),
    ]:
        with pytest.raises(ValueError, match=text):
            spts.Wire(skin, **arguments)
    wire = spts.Wire(skin)
    for count in (0, 2**40, None):
        with pytest.raises(ValueError, match="measurements"):
            wire.record(pressed, count)
    with pytest.raises(ValueError, match="measurements"):
        wire.record(pressed, -1)
    with pytest.raises(ValueError, match="another skin"):
        spts.Wire(spts.Skin(10, 10, 0.015)).record(pressed, 20)
    later = skin.touch({}, dt=1.0)
    wire.feel(later)
    with pytest.raises(ValueError, match="time"):
        wire.feel(pressed)


def test_shapes_are_said(skin, pressed):
    """A window in place of windows, and `record`'s (y, phi) in the order in which it comes."""
    y, phi = spts.Wire(skin).record(pressed, 20)
    for text, call in [
        (
            r"`phi` has shape \(1, 20, 100\); \(M, taxels\) is needed: take phi\[0\]",
            lambda: spts.decode(phi[None], y, skin),
        ),
        (r"`y` has shape \(1, 20\); \(M,\) is needed: take y\[0\]", lambda: spts.decode(phi, y[None], skin)),
        ("`phi` and `y` are swapped", lambda: spts.decode(y, phi, skin)),
        ("`phi` and `y` are swapped", lambda: spts.windows(y, phi)),
        ("`phi` and `y` are swapped", lambda: spts.windows(y[None], phi[None])),
        (r"`phi` has shape \(1, 20, 100\) and `y` \(20,\)", lambda: spts.windows(phi[None], y)),
        ("real", lambda: spts.decode(phi + 1j, y, skin)),
    ]:
        with pytest.raises(ValueError, match=text):
            call()


def test_one_image_is_not_scored_row_by_row_unsaid(pressed):
    image = pressed.pressure
    with pytest.warns(UserWarning, match=r"\(10, 10\): it is scored as 10 images of 10 taxels"):
        assert spts.iou(image, image).shape == (10,)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for one in (image[None], image.ravel(), image.reshape(1, -1)):
            assert spts.iou(one, one) == spts.support_accuracy(one, one) == [1.0]
        # windows of a decoder's answers
        assert spts.iou(np.ones((20, 100)), np.ones((20, 100))).shape == (20,)
        assert spts.iou(image[:, None], image[:, None]).shape == (10,)
    with pytest.raises(ValueError, match="same"):
        spts.iou(image, image.ravel())


def test_a_dead_skin(skin, ball, pressed):
    """Every cell is dead: measurements are numbers, and so is what is decoded of them."""
    wire = spts.Wire(skin, faults=[{"name": "dead", "taxel": k} for k in range(100)])
    y, phi = wire.record(pressed, 20)
    assert np.isfinite(y).all() and np.isfinite(spts.decode(phi, y, (10, 10))).all()


def test_decoding(skin, pressed):
    y, phi = spts.Wire(skin).record(pressed, 20)
    for text, arguments in [
        ("decoder", (phi, y, (10, 10), "best")),
        ("shape", (phi, y, (0, 10))),
        ("shape", (phi, y, (1000, 1000))),
        ("phi", (phi, y, (10, 11))),
        ("phi", (phi * NAN, y, (10, 10))),
        ("y", (phi, y[:19], (10, 10))),
        ("y", (phi, y * np.inf, (10, 10))),
        ("images", (phi, y, (10, 10), "evidence")),
        ("prior", (phi, y, (10, 10), "nn_lmmse", np.ones((3, 99)))),
        ("images", (phi, y, (10, 10), "nn_lmmse", np.full((3, 100), NAN))),
        ("library", (phi, y, (10, 10), "nn_lmmse", np.zeros((3, 100)))),
    ]:
        with pytest.raises(ValueError, match=text):
            spts.decode(*arguments)


def test_all_commands_are_there():
    said = subprocess.run([sys.executable, "-m", "spts", "--help"], capture_output=True, text=True, check=True).stdout
    commands = {line.split()[0] for line in said.splitlines() if line.startswith("  ") and line[2] != " "}
    assert {"simulate", "reproduce", "live", "design", "bench", "score", "dataset", "record"} <= commands
    said = subprocess.run([sys.executable, "-m", "spts", "dataset", "mke"], capture_output=True, text=True)
    assert said.returncode == 2 and "make" in said.stderr, said.stderr
