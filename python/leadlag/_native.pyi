"""The extension module, written in Rust."""

import os
from collections.abc import Callable, Sequence
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Unpack

__version__: str
PROGRAM: str

Progress = Callable[[float, str], None]

class Error(Exception):
    """What could not be done: where, what was expected, what was found, what to do."""

class UsageError(Error):
    """Something was asked for that cannot be, whatever the data."""

class _Reading(TypedDict, total=False):
    """Options of reading, each a keyword; None stands for the default."""

    columns: str | os.PathLike[str] | None
    """Column map of a table, by name or file."""
    layout: str | None
    """Layout of the file; by default its header tells."""
    trajectory: str | int | None
    """Id of the trajectory, in files that hold several."""
    segment: int | None
    """Segment between long gaps, from 1; by default the longest."""
    start: float | None
    """First time to use [s], as in the file."""
    end: float | None
    """Last time to use [s], as in the file."""
    max_gap: float | None
    """Gaps up to this are interpolated [s]; 1 by default."""
    smooth: bool | None
    """Whether signals are smoothed as the paper's authors did."""
    resample: float | None
    """Time step to resample to [s]."""
    reconcile: str | None
    """What the spacing is anchored to: "gap" (the default) or "speeds"."""
    vehicle: str | None
    """The follower's car: a built-in one, or FILE#NAME."""
    grade: str | os.PathLike[str] | None
    """Grade table, or "level"."""
    lead_length: float | None
    """Length of the preceding vehicle [m]."""
    lead_start: float | None
    """Position of the preceding vehicle on the grade table at the first row [m]."""

class Drive:
    """One measured follower behind its leader, prepared: gaps filled, one segment, one time step."""

    def __new__(
        cls,
        table: Any,
        follower: int | str | None = None,
        *,
        name: str = "table",
        **options: Unpack[_Reading],
    ) -> Drive: ...
    @property
    def label(self) -> str:
        """`FILE follower N`, with trajectory id and segment where there are several."""
    @property
    def name(self) -> str:
        """Name of the follower as in the file."""
    @property
    def time_step(self) -> float:
        """Time step [s]."""
    @property
    def time(self) -> NDArray[np.float64]:
        """Times [s], as in the file, shape (samples,)."""
    @property
    def spacing(self) -> NDArray[np.float64]:
        """Bumper-to-bumper spacing [m], shape (samples,)."""
    @property
    def speed(self) -> NDArray[np.float64]:
        """Speed of the follower [m/s], shape (samples,)."""
    @property
    def lead_speed(self) -> NDArray[np.float64]:
        """Speed of the preceding vehicle [m/s], shape (samples,)."""
    @property
    def position(self) -> NDArray[np.float64]:
        """Position of the follower along the road [m], shape (samples,)."""
    @property
    def lead_position(self) -> NDArray[np.float64]:
        """Position of the preceding vehicle [m], of its rear bumper where its length is not known, shape (samples,)."""
    @property
    def preparation(self) -> list[str]:
        """What was done to the data, a line each."""
    @property
    def warnings(self) -> list[str]:
        """What is doubtful in the data, a line each."""
    def __len__(self) -> int: ...

