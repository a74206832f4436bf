"""Figures of many designs at once: what a deflection with an axis of designs comes to, one number a design."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial, reduce
from typing import Any

import numpy as np

from elastic import FIELDS, Deflection
from elastic.assessment import angle_error, euler_ratio
from elastic.beams.compliance import designs_of
from elastic.cycle_maxima import Maximum, cycle_maxima
from elastic.sampling import displacement_of
from kinelast.figures.results import WELL, drive_words
from kinelast.scene.data import Scene
from kinelast.scene.error import fault, likely
from kinelast.scene.limits import Output
from kinelast.scene.motion import scene_deflection
from rigid import Motion, drive_efforts
from rigid.analysis import reachable, transmission_angles
from rigid.constants import mass_moments

ALONG = {"deflection": "w", "chord": "chord", "stress": "mises", "u": "u", "phi": "phi", "N": "N", "V": "V", "M": "M"}
"""Figures that are the greatest magnitude of a field, by what they are called."""


@dataclass(frozen=True, eq=False)
class Found:
    """Designs at their positions: a scene and its motion, columns (designs, positions) or (positions,).

    `output` is what the machine is there for, where it is known; `wanted` are the fields that figures take; `used` is
    how many designs count: those that follow only fill the arrays.
    """

    scene: Scene
    motion: Motion
    output: Output | None = None
    wanted: frozenset[str] = field(default_factory=frozenset)
    used: int | None = None

    @cached_property
    def bent(self) -> Deflection:
        """Its deflection, computed where a figure asks for it."""
        return scene_deflection(self.scene, self.motion)

    @cached_property
    def reached(self) -> Any:
        """Whether the mechanism closes, shape (..., positions)."""
        return np.broadcast_to(reachable(self.motion), self.columns)

    @cached_property
    def condition(self) -> Any:
        """Of the motion, shape (..., positions)."""
        return np.broadcast_to(self.motion.condition, self.columns)

    @cached_property
    def counted(self) -> Any:
        """Whether a position counts in the largest values, shape (..., positions); None where all do.

        As in `kinelast.figures.results.Results.counted`.
        """
        well = self.condition <= WELL
        if well.all():
            return None
        return np.where(well.any(axis=-1, keepdims=True), well, ~self.bent.lost)

    @cached_property
    def maxima(self) -> dict[str, Maximum]:
        """Greatest magnitudes of the fields that are wanted, of every beam over the positions that count."""
        return cycle_maxima(self.bent, sorted(self.wanted), self.counted)

    def largest(self, values: Any) -> tuple[Any, Any]:
        """Largest magnitude over the positions that count, shape (..., designs), and the position."""
        size = np.abs(np.broadcast_to(values, (*np.shape(values)[: -len(self.columns)], *self.columns)))
        at = size.argmax(axis=-1)
        most = np.take_along_axis(size, at[..., None], -1)[..., 0]
        if self.counted is None and np.isfinite(most).all():
            return most, at
        good = np.isfinite(size) if self.counted is None else np.isfinite(size) & self.counted
        size = np.where(good, size, -1.0)
        at = size.argmax(axis=-1)
        most = np.take_along_axis(size, at[..., None], -1)[..., 0]
        return np.where(most < 0.0, np.nan, most), at

    @cached_property
    def columns(self) -> tuple[int, ...]:
        """Shape of the columns, also where the designs differ in what does not move them."""
        return np.broadcast_shapes(self.motion.columns, designs_of(self.scene.sections))

    def of_beams(self, key: str) -> tuple[Any, Any]:
        """Largest magnitude of a field of every beam, shape (beams, ...), and the position."""
        return self.maxima[key].value, self.maxima[key].position


Values = tuple[Any, Any]
"""A figure of every design, and the key of the place where it is, or None."""


@dataclass(frozen=True)
class Figure:
    """A figure of a design: its name, SI unit, what it is of `Found`, and the fields that takes."""

    name: str
    unit: str
    of: Callable[[Found], Values]
    fields: tuple[str, ...] = ()


def figures_of(scene: Scene, output: Output | None) -> dict[str, Figure]:
    """All figures that the designs of a scene have, by name."""
    found = [*_along_beams(scene), *_of_motion(scene)]
    if output is not None:
        found.append(Figure("output_error", "m" if output.point else "rad", _output_error))
    table = {figure.name: figure for figure in found}
    if scene.limits:
        fields = {"deflection": "w", "chord": "chord", "safety": "mises"}
        needed = tuple({fields[limit.kind]: None for limit in scene.limits if limit.kind in fields})
        table["acceptable"] = Figure("acceptable", "1", _acceptable, needed)
    return table


def chosen(table: Mapping[str, Figure], names: Iterable[str | Figure]) -> list[Figure]:
    """Figures by name; one that is none of the table stands for itself.

    Raises
    ------
    SceneError
        There is none of a name.
    """
    for name in names:
        if isinstance(name, str) and name not in table:
            raise fault("", "figures", f'there is no figure "{name}"{likely(name, table)}')
    return [table[name] if isinstance(name, str) else name for name in names]


def _along_beams(scene: Scene) -> Iterable[Figure]:
    if not scene.labels:
        return
    for name, key in ALONG.items():
        unit = FIELDS[key].unit
        yield Figure(name, unit, partial(_greatest, key=key), (key,))
        for beam, label in enumerate(scene.labels):
            yield Figure(f"{name}.{label}", unit, partial(_of_beam, key=key, beam=beam), (key,))
    yield Figure("safety", "1", partial(_safety, beams=range(len(scene.labels))), ("mises",))
    for beam, label in enumerate(scene.labels):
        yield Figure(f"safety.{label}", "1", partial(_safety, beams=(beam,)), ("mises",))
    yield Figure("buckling", "1", lambda found: _over_all(found, euler_ratio(found.bent)))


def _of_motion(scene: Scene) -> Iterable[Figure]:
    yield Figure("mass", "kg", _mass)
    words = drive_words(scene.mechanism)
    for number, (name, _, _, unit) in enumerate(words):
        figure = Figure(f"drive_effort.{name}", unit, partial(_effort, number=number))
        yield figure
        if len(words) == 1:
            yield Figure("drive_effort", unit, figure.of)
    yield Figure("joint_force", "N", lambda found: _over_all(found, _rows(found, found.bent.forces.force)))
    yield Figure("shaking_force", "N", lambda found: found.largest(found.bent.forces.ground_force))
    yield Figure("shaking_moment", "N m", lambda found: found.largest(found.bent.forces.ground_moment))
    yield Figure("condition", "1", _condition)
    yield Figure("transmission_angle", "rad", _transmission)
    yield Figure("reach", "1", lambda found: (found.reached.mean(axis=-1), None))


def _rows(found: Found, values: Sequence[Any]) -> Any:
    return np.array([np.broadcast_to(np.abs(value), found.columns) for value in values])


def _over_all(found: Found, values: Any) -> Values:
    """Largest over beams or joints."""
    return _most(found, *found.largest(values))


def _greatest(found: Found, key: str) -> Values:
    return _most(found, *found.of_beams(key))


def _most(found: Found, most: Any, at: Any) -> Values:
    """The largest of several rows, and the key of row and position."""
    row = np.where(np.isnan(most), -1.0, most).argmax(axis=0)[None]
    most, at = (np.take_along_axis(values, row, 0)[0] for values in (most, at))
    return most, row[0] * found.columns[-1] + at


def _of_beam(found: Found, key: str, beam: int) -> Values:
    most, at = found.of_beams(key)
    return most[beam], at[beam]


def _safety(found: Found, beams: Iterable[int]) -> Values:
    """Least yield stress over the largest von Mises stress; nan where that of a beam is not known."""
    most, at = found.of_beams("mises")
    least: Any = None
    for beam in beams:
        limit = np.ravel(found.bent.sections[beam].yield_stress)
        with np.errstate(divide="ignore", invalid="ignore"):
            factor = np.where(
                most[beam] > 0.0, limit / most[beam], np.where(np.isnan(most[beam] + limit), np.nan, np.inf)
            )
        place = beam * found.columns[-1] + at[beam]
        if least is None:
            least = factor, place
        else:
            better = (factor < least[0]) | np.isnan(factor)
            least = np.where(better, factor, least[0]), np.where(better, place, least[1])
    assert least is not None
    return np.reshape(least[0], found.columns[:-1]), np.reshape(least[1], found.columns[:-1])


def _mass(found: Found) -> Values:
    """Of all moving links."""
    masses = (np.real(mass_moments(link)[0]) for link in found.scene.mechanism.links[1:])
    total: Any = sum(masses)
    return np.broadcast_to(np.ravel(total) if found.columns[:-1] else total, found.columns[:-1]), None


def _effort(found: Found, number: int) -> Values:
    return found.largest(drive_efforts(found.bent.motion, found.bent.forces)[number])


def _condition(found: Found) -> Values:
    condition = np.where(found.bent.lost, -1.0, found.condition)
    most = condition.max(axis=-1)
    return np.where(most < 0.0, np.nan, most), condition.argmax(axis=-1)


def _transmission(found: Found) -> Values:
    """Least transmission angle of any dyad; nan where there is none."""
    angles = [each.angle for each in transmission_angles(found.motion)]
    if not angles:
        return np.full(found.columns[:-1], np.nan), None
    angle = np.broadcast_to(reduce(np.minimum, angles), found.columns)
    return angle.min(axis=-1), angle.argmin(axis=-1)


def _output_error(found: Found) -> Values:
    output = found.output
    assert output is not None
    if output.point:
        return found.largest(displacement_of(found.bent, output.link, output.point))
    mechanism = found.scene.mechanism
    points = mechanism.links[mechanism.index[output.link]].points
    return _over_all(found, _rows(found, [angle_error(found.bent, output.link, point) for point in points]))


def _acceptable(found: Found) -> Values:
    """1 where all limits of the scene are kept, else 0; a limit that there is no figure for is not kept."""
    kept: Any = True
    owners = [found.scene.mechanism.links[at].name for at, _ in found.scene.mechanism.beams]
    for limit in found.scene.limits:
        beams = [number for number, owner in enumerate(owners) if limit.link in ("", owner)]
        if limit.kind == "safety":
            kept = kept & (_safety(found, beams)[0] >= np.ravel(limit.value))
            continue
        if limit.kind == "output":
            value = np.nan if found.output is None else _output_error(found)[0]
        else:
            value = found.of_beams(ALONG[limit.kind])[0][beams].max(axis=0)
        kept = kept & (value <= np.ravel(limit.value))
    return np.reshape(np.where(kept, 1.0, 0.0), found.columns[:-1]), None
