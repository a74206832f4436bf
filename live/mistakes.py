"""Errors in the text of a scene, with line numbers."""

import math
import re
from typing import Any

from kinelast.scene.document import mistakes_in
from kinelast.scene.error import SceneError
from kinelast.scene.mistakes import path_of
from kinelast.scene.sections import Read
from live.text import line_of, places

NEXT = "Next: Support puts points on the ground, Drive turns a link about its pin."  # shown if there are no drives


def mistakes_of(error: Exception, text: str, read: Read) -> list[dict[str, Any]]:
    """Return all errors in a text from top to bottom. If no error is found, return `error`.

    `read` reads the files to which the scene refers.
    """
    others = error.others if isinstance(error, SceneError) else ()
    found = [mistake(each, text) for each in mistakes_in(text, read) or [error, *others]]
    return sorted(found, key=lambda each: each["line"] or math.inf)


def mistake(error: Exception, text: str) -> dict[str, Any]:
    """Return the line (or None) and the message of an error. If there are no drives, return the next step."""
    if isinstance(error, SceneError) and error.table == "drives" and error.problem.startswith("the table is missing"):
        return {"line": None, "message": NEXT, "next": True}
    if not isinstance(error, SceneError):
        at = re.search(r"at line (\d+)", str(error))
        return {"line": int(at[1]) if at else None, "message": str(error)}
    message = " ".join(part for part in (error.key if error.table == "points" else "", error.problem) if part)
    if at := re.search(r"at line (\d+)", error.problem) if not error.table else None:
        return {"line": int(at[1]), "message": message}
    try:
        first = places(text).nearest(path_of(error.table, error.key))
    except (ValueError, IndexError):
        first = None
    return {"line": None if first is None else line_of(text, first), "message": message or str(error)}
