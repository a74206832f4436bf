"""Proposals for balancing: counterweights, discs and springs on links that rotate about ground pins."""

import math
from cmath import rect
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from kinelast.answers.results import Results
from kinelast.scene.document import Document
from kinelast.scene.links import drawn_direction, drawn_places
from kinelast.values.numbers import DisplayUnits, coordinate, percent, quantity
from kinelast.values.reading import reading
from machine import drives
from machine.drives import Balance, balanced
from rigid import Motion, position_of
from rigid.plane import cross

MIN_AMOUNT = 1e-9  # smaller amounts, relative to the largest, are round-off


def balance_figures(results: Results) -> dict[str, Any]:
    """Return proposals for balancing a machine as plain data, computed by `machine.drives.balanced`.

    `shaking_force` and `weight` propose counterweights on the links, as first moments of mass. `shaking_moment`
    proposes discs in addition to the counterweights of `shaking_force`. A disc with a negative moment of inertia has to
    rotate in the opposite direction. `drive_effort` proposes a torsion spring at the pin of one link. Each proposal
    contains the peaks before and after balancing, and the ratio of the root mean squares after and before balancing.
    `words` describes the proposals in text.
    """
    motion, pins = results.motion, drives.pivoted_links(results.motion)
    if not pins or not results.cycle.counted.all():
        why = "no link rotates about a ground pin" if not pins else "some positions are excluded"
        return {"words": [f"balancing is not possible: {why}"]}
    weight = results.cycle.weights
    force = balanced(
        drives.inertia_force(motion), [each for at in pins for each in drives.shaking_influences(motion, at)], weight
    )
    proposals: dict[str, Any] = {"shaking_force": _proposal(force, "N", _counterweights(results, pins, force))}
    moment = _moment(motion, pins, force, weight)
    proposals["shaking_moment"] = _proposal(moment, "N m", _discs(results, pins, moment))
    units = [unit for *_, unit in results.drive_words]
    if abs(results.mechanism.gravity) and len(set(units)) == 1:
        held = balanced(
            drives.weight_effort(motion), [each for at in pins for each in drives.weight_influences(motion, at)], weight
        )
        proposals["weight"] = _proposal(held, units[0], _counterweights(results, pins, held))
    if len(set(units)) == 1:
        rows = zip(results.cycle.efforts, results.drive_words, strict=True)
        efforts = np.array([results.figures.rounded(effort, unit) for effort, (*_, unit) in rows])
        swings = [at for at in pins if not _makes_full_turns(motion, at)]
        springs = {at: balanced(efforts, drives.spring_influences(motion, at), weight) for at in swings}
        soft = {at: each for at, each in springs.items() if each.amounts[0] > 0}
        if soft:
            at, best = min(soft.items(), key=lambda each: each[1].share)
            proposals["drive_effort"] = _proposal(best, units[0], _spring(results, at, pins[at], best))
    return {**proposals, "words": [*_words(proposals, results.scene.shown_in)]}


def balance_text(document: Document, proposals: Mapping[str, Any]) -> str:
    """Return the text of the scene with additional counterweights, which reduce the shaking force.

    Each counterweight is a rigid link, welded to the link that it balances at the ground pin or another point. The
    masses become variables of the table `[optimize]`. If the scene has no variables yet, the optimization minimizes the
    shaking force. The text is empty if a counterweight cannot be added.

    Parameters
    ----------
    proposals
        The dictionary that `balance_figures` returned for this scene.
    """
    import tomlkit

    file, taken = tomlkit.parse(document.text()), {*document.tables.get("welds", ())}
    variables = {}
    for part in proposals.get("shaking_force", {}).get("parts", ()):
        name, mass = f"{part['link']}_counterweight", part["mass"].value
        place = _drawn_place(document, part)
        at = next(
            (point for point in (part["pin"], *document.table.links[part["link"]].points) if point not in taken), ""
        )
        if place is None or not at or name in document.table.links:
            return ""
        taken.add(at)
        _put(file, "points", name, [f"{float(each)!r} m" for each in (place.real, place.imag)])
        link = {"points": [at, name], "rigid": True, "mass": f"{mass!r} kg", "center": name, "inertia": 0.0}
        _put(file, "links", name, link)
        _put(file, "welds", at, {"links": [part["link"], name]})
        variables[f"links.{name}.mass"] = ["1 g", f"{2 * mass:.4g} kg"]
    if not variables:
        return ""
    if not document.table.optimize.variables:
        _put(file, "optimize", "minimize", "shaking_force")
    _put(file, "optimize", "variables", {**dict(file["optimize"].get("variables", {})), **variables})
    return f"# The scene {document.name} with counterweights of its shaking force, as proposed.\n" + tomlkit.dumps(file)


def _put(file: Any, table: str, key: str, value: Any) -> None:
    """Set a key of a table in the parsed file, adding the table if it is missing."""
    if table not in file:
        file[table] = {}
    file[table][key] = value


