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
NOTEBOOKS = sorted((ROOT / "python/notebooks").glob("*.ipynb"))
# what a file may have at most, with its pictures, bytes
MOST = 200_000
# what is run less often here than in the notebook
FEWER = {
    "decoder": {"rows=6000": "rows=1000", "100_000": "5_000", "X[:600], images[:600]": "X[:200], images[:200]"},
    "own_data": {"measurements=[26, 52, 102]": "measurements=[52]", "range(4)": "range(2)"},
    "policy": {"SEEDS, TESTS = 5, 50": "SEEDS, TESTS = 1, 5", "episodes=50": "episodes=10"},
}


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
    outputs = [output for cell in cells for output in cell.get("outputs", [])]
    assert outputs and all(output["output_type"] != "error" for output in outputs)
    assert path.stat().st_size < MOST
    blocks = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    for all_of_it, fewer in FEWER.get(path.stem, {}).items():
        assert sum(all_of_it in block for block in blocks) == 1, all_of_it
        blocks = [block.replace(all_of_it, fewer) for block in blocks]
    run(blocks, tmp_path, monkeypatch)


def test_the_robot_takes_thirty_lines():
    """Without the model of the robot itself, and blank lines."""
    block = next(
        b for b in re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL) if "attach(" in b
    )
    own = re.sub(r'""".*?"""', "XML", block, flags=re.DOTALL)
    assert len([line for line in own.splitlines() if line.strip()]) <= 30
