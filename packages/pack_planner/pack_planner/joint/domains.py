"""Where each box of a look-ahead could go in a joint solution: its entries, cheapest first.

An entry is a grid position of one box in one bin and orientation, of one of two kinds.

``ALONE``
    the box stands there on the placed boxes alone, under every rule of the profile; z is exact.
``LEANING``
    it would need other boxes of the look-ahead under it; z is the least height at which enough
    base vertices could rest. A vertex over a placed top of height h rests at z if ``z == h`` (less
    the support tolerance), or, carried by another box of the look-ahead, no lower than h plus the
    least height any of those boxes can have. So no joint solution has the box there below z, save
    where an ``ALONE`` entry says so.

Together the entries of a box cover every joint solution: a placed box can never be above it
(access from above), and its vertices rest on placed boxes, on the look-ahead, or on both.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pack_planner.engine.search import in_zone
from pack_planner.engine.support import cell_rests, well_supported

#: Columns of an entry.
BIN, X, Y, Z, DX, DY, DZ, KIND, TURN = range(9)
ALONE, LEANING = 0, 1

Entries = NDArray[np.int64]


@njit(cache=True, nogil=True)
def paint(boxes, cells_x, cells_y, step):  # type: ignore[no-untyped-def]
    """Height of the highest top over each grid cell, and the number of its box, -1 for none."""
    height = np.zeros((cells_x, cells_y), np.int32)
    owner = np.full((cells_x, cells_y), -1, np.int32)
    for number in range(len(boxes)):
        x0, y0, x1, y1, top = boxes[number]
        for i in range(x0 // step, min(cells_x, -(-x1 // step))):
            for j in range(y0 // step, min(cells_y, -(-y1 // step))):
                if top > height[i, j]:
                    height[i, j] = top
                    owner[i, j] = number
    return height, owner


@njit(cache=True, nogil=True)
def _windows(values, wide, deep):  # type: ignore[no-untyped-def]
    """Maximum of ``values`` over every window of ``wide`` x ``deep`` cells, by doubling."""
    done = 1
    highest = values
    while done < wide:
        shift = min(done, wide - done)
        highest = np.maximum(highest[: len(highest) - shift], highest[shift:])
        done += shift
    done = 1
    while done < deep:
        shift = min(done, deep - done)
        highest = np.maximum(highest[:, : highest.shape[1] - shift], highest[:, shift:])
        done += shift
    return highest


@njit(cache=True, nogil=True)
def _least_leaning(corners, z, tolerance, filler, min_vertices, above):  # type: ignore[no-untyped-def]
    """Least height from ``z`` at which ``min_vertices`` corners could rest; -1 if there is none.

    ``filler`` is the least height of another box of the look-ahead; ``above`` asks for more than z.
    """
    least = -1
    for trial in range(6):
        if trial == 4:
            height = z
        elif trial == 5:
            height = z + 1
        else:
            height = corners[trial] + filler
        if height < z or (above and height == z) or (least >= 0 and height >= least):
            continue
        resting = 0
        for corner in range(4):
            if corners[corner] >= height - tolerance or corners[corner] + filler <= height:
                resting += 1
        if resting >= min_vertices:
            least = height
    return least


@njit(cache=True, nogil=True)
def find_entries(  # type: ignore[no-untyped-def]
    number, bin_size, boxes, height, owner, slack, passed_on, rule, min_vertices, sizes, turns,
    centres, force, zones, radius, weights, filler, cap, least_only, lines_x, lines_y,
):  # fmt: skip
    """Entries of one box in the bin at ``number`` that cost at most ``cap``, and their costs.

    Parameters
    ----------
    height, owner : see :func:`paint`.
    filler : least height of the other boxes of the look-ahead; negative if there are none.
    least_only : only the cheapest is wanted; the others are left out.
    lines_x, lines_y : bool (orientations, cells), the grid lines that count.
    others : as in :func:`pack_planner.engine.search.search_bin`.
    """
    step, tolerance, com_margin, min_share = rule
    varies = com_margin > -np.inf or min_share > 0.0 or len(slack) > 0
    entries = np.empty((64, 9), np.int64)
    costs = np.empty(64)
    count = 0
    corners = np.empty(4, np.int64)
    for k in range(len(sizes)):
        dx, dy, dz = sizes[k]
        wide, deep = dx // step, dy // step
        if wide > height.shape[0] or deep > height.shape[1] or dz > bin_size[2]:
            continue
        top = _windows(height, wide, deep)
        for i in range(top.shape[0]):
            x = i * step
            if weights[0] * x + weights[1] * dz + weights[2] > cap:
                break
            if not lines_x[k, i]:
                continue
            for j in range(top.shape[1]):
                y = j * step
                base = weights[0] * (x + y) + weights[1] * dz + weights[2]
                if base > cap:
                    break
                z = np.int64(top[i, j])
                cost = base + weights[1] * z
                if cost > cap or z + dz > bin_size[2] or not lines_y[k, j]:
                    continue
                far_i, far_j = i + wide - 1, j + deep - 1
                corners[0], corners[1] = height[i, j], height[far_i, j]
                corners[2], corners[3] = height[i, far_j], height[far_i, far_j]
                alone = z == 0
                if not alone:
                    far_x, far_y = x + dx - step, y + dy - step
                    low = z - tolerance
                    resting = 0
                    for corner in range(4):
                        resting += int(corners[corner] >= low)
                    if resting >= min_vertices:
                        resting = (
                            int(cell_rests(boxes, owner[i, j], x, y, step, z, tolerance))
                            + int(cell_rests(boxes, owner[far_i, j], far_x, y, step, z, tolerance))
                            + int(cell_rests(boxes, owner[i, far_j], x, far_y, step, z, tolerance))
                            + int(
                                cell_rests(
                                    boxes, owner[far_i, far_j], far_x, far_y, step, z, tolerance
                                )
                            )
                        )
                    alone = resting >= min_vertices and (
                        not varies
                        or well_supported(
                            boxes, (x, y, x, y), (dx, dy, dz), z, tolerance, centres[k],
                            com_margin, min_share, force, slack, passed_on,
                        )
                    )  # fmt: skip
                for kind in range(2):
                    if kind == ALONE:
                        if not alone or in_zone(zones, radius, turns[k], x, y, z):
                            continue
                    else:
                        if filler < 0:
                            continue
                        z = _least_leaning(corners, z, tolerance, filler, min_vertices, alone)
                        cost = base + weights[1] * z
                        if z < 0 or z + dz > bin_size[2] or cost > cap:
                            continue
                    if least_only:
                        cap = cost
                        count = 0
                    if count == len(costs):
                        entries = np.concatenate((entries, np.empty_like(entries)))
                        costs = np.concatenate((costs, np.empty_like(costs)))
                    costs[count] = cost
                    entry = entries[count]
                    entry[0], entry[1], entry[2], entry[3] = number, x, y, z
                    entry[4], entry[5], entry[6] = dx, dy, dz
                    entry[7], entry[8] = kind, turns[k]
                    count += 1
    return entries[:count], costs[:count]
