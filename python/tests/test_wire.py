"""The one wire: what it measures, what it remembers, and that it is what Rust says."""

import pathlib

import numpy as np
import spts
from conftest import UPRIGHT


def test_the_bytes_are_those_of_rust():
    """A test of the library itself (`twin/src/wire.rs`) holds the same file against what it says."""
    lines = (pathlib.Path(__file__).parents[2] / "twin/assets/wire_bytes.txt").read_text().split()
    skin, block = spts.Skin(10, 10, 0.015, electrode=0.01), spts.Body.box((0.04, 0.05, 0.03))
    wire = spts.Wire(skin, seed=7)
    for k in range(3):
        pose = ((0.01, -0.02, 0.014 - 1e-3 * k), UPRIGHT)
        touch = skin.touch({block: pose}, {block: (0, 0, -0.01, 0, 0, 0)}, 0.1)
        wire.feel(touch)
    own = [wire.record(touch, 40, raw=True)[0], wire.record(touch, raster=True, raw=True)[0]]
    assert [v.tobytes().hex() for v in own] == lines


def test_an_ideal_wire_is_phi_times_the_image(skin, pressed):
    wire = spts.Wire(skin, readout="ideal")
    y, phi = wire.record(pressed, 200)
    ratios = (phi @ wire.conductance.ravel()) / y
    # one gain, V/S; the idle output, of the untouched skin, is nearly nothing
    assert np.ptp(ratios) < 1e-6 * abs(ratios.mean())
    scan, once = wire.record(pressed, raster=True)
    assert np.array_equal(once, np.eye(100))
    assert np.allclose(scan / scan.max(), wire.conductance.ravel() / wire.conductance.max(), atol=1e-9)


def test_the_same_seed_gives_the_same_bytes(skin, pressed):
    y = [spts.Wire(skin, seeds="mixed", seed=s).record(pressed, 50)[0] for s in (1, 1, 2)]
    assert np.array_equal(y[0], y[1]) and not np.array_equal(y[0], y[2])


def test_the_cut_into_calls_does_not_show(skin, pressed):
    whole, parts = spts.Wire(skin), spts.Wire(skin)
    y, phi = whole.record(pressed, 60)
    pieces = [parts.record(pressed, n) for n in (1, 19, 40)]
    assert np.array_equal(y, np.concatenate([p[0] for p in pieces]))
    assert np.array_equal(phi, np.concatenate([p[1] for p in pieces]))


def test_it_remembers(skin, ball):
    """Velostat creeps while it is held, and what has been pressed reads differently from what has not."""
    wire = spts.Wire(skin, readout="ideal")
    pose = {ball: ((0, 0, 0.028), UPRIGHT)}
    now = wire.record(skin.touch(pose, dt=0.01), raster=True)[0].max()
    later = wire.record(skin.touch(pose, dt=10.0), raster=True)[0].max()
    assert later > 1.01 * now


def test_two_wires_share_a_skin(skin, pressed):
    """The wires of the upper and the lower half see what one wire sees."""
    halves = [spts.Wire(skin, readout="ideal", taxels=range(a, a + 50)) for a in (0, 50)]
    scans = [w.record(pressed, raster=True)[0] for w in halves]
    assert halves[0].shape == (1, 50) and halves[0].record(pressed, 7)[1].shape == (7, 50)
    found = np.concatenate(scans).reshape(10, 10)
    assert np.argmax(found) in np.flatnonzero(pressed.pressure > 0.5 * pressed.pressure.max())


def test_raw_is_with_the_idle_output(skin, pressed):
    a, b = spts.Wire(skin), spts.Wire(skin)
    assert np.allclose(a.record(pressed, 30, raw=True)[0] - a.idle, b.record(pressed, 30)[0], atol=1e-15)


def test_faults_and_parameters(skin, pressed):
    dead = spts.Wire(skin, readout="ideal", faults=[{"name": "dead", "taxel": int(np.argmax(pressed.pressure))}])
    sound = spts.Wire(skin, readout="ideal", parameters={"spread_log_sd": 0.0})
    assert dead.record(pressed, raster=True)[0].max() < sound.record(pressed, raster=True)[0].max()
    seeds = spts.Wire(skin, seeds=list(range(1, 101)), levels="analog").record(pressed, 5)[1]
    assert len(np.unique(seeds)) > 50
