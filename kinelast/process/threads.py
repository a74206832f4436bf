"""Small matrices by thousands: the linear algebra's threads cost more there than they gain."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController


@contextmanager
def one_thread() -> Iterator[None]:
    """The linear algebra of numpy and scipy keeps to one thread meanwhile; a decorator too.

    The command has set that before numpy was loaded; who asks from Python has numpy loaded already.
    """
    if os.environ.get("OMP_NUM_THREADS") == "1":
        yield
        return
    with _controller("scipy.linalg" in sys.modules).limit(limits=1, user_api="blas"):
        yield


@lru_cache(maxsize=2)
def _controller(_: bool) -> ThreadpoolController:
    """Made once, and once more where scipy has brought a library of its own."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
