"""Runs the code of README.md and of the book, page by page: `python scripts/docs/run_blocks.py [PAGE ...]`.

Every page has a fresh folder that looks like a checkout with nothing in `out`, and `spts` on its path. Its `sh` and
`python` blocks run there in their order; a `text` block has to be what the block before it has printed. Lines may be left
out of it, and `…` stands for anything. `toml` and `rust` blocks are for the tests in Rust. Marks: see blocks.py.

    --with slow             run what takes long, too; also `--with network`
    --without python        leave Python out, where the package `spts` is not built
    --times                 print the time of every block
"""

import argparse
import concurrent.futures
import contextlib
import io
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback

from blocks import ROOT, PageError, blocks, pages

# a block that takes longer hangs
TIMEOUT_S = 900


def recordings():
    """Folder of recordings of the real skin, or none."""
    named = os.environ.get("SPTS_RECORDINGS") or os.environ.get("RECORDINGS")
    return pathlib.Path(named).resolve() if named and pathlib.Path(named).is_dir() else None


def checkout(folder):
    """Makes `folder` look like a fresh checkout: links to what is in the real one, and nothing in `out`."""
    for entry in ROOT.iterdir():
        if entry.name not in ("out", "recordings", ".git"):
            (folder / entry.name).symlink_to(entry)
    if recordings():
        (folder / "recordings").symlink_to(recordings())


def environment(spts):
    """What the blocks find: this Python and the program first."""
    path = [str(spts.parent), str(pathlib.Path(sys.executable).parent), os.environ["PATH"]]
    return {**os.environ, "PATH": os.pathsep.join(path), "MPLBACKEND": "Agg", "NO_COLOR": "1"}


def run_shell(block, folder, spts):
    """Output of a `sh` block."""
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", block.text],
        cwd=folder,
        env=environment(spts),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=TIMEOUT_S,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise AssertionError(f"ends with status {done.returncode}:\n{done.stdout[-2000:]}")
    return done.stdout


def run_python(block, names):
    """Output of a `python` block, which sees what those before it on its page have named."""
    printed = io.StringIO()
    signal.alarm(TIMEOUT_S)
    try:
        with contextlib.redirect_stdout(printed):
            exec(compile(block.text, block.where, "exec"), names)
    finally:
        signal.alarm(0)
    return printed.getvalue()


def compare(block, output):
    """Fails unless the lines of a `text` block are lines of `output`, in their order."""
    printed = iter(" ".join(line.split()) for line in output.splitlines())
    for line in block.text.splitlines():
        wanted = " ".join(line.split())
        if wanted in ("", "…"):
            continue
        pattern = re.compile(".*".join(re.escape(part) for part in wanted.split("…")))
        if not any(pattern.fullmatch(line) for line in printed):
            raise AssertionError(f"does not print `{wanted}`, or not there, but:\n{output[-4000:]}")


def run_page(page, options):
    """Runs the blocks of one page; a line for each, and whether all is well."""
    report, names, output = [], {"__name__": "__main__"}, None
    folder = pathlib.Path(tempfile.mkdtemp(prefix="spts-page-"))
    try:
        checkout(folder)
        os.chdir(folder)
        for block in blocks(page):
            start = time.monotonic()
            try:
                said, output = run_block(block, output, folder, names, options)
            except (AssertionError, subprocess.TimeoutExpired) as error:
                report.append(f"{block.where}: {error}")
                return report, False
            except KeyboardInterrupt:
                raise
            except BaseException:  # whatever a block of Python raises, its own end included
                report.append(f"{block.where}:\n{traceback.format_exc(limit=-3)}")
                return report, False
            if said and options.times:
                report.append(f"{time.monotonic() - start:6.1f} s  {block.where} {said}")
    except PageError as error:
        return [str(error)], False
    finally:
        os.chdir(ROOT)
        shutil.rmtree(folder, ignore_errors=True)
    return report, True


def run_block(block, output, folder, names, options):
    """What was done with a block, if anything, and what the blocks printed that a `text` block after it may show."""
    if block.language == "json":
        json.loads(block.text)
    if block.language == "text" and "none" not in block.marks:
        assert output is not None, "no block before it prints something; mark it `<!-- run: none -->` if none should"
        if output is not SKIPPED:
            compare(block, output)
        return "compared", output
    if block.language not in ("sh", "python"):
        return None, output
    needs_python = block.language == "python" or "python -m spts." in block.text
    left_out = (needs_python and "python" in options.without) or not block.marks <= options.allowed
    if left_out:
        return "left out", SKIPPED
    if block.language == "sh":
        return "run", run_shell(block, folder, options.spts)
    return "run", run_python(block, names)


# output of a block that was left out
SKIPPED = object()


def main():
    parser = argparse.ArgumentParser(description="Runs the code of README.md and of the book.")
    parser.add_argument("pages", nargs="*", type=pathlib.Path, metavar="PAGE", help="Pages [default: all]")
    parser.add_argument("--spts", type=pathlib.Path, default=ROOT / "target/release/spts", help="the program")
    parser.add_argument("--with", dest="extra", action="append", default=[], choices=["slow", "network"])
    parser.add_argument("--without", action="append", default=[], choices=["python"])
    parser.add_argument("--jobs", type=int, default=2, help="pages at once [default: 2]")
    parser.add_argument("--times", action="store_true", help="print the time of every block")
    options = parser.parse_args()
    options.spts = options.spts.resolve()
    if not options.spts.is_file():
        parser.error(f"{options.spts}: not there; build it with `cargo build --release --workspace`")
    options.allowed = frozenset(options.extra) | ({"recordings"} if recordings() else set())
    wanted = [page.resolve() for page in options.pages] or pages()
    start, good = time.monotonic(), True
    with concurrent.futures.ProcessPoolExecutor(options.jobs, max_tasks_per_child=1) as pool:
        for report, well in pool.map(run_page, wanted, [options] * len(wanted)):
            good &= well
            print("\n".join(report), end="\n" if report else "", flush=True)
    print(f"{len(wanted)} pages in {time.monotonic() - start:.0f} s: {'all is well' if good else 'see above'}")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
