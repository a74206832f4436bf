"""End stops, which limit the angle or travel of joints, and the smallest distances of joints from their stops."""

from __future__ import annotations

import cmath
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct

from elastic import Largest
from kinelast.scene.moved_joint import coordinate, moved_joint
from kinelast.scene.part import Assembly, Part
from kinelast.scene.tables import JointNameTable
from kinelast.values.error import fault
from kinelast.values.figure import LEAST, Figure, Kind
from kinelast.values.numbers import require
from kinelast.values.quantities import AngleOrLength
from kinelast.values.reading import Reader, reading
from rigid import Mechanism, Motion, PinDrive, Reals, SliderDrive
from rigid.analysis import LinkAngle, Slide

if TYPE_CHECKING:
    from kinelast.figures.cycle import Cycle
    from kinelast.scene.data import Scene
    from symbols import Anchor, Mark

TURN = 2.0 * np.pi
ROUND_OFF = 1e-9  # of an angle, relative to a turn
INSIDE = 0.25 * TURN  # [rad] distance between `Stop.middle` and the stop, if there is only one stop
BAR = 4.0  # length of the bar in the symbol of a stop, relative to the symbol size


class StopTable(JointNameTable, frozen=True, kw_only=True):
    """End stops of a joint, which is given as in a drive."""

    #: lower bound of the coordinate [no stop]
    least: AngleOrLength | None = None
    most: AngleOrLength | None = None  #: upper bound of the coordinate [no stop]
    margin: AngleOrLength | None = None  #: minimum distance from the stops [0]

    @property
    def required_margin(self) -> AngleOrLength:
        """Smallest allowed distance from the stops."""
        return AngleOrLength.read(0.0) if self.margin is None else self.margin


class Stop(Struct, frozen=True):
    """End stops of a joint. `least` or `most` [rad or m] is None if there is no stop on that side."""

    joint: PinDrive | SliderDrive
    least: Any
    most: Any

    @property
    def unit(self) -> str:
        """SI unit of the coordinate."""
        return "rad" if self.joint.turns else "m"

    @property
    def middle(self) -> Any:
        """Angle in the middle between both stops, or at the distance `INSIDE` from a single stop [rad]."""
        if self.least is None or self.most is None:
            return self.most - INSIDE if self.least is None else self.least + INSIDE
        return (self.least + self.most) / 2.0

    def coordinate(self, motion: Motion) -> Reals:
        """Return the travel [m] or angle [rad]. The angle is continuous over the positions and starts near `middle`."""
        if not isinstance(self.joint, PinDrive):
            return Slide(self.joint.slider).value(motion)
        off = LinkAngle(self.joint.link, self.joint.on).difference(motion, self.middle)
        turns = np.nan_to_num(np.round(np.diff(off, axis=-1, prepend=off[..., :1]) / TURN)).cumsum(axis=-1)
        return np.asarray(self.middle + off - TURN * turns)

    def margin(self, motion: Motion, upper: bool, cyclic: bool) -> Reals:
        """Return the distance from the upper or the lower stop; negative beyond it, shape (..., positions).

        A link that turns fully passes its stop, so its margin is negative. `cyclic` is true if the motion repeats.
        """
        value = self.coordinate(motion)
        left: Reals = self.most - value if upper else value - self.least
        if not self.joint.turns:
            return left
        low, high = (np.nan_to_num(end.reduce(value, axis=-1, keepdims=True)) for end in (np.fmin, np.fmax))
        first, last = value[..., :1], value[..., -1:]
        closing = np.remainder(first - last + TURN / 2, TURN) - TURN / 2  # after the last position, if it repeats
        turned = np.nan_to_num(np.abs(last + closing - first)) if cyclic else 0.0
        fully = np.maximum(high - low, turned) >= TURN * (1.0 - ROUND_OFF)
        nearest = np.nan_to_num(np.fmin.reduce(left, axis=-1, keepdims=True))
        return left - TURN * np.where(fully & (nearest >= 0.0), np.floor(nearest / TURN) + 1.0, 0.0)


def _built(assembly: Assembly) -> dict[str, Stop]:
    return {name: _stop(f"stops.{name}", table, assembly) for name, table in STOPS.tables(assembly.table).items()}


