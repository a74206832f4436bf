"""Numbers that a scene's studies name: by how much they scatter, within which bounds they are sought, how they vary."""

from __future__ import annotations

from typing import Any

from kinelast.scene.error import SceneError, fault
from kinelast.scene.format import SceneTable
from kinelast.scene.format_studies import Amount, RangeTable, ToleranceTable
from kinelast.scene.variables import Place, Variable, place_of, value_at


def require_studies(table: SceneTable) -> None:
    """Raise where a study of a scene names a number that there is not, or a value that it cannot have."""
    for path, given in table.tolerances.items():
        tolerance(table, path, given)
    for path, (low, high) in table.optimize.variables.items():
        bounds(table, path, low, high)
    for path in table.sensitivities.numbers:
        place_of(table, path)
    for path, entry in table.sweep.vary.items():
        place = place_of(table, path)
        if isinstance(entry, RangeTable):
            ends(table, place, entry)
        else:
            for value in entry:
                varied(table, place, value)


def tolerance(table: SceneTable, path: str, given: Amount | ToleranceTable) -> tuple[Variable, float, bool]:
    """A number, how far it may be off [SI unit], and whether it scatters normally.

    Raises
    ------
    SceneError
        No such number; no difference with a unit that fits, or not greater than zero.
    """
    place = place_of(table, path)
    entry = given if isinstance(given, ToleranceTable) else ToleranceTable(plus_minus=given)
    text = entry.plus_minus
    if isinstance(text, str) and text.strip().endswith("%"):
        try:
            half = abs(place.variable.base) * float(text.strip()[:-1]) / 100
        except ValueError:
            raise fault("tolerances", f'"{path}"', f'expected a share, as in "2 %", got "{text}"') from None
    else:
        half = value_at(table, place, text)
    if not half > 0:
        raise fault("tolerances", f'"{path}"', f"expected a tolerance greater than zero, got {text!r}")
    return place.variable, half, entry.distribution == "normal"


def bounds(table: SceneTable, path: str, low: Amount, high: Amount) -> tuple[Variable, float, float]:
    """A number and its bounds [SI unit]; SceneError where they are none, or the wrong way round."""
    place = place_of(table, path)
    first, last = (value_at(table, place, each) for each in (low, high))
    if not first < last:
        problem = f"expected two bounds, the lower one first, got [{low!r}, {high!r}]"
        raise fault("optimize.variables", f'"{path}"', problem)
    return place.variable, first, last


def ends(table: SceneTable, place: Place, entry: RangeTable) -> tuple[float, float]:
    """The ends of a range that is swept [SI unit]; SceneError where they are none, or the wrong way round."""
    low, high = varied(table, place, entry.start), varied(table, place, entry.end)
    if not low < high:
        path, unit = place.variable.path, place.variable.unit.replace("1", "")
        problem = f"the wrong way round: from {low:g} to {high:g} {unit}".rstrip()
        raise fault("sweep", f"vary {path}", f"{problem}, expected from the smaller to the larger")
    return low, high


def varied(table: SceneTable, place: Place, text: Any) -> float:
    """A value that is swept [SI unit]; SceneError where it cannot stand there."""
    try:
        return value_at(table, place, text)
    except SceneError as error:
        raise fault("sweep", f"vary {place.variable.path}", error.problem) from None
