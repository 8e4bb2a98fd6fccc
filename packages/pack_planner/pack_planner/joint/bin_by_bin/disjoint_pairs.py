"""Compiled: what boxes must pay at least, by what pairs of them must pay."""

from __future__ import annotations

import numpy as np

from pack_planner.joint.compiled import compiled, uncounted


@compiled
def matched(count, extra):  # type: ignore[no-untyped-def]
    """The most that disjoint pairs and triples of ``count`` boxes must pay, by ``extra`` of pairs.

    Three boxes pay at least half of what their three pairs do.
    """
    return matched_wholes(count, extra, 1 << np.arange(count), np.empty(1 << count))


@uncounted
def matched_wholes(count, extra, whole, matches):  # type: ignore[no-untyped-def]
    """The same where ``extra`` of a pair is paid by two sets of boxes, ``whole`` of each as bits.

    Pairs and triples then share no box of these sets. ``matches`` is room for a number for each set
    of boxes.
    """
    matches[0] = 0.0
    for mask in range(1, 1 << count):
        best = 0.0
        for i in range(count):
            if mask >> i & 1:
                best = max(best, matches[mask & ~(1 << i)])
        for i in range(count):
            if whole[i] & ~mask:
                continue
            rest = mask & ~whole[i]
            for k in range(i + 1, count):
                if whole[k] & ~rest or extra[i, k] <= 0.0:
                    continue
                left = rest & ~whole[k]
                best = max(best, extra[i, k] + matches[left])
                for j in range(k + 1, count):
                    if whole[j] & ~left == 0:
                        three = extra[i, k] + extra[i, j] + extra[k, j]
                        best = max(best, 0.5 * three + matches[left & ~whole[j]])
        matches[mask] = best
    return matches[(1 << count) - 1]
