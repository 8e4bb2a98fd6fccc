"""How the functions of the joint search are compiled.

Each function of these is compiled on its own and once more in all that call it, so what Python
never calls is made without a way for Python to call it: half of the work, where a function takes
thirty arrays.
"""

from __future__ import annotations

from numba import njit

#: For functions that Python calls.
entry = njit(cache=True, nogil=True)
#: For functions that only compiled code calls.
compiled = njit(cache=True, nogil=True, no_cpython_wrapper=True)
#: The same without counting who has a reference to an array. Numba counts in every call that hands
#: on a tuple of arrays, atomically, which took two thirds of the time. The caller keeps all arrays
#: alive; what is compiled so makes none.
uncounted = njit(cache=True, nogil=True, _nrt=False, no_cpython_wrapper=True)
