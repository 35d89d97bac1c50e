"""A decoder for `spts score --external 'python3 scripts/examples/decoder.py'`: ridge regression.

Shows the protocol: without a prior its images are poor, the more so the fewer measurements there are.

Reads a header line, then one window a line, and answers each with an image. Needs numpy.
"""

import json
import sys

import numpy as np

header = json.loads(sys.stdin.readline())
for line in sys.stdin:
    window = json.loads(line)
    signs = np.frombuffer("".join(window["phi"]).encode(), dtype=np.uint8).reshape(window["m"], -1)
    phi = np.where(signs == ord("+"), 1.0, -1.0)
    y = np.array(window["y"])
    # the rows are nearly orthogonal: Φ Φᵀ ≈ N I
    ridge = 0.1 * header["taxels"]
    image = phi.T @ np.linalg.solve(phi @ phi.T + ridge * np.eye(len(y)), y)
    print(json.dumps({"image": image.tolist()}), flush=True)
