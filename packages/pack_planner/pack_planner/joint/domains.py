"""Where each box of a look-ahead could go in a joint solution: its entries.

An entry is a grid position and height of one box in one bin and orientation, of one of two kinds.

``ALONE``
    the box stands there on the placed boxes alone, under every rule of the profile.
``LEANING``
    it needs other boxes of the look-ahead under it: enough of its base vertices lie over a placed
    top at its height or over an entry of another box whose top is there.

Heights are taken in increasing order, and a top lies above its base, so each top is known before
something may lean on it. Which entries can be had together, and whether a leaning box is well
supported then, is left to the search; but every joint solution is made of entries.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pack_planner.engine.support import cell_rests, well_supported
from pack_planner.joint.bounds import windows

#: Columns of an entry.
BIN, X, Y, Z, DX, DY, DZ, KIND, TURN, BOX = range(10)
ALONE, LEANING = 0, 1

#: Columns of a shape: box, orientation number, planned size.
_BOX, _TURN, _DX, _DY, _DZ = range(5)

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
def stands_alone(  # type: ignore[no-untyped-def]
    boxes, height, owner, slack, passed_on, rule, min_vertices, x, y, z, size, centre, force
):
    """Whether a box stands at (x, y, z) on the placed boxes; z is the highest top under it."""
    if z == 0:
        return True
    step, tolerance, com_margin, min_share = rule
    dx, dy, _ = size
    low = z - tolerance
    resting = 0
    for corner in range(4):
        cx = x if corner % 2 == 0 else x + dx - step
        cy = y if corner < 2 else y + dy - step
        i, j = cx // step, cy // step
        if height[i, j] >= low and cell_rests(boxes, owner[i, j], cx, cy, step, z, tolerance):
            resting += 1
    if resting < min_vertices:
        return False
    if com_margin == -np.inf and min_share <= 0.0 and len(slack) == 0:
        return True
    return well_supported(
        boxes, (x, y, x, y), size, z, tolerance, centre, com_margin, min_share,
        force, slack, passed_on,
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _append(entries, costs, count, number, x, y, z, shape, kind, cost):  # type: ignore[no-untyped-def]
    if count == len(costs):
        entries = np.concatenate((entries, np.empty_like(entries)))
        costs = np.concatenate((costs, np.empty_like(costs)))
    row = entries[count]
    row[0], row[1], row[2], row[3] = number, x, y, z
    row[4], row[5], row[6] = shape[2], shape[3], shape[4]
    row[7], row[8], row[9] = kind, shape[1], shape[0]
    costs[count] = cost
    return entries, costs


@njit(cache=True, nogil=True)
def alone_entries(  # type: ignore[no-untyped-def]
    number, bin_size, boxes, height, owner, slack, passed_on, rule, min_vertices,
    shapes, centres, forces, zones, radius, weights, caps,
):  # fmt: skip
    """``ALONE`` entries of all boxes in the bin at ``number``, and what the leaning ones need.

    Parameters
    ----------
    height, owner : see :func:`paint`.
    shapes, centres : (box, orientation number, dx, dy, dz) and centre of mass of each orientation
        of each box that may go into this bin.
    forces : weight of each box, newtons.
    zones : refused positions (box, orientation, x, y, z).
    weights : (w1, w2, value of the bin's index), per millimetre.
    caps : per box, the highest cost that matters.
    others : as in :func:`pack_planner.engine.search.search_bin`.

    Returns
    -------
    entries, costs, landing, stands : landing (shapes, cells, cells) is the highest top under each
        position, stands tells the positions of the entries.
    """
    step = rule[0]
    entries = np.empty((64, 10), np.int64)
    costs = np.empty(64)
    count = 0
    landing = np.zeros((len(shapes), height.shape[0], height.shape[1]), np.int32)
    stands = np.zeros((len(shapes), height.shape[0], height.shape[1]), np.bool_)
    for s in range(len(shapes)):
        shape = shapes[s]
        which, turn, dx, dy, dz = shape
        cap = caps[which]
        wide, deep = dx // step, dy // step
        if wide > height.shape[0] or deep > height.shape[1] or dz > bin_size[2]:
            continue
        top = windows(height, wide, deep)
        landing[s, : top.shape[0], : top.shape[1]] = top
        for i in range(top.shape[0]):
            x = i * step
            if weights[0] * x + weights[1] * dz + weights[2] > cap:
                break
            for j in range(top.shape[1]):
                y = j * step
                base = weights[0] * (x + y) + weights[1] * dz + weights[2]
                if base > cap:
                    break
                z = np.int64(top[i, j])
                cost = base + weights[1] * z
                if cost > cap or z + dz > bin_size[2]:
                    continue
                if not stands_alone(
                    boxes, height, owner, slack, passed_on, rule, min_vertices, x, y, z,
                    (dx, dy, dz), centres[s], forces[which],
                ):  # fmt: skip
                    continue
                stands[s, i, j] = True
                if refused(zones, radius, which, turn, x, y, z):
                    continue
                entries, costs = _append(entries, costs, count, number, x, y, z, shape, ALONE, cost)
                count += 1
    return entries[:count], costs[:count], landing, stands


@njit(cache=True, nogil=True)
def refused(zones, radius, box, turn, x, y, z):  # type: ignore[no-untyped-def]
    """Whether (x, y, z) lies within ``radius`` of a refused position of this box and turn."""
    for k in range(len(zones)):
        zone = zones[k]
        if (
            zone[0] == box
            and zone[1] == turn
            and zone[4] == z
            and abs(x - zone[2]) < radius
            and abs(y - zone[3]) < radius
        ):
            return True
    return False


@njit(cache=True, nogil=True)
def _paint_tops(entries, chosen, masks, step, area):  # type: ignore[no-untyped-def]
    """Mark in ``masks`` (boxes, cells, cells) what the tops of the ``chosen`` entries cover.

    ``area`` = (i0, j0, i1, j1) bounds it; only there is ``masks`` written.
    """
    i0, j0, i1, j1 = area
    masks[:, i0 : i1 + 1, j0 : j1 + 1] = 0
    for index in chosen:
        row = entries[index]
        a, b = row[1] // step, row[2] // step
        c, d = a + row[4] // step, b + row[5] // step
        own = masks[row[9]]
        own[a, b] += 1
        own[c, b] -= 1
        own[a, d] -= 1
        own[c, d] += 1
    for k in range(len(masks)):
        own = masks[k]
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                value = own[i, j]
                if i > i0:
                    value += own[i - 1, j]
                if j > j0:
                    value += own[i, j - 1]
                if i > i0 and j > j0:
                    value -= own[i - 1, j - 1]
                own[i, j] = value


@njit(cache=True, nogil=True)
def leaning_entries(  # type: ignore[no-untyped-def]
    number, bin_size, height, rule, min_vertices, shapes, zones, radius, weights, caps,
    low, entries, costs, landing, stands, box_count, most,
):  # fmt: skip
    """``entries`` and ``costs`` with the ``LEANING`` ones added, and whether that is all of them.

    At most about ``most`` are made, none below ``low`` (see :class:`.bounds.Reach`). Arguments as
    for, and from, :func:`alone_entries`.
    """
    step, tolerance = rule[0], rule[1]
    limit = bin_size[2]
    count = len(costs)
    head = np.full(limit + 1, -1, np.int64)
    following = np.empty(max(count, 64), np.int64)
    for index in range(count):
        top = entries[index, 3] + entries[index, 6]
        following[index] = head[top]
        head[top] = index
    placed_top = np.zeros(limit + 1, np.bool_)
    if tolerance > 0:
        for value in height.ravel():
            placed_top[value] = True
    masks = np.zeros((box_count, height.shape[0] + 1, height.shape[1] + 1), np.int32)
    chosen = np.empty(64, np.int64)
    for z in range(1, limit):
        if head[z] < 0 and not placed_top[z]:
            continue
        found = 0
        i0, j0, i1, j1 = height.shape[0], height.shape[1], 0, 0
        for top in range(max(1, z - tolerance), z + 1):
            index = head[top]
            while index >= 0:
                if found == len(chosen):
                    chosen = np.concatenate((chosen, np.empty_like(chosen)))
                chosen[found] = index
                found += 1
                row = entries[index]
                i0, j0 = min(i0, row[1] // step), min(j0, row[2] // step)
                i1 = max(i1, (row[1] + row[4]) // step)
                j1 = max(j1, (row[2] + row[5]) // step)
                index = following[index]
        if found == 0:
            continue
        _paint_tops(entries, chosen[:found], masks, step, (i0, j0, i1, j1))
        for s in range(len(shapes)):
            which, turn, dx, dy, dz = shapes[s]
            cap = caps[which]
            if z + dz > limit:
                continue
            wide, deep = dx // step, dy // step
            last_i, last_j = height.shape[0] - wide, height.shape[1] - deep
            least = weights[1] * (z + dz) + weights[2]
            for i in range(max(0, i0 - wide + 1), min(i1, last_i + 1)):
                x = i * step
                if least + weights[0] * x > cap:
                    break
                for j in range(max(0, j0 - deep + 1), min(j1, last_j + 1)):
                    y = j * step
                    cost = least + weights[0] * (x + y)
                    if cost > cap:
                        break
                    if low[s, i, j] > z:
                        continue
                    resting = 0
                    for corner in range(4):
                        a = i if corner % 2 == 0 else i + wide - 1
                        b = j if corner < 2 else j + deep - 1
                        if z - tolerance <= height[a, b]:
                            resting += 1
                        elif i0 <= a < i1 and j0 <= b < j1:
                            for k in range(box_count):
                                if k != which and masks[k, a, b] > 0:
                                    resting += 1
                                    break
                    if resting < min_vertices or (landing[s, i, j] == z and stands[s, i, j]):
                        continue
                    if refused(zones, radius, which, turn, x, y, z):
                        continue
                    entries, costs = _append(
                        entries, costs, count, number, x, y, z, shapes[s], LEANING, cost
                    )
                    if count == len(following):
                        following = np.concatenate((following, np.empty_like(following)))
                    following[count] = head[z + dz]
                    head[z + dz] = count
                    count += 1
            if count > most:
                return entries[:count], costs[:count], False
    return entries[:count], costs[:count], True
