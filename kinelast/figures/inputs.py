"""Inputs of a scene, as figures: speeds, gravity, loads, point masses, materials, theory."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from kinelast.figures.figure import figure
from kinelast.figures.results import Results
from rigid import LineLoad, PointLoad, Resistance, TorsionSpring

STEADY = 1e-9  # share of the speed by which a steady drive may seem to change


def input_figures(results: Results) -> dict[str, Any]:
    """Inputs of a scene that the reader of a report needs beside its links."""
    mechanism, sections = results.mechanism, results.deflection.sections
    gravity = complex(mechanism.gravity)
    return {
        "theory": "Timoshenko" if any(np.isfinite(section.kGA) for section in sections) else "Euler-Bernoulli",
        "materials": {
            name: {
                "E": figure(stuff.E, "Pa"),
                "density": figure(stuff.density, "kg/m^3"),
                "yield": figure(np.nan if stuff.yield_stress is None else stuff.yield_stress, "Pa"),
            }
            for name, stuff in results.scene.materials.items()
        },
        "gravity": {"x": figure(gravity.real, "m/s^2"), "y": figure(gravity.imag, "m/s^2")},
        "drives": {
            name: _speed(least, most, unit)
            for (name, _, unit, _), least, most in zip(results.drive_words, *results.figures.rates, strict=True)
        },
        "point_masses": [
            {"link": link.name, "point": lump.point, "mass": figure(lump.mass, "kg")}
            for link in mechanism.links[1:]
            for lump in link.lumps
        ],
        "loads": [dict(_load(load)) for load in mechanism.loads],
    }


def _speed(least: float, most: float, unit: str) -> dict[str, Any]:
    """Greatest speed of a drive with its sign, and whether it is the same throughout."""
    fastest = least if abs(least) > abs(most) else most
    return {"speed": figure(fastest, f"{unit}/s"), "steady": bool(most - least <= STEADY * abs(fastest))}


def _load(load: Any) -> Iterator[tuple[str, Any]]:
    """Kind of a load, the link and place it acts on, how large it is before any law in time, and where it points."""
    resists = isinstance(load, Resistance)
    yield "resists", ("one way" if load.one_way else "both ways") if resists else None
    load = load.load if resists else load
    yield "kind", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", type(load).__name__).lower()
    yield "link", getattr(load, "link", "")
    yield "place", getattr(load, "point", getattr(load, "at", ""))
    yield "varies", getattr(load, "law", None) is not None  # with time, an angle or a slide
    force: Any = 0.0
    sizes: list[tuple[Any, str]]
    if isinstance(load, PointLoad):
        force = load.force
        sizes = [(abs(force), "N"), (load.moment, "N m")]
    elif isinstance(load, LineLoad):
        force = load.start or load.end
        sizes = [(abs(load.start), "N/m"), (abs(load.end), "N/m")]
    else:
        turned = isinstance(load, TorsionSpring)
        per = ("N m/rad", "N m s/rad", "N m") if turned else ("N/m", "N s/m", "N")
        sizes = list(zip((load.stiffness, load.damping, load.preload), per, strict=True))
    given = [figure(size, unit) for size, unit in sizes if size or isinstance(load, LineLoad)]
    yield "sizes", given
    yield "towards", figure(np.angle(force), "rad") if force else None
