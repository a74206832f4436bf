"""How the answer goes with the speed of the drive: largest deflection and stress, critical speeds, limits that hold."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic import Deflection
from elastic.cycle_maxima import cycle_maxima
from elastic.elastodynamics import SpeedMap, critical_speeds, speed_map
from kinelast.figures.theory import damping_of
from kinelast.numbers import quantity
from kinelast.scene.data import Scene
from kinelast.scene.error import SceneError
from kinelast.scene.limits import Limit
from kinelast.threads import one_thread
from rigid import ConstantSpeed, MechanismError

FIELDS = ("w", "chord", "mises")
KINDS = {"deflection": "w", "chord": "chord"}  # limits, by what they are held against


@dataclass(frozen=True, eq=False)
class Speeds:
    """Largest values over the cycle at several speeds.

    Attributes
    ----------
    speed
        Of the drive [rad/s or m/s], shape (speeds,).
    found
        What the engine found: values of `FIELDS` [m, m, Pa] per beam, with and without vibration, growth.
    highest
        Highest speed up to which every limit of the scene holds; None without limits, 0.0 where they fail at the first.
    critical
        Speeds at which a low multiple of the drive's runs through the lowest natural frequencies, by that multiple:
        least and greatest over the cycle.
    """

    speed: Any
    found: SpeedMap
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
    own = abs(float(scene.laws[0].speed))
    speed = np.linspace(*asked)
    try:
        ratios, period = (speed / own).tolist(), 2 * math.pi / own
        found = speed_map(scene.course.at, period, ratios, scene.sections, _largest, scene.joints, damping_of(scene))
    except (MechanismError, ValueError) as error:
        raise SceneError(scene.path, "", "", f"--speeds: {error}") from None
    spans = critical_speeds(found.omega).items()
    critical = {n: (low, high) for n, (low, high) in spans if low <= asked[1] and high >= asked[0]}
    return Speeds(speed, found, _highest(scene, speed, found.values), critical)


def _largest(bent: Deflection) -> Any:
    """Largest magnitudes of `FIELDS` over the cycle, shape (fields, beams)."""
    found = cycle_maxima(bent, FIELDS, period=bent.motion.time[:, -1])
    return np.array([found[field].value for field in FIELDS])


def _highest(scene: Scene, speed: Any, values: Any) -> float | None:
    limits = [limit for limit in scene.limits if limit.kind in (*KINDS, "safety")]
    if not limits:
        return None
    holds = np.all([_kept(scene, limit, values) for limit in limits], axis=0)
    count = len(speed) if holds.all() else int(holds.argmin())
    return float(speed[count - 1]) if count else 0.0


def _kept(scene: Scene, limit: Limit, values: Any) -> Any:
    """Whether a limit holds, per speed; not where there is no steady state."""
    owners = [scene.mechanism.links[at].name for at, _ in scene.mechanism.beams]
    beams = [number for number, owner in enumerate(owners) if limit.link in ("", owner)]
    if limit.kind == "safety":
        bound = np.array([float(np.ravel(scene.sections[number].yield_stress)[0]) for number in beams]) / limit.value
        return (values[:, FIELDS.index("mises"), beams] <= bound).all(axis=1)
    return (values[:, FIELDS.index(KINDS[limit.kind])][:, beams] <= limit.value).all(axis=1)


def speed_unit(scene: Scene) -> str:
    """Unit of the speed of the drive."""
    return "rad/s" if scene.mechanism.drives[0].turns else "m/s"


def speed_figures(found: Speeds, scene: Scene) -> dict[str, Any]:
    """Speeds as plain data; largest values per field and beam, null where there is no steady state; and in words."""
    ways = {"values": found.found.values, "without_vibration": found.found.quasi_static}
    curves = {
        way: {
            field: {label: values[:, k, beam].tolist() for beam, label in enumerate(scene.labels)}
            for k, field in enumerate(FIELDS)
        }
        for way, values in ways.items()
    }
    return {
        "words": list(_words(found, scene)),
        "unit": speed_unit(scene),
        "speed": found.speed.tolist(),
        **curves,
        "from": float(found.speed[0]),
        "to": float(found.speed[-1]),
        "count": len(found.speed),
        "highest_within_limits": found.highest,
        "error": np.asarray(found.found.error, float).tolist(),
        "unstable": [float(speed) for speed in found.speed[~found.found.stable]],
        "critical": {str(harmonic): list(span) for harmonic, span in found.critical.items()},
    }


def _words(found: Speeds, scene: Scene) -> Iterator[str]:
    """What the speeds come to."""
    unit, unstable = speed_unit(scene), found.speed[~found.found.stable]
    if found.highest is not None:
        kept = "all limits of links hold up to" if found.highest else "limits do not hold at the lowest speed,"
        yield f"{kept} {quantity(found.highest or found.speed[0], unit)}"
    if len(unstable):
        yield f"no steady state at {len(unstable)} of {len(found.speed)} speeds, from {quantity(unstable[0], unit)}"
