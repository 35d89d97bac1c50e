"""Speaks for a class in a Python file: a line of JSON in, a line out."""
import importlib.util
import json
import sys
from types import SimpleNamespace

import numpy as np


def rows_of(lines):
    """Rows of signs or numbers as an array."""
    if lines and isinstance(lines[0], str):
        return np.array([[1.0 if sign == "+" else -1.0 for sign in line] for line in lines])
    return np.asarray(lines, float)


spec = importlib.util.spec_from_file_location("entrant", sys.argv[1])
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
own = [v for v in vars(module).values() if isinstance(v, type) and v.__module__ == "entrant" and hasattr(v, "predict")]
if len(own) != 1:
    sys.exit(f"{sys.argv[1]}: {len(own)} classes with a method `predict`; valid: 1")
entrant = own[0]()
answers, sys.stdout = sys.stdout, sys.stderr
header = json.loads(sys.stdin.readline())
names = {int(number): name for number, name in header["classes"].items()}
images, labels = header["learn"]["images"], header["learn"]["labels"]
train = SimpleNamespace(images=np.asarray(images, float), labels=[names.get(k) for k in labels], rows=header["rows"], cols=header["cols"])
if hasattr(entrant, "fit"):
    entrant.fit(train)
numbers = {name: number for number, name in names.items()}
for line in sys.stdin:
    window = json.loads(line)
    answer = entrant.predict(rows_of(window["phi"]), np.asarray(window["y"], float))
    image, label = answer if isinstance(answer, tuple) else (answer, None)
    said = {"image": np.asarray(image, float).ravel().tolist()}
    if label is not None:
        said["label"] = numbers[label]
    print(json.dumps(said), file=answers, flush=True)
