"""Plans of sweeps: the input values of all designs.

The input values of a design are computed from the index of the design. Each chunk of a sweep can therefore be computed
independently of the other chunks.
"""

import csv
import re
import warnings
from collections.abc import Sequence
from functools import cached_property
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct

from kinelast.scene import document, sections, tables, variables
from kinelast.scene.format import SceneTable
from kinelast.scene.limits import ends, varied
from kinelast.scene.text import COLUMNS, reader_in
from kinelast.values.error import fault, plain
from rigid import Reals

MAX_DESIGNS = 10**18
# Limited by memory (latin-hypercube) and by the bits of Sobol points (sobol).
MAX_SAMPLES = {"latin-hypercube": 10**7, "sobol": 2**30}
HEADING = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\])?\s*")  # heading of a column: path, and optionally a unit in brackets


class ListedValues(Struct, frozen=True, eq=False):
    """Values from a list or a table, shape (count, varied inputs)."""

    rows: Reals

    @property
    def count(self) -> int:
        """Number of values."""
        return len(self.rows)

    def values(self, number: Any) -> Reals:
        """Return the values with the indices `number`, shape (n, varied inputs)."""
        return self.rows[number]


class EvenValues(Struct, frozen=True, eq=False):
    """Evenly spaced values of one input, from `low` to `high`."""

    low: float
    high: float
    count: int

    def values(self, number: Any) -> Reals:
        """Return the values with the indices `number`, shape (n, 1)."""
        last = self.count - 1
        found = np.where(number == last, self.high, self.low + number * ((self.high - self.low) / last))
        return found[:, None]


class Sample(Struct, frozen=True, eq=False, dict=True):
    """Random samples of several inputs, each within a range.

    Attributes
    ----------
    count
        Number of samples.
    low, high
        Ends of the ranges, shape (varied inputs,).
    method
        "latin-hypercube", or "sobol" for a scrambled Sobol sequence.
    seed
        Seed of the random generator.
    """

    count: int
    low: Reals
    high: Reals
    method: str
    seed: int

    def values(self, number: Any) -> Reals:
        """Return the samples with the indices `number`, shape (n, varied inputs)."""
        return self.low + self._shares(np.asarray(number)) * (self.high - self.low)

    def _shares(self, number: Any) -> Reals:
        if self.method == "latin-hypercube":
            return np.asarray(self._drawn[number])
        from scipy.stats import qmc

        first, last = int(number.min(initial=0)), int(number.max(initial=0))
        sequence = qmc.Sobol(len(self.low), scramble=True, rng=self.seed)
        if first:
            sequence.fast_forward(first)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # scipy warns if the number of points is not a power of 2
            return np.asarray(sequence.random(last - first + 1)[number - first])

    @cached_property
    def _drawn(self) -> Reals:
        from scipy.stats import qmc

        return np.asarray(qmc.LatinHypercube(len(self.low), rng=self.seed).random(self.count))


Factor = ListedValues | EvenValues | Sample
"""Values of one input, or joint values of several inputs.

A sweep computes all combinations of the values of all factors.
"""


class Plan(Struct, frozen=True, eq=False):
    """Designs of a sweep, numbered from 0.

    The designs are all combinations of the values of the factors. The last factor varies fastest.

    Attributes
    ----------
    paths, units
        Paths and SI units of the varied inputs. An example of a path is "sections.bar.depth".
    factors
        Factors of the sweep. Each factor contains the values of one or several inputs.
    """

    paths: tuple[str, ...]
    units: tuple[str, ...]
    factors: tuple[Factor, ...]

    @property
    def count(self) -> int:
        """Number of designs."""
        return prod(factor.count for factor in self.factors)

    def values(self, first: int, last: int) -> Reals:
        """Return the input values of designs `first` to `last` - 1 in SI units, shape (last - first, paths)."""
        number, parts = np.arange(first, last, dtype=np.int64), []
        for factor in reversed(self.factors):
            number, own = np.divmod(number, factor.count)
            parts.append(factor.values(own))
        return np.concatenate(parts[::-1], axis=1)


