"""How far the machine's output is from where rigid links would have it, as figures."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from elastic.assessment import angle_error
from kinelast.figures.figure import largest
from kinelast.figures.results import Results
from rigid import GROUND


def point_figures(results: Results) -> dict[str, dict[str, Any]]:
    """Per point that moves its largest displacement, and how much of it is along the point's path and off it."""
    return {
        point: {
            "displacement": largest(results, np.abs(deviation.displacement), "m"),
            "along_path": largest(results, deviation.along, "m"),
            "off_path": largest(results, deviation.normal, "m"),
        }
        for point, deviation in results.deviations.items()
    }


def angle_figures(results: Results) -> dict[str, dict[str, Any]]:
    """Per moving link the largest error of its angle, at that of its points where it is largest."""
    found = {}
    for link in results.mechanism.links[1:]:
        turned = [
            largest(results, angle_error(results.deflection, link.name, point), "rad", point=point)
            for point in link.points
        ]
        found[link.name] = max(turned, key=lambda each: abs(each["value"] or 0.0))
    return found


def output_figure(
    results: Results, points: dict[str, dict[str, Any]], angles: dict[str, dict[str, Any]]
) -> dict[str, Any] | None:
    """Error of what the machine is there for: as the scene names it, or as far as that can be told from its form.

    `guessed` where it is told from the form. Of the traced points, which belong to one link alone, the one that strays
    most; else of what slides on the ground, or else turns on it, without being driven. What nothing displaces is not
    what the machine is there for.
    """
    named = results.scene.output
    if named is not None and named.point:
        return {"kind": "point", "name": named.point, "guessed": False, **points[named.point]["displacement"]}
    if named is not None:
        return {"kind": "angle", "name": named.link, "guessed": False, **angles[named.link]}
    for names, what in ((_traced(results), "point"), (_slid(results), "slide")):
        moved = [name for name in names if points[name]["displacement"]["value"]]
        if moved:
            name = max(moved, key=lambda each: points[each]["displacement"]["value"])
            return {"kind": what, "name": name, "guessed": True, **points[name]["displacement"]}
    driven = {drive.name for drive in results.mechanism.drives if drive.turns}
    ground = results.mechanism.links[0].points
    turned = [
        link.name for link in results.mechanism.links[1:] if ground.keys() & link.points and link.name not in driven
    ]
    turned = [name for name in turned if angles[name]["value"]]
    if not turned:
        return None
    name = max(turned, key=lambda each: abs(angles[each]["value"]))
    return {"kind": "angle", "name": name, "guessed": True, **angles[name]}


def _traced(results: Results) -> Iterator[str]:
    """Points of one link alone that no slider is at."""
    carried = [point for link in results.mechanism.links for point in link.points]
    at_sliders = {slider.point for slider in results.mechanism.sliders}
    return (point for point in results.deviations if carried.count(point) == 1 and point not in at_sliders)


def _slid(results: Results) -> Iterator[str]:
    """Points that slide on the ground without being driven."""
    driven = {drive.name for drive in results.mechanism.drives if not drive.turns}
    return (
        slider.point
        for slider in results.mechanism.sliders
        if slider.on == GROUND and slider.name not in driven and slider.point in results.deviations
    )
