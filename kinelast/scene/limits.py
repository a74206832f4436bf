"""Limits and output of a scene, and numbers in its studies: tolerances, bounds of variables, ranges of sweeps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from kinelast.scene import tables
from kinelast.scene.format import SceneTable
from kinelast.scene.parts import PARTS
from kinelast.scene.parts.fatigue import FATIGUE, FATIGUED
from kinelast.scene.tables import Amount, BoundTable
from kinelast.scene.variables import Place, Variable, place_of, value_at
from kinelast.values.error import SceneError, fault, known_name, likely
from kinelast.values.figure import BEAM, LARGEST, LEAST, OUTPUT_ERROR, SCENE, STOPPING, Limit
from kinelast.values.numbers import real
from kinelast.values.units import Quantity
from rigid import Mechanism
from rigid.arrays import Real

if TYPE_CHECKING:
    from kinelast.scene.data import Scene


class FigureBound(Struct, frozen=True):
    """Limits on a figure (a result such as the largest deflection), as the file gives them under the figure's name.

    Whether the figure exists is checked later.

    Attributes
    ----------
    name
        Name of the figure, or `KEY.ITEM` for one of its items.
    given
        A number, which is an upper limit, or a table with `most` and `least`.
    table
        Table that contains the limits, for messages.
    per_length
        Metres per length unit of the file.
    """

    name: str
    given: Amount | BoundTable
    table: str
    per_length: float

    def within(self, unit: str, over: str) -> list[tuple[float, bool]]:
        """Return each limit in `unit`, the SI unit of the figure, and whether it is a lower limit.

        `over` says which value of the cycle the figure is, see `Figure.over`.

        Raises
        ------
        SceneError
            There is no limit, a limit has the wrong dimension, or no value can meet the limits. A number for a smallest
            value is also refused: it may be meant as a lower limit, e.g. a safety factor of 2.
        """
        given = self.given if isinstance(self.given, BoundTable) else BoundTable(most=self.given)
        try:
            limits = [
                (Quantity.of_unit(unit, amount, self.per_length), least)
                for amount, least in ((given.most, False), (given.least, True))
                if amount is not None
            ]
        except ValueError as error:
            raise self._fault(str(error)) from None
        if not limits:
            raise self._fault('expected a bound, as in { most = "1 mm" } or { least = 2 }')
        if given is not self.given and over == LEAST:
            bound = f'"{self.given}"' if isinstance(self.given, str) else f"{self.given:g}"
            lower, upper = f"{{ least = {bound} }} for a lower limit", f"{{ most = {bound} }} for an upper limit"
            raise self._fault(f"the figure is a smallest value: write {lower}, or {upper}")
        if over == LARGEST and min(value for value, _ in limits) < 0.0:
            raise self._fault("the limit is negative, but the figure is the largest magnitude, without sign")
        if len(limits) > 1 and limits[0][0] < limits[1][0]:
            raise self._fault("no value meets both limits: least is above most")
        return limits

    def _fault(self, problem: str) -> SceneError:
        return fault(self.table, f'"{self.name}"', problem)


def figure_bounds(table: SceneTable, given: Mapping[str, Amount | BoundTable], where: str) -> tuple[FigureBound, ...]:
    """Return the limits that the file gives under the names of figures (results such as the largest deflection)."""
    return tuple(FigureBound(name, bound, where, tables.PER_LENGTH[table.units]) for name, bound in given.items())


class Output(Struct, frozen=True):
    """Output of a machine: the position of a point, or the angle of a link if `point` is empty.

    `guessed` is True if the program chose the output.
    """

    link: str
    point: str = ""
    guessed: bool = False

    @property
    def unit(self) -> str:
        """Unit of the output error."""
        return "m" if self.point else "rad"


def limits_in(table: SceneTable, scene: Scene) -> Iterator[Limit]:
    """Yield the limits of a scene that have their own key, such as `safety` under `[limits]`.

    All other attributes of `scene` must be set.
    """
    limits, mechanism = table.limits, scene.mechanism
    yield from _of_links(table, limits, "")
    for part in PARTS:
        yield from part.limits(table, scene)
    elastic = [link.name for link in mechanism.links[1:] if link.beams]
    for name, own in limits.links.items():
        known_name("limits.links", name, name, elastic, "link with beams")
        yield from _of_links(table, own, name)
    if limits.output is not None:
        bound, unit = _of_output(table, mechanism, "limits", "output", limits.output)
        yield Limit(OUTPUT_ERROR, bound, unit=unit, of=SCENE)
    if limits.residual is not None:
        bound, unit = _of_output(table, mechanism, "limits", "residual", limits.residual)
        yield Limit("residual", bound, unit=unit, of=STOPPING)
    if limits.settling is not None:
        yield Limit("settling", real(limits.settling), unit="s", of=STOPPING)


def build_settled(table: SceneTable, mechanism: Mechanism) -> Real | None:
    """Return the distance from the rest position within which the output counts as settled [m or rad].

    Return None if the scene does not give this distance.
    """
    given = table.run.settled
    return None if given is None else _of_output(table, mechanism, "run", "settled", given)[0]


def _of_output(table: SceneTable, mechanism: Mechanism, where: str, key: str, given: Quantity) -> tuple[Any, str]:
    """Return an allowed distance of the output from its ideal or rest position, and the unit of this distance.

    The unit is empty if the file neither names the output nor gives a unit, so that it may be a length or an angle.
    """
    output, unit = build_output(table, mechanism), given.unit
    meant = unit if output is None else "m" if output.point else "rad"
    if unit not in ("", meant):
        expected = 'a length, as in "0.1 mm"' if meant == "m" else 'an angle, as in "0.1 deg"'
        raise fault(where, key, f"expected {expected}, since the output is {table.run.output}")
    if not meant and table.units != "m":
        expected = 'a length or an angle with its unit, as in "0.1 mm"'
        raise fault(where, key, f"expected {expected}, since output is missing under [run]")
    return given.within(meant), meant


def _of_links(scene_table: SceneTable, table: tables.LinkLimitsTable, link: str) -> Iterator[Limit]:
    for kind in tables.LinkLimitsTable.__struct_fields__:
        value = getattr(table, kind)
        if value is not None:
            unit = value.units[0] if isinstance(value, Quantity) else "1"
            if kind in ("endurance", "life") and not FATIGUE.tables(scene_table):
                raise fault("limits", kind, "needs the fatigue of the links: add [fatigue]")
            of = FATIGUED if kind in ("endurance", "life") else BEAM
            yield Limit(kind, real(value), kind in tables.LEAST_ALLOWED, link, unit, of)


def sets_limit(path: str) -> bool:
    """Return True if the number at a path is only a limit on a result of a machine part, e.g. of a bearing.

    Examples
    --------
    >>> sets_limit("bearings.A.rolling.life"), sets_limit("bearings.A.rolling.C"), sets_limit("stops.A.margin")
    (True, False, True)
    """
    table, _, rest = path.partition(".")
    key = rest.partition(".")[2]
    return any(part.sets_limit(key) for part in PARTS if part.key == table)


def build_output(table: SceneTable, mechanism: Mechanism) -> Output | None:
    """Return the output of a scene, which is a point or LINK.angle; None if the scene does not give it.

    Raises
    ------
    SceneError
        There is no moving point or link with this name.
    """
    words = table.run.output
    if not words:
        return None
    moving = mechanism.links[1:]
    owner, _, what = words.rpartition(".")
    if owner and what == "angle":
        if owner not in {link.name for link in moving}:
            names = [link.name for link in moving]
            raise fault("run", "output", f'there is no moving link "{owner}"{likely(owner, names)}')
        return Output(owner)
    fixed_points = mechanism.links[0].points
    carrier = next((link.name for link in moving if words in link.points and words not in fixed_points), None)
    if carrier is None:
        names = list(dict.fromkeys(point for link in moving for point in link.points if point not in fixed_points))
        problem = f'there is no point "{words}" that moves{likely(words, names)}'
        problem += f'; write an angle as in "{moving[-1].name}.angle"'
        raise fault("run", "output", problem)
    return Output(carrier, words)


def require_studies(table: SceneTable) -> None:
    """Raise SceneError if a study of the scene refers to an unknown number or contains an impossible value."""
    for path, given in table.tolerances.items():
        tolerance(table, path, given)
    for path, (low, high) in table.optimize.variables.items():
        bounds(table, path, low, high)
    for path in table.sensitivities.numbers:
        place_of(table, path)
    for path, entry in table.sweep.vary.items():
        place = place_of(table, path)
        if isinstance(entry, tables.RangeTable):
            ends(table, place, entry)
        else:
            for value in entry:
                varied(table, place, value)


def tolerance(table: SceneTable, path: str, given: Amount | tables.ToleranceTable) -> tuple[Variable, float, bool]:
    """Return the number at a path, its tolerance [SI unit], and whether its distribution is normal.

    Raises
    ------
    SceneError
        The number is unknown, the unit is wrong, or the tolerance is not greater than zero.
    """
    place = place_of(table, path)
    entry = given if isinstance(given, tables.ToleranceTable) else tables.ToleranceTable(plus_minus=given)
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
    """Return the number at a path and its bounds [SI unit].

    Raise SceneError if the bounds are invalid or in the wrong order.
    """
    place = place_of(table, path)
    first, last = (value_at(table, place, each) for each in (low, high))
    if not first < last:
        problem = f"expected two bounds, the lower one first, got [{low!r}, {high!r}]"
        raise fault("optimize.variables", f'"{path}"', problem)
    return place.variable, first, last


def ends(table: SceneTable, place: Place, entry: tables.RangeTable) -> tuple[float, float]:
    """Return the ends of a range [SI unit]. Raise SceneError if they are invalid or in the wrong order."""
    low, high = varied(table, place, entry.start), varied(table, place, entry.end)
    if not low < high:
        path, unit = place.variable.path, place.variable.unit.replace("1", "")
        problem = f"reversed: from {low:g} to {high:g} {unit}".rstrip()
        raise fault("sweep", f"vary {path}", f"{problem}, expected from the smaller to the larger")
    return low, high


def varied(table: SceneTable, place: Place, text: Any) -> float:
    """Return a value that a sweep gives to a number [SI unit].

    Raise SceneError if the number cannot have this value.
    """
    try:
        return value_at(table, place, text)
    except SceneError as error:
        raise fault("sweep", f"vary {place.variable.path}", error.problem) from None
