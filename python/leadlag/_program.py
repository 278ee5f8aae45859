"""The command ``leadlag``: the same program as the one that cargo installs."""

from __future__ import annotations

import os
import sys


def main() -> int:
    """Runs the command line of this process and returns its exit code."""
    # Mesa's layer for choosing among devices prints an error where there is no desktop session.
    if sys.platform == "linux" and not {"XDG_RUNTIME_DIR", "MESA_VK_DEVICE_SELECT"} & os.environ.keys():
        os.environ["NODEVICE_SELECT"] = "1"
    from ._native import run

    return run(["leadlag", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
