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
    assert np.array_equal(found[0].reshape(10, 10), spts.decode(phi[0], y[0], (10, 10)))


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
