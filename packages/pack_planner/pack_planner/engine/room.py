"""How much of a room of each extent stays empty on average, by the boxes that are known."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def unusable(extents, shares, limit, step, choices):  # type: ignore[no-untyped-def]
    """What stays empty of a room of each extent up to ``limit``, float64 (limit + 1,), millimetres.

    The room is filled from one end with boxes that come at random, ``choices`` at a time, of which
    the one is taken after which most will be filled; when none of them fits it stays as it is.

    Parameters
    ----------
    extents : int64 (n,), extents of the known boxes, each once, rising.
    shares : float64 (n,), how often each occurs; their sum is 1.
    limit, step : millimetres; between multiples of ``step`` nothing is computed.
    choices : how many boxes there are to choose from.
    """
    filled = np.zeros(limit // step + 1)
    gains, parts = np.empty(len(extents)), np.empty(len(extents))
    for room in range(len(filled)):
        count = 0
        while count < len(extents) and extents[count] <= room * step:
            gain = extents[count] + filled[room - -(-extents[count] // step)]
            place = count
            while place > 0 and gains[place - 1] > gain:
                gains[place], parts[place] = gains[place - 1], parts[place - 1]
                place -= 1
            gains[place], parts[place] = gain, shares[count]
            count += 1
        # of several boxes the one counts that gains most
        below = 1.0 - parts[:count].sum()
        mean = 0.0
        for i in range(count):
            mean += gains[i] * ((below + parts[i]) ** choices - below**choices)
            below += parts[i]
        filled[room] = mean
    empty = np.empty(limit + 1)
    for mm in range(limit + 1):
        empty[mm] = mm - filled[mm // step]
    return empty
