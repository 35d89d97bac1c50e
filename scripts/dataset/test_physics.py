"""The columns mean what they say, checked with nothing of ours: y = Φx, force balance, volts and codes."""

import numpy as np
import pytest
import readers

# of the published skin; `as_built` and `ideal` drive it with so many volts through so many ohms of feedback
PITCH_M, TAXELS, MEASUREMENTS = 0.015, 100, 20
VOLTS_PER_SIEMENS = 4.3 * 1000.0
# Values are rounded to float32 once, relative error at most 2^-24. A sum of 100 of them times ±1 is off by at most that
# times the sum of their magnitudes; a factor of 4 for what is rounded on the other side as well.
ROUNDING = 4 * 2.0**-24
# a taxel counts as pressed above this share of the largest conductance
SUPPORT = 0.23
# the published converter: y = 32 V − code · 3.3 V / 1023 · 11140 / 570
OFFSET_V, STEP_V, LARGEST_CODE = 32.0, 3.3 / 1023 * 11140 / 570, 1023


@pytest.fixture(scope="module")
def columns(request):
    """Values of a named data set's columns in float64."""

    def values(name):
        found = readers.PyArrow(request.getfixturevalue(name).folder).columns()
        return {key: values.astype(np.float64) if values.dtype == np.float32 else values for key, (values, _) in found.items()}

    return values


def phi_times(data, x):
    """Φx of every row's window."""
    phi = data["phi"].reshape(-1, MEASUREMENTS, TAXELS)
    return np.einsum("rmn,rn->rm", phi, x)


def forces(data):
    """Sum of the forces of all objects."""
    return sum(values for name, values in data.items() if name.startswith("force_n"))


def test_weights_are_plus_and_minus_one(columns):
    phi = columns("several")["phi"]
    assert set(np.unique(phi)) == {-1.0, 1.0}
    # as often the one as the other: a million fair coins are off by more than 5 / sqrt(n) once in 2 million times
    assert abs(phi.mean()) < 5 / np.sqrt(phi.size)


def test_without_effects_y_is_phi_times_the_image_and_the_image_is_conductance(columns):
    data = columns("ideal")
    exact = phi_times(data, data["image_v"])
    bound = ROUNDING * (np.abs(data["image_v"]).sum(axis=1, keepdims=True) + np.abs(data["y_v"]))
    assert np.all(np.abs(data["y_v"] - exact) <= bound)
    image = VOLTS_PER_SIEMENS * data["conductance_s"]
    assert np.all(np.abs(data["image_v"] - image) <= ROUNDING * image)


@pytest.mark.parametrize("first", [1, -1], ids=["next window", "window before"])
def test_without_effects_another_windows_phi_does_not_fit(columns, first):
    data = columns("ideal")
    data["phi"] = np.roll(data["phi"], first, axis=0)
    assert np.corrcoef(phi_times(data, data["image_v"]).ravel(), data["y_v"].ravel())[0, 1] < 0.5


def test_as_built_y_is_phi_times_conductance_plus_offset_and_noise(columns):
    data = columns("several")
    x = phi_times(data, data["conductance_s"]).ravel()
    y = data["y_v"].ravel()
    (gain, offset), *_ = np.linalg.lstsq(np.stack([x, np.ones_like(x)], axis=1), y, rcond=None)
    # the largest noise of the profile is 0.073 of the image's length and 0.18 V idle, a seventh of it:
    # 1 - (0.073^2 + 0.14^2) / 2
    assert np.corrcoef(x, y)[0, 1] > 0.985
    # the readout's memory is under 4 % a measurement
    assert gain == pytest.approx(VOLTS_PER_SIEMENS, rel=0.04)
    # constant_v of the profile `as_built`
    assert -0.2479 < offset < -0.1


def test_as_built_the_raster_image_is_as_exact_as_its_noise_allows(columns):
    data = columns("several")
    x, image = VOLTS_PER_SIEMENS * data["conductance_s"], data["image_v"]
    assert np.corrcoef(x.ravel(), image.ravel())[0, 1] > 0.95
    assert image.min() >= 0.0
    # Φ adds the errors of 100 taxels of the raster scan; most of what is left of y is those
    left = data["y_v"] - phi_times(data, image)
    error = image - x
    assert left.std() == pytest.approx(np.sqrt(TAXELS) * error.std(), rel=0.5)


@pytest.mark.parametrize("name", ["shapes", "several", "ideal"])
def test_pressure_adds_up_to_the_forces(columns, name):
    data = columns(name)
    force = forces(data)
    whole = data["pressure_pa"].sum(axis=1) * PITCH_M**2
    assert force.min() > 1.0
    inside = ~data["over_edge"]
    assert inside.sum() > 100
    assert np.all(np.abs(whole - force)[inside] <= ROUNDING * force[inside])
    # an object that hangs over the edge presses with all its force on the part of the sheet that is under it
    assert np.all(np.abs(whole - force) <= ROUNDING * force)


@pytest.mark.parametrize("name", ["shapes", "several"])
def test_support_is_what_is_pressed(columns, name):
    data = columns(name)
    conductance = data["conductance_s"]
    level = SUPPORT * conductance.max(axis=1, keepdims=True)
    # a value so near the level that rounding to float32 decides may be either
    clear = np.abs(conductance - level) > ROUNDING * level
    assert np.array_equal(data["support"][clear], (conductance > level)[clear])
    assert np.all(conductance[data["pressure_pa"] == 0.0] == 0.0)


def test_codes_and_volts_are_the_same_samples(columns):
    volts, codes = columns("several"), columns("codes")
    assert "y_v" not in codes and "y_code" not in volts
    assert codes["y_code"].min() >= 0 and codes["y_code"].max() <= LARGEST_CODE
    exact = OFFSET_V - codes["y_code"] * STEP_V
    assert np.all(np.abs(volts["y_v"] - exact) <= ROUNDING * OFFSET_V)
    for name in volts.keys() & codes.keys():
        assert np.array_equal(volts[name], codes[name]), name


def test_pressures_lie_where_the_object_is(columns):
    data = columns("shapes")
    column, row = np.meshgrid(np.arange(10), np.arange(10))
    x_m = PITCH_M * (column.ravel() - 4.5)
    y_m = PITCH_M * (4.5 - row.ravel())
    weight = data["pressure_pa"] / data["pressure_pa"].sum(axis=1, keepdims=True)
    inside = ~data["over_edge"]
    # shapes are at most 90 mm long, and their origin is the middle of their extent: no centre of pressure is farther
    # away than half of that
    for place, axis in ((x_m, "x_m"), (y_m, "y_m")):
        away = weight @ place - data[axis]
        assert np.abs(away[inside]).max() < 0.045, axis
        assert np.corrcoef((weight @ place)[inside], data[axis][inside])[0, 1] > 0.9, axis