def plan_of(scene: document.Document | document.Tables, folder: Path = Path()) -> Plan:
    """Return the plan of the sweep of a scene.

    Parameters
    ----------
    scene
        A scene as a parsed document, or the tables that were read from a scene file.
    folder
        Folder of the scene file. If the sweep names a CSV file with designs, the file is read from this folder.

    Raises
    ------
    SceneError
        The scene has no sweep. A path, unit or range is invalid. Keys conflict, or a CSV file with designs cannot be
        read.

    Examples
    --------
    >>> from kinelast import shipped_scenes
    >>> from kinelast.scene.parsing import parse_toml
    >>> from kinelast.scene.text import file_text
    >>> tables = parse_toml(file_text(shipped_scenes()["steel_four_bar"]))
    >>> vary = {"sections.bar.depth": {"from": "3 mm", "to": "6 mm", "count": 4}, "drives.crank.speed": [50, 100]}
    >>> plan = plan_of({**tables, "sweep": {"vary": vary}})
    >>> plan.count, plan.values(5, 6)
    (8, array([[5.e-03, 1.e+02]]))
    """
    table = document.document_of(scene).table
    sweep = table.sweep
    if not sweep.vary and sweep.table is None:
        problem = 'no number is varied: expected as in "sections.bar.depth" = {from = "3 mm", to = "9 mm", count = 7}'
        raise fault("sweep", "vary", problem)
    places: list[variables.Place] = []
    factors: list[Factor] = []
    if sweep.table is not None:
        text = sections.read_as(sweep.table, COLUMNS, reader_in(folder), "sweep", "table")
        places, rows = _table(table, sweep.table, text)
        factors.append(ListedValues(rows))
    drawn: list[tuple[variables.Place, float, float]] = []
    for path, entry in sweep.vary.items():
        place = variables.place_of(table, path)
        if isinstance(entry, tables.RangeTable) and entry.count is None:
            drawn.append((place, *ends(table, place, entry)))
            continue
        places.append(place)
        if isinstance(entry, tables.RangeTable):
            factors.append(EvenValues(*ends(table, place, entry), entry.count or 2))
        else:
            factors.append(ListedValues(np.array([[varied(table, place, text)] for text in entry])))
    if drawn or sweep.method != "grid" or sweep.samples is not None:
        factors.append(_sample(sweep, drawn))
    places += [place for place, _, _ in drawn]
    _require_apart(places)
    paths, units = ([getattr(place.variable, name) for place in places] for name in ("path", "unit"))
    plan = Plan(tuple(paths), tuple(units), tuple(factors))
    if plan.count > MAX_DESIGNS:
        raise fault("sweep", "vary", f"{plan.count:.3g} designs are too many, at most {MAX_DESIGNS:.0e} are allowed")
    return plan


def _sample(sweep: tables.SweepTable, drawn: Sequence[tuple[variables.Place, float, float]]) -> Sample:
    """Return samples of all inputs for which the sweep gives a range but no count."""
    if sweep.method == "grid":
        if drawn:
            path = drawn[0][0].variable.path
            problem = "the key is missing: give count, the number of values on the grid, or a sampling method"
            raise fault("sweep", f"vary {path}", problem)
        problem = "belongs to the methods latin-hypercube and sobol; for a grid, give each range a count"
        raise fault("sweep", "samples", problem)
    if not drawn:
        raise fault("sweep", "method", f"{sweep.method} samples ranges without a count, but all ranges have one")
    if sweep.samples is None:
        raise fault("sweep", "samples", f"the key is missing: give the number of designs for {sweep.method}")
    if sweep.samples > MAX_SAMPLES[sweep.method]:
        problem = f"{sweep.method} allows at most {MAX_SAMPLES[sweep.method]}, got {sweep.samples}"
        raise fault("sweep", "samples", problem)
    low, high = (np.array(ends) for ends in zip(*((low, high) for _, low, high in drawn), strict=True))
    return Sample(sweep.samples, low, high, sweep.method, sweep.seed)


def _table(table: SceneTable, name: str, text: str) -> tuple[list[variables.Place], Reals]:
    """Read a CSV text; return the locations of the inputs, and their values, shape (designs, varied inputs).

    The headings are the paths of the inputs, with units in brackets.
    """
    name = plain(name, 80)
    head, *rows = [row for row in csv.reader(text.splitlines()) if any(cell.strip() for cell in row)] or [[]]
    if not rows:
        raise fault("sweep", "table", f"{name} contains no design: expected a row of paths and a row for every design")
    columns = []
    for cell in head:
        heading = HEADING.fullmatch(cell)
        assert heading is not None
        unit = heading[2] or ""
        whole = unit and not unit.isdecimal()  # a number in brackets is not a unit but part of the path
        columns.append((variables.place_of(table, heading[1] if whole else cell.strip()), unit if whole else ""))
    values = np.empty((len(rows), len(columns)))
    for number, row in enumerate(rows):
        if len(row) != len(columns):
            raise fault("sweep", "table", f"{name}: row {number + 2} has {len(row)} cells, expected {len(columns)}")
        for k, ((place, unit), cell) in enumerate(zip(columns, row, strict=True)):
            values[number, k] = variables.value_at(table, place, _cell(cell.strip(), unit))
    return [place for place, _ in columns], values


def _cell(text: str, unit: str) -> float | str:
    """Return the content of a cell. If the content is a number without a unit, add the unit of the column."""
    try:
        bare = float(text)
    except ValueError:
        return text
    return f"{text} {unit}" if unit and unit != "1" else bare


def _require_apart(places: Sequence[variables.Place]) -> None:
    """Raise SceneError if two paths lead to the same input value."""
    seen: dict[tuple[Any, ...], str] = {}
    for place in places:
        before = seen.setdefault(place.keys, place.variable.path)
        if before != place.variable.path or [other.keys for other in places].count(place.keys) > 1:
            raise fault("sweep", f"vary {place.variable.path}", "the number is varied twice")
