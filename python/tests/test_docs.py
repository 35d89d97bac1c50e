"""The notebooks run. The pages of the book are run by scripts/docs/run_blocks.py."""

import json
import pathlib
import re

import matplotlib
import pytest

matplotlib.use("Agg")

import matplotlib.pyplot

ROOT = pathlib.Path(__file__).parents[2]
PAGE = ROOT / "docs/python.md"
# torch is large: that notebook is run by hand
NOTEBOOKS = sorted(path for path in (ROOT / "python/notebooks").glob("*.ipynb") if path.stem != "torch")


def run(blocks, where, monkeypatch):
    monkeypatch.chdir(where)
    names = {"__name__": "__main__"}
    for number, block in enumerate(blocks):
        exec(compile(block, f"block {number}", "exec"), names)
    matplotlib.pyplot.close("all")
    return names


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook(path, tmp_path, monkeypatch):
    cells = json.loads(path.read_text())["cells"]
    assert all(not cell.get("outputs") or cell["outputs"][0]["output_type"] != "error" for cell in cells)
    run(["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"], tmp_path, monkeypatch)


def test_the_robot_takes_thirty_lines():
    """Without the model of the robot itself, and blank lines."""
    block = next(
        b for b in re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL) if "attach(" in b
    )
    own = re.sub(r'""".*?"""', "XML", block, flags=re.DOTALL)
    assert len([line for line in own.splitlines() if line.strip()]) <= 30
