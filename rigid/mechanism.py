"""A planar mechanism before it moves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from rigid.arrays import Complex
from rigid.names import misnamed
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


@dataclass(frozen=True, eq=False)
class Mechanism:
    """A planar mechanism: links (one of them named "ground"), their joints, drives, gears, loads and friction.

    Links that share a point's name are pinned there, unless `welds` join them rigidly. `drawing` places the points
    [m] near a position of the mechanism and so picks the branch it is assembled in; of designs whose drawings
    differ, it holds arrays of shape (designs, 1). `gravity` [m/s^2]. `friction` by name of the pin (its point) or
    slider.
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
    index: Mapping[str, int] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Put the ground first, number the links and look up all names."""
        ordered = tuple(sorted(self.links, key=lambda link: link.name != GROUND))
        object.__setattr__(self, "links", ordered)
        object.__setattr__(self, "index", {link.name: number for number, link in enumerate(ordered)})
        if GROUND not in self.index:
            raise MechanismError('no link is named "ground": name the fixed link so')
        if len(self.index) < len(ordered):
            raise MechanismError("two links have the same name")
        wrong = misnamed(self)
        if wrong:
            raise MechanismError(wrong, kind="name")

    def __repr__(self) -> str:
        return f"Mechanism({len(self.links)} links, {len(self.drives)} drives)"

    @cached_property
    def beams(self) -> tuple[tuple[int, Beam], ...]:
        """Every beam of the moving links with its link's number, link by link: the order of all arrays of beams."""
        return tuple((number, beam) for number, link in enumerate(self.links) if number for beam in link.beams)

    @cached_property
    def designs(self) -> tuple[int, ...]:
        """Shape of its parameters: () or (designs, 1)."""
        values: list[Any] = [self.gravity, *self.drawing.values()]
        for link in self.links:
            values += link.points.values()
            values += [value for beam in link.beams for value in (beam.mass_per_length, beam.rotary_inertia)]
            values += [value for lump in link.lumps for value in (lump.mass, lump.inertia, lump.offset)]
        values += [value for part in self.fixed_angles for value in part.lengths]
        for load in self.loads:
            values += [value for value in vars(load).values() if np.ndim(value) == 2 and np.shape(value)[1] == 1]
        values += [value for friction in self.friction.values() for value in vars(friction).values()]
        return np.broadcast_shapes(*(np.shape(value) for value in values))

    @property
    def fixed_angles(self) -> tuple[Slider | Weld, ...]:
        """Sliders and welds: the parts that hold the angle of one link on another."""
        return *self.sliders, *self.welds

    @cached_property
    def size(self) -> float:
        """Greatest distance of drawn points from the first, of the first design [m]; 1 where there is none."""
        places = np.array([np.ravel(place)[0] for place in self.drawing.values()], complex)
        return float(np.abs(places - places[:1]).max(initial=0.0)) or 1.0

    def slider(self, name: str) -> Slider:
        """The slider of a name."""
        return next(slider for slider in self.sliders if slider.name == name)

    def ends(self, drive: PinDrive | SliderDrive) -> tuple[int, int]:
        """Numbers of the links that a drive's coordinate is counted from and of; of a gear's end too."""
        link, on = drive.links or (self.slider(drive.joint).link, self.slider(drive.joint).on)
        return self.index[on], self.index[link]

    @cached_property
    def slider_points(self) -> Mapping[str, str]:
        """Point of the block by the slider's name."""
        return {slider.name: slider.point for slider in self.sliders}

    @cached_property
    def welded_points(self) -> frozenset[str]:
        """Points at which all links that share them are welded, so that nothing turns there."""
        shared = Counter(point for link in self.links for point in link.points)
        welds = Counter(weld.point for weld in self.welds)
        return frozenset(point for point, count in welds.items() if count >= shared[point] - 1)

    def beam_number(self, link: str, number: int) -> int:
        """Place of a link's beam among all beams."""
        return next(k for k, (at, _) in enumerate(self.beams) if at == self.index[link]) + number
