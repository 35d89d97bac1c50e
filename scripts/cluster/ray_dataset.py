"""A data set on a Ray cluster: one task a file, all calling the same program.

    python scripts/cluster/ray_dataset.py random-shapes --out /shared/shapes --rows 1000000
    python scripts/cluster/ray_dataset.py my_spec.toml --out /shared/mine --address auto --spts /opt/spts/bin/spts

A worker that dies is tried again on another node. A file that the program itself refuses fails on any node: it is put
into quarantine (DIR.quarantine.json, with the error) and the others go on. Run the same line again after a crash of any
kind: files that are there are not made twice. Needs `pip install ray`; DIR has to be on a disk that all nodes share.
"""

import argparse
import json
import pathlib
import subprocess
import sys

REFUSED = 2  # the program's exit status for what fails on any machine
RETRIES = 3  # of a task whose worker died


def run(arguments, check=True):
    """Runs the program; its exit status, standard output and error."""
    done = subprocess.run(arguments, capture_output=True, text=True)
    if check and done.returncode != 0:
        sys.exit(done.stderr.strip() or f"{arguments[0]}: exit status {done.returncode}")
    return done.returncode, done.stdout, done.stderr.strip()


def make_file(command, shard, shards):
    """Makes file number `shard`: the part of one worker of as many as there are files."""
    status, _, error = run([*command, "--shard", f"{shard}/{shards}", "--threads", "1"], check=False)
    if status == REFUSED:
        return shard, error
    if status != 0:
        raise RuntimeError(f"file {shard}: exit status {status}: {error}")  # Ray tries again
    return shard, None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("spec", help="a TOML file, or a spec that ships")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="folder of the data set")
    parser.add_argument("--rows", type=int, help="rows, in place of the spec's")
    parser.add_argument("--seed", type=int, help="root of every random number, in place of the spec's")
    parser.add_argument("--address", help="of a cluster; without it one is started here")
    parser.add_argument("--cpus", type=int, help="of a cluster that is started here")
    parser.add_argument("--spts", default="spts", help="the program, on every node")
    options = parser.parse_args()

    import ray

    out = options.out.resolve()
    command = [options.spts, "dataset", "make", options.spec, "--out", str(out), "--json"]
    for name in ("rows", "seed"):
        if getattr(options, name) is not None:
            command += [f"--{name}", str(getattr(options, name))]
    # the first file of so many that it is the only one: it begins the data set, or shows what is wrong with the spec
    run([*command, "--shard", f"0/{10**9}", "--threads", "1"])
    _, text, _ = run([options.spts, "dataset", "info", str(out), "--json"])
    shards = json.loads(text)["shards"]

    ray.init(address=options.address, num_cpus=None if options.address else options.cpus, include_dashboard=False, log_to_driver=False)
    task = ray.remote(num_cpus=1, max_retries=RETRIES, retry_exceptions=[RuntimeError])(make_file)
    waiting = [task.remote(command, shard, shards) for shard in range(1, shards)]
    quarantine, made = {}, 1
    while waiting:
        ready, waiting = ray.wait(waiting, num_returns=1)
        for shard, error in ray.get(ready):
            made += error is None
            if error is not None:
                quarantine[shard] = error
        if sys.stderr.isatty():
            print(f"\r{made} of {shards} files, {len(quarantine)} in quarantine", end="", file=sys.stderr)
    if sys.stderr.isatty():
        print(file=sys.stderr)
    if quarantine:
        path = out.with_name(out.name + ".quarantine.json")
        path.write_text(json.dumps(quarantine, indent=2) + "\n")
        sys.exit(f"{len(quarantine)} of {shards} files cannot be made: {path}")
    _, text, _ = run([options.spts, "dataset", "finish", str(out), "--json"])
    print(text.strip())


if __name__ == "__main__":
    main()
