"""What the checks of the Python module share: results as JSON lines, random pose-sets, the program as a process."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

import posegate

ROOT = Path(__file__).resolve().parents[3]
Floats = NDArray[np.float64]

beyond: list[str] = []


def figure(name: str, value: float, unit: str, goal: Optional[float] = None, at_least: bool = True) -> None:
    """Prints a figure; notes it if it is beyond its goal."""
    print(json.dumps({"name": name, "value": value, "unit": unit, "goal": goal}), flush=True)
    if goal is not None and not (value >= goal if at_least else value <= goal):
        beyond.append(name)


def end() -> None:
    """Ends the process; its exit code is 1 if a figure is beyond its goal."""
    if beyond:
        sys.exit("beyond a goal: " + "; ".join(beyond))


def require(holds: bool, what: object) -> None:
    """Ends the process with a message unless the condition holds."""
    if not holds:
        sys.exit(f"failed: {what}")


def program(*words: str) -> "subprocess.CompletedProcess[str]":
    """Runs the program of the wheel."""
    path = Path(sys.executable).parent / "posegate"
    return subprocess.run([str(path), *words], capture_output=True, text=True, cwd=ROOT, check=False)


def answers(*words: str) -> list[dict[str, Any]]:
    """Returns the lines of JSON of a command whose answer may be no."""
    ended = program(*words)
    require(ended.returncode in (0, 1), f"{words}: {ended.returncode}: {ended.stderr}")
    return [json.loads(line) for line in ended.stdout.splitlines()]


def tables() -> list[Path]:
    """Returns the committed tables."""
    found = sorted([*ROOT.glob("examples/tables/*.posegate"), *ROOT.glob("tests/data/*.posegate")])
    require(len(found) >= 10, found)
    return found


def pose_sets(count: int, seed: int, width: float = 1.0) -> tuple[Floats, Floats]:
    """Returns random poses about the origin and covariances, of which some are not valid."""
    random = np.random.default_rng(seed)
    poses = random.uniform(-1.0, 1.0, (count, 3)) * [width, width, 0.4 * width]
    factors = random.normal(size=(count, 3, 3)) * [[0.02], [0.02], [0.01]]
    factors *= random.uniform(0.05, 2.0, (count, 1, 1))
    covs = factors @ factors.transpose(0, 2, 1)
    covs = (covs + covs.transpose(0, 2, 1)) / 2
    for bad, (row, value) in enumerate([(0, np.nan), (1, np.inf), (2, -1.0), (0, 0.0)]):
        covs[bad::997, row, row] = value
    poses[5::991, 0] = np.nan
    poses[7::983, 1] = 3000.0
    covs[11::977] = 0.0
    covs[13::971, 0, 1] += 1e-3
    return poses, covs


def open_table(path: Path) -> posegate.Table:
    """Opens a table."""
    return posegate.Table.open(path)
