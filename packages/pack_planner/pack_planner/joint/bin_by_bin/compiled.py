"""How the inner functions of the search bin by bin are compiled."""

from __future__ import annotations

from numba import njit

#: Without counting who has a reference to an array. Numba counts in every call that hands on a
#: tuple of arrays, atomically, which took two thirds of the time. The caller keeps all arrays
#: alive; what is compiled so makes none.
compiled = njit(cache=True, nogil=True, _nrt=False)
