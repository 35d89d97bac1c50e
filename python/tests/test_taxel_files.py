"""Taxels where files and sites say: `dress(taxels=…)` and `dress(sites=…)`."""

import json
import time

import mujoco
import numpy as np
import pytest
import spts.mujoco
from spts.taxels import areas_of, nearest

# A ball that lies on its lowest point, with a box fixed beside it, and a frame at that point that looks down.
MODEL = """
<mujoco><option timestep="0.002"/><asset><mesh name="wedge" vertex=".2 0 0  .3 0 0  .2 .1 0  .2 0 .1"/></asset><worldbody>
  <geom name="floor" type="plane" size="2 2 .1"/>
  <body name="palm" pos="0 0 .0501"><freejoint/><geom name="ball" size=".05" mass="1"/>
    <site name="low" pos="0 0 -.05" zaxis="0 0 -1"/>
    <body name="tip" pos="0 .2 0"><joint axis="0 1 0" stiffness="100" damping="1"/>
      <geom name="block" type="box" size=".03 .02 .01" pos="0 0 .01" mass=".01"/>
      <site name="skin_0" pos="0 0 .02" type="box" size=".004 .005 .001"/>
      <site name="skin_1" pos=".01 0 .02" type="ellipsoid" size=".002 .003 .001"/>
      <site name="skin_2" pos=".01 .01 .02"/><site name="skin_3" pos="0 .01 .02"/></body></body>
  <body name="wedge"><freejoint/><geom name="wedge" type="mesh" mesh="wedge" mass=".1"/></body>
</worldbody></mujoco>"""
RADIUS = 0.05


@pytest.fixture(scope="module")
def model():
    return mujoco.MjModel.from_xml_string(MODEL)


def cap(count=400, share=0.1):
    """Normals spread evenly over the lowest `share` of a sphere."""
    k = np.arange(count) + 0.5
    height, angle = 1.0 - 2.0 * share * k / count, 2.399963229728653 * k
    across = np.sqrt(1.0 - height**2)
    return np.stack([across * np.cos(angle), across * np.sin(angle), -height], axis=1)


def dressed(model, steps=0, **arguments):
    data = mujoco.MjData(model)
    robot = spts.mujoco.dress(model, data, **{"wires": None, **arguments})
    for _ in range(steps):
        robot.step()
    return robot


def write(path, rows, *, header="", separator=",", form="{:.9g}"):
    lines = [separator.join(form.format(v) for v in row) for row in rows]
    path.write_text("\n".join([header, *lines] if header else lines) + "\n")
    return path


def felt(robot):
    return [touch.pressure.ravel() @ skin.areas for touch, skin in zip(robot.touches, robot.skins)]


def test_a_file_is_as_good_as_the_pitch(model, tmp_path):
    """The points that `pitch` makes, from a file: the same pressures, but for the ten digits of the file."""
    by_pitch = dressed(model, 300, pitch=0.005, links=["palm"])
    skin = by_pitch.skins[0]
    rows = np.c_[skin.positions - 0.003 * skin.normals, skin.normals, skin.areas]
    path = write(tmp_path / "palm.csv", rows, header="x,y,z,nx,ny,nz,area", form="{:.12g}")
    by_file = dressed(model, 300, taxels={"palm": path})
    pressure, other = (robot.touches[0].pressure for robot in (by_pitch, by_file))
    assert dressed(model, taxels={model.body("palm").id: path}).names == by_file.names == ["palm"]
    assert np.array_equal(by_file.rows[0], np.arange(by_file.taxels))
    assert pressure.max() > 1e3 and np.abs(pressure - other).max() < 1e-6 * pressure.max()
    assert felt(by_file)[0] == pytest.approx(9.81, rel=1e-3)


