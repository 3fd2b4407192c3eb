"""A plain NumPy implementation of the decision on a facet table: a decision on the same bytes without Posegate's core.

To first order in the yaw, with the bounds of the head of src/contain/frame.rs for the rest, in floats and without a budget for rounding:
for comparison of speed, not for use.
"""

import struct

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class FacetTable:
    """The facets of a table's bytes."""

    def __init__(self, data: bytes) -> None:
        self.goal = np.array(struct.unpack_from("<ii", data, 16)) * 1e-6
        turn = 2 * np.pi / 2**32
        self.goal_yaw = struct.unpack_from("<I", data, 24)[0] * turn
        self.radius = struct.unpack_from("<I", data, 64)[0] / 65536
        at = struct.unpack_from("<I", data, 76)[0]
        exponent, pieces, frames, _, facets, _, _, farthest = struct.unpack_from("<BBBBHHHH", data, at)
        unit = 2.0**exponent * 1e-6
        self.farthest = farthest * unit
        pieces_at, frames_at = at + 12, at + 12 + 12 * pieces
        facets_at = frames_at + 6 * frames
        self.pieces = []
        for piece in range(pieces):
            start, width, own, _, _ = struct.unpack_from("<IIBBH", data, pieces_at + 12 * piece)
            parts = []
            for _ in range(own):
                axes, count, x, y = struct.unpack_from("<BBhh", data, frames_at)
                frames_at += 6
                rows = np.frombuffer(data, "<i2", 3 * count, facets_at).reshape(count, 3).astype(float)
                facets_at += 6 * count
                parts.append((axes == 1, np.array([x, y]) * unit, rows[:, :2] / 16384, rows[:, 2] * unit))
            self.pieces.append((start * turn, width * turn, width == 2**32 - 1, parts))

    def decide_many(self, poses: Floats, covs: Floats) -> NDArray[np.bool_]:
        """Returns `True` for each pose-set that is inside one piece."""
        scaled = covs * self.radius
        minors = scaled[:, 0, 0] * scaled[:, 1, 1] - scaled[:, 0, 1] ** 2
        with np.errstate(invalid="ignore", divide="ignore"):
            is_valid = (scaled[:, 0, 0] > 0) & (minors > 0) & (np.linalg.det(scaled) > 0)
            turn = np.sqrt(scaled[:, 2, 2])
            broad = np.sqrt(scaled[:, 0, 0] + scaled[:, 1, 1])
            place = poses[:, :2] - self.goal
            c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
            inside = np.zeros(len(poses), dtype=np.bool_)
            for start, width, whole, parts in self.pieces:
                above = np.mod(poses[:, 2] - self.goal_yaw - start, 2 * np.pi)
                held = is_valid if whole else is_valid & (above - turn >= 0) & (above + turn <= width)
                for turns, (vx, vy), normals, b in parts:
                    if turns:
                        dx, dy = place[:, 0] - vx, place[:, 1] - vy
                        px, py = c * dx + s * dy, c * dy - s * dx
                        lx, ly = py, -px
                        nx = c[:, None] * normals[:, 0] - s[:, None] * normals[:, 1]
                        ny = s[:, None] * normals[:, 0] + c[:, None] * normals[:, 1]
                        lever = np.hypot(px, py) + broad
                        rest = 9 / 16 * turn**2 * self.farthest + 3 / 8 * turn**3 * lever + turn * broad
                    else:
                        ax, ay = c * vx - s * vy, s * vx + c * vy
                        px, py = place[:, 0] + ax, place[:, 1] + ay
                        lx, ly = -ay, ax
                        nx, ny = np.broadcast_to(normals.T[:, None, :], (2, len(poses), len(b)))
                        rest = turn**2 * np.hypot(vx, vy) / 2
                    nt = lx[:, None] * normals[:, 0] + ly[:, None] * normals[:, 1]
                    along = np.stack([nx, ny, nt], axis=2)
                    extent = np.sqrt(np.einsum("nfi,nij,nfj->nf", along, scaled, along))
                    slack = b - px[:, None] * normals[:, 0] - py[:, None] * normals[:, 1]
                    held = held & np.all(slack - rest[:, None] >= extent, axis=1)
                inside |= held
        return inside
