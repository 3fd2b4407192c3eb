"""Is a robot localized well enough for this task?

`Table` decides on estimates with the code that runs on the motion controller, `Gate` and `Tracker` are those of the controller, `Site` reads site files and
builds proven tables. The functions are the commands of the program `posegate`.
Lengths are in metres, angles in radians, poses are (x, y, yaw) in the world frame.
"""

import copyreg
from typing import Any

from ._calls import Drawing, cover, draw, learn_bounds, learn_inflation, metrics, place, plan, replay
from ._core import REASONS, Bounded, Evidence, Gate, GateStep, PosegateError, Site, Table, Tracker, Verdict, __version__

__all__ = [
    "REASONS",
    "Bounded",
    "Drawing",
    "Evidence",
    "Gate",
    "GateStep",
    "PosegateError",
    "Site",
    "Table",
    "Tracker",
    "Verdict",
    "__version__",
    "cover",
    "draw",
    "learn_bounds",
    "learn_inflation",
    "metrics",
    "place",
    "plan",
    "replay",
]


def _pickled_site(site: Site) -> tuple[Any, ...]:
    return (Site.open, (str(site.path),)) if site.text is None else (Site.parse, (site.text,))


def _pickled_table(table: Table) -> tuple[Any, ...]:
    return Table, (bytes(table),)


def _pickled_bound(bound: Bounded) -> tuple[Any, ...]:
    return Bounded, (bound.translation, bound.yaw)


def _pickled_verdict(verdict: Verdict) -> tuple[Any, ...]:
    return Verdict, (verdict.permit, verdict.reason, verdict.margin, verdict.worst_pose)


# A gate has a state that must not be copied, so it is not pickled.
copyreg.pickle(Bounded, _pickled_bound)
copyreg.pickle(Site, _pickled_site)
copyreg.pickle(Table, _pickled_table)
copyreg.pickle(Verdict, _pickled_verdict)
