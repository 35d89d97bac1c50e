#!/usr/bin/env python3
"""Prints what the program and the wheel are made of, as CSV: crate, version, licence, and where its source is.

`python3 scripts/licences.py TARGET...`, a target as x86_64-unknown-linux-gnu. What only tests, build scripts and
macros use is left out.
"""

import csv
import json
import subprocess
import sys


# what is no crate and is in them all the same
FONT = ("Inter (font)", "3.19", "OFL-1.1", "https://github.com/rsms/inter")


def macro(package):
    """Whether `package` only writes code while others are compiled."""
    return any("proc-macro" in target["kind"] for target in package["targets"])


def crates(root, target):
    """The packages that the package `root` links on `target`, by name and version."""
    command = ["cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", target]
    found = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)
    packages = {package["id"]: package for package in found["packages"]}
    nodes = {node["id"]: node for node in found["resolve"]["nodes"]}
    todo, linked = [key for key, package in packages.items() if package["name"] == root], set()
    while todo:
        key = todo.pop()
        if key not in linked:
            linked.add(key)
            kinds = [(dep["pkg"], kind["kind"]) for dep in nodes[key]["deps"] for kind in dep["dep_kinds"]]
            todo += [dependency for dependency, kind in kinds if kind is None and not macro(packages[dependency])]
    return {(packages[key]["name"], packages[key]["version"]): packages[key] for key in linked}


def main():
    linked = {}
    for target in sys.argv[1:]:
        linked |= crates("spts-cli", target) | crates("spts-python", target)
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["crate", "version", "licence", "source"])
    table.writerow(FONT)
    for (name, version), package in sorted(linked.items()):
        if package["source"]:
            table.writerow([name, version, package["license"] or package["license_file"], package["repository"] or ""])


if __name__ == "__main__":
    main()
