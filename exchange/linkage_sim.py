"""Mechanisms of linkage_sim, stored as JSON with bodies (each in its own axes), joints and drivers in SI units."""

import cmath
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from exchange.drawing import GROUND, Drive, ExchangeError, ForeignLink, ForeignMechanism, ForeignSlider, Names

SOURCE = "linkage_sim"
TURN = "60 rpm"
READ = ("revolute", "fixed", "prismatic")  # supported joint types
TRIES = 60  # number of random starts in the search for an assembly
MAX_GAP = 1e-9  # largest gap of a closed joint / size of the largest body
MAX_STEPS, MAX_RESIDUAL = 50, 1e-10  # limits of the solver of linkage_sim, which starts with all bodies at the origin
DIFFERENCE = 1e-6  # step of difference quotients [rad], or for lengths relative to the size of the largest body

Place = tuple[complex, float]  # origin and angle of a body


@dataclass(frozen=True)
class JointPair:
    """Joint between points of two bodies, each given in the axes of its body.

    `axis` is the direction of a slider in the axes of the first body, or None. `turn` is the angle of the second body
    relative to the first if it is constant, or None.
    """

    first: str
    second: str
    at_first: complex
    at_second: complex
    axis: complex | None
    turn: float | None


def of_linkage_sim(data: Mapping[str, Any], title: str) -> ForeignMechanism:
    """Return the mechanism in a JSON object of linkage_sim.

    Raises
    ------
    ExchangeError
        If the bodies cannot be assembled.
    """
    bodies, notes = data["bodies"], []
    local = {name: _points(body) for name, body in bodies.items()}
    joints = {key: each for key, each in data["joints"].items() if each["type"] in READ}
    pairs = {key: _pair(each, local) for key, each in joints.items()}
    for key, each in data["joints"].items():
        if key not in joints and each["type"] != "revolute_driver":
            notes.append(f"joint {key} ({each['type']}) is left out")
    drivers = [each for each in data.get("drivers", {}).values() if each["type"] == "constant_speed"]
    notes += [
        f"the driver {key} ({each['type']}) is left out"
        for key, each in data.get("drivers", {}).items()
        if each["type"] != "constant_speed"
    ]
    turns = {(each["body_i"], each["body_j"]): float(each.get("theta_0", 0)) for each in drivers}
    where, own = _assembled(list(local), list(pairs.values()), turns)
    if not own:
        notes.append(
            "linkage_sim stores no positions, and its solver does not converge: this is one possible assembly. For"
            " another one, move the points"
        )
    names, called = Names(), Names([GROUND])
    host = _hosts(local, joints)
    same = _shared(joints)
    points: dict[str, complex] = {}
    members: dict[str, list[str]] = {host[body]: [] for body in local}
    for body, carried in local.items():
        for point, place in carried.items():
            name = names(same.get((body, point), f"{body} {point}"), point)
            points[name] = where[body][0] + cmath.exp(1j * where[body][1]) * place
            if name not in members[host[body]]:
                members[host[body]].append(name)
    links = {
        called(body): ForeignLink(
            tuple(carried), *_mass([(bodies[part], where[part]) for part in local if host[part] == body])
        )
        for body, carried in members.items()
        if body != GROUND
    }

    def link(body: str) -> str:
        return GROUND if host[body] == GROUND else called(host[body])

    slides = {
        f"slide_{key}".replace(" ", "_"): ForeignSlider(
            link(pair.second), link(pair.first),
            names(same.get((pair.second, joints[key]["point_j"]), f"{pair.second} {joints[key]['point_j']}")),
            pair.axis * cmath.exp(1j * where[pair.first][1]),
        )
        for key, pair in pairs.items() if pair.axis is not None
    }  # fmt: skip
    ends = [(link(each["body_i"]), link(each["body_j"]), float(each["omega"])) for each in drivers]
    drives = tuple(
        Drive({"link": second, **({} if first == GROUND else {"on": first})}, f"{speed:.12g} rad/s")
        for first, second, speed in ends
    )
    forces = [force for force in data.get("forces") or () if force.get("type") != "Gravity"]
    if forces:
        notes.append(f"forces that are left out: {len(forces)}; put them under [[loads]] and [[springs]]")
    if not drives:
        notes.append(f"no drive in the file: the first link on the ground is turned at {TURN}")
        turning = next((p.second for p in pairs.values() if p.first == GROUND and p.axis is None), None)
        if turning is None:
            raise ExchangeError("this file of linkage_sim has no driver, and no link that turns on the ground")
        drives = (Drive({"link": link(turning)}, TURN),)
    ground = tuple(members.get(GROUND, ()))
    return ForeignMechanism(
        title, SOURCE, "m", points, ground, links, slides=slides, drives=drives, gravity=True, notes=tuple(notes)
    )  # linkage_sim applies gravity along -y to every file


def _points(body: Mapping[str, Any]) -> dict[str, complex]:
    tables = (body.get("attachment_points") or {}, body.get("coupler_points") or {})
    return {name: complex(*place) for table in tables for name, place in table.items()}


