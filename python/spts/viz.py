"""Pictures of touches and of the wire. Needs `matplotlib`; `log` needs `rerun-sdk`.

A live press, in a window::

    import spts, spts.viz

    skin, ball = spts.Skin(10, 10, 0.015), spts.Body.sphere(0.03)
    wire, view = spts.Wire(skin), spts.viz.Live(skin.shape)
    for k in range(200):
        depth = 3e-3 * (k / 200)
        touch = skin.touch({ball: ((0.02, 0.0, 0.03 - depth), (1, 0, 0, 0))}, dt=0.01)
        y, phi = wire.record(touch, 20)
        view.show(touch, y, spts.decode(phi, y, skin))
"""

from __future__ import annotations

import numpy as np

_COLOURS = "magma"


def image(values, ax=None, title=None, unit="kPa"):
    """Draws a tactile image, one square a taxel.

    Parameters
    ----------
    values : ndarray (rows, cols)
        For "kPa" in pascals, else as they are.
    ax : matplotlib.axes.Axes, optional
        Default: a new figure's.
    title, unit : str, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    import matplotlib.pyplot as plt

    values = _grid(values)
    ax = plt.subplots(figsize=(4.2, 3.6), layout="constrained")[1] if ax is None else ax
    shown = ax.imshow(values / 1e3 if unit == "kPa" else values, cmap=_COLOURS, vmin=min(0.0, float(values.min())))
    ax.figure.colorbar(shown, ax=ax, label=unit, shrink=0.8)
    ax.xaxis.get_major_locator().set_params(integer=True)
    ax.yaxis.get_major_locator().set_params(integer=True)
    ax.set_xlabel("column")
    ax.set_ylabel("row")
    ax.set_title(title or "")
    return ax


def trace(y, ax=None, rate=None, title=None):
    """Draws what the one wire says: a dot a measurement.

    Parameters
    ----------
    y : ndarray (M,)
        Measurements, V.
    ax : matplotlib.axes.Axes, optional
    rate : float, optional
        Measurements a second, Hz: `wire.sample_rate`; the axis is a time then.
    title : str, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    import matplotlib.pyplot as plt

    y = np.asarray(y, np.float64)
    ax = plt.subplots(figsize=(5, 2.6), layout="constrained")[1] if ax is None else ax
    at = np.arange(len(y)) * (1.0 if rate is None else 1e3 / rate)
    ax.plot(at, y, marker="o", markersize=3, linewidth=0.8, color="#b5367a")
    ax.set_xlabel("measurement" if rate is None else "time / ms")
    ax.set_ylabel("wire / V")
    ax.set_title(title or "")
    return ax


class Live:
    """A window with the pressure, the wire's measurements and the decoded image, drawn anew with every `show`."""

    def __init__(self, shape):
        import matplotlib.pyplot as plt

        self._plt = plt
        self.figure, axes = plt.subplots(1, 3, figsize=(11, 3.4), layout="constrained")
        blank = np.zeros(shape)
        self._images = [axes[k].imshow(blank, cmap=_COLOURS, vmin=0, vmax=1) for k in (0, 2)]
        self._line = axes[1].plot([], [], marker="o", markersize=3, linewidth=0.8, color="#b5367a")[0]
        self._bars = [self.figure.colorbar(self._images[0], ax=axes[0], label="kPa", shrink=0.8)]
        for ax, title in zip(axes, ("pressure", "one wire / V", "decoded")):
            ax.set_title(title)
        for ax in (axes[0], axes[2]):
            ax.set_xlabel("column")
            ax.set_ylabel("row")
        axes[1].set_xlabel("measurement")
        self._axes = axes

    def show(self, touch, y=None, decoded=None, pause=1e-3):
        """Draws a touch, and measurements and a decoded image where they are given.

        Parameters
        ----------
        touch : spts.Touch
        y : ndarray (M,), optional
        decoded : ndarray (rows, cols), optional
        pause : float
            Time that the window gets, s.
        """
        for shown, values in zip(self._images, (touch.pressure / 1e3, decoded)):
            if values is not None:
                shown.set_data(values)
                shown.set_clim(0.0, max(float(np.max(values)), 1e-9))
        if y is not None:
            self._line.set_data(np.arange(len(y)), y)
            self._axes[1].relim()
            self._axes[1].autoscale_view()
        self.figure.canvas.draw_idle()
        self._plt.pause(pause)


def animate(pressures, path, decoded=None, fps=25):
    """Writes a press as an animation.

    Parameters
    ----------
    pressures : ndarray (n, rows, cols)
        Pa, one image a frame.
    path : str
        A file that ends in .gif, or in what matplotlib's writers on this machine make.
    decoded : ndarray (n, rows, cols), optional
        Shown beside it.
    fps : float
        Frames a second.
    """
    import matplotlib.animation
    import matplotlib.pyplot as plt

    pressures = np.asarray(pressures, np.float64)
    if pressures.ndim != 3 or not len(pressures):
        raise ValueError(f"`pressures` has shape {pressures.shape}; (n, rows, cols) with n > 0 is needed")
    films = [("pressure / kPa", pressures / 1e3)]
    if decoded is not None:
        decoded = np.asarray(decoded, np.float64)
        if decoded.shape != pressures.shape:
            raise ValueError(f"`decoded` has shape {decoded.shape}; {pressures.shape} is needed, as `pressures` has it")
        films.append(("decoded", decoded))
    figure, axes = plt.subplots(1, len(films), figsize=(3.6 * len(films), 3.2), layout="constrained", squeeze=False)
    shown = []
    for ax, (title, values) in zip(axes[0], films):
        top = max(float(values.max()), 1e-12)
        shown.append(ax.imshow(values[0], cmap=_COLOURS, vmin=0.0, vmax=top))
        ax.set_title(title)
        ax.set_xticks([])
        ax.set_yticks([])

    def frame(k):
        for drawn, (_, values) in zip(shown, films):
            drawn.set_data(values[k])
        return shown

    film = matplotlib.animation.FuncAnimation(figure, frame, frames=len(pressures), blit=True)
    film.save(path, writer="pillow" if str(path).endswith(".gif") else None, fps=fps)
    plt.close(figure)


def rgb(values, size=240):
    """A tactile image as colours, uint8 (size, size * cols / rows, 3), without a figure.

    Parameters
    ----------
    values : ndarray (rows, cols)
    size : int
        Height in pixels, about.
    """
    import matplotlib

    values = _grid(values)
    scaled = values / max(float(values.max()), 1e-12)
    colours = matplotlib.colormaps[_COLOURS](np.clip(scaled, 0.0, 1.0))[..., :3]
    each = max(1, size // values.shape[0])
    return np.kron((255 * colours).astype(np.uint8), np.ones((each, each, 1), np.uint8))


def log(touch, y=None, decoded=None, name="skin"):
    """Sends a touch to Rerun's viewer, after `rerun.init`; what is given of measurements and image too. Needs `rerun-sdk`."""
    import rerun

    rerun.set_time("touch", duration=touch.time)
    rerun.log(f"{name}/pressure", rerun.Tensor(touch.pressure))
    if y is not None:
        rerun.log(f"{name}/wire", rerun.BarChart(np.asarray(y)))
    if decoded is not None:
        rerun.log(f"{name}/decoded", rerun.Tensor(np.asarray(decoded)))


def _grid(values):
    values = np.asarray(values, np.float64)
    if values.ndim != 2 or not values.size:
        raise ValueError(f"`values` has shape {values.shape}; (rows, cols) is needed")
    return values
