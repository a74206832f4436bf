"""Joints of a scene that rub, give way or do not fit."""

from __future__ import annotations

from collections import Counter
from math import inf

from elastic import JointCompliance
from kinelast.scene.error import fault, known_name
from kinelast.scene.format import SceneTable
from kinelast.scene.format_motion import JointTable
from kinelast.scene.many import real, vector
from kinelast.scene.quantities import Damping
from rigid import Friction, Mechanism

RUBBING = ("friction", "viscosity", "radius", "length")


def build_joints(scene: SceneTable, mechanism: Mechanism) -> dict[str, JointCompliance]:
    """Joints by the name of their point, slider or slot."""
    shared = Counter(point for link in mechanism.links for point in link.points)
    sliders = list(mechanism.slider_points)
    pins = [point for point, count in shared.items() if count > 1]
    driven = [drive.joint for drive in mechanism.drives if drive.turns]
    joints = {}
    for name, table in scene.joints.items():
        if all(getattr(table, key) is None for key in ("compliance", "rotation", "gap", "turn")):
            continue
        where = f"joints.{name}"
        known_name("joints", name, name, [*pins, *sliders], "joint")
        for key in ("rotation", "turn"):
            if getattr(table, key) is not None and name not in (*sliders, *driven, *scene.welds):
                raise fault(where, key, "a pin that no drive turns carries no moment: leave it out")
        joints[name] = JointCompliance(
            real(table.compliance or 0.0),
            real(table.rotation or 0.0),
            0j if table.gap is None else vector(table.gap),
            real(table.turn or 0.0),
        )
    return joints


def build_friction(scene: SceneTable, mechanism: Mechanism) -> dict[str, Friction]:
    """Friction by the name of the joint's point, slider or slot."""
    shared = Counter(point for link in mechanism.links for point in link.points)
    sliders = list(mechanism.slider_points)
    found = {}
    for name, table in scene.joints.items():
        if all(getattr(table, key) is None for key in RUBBING):
            continue
        where, slides = f"joints.{name}", name in sliders
        known_name("joints", name, name, [*(point for point, count in shared.items() if count > 1), *sliders], "joint")
        count = max(shared[name] - 1, 0) + slides
        if name in scene.welds:
            raise fault(where, "friction", "the links are welded there, and do not rub")
        if count > 1:
            raise fault(where, "friction", f"{count} joints are called so: which of them rubs is not told")
        found[name] = _friction(where, table, slides)
    return found


def _friction(where: str, table: JointTable, slides: bool) -> Friction:
    """Friction of a pin, or of a slider."""
    key, problem = ("radius", "belongs to a pin") if slides else ("length", "belongs to a slider")
    if getattr(table, key) is not None:
        raise fault(where, key, problem)
    if table.friction is None and table.viscosity is None:
        raise fault(where, "friction", "the key is missing: a number, as in 0.1, or viscosity")
    if table.friction and not slides and table.radius is None:
        raise fault(
            where, "radius", 'the key is missing: the pin\'s, as in "5 mm", on which its friction has its lever'
        )
    if table.viscosity is not None and table.viscosity.unit not in ("", Damping.units[not slides]):
        example = '"5 N s/m"' if slides else '"0.1 N m s/rad"'
        raise fault(where, "viscosity", f"expected a damping, as in {example}, got one in {table.viscosity.unit}")
    sizes = real(table.friction or 0.0), real(table.radius or 0.0), real(table.length or inf)
    return Friction(*sizes, real(table.viscosity or 0.0))
