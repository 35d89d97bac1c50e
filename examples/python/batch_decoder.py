"""A classifier for `spts score --external 'python3 examples/python/batch_decoder.py {learn} {windows} {answers}'`.

Takes the object whose mean image explains the measurements best. Needs numpy.
"""

import sys

import numpy as np

learn, windows, answers = (sys.argv[1], sys.argv[2], sys.argv[3])
training, asked = np.load(learn), np.load(windows)
classes = np.unique(training["labels"])
means = np.stack([training["images"][training["labels"] == c].mean(axis=0) for c in classes])
seen = asked["phi"].astype(float) @ means.T  # windows × M × classes
score = np.einsum("wm,wmc->wc", asked["y"], seen) / np.linalg.norm(seen, axis=1)
best = score.argmax(axis=1)
np.savez(answers, labels=classes[best].astype(np.int64), images=means[best])
