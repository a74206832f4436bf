"""Freed memory is kept for the next call instead of going back to the system.

glibc returns every freed block above a threshold to the system and has the next one of that size mapped and zeroed
anew, page by page: for arrays of some thousand positions that costs as much as the mechanics (1.6 against 0.6 ms for
all fields of a four-bar at 2,048 positions). Here that threshold is set to the most there can be, whatever the
environment says: dask starts its processes with a low one (`MALLOC_TRIM_THRESHOLD_`). Elsewhere than with glibc this
does nothing.
"""

import ctypes
from contextlib import suppress

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # malloc.h

with suppress(OSError, AttributeError, TypeError):
    _set = ctypes.CDLL(None).mallopt
    _set(M_MMAP_THRESHOLD, 32 * 2**20)
    _set(M_TRIM_THRESHOLD, 64 * 2**20)
