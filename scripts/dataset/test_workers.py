"""One spec, one digest: any threads, workers, order, crashes and Ray make the same files."""

import importlib.util
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time

import conftest
import pytest

# thirty files, so that there are more than workers and threads
SPEC = """\
name = "workers"
rows = 1200
rows_per_shard = 40
seed = 5

[object]
from = "shapes"
rows_per_shape = 28
count = { choice = [1, 2] }

[pose]
x_share = { uniform = [-0.3, 0.3] }
rotation_deg = { uniform = [-180.0, 180.0] }

[skin]
rows_per_skin = 12
presses_before = { choice = [0, 5] }
"""
# rows of the run that is ended again and again, for each time
ROWS_PER_KILL = 300
RAY_SECONDS = 120


def files(folder):
    """{name: content} of a finished data set; names that begin with a dot as well."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def spec(program):
    return program.spec("workers", SPEC)


@pytest.fixture(scope="module")
def one_thread(program, spec):
    """The data set that all others have to equal, made by one thread; its folder and digest."""
    out = program.folder / "one-thread"
    made = program.json("dataset", "make", spec, "--out", out, environment={"RAYON_NUM_THREADS": "1"})
    return out, made["finished"]["digest"]


def test_two_threads(program, spec, one_thread):
    out = program.folder / "two-threads"
    made = program.json("dataset", "make", spec, "--out", out, "--threads", 2)
    assert made["finished"]["digest"] == one_thread[1]
    assert program.json("dataset", "info", out)["digest"] == one_thread[1]
    assert files(out) == files(one_thread[0])


def test_another_seed_has_another_digest(program, spec, one_thread):
    made = program.json("dataset", "make", spec, "--seed", 6, "--out", program.folder / "another-seed")
    assert made["finished"]["digest"] != one_thread[1]


def test_four_workers_one_after_the_other_in_any_order(program, spec, one_thread):
    out = program.folder / "one-after-the-other"
    order = random.Random(3).sample(range(4), 4)
    assert order != sorted(order)
    for shard in order:
        program.call("dataset", "make", spec, "--out", out, "--shard", f"{shard}/4")
    assert program.json("dataset", "finish", out)["digest"] == one_thread[1]
    assert files(out) == files(one_thread[0])


def test_four_workers_at_once(program, spec, one_thread):
    out = program.folder / "at-once"
    command = [program.path, "dataset", "make", spec, "--out", out]
    workers = [subprocess.Popen([*command, "--shard", f"{shard}/4"], stdout=subprocess.DEVNULL) for shard in range(4)]
    assert [worker.wait() for worker in workers] == [0] * 4
    assert program.json("dataset", "finish", out)["digest"] == one_thread[1]
    assert files(out) == files(one_thread[0])


def test_workers_on_disks_of_their_own(program, spec, one_thread):
    out, away = program.folder / "gathered", program.folder / "away"
    for shard, folder in enumerate([out, away]):
        program.call("dataset", "make", spec, "--out", folder, "--shard", f"{shard}/2")
    for part in (away / "data").iterdir():
        shutil.copy(part, out / "data")
    assert program.json("dataset", "finish", out)["digest"] == one_thread[1]


def test_a_run_that_is_killed_again_and_again(program, spec, request):
    kills = request.config.getoption("--kills")
    rows = ROWS_PER_KILL * kills
    begin = time.monotonic()
    whole = program.make("never-killed", spec, "--rows", rows)
    seconds = time.monotonic() - begin
    out = program.folder / "killed"
    command = [program.path, "dataset", "make", spec, "--rows", str(rows), "--out", out]
    moments = random.Random(1)
    statuses, seen = [], set()
    for _ in range(kills):
        run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True)
        # on average the share of the work that lets the last one find something to do
        time.sleep(moments.uniform(0.0, 2.0 * seconds / kills))
        run.send_signal(signal.SIGKILL)
        error = run.communicate()[1].decode()
        assert run.returncode in (0, -signal.SIGKILL), error
        statuses.append(run.returncode)
        seen.add(len(list(out.glob("data/part-*.parquet"))))
    # some of the runs may have come to their end before they were killed
    assert statuses.count(-signal.SIGKILL) >= 0.7 * kills
    assert len(seen) >= 0.3 * kills, f"the runs were ended at too few moments: {sorted(seen)} files"
    assert program.json(*command[1:])["finished"]["digest"] == whole.info["digest"]
    assert files(out) == files(whole.folder)
    program.call("dataset", "verify", out)


@pytest.mark.parametrize("place", ["data", "."], ids=["beside the rows", "beside the card"])
def test_what_a_killed_run_was_writing_is_removed_by_the_last_step(program, spec, one_thread, place):
    out = program.folder / f"left-{'rows' if place == 'data' else 'card'}"
    shutil.copytree(one_thread[0], out)
    # names of files that were being written have a dot, twelve letters or digits and this end
    (out / place / ".spts-abcdefABCDEF.part").write_bytes(b"PAR1 half a file")
    assert program.json("dataset", "make", spec, "--out", out)["finished"]["digest"] == one_thread[1]
    assert files(out) == files(one_thread[0])


@pytest.mark.skipif(importlib.util.find_spec("ray") is None, reason="ray is not installed")
def test_ray_with_two_workers(program, spec, one_thread):
    script = conftest.ROOT / "scripts/cluster/ray_dataset.py"
    out = program.folder / "ray"
    done = subprocess.run(
        [sys.executable, script, spec, "--out", out, "--cpus", "2", "--spts", program.path],
        capture_output=True,
        text=True,
        timeout=RAY_SECONDS,
        env=os.environ | {"RAY_USAGE_STATS_ENABLED": "0"},
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["digest"] == one_thread[1]
    assert files(out) == files(one_thread[0])
