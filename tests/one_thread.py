"""One thread a process, as the command has it; imported before numpy, which otherwise gives small matrices all cores.

Tests run side by side: the whole suite takes 1.7 times as long without.
"""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