@pytest.mark.parametrize(
    "header, separator, unit",
    [
        ("", ",", "m"),
        ("", " ", "mm"),
        ("", "\t", "cm"),
        ("x,y,z,nx,ny,nz", ",", "m"),
        ("X; Y; Z; NX; NY; NZ", ";", "mm"),
    ],
)
def test_csv(model, tmp_path, header, separator, unit):
    normals = cap(100)
    rows = np.c_[normals * RADIUS / {"m": 1.0, "cm": 1e-2, "mm": 1e-3}[unit], normals]
    path = write(tmp_path / "palm.csv", rows, header=header, separator=separator)
    path.write_text("# of the left hand\r\n\r\n" + path.read_text().replace("\n", "  # one\r\n"), newline="")
    (skin,) = dressed(model, taxels=path, links=["palm"], unit=unit).skins
    assert np.allclose(skin.positions, normals * 0.053, atol=1e-8) and np.allclose(skin.normals, normals, atol=1e-7)
    # a share of the sphere, within the rims
    assert skin.areas.sum() == pytest.approx(0.1 * 4 * np.pi * RADIUS**2, rel=0.15)


def test_columns_of_names(model, tmp_path):
    """Frames of bodies, sites and geoms, areas, and wires by their labels over several links."""
    path = tmp_path / "robot.csv"
    path.write_text(
        "id,link,x,y,z,nx,ny,nz,area,wire\n"
        "7,palm,0,0,-0.05,0,0,-2,1e-4,left\n"
        "8,tip,0,0,0.02,0,0,1,2e-4,right\n"
        "9,tip,0.01,0,0.02,0,0,1,3e-4,left\n"
        "10,low,0.01,0,-0.001,0.2,0,0.98,4e-4,right\n"
    )
    robot = dressed(model, taxels=str(path), wires="link")
    assert robot.names == ["palm", "tip"] and [rows.tolist() for rows in robot.rows] == [[0, 3], [1, 2]]
    palm, tip = robot.skins
    assert np.allclose(palm.areas, [1e-4, 4e-4]) and np.allclose(tip.positions, [[0, 0, 0.023], [0.01, 0, 0.023]])
    # the site looks down: its z is the body's -z
    assert np.allclose(
        palm.normals, np.array([[0, 0, -1], [0.2, 0, -0.98]]) / [[1.0], [np.hypot(0.2, 0.98)]], atol=1e-9
    )
    assert [wire.shape for wire in robot.wires] == [(1, 2), (1, 2)]
    robot.step()
    assert [phi.shape for _, phi in robot.record(5)] == [(5, 2)] * 2
    assert robot._wired == [[0, 1], [0, 1]]
    assert dressed(model, taxels=path, wires=None).wires == []
    # a geom's frame, and the frame of a mesh's file
    path.write_text("geom,x,y,z,nx,ny,nz,area\nblock,0,0,0.01,0,0,1,1e-4\nwedge,0.21,0.01,0,0,0,-1,1e-4\n")
    tip, wedge = dressed(model, taxels=path).skins
    assert np.allclose(tip.positions, [[0, 0, 0.023]])
    assert np.allclose(wedge.positions, [[0.21, 0.01, -0.003]]) and np.allclose(wedge.normals, [[0, 0, -1]], atol=1e-6)


def test_json(model, tmp_path):
    normals, path = cap(100), tmp_path / "taxels.json"
    names = ("x", "y", "z", "nx", "ny", "nz")
    rows = [dict(zip(names, map(float, row)), wire=k % 3) for k, row in enumerate(np.c_[normals * RADIUS, normals])]
    skins = []
    for content in (rows, {"taxels": rows}):
        path.write_text(json.dumps(content))
        robot = dressed(model, taxels={"palm": path}, wires="link")
        skins += robot.skins
        assert [wire.shape[1] for wire in robot.wires] == [34, 33, 33]
    link = {"points": (1e3 * RADIUS * normals).tolist(), "normals": normals.tolist(), "areas": [25.0] * 100}
    path.write_text(json.dumps({"links": {"palm": link}}))
    (skin,) = dressed(model, taxels=path, unit="mm").skins
    assert np.allclose(skin.areas, 25e-6)
    for other in skins:
        assert np.allclose(other.positions, skin.positions, atol=1e-12)


