"""Compiled search for the placements that waste least, of several boxes in one bin.

It goes through the positions of :func:`pack_planner.engine.placements.all_spots`. Resting corners
are counted before anything is weighed, the other rules are looked at last, and the surroundings
only where they could make a position one of the best.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pack_planner.engine.placements import _with_far_ends
from pack_planner.engine.search import _spans, _zone_lines, candidate_lines, in_zone
from pack_planner.engine.support import resting_vertices, well_supported
from pack_planner.engine.waste import (
    ABOVE,
    BESIDE,
    LEVEL,
    SHUT_OFF,
    SLENDER,
    SNUG,
    SPREAD,
    TALL,
    TOUCHED,
    shut_off,
    steps_between,
    waste_below,
    waste_beside,
)


@njit(cache=True, nogil=True)
def least_waste(  # type: ignore[no-untyped-def]
    bin_size, boxes, columns, rows, height, owner, lines_x, lines_y, slack, passed_on, bearing,
    rule, min_vertices, which, sizes, turns, centres, sures, starts, forces, zones, zone_starts,
    radius, far_ends, weights, unusable_above, unusable_beside, count,
):  # fmt: skip
    """The ``count`` placements of least waste of each box, best first.

    Parameters
    ----------
    bin_size to min_vertices : as of :func:`pack_planner.engine.search.search_bin`.
    which : numbers of the boxes that are looked at.
    sizes, turns, centres, sures : of every orientation of all boxes, box after box.
    starts, forces : where the orientations of each box begin in these, and its weight, newtons.
    zones, zone_starts, radius : refused positions (orientation, x, y, z) of the boxes of ``which``.
    far_ends : whether also the far ends of the candidate lines are looked at.
    weights, unusable_above, unusable_beside : see :mod:`pack_planner.engine.waste`.
    count : how many placements of each box are wanted.

    Returns
    -------
    found : int64 (len(which), count, 4), x, y, z and the row in ``sizes``; that is -1 where there
        are no more.
    wastes : float64 (len(which), count), what each wastes.
    """
    step, tolerance, com_margin, min_share, stability = rule
    varies = max(com_margin, stability) > -np.inf or min_share > 0.0 or len(slack) > 0
    found = np.full((len(which), count, 4), -1, np.int64)
    wastes = np.full((len(which), count), np.inf)
    left_steps, right_steps, front_steps, back_steps = steps_between(columns, rows, height)
    highest = np.empty(len(rows), height.dtype)
    length, breadth, limit = bin_size
    rewards = max(weights[LEVEL], 0.0) + max(weights[SNUG], 0.0)
    # no room beside or above a box can be gained that is worth more than this
    most_beside = weights[BESIDE] * unusable_beside.max()
    most_above = weights[ABOVE] * unusable_above.max()
    for number in range(len(which)):
        box = which[number]
        refused = zones[zone_starts[number] : zone_starts[number + 1]]
        best, places = wastes[number], found[number]
        for k in range(starts[box], starts[box + 1]):
            dx, dy, dz = sizes[k, 0], sizes[k, 1], sizes[k, 2]
            if dx > length or dy > breadth or dz > limit:
                continue
            turn = turns[k]
            around, volume = 2.0 * (dx + dy), float(dx * dy) * dz
            limit_x, limit_y = (length - dx) // step * step, (breadth - dy) // step * step
            xs = candidate_lines(
                lines_x, dx, step, limit_x, _zone_lines(refused, turn, 0, radius, step)
            )
            ys = candidate_lines(
                lines_y, dy, step, limit_y, _zone_lines(refused, turn, 1, radius, step)
            )
            if far_ends:
                xs = _with_far_ends(xs, step, limit_x)
                ys = _with_far_ends(ys, step, limit_y)
            span_x, span_y = _spans(xs, dx, step, columns), _spans(ys, dy, step, rows)
            shape = weights[SLENDER] * dz / min(dx, dy)
            # what the rest of the waste is at least, and what each millimetre of contact may gain
            least = shape - rewards - most_beside * (1.0 / dx + 1.0 / dy) - most_above / dz
            least += min(weights[TALL], 0.0)
            reward = max(weights[TOUCHED], 0.0) / around
            for i in range(len(xs)):
                x = xs[i]
                left, right, end_x = span_x[i, 0], span_x[i, 1], span_x[i, 2]
                left_most = left_steps[left, -1] if columns[left] == x else 0.0
                right_most = right_steps[end_x, -1] if columns[end_x] == x + dx else 0.0
                touching_x = min(left_most, dy) + min(right_most, dy)
                waste_x = min(weights[SPREAD], 0.0) + max(weights[SPREAD], 0.0) * x / (
                    length + breadth
                )
                if waste_x + least - reward * (touching_x + 2.0 * dx) >= best[count - 1]:
                    continue
                filled = False
                for j in range(len(ys)):
                    y = ys[j]
                    front, back, end_y = span_y[j, 0], span_y[j, 1], span_y[j, 2]
                    touching = 0.0
                    if left_most > 0:
                        touching += min(left_steps[left, end_y] - left_steps[left, front], dy)
                    if right_most > 0:
                        touching += min(right_steps[end_x, end_y] - right_steps[end_x, front], dy)
                    if rows[front] == y:
                        touching += min(front_steps[front, end_x] - front_steps[front, left], dx)
                    if rows[end_y] == y + dy:
                        touching += min(back_steps[end_y, end_x] - back_steps[end_y, left], dx)
                    bound = least - reward * touching
                    waste = weights[SPREAD] * (x + y) / (length + breadth)
                    if waste + bound >= best[count - 1]:
                        continue
                    if not filled:
                        highest[:] = 0
                        for column in range(left, end_x):
                            for row in range(len(rows) - 1):
                                highest[row] = max(highest[row], height[column, row])
                        filled = True
                    z = 0
                    for row in range(front, end_y):
                        z = max(z, highest[row])
                    top = z + dz
                    if top > limit:
                        continue
                    if z > 0 and min_vertices > 0:
                        # few places have the corners, and none of the others lowers the bound
                        resting = resting_vertices(
                            boxes, owner, left, right, front, back, x, y, dx, dy, step, z,
                            tolerance,
                        )  # fmt: skip
                        if resting < min_vertices:
                            continue
                    waste += weights[TALL] * top / limit
                    area, spans = (x, y, x + dx, y + dy), (left, end_x, front, end_y)
                    waste += (
                        waste_below(
                            columns,
                            rows,
                            height,
                            area,
                            spans,
                            z,
                            top,
                            limit,
                            tolerance,
                            unusable_above,
                            weights,
                        )
                        / volume
                    )
                    if weights[SHUT_OFF] > 0.0:
                        room = shut_off(columns, rows, height, area, spans, top)
                        waste += weights[SHUT_OFF] * room / volume
                    if waste + bound + most_above / dz >= best[count - 1]:
                        continue
                    waste += shape + waste_beside(
                        columns, rows, height, area, spans, z, top, unusable_beside, weights
                    )
                    if waste >= best[count - 1] or in_zone(refused, radius, turn, x, y, z):
                        continue
                    if z > 0 and varies:
                        stands = well_supported(
                            boxes, bearing, (x, y, x, y), (dx, dy, dz), z, rule, centres[k],
                            sures[k], forces[box], slack, passed_on,
                        )  # fmt: skip
                        if not stands:
                            continue
                    place = count - 1
                    while place > 0 and best[place - 1] > waste:
                        best[place] = best[place - 1]
                        places[place] = places[place - 1]
                        place -= 1
                    best[place] = waste
                    places[place, 0], places[place, 1] = x, y
                    places[place, 2], places[place, 3] = z, k
    return found, wastes
