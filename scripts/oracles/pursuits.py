"""Supports that scikit-learn finds in random problems → tests/oracles/pursuits.json.

scikit-learn's `orthogonal_mp` is orthogonal matching pursuit, on the columns as they are and on columns of length 1.
Supports are sorted: the program does not tell the order.

    python scripts/oracles/pursuits.py
"""

import json
import pathlib
import warnings

import numpy as np
import problems
import sklearn
from sklearn.linear_model import orthogonal_mp

COUNT = 1000
OUT = pathlib.Path(__file__).parents[2] / "tests/oracles/pursuits.json"


def main():
    warnings.simplefilter("error")
    rows = {"omp": [], "omp_normalized": []}
    for index in range(COUNT):
        a, y, s = problems.problem(index)
        unit = a / np.linalg.norm(a, axis=0)
        rows["omp"].append(orthogonal_mp(a, y, n_nonzero_coefs=s))
        rows["omp_normalized"].append(orthogonal_mp(unit, y, n_nonzero_coefs=s))
    supports = {name: [np.flatnonzero(code).tolist() for code in codes] for name, codes in rows.items()}
    versions = {"scikit-learn": sklearn.__version__, "numpy": np.__version__}
    lines = [f'  "{name}": [\n    ' + ",\n    ".join(chunks(codes)) + "\n  ]" for name, codes in supports.items()]
    OUT.write_text('{\n  "versions": ' + json.dumps(versions) + ",\n" + ",\n".join(lines) + "\n}\n")


def chunks(codes, per_line=8):
    """Supports as text, some a line."""
    text = [json.dumps(code, separators=(",", ":")) for code in codes]
    return [", ".join(text[i : i + per_line]) for i in range(0, len(text), per_line)]


if __name__ == "__main__":
    main()
