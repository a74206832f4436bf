"""designs.html: many designs of a scene as one page: their trade-off front, parallel coordinates, table."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from kinelast.outputs.page.data import Numbers
from kinelast.outputs.page.report import as_data, filled, shared_parts, text_of
from rigid.arrays import Integers, Reals

MARK = b'<script type="application/json" id="designs">'  # by which a page of this program is known
SCRIPTS = ("numbers", "dom", "theme", "arrays", "design_data", "scatter", "parallel", "design_table", "designs")
SHOWN = 10_000  # designs that a page holds: of more, the fronts and a random part
FRONTS = 6  # figures of which every pair has its front among those
GREATER = ("safety", "transmission_angle", "reach", "acceptable", "output_travel")  # figures that are better large


def designs_page(
    title: str,
    columns: Mapping[str, Any],
    units: Mapping[str, str],
    reasons: Sequence[str],
    numbers: Sequence[str],
    figures: Sequence[str],
    best: int | None = None,
    sensitivities: Mapping[str, Mapping[str, float]] | None = None,
    pages: Mapping[int, str] | None = None,
    scene: str | None = None,
    options: str = "",
) -> bytes:
    """The page of many designs, UTF-8: it needs nothing but itself and asks for nothing.

    Parameters
    ----------
    title
        Of the scene.
    columns
        By name the values of all designs, shape (designs,), nan where unknown.
    units
        By the same names.
    reasons
        Per design why it has no figures; empty where all is well.
    numbers, figures
        Names of the columns that were changed, as paths in the scene, and of those that came out of it.
    best
        Number of the design that was found best, counted from 0.
    sensitivities
        Per figure, by how many per cent it grows where a number grows by 1 %.
    pages
        Addresses of the pages of single designs, beside this one, by their numbers.
    scene, options
        What the command calls the scene, and the options by which a design's single run has the figures of this page:
        designs without a page are told the commands that make it.

    Raises
    ------
    ValueError
        Columns of unlike lengths, or a name without its column.
    """
    count = len(reasons)
    for name in (*numbers, *figures):
        if name not in columns or np.shape(columns[name]) != (count,):
            found = np.shape(columns[name]) if name in columns else "none"
            raise ValueError(f"column {name!r}: expected shape ({count},), got {found}")
    values = {name: np.asarray(columns[name], float) for name in (*numbers, *figures)}
    kept = kept_designs(count, [values[name] * (-1 if is_greater(name) else 1) for name in figures], best)
    store = Numbers()
    store.add("#design", kept.astype(float))
    for name, column in values.items():
        store.add(name, column[kept])
    words = dict.fromkeys(reasons[at] for at in kept)
    store.add("#reason", np.array([list(words).index(reasons[at]) for at in kept], float), "f")
    packed, is_packed = store.bytes()
    data = {
        "arrays": store.places,
        "packed": is_packed,
        "count": len(kept),
        "of": count,
        "units": {name: units.get(name, "1") for name in values},
        "numbers": list(numbers),
        "figures": list(figures),
        "axes": first_axes(numbers, figures),
        "greater": [name for name in figures if is_greater(name)],
        "reasons": list(words),
        "failed": sum(map(bool, reasons)),
        "best": best,
        "sensitivities": {figure: dict(row) for figure, row in (sensitivities or {}).items()},
        "pages": {str(design): address for design, address in (pages or {}).items()},
        "scene": scene,
        "options": options,
    }
    parts = {"title": text_of(title), "designs": as_data(data), "numbers": b64encode(packed), **shared_parts(SCRIPTS)}
    return filled("designs.html", parts)


def first_axes(numbers: Sequence[str], figures: Sequence[str]) -> list[str]:
    """Columns that a page shows at first, across and up: one number against a figure, or two figures.

    Examples
    --------
    >>> first_axes(["depth", "width"], ["deflection", "stress", "mass"])
    ['mass', 'deflection']
    >>> first_axes(["depth"], ["deflection"])
    ['depth', 'deflection']
    """
    lead, *others = (*figures, *numbers)
    if not figures or len(numbers) == 1:
        return [numbers[0], lead]
    return ["mass" if "mass" in figures and lead != "mass" else [*others, lead][0], lead]


def is_greater(figure: str) -> bool:
    """Whether a figure is better the larger it is."""
    return figure.split(".", maxsplit=1)[0] in GREATER


def kept_designs(count: int, figures: Sequence[Any], best: int | None) -> Integers:
    """Numbers of the designs that a page holds: all, or the fronts of pairs of figures, the best, and a random part.

    Parameters
    ----------
    figures
        Per figure its values, shape (designs,), less being better; the first ones have fronts.
    """
    if count <= SHOWN:
        return np.arange(count)
    pairs = combinations(figures[:FRONTS], 2) if len(figures) > 1 else [(figures[0], figures[0])]
    fronts = [front(*pair) for pair in pairs]
    random, chosen = np.random.default_rng(0), np.array([] if best is None else [best], int)
    first = np.setdiff1d(np.concatenate(fronts), chosen)
    first = random.choice(first, min(len(first), SHOWN - len(chosen)), replace=False)
    others = np.setdiff1d(np.arange(count), [*chosen, *first])
    return np.sort(
        np.concatenate([chosen, first, random.choice(others, SHOWN - len(chosen) - len(first), replace=False)])
    )


def front(first: Reals, second: Reals) -> Integers:
    """Pareto front of two figures, shape (designs,), less being better: numbers of its designs, by the first figure.

    Examples
    --------
    >>> front(np.array([1.0, 2.0, 3.0, 2.5]), np.array([3.0, 1.0, 0.5, 2.0])).tolist()
    [0, 1, 2]
    """
    known = np.flatnonzero(np.isfinite(first) & np.isfinite(second))
    order: Integers = known[np.lexsort((second[known], first[known]))]
    least = np.minimum.accumulate(np.concatenate([[np.inf], second[order]]))
    ahead: Integers = order[second[order] < least[:-1]]
    return ahead
