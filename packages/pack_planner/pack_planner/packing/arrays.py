"""Placements as arrays, for those who go on to compute with them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.orientation import ORIENTATIONS
from pack_msgs_py.values import Bin, PlacedBox


class PlacementArrays(NamedTuple):
    """Placements, one a row, in the bin frame: origin front left bottom, x length, z up.

    Attributes
    ----------
    ids : str (n,), the boxes.
    bins : int64 (n,), serial numbers of the bins, from 1 in the order of opening.
    corners : int64 (n, 3), planned corner nearest the origin, millimetres.
    sizes : int64 (n, 3), planned size along the bin's axes, millimetres.
    turns : int64 (n,), indices into :data:`pack_msgs_py.orientation.ORIENTATIONS`.
    volumes : float64 (n,), true volume, cubic millimetres.
    """

    ids: NDArray[np.str_]
    bins: NDArray[np.int64]
    corners: NDArray[np.int64]
    sizes: NDArray[np.int64]
    turns: NDArray[np.int64]
    volumes: NDArray[np.float64]


def placement_arrays(placements: Iterable[tuple[PlacedBox, Bin]]) -> PlacementArrays:
    """Placed boxes with their bins as arrays, in the given order."""
    rows = list(placements)
    boxes = [placed for placed, _ in rows]
    return PlacementArrays(
        ids=np.array([placed.box.id for placed in boxes], np.str_),
        bins=np.array([target.serial for _, target in rows], np.int64),
        corners=np.array([placed.corner_mm for placed in boxes], np.int64).reshape(-1, 3),
        sizes=np.array([placed.size_mm for placed in boxes], np.int64).reshape(-1, 3),
        turns=np.array([ORIENTATIONS.index(placed.orientation) for placed in boxes], np.int64),
        volumes=np.array([placed.box.volume_mm3 for placed in boxes], np.float64),
    )
