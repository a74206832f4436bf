"""Words on limits that cannot be judged, and on figures (results such as the largest deflection) with large errors."""

from collections.abc import Callable, Iterable, Sequence

from kinelast.reports.limits import UNKNOWN
from kinelast.reports.report import JudgedLimit, UnreliableFigure
from kinelast.values.numbers import few, percent

LIMIT_NAMES = {
    "deflection": "deflection",
    "chord": "deflection from chord",
    "safety": "safety",
    "output": "output error",
}


def unjudged_limits(limits: Iterable[JudgedLimit], member: Callable[[str], str]) -> dict[str, list[str]]:
    """Return the names of the limits that cannot be judged, grouped by the reason.

    `member` returns the name of a beam from its label.
    """
    by_reason: dict[str, list[str]] = {}
    for row in limits:
        if row.outcome == UNKNOWN:
            item = member(row.found.label) if row.found.label else row.on
            by_reason.setdefault(row.problem, []).append(_of(LIMIT_NAMES.get(row.kind, row.name), item))
    return by_reason


def large_errors(unreliable: Iterable[UnreliableFigure], most: int | None = None) -> list[str]:
    """Return a phrase for each figure with large errors. A phrase names the items and the errors.

    Parameters
    ----------
    unreliable
        Figures with large errors, sorted from the largest relative error to the smallest.
    most
        Maximum number of items that a phrase names. If it is given, a phrase states only the largest error. By default
        a phrase names all items, each with its own error.
    """
    by_name: dict[str, list[UnreliableFigure]] = {}
    for each in unreliable:
        by_name.setdefault(each.name, []).append(each)
    return [_in_full(name, rows) if most is None else _in_brief(name, rows, most) for name, rows in by_name.items()]


def _in_full(name: str, rows: Sequence[UnreliableFigure]) -> str:
    first, *others = (f"{each.on or ''} ({_error(each)})".lstrip() for each in rows)
    return ", ".join([_of(name, first) if rows[0].on else f"{name} {first}", *others])


def _in_brief(name: str, rows: Sequence[UnreliableFigure], most: int) -> str:
    items, errors = few([each.on for each in rows if each.on], most), dict.fromkeys(_error(each) for each in rows)
    largest = next(iter(errors))
    if len(errors) > 1:
        largest = f"up to {largest}" if largest.startswith("±") else "some errors larger than the value"
    return f"{_of(name, ', '.join(items))} ({largest})"


def _error(each: UnreliableFigure) -> str:
    """Return the relative error of a figure in words."""
    return f"± {percent(each.share)}" if each.share is not None and each.share <= 1.0 else "error larger than the value"


def _of(name: str, item: str | None) -> str:
    """Return the name of a figure, followed by the item if there is one."""
    return f"{name} of {item}" if item else name
