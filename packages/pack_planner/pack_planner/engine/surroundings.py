"""What lies around and under placements: free space, volume below, neighbouring heights."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pack_planner.engine.height_map import BinModel
from pack_planner.engine.placements import Spots

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def gaps(spots: Spots, model: BinModel) -> Ints:
    """Room beside each placement, int64 (n, 4), millimetres: towards -x, +x, -y, +y.

    From the box to the nearest box that stands higher than its base, or to the wall.
    """
    distances: Ints = _gaps(
        model.source.spec.size_mm, model.columns, model.rows, model.height,
        spots.corners, spots.sizes,
    )  # fmt: skip
    return distances


def lost_volume(spots: Spots, model: BinModel) -> Floats:
    """Volume between each box's base and the height map below it, cubic millimetres, (n,)."""
    volumes: Floats = _lost_volume(
        model.columns, model.rows, model.height, spots.corners, spots.sizes
    )
    return volumes


def border(spots: Spots, model: BinModel) -> Floats:
    """The height map right beside each placement, float64 (n, 3), in cells of 1 cm.

    Sum of |height - top of the box| in centimetres over the bordering cells, number of these cells
    that are higher than its top, and number that are level with it. Walls have no cells.
    """
    neighbours: Floats = _border(
        model.source.spec.size_mm, model.columns, model.rows, model.height,
        spots.corners, spots.sizes,
    )  # fmt: skip
    return neighbours


@njit(cache=True, nogil=True)
def _gaps(bin_size, columns, rows, height, corners, sizes):  # type: ignore[no-untyped-def]
    distances = np.empty((len(corners), 4), np.int64)
    for index in range(len(corners)):
        x, y, z = corners[index]
        far_x, far_y = x + sizes[index, 0], y + sizes[index, 1]
        low_x, high_x, low_y, high_y = 0, bin_size[0], 0, bin_size[1]
        for i in range(len(columns) - 1):
            beside_x = columns[i] < far_x and columns[i + 1] > x
            for j in range(len(rows) - 1):
                if height[i, j] <= z:
                    continue
                if rows[j] < far_y and rows[j + 1] > y:
                    if columns[i + 1] <= x:
                        low_x = max(low_x, columns[i + 1])
                    elif columns[i] >= far_x:
                        high_x = min(high_x, columns[i])
                if beside_x:
                    if rows[j + 1] <= y:
                        low_y = max(low_y, rows[j + 1])
                    elif rows[j] >= far_y:
                        high_y = min(high_y, rows[j])
        distances[index, 0], distances[index, 1] = x - low_x, high_x - far_x
        distances[index, 2], distances[index, 3] = y - low_y, high_y - far_y
    return distances


@njit(cache=True, nogil=True)
def _lost_volume(columns, rows, height, corners, sizes):  # type: ignore[no-untyped-def]
    volumes = np.zeros(len(corners))
    for index in range(len(corners)):
        x, y, z = corners[index]
        far_x, far_y = x + sizes[index, 0], y + sizes[index, 1]
        for i in range(len(columns) - 1):
            wide = min(columns[i + 1], far_x) - max(columns[i], x)
            if wide <= 0:
                continue
            for j in range(len(rows) - 1):
                deep = min(rows[j + 1], far_y) - max(rows[j], y)
                if deep > 0:
                    volumes[index] += float(wide * deep) * (z - height[i, j])
    return volumes


@njit(cache=True, nogil=True)
def _border(bin_size, columns, rows, height, corners, sizes):  # type: ignore[no-untyped-def]
    neighbours = np.zeros((len(corners), 3))
    for index in range(len(corners)):
        x, y, z = corners[index]
        far_x, far_y = x + sizes[index, 0], y + sizes[index, 1]
        top = z + sizes[index, 2]
        for i in range(len(columns) - 1):
            wide = min(columns[i + 1], far_x) - max(columns[i], x)
            left = columns[i] <= x - 1 < columns[i + 1]
            right = far_x < bin_size[0] and columns[i] <= far_x < columns[i + 1]
            for j in range(len(rows) - 1):
                deep = min(rows[j + 1], far_y) - max(rows[j], y)
                front = rows[j] <= y - 1 < rows[j + 1]
                back = far_y < bin_size[1] and rows[j] <= far_y < rows[j + 1]
                cells = 0.0
                if deep > 0:
                    cells += deep / 10.0 * (int(left) + int(right))
                if wide > 0:
                    cells += wide / 10.0 * (int(front) + int(back))
                if cells > 0:
                    rise = height[i, j] - top
                    neighbours[index, 0] += cells * abs(rise) / 10.0
                    neighbours[index, 1] += cells * int(rise > 0)
                    neighbours[index, 2] += cells * int(rise == 0)
    return neighbours
