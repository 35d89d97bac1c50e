"""The console script `spts`, which is also `python -m spts`."""

from __future__ import annotations

import signal
import sys

from ._spts import command_line


def main():
    """Runs the command line of this process."""
    # the program ends itself when Ctrl-C is pressed, and removes what it has begun
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(command_line(["spts", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