def _drawn_place(document: Document, part: Mapping[str, Any]) -> complex | None:
    """Return the position of a counterweight as drawn, or None if the drawing does not fix the angle of its link."""
    mechanism, places = document.scene.mechanism, drawn_places(document.table)
    direction = drawn_direction(mechanism.links[mechanism.index[part["link"]]], places)
    if direction is None or part["pin"] not in places:
        return None
    return complex(places[part["pin"]] + direction * rect(part["radius"].value, part["direction"].value))


def _moment(motion: Motion, pins: Mapping[int, str], force: Balance, weight: Any) -> Balance:
    """Return the discs that balance the shaking moment remaining after `force` balances the shaking force."""
    left = drives.inertia_moment(motion)
    for (at, pin), pair in zip(pins.items(), force.amounts.reshape(-1, 2), strict=True):
        pushes = (amount * each for amount, each in zip(pair, drives.shaking_influences(motion, at), strict=True))
        left = left + cross(position_of(motion, 0, pin), sum(pushes, start=0j))
    return balanced(left, [-motion.angular_acceleration[at] for at in pins], weight)


def _makes_full_turns(motion: Motion, at: int) -> bool:
    """Return whether a link rotates by more than half a turn, so that it cannot have a torsion spring."""
    angle = np.unwrap(np.angle(motion.direction[at]))
    return bool(abs(angle[-1] - angle[0]) > np.pi)


def _proposal(balance: Balance, unit: str, parts: list[dict[str, Any]]) -> dict[str, Any]:
    before, after = (float(np.abs(values).max()) for values in (balance.before, balance.after))
    return {"before": reading(before, unit), "after": reading(after, unit), "left": balance.share, "parts": parts}


def _counterweights(results: Results, pins: Mapping[int, str], balance: Balance) -> list[dict[str, Any]]:
    """Return counterweights for the links: first moment of mass to add, a radius, and the mass at this radius."""
    rows = []
    largest = float(np.abs(balance.amounts).max(initial=0.0))
    for (at, pin), pair in zip(pins.items(), balance.amounts.reshape(-1, 2), strict=True):
        link, moment = results.mechanism.links[at], complex(*pair)
        if abs(moment) <= MIN_AMOUNT * largest:
            continue
        radius = max(abs(complex(place) - complex(link.points[pin])) for place in link.points.values()) / 2 or 1.0
        rows.append(
            {
                "link": link.name,
                "pin": pin,
                "moment": reading(abs(moment), "kg m"),
                "direction": reading(math.atan2(moment.imag, moment.real), "rad"),
                "radius": reading(radius, "m"),
                "mass": reading(abs(moment) / radius, "kg"),
            }
        )
    return rows


def _discs(results: Results, pins: Mapping[int, str], balance: Balance) -> list[dict[str, Any]]:
    """Return the moments of inertia of the discs to add to the links."""
    names = [results.mechanism.links[at].name for at in pins]
    pairs = zip(names, pins.values(), balance.amounts.tolist(), strict=True)
    return [{"link": name, "pin": pin, "disc": reading(amount, "kg m^2")} for name, pin, amount in pairs]


def _spring(results: Results, at: int, pin: str, balance: Balance) -> list[dict[str, Any]]:
    """Return the stiffness of the torsion spring, and the angle of the link at which the spring is unloaded."""
    stiffness, moment = balance.amounts.tolist()
    slack = float(np.angle(results.motion.direction[at, 0])) - moment / stiffness
    link = results.mechanism.links[at].name
    given = {"stiffness": reading(stiffness, "N m/rad"), "angle": reading(slack, "rad")}
    return [{"link": link, "pin": pin, **given}]


def _words(proposals: Mapping[str, Any], shown_in: DisplayUnits) -> Iterator[str]:
    """Yield sentences that describe the proposals."""
    for key, name in (("shaking_force", "shaking force"), ("weight", "effort of the weights")):
        if key in proposals and proposals[key]["before"].value:
            parts = (
                f"{quantity(each['mass'].value, 'kg', 3, shown_in)} at "
                f"{quantity(each['radius'].value, 'm', 3, shown_in)} from {each['pin']} on "
                f"{each['link']}, {coordinate(each['direction'].value, 'rad')} from its axis"
                for each in proposals[key]["parts"]
            )
            yield f"balance of the {name}: {'; '.join(parts)} {_remainder_words(proposals[key], shown_in)}"
    if "drive_effort" in proposals:
        (each,) = proposals["drive_effort"]["parts"]
        spring = f"{quantity(each['stiffness'].value, 'N m', 3, shown_in)}/rad at {each['pin']} on {each['link']}"
        slack = coordinate(each["angle"].value, "rad")
        left = _remainder_words(proposals["drive_effort"], shown_in)
        yield f"balance of the drive: a spring of {spring}, slack at {slack}, {left}"


def _remainder_words(row: Mapping[str, Any], shown_in: DisplayUnits) -> str:
    if row["left"] < MIN_AMOUNT:
        return "leaves nothing"
    before, after = (quantity(row[key].value, row[key].unit, 3, shown_in) for key in ("before", "after"))
    return f"leaves {percent(row['left'])} as root mean square, at most {after} of {before}"
