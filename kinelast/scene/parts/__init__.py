"""Machine parts. Each has its own file and is registered here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from kinelast.scene.part import Part
from kinelast.scene.parts.bearings import BEARINGS
from kinelast.scene.parts.cams import CAMS
from kinelast.scene.parts.cylinders import CYLINDERS
from kinelast.scene.parts.fatigue import FATIGUE
from kinelast.scene.parts.flywheels import FLYWHEELS
from kinelast.scene.parts.motors import MOTORS
from kinelast.scene.parts.stops import STOPS

if TYPE_CHECKING:
    from kinelast.scene.data import Scene
    from symbols import Mark

PARTS: tuple[Part[Any], ...] = (FLYWHEELS, MOTORS, CYLINDERS, CAMS, BEARINGS, FATIGUE, STOPS)


def symbols_of(scene: Scene) -> list[Mark]:
    """Return the symbols of all machine parts, such as motors, for the drawing of a scene."""
    return [mark for part in PARTS for mark in part.symbols(scene)]
