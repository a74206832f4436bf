"""Joints with bearings, pins, eyes or clearance, as kinds of items of figures (results such as the life)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kinelast.values.figure import MACHINE, Kind, joint_words

if TYPE_CHECKING:
    from kinelast.scene.data import Scene

KEY = "bearings"


def _has(scene: Scene, joint: str, part: str) -> bool:
    """Return True if a joint has a machine part, such as an eye.

    The part "bearing" is present at any pin with a table under `[bearings]`.
    """
    parts = scene.parts[KEY].get(joint)
    if parts is None:
        return False
    return joint not in scene.mechanism.slider_points if part == "bearing" else getattr(parts, part) is not None


def joints_with(scene: Scene, part: Kind) -> dict[int, str]:
    """Return the names of the joints that have a machine part of the given kind, by joint number."""
    words = enumerate(joint_words(scene.mechanism))
    return {number: name for number, (name, _) in words if _has(scene, name, part.name)}


def _joints(part: str, noun: str = "") -> Kind:
    """Return a kind of item for results. Its items are the joints that have the machine part `part`."""
    return Kind(part, lambda scene: [name for name, _ in joint_words(scene.mechanism) if _has(scene, name, part)], noun)


BEARING, CLEARANCE = _joints("bearing", "joint"), _joints("clearance", "joint")
ROLLING, PLAIN = _joints("rolling", "rolling bearing"), _joints("plain", "plain bearing")
PIN, EYE = _joints("pin"), _joints("eye")
CLEARANCES = Kind("scene with clearance", lambda scene: [""] * bool(joints_with(scene, CLEARANCE)), MACHINE)