def test_the_icubs_format(model, tmp_path):
    """Rows of zeros are no taxels; what is at one place shares its area; the name is the link."""
    normals = cap(60)
    rows = np.c_[normals * RADIUS, 0.7 * normals]
    rows[[3, 10]], rows[21:24] = 0.0, rows[20]
    path = write(tmp_path / "hand.txt", rows, separator="  ")
    head = f"name                palm\nspatial_sampling    taxel\ntaxel2Repr (  {' 3' * 60} )\n[calibration]\n"
    path.write_text(head + path.read_text())
    with pytest.warns(UserWarning, match=r"hand.txt: line 25 and .*hand.txt: line 26; 4 of 58 share their places"):
        robot = dressed(model, taxels=path)
    assert robot.names == ["palm"]
    assert np.array_equal(robot.rows[0], np.delete(np.arange(60), [3, 10]))
    areas = dict(zip(robot.rows[0], robot.skins[0].areas))
    assert areas[20] == areas[21] == areas[23] < 0.5 * areas[30]
    # as values of a port
    port = np.zeros(60)
    port[robot.rows[0]] = robot.skins[0].areas
    assert (port == 0.0).sum() == 2
    with pytest.raises(ValueError, match='hand.txt: line 5: `link`: the model has none called "plam"; .*palm'):
        dressed(model, taxels={"plam": path, "palm": path})


def test_sites(model):
    robot = dressed(model, sites="skin_*")
    (skin,) = robot.skins
    assert robot.names == ["tip"] and np.allclose(skin.normals, [[0, 0, 1]] * 4)
    assert np.allclose(skin.positions, [[0, 0, 0.023], [0.01, 0, 0.023], [0.01, 0.01, 0.023], [0, 0.01, 0.023]])
    # a box and an ellipsoid have areas; the others their share of a square of 10 mm, at its corners
    assert np.allclose(skin.areas[:2], [4 * 4e-3 * 5e-3, np.pi * 2e-3 * 3e-3])
    assert np.allclose(skin.areas[2:], 1e-4, rtol=0.15)
    assert np.allclose(dressed(model, sites="skin_*", pitch=0.02).skins[0].areas[2:], 4e-4)
    with pytest.raises(ValueError, match='`sites` = "pad_.": no site .*skin_0'):
        dressed(model, sites="pad_?")


@pytest.mark.parametrize("off", [-0.015, -0.004, 0.004, 0.015])
def test_places_beside_the_surface_are_put_onto_it(model, off):
    """A robot's own geometry is finer than its geoms: the force is felt all the same, in either mode."""
    normals = cap()
    for mode in ("sense", "foam"):
        robot = dressed(model, 300, taxels={"palm": np.c_[(RADIUS + off) * normals, normals]}, mode=mode)
        assert np.linalg.norm(robot.skins[0].positions, axis=1) == pytest.approx(0.053, abs=5e-4)
        assert felt(robot)[0] == pytest.approx(9.81, rel=0.02)
    # without normals, the surface's
    (skin,) = dressed(model, taxels={"palm": (RADIUS + off) * normals}).skins
    assert np.einsum("ij,ij->i", skin.normals, normals).min() > 0.98


@pytest.mark.parametrize(
    "change", [lambda rows: rows * [1, 1, 1, -1, -1, -1], lambda rows: rows + [0, 0, -0.1, 0, 0, 0]]
)
def test_taxels_that_may_feel_nothing_are_told(model, change):
    normals = cap(50)
    with pytest.warns(UserWarning, match=r'50 of 50 taxels of "palm" have no surface .* row 0: are unit, frame'):
        dressed(model, taxels={"palm": change(np.c_[RADIUS * normals, normals])})


GOOD = "0 0 -.05 0 0 -1\n.01 0 -.049 0 0 -1\n0 .01 -.049 0 0 -1\n"


