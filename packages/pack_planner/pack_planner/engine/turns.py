"""What the compiled search reads of a box and of a profile."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pack_msgs_py.geometry.footprint import oriented_offset
from pack_msgs_py.orientation import ORIENTATIONS, allowed_orientations, oriented_size
from pack_msgs_py.profiles import Profile, planned_size
from pack_msgs_py.values import Box, Int3, Vec3

#: What a box surely covers, (x0, y0, x1, y1) relative to its planned corner, millimetres.
Sure = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class Turns:
    """The allowed orientations of one box, one a row.

    Attributes
    ----------
    sizes : int64 (n, 3), planned size along the bin's axes, millimetres.
    numbers : int64 (n,), indices into :data:`pack_msgs_py.orientation.ORIENTATIONS`.
    centres : float64 (n, 2), offset of the centre of mass from the middle along x and y.
    sures : float64 (n, 4), what the box surely covers, see :func:`sure_part`.
    """

    sizes: NDArray[np.int64]
    numbers: NDArray[np.int64]
    centres: NDArray[np.float64]
    sures: NDArray[np.float64]


@lru_cache(maxsize=512)
def turns_of(box: Box, profile: Profile) -> Turns:
    """The orientations that ``profile`` allows ``box``."""
    names = allowed_orientations(box, profile.orientations)
    planned = [planned_size(box, name, profile) for name in names]
    true = [oriented_size(box.size_mm, name) for name in names]
    sures = [
        sure_part(size, edges, profile.bearing_inset_mm)
        for size, edges in zip(planned, true, strict=True)
    ]
    return Turns(
        np.array(planned, np.int64).reshape(-1, 3),
        np.array([ORIENTATIONS.index(name) for name in names], np.int64),
        np.array(
            [oriented_offset(box.com_offset_mm, name)[:2] for name in names], np.float64
        ).reshape(-1, 2),
        np.array(sures, np.float64).reshape(-1, 4),
    )


def sure_part(planned: Int3, true: Vec3, inset_mm: float) -> Sure:
    """What a box of ``true`` size in the middle of its ``planned`` space covers for certain."""
    (x0, x1), (y0, y1) = (
        ((space - edge) / 2 + inset_mm, (space + edge) / 2 - inset_mm)
        for space, edge in zip(planned[:2], true[:2], strict=True)
    )
    return (x0, y0, x1, y1)


def support_rule(profile: Profile) -> tuple[int, int, float, float, float]:
    """Numbers of the support rules: (step, tolerance, com_margin, min_share, stability margin).

    A margin that is switched off is negative infinity.
    """
    margins = (profile.com_margin_mm, profile.stability_margin_mm)
    com_margin, stability = (-math.inf if mm is None else float(mm) for mm in margins)
    return (
        profile.resolution_mm,
        profile.support_tolerance_mm,
        com_margin,
        float(profile.min_support_share),
        stability,
    )
