"""Is a robot localized well enough for this task?

`Table` decides on estimates with the code that runs on the motion controller, `Site` reads site files and builds proven tables.
Lengths are in metres, angles in radians, poses are (x, y, yaw) in the world frame.
"""

from ._core import REASONS, PosegateError, Site, Table, Verdict, __version__

__all__ = ["REASONS", "PosegateError", "Site", "Table", "Verdict", "__version__"]
