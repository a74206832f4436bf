"""Mechanisms of linkage_sim, as JSON of bodies, joints and drivers in SI units, each body in axes of its own."""

from __future__ import annotations

import cmath
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from exchange.drawing import Body, Drawing, Drive, ExchangeError, Names, Slide

SOURCE = "linkage_sim"
GROUND = "ground"
TURN = "60 rpm"
TRIES = 60  # of places to begin with
CLOSED = 1e-9  # of the largest body, gaps of joints that count as closed


@dataclass(frozen=True)
class Pair:
    """A joint between a point of one body and one of another, in their axes; `axis` where it slides, in the first's.

    `turn` is the angle of the second body from the first where it may not turn, else None.
    """

    first: str
    second: str
    at_first: complex
    at_second: complex
    axis: complex | None
    turn: float | None


def of_linkage_sim(data: Mapping[str, Any], title: str) -> Drawing:
    """The mechanism in a JSON object of linkage_sim; ExchangeError where it is none."""
    try:
        return _drawing(data, title)
    except (KeyError, TypeError, ValueError, StopIteration) as error:
        raise ExchangeError(f"no mechanism of linkage_sim that can be read: {error!r}") from None


def _drawing(data: Mapping[str, Any], title: str) -> Drawing:
    bodies = data["bodies"]
    notes = ["linkage_sim keeps bodies, not where they are: their places were searched for, the first assembly found"]
    local = {name: _points(body) for name, body in bodies.items()}
    joints = {key: each for key, each in data["joints"].items() if each["type"] in ("revolute", "fixed", "prismatic")}
    pairs = {key: _pair(each, local) for key, each in joints.items()}
    for key, each in data["joints"].items():
        if key not in joints and each["type"] != "revolute_driver":
            notes.append(f"joint {key} ({each['type']}) is left out")
    turns = {
        (each["body_i"], each["body_j"]): float(each.get("theta_0", 0))
        for each in data.get("drivers", {}).values()
        if each["type"] == "constant_speed"
    }
    where = _placed(
        list(local), list(pairs.values()), turns, max(abs(p) for carried in local.values() for p in carried.values())
    )
    names, called = Names(), Names(["ground"])
    same = _shared(joints)
    points: dict[str, complex] = {}
    members: dict[str, list[str]] = {}
    for body, carried in local.items():
        for point, place in carried.items():
            key = same.get((body, point), f"{body} {point}")
            name = names(key, point)
            points[name] = where[body][0] + cmath.exp(1j * where[body][1]) * place
            members.setdefault(body, [])
            if name not in members[body]:
                members[body].append(name)
    links = {
        called(body): Body(tuple(carried), float(bodies[body].get("mass") or 0) or None)
        for body, carried in members.items()
        if body != GROUND
    }
    slides = {
        f"slide_{key}".replace(" ", "_"): Slide(
            called(pair.second), GROUND if pair.first == GROUND else called(pair.first),
            names(same.get((pair.second, joints[key]["point_j"]), f"{pair.second} {joints[key]['point_j']}")),
            pair.axis * cmath.exp(1j * where[pair.first][1]),
        )
        for key, pair in pairs.items() if pair.axis is not None
    }  # fmt: skip
    if any(each["type"] == "fixed" for each in joints.values()):
        notes.append("fixed joints are left out: a [welds] table of their point does it")
    drives = tuple(
        Drive({"link": called(each["body_j"]), **({} if each["body_i"] == GROUND else {"on": called(each["body_i"])})},
              f"{float(each['omega']):.12g} rad/s")
        for each in data.get("drivers", {}).values() if each["type"] == "constant_speed"
    )  # fmt: skip
    if data.get("forces"):
        notes.append(f"forces that are left out: {len(data['forces'])}; put them under [[loads]] and [[springs]]")
    if not drives:
        notes.append(f"no drive in the file: the first link on the ground is turned at {TURN}")
        first = next(pair.second for pair in pairs.values() if pair.first == GROUND and pair.axis is None)
        drives = (Drive({"link": called(first)}, TURN),)
    return Drawing(title, SOURCE, "m", points, tuple(members.get(GROUND, ())), links, slides=slides, drives=drives,
                   notes=tuple(notes))  # fmt: skip


def _points(body: Mapping[str, Any]) -> dict[str, complex]:
    tables = (body.get("attachment_points") or {}, body.get("coupler_points") or {})
    return {name: complex(*place) for table in tables for name, place in table.items()}


def _pair(each: Mapping[str, Any], local: Mapping[str, Mapping[str, complex]]) -> Pair:
    first, second = each["body_i"], each["body_j"]
    slides = each["type"] == "prismatic"
    return Pair(
        first, second, local[first][each["point_i"]], local[second][each["point_j"]],
        complex(*each["axis_local_i"]) if slides else None,
        None if each["type"] == "revolute" else float(each.get("delta_theta_0", 0)),
    )  # fmt: skip


def _shared(joints: Mapping[str, Mapping[str, Any]]) -> dict[tuple[str, str], str]:
    """Points of bodies that are one point of the drawing, as a pin joins them: each with the name of the first."""
    of: dict[tuple[str, str], str] = {}
    for each in joints.values():
        if each["type"] != "prismatic":
            a, b = (each["body_i"], each["point_i"]), (each["body_j"], each["point_j"])
            keep = of.get(a) or of.get(b) or " ".join(a)
            gone = {of.get(a), of.get(b)} - {None, keep}
            of |= {point: keep for point, name in of.items() if name in gone} | {a: keep, b: keep}
    return of


def _placed(
    bodies: list[str], pairs: list[Pair], turns: Mapping[tuple[str, str], float], size: float
) -> dict[str, tuple[complex, float]]:
    """Place and angle of every body at which all joints close and driven ones stand at their start."""
    from scipy.optimize import least_squares

    moving = [body for body in bodies if body != GROUND]

    def placed(x: Any) -> dict[str, tuple[complex, float]]:
        at = {body: (complex(*x[3 * n : 3 * n + 2]) * size, float(x[3 * n + 2])) for n, body in enumerate(moving)}
        return {GROUND: (0j, 0.0), **at}

    def gaps(x: Any) -> Any:
        at = placed(x)
        out: list[Any] = []
        for pair in pairs:
            (p, a), (q, b) = at[pair.first], at[pair.second]
            gap = (q + cmath.exp(1j * b) * pair.at_second - p - cmath.exp(1j * a) * pair.at_first) / size
            across = (
                gap if pair.axis is None else (gap * (cmath.exp(1j * a) * pair.axis / abs(pair.axis)).conjugate()).imag
            )
            out += [across.real, across.imag] if pair.axis is None else [across]
            if pair.turn is not None:
                out.append(np.sin(b - a - pair.turn))
        out += [2 * np.sin((at[j][1] - at[i][1] - angle) / 2) for (i, j), angle in turns.items()]
        return np.array(out)

    random = np.random.default_rng(0)
    for _ in range(TRIES):
        start = random.uniform(-1, 1, 3 * len(moving))
        start[2::3] *= np.pi
        best = least_squares(gaps, start, xtol=1e-15, ftol=1e-15, gtol=1e-15)
        if np.abs(best.fun).max(initial=0) < CLOSED:
            return placed(best.x)
    raise ExchangeError("its bodies could not be put together")
