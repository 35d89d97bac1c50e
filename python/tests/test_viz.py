"""Pictures: that they are drawn, and of what."""

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import spts
import spts.viz


def test_pictures(skin, pressed, tmp_path):
    y, phi = spts.Wire(skin).record(pressed, 20)
    drawn = spts.viz.image(pressed.pressure, title="a press")
    assert np.allclose(drawn.images[0].get_array(), pressed.pressure / 1e3)
    assert np.array_equal(spts.viz.trace(y, rate=64e3).lines[0].get_ydata(), y)
    view = spts.viz.Live(skin.shape)
    view.show(pressed, y, spts.decode(phi, y, skin.shape))
    view.figure.savefig(tmp_path / "live.png")
    assert (tmp_path / "live.png").stat().st_size > 10_000
    plt.close("all")


def test_an_animation(pressed, tmp_path):
    films = np.array([k * pressed.pressure for k in range(5)])
    spts.viz.animate(films, tmp_path / "press.gif", decoded=films)
    assert (tmp_path / "press.gif").read_bytes()[:6] == b"GIF89a"
    with pytest.raises(ValueError, match="pressures"):
        spts.viz.animate(films[0], tmp_path / "press.gif")


def test_colours(pressed):
    shown = spts.viz.rgb(pressed.pressure)
    assert shown.shape == (240, 240, 3) and shown.dtype == np.uint8
    brightest = np.unravel_index(shown.sum(axis=2).argmax(), (240, 240))
    assert tuple(k // 24 for k in brightest) == np.unravel_index(pressed.pressure.argmax(), (10, 10))