@pytest.mark.parametrize(
    "content, text",
    [
        ("", "empty"),
        ("# nothing\n", "no taxel in it"),
        ("0 0 0 0 0 0\n" * 3, "no taxel in it, 3 rows of zeros"),
        ("x,y,z\n", "no taxel under the header"),
        (b"\x00\x01\x7fELF", "not text"),
        ("x y z".encode("utf-16"), "UTF-16"),
        ("0 0 0 1\n", "line 1 has 4 numbers"),
        (GOOD + "0 .02 -.049 0 0\n", "line 4 has 5 fields; the first line has 6"),
        ("x,y,z\n0,0,-.05\n0,0.01,up\n", "line 3: `z` = 'up' is no number"),
        (GOOD + "nan .02 -.049 0 0 -1\n", "line 4: .* a finite number"),
        (GOOD + "0 .02 -.049 0 0 0\n", "line 4: .* normal of zero length"),
        (GOOD + "0 0 -.05 0 0 -1\n", r"line 1 and .*line 4; is the unit right\?"),
        ("0,01;0,02;0,03\n", "'0,01' comes of a decimal comma"),
        ("0,01 0,02 0,03\n", "'03' comes of a decimal comma"),
        ("x;y;z\n0,01;0;0\n", "line 2: '0,01' comes of a decimal comma"),
        ("0,01,0,02,0,03\n", "'01' comes of a decimal comma"),
        ("x,y,z\n0,01,0,02,0,03\n", "'01' comes of a decimal comma"),
        ("0 0 -50 0 0 -1\n", 'unit="mm"'),
        ("0 0 -5 0 0 -1\n1 0 -5 0 0 -1\n", "whole metres, .*unit="),
        ("x,y,z,nx\n0,0,0,1\n", "a normal needs"),
        ("x,y,nx,ny,nz\n0,0,0,1,0\n", "no column `z`"),
        ("x,y,z,pressure\n0,0,0,1\n", "unknown column 'pressure'; valid: x, y"),
        ("x,y,z,z\n0,0,0,1\n", "2 columns are called 'z'"),
        ("x,y,z,link,geom\n0,0,.1,palm,ball\n", "one column may name the frame; it has: link, geom"),
        ("x,y,z,link\n0,0,.1,palm\n", 'has a column `link`, and is given for "palm" too'),
        ("x,y,z,area\n0,0,-.05,0\n", r"`area` is outside \(0, 1\] m²"),
        ("0 0 -.05 0 0 -1\n", "give `area` or `pitch`"),
        ("0 0 .01\n", 'no normal, and no surface of "palm" within 0.02 m'),
        ("{", "no JSON: .*line 1"),
        ("[]", "a list of objects"),
        ('{"points": []}', "a list of objects"),
        ('[{"x": 0, "y": 0, "z": 1.5}, {"x": 0, "y": 0}]', "taxel 1 differs from the first in its fields: z"),
        ('[{"x": 0, "y": 0, "z": "1"}]', "taxel 0: `z` = '1' is no number"),
        ('[{"x": 0, "y": 0, "z": NaN}]', "taxel 0: .* finite"),
        ('[{"x": 0, "y": 0, "zz": 1}]', "unknown column 'zz'"),
        ('{"links": {"palm": {"points": [[0, 0]]}}}', "rows of 3 numbers"),
        ('{"links": {"palm": {"points": [[0, 0, 1.5]], "areas": [1, 2]}}}', "1 points, but 2 of `area`"),
        ('{"links": {"palm": {"points": [[0, 0, 1.5]], "areas": ["a"]}}}', "`area` has entries that are no numbers"),
        ('{"links": {"palm": {"normals": []}}}', "`points` are needed"),
    ],
)
def test_files_that_are_refused(model, tmp_path, content, text):
    """By the name of the file, and the line or the number of the taxel."""
    path = tmp_path / "bad.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ValueError, match=f"(?s)bad.csv.*({text})"):
        dressed(model, taxels={"palm": path})


