"""Cylinders of sliding drives: pressure, flow, and buckling of the rod."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from kinelast.scene.drive_values import by_drive, effort, named_tables, numbered, of_drives, rate
from kinelast.scene.part import Part
from kinelast.scene.tables import Factor, StrictTable
from kinelast.values.error import fault, known_name
from kinelast.values.figure import AVERAGE, LEAST, Figure, Kind, RangeCheck, averaged, each, least
from kinelast.values.numbers import real, require
from kinelast.values.quantities import FlowRate, Pressure, Size, Stress
from machine.drives import ROD_RANGE, Cylinder, buckling_safety, flow_rate, working_pressure
from rigid import GROUND

if TYPE_CHECKING:
    from kinelast.scene.data import Scene
    from kinelast.scene.format import SceneTable
    from symbols import Mark


KEY = "cylinders"


class CylinderTable(StrictTable, frozen=True, kw_only=True):
    """A hydraulic or pneumatic cylinder of a sliding drive."""

    bore: Size  #: diameter of the piston
    rod: Size | None = None  #: diameter of the rod [0]
    length: Size | None = None  #: buckling length of the rod with pinned ends [buckling is not checked]
    E: Stress | None = None  #: Young's modulus of the rod [206 GPa]
    pressure: Pressure | None = None  #: maximum supply pressure [no limit]
    flow: FlowRate | None = None  #: maximum supply flow [no limit]
    buckling_safety: Factor | None = None  #: minimum Euler load / push force [no limit]


def _cylinder(scene: SceneTable, number: int) -> Cylinder | None:
    table, known = scene.drives[number - 1], CYLINDERS.tables(scene)
    if table.cylinder is None:
        return None
    known_name(f"drives[{number}]", "cylinder", table.cylinder, known, "cylinder")
    if table.turns:
        raise fault(f"drives[{number}]", "cylinder", "a cylinder drives a slider, not a pin")
    given, where = known[table.cylinder], f"cylinders.{table.cylinder}"
    keys = {key: real(value) for key in given.__struct_fields__ if (value := getattr(given, key)) is not None}
    cylinder = Cylinder(**{"modulus" if key == "E" else key: value for key, value in keys.items()})
    require(cylinder.rod < cylinder.bore, where, "rod", "expected a diameter below bore")
    return cylinder


def _symbols(scene: Scene) -> Iterator[Mark]:
    """Yield the drawing symbols (barrel and rod) of each cylinder, if its barrel is a moving link with two points."""
    from symbols import Anchor, cylinder

    mechanism = scene.mechanism
    for number, _ in numbered(scene, KEY):
        slider = mechanism.slider(mechanism.drives[number].joint)
        rod, barrel = (mechanism.links[mechanism.index[name]] for name in (slider.link, slider.on))
        if barrel.name != GROUND and (len(barrel.points), len(rod.points)) == (2, 1):
            foot = next(iter(barrel.points))
            length = abs(complex(mechanism.drawing[slider.point]) - complex(mechanism.drawing[foot]))
            yield from cylinder(Anchor(barrel.name, foot), Anchor(rod.name, slider.point), length, slider.name)


CYLINDER = Kind("cylinder", lambda scene: scene.parts[KEY])
CYLINDERS: Part[Cylinder] = Part(
    KEY, "hydraulic and pneumatic cylinders of drives", CylinderTable, by_drive(_cylinder),
    (
        Figure("pressure", "cylinder pressure", "Pa", CYLINDER,
               each(of_drives(KEY, lambda cycle, number, own: working_pressure(own, effort(cycle, number)))),
               limit="pressure"),
        Figure("flow", "cylinder flow", "m^3/s", CYLINDER,
               each(of_drives(KEY, lambda cycle, number, own: flow_rate(own, rate(cycle, number)))),
               limit="flow", rigid=True),
        Figure("rod_slenderness", "slenderness of a cylinder rod", "1", CYLINDER,
               averaged(of_drives(KEY, lambda _, __, own: own.slenderness)), AVERAGE, rigid=True),
        Figure("rod_buckling", "buckling safety of a cylinder rod", "1", CYLINDER,
               least(of_drives(KEY, lambda cycle, number, own: buckling_safety(own, effort(cycle, number)))), LEAST,
               limit="buckling_safety"),
    ),
    symbols=_symbols,
    checks=(RangeCheck(ROD_RANGE, CYLINDER, "rod_slenderness", ("rod_buckling",)),),
    owned=named_tables(KEY, "cylinder"),
    drive_row="cylinder",
    on_axis=True,
    usual={  # from a syringe to a 100,000 t press
        "bore": ("bore", 1e-4, 5.0, "m", "40 mm"),
        "rod": ("rod", 0.0, 5.0, "m", "25 mm"),
        "modulus": ("modulus of the rod", 1e8, 2e12, "Pa", "206 GPa"),
        "pressure": ("pressure", 1e4, 1e9, "Pa", "160 bar"),
        "flow": ("flow", 1e-12, 1.0, "m^3/s", "6 l/min"),
    },
    stand_in={"bore": 0.05},
)  # fmt: skip