def _stop(where: str, table: StopTable, assembly: Assembly) -> Stop:
    joint = moved_joint(where, "", table, assembly.links, assembly.sliders)
    if table.least is None and table.most is None:
        raise fault(where, "least", "the key is missing: give least, most or both")
    unit = "rad" if joint.turns else "m"
    given = {key: getattr(table, key) for key in ("least", "most", "margin")}
    least, most, margin = (None if each is None else coordinate(where, key, each, unit) for key, each in given.items())
    if least is not None and most is not None:
        require(least < most, where, "most", "expected a value above least")
        require((most - least < TURN) | (not joint.turns), where, "most", "expected less than a turn above least")
    if margin is not None:
        require(margin >= 0.0, where, "margin", "expected zero or more")
    return Stop(joint, least, most)


def _side(name: str, key: str) -> Kind:
    """Return a kind of item. Its items are the stops on the side `key`: "least" or "most"."""
    return Kind(
        name, lambda scene: [stop for stop, own in STOPS.of(scene).items() if getattr(own, key) is not None], "end stop"
    )


LOWER, UPPER = _side("lower stop", "least"), _side("upper stop", "most")


def _units(kind: Kind) -> Callable[[Scene], list[str]]:
    return lambda scene: [STOPS.of(scene)[name].unit for name in kind.names(scene)]


def _margins(kind: Kind, upper: bool) -> Callable[[Cycle], Largest]:
    """Return a function that finds the smallest margin of each stop over all positions, even ill-conditioned ones."""

    def find(cycle: Cycle) -> Largest:
        stops = [STOPS.of(cycle.scene)[name] for name in kind.names(cycle.scene)]
        return cycle.least(cycle.rows([stop.margin(cycle.motion, upper, cycle.scene.run.turn) for stop in stops]))

    return find


def _row(reader: Reader, name: str) -> dict[str, Any]:
    stop = STOPS.of(reader.scene)[name]
    ends = {key: end for key in ("least", "most") if (end := getattr(stop, key)) is not None}
    return {"joint": stop.joint.name, **{key: reading(np.ravel(end)[0], stop.unit) for key, end in ends.items()}}


def _symbols(scene: Scene) -> Iterator[Mark]:
    """Yield the drawing symbol of each stop: a bar with ticks on the forbidden side."""
    from symbols import Line, Mark

    for stop in STOPS.of(scene).values():
        for end, side in ((stop.least, -1.0), (stop.most, 1.0)):
            if end is not None:
                at, along, start = _bar(stop, float(np.ravel(end)[0]), scene.mechanism)
                bar = start + BAR * np.array([0.0, 0.5, 1.0])
                ticks = (Line(np.array([foot, foot + 0.25 * BAR * (side * 1j - 1.0)])) for foot in bar)
                yield Mark("stop", at, (Line(bar), *ticks), axis=(at.link, along))


def _bar(stop: Stop, end: float, mechanism: Mechanism) -> tuple[Anchor, complex, float]:
    """Return the position, direction and start of the bar in the symbol of a stop.

    The bar is along a rotating link, or across the line of a slider.
    """
    from symbols import Anchor

    if not isinstance(stop.joint, PinDrive):
        slider = mechanism.slider(stop.joint.slider)
        way = complex(slider.direction)
        return Anchor(slider.on, local=complex(slider.origin) + end * way), -1j * way, -BAR / 2
    link, on = (mechanism.links[mechanism.index[name]].points for name in (stop.joint.link, stop.joint.on))
    arm = max((complex(place) - complex(link[stop.joint.at]) for place in link.values()), key=abs)
    along = cmath.exp(1j * end) * arm / (abs(arm) or 1.0)
    return Anchor(stop.joint.on, local=complex(on[stop.joint.at])), along, BAR


def _begin(kind: str, name: str) -> dict[str, Any] | None:
    if kind == "links":
        return {"link": name, "least": "-30 deg", "most": "30 deg"}
    return {"slider": name, "least": "-10 mm", "most": "10 mm"} if kind in ("sliders", "slots") else None


STOPS: Part[Stop] = Part(
    "stops", "end stops of joints", StopTable, _built,
    (
        Figure("lower_stop_margin", "margin of a joint above its lower stop", _units(LOWER), LOWER,
               _margins(LOWER, upper=False), LEAST, everywhere=True,
               limit="required_margin", rigid=True),
        Figure("upper_stop_margin", "margin of a joint below its upper stop", _units(UPPER), UPPER,
               _margins(UPPER, upper=True), LEAST, everywhere=True,
               limit="required_margin", rigid=True),
    ),
    _row, _symbols, _begin, "end stops of the link or slider",
)  # fmt: skip
