"""Speaks for a class in a Python file: a line of JSON in, a line out (docs/benchmark.md)."""

import importlib.util
import json
import sys
from types import SimpleNamespace

try:
    import numpy as np
except ImportError:
    sys.exit(f"{sys.executable} has no NumPy: pip install numpy")


def say(**answer):
    """One line out."""
    print(json.dumps(answer), file=OUT, flush=True)


def levels(lines):
    """Rows of signs or numbers as an array, M × N."""
    texts = lines and isinstance(lines[0], str)
    return np.array([[1.0 if sign == "+" else -1.0 for sign in line] for line in lines] if texts else lines, float)


def measured(rows):
    """Samples at rows of levels, which are measured now."""
    rows = np.atleast_2d(np.asarray(rows, float))
    taxels = header["rows"] * header["cols"]
    if rows.shape[1] != taxels or not (np.abs(rows) <= 1.0).all():
        sys.exit(f"{FILE}: levels to measure are an array {rows.shape}; valid: (rows, {taxels}), each in [-1, 1]")
    whole = np.isin(rows, (-1, 0, 1)).all()
    say(measure=["".join("-0+"[int(w) + 1] for w in row) for row in rows] if whole else rows.tolist())
    return np.array(json.loads(sys.stdin.readline())["y"])


def answered(method, answer):
    """An image, or an image and a name."""
    image, name = answer if isinstance(answer, tuple) else (answer, None)
    image = np.asarray(image, float).ravel()
    if not np.isfinite(image).all():
        bad = np.flatnonzero(~np.isfinite(image))[0]
        sys.exit(f"{FILE}: value {bad} of the image of `{method}` is {image[bad]}; valid: finite numbers")
    if name is not None and name not in NUMBERS:
        sys.exit(f"{FILE}: `{method}` names {name!r}; valid: {', '.join(NUMBERS)}, or no name")
    say(image=image.tolist(), **({} if name is None else {"label": NUMBERS[name]}))


def signs(rows, m):
    """The rows of ±1 for m measurements, as strings."""
    rows, taxels = np.asarray(rows, float), header["rows"] * header["cols"]
    if rows.shape != (m, taxels) or not (np.abs(rows) == 1.0).all():
        sys.exit(f"{FILE}: `rows({m})` gives an array {rows.shape}; valid: ({m}, {taxels}), of -1 and 1 alone")
    return ["".join("+" if w > 0 else "-" for w in row) for row in rows]


FILE = sys.argv[1]
OUT, sys.stdout = sys.stdout, sys.stderr  # what the class prints is no answer
spec = importlib.util.spec_from_file_location("entrant", FILE)
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
classes = [v for v in vars(module).values() if isinstance(v, type) and v.__module__ == "entrant"]
classes = [v for v in classes if hasattr(v, "predict") or hasattr(v, "read")]
# not those that another one is derived from
classes = [v for v in classes if not any(v in other.__mro__[1:] for other in classes)]
if len(classes) != 1:
    found = ", ".join(v.__name__ for v in classes) or "none"
    sys.exit(f"{FILE}: classes with a method `predict` or `read`: {found}; valid: one")
entrant = classes[0]()
header = json.loads(sys.stdin.readline())
names = {int(number): name for number, name in header["classes"].items()}
NUMBERS = {name: number for number, name in names.items()}
train = SimpleNamespace(
    images=np.array(header["learn"]["images"], float),
    labels=[names.get(number) for number in header["learn"]["labels"]],
    rows=header["rows"],
    cols=header["cols"],
    measurements=header.get("measurements", []),
)
if hasattr(entrant, "fit"):
    entrant.fit(train)
for line in sys.stdin:
    asked = json.loads(line)
    if "rows" in asked:
        say(rows=signs(entrant.rows(asked["rows"]), asked["rows"]))
    elif "read" in asked:
        answered("read", entrant.read(measured, asked["read"]))
    else:
        answered("predict", entrant.predict(levels(asked["phi"]), np.array(asked["y"], float)))
