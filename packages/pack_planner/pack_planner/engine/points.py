"""Points of a partly filled bin where heuristics try the corner of the next box."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pack_planner.engine.height_map import BinModel

Ints = NDArray[np.int64]


def extreme_points(model: BinModel) -> Ints:
    """Extreme points of the bin, int64 (n, 2), x and y in millimetres, each once.

    Each box sends three of its corners along two axes each, until they meet a box or a wall
    (Crainic, Perboli, Tadei: Extreme point-based heuristics for three-dimensional bin packing,
    INFORMS Journal on Computing 20(3), 2008, section 3). Boxes come from above, so a box whose
    corner is put over a point sinks to where it rests, and the heights of the points do not
    matter.
    """
    boxes = np.array(
        [(*one.corner_mm, *one.far_mm) for one in model.source.boxes], np.int64
    ).reshape(-1, 6)
    length, breadth, _ = model.source.spec.size_mm
    points: Ints = np.unique(_extreme_points(boxes), axis=0)
    inside = (points[:, 0] < length) & (points[:, 1] < breadth)
    return points[inside]


def corner_points(model: BinModel) -> Ints:
    """Corner points of the bin, int64 (n, 2), x and y in millimetres.

    Corners of the staircase that the boxes form (Martello, Pisinger, Vigo: The three-dimensional
    bin packing problem, Operations Research 48(2), 2000, section 4): where the height map has a
    higher neighbour or a wall both towards the origin's x wall and towards its y wall.
    """
    height = np.pad(model.height, ((1, 0), (1, 0)), constant_values=np.iinfo(np.int32).max)
    here = height[1:, 1:]
    columns, rows = np.nonzero((height[:-1, 1:] > here) & (height[1:, :-1] > here))
    return np.stack((model.columns[columns], model.rows[rows]), axis=1)


@njit(cache=True, nogil=True)
def _extreme_points(boxes):  # type: ignore[no-untyped-def]
    """(x, y) of six projected corners of each box onto the boxes placed before it."""
    found = np.zeros((6 * len(boxes) + 1, 2), np.int64)
    size = 1
    for k in range(len(boxes)):
        x0, y0, z0, x1, y1, z1 = boxes[k]
        # (x1, y0, z0) along y and z, (x0, y1, z0) along x and z, (x0, y0, z1) along x and y
        right_y, back_x, top_x, top_y = 0, 0, 0, 0
        for i in range(k):
            bx0, by0, bz0, bx1, by1, bz1 = boxes[i]
            if by1 <= y0:
                if bx0 <= x1 < bx1 and bz0 <= z0 < bz1:
                    right_y = max(right_y, by1)
                if bx0 <= x0 < bx1 and bz0 <= z1 < bz1:
                    top_y = max(top_y, by1)
            if bx1 <= x0:
                if by0 <= y1 < by1 and bz0 <= z0 < bz1:
                    back_x = max(back_x, bx1)
                if by0 <= y0 < by1 and bz0 <= z1 < bz1:
                    top_x = max(top_x, bx1)
        for x, y in ((x1, right_y), (x1, y0), (back_x, y1), (x0, y1), (top_x, y0), (x0, top_y)):
            found[size, 0] = x
            found[size, 1] = y
            size += 1
    return found
