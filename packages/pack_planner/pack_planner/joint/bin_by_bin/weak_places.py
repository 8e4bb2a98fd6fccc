"""Compiled: where a box would stand badly on the placed boxes of a bin."""

from __future__ import annotations

import numpy as np

from pack_planner.engine.support import cell_rests, well_supported
from pack_planner.joint.bounds import NEVER, landings
from pack_planner.joint.compiled import compiled, entry


@compiled
def _stands_alone(  # type: ignore[no-untyped-def]
    boxes, height, owner, slack, passed_on, bearing, rule, min_vertices, corner, size, centre, sure,
    force,
):  # fmt: skip
    """Whether a box stands at ``corner`` on the placed boxes, at the highest top under it."""
    x, y, z = corner
    if z == 0:
        return True
    step, tolerance, com_margin, min_share, stability = rule
    dx, dy, _ = size
    low = z - tolerance
    resting = 0
    for vertex in range(4):
        cx = x if vertex % 2 == 0 else x + dx - step
        cy = y if vertex < 2 else y + dy - step
        i, j = cx // step, cy // step
        if height[i, j] >= low and cell_rests(boxes, owner[i, j], cx, cy, step, z, tolerance):
            resting += 1
    if resting < min_vertices:
        return False
    if max(com_margin, stability) == -np.inf and min_share <= 0.0 and len(slack) == 0:
        return True
    return well_supported(
        boxes, bearing, (x, y, x, y), size, z, rule, centre, sure, force, slack, passed_on
    )


@entry
def weak_places(  # type: ignore[no-untyped-def]
    bin_size, boxes, height, owner, slack, passed_on, bearing, rule, min_vertices, shapes, centres,
    sures, forces, stop,
):  # fmt: skip
    """Where a box on placed boxes alone breaks a rule of support: its base there, else -1.

    Int32 (shapes, cells, cells). ``bearing`` and ``rule`` as of
    :func:`pack_planner.engine.search.search_bin`; ``shapes`` as in :func:`.bounds.landings`;
    ``centres`` of mass and what is surely covered (``sures``) for each shape; ``forces``: weight of
    each box, newtons; see :mod:`.budget` for ``stop``.
    """
    step = rule[0]
    base = landings(bin_size, height, step, shapes, stop)
    for s in range(len(shapes)):
        which, _, dx, dy, dz = shapes[s]
        for i in range(base.shape[1]):
            if stop[0]:
                return base
            for j in range(base.shape[2]):
                z = np.int64(base[s, i, j])
                base[s, i, j] = -1
                if z == 0 or z >= NEVER:
                    continue
                x, y = i * step, j * step
                if not _stands_alone(
                    boxes, height, owner, slack, passed_on, bearing, rule, min_vertices, (x, y, z),
                    (dx, dy, dz), centres[s], sures[s], forces[which],
                ):  # fmt: skip
                    base[s, i, j] = z
    return base
