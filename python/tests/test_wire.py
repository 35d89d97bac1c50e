"""The one wire: what it measures, what it remembers, and that it is what Rust says."""

import pathlib

import numpy as np
import pytest
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


def test_given_rows_are_repeated(skin, pressed):
    rng = np.random.default_rng(0)
    rows = np.where(rng.random((7, 100)) < 0.5, -1, 1)
    for given in (rows, rows.tolist(), rows.astype(np.int8), np.asfortranarray(rows, np.float32)):
        wire = spts.Wire(skin, readout="ideal", rows=given)
        (y, phi), (again, same) = wire.record(pressed, 7), wire.record(pressed, 7)
        assert np.array_equal(phi, rows) and np.array_equal(same, rows)
        assert np.allclose(y, again) and y.std() > 0.0
    # they begin where the wire stands, and go around
    wire.record(pressed, 3)
    assert np.array_equal(wire.record(pressed, 10)[1], rows[(np.arange(10) + 3) % 7])
    # eight bits: the levels of an analog wire are taken as it gives them
    analog = spts.Wire(skin, levels="analog").record(pressed, 5)[1]
    assert np.array_equal(spts.Wire(skin, rows=analog, levels="analog").record(pressed, 5)[1], analog)
    # a part of a skin has rows of its own length
    part = spts.Wire(skin, rows=rows[:, :30], taxels=range(30)).record(pressed, 14)[1]
    assert np.array_equal(part, np.tile(rows[:, :30], (2, 1)))
    # a raster scan is one
    assert np.array_equal(wire.record(pressed, raster=True)[1], np.eye(100))


def test_rows_of_a_file(skin, pressed, tmp_path):
    rows = np.where(np.random.default_rng(0).random((5, 100)) < 0.5, -1, 1)
    file = tmp_path / "rows.txt"
    file.write_text("# five\n" + "\n".join("".join("+" if v > 0 else "-" for v in row) for row in rows))
    assert np.array_equal(spts.Wire(skin, rows=str(file)).record(pressed, 5)[1], rows)
    # a profile that has rows brings them, and what is asked for goes before
    ideal = 'weights = "binary"\nsample_rate_hz = 64300\ndrive_v = 4.3\nfeedback_ohm = 1000\n'
    profile = tmp_path / "profile.toml"
    profile.write_text(f'patterns = """\n{file.read_text()}\n"""\n{ideal}')
    assert np.array_equal(spts.Wire(skin, readout=str(profile)).record(pressed, 5)[1], rows)
    assert np.array_equal(spts.Wire(skin, str(profile), rows=-rows[:2]).record(pressed, 2)[1], -rows[:2])
    assert not (spts.Wire(skin, str(profile), seeds="mixed").record(pressed, 5)[1] == rows).all(axis=1).any()
    with pytest.raises(ValueError, match="patterns.*100.*25|25.*patterns.*100"):
        spts.Wire(spts.Skin(5, 5, 0.01), readout=str(profile))


def test_what_no_row_is(skin):
    good = np.ones((3, 100))
    for text, arguments in [
        (
            r"`rows\[1, 5\]` = 0.5 is no level; the nearest is 0.49",
            {"rows": np.where(np.arange(300).reshape(3, 100) == 105, 0.5, 1)},
        ),
        (r"`rows\[0, 0\]` = 0 is no level", {"rows": np.zeros((2, 100))}),
        (r"`rows\[0, 0\]` = NaN", {"rows": good * np.nan}),
        (r"`rows\[0, 0\]` = 2 ", {"rows": 2 * good}),
        ("`rows`: number of taxels of a row = 99; valid: 100", {"rows": good[:, :99]}),
        (r"shape \(0, 100\)", {"rows": good[:0]}),
        ("`rows`: an array", {"rows": 3}),
        ("`rows`: an array", {"rows": good[0]}),
        ("only one of them", {"rows": good, "seeds": "mixed"}),
        ("no-file", {"rows": "no-file.txt"}),
        ("binary", {"rows": good * (201 - 127.5) / 127.5}),
    ]:
        with pytest.raises(ValueError, match=text):
            spts.Wire(skin, **arguments)


def two_skins():
    return spts.Skin(4, 5, 0.01), spts.Skin.cylinder(0.05, 6, 3, span=(0.0, 0.05), arc=(0.0, 1.0))


def on(skin, ball, taxel, depth, dt):
    place = skin.positions[taxel] + (0.03 - depth) * skin.normals[taxel]
    return skin.touch({ball: (place, UPRIGHT)}, dt=dt)


