"""The leading drive of a scene: the first drive that moves. The option `--speeds` gives the speeds of this drive."""

from typing import Any

import numpy as np
from msgspec.structs import replace

from kinelast.scene.data import Scene
from kinelast.values.error import SceneError
from rigid import ConstantSpeed

CLOCK = 24  # number of instants at which loads are tested for a dependence on time


def leading_drive(scene: Scene) -> int:
    """Return the number of the first moving drive; 0 if no drive moves.

    A speed map keeps the ratios between the speeds of the drives.
    """
    return next((number for number, law in enumerate(scene.laws) if getattr(law, "speed", 0.0)), 0)


def speed_unit(scene: Scene) -> str:
    """Return the unit of the speed of the leading drive."""
    return "rad/s" if scene.mechanism.drives[leading_drive(scene)].turns else "m/s"


def nominal_speed(scene: Scene) -> float:
    """Return the magnitude of the speed [rad/s or m/s] that the scene prescribes for the leading drive.

    Raises
    ------
    SceneError
        A drive has no constant speed, no drive moves, the run has no cycle, or a load depends on time.
    """
    lead = scene.laws[leading_drive(scene)]
    if not all(isinstance(law, ConstantSpeed) for law in scene.laws) or not isinstance(lead, ConstantSpeed):
        problem = "--speeds scales drives at constant speed; it cannot scale laws of time and efforts"
        raise SceneError(scene.path, "drives", "", problem)
    if not lead.speed:
        raise SceneError(scene.path, "drives", "", "--speeds scales drives at constant speed, but none moves")
    if scene.run.no_cycle:
        raise SceneError(scene.path, "drives", "", f"--speeds takes cycles: {scene.run.no_cycle}")
    laws = (getattr(load, "law", None) for load in scene.mechanism.loads)
    if any(_depends_on_time(scene, law) for law in laws if law is not None):
        problem = "--speeds cannot scale a load by time: give its table against the angle of a link"
        raise SceneError(scene.path, "loads", "", problem)
    return abs(float(lead.speed))


def _depends_on_time(scene: Scene, law: Any) -> bool:
    """Return whether the factor of a load depends on time itself: it changes although positions and rates do not."""
    motion = scene.course.at(float(scene.run.cycle) * np.arange(CLOCK) / CLOCK)
    now, later = (np.asarray(law(each)) for each in (motion, replace(motion, time=0.61 * motion.time)))
    return not np.allclose(now, later, rtol=1e-9, atol=1e-12 * np.abs(now).max(initial=0.0))
