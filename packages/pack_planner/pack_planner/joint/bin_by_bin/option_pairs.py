"""Compiled: what two options in one bin must pay to stand clear of each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pack_planner.joint.bin_by_bin.group_problem import Cells, Flags, Floats, Ints
from pack_planner.joint.bin_by_bin.places import FAR
from pack_planner.joint.bounds import NEVER
from pack_planner.joint.compiled import compiled, entry


def suffix_least(profile: Cells) -> NDArray[np.int32]:
    """The least of a + profile[a] from each cell a on, per row; one more column, ``NEVER``."""
    cells = np.arange(profile.shape[1], dtype=np.int32)
    places = np.where(profile < FAR, cells + profile, np.int32(NEVER))
    least = np.full((len(profile), profile.shape[1] + 1), NEVER, np.int32)
    least[:, :-1] = np.minimum.accumulate(places[:, ::-1], axis=1)[:, ::-1]
    return least


def pair_costs(
    rows: Ints, by_x: Cells, by_y: Cells, sizes: Ints, span: Ints, box: Ints, cost: Floats,
    flat: Floats, w1: float, limits: Floats, at: Ints, extra: Floats, behind: Floats, stop: Flags,
) -> None:  # fmt: skip
    """What two options in one bin must pay on top of their least costs.

    Parameters
    ----------
    rows : the turns of each option, numbers of rows, (options, 2).
    by_x, by_y : least y at each x, least x at each y of the places of each row.
    sizes : of each row along x and y, cells.
    span : base and top of each option.
    box, cost, flat : of each option: its box, its least cost, what of it is not w1 (x + y).
    limits : for two boxes, the most that both may cost together; infinite stands for more.
    at : numbers of the options in what follows.
    extra : becomes what both pay together.
    behind : becomes what the one pays when it goes behind the other, [behind, in front].
    stop : what is not looked at once this is raised pays nothing, see :mod:`.budget`.
    """
    if stop[0]:
        return
    # for rows that some option still has; row numbers are of these then
    used, numbers = np.unique(rows, return_inverse=True)
    profiles = by_x[used], by_y[used]
    after = []
    for profile in profiles:
        if stop[0]:
            return
        after.append(suffix_least(profile))
    first = (profiles[0] < FAR).argmax(axis=1), (profiles[1] < FAR).argmax(axis=1)
    _pair_costs(
        numbers.reshape(rows.shape), *profiles, *after, first, sizes[used], span, box, cost, flat,
        w1, limits, at, extra, behind, stop,
    )  # fmt: skip


@compiled
def _beside(first, after, wide, best):  # type: ignore[no-untyped-def]
    """The least x + y of two rows in sum, less than ``best``, the second ``wide`` cells on."""
    for a in range(len(first)):
        if a >= best:
            break
        if first[a] < FAR and a + wide < len(after):
            best = min(best, a + first[a] + after[a + wide])
    return best


@entry
def _pair_costs(  # type: ignore[no-untyped-def]
    rows, by_x, by_y, after_x, after_y, first, sizes, span, box, cost, flat, w1, limits, at, extra,
    behind, stop,
):  # fmt: skip
    """See :func:`pair_costs`; ``first`` is the first cell of each row along x, and along y."""
    count = len(rows)
    for i in range(count):
        for k in range(i + 1, count):
            if stop[0]:
                return
            if box[i] == box[k]:
                continue
            least = cost[i] + cost[k]
            limit = limits[box[i], box[k]]
            if least < limit and span[i, 0] < span[k, 1] and span[k, 0] < span[i, 1]:
                best = NEVER
                if w1 > 0:
                    best = int(min(NEVER, np.ceil((limit - flat[i] - flat[k]) / w1)))
                worst = best
                at_least = round((least - flat[i] - flat[k]) / w1) if w1 > 0 else 0
                after_i, after_k = NEVER, NEVER
                for p in range(2):
                    for q in range(2):
                        r, s = rows[i, p], rows[k, q]
                        if (p == 1 and r == rows[i, 0]) or (q == 1 and s == rows[k, 0]):
                            continue
                        if best > at_least:
                            best = _beside(by_x[r], after_x[s], sizes[r, 0], best)
                            best = _beside(by_x[s], after_x[r], sizes[s, 0], best)
                        if best > at_least:
                            best = _beside(by_y[r], after_y[s], sizes[r, 1], best)
                            best = _beside(by_y[s], after_y[r], sizes[s, 1], best)
                        for after, axis in ((after_x, 0), (after_y, 1)):
                            last = after.shape[1] - 1
                            end = min(first[axis][s] + sizes[s, axis], last)
                            after_i = min(after_i, after[r, end])
                            end = min(first[axis][r] + sizes[r, axis], last)
                            after_k = min(after_k, after[s, end])
                behind[at[i], at[k]] = max(0.0, flat[i] + w1 * after_i - cost[i])
                behind[at[k], at[i]] = max(0.0, flat[k] + w1 * after_k - cost[k])
                least = max(least, flat[i] + flat[k] + w1 * best) if best < worst else np.inf
            pays = least - cost[i] - cost[k] if least < limit else np.inf
            extra[at[i], at[k]] = extra[at[k], at[i]] = max(0.0, pays)
