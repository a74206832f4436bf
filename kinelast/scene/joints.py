"""Joints of a scene that give way or do not fit."""

from __future__ import annotations

from collections import Counter

from elastic import JointCompliance
from kinelast.scene.error import fault, known_name
from kinelast.scene.format import SceneTable
from kinelast.scene.many import real, vector
from rigid import Mechanism


def build_joints(scene: SceneTable, mechanism: Mechanism) -> dict[str, JointCompliance]:
    """Joints by the name of their point, slider or slot."""
    shared = Counter(point for link in mechanism.links for point in link.points)
    sliders = [slider.name for slider in mechanism.sliders]
    pins = [point for point, count in shared.items() if count > 1]
    driven = [drive.joint for drive in mechanism.drives if drive.turns]
    joints = {}
    for name, table in scene.joints.items():
        where = f"joints.{name}"
        known_name("joints", name, name, [*pins, *sliders], "joint")
        for key in ("rotation", "turn"):
            if getattr(table, key) is not None and name not in (*sliders, *driven):
                raise fault(where, key, "a pin that no drive turns carries no moment: leave it out")
        joints[name] = JointCompliance(
            real(table.compliance or 0.0),
            real(table.rotation or 0.0),
            0j if table.gap is None else vector(table.gap),
            real(table.turn or 0.0),
        )
    return joints
