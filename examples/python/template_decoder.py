"""A classifier for `spts score --external 'python3 examples/python/template_decoder.py'`, which learns from raster images.

Takes the object whose mean image explains the measurements best. Needs numpy.
"""

import json
import sys

import numpy as np

header = json.loads(sys.stdin.readline())
images, labels = (np.array(header["learn"][name]) for name in ("images", "labels"))
classes = np.unique(labels)
means = np.stack([images[labels == c].mean(axis=0) for c in classes])
for line in sys.stdin:
    window = json.loads(line)
    phi = np.array([[1.0 if sign == "+" else -1.0 for sign in row] for row in window["phi"]])
    seen = phi @ means.T  # M × classes
    best = np.argmax(window["y"] @ seen / np.linalg.norm(seen, axis=0))
    print(json.dumps({"label": int(classes[best]), "image": means[best].tolist()}), flush=True)
