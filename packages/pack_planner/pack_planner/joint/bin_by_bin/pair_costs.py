"""Compiled: what two boxes of a node of :mod:`.arrangement` cost when they do not meet."""

from __future__ import annotations

from pack_planner.joint.bin_by_bin.branching import EITHER, HUGE
from pack_planner.joint.bin_by_bin.held_places import is_plain, least_cost, plain_cost
from pack_planner.joint.compiled import uncounted


@uncounted
def meet(i, k, place, sizes):  # type: ignore[no-untyped-def]
    """Whether boxes ``i`` and ``k`` overlap along x and y at their places."""
    a, b = sizes[i, place[i, 2]], sizes[k, place[k, 2]]
    for axis in range(2):
        if place[i, axis] >= place[k, axis] + b[axis]:
            return False
        if place[k, axis] >= place[i, axis] + a[axis]:
            return False
    return True


@uncounted
def _loads(k, axis, first, problem, node, limit, loads):  # type: ignore[no-untyped-def]
    """What the boxes that rest wholly on ``k`` cost at least when it begins at ``first``.

    Each one's cost goes into ``loads``; they are not complete when all cost ``limit``.
    """
    lo, hi, turn, cost, place = node.low, node.high, node.turn, node.cost, node.place
    wholly, turns = problem.wholly[k], problem.turns
    total = 0.0
    for m in range(len(lo)):
        if m == k or not wholly >> m & 1:
            continue
        if place[m, axis] >= first:
            loads[m] = cost[m]
            total += cost[m]
            continue
        x0, y0 = lo[m, 0], lo[m, 1]
        if axis == 0:
            x0 = max(x0, first)
        else:
            y0 = max(y0, first)
        window = (x0, hi[m, 0], y0, hi[m, 1])
        best = limit - total
        for t in range(turns[m]):
            if turn[m] == EITHER or turn[m] == t:
                best = least_cost(m, t, problem, node, window, best)
        loads[m] = best
        total += best
        if total >= limit:
            return limit
    return total


@uncounted
def sides(i, k, problem, node, limit, out, behind):  # type: ignore[no-untyped-def]
    """What two boxes and what rests wholly on them cost at least, returned and in ``out``.

    ``out`` is (turns of i, of k, sides); side 2 * axis: ``i`` comes first along the axis; the next
    one: ``k`` does. What each box pays at least when ``k`` goes behind ``i``, and the other way
    round, goes into ``behind``, (2, boxes), see :func:`.who_goes_behind.least_behind`.
    """
    lo, hi, turn, least, cost = node.low, node.high, node.turn, node.least, node.cost
    sizes, turns, wholly = problem.sizes, problem.turns, problem.wholly
    after, near, rows = problem.after, problem.near, problem.rows
    flat, w1 = problem.flat, problem.w1
    plain_i, plain_k = is_plain(i, problem, node), is_plain(k, problem, node)
    on_i, on_k = 0.0, 0.0
    for m in range(len(lo)):
        on_i += cost[m] if m != i and wholly[i] >> m & 1 else 0.0
        on_k += cost[m] if m != k and wholly[k] >> m & 1 else 0.0
    best = HUGE
    out[:] = HUGE
    behind[:] = 0.0
    for way in range(2):
        for m in range(len(lo)):
            if m in (i, k) or wholly[i if way else k] >> m & 1:
                behind[way, m] = HUGE
    loads = node.loads
    for side in range(4):
        axis, back = side // 2, side % 2
        a, plain_a, on_a, b, plain_b, on_b = i, plain_i, on_i, k, plain_k, on_k
        if back:
            a, plain_a, on_a, b, plain_b, on_b = k, plain_k, on_k, i, plain_i, on_i
        cheapest_b = min(least[b, 0], least[b, turns[b] - 1])
        for ta in range(turns[a]):
            if turn[a] != EITHER and turn[a] != ta:
                continue
            one = least[a, ta] + on_a
            if one + cheapest_b + on_b >= limit:
                continue
            begin = lo[a, axis] + sizes[a, ta, axis]
            last = min(hi[a, axis], hi[b, axis] - sizes[a, ta, axis])
            if begin > hi[b, axis] or last < lo[a, axis]:
                continue
            if last < hi[a, axis]:
                x0, y0, x1, y1 = lo[a, 0], lo[a, 1], hi[a, 0], hi[a, 1]
                if axis == 0:
                    x1 = last
                else:
                    y1 = last
                most = limit - cheapest_b - on_b - on_a
                if plain_a:
                    one = plain_cost(after, near, rows[a, ta], flat[a], w1, x0, x1, y0, y1, most)
                else:
                    one = least_cost(a, ta, problem, node, (x0, x1, y0, y1), most)
                one += on_a
                if one + cheapest_b + on_b >= limit:
                    continue
            first = max(lo[b, axis], begin)
            x0, y0, x1, y1 = lo[b, 0], lo[b, 1], hi[b, 0], hi[b, 1]
            if axis == 0:
                x0 = first
            else:
                y0 = first
            most = limit - one - on_b
            for tb in range(turns[b]):
                if (turn[b] != EITHER and turn[b] != tb) or least[b, tb] >= most:
                    continue
                if first == lo[b, axis]:
                    two = least[b, tb]
                elif plain_b:
                    two = plain_cost(after, near, rows[b, tb], flat[b], w1, x0, x1, y0, y1, most)
                else:
                    two = least_cost(b, tb, problem, node, (x0, x1, y0, y1), most)
                if two >= most:
                    continue
                own = two
                if wholly[b] != 1 << b:
                    two += _loads(b, axis, first, problem, node, limit - one - two, loads)
                if one + two < limit:
                    behind[back, a] = min(behind[back, a], max(one - on_a - cost[a], 0.0))
                    behind[back, b] = min(behind[back, b], max(own - cost[b], 0.0))
                    for m in range(len(lo)):
                        if m != b and wholly[b] >> m & 1:
                            behind[back, m] = min(behind[back, m], loads[m] - cost[m])
                    p, q = (ta, tb) if back == 0 else (tb, ta)
                    out[p, q, side] = one + two
                    best = min(best, one + two)
    return best
