"""Decoders as estimators."""

import numpy as np
import pytest
import spts
import spts.decoders
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer
from sklearn.utils.estimator_checks import check_estimator
from spts.decode import learned_of

SHAPES = {
    "ball": spts.Body.sphere(0.05),
    "box": spts.Body.box((0.07, 0.02, 0.05)),
    "rod": spts.Body.cylinder(0.01, 0.05),
}


@pytest.fixture(scope="module")
def presses():
    """Φ, measurements, true images and names of shapes pressed within a few millimetres of the middle."""
    rng = np.random.default_rng(0)
    skin = spts.Skin(10, 10, 0.015)
    phi, y, images, names = [], [], [], []
    for k in range(60):
        name = list(SHAPES)[k % 3]
        body = SHAPES[name]
        wire = spts.Wire(skin, seed=3)
        low = -body.mesh[0][:, 2].min()
        pose = (np.append(rng.normal(0, 0.003, 2), low - 2e-3), (1, 0, 0, 0))
        touch = skin.touch({body: pose}, dt=0.1)
        window = wire.record(touch, 30)
        y.append(window[0]), phi.append(window[1])
        images.append(wire.record(touch, raster=True)[0]), names.append(name)
        skin.touch({}, dt=10.0)
    return np.array(phi), np.array(y), np.array(images), np.array(names)


def test_every_decoder_decodes(presses):
    phi, y, images, names = presses
    labels = np.unique(names, return_inverse=True)[1]
    X = spts.windows(phi, y)
    for name in spts.decoders.names():
        estimator = spts.decoders.ImageDecoder(name).fit(X[:40], images[:40], labels[:40])
        found = estimator.predict(X[40:])
        assert found.shape == (20, 100) and np.isfinite(found).all(), name
        one = spts._spts.Decoder(name, (10, 10), images[:40], labels[:40]).decode(phi[40], y[40])
        assert np.array_equal(one.ravel(), found[0]), name
    assert spts.decoders.NnLmmse().fit(X[:40], images[:40]).score(X[40:], images[40:]) > 0.5


def test_scikit_learn_takes_them(presses):
    phi, y, images, _ = presses
    X = spts.windows(phi, y)
    estimator = clone(spts.decoders.NnLmmse(shape=(10, 10)))
    assert estimator.get_params() == {"shape": (10, 10)}
    scores = cross_val_score(estimator, X, images, cv=3)
    assert scores.shape == (3,) and scores.min() > 0.3
    search = GridSearchCV(spts.decoders.ImageDecoder(), {"decoder": ["omp", "nn_lmmse"]}, cv=2).fit(X, images)
    assert search.best_params_["decoder"] in ("omp", "nn_lmmse")
    piped = make_pipeline(FunctionTransformer(np.ascontiguousarray), spts.decoders.Tv()).fit(X, images)
    assert piped.predict(X[:2]).shape == (2, 100)


def test_without_images_it_knows_the_layout(presses):
    phi, y, images, _ = presses
    X = spts.windows(phi, y)
    found = spts.decoders.NnLmmse().fit().predict(X)
    assert spts.iou(found, images).mean() > 0.4
    assert np.array_equal(found[0].reshape(10, 10), spts.decode(phi[0], y[0], (10, 10), "nn_lmmse"))


def test_classes(presses):
    phi, y, images, names = presses
    X = spts.windows(phi, y)
    evidence = spts.decoders.Evidence().fit(X[:45], names[:45], images=images[:45])
    assert evidence.score(X[45:], names[45:]) > 0.5
    sparse = spts.decoders.SparseClassifier().fit(images[:45], names[:45])
    assert sparse.score(images[45:], names[45:]) > 0.5


def test_the_classifier_is_an_estimator():
    why = "clouds of points around zero, standardised: the direction of an image, which is all that it looks at, says little there"
    check_estimator(spts.decoders.SparseClassifier(), expected_failed_checks={"check_classifiers_train": why})


def test_an_untouched_skin_can_be_decoded():
    """Noise alone: whatever it is, the image of it is found, and it is small."""
    skin = spts.Skin(10, 10, 0.015)
    nothing = skin.touch({}, dt=0.1)
    for seed in range(100):
        wire = spts.Wire(skin, seed=7919 * seed)
        for _ in range(10):
            y, phi = wire.record(nothing, 20)
            image = spts.decode(phi, y, (10, 10))
            assert np.isfinite(image).all() and image.max() < 0.5


def ball_of_points(taxels, radius):
    """A half ball with taxels in any order: one row, in which neighbours on the skin have any numbers."""
    k = np.random.default_rng(0).permutation(taxels)
    z, turn = 1.0 - (k + 0.5) / taxels, k * np.pi * (3.0 - 5.0**0.5)
    side = np.sqrt(1.0 - z**2)
    normals = np.stack([side * np.cos(turn), side * np.sin(turn), z], axis=1)
    return spts.Skin.from_points(radius * normals, normals, np.full(taxels, 2 * np.pi * radius**2 / taxels))


