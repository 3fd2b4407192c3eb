"""The types of the compiled part."""

import os
from typing import Final, Optional, Union, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: Final[str]

REASONS: Final[tuple[Optional[str], ...]]
"""The names of the reasons by their codes. Code 0 is a permit: None."""

_Path = Union[str, os.PathLike[str]]

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

    def decide(self, x: float, y: float, yaw: float, cov: ArrayLike, epsilon: Optional[float] = None) -> Verdict:
        """Decides on one estimate: m, m, rad, and its covariance by rows in m^2, m rad and rad^2."""

    def decide_many(
        self, poses: ArrayLike, covs: ArrayLike, epsilon: Optional[float] = None
    ) -> tuple[NDArray[np.bool_], NDArray[np.uint8]]:
        """Decides on many estimates: arrays of shape (n, 3) and (n, 3, 3).

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

    @property
    def tasks(self) -> list[str]:
        """The names of the tasks."""

    def contains(self, task: str, poses: ArrayLike) -> NDArray[np.bool_]:
        """Returns `True` for each pose (an array of shape (n, 3)) that is in the success set of a task."""

    def build(self, task: str) -> Table:
        """Builds the table of a task and proves it."""

def program(library: _Path, words: list[str]) -> int:
    """Runs a command line and returns its exit code."""
