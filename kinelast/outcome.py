"""A scene that is to be computed, and how that went."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

FINE, CHECK_FAILED, BAD_INPUT, BUG = 0, 1, 2, 3
"""Exit statuses of the command, the greatest of all scenes' counts."""
DONE, FAILED, SKIPPED = "done", "failed", "skipped"
MESSAGE = 1000  # letters of a line, at most


@dataclass(frozen=True)
class Task:
    """A scene's file, the folder for its results, and what the two are called."""

    path: Path
    folder: Path
    name: str


@dataclass(frozen=True)
class Outcome:
    """How a scene went.

    The exit status it calls for, one line about it, whether it was done, failed or skipped, questions about its
    figures, its figures where there are any, and how many seconds it took. `interrupted`: a user ended it, and what was
    found until then is kept.
    """

    status: int
    line: str
    state: str = FAILED
    questions: tuple[str, ...] = ()
    figures: Mapping[str, Any] = field(default_factory=dict)
    seconds: float = 0.0
    interrupted: bool = False
