"""How the answer goes with the speed of the drive: largest deflection and stress, critical speeds, limits that hold."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from elastic import Deflection
from elastic.elastodynamics import SpeedMap, critical_speeds, speed_map
from kinelast.figures.cycle import Cycle
from kinelast.figures.entry import Figure, Measure, items_of, measures_of
from kinelast.figures.limits import judged, kept, magnitudes
from kinelast.figures.output import output_of
from kinelast.figures.registry import figures_of
from kinelast.figures.theory import damping_of
from kinelast.scene.data import Scene
from kinelast.scene.error import SceneError
from kinelast.scene.numbers import quantity
from kinelast.tasks.progress import one_thread
from rigid import ConstantSpeed, MechanismError
from rigid.arrays import Reals

FIELDS = {"w": "deflection", "chord": "chord", "mises": "stress"}  # that are told of every beam, and their figures


@dataclass(frozen=True, eq=False)
class Speeds:
    """Largest values over the cycle at several speeds.

    Attributes
    ----------
    speed
        Of the drive [rad/s or m/s], shape (speeds,).
    map
        The speed map: values of `FIELDS` [m, m, Pa] per beam, with and without vibration, growth.
    figures
        The registered figures as measures, each with its values with vibration, shape (speeds,).
    highest
        Highest speed up to which every limit of the scene holds; None without limits, 0.0 where they fail at the first.
    critical
        Speeds at which a low multiple of the drive's runs through the lowest natural frequencies, by that multiple:
        least and greatest over the cycle.
    """

    speed: Reals
    map: SpeedMap
    figures: Mapping[str, tuple[Measure, Any]]
    highest: float | None
    critical: Mapping[int, tuple[float, float]]


@one_thread()
def speeds(scene: Scene, asked: tuple[float, float, int]) -> Speeds:
    """The answer at speeds from one to another.

    Raises
    ------
    SceneError
        Not one drive at constant speed moves the scene, or vibration cannot be answered.
    """
    if len(scene.laws) != 1 or not isinstance(scene.laws[0], ConstantSpeed) or not scene.laws[0].speed:
        raise SceneError(scene.path, "drives", "", "--speeds takes a scene with one drive, at constant speed")
    if scene.run.no_cycle:
        raise SceneError(scene.path, "drives", "", f"--speeds takes cycles: {scene.run.no_cycle}")
    nominal = abs(float(scene.laws[0].speed))
    speed = np.linspace(*asked)
    figures = [figure for figure in figures_of(output_of(scene)) if not figure.asked]
    measure = partial(_largest, scene, figures)
    try:
        ratios, period = (speed / nominal).tolist(), float(scene.run.cycle)
        steady = speed_map(scene.course.at, period, ratios, scene.sections, measure, scene.joints, damping_of(scene))
    except (MechanismError, ValueError) as error:
        raise SceneError(scene.path, "", "", f"--speeds: {error}") from None
    spans = critical_speeds(steady.omega).items()
    critical = {n: (low, high) for n, (low, high) in spans if low <= asked[1] and high >= asked[0]}
    values, plain = (_by_figure(scene, figures, each) for each in (steady.values, steady.quasi_static))
    vibrating, still = (np.array([each[key] for key in FIELDS.values()]).transpose(2, 0, 1) for each in (values, plain))
    measures = {name: (measure, measure.among(values[measure.figure.key]))
               for name, measure in measures_of(scene, figures).items()}  # fmt: skip
    return Speeds(
        speed, replace(steady, values=vibrating, quasi_static=still), measures, _highest(scene, speed, values), critical
    )


def _largest(scene: Scene, figures: Sequence[Figure], bent: Deflection) -> Reals:
    """Magnitudes of the items of figures one behind the other, shape (rows, speeds); fields between positions too."""
    fields = frozenset(field for figure in figures for field in figure.fields)
    cycle = Cycle(scene, bent.motion, bent, wanted=fields, period=bent.motion.time[:, -1])
    return np.concatenate(list(magnitudes(cycle, figures).values()))


def _by_figure(scene: Scene, figures: Sequence[Figure], rows: Any) -> dict[str, Any]:
    """By key the values of a figure's items, shape (items, speeds), from rows of shape (speeds, rows)."""
    counts = [len(items_of(scene, figure.of)) for figure in figures]
    parts = np.split(rows.T, np.cumsum(counts)[:-1])
    return {figure.key: part for figure, part in zip(figures, parts, strict=True)}


def _highest(scene: Scene, speed: Any, values: Mapping[str, Any]) -> float | None:
    """The highest speed up to which all limits are kept; there is no figure where there is no steady state."""
    if not scene.limits:
        return None
    holds = kept(judged(scene, values))
    count = len(speed) if holds.all() else int(holds.argmin())
    return float(speed[count - 1]) if count else 0.0


def speed_unit(scene: Scene) -> str:
    """Unit of the speed of the drive."""
    return "rad/s" if scene.mechanism.drives[0].turns else "m/s"


def speed_figures(result: Speeds, scene: Scene) -> dict[str, Any]:
    """Speeds as plain data; largest values per field and beam, null where there is no steady state; and in words."""
    ways = {"values": result.map.values, "without_vibration": result.map.quasi_static}
    curves = {
        kind: {
            field: {label: values[:, k, beam].tolist() for beam, label in enumerate(scene.labels)}
            for k, field in enumerate(FIELDS)
        }
        for kind, values in ways.items()
    }
    return {
        "words": list(_words(result, scene)),
        "unit": speed_unit(scene),
        "speed": result.speed.tolist(),
        **curves,
        "figures": {
            name: {"unit": measure.unit, "values": values.tolist()}
            for name, (measure, values) in result.figures.items()
            if measure.items is None
        },
        "from": float(result.speed[0]),
        "to": float(result.speed[-1]),
        "count": len(result.speed),
        "highest_within_limits": result.highest,
        "error": np.asarray(result.map.error, float).tolist(),
        "unstable": [float(speed) for speed in result.speed[~result.map.stable]],
        "critical": {str(harmonic): list(span) for harmonic, span in result.critical.items()},
    }


def _words(result: Speeds, scene: Scene) -> Iterator[str]:
    """Sentences on the speeds: the highest within the limits, and those without a steady state."""
    unit, unstable = speed_unit(scene), result.speed[~result.map.stable]
    if result.highest is not None:
        kept = "all limits hold up to" if result.highest else "limits do not hold at the lowest speed,"
        yield f"{kept} {quantity(result.highest or result.speed[0], unit)}"
    if len(unstable):
        yield f"no steady state at {len(unstable)} of {len(result.speed)} speeds, from {quantity(unstable[0], unit)}"