def test_a_wire_over_two_skins(ball):
    a, b = two_skins()
    wire = spts.Wire([a, b], readout="ideal", seed=5)
    assert wire.shape == (1, 38)
    left, right = on(a, ball, 7, 2e-3, 0.1), on(b, ball, 4, 2e-3, 0.3)
    # one skin alone leaves the other as it is: bare, here
    wire.feel([left, None])
    alone = spts.Wire(a, readout="ideal", seed=5, parameters={"session_tilt_log_sd": 0.0})
    alone.feel(left)
    assert np.allclose(wire.conductance[0, :20], alone.conductance.ravel(), rtol=1e-12)
    assert not (wire.conductance[0, 20:] > 1e-12).any()
    y, phi = wire.record((None, right), 50)
    assert phi.shape == (50, 38) and set(np.unique(phi)) == {-1, 1}
    assert np.allclose(wire.conductance[0, :20], alone.conductance.ravel(), rtol=1e-12)
    assert np.argmax(wire.conductance[0, 20:]) == np.argmax(right.pressure)
    ratios = y / (phi @ wire.conductance.ravel())
    assert np.ptp(ratios) < 1e-6 * abs(ratios.mean())
    # the same touches again are nothing new
    before = wire.conductance
    wire.feel([left, right])
    assert np.array_equal(wire.conductance, before)


def test_taxels_count_through_all_skins(ball):
    a, b = two_skins()
    order = [37, 3, 20, 7, 24]
    whole, some = spts.Wire([a, b]), spts.Wire([a, b], taxels=order, seeds=[9, 8, 7, 6, 5])
    touches = [on(a, ball, 7, 2e-3, 0.1), on(b, ball, 4, 2e-3, 0.1)]
    whole.feel(touches), some.feel(touches)
    assert some.shape == (1, 5) and some.record(touches, 3)[1].shape == (3, 5)
    pressed = np.concatenate([t.pressure.ravel() for t in touches])[order] > 0.0
    assert np.array_equal(some.conductance[0] > 1e-9, pressed) and 0 < pressed.sum() < 5


def test_one_skin_in_a_list_is_a_skin(skin, pressed):
    # taxels in a row are no sheet that a mounting tilts
    own, listed = spts.Wire(skin, seed=2, parameters={"session_tilt_log_sd": 0.0}), spts.Wire([skin], seed=2)
    y, phi = own.record(pressed, 40)
    again, same = listed.record([pressed], 40)
    assert listed.shape == (1, 100) and np.array_equal(y, again) and np.array_equal(phi, same)


def test_what_does_not_fit_a_wire_over_skins(ball):
    a, b = two_skins()
    with pytest.raises(ValueError, match="session_tilt_log_sd` = 0.1"):
        spts.Wire([a, b], parameters={"session_tilt_log_sd": 0.1})
    wire, single = spts.Wire([a, b]), spts.Wire(a)
    left, right = on(a, ball, 7, 1e-3, 0.1), on(b, ball, 4, 1e-3, 0.1)
    for error, text, call in [
        (ValueError, "has 1 entries", lambda: wire.feel([left])),
        (ValueError, "has 3 entries", lambda: wire.record([left, right, None], 5)),
        (ValueError, r"`touch\[0\]` is of another skin than skin 0", lambda: wire.feel([right, left])),
        (ValueError, r"`touch\[1\]` is a str", lambda: wire.feel([left, "b"])),
        (ValueError, "over 2 skins", lambda: wire.feel(left)),
        (ValueError, "`touch`: a touch or an array", lambda: single.feel([left])),
        (ValueError, "`touch` is a NoneType; valid: a touch or an array", lambda: single.feel(None)),
        (ValueError, r"`skin\[1\]` is there twice", lambda: spts.Wire([a, a])),
        (ValueError, r"`skin\[1\]` is no skin", lambda: spts.Wire([a, ball])),
        (ValueError, "`skin` is a Body", lambda: spts.Wire(ball)),
        (ValueError, "`skin` is empty", lambda: spts.Wire([])),
        (ValueError, r"`taxels\[0\]` = 38 is outside \[0, 37\]", lambda: spts.Wire([a, b], taxels=[38])),
        (ValueError, "none of skin 1", lambda: spts.Wire([a, b], taxels=[3, 4])),
    ]:
        with pytest.raises(error, match=text):
            call()
    # none of a refused call is felt
    before = wire.conductance
    with pytest.raises(ValueError, match="another skin"):
        wire.feel([left, left])
    assert np.array_equal(wire.conductance, before)
    wire.record([left, right], 5)