class Fit:
    """Calibrated parameters with what is known of them."""

    @property
    def drives(self) -> list[Drive]:
        """The drives that it was calibrated on."""
    @property
    def model(self) -> str:
        """The model, by its name."""
    @property
    def score(self) -> float:
        """What was minimised, by the f64 reference."""
    @property
    def parameters(self) -> dict[str, float]:
        """The calibrated parameters by the paper's symbols, in SI units."""
    @property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """95 % intervals of the parameters that the data determine."""
    @property
    def units(self) -> dict[str, str]:
        """The units of the parameters."""
    @property
    def at_bound(self) -> list[str]:
        """Parameters within 0.1 % of their range of a bound."""
    def to_json(self) -> str:
        """The text of `result.json`, as the command line writes it."""
    def simulate(self, drive: Drive) -> Simulation:
        """Simulates the calibrated model on a drive, by the f64 reference."""
    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes what `leadlag calibrate --out` writes, but for the time that it took."""
    def report(self, path: str | os.PathLike[str] | None = None) -> Any:
        """The HTML report: written to a file where a path is given, else shown in a notebook."""
    def plot(self) -> Any:
        """Measured and simulated signals over time, drawn by matplotlib; the figure comes back."""
    def _picture(self) -> str | None: ...
    def _repr_html_(self) -> str: ...

class Simulation:
    """A run of a calibrated model on a drive, as far as it went."""

    @property
    def time(self) -> NDArray[np.float64]:
        """Times [s], shape (samples,)."""
    @property
    def spacing(self) -> NDArray[np.float64]:
        """Simulated spacing [m], shape (samples,)."""
    @property
    def speed(self) -> NDArray[np.float64]:
        """Simulated speed [m/s], shape (samples,)."""
    @property
    def acceleration(self) -> NDArray[np.float64]:
        """Simulated acceleration [m/s²], shape (samples,)."""
    @property
    def scores(self) -> dict[str, float]:
        """Every measure of the error that exists for the drive, by name: `nrmse_sva`, `rmse_s`, ..."""
    @property
    def ended(self) -> str | None:
        """Why the run ended early: a crash, for example."""
    def to_pandas(self) -> Any:
        """The signals as a pandas DataFrame, a row per sample."""

class Findings:
    """What a diagnosis found."""

    @property
    def verdict(self) -> str:
        """The answer in a word: named, helps, nothing, ambiguous, unexplained, not_testable."""
    @property
    def reason(self) -> str:
        """Why, in a sentence."""
    @property
    def causes(self) -> list[str]:
        """The causes that the likelihood adopts, in order."""
    @property
    def recommended(self) -> list[str]:
        """The causes with which the model follows unseen drives better."""
    @property
    def text(self) -> str:
        """The whole answer in words."""
    def to_json(self) -> str:
        """The text of `diagnosis.json`: all that was found."""
    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes what `leadlag diagnose --out` writes."""
    def report(self, path: str | os.PathLike[str] | None = None) -> Any:
        """The HTML report: written to a file where a path is given, else shown in a notebook."""

class Evaluator:
    @property
    def parameters(self) -> list[str]: ...
    @property
    def units(self) -> list[str]: ...
    @property
    def lower(self) -> NDArray[np.float64]: ...
    @property
    def upper(self) -> NDArray[np.float64]: ...
    @property
    def device(self) -> str: ...
    def scores(self, x: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def simulate(self, x: NDArray[np.float64], drive: int) -> list[NDArray[np.float64]]: ...

class Calibration:
    def __new__(cls, model: str | tuple[str, str, str], extensions: Sequence[str | tuple[str, str]]) -> Calibration: ...
    @property
    def model(self) -> str: ...
    def bounds(self, given: str) -> Calibration: ...
    def bound(self, parameter: str, lower: float, upper: float) -> Calibration: ...
    def fix(self, parameter: str, value: float) -> Calibration: ...
    def words(
        self, gof: str | None, convention: str | None, optimizer: str | None, evaluator: str | None, precision: str | None
    ) -> Calibration: ...
    def numbers(
        self, seed: int | None, replicates: int | None, max_evaluations: int | None, intervals: bool | None
    ) -> Calibration: ...
    def warnings(self, drives: Sequence[Drive]) -> list[str]: ...
    def run(self, drives: Sequence[Drive], progress: Progress | None) -> tuple[Fit, BaseException | None]: ...
    def evaluate_on(self, drives: Sequence[Drive]) -> Evaluator: ...

def read(
    path: str | os.PathLike[str],
    follower: int | str | None = None,
    **options: Unpack[_Reading],
) -> Drive:
    """Reads the drive of a follower from a file. ``follower``: 1 is right behind the platoon leader; or a name or id."""

def synthetic(seed: int = 1, duration: float = 120.0) -> Drive:
    """A made-up drive of one car behind another, to try things without data. ``duration``: 20 s to some hours [s]."""

def calibrate_files(
    paths: Sequence[str | os.PathLike[str]],
    text: bytes | None,
    calibrations: Sequence[Calibration],
    settings: dict[str, Any],
    progress: Progress | None,
) -> tuple[dict[str, Any], list[str], BaseException | None]: ...
def calibrate_drives(
    drives: Sequence[Drive], calibrations: Sequence[Calibration], progress: Progress | None
) -> tuple[dict[str, Any], list[str], BaseException | None]: ...
def diagnose(
    drives: Sequence[Drive],
    holdout: Sequence[Drive],
    base: str | tuple[str, str, str],
    extend: Sequence[str | tuple[str, str]],
    effort: str,
    seed: int,
    causes: Sequence[tuple[str, str]],
    bounds: Sequence[str],
    single: Sequence[tuple[str, float, float]],
    correct: bool,
    progress: Progress | None,
) -> Findings: ...
def page(file: str | os.PathLike[str]) -> str: ...
def run(words: Sequence[str]) -> int: ...
