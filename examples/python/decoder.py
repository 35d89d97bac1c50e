"""A decoder for `spts score --external 'python3 examples/python/decoder.py'`: ridge regression.

Shows the protocol: without a prior its images are poor, the more so the fewer measurements there are.

Reads a header line, then one window a line, and answers each with an image. Needs numpy.
"""

import json
import sys

import numpy as np



def weights(rows):
    """Φ, measurements × taxels: each row is a string of signs, or an array of numbers where weights are not ±1."""
    if isinstance(rows[0], str):
        rows = [[1.0 if sign == "+" else -1.0 for sign in row] for row in rows]
    return np.array(rows)


header = json.loads(sys.stdin.readline())
for line in sys.stdin:
    window = json.loads(line)
    phi = weights(window["phi"])
    y = np.array(window["y"])
    # the rows are nearly orthogonal: Φ Φᵀ ≈ s I, where s is the mean square length of a row: N for weights of ±1
    ridge = 0.1 * np.mean(np.sum(phi**2, axis=1))
    image = phi.T @ np.linalg.solve(phi @ phi.T + ridge * np.eye(len(y)), y)
    print(json.dumps({"image": image.tolist()}), flush=True)
