"""Keep freed memory for the next call instead of returning it to the system.

glibc returns each freed block above a threshold, and maps and zeroes the next block of that size page by page. For
arrays of some thousand positions this costs as much as the mechanics (1.6 against 0.6 ms for all fields of a four-bar
at 2,048 positions). The threshold is set to its maximum here, even if the environment sets another: dask starts its
processes with a low one (`MALLOC_TRIM_THRESHOLD_`). Without glibc this has no effect.
"""

import ctypes
from contextlib import suppress

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # malloc.h

with suppress(OSError, AttributeError, TypeError):
    _set = ctypes.CDLL(None).mallopt
    _set(M_MMAP_THRESHOLD, 32 * 2**20)
    _set(M_TRIM_THRESHOLD, 64 * 2**20)
