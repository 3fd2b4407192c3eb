"""The types of the compiled part."""

import os
from pathlib import Path
from typing import Any, Final, Literal, Optional, Union, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: Final[str]

REASONS: Final[tuple[Optional[str], ...]]
"""The names of the reasons by their codes. Code 0 is a permit: None."""

_Path = Union[str, os.PathLike[str]]
_Spread = Union[ArrayLike, "Bounded"]
_Terms = Literal["filled", "yaw_unknown", "all_unknown"]

class PosegateError(ValueError):
    """A file, an argument or a task that is refused, in the words of the program `posegate`."""

    help: Optional[str]
    """What to do about it."""

@final
class Verdict:
    """The gate's decision on one estimate. True if it permits."""

    @property
    def permit(self) -> bool:
        """True if the task may start."""

    @property
    def reason(self) -> Optional[str]:
        """The name of the reason of a denial. `posegate explain REASON` describes what to do about it."""

    @property
    def margin(self) -> Optional[float]:
        """The largest factor by which the pose-set could be scaled: at least 1 with a permit."""

    @property
    def worst_pose(self) -> Optional[tuple[float, float, float]]:
        """A pose of the pose-set that is not in the success set."""

    def __new__(
        cls,
        permit: bool,
        reason: Optional[str] = None,
        margin: Optional[float] = None,
        worst_pose: Optional[tuple[float, float, float]] = None,
    ) -> "Verdict": ...
    def __bool__(self) -> bool: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class Table:
    """The proven table of a task."""

    def __new__(cls, data: bytes) -> "Table": ...
    @staticmethod
    def open(path: _Path) -> "Table":
        """Reads a table that `posegate table build` or `Site.build` has made."""

    @property
    def task(self) -> str:
        """The name of the task."""

    @property
    def epsilon(self) -> float:
        """The confidence of the Gaussian pose-sets if none is given."""

    def decide(
        self,
        x: float,
        y: float,
        yaw: float,
        cov: _Spread,
        epsilon: Optional[float] = None,
        cross_terms: _Terms = "filled",
        inflation: float = 1.0,
    ) -> Verdict:
        """Decides on one estimate: m, m, rad, and its covariance by rows in m^2, m rad and rad^2, or a `Bounded`.

        `cross_terms` says which terms of it the source fills; `inflation` (1 to 4096) multiplies it.
        """

    @overload
    def decide_many(
        self,
        poses: ArrayLike,
        covs: _Spread,
        epsilon: Optional[float] = None,
        margins: Literal[False] = False,
        cross_terms: _Terms = "filled",
        inflation: float = 1.0,
    ) -> tuple[NDArray[np.bool_], NDArray[np.uint8]]: ...
    @overload
    def decide_many(
        self,
        poses: ArrayLike,
        covs: _Spread,
        epsilon: Optional[float] = None,
        *,
        margins: Literal[True],
        cross_terms: _Terms = "filled",
        inflation: float = 1.0,
    ) -> tuple[NDArray[np.bool_], NDArray[np.uint8], NDArray[np.float64]]:
        """Decides on many estimates: arrays of shape (n, 3) and (n, 3, 3), or one `Bounded` for all.

        With `margins` also returns the margins, NaN where a reason has none.
        Returns `True` for each that is permitted, and the codes of the reasons, indices of `REASONS`. Uses all cores and does not hold
        the interpreter's lock: do not write into the arrays until it returns.
        """

    def __bytes__(self) -> bytes: ...

@final
class Site:
    """The cameras, tags and tasks of a place."""

    @staticmethod
    def open(path: _Path) -> "Site":
        """Reads and checks a site file."""

    @staticmethod
    def parse(text: str) -> "Site":
        """Checks the text of a site file. Files that it names are relative to the working folder."""

    @property
    def path(self) -> Optional[Path]:
        """The path of the site file; `None` for a text."""

    @property
    def text(self) -> Optional[str]:
        """The text that was parsed; `None` for a file."""

    @property
    def tasks(self) -> list[str]:
        """The names of the tasks."""

    def contains(self, task: str, poses: ArrayLike) -> NDArray[np.bool_]:
        """Returns `True` for each pose (an array of shape (n, 3)) that is in the success set of a task."""

    def build(self, task: str) -> Table:
        """Builds the table of a task and proves it."""

