"""Spread the cases of a test over the quick, the slow and the exhaustive suite (CONTRIBUTING.md)."""

from collections.abc import Iterable

import pytest


def in_tiers(cases: Iterable, quick: int = 3, slow: int = 0) -> list:
    """Return parameters: the first `quick` cases run always, the next `slow` before a merge, all others on request.

    Put the cases first that differ most.

    >>> [case if isinstance(case, str) else (*case.values, case.marks[0].name) for case in in_tiers("abcd", 1, 2)]
    ['a', ('b', 'slow'), ('c', 'slow'), ('d', 'exhaustive')]
    """
    cases = list(cases)
    marks = [()] * quick + [pytest.mark.slow] * slow
    marks += [pytest.mark.exhaustive] * (len(cases) - len(marks))
    return [_marked(case, mark) for case, mark in zip(cases, marks, strict=False)]


def _marked(case, mark):
    """Return a case as a parameter with the mark, unless it has one already."""
    if not mark or hasattr(case, "marks"):
        return case
    values = case if isinstance(case, tuple | list) else (case,)
    return pytest.param(*values, marks=mark)
