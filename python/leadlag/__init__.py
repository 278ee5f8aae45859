"""Calibrates car-following and adaptive-cruise-control models on measured trajectories.

    import leadlag as ll

    drive = ll.Drive(frame)                  # or ll.read("platoon.csv", follower=1)
    fit = ll.calibrate(drive, "idm+delay", bounds="human", seed=1)
    fit.parameters, fit.intervals, fit.score
    fit.simulate(other).to_pandas()

Lengths are metres, times seconds, speeds m/s, accelerations m/s². The same seed gives the same result to the bit as the command ``leadlag``,
whatever the number of threads. Errors are :class:`Error`, or :class:`UsageError` for invalid requests.
"""

import os as _os
import sys as _sys

# Mesa's layer for choosing among GPUs prints an error without a desktop session. leadlag does not need the layer.
if _sys.platform == "linux" and not {"XDG_RUNTIME_DIR", "MESA_VK_DEVICE_SELECT"} & _os.environ.keys():
    _os.environ["NODEVICE_SELECT"] = "1"

from ._api import (
    Drive,
    Evaluator,
    Model,
    calibrate,
    calibrate_all,
    diagnose,
    diagnose_all,
)
from ._fleet import Fleet, compare
from ._native import Error, Findings, Fit, Simulation, UsageError, __version__, read, synthetic

__all__ = [
    "Drive",
    "Error",
    "Evaluator",
    "Findings",
    "Fit",
    "Fleet",
    "Model",
    "Simulation",
    "UsageError",
    "__version__",
    "calibrate",
    "calibrate_all",
    "compare",
    "diagnose",
    "diagnose_all",
    "read",
    "synthetic",
]