def test_arguments_that_are_refused(model, tmp_path):
    path = tmp_path / "palm.txt"
    path.write_text(GOOD)
    wired = tmp_path / "wired.csv"
    wired.write_text("x,y,z,wire\n0,0,-.05,1\n")
    rows = np.c_[RADIUS * cap(9), cap(9)]
    for text, arguments in [
        ("of which link", {"taxels": path}),
        ("of which link", {"taxels": path, "links": ["palm", "tip"]}),
        ("no taxel is on tip", {"taxels": {"palm": path}, "links": ["tip"]}),
        ("both given", {"taxels": path, "sites": "skin_*"}),
        ("`unit` = 'inch'; valid: m, cm, mm", {"taxels": path, "unit": "inch"}),
        ("empty", {"taxels": []}),
        ("empty", {"taxels": {}}),
        (r'`taxels\["tip"\]`: no column `wire`', {"taxels": {"palm": wired, "tip": rows}}),
        (r'`taxels\["palm"\]`: rows of 3 or 6 numbers', {"taxels": {"palm": rows[:, :4]}}),
        (r'`taxels\["palm"\]`: rows of 3 or 6 numbers', {"taxels": {"palm": 3.0}}),
        (
            r'`taxels\["palm"\]`: row 2: .*finite',
            {"taxels": {"palm": np.where(np.arange(9)[:, None] == 2, np.nan, rows)}},
        ),
        ("no geom with a surface", {"taxels": {"world": rows}}),
    ]:
        with pytest.raises(ValueError, match=text):
            dressed(model, **arguments)
    with pytest.raises(FileNotFoundError, match="gone.csv"):
        dressed(model, taxels={"palm": tmp_path / "gone.csv"})


def test_the_nearest_are_those_of_all_pairs():
    rng = np.random.default_rng(0)
    points, others = rng.uniform(size=(900, 3)) ** 3, rng.uniform(-0.5, 1.2, (300, 3))
    for a, b, own in ((points, points, None), (others, points, points)):
        far = np.linalg.norm(a[:, None] - b[None], axis=2)
        if own is None:
            np.fill_diagonal(far, np.inf)
        least = np.sort(far, axis=1)[:, :4]
        for reach in (np.inf, 0.1):
            found, away = nearest(a, own, 4, reach)
            assert np.allclose(away, np.where(least <= reach, least, np.inf))
            near = np.isfinite(away)
            assert np.allclose(np.take_along_axis(far, found, 1)[near], away[near])


@pytest.mark.parametrize("step", [1.0, 0.5 * 3**0.5])
def test_areas_of_lattices(step):
    """Square and hexagonal: 2.5 % inside, where the cell's polygon is taken by 16 rays, and on the whole 5 %."""
    row, col = (v.ravel() for v in np.indices((20, 20)))
    shift = 0.0 if step == 1.0 else 0.5 * (row % 2)
    places = 0.01 * np.stack([col + shift, step * row, np.zeros(400)], axis=1)
    areas = areas_of(places, np.tile((0.0, 0.0, 1.0), (400, 1)))
    inner = (row > 1) & (row < 18) & (col > 1) & (col < 18)
    assert np.allclose(areas[inner], 1e-4 * step, rtol=0.025) and areas.mean() == pytest.approx(1e-4 * step, rel=0.06)


def test_many_taxels_load_in_seconds(model, tmp_path):
    normals = cap(100_000, share=1.0)
    path = write(tmp_path / "many.csv", np.c_[RADIUS * normals, normals], header="x,y,z,nx,ny,nz", form="{:.7f}")
    began = time.process_time()
    robot = dressed(model, taxels={"palm": path})
    assert time.process_time() - began < 10.0
    assert robot.taxels == 100_000 and robot.skins[0].areas.sum() == pytest.approx(4 * np.pi * RADIUS**2, rel=0.02)


def test_rows_of_zeros_have_no_taxel():
    columns = dict(zip("xyz", ([0.0, 1.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.2, 0.1])))
    assert list(spts.taxels.Table("a", columns).rows) == [1, 2]
    normals = {"nx": [0.0, 0.0, 0.0], "ny": [0.0, 0.0, 0.0], "nz": [0.0, 1.0, 1.0]}
    assert list(spts.taxels.Table("a", columns | normals).rows) == [1, 2]