def _mass(parts: Sequence[tuple[Mapping[str, Any], Place]]) -> tuple[float | None, complex | None, float | None]:
    """Return the total mass, centre and inertia of the bodies that form a link, including their point masses."""
    lumps = []
    for body, (origin, angle) in parts:
        turn = cmath.exp(1j * angle)
        inertia = float(body.get("izz_cg", body.get("Izz_cg", 0)) or 0)
        lumps.append((float(body.get("mass") or 0), origin + turn * complex(*body.get("cg_local", (0, 0))), inertia))
        lumps += [
            (float(lump["mass"]), origin + turn * complex(*lump["local_pos"]), 0.0)
            for lump in body.get("point_masses") or ()
        ]
    mass = sum(lump[0] for lump in lumps)
    if not mass:
        return None, None, None
    center = sum(part * place for part, place, _ in lumps) / mass
    return mass, center, sum(own + part * abs(place - center) ** 2 for part, place, own in lumps)


def _pair(each: Mapping[str, Any], local: Mapping[str, Mapping[str, complex]]) -> JointPair:
    first, second = each["body_i"], each["body_j"]
    slides = each["type"] == "prismatic"
    return JointPair(
        first, second, local[first][each["point_i"]], local[second][each["point_j"]],
        complex(*each["axis_local_i"]) if slides else None,
        None if each["type"] == "revolute" else float(each.get("delta_theta_0", 0)),
    )  # fmt: skip


def _hosts(local: Mapping[str, Any], joints: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """Return for each body the first body that is connected to it by fixed joints, or the ground if it is connected."""
    host = {body: body for body in local}
    for each in joints.values():
        if each["type"] == "fixed":
            one, other = host[each["body_i"]], host[each["body_j"]]
            keep, merged = (other, one) if other == GROUND else (one, other)
            host = {body: keep if now == merged else now for body, now in host.items()}
    return host


def _shared(joints: Mapping[str, Mapping[str, Any]]) -> dict[tuple[str, str], str]:
    """Return a common name for all points that joints make coincide, by body and point."""
    of: dict[tuple[str, str], str] = {}
    for each in joints.values():
        if each["type"] != "prismatic":
            a, b = (each["body_i"], each["point_i"]), (each["body_j"], each["point_j"])
            keep = of.get(a) or of.get(b) or " ".join(a)
            replaced = {of.get(a), of.get(b)} - {None, keep}
            of |= {point: keep for point, name in of.items() if name in replaced} | {a: keep, b: keep}
    return of


def _assembled(
    bodies: list[str], pairs: list[JointPair], turns: Mapping[tuple[str, str], float]
) -> tuple[dict[str, Place], bool]:
    """Return positions that close all joints with the drivers at their start, and whether linkage_sim finds the same.

    A file contains no positions. Like linkage_sim, this function starts Newton's method with every body at the origin.
    If that fails, it searches from random positions.
    """
    moving = [body for body in bodies if body != GROUND]
    if not moving:
        return {GROUND: (0j, 0.0)}, True
    size = max((abs(p) for pair in pairs for p in (pair.at_first, pair.at_second)), default=0.0) or 1.0

    column = {body: 3 * n for n, body in enumerate(moving)}

    def placed(x: Any) -> dict[str, Place]:
        at = {body: (complex(*x[n : n + 2]), float(x[n + 2])) for body, n in column.items()}
        return {GROUND: (0j, 0.0), **at}

    def gaps(x: Any) -> Any:
        """Return the gaps of all joints and drivers."""
        at, out = placed(x), []
        for pair in pairs:
            (p, a), (q, b) = at[pair.first], at[pair.second]
            gap = q + cmath.exp(1j * b) * pair.at_second - p - cmath.exp(1j * a) * pair.at_first
            if pair.axis is None:
                out += [gap.real, gap.imag]
            else:
                out.append((gap * (cmath.exp(1j * a) * pair.axis / abs(pair.axis)).conjugate()).imag)
            if pair.turn is not None:
                out.append(b - a - pair.turn)
        return np.array(out + [at[second][1] - at[first][1] - angle for (first, second), angle in turns.items()])

    start = _newton(gaps, np.zeros(3 * len(moving)), size)
    if start is not None:
        return placed(start), True
    return placed(_searched(gaps, len(moving), size)), False


def _newton(gaps: Callable[[Any], Any], x: Any, size: float) -> Any:
    """Solve for zero gaps by Newton's method with minimum-norm steps; return None if this fails."""
    steps = DIFFERENCE * np.diag(np.tile([size, size, 1.0], len(x) // 3))
    for _ in range(MAX_STEPS):
        gap = gaps(x)
        if np.linalg.norm(gap) < MAX_RESIDUAL:
            return x
        slopes = [(gaps(x + step) - gaps(x - step)) / (2.0 * step.sum()) for step in steps]
        x = x - np.linalg.lstsq(np.transpose(slopes), gap, rcond=DIFFERENCE)[0]
    return None


def _searched(gaps: Callable[[Any], Any], bodies: int, size: float) -> Any:
    """Solve for zero gaps from random starting positions."""
    from scipy.optimize import least_squares

    random, scale = np.random.default_rng(0), np.tile([size, size, np.pi], bodies)
    for _ in range(TRIES):
        start = scale * random.uniform(-1, 1, 3 * bodies)
        best = least_squares(gaps, start, x_scale=scale, xtol=1e-15, ftol=1e-15, gtol=1e-15)
        if np.abs(best.fun).max(initial=0) < MAX_GAP * max(size, 1.0):
            return best.x
    raise ExchangeError("the bodies of this file of linkage_sim cannot be assembled")
