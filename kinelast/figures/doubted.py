"""Limits that cannot be judged and figures with large errors, in words: in full, or shortened for a headline."""

from collections.abc import Callable, Iterable, Sequence

from kinelast.figures.limits import UNKNOWN
from kinelast.figures.report import JudgedLimit, UnreliableFigure
from kinelast.scene.numbers import percent

LIMIT_NAMES = {
    "deflection": "deflection",
    "chord": "deflection from chord",
    "safety": "safety",
    "output": "output error",
}


def unjudged_limits(limits: Iterable[JudgedLimit], member: Callable[[str], str]) -> dict[str, list[str]]:
    """Return the limits that cannot be judged, by reason; `member` names a beam by its label."""
    by_reason: dict[str, list[str]] = {}
    for row in limits:
        if row.outcome == UNKNOWN:
            item = member(row.found.label) if row.found.label else row.on
            by_reason.setdefault(row.problem, []).append(_of(LIMIT_NAMES.get(row.kind, row.name), item))
    return by_reason


def large_errors(unreliable: Iterable[UnreliableFigure], most: int | None = None) -> list[str]:
    """Return the figures with large errors in words.

    Parameters
    ----------
    unreliable
        Figures with large errors, least certain first.
    most
        Maximum number of items that a figure names, with the largest of their errors. By default it names all items,
        each with its error.
    """
    by_name: dict[str, list[UnreliableFigure]] = {}
    for each in unreliable:
        by_name.setdefault(each.name, []).append(each)
    return [_in_full(name, rows) if most is None else _in_brief(name, rows, most) for name, rows in by_name.items()]


def few(names: Sequence[str], most: int) -> list[str]:
    """Return some names, and the number of the others."""
    return [*names] if len(names) <= most else [*names[:most], f"{len(names) - most} more"]


def _in_full(name: str, rows: Sequence[UnreliableFigure]) -> str:
    first, *others = (f"{each.on or ''} ({_error(each)})".lstrip() for each in rows)
    return ", ".join([_of(name, first) if rows[0].on else f"{name} {first}", *others])


def _in_brief(name: str, rows: Sequence[UnreliableFigure], most: int) -> str:
    items, largest = few([each.on for each in rows if each.on], most), _error(rows[0])
    up_to = "up to " if len(rows) > 1 and largest.startswith("±") else ""
    return f"{_of(name, ', '.join(items))} ({up_to}{largest})"


def _error(each: UnreliableFigure) -> str:
    """Return the relative error of a figure in words."""
    return f"± {percent(each.share)}" if each.share is not None and each.share <= 1.0 else "error larger than the value"


def _of(name: str, item: str | None) -> str:
    """Return the name of a figure with its item."""
    return f"{name} of {item}" if item else name
