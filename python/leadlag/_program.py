"""The command ``leadlag``: the same program as the one that cargo installs."""

from __future__ import annotations

import sys

from leadlag._native import run


def main() -> int:
    """Runs the command line of this process and returns its exit code."""
    return run(["leadlag", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
