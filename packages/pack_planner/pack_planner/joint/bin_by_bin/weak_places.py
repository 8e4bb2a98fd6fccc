"""Compiled: where a box would stand badly on the placed boxes of a bin."""

from __future__ import annotations

import numpy as np
from numba import njit

from pack_planner.joint.bounds import NEVER, landings
from pack_planner.joint.domains import stands_alone


@njit(cache=True, nogil=True)
def weak_places(  # type: ignore[no-untyped-def]
    bin_size, boxes, height, owner, slack, passed_on, rule, min_vertices, shapes, centres, forces
):
    """Where a box on placed boxes alone breaks a rule of support: its base there, else -1.

    Int32 (shapes, cells, cells). ``rule`` = (resolution, support tolerance, margin of the centre of
    mass, least share of support); ``shapes`` as in :func:`.bounds.landings`; ``centres`` of mass
    for each shape; ``forces``: weight of each box, newtons.
    """
    step = rule[0]
    base = landings(bin_size, height, step, shapes)
    for s in range(len(shapes)):
        which, _, dx, dy, dz = shapes[s]
        for i in range(base.shape[1]):
            for j in range(base.shape[2]):
                z = np.int64(base[s, i, j])
                base[s, i, j] = -1
                if z == 0 or z >= NEVER:
                    continue
                x, y = i * step, j * step
                if not stands_alone(
                    boxes, height, owner, slack, passed_on, rule, min_vertices, x, y, z,
                    (dx, dy, dz), centres[s], forces[which],
                ):  # fmt: skip
                    base[s, i, j] = z
    return base
