"""Whatever goes wrong with a scene becomes its outcome, so that it does not take the others with it."""

from __future__ import annotations

import traceback
from collections.abc import Callable

from kinelast.outcome import BAD_INPUT, BUG, MESSAGE, Outcome
from kinelast.request import RequestError
from kinelast.scene.error import SceneError, plain
from rigid import MechanismError


def attempted(name: str, work: Callable[[], Outcome], fewer: str, place: str = "") -> Outcome:
    """The outcome of a scene's work, or of what it raises.

    Parameters
    ----------
    fewer
        What to ask less of where memory runs out.
    place
        Where it was written to, for faults of the disk that name no file.
    """
    try:
        return work()
    except (SceneError, MechanismError, RequestError) as error:
        return Outcome(BAD_INPUT, f"{name}: {plain(str(error), MESSAGE)}")
    except OSError as error:
        where = f"{error.filename or place}: " if error.filename or place else ""
        told = plain(f"{where}{(error.strerror or str(error)).lower()}", MESSAGE)
        return Outcome(BAD_INPUT, f"{name}: not written: {told}")
    except MemoryError:
        return Outcome(BAD_INPUT, f"{name}: out of memory: ask for fewer {fewer}")
    except Exception:
        return Outcome(BUG, f"{name}: the program failed, please report this:\n{traceback.format_exc()}")