@final
class GateStep:
    """The state of a gate after a step. True if the interlock may be open."""

    @property
    def is_open(self) -> bool:
        """True if the interlock may be open."""

    @property
    def state(self) -> str:
        """The name of the gate's state: inhibited, qualifying, permitted or latched."""

    @property
    def reason(self) -> Optional[str]:
        """The name of the reason why the report does not permit, or without a report why the gate is closed."""

    def __bool__(self) -> bool: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class Bounded:
    """A bounded error, wherever a covariance is taken: the robot is within `translation` metres and `yaw` radians of the estimate."""

    @property
    def translation(self) -> float:
        """The radius in the plane, metres."""

    @property
    def yaw(self) -> float:
        """The half width in yaw, radians."""

    def __new__(cls, translation: float, yaw: float) -> "Bounded": ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class Evidence:
    """An estimate with its stamp, and other hypotheses about the robot's pose: a gate permits only if the pose-set of every one is inside.

    `others` are estimates (x, y, yaw, cov) of the same moment; `elsewhere` is the probability that the robot is at none of them.
    """

    def __new__(
        cls,
        stamp_ms: int,
        x: float,
        y: float,
        yaw: float,
        cov: _Spread,
        *,
        others: list[tuple[float, float, float, _Spread]] = [],
        elsewhere: float = 0.0,
        sequence: Optional[int] = None,
    ) -> "Evidence": ...

@final
class Gate:
    """The state machine of the motion controller: it opens after consecutive permits, and closes at once on a denial."""

    def __new__(
        cls,
        table: Table,
        *,
        frame: str = "map",
        period_ms: int = 50,
        jitter_ms: int = 50,
        max_speed: float = 0.0,
        max_yaw_rate: float = 0.0,
        cross_terms: _Terms = "filled",
        inflation: float = 1.0,
        permits_in_a_row: int = 3,
        now_ms: int = 0,
    ) -> "Gate": ...
    def step(
        self, now_ms: int, stamp_ms: int, x: float, y: float, yaw: float, cov: _Spread, sequence: Optional[int] = None
    ) -> GateStep:
        """Evaluates an estimate at the time `now_ms`: its stamp, m, m, rad, and its covariance by rows or a `Bounded`."""

    def step_on(self, now_ms: int, evidence: Union["Tracker", Evidence]) -> GateStep:
        """Evaluates, at the time `now_ms`, what a tracker carries to it, or an `Evidence`. Without a usable fix of a tracker the gate closes."""

    def tick(self, now_ms: int) -> GateStep:
        """Advances the time without a report."""

    def reset(self, now_ms: int) -> None:
        """Ends a latched fault and the permits so far."""

    @property
    def state(self) -> str:
        """The name of the state: inhibited, qualifying, permitted or latched."""

@final
class Tracker:
    """Carries a fix forward along odometry, as the controller does."""

    def __new__(
        cls,
        table: Table,
        *,
        max_speed: float,
        max_yaw_rate: float,
        frame: str = "map",
        noise: tuple[float, float, float] = (0.02, 0.05, 0.02),
        slip: float = 0.02,
        cross_terms: _Terms = "filled",
        inflation: float = 1.0,
        max_gap_ms: int = 200,
        max_fix_age_ms: int = 5000,
    ) -> "Tracker": ...
    def odometry(self, ahead: float, left: float, turn: float, from_ms: int, to_ms: int) -> Optional[str]:
        """Adds a movement between two times: metres ahead, metres to the left, radians to the left."""

    def fix(self, stamp_ms: int, x: float, y: float, yaw: float, cov: _Spread) -> Optional[str]:
        """Takes a fix with its stamp: m, m, rad, and its covariance by rows."""

    def tracked(self, now_ms: int) -> dict[str, Any]:
        """Returns the pose at the time of the newest odometry: `stamp_ms` and `pose`, or `reason` if there is none."""

def answer(words: list[str]) -> str:
    """Runs a command line that prints its answer, and returns the text."""

def program(library: _Path, words: list[str]) -> int:
    """Runs a command line and returns its exit code."""
