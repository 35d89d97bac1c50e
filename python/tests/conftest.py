"""What the tests share."""

import signal

import numpy as np
import pytest
import spts

# programs that tests end with Ctrl-C inherit what a shell in the background does, which is to ignore it
signal.signal(signal.SIGINT, signal.default_int_handler)
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


@pytest.fixture
def skin():
    return spts.Skin(rows=10, cols=10, pitch=0.015)


@pytest.fixture
def ball():
    return spts.Body.sphere(radius=0.03)


@pytest.fixture
def pressed(skin, ball):
    """A ball that presses 2 mm deep."""
    return skin.touch({ball: ((0.004, -0.003, 0.028), UPRIGHT)}, dt=0.1)


def turned(axis, angle):
    """Quaternion (w, x, y, z) of a rotation."""
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    return np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * axis])