@pytest.mark.parametrize("decoder", ["auto", "tv", "patches", "mixture"])
def test_taxels_count_by_their_places(decoder):
    """On a skin from points in any order a touch of several taxels is seen better where the skin is told than where
    only the number of taxels is."""
    skin, ball = ball_of_points(150, 0.03), spts.Body.sphere(0.2)
    found = {"skin": [], "shape": []}
    for seed in range(20):
        skin.reset()
        taxel = 7 * seed
        place = skin.positions[taxel] + (0.2 - 0.0025) * skin.normals[taxel]
        touch = skin.touch({ball: (place, (1.0, 0.0, 0.0, 0.0))}, dt=0.1)
        y, phi = spts.Wire(skin, seed=seed).record(touch, 30)
        for name, told in (("skin", skin), ("shape", skin.shape)):
            found[name].append(spts.iou(spts.decode(phi, y, told, decoder)[None], touch.pressure[None])[0])
    means = {name: np.mean(scores) for name, scores in found.items()}
    assert means["skin"] > means["shape"] + 0.2, means
    assert means["skin"] > 0.8 or decoder != "auto", means


def test_links_share_a_wire():
    """Taxels of two skins on one wire, numbered at random: the touch of one is seen, the other stays untouched."""
    numbers = np.random.default_rng(1).permutation(150)
    skin, ball = ball_of_points(75, 0.02), spts.Body.sphere(0.2)
    decoder = learned_of("auto", [(of, skin.positions, skin.normals) for of in (numbers[:75], numbers[75:])])
    scores, elsewhere = [], []
    for seed in range(10):
        skin.reset()
        place = skin.positions[7 * seed] + (0.2 - 0.0025) * skin.normals[7 * seed]
        truth = np.zeros(150)
        touch = skin.touch({ball: (place, (1.0, 0.0, 0.0, 0.0))}, dt=0.1)
        truth[numbers[75:]] = touch.pressure
        phi = np.random.default_rng(seed).choice([-1.0, 1.0], (30, 150))
        image = decoder.decode(phi, phi @ truth).ravel()
        scores.append(spts.iou(image[None], truth[None])[0])
        elsewhere.append(image[numbers[:75]].max() / image.max())
    assert np.mean(scores) > 0.8 and np.mean(elsewhere) < 0.1, (scores, elsewhere)


def test_a_line_of_taxels_is_in_order():
    """The places of taxels in a row say what their numbers say."""
    skin = spts.Skin(1, 40, 0.01)
    touch = skin.touch({spts.Body.sphere(0.03): ((0.05, 0.0, 0.029), (1.0, 0.0, 0.0, 0.0))}, dt=0.1)
    y, phi = spts.Wire(skin, seed=1).record(touch, 12)
    for name in ("auto", "tv", "patches"):
        assert np.array_equal(spts.decode(phi, y, skin, name), spts.decode(phi, y, (1, 40), name))


def test_the_default_is_the_best_or_nearly():
    """What `scripts/python_decoders.py` prints at length."""
    skin, found = spts.Skin(10, 10, 0.015), {name: [] for name in ("mixture", "nn_lmmse", "nn_lasso", "amortised")}
    bodies = [spts.Body.sphere(0.005), spts.Body.box((0.06, 0.04, 0.02)), spts.Body.sphere(0.03)]
    for seed in range(36):
        rng, body = np.random.default_rng(seed), bodies[seed % 3]
        skin.reset()
        turn = rng.uniform(0.0, np.pi)
        place = (*skin.positions[rng.integers(100)][:2], -body.mesh[0][:, 2].min() - 0.0015)
        touch = skin.touch({body: (place, (np.cos(turn), 0.0, 0.0, np.sin(turn)))}, dt=0.1)
        y, phi = spts.Wire(skin, seed=seed).record(touch, 20)
        for name, scores in found.items():
            scores.append(spts.iou(spts.decode(phi, y, skin, name)[None], touch.pressure[None])[0])
    assert np.array_equal(spts.decode(phi, y, skin), spts.decode(phi, y, skin, "amortised"))
    means = {name: np.mean(scores) for name, scores in found.items()}
    assert means["amortised"] > max(means.values()) - 0.02, means


def test_a_prior():
    images = spts.prior((4, 6), count=500, seed=1)
    assert images.shape == (500, 24) and (images >= 0.0).all() and (images.max(axis=1) > 0.3).all()
    assert np.array_equal(images, spts.prior((4, 6), count=500, seed=1))
    # every taxel is touched now and then, and a touch is of some taxels
    assert (images > 0.1).mean(axis=0).min() > 0.02 and 1.0 < (images > 0.1).sum(axis=1).mean() < 12.0
    assert spts.prior((1, 1), 3).shape == (3, 1)
    for count in (0, 10**7):
        with pytest.raises(ValueError, match="count"):
            spts.prior((4, 6), count)
