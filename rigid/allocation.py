"""Freed memory is kept for the next call instead of going back to the system.

glibc returns every freed block above a threshold to the system and has the next one of that size mapped and zeroed
anew, page by page: for arrays of some thousand positions that costs as much as the mechanics (1.6 against 0.6 ms for
all fields of a four-bar at 2,048 positions). Freeing one large block raises that threshold to its size once and for
all; the block itself is never touched, so it takes no memory. Elsewhere than with glibc this does nothing.
"""

import numpy as np

np.empty(31 * 2**20, np.uint8)
