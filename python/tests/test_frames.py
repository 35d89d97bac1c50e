"""Frames of any skin: arrays in, sessions and samples out."""

import numpy as np
import pytest
import spts

RNG = np.random.default_rng(5)


def movie(presses=2, rows=6, cols=8):
    """Presses of a block on rows x cols taxels, Pa."""
    frames = np.zeros((presses, 20, rows, cols))
    for k, press in enumerate(frames):
        press[6:16, 1 + k : 4 + k, 2:5] = 2e4
    return frames


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_frames_come_back_and_go_through_a_wire(tmp_path):
    frames = movie()
    frames[0, 2, 0, 0] = np.nan
    session = spts.Session.from_frames(frames, 100, "pressure", pitch=0.01, name="block")
    assert np.array_equal(session.frames, frames, equal_nan=True)
    assert session.hold == pytest.approx((0.06, 0.16)) and session.compressive is None and not session.simulated
    wired = session.wire("as_built", seed=3)
    assert wired.simulated and len(wired.compressive) == len(wired.raster) == 2
    assert np.array_equal(wired.compressive.pressure[1], frames[1, 10])
    wired.write(tmp_path / "block")
    board = spts.score("tv", tmp_path / "block", measurements=[24])
    assert board.of("tv", 24)["iou"] > 0.7
    again = spts.load(tmp_path / "block")
    assert np.array_equal(again.compressive.volts, session.wire("as_built", seed=3).compressive.volts)


def test_what_is_assumed_is_said():
    with pytest.warns(UserWarning) as said:
        spts.Session.from_frames(movie(), 100).wire()
    said = "\n".join(str(warning.message) for warning in said)
    for words in ("idle: the first 6 frames", "hold: 0.060 to 0.160 s", "not in pascals or siemens", "peak"):
        assert words in said
    assert "--" not in said


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_what_cannot_be_is_refused():
    frames = movie()
    for change, said in (
        ({"rate": 0.0}, "rate"),
        ({"unit": "kPa"}, '`unit` = "kPa"'),
        ({"rows": 5}, "both or none"),
        ({"rows": 5, "cols": 5}, "shape"),
        ({"idle": 21}, "idle"),
        ({"hold": (0.1, 0.3)}, "hold"),
        ({"pitch": -1.0}, "pitch"),
    ):
        with pytest.raises(ValueError, match=said):
            spts.Session.from_frames(**{"frames": frames, "rate": 100.0, **change})
    with pytest.raises(ValueError, match="not finite"):
        spts.Session.from_frames(np.full((3, 4, 4), np.inf), 100)
    with pytest.raises(ValueError, match="nothing touches"):
        spts.Session.from_frames(np.zeros((3, 4, 4)), 100).wire()


def test_a_wire_measures_an_array():
    skin, pressure = spts.Skin(6, 8, 0.01), movie()[0, 10]
    touch = spts.Touch.from_array(skin, pressure, dt=0.1)
    assert np.array_equal(touch.pressure, pressure) and touch.number == 1 and touch.time == pytest.approx(0.1)
    assert touch.area == pytest.approx(9 * 1e-4) and touch.wrenches == {}
    by_touch = spts.Wire(skin, seed=2).record(touch, 30)
    by_array = spts.Wire(skin, seed=2).record(pressure, 30, dt=0.1)
    assert all(np.array_equal(a, b) for a, b in zip(by_touch, by_array, strict=True))
    wire = spts.Wire(skin, readout="ideal")
    for _ in range(3):
        y, phi = wire.record(pressure.tolist(), 20)
    assert spts.iou([spts.decode(phi, y, skin, "tv")], [pressure])[0] > 0.3
    for wrong, said in (
        ((np.zeros((5, 8)), 20), "shape"),
        ((np.full((6, 8), -1.0), 20), "outside"),
        ((np.full((6, 8), np.nan), 20), "NaN"),
        (("cup", 20), "`touch` is a str; valid: a touch or an array"),
    ):
        with pytest.raises(ValueError, match=said):
            wire.record(*wrong)
    with pytest.raises(ValueError, match="`dt` is for arrays"):
        spts.Wire(skin).record(touch, 20, dt=0.1)
    with pytest.raises(ValueError, match="`dt` = -1"):
        wire.feel(pressure, dt=-1)
    left = spts.Skin(6, 8, 0.01)
    both = spts.Wire([skin, left])
    assert both.record([spts.Touch.from_array(skin, pressure), None], 10)[0].shape == (10,)
    with pytest.raises(ValueError, match="from_array"):
        spts.Wire(skin, taxels=range(10)).record(pressure, 5)


def test_auto():
    assert (spts.auto((10, 10)), spts.auto((50, 50)), spts.auto((1, 600))) == ("amortised", "patches", "amortised")
    assert spts.auto(spts.Skin(16, 16, 0.005)) == "amortised"
    phi = RNG.choice([-1.0, 1.0], (60, 144))
    image = np.zeros((12, 12))
    image[3:6, 4:9] = 1.0
    named = spts.decode(phi, phi @ image.ravel(), (12, 12), decoder=spts.auto((12, 12)))
    assert np.array_equal(spts.decode(phi, phi @ image.ravel(), (12, 12)), named)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_frames_make_a_data_set(tmp_path):
    sessions = [
        spts.Session.from_frames(movie(3) * (k + 1), 100, "pressure", pitch=0.01, name=name, idle=5)
        for k, name in enumerate(["one", "two"])
    ]
    data = spts.dataset.make(frames=sessions, folder=tmp_path / "set", set={"record.measurements": 12})
    assert len(data) == 6 and data.shape == (6, 8) and list(data["object"][:2]) == ["one", "two"]
    pressure = data["pressure_pa"].reshape(6, 6, 8)
    assert np.allclose(pressure[1], movie(3)[0, 10] * 2) and np.allclose(pressure[2], movie(3)[1, 10])
    assert (tmp_path / "set_frames" / "two" / "session.json").exists()
    again = spts.dataset.make(frames=tmp_path / "set_frames", folder=tmp_path / "more", rows=18)
    assert len(again) == 18 and np.array_equal(again["pressure_pa"][:6], data["pressure_pa"])
    with pytest.raises(TypeError, match="`spec` or `frames`"):
        spts.dataset.make()
    with pytest.raises(ValueError, match="nowhere"):
        spts.dataset.make(frames=tmp_path / "nowhere", folder=tmp_path / "none")
