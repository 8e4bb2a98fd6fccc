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
        [(*placed.corner_mm, *placed.far_mm) for placed in model.source.boxes], np.int64
    ).reshape(-1, 6)
    return _inside(_extreme_points(boxes), model)


def corner_points(model: BinModel) -> Ints:
    """Corner points of the bin, int64 (n, 2), x and y in millimetres, each once.

    The bin's corner at the origin and three corners of each box: right of it, behind it and on top
    of it, all at its own x and y (the pivot points of Dube, Kanavathy: Optimizing three-dimensional
    bin packing through simulation, IASTED Modelling, Simulation and Optimization, 2006). Unlike
    extreme points they are not projected onto other boxes and walls.
    """
    points = [(0, 0)]
    for placed in model.source.boxes:
        (x0, y0, _), (x1, y1, _) = placed.corner_mm, placed.far_mm
        points += [(x1, y0), (x0, y1), (x0, y0)]
    return _inside(np.array(points, np.int64), model)


def _inside(points: Ints, model: BinModel) -> Ints:
    length, breadth, _ = model.source.spec.size_mm
    once: Ints = np.unique(points, axis=0)
    return once[(once[:, 0] < length) & (once[:, 1] < breadth)]


@njit(cache=True, nogil=True)
def _extreme_points(boxes):  # type: ignore[no-untyped-def]
    """(x, y) of six projected corners of each box onto the boxes placed before it."""
    points = np.zeros((6 * len(boxes) + 1, 2), np.int64)
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
            points[size, 0] = x
            points[size, 1] = y
            size += 1
    return points
