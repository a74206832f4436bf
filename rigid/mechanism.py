"""Definition of a planar mechanism."""

from collections import Counter
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct, field
from msgspec.structs import astuple, force_setattr

from rigid.arrays import Complex
from rigid.names import definition_error
from rigid.parts import (
    GROUND,
    Beam,
    Friction,
    Gear,
    LineLoad,
    Link,
    Load,
    MechanismError,
    PinDrive,
    Slider,
    SliderDrive,
    Weld,
)


class Mechanism(Struct, frozen=True, eq=False, dict=True):
    """A planar mechanism: links (one of them named "ground"), joints, drives, gears, loads and friction.

    Links with a point of the same name are pinned at this point, unless `welds` join them rigidly. `drawing` gives
    approximate positions of points [m], which select the assembly branch; arrays of shape (designs, 1) if designs
    differ. `gravity` is in m/s^2. `friction` is given by the name of the pin (its point) or slider.
    """

    links: tuple[Link, ...]
    drives: tuple[PinDrive | SliderDrive, ...]
    drawing: Mapping[str, Complex]
    sliders: tuple[Slider, ...] = ()
    gravity: Complex = 0.0
    loads: tuple[Load | LineLoad, ...] = ()
    gears: tuple[Gear, ...] = ()
    friction: Mapping[str, Friction] = field(default_factory=dict)
    welds: tuple[Weld, ...] = ()

    def __post_init__(self) -> None:
        """Put the ground first and check the definition."""
        ordered = tuple(sorted(self.links, key=lambda link: link.name != GROUND))
        force_setattr(self, "links", ordered)
        if GROUND not in self.index:
            raise MechanismError('no link is named "ground": give the fixed link this name')
        if len(self.index) < len(ordered):
            raise MechanismError("two links have the same name")
        problem = definition_error(self)
        if problem:
            raise MechanismError(problem, kind="name")

    def __repr__(self) -> str:
        return f"Mechanism({len(self.links)} links, {len(self.drives)} drives)"

    @cached_property
    def index(self) -> dict[str, int]:
        """Number of each link by name."""
        return {link.name: number for number, link in enumerate(self.links)}

    @cached_property
    def beams(self) -> tuple[tuple[int, Beam], ...]:
        """Beams of all moving links with their link indices. All arrays of beams are in this order."""
        return tuple((number, beam) for number, link in enumerate(self.links) if number for beam in link.beams)

    @cached_property
    def designs(self) -> tuple[int, ...]:
        """Broadcast shape of all parameters: () or (designs, 1)."""
        values: list[Any] = [self.gravity, *self.drawing.values()]
        for link in self.links:
            values += link.points.values()
            values += [value for beam in link.beams for value in (beam.mass_per_length, beam.rotary_inertia)]
            values += [value for lump in link.lumps for value in (lump.mass, lump.inertia, lump.offset)]
        values += [value for part in self.fixed_angles for value in part.lengths]
        for load in self.loads:
            own = astuple(load) if isinstance(load, Struct) else vars(load).values()
            values += [value for value in own if np.ndim(value) == 2 and np.shape(value)[1] == 1]
        values += [value for friction in self.friction.values() for value in astuple(friction)]
        return np.broadcast_shapes(*(np.shape(value) for value in values))

    @property
    def fixed_angles(self) -> tuple[Slider | Weld, ...]:
        """Sliders and welds, which fix the angle between two links."""
        return *self.sliders, *self.welds

    @cached_property
    def size(self) -> float:
        """Largest distance of a drawn point from the first drawn point, for the first design [m]; 1 if zero."""
        places = np.array([np.ravel(place)[0] for place in self.drawing.values()], complex)
        return float(np.abs(places - places[:1]).max(initial=0.0)) or 1.0

    def slider(self, name: str) -> Slider:
        """Return a slider by name."""
        return next(slider for slider in self.sliders if slider.name == name)

    def ends(self, drive: PinDrive | SliderDrive) -> tuple[int, int]:
        """Return the indices of the reference link and of the moved link of a drive or gear end."""
        link, on = drive.links or (self.slider(drive.joint).link, self.slider(drive.joint).on)
        return self.index[on], self.index[link]

    @cached_property
    def slider_points(self) -> Mapping[str, str]:
        """Point of the block, by slider name."""
        return {slider.name: slider.point for slider in self.sliders}

    @cached_property
    def welded_points(self) -> frozenset[str]:
        """Points at which all links are welded, without relative rotation."""
        shared = Counter(point for link in self.links for point in link.points)
        welds = Counter(weld.point for weld in self.welds)
        return frozenset(point for point, count in welds.items() if count >= shared[point] - 1)

    def beam_number(self, link: str, number: int) -> int:
        """Return the index in `beams` of a link's beam."""
        return next(k for k, (at, _) in enumerate(self.beams) if at == self.index[link]) + number
