"""Use one thread per process, like the command. Import this before numpy.

Without it, numpy uses all cores for small matrices, and parallel tests take 1.7 times as long.
"""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
