"""Import of mechanisms from the program linkage_sim: JSON with bodies (each in body axes), joints and drivers."""

import cmath
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from exchange.foreign_mechanism import GROUND, Drive, ExchangeError, ForeignLink, ForeignMechanism, ForeignSlider, Names

SOURCE = "linkage_sim"
DEFAULT_SPEED = "60 rpm"  # speed of the drive that is assumed if the file has no driver
SUPPORTED_JOINTS = ("revolute", "fixed", "prismatic")
TRIES = 60  # number of random starting positions in the search for an assembly
MAX_GAP = 1e-9  # [m] a joint is closed if its gap is below MAX_GAP * max(1, size of the largest body / 1 m)
# as in linkage_sim: largest number of Newton steps, and allowed norm of the residual
MAX_STEPS, MAX_RESIDUAL = 50, 1e-10
# Step of difference quotients: DIFFERENCE rad for angles, DIFFERENCE * (size of the largest body) for lengths. Newton's
# method also treats singular values below DIFFERENCE * (largest singular value) as zero.
DIFFERENCE = 1e-6

Place = tuple[complex, float]  # origin [m] and angle [rad] of a body


class JointPair(Struct, frozen=True):
    """Joint between two bodies. `at_first` and `at_second` are the joined points, each in the axes of its own body.

    `axis` is the direction of a slider in the axes of the first body, or None for a pin. `turn` is the angle of the
    second body relative to the first body if this angle is constant, otherwise None.
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
        If the bodies cannot be assembled, or if there is neither a driver nor a link that turns on the ground.
    """
    bodies, notes = data["bodies"], []
    local = {name: _points(body) for name, body in bodies.items()}
    joints = {key: each for key, each in data["joints"].items() if each["type"] in SUPPORTED_JOINTS}
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
    positions, as_in_program = _assembled(list(local), list(pairs.values()), turns)
    if not as_in_program:
        notes.append(
            "linkage_sim stores no positions, and its solver does not converge: this is one possible assembly. For"
            " another one, move the points"
        )
    point_names, link_names = Names(), Names([GROUND])
    link_of_body = _links_of_bodies(local, joints)
    shared_names = _shared(joints)
    points: dict[str, complex] = {}
    members: dict[str, list[str]] = {link_of_body[body]: [] for body in local}
    for body, carried in local.items():
        for point, place in carried.items():
            name = point_names(shared_names.get((body, point), f"{body} {point}"), point)
            points[name] = positions[body][0] + cmath.exp(1j * positions[body][1]) * place
            if name not in members[link_of_body[body]]:
                members[link_of_body[body]].append(name)
    links = {
        link_names(body): ForeignLink(
            tuple(carried), *_mass([(bodies[part], positions[part]) for part in local if link_of_body[part] == body])
        )
        for body, carried in members.items()
        if body != GROUND
    }

    def link(body: str) -> str:
        return GROUND if link_of_body[body] == GROUND else link_names(link_of_body[body])

    slides = {
        f"slide_{key}".replace(" ", "_"): ForeignSlider(
            link(pair.second), link(pair.first),
            point_names(
                shared_names.get((pair.second, joints[key]["point_j"]), f"{pair.second} {joints[key]['point_j']}")
            ),
            pair.axis * cmath.exp(1j * positions[pair.first][1]),
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
        notes.append(f"no drive in the file: the first link on the ground is turned at {DEFAULT_SPEED}")
        turning = next((p.second for p in pairs.values() if p.first == GROUND and p.axis is None), None)
        if turning is None:
            raise ExchangeError("this file of linkage_sim has no driver, and no link that turns on the ground")
        drives = (Drive({"link": link(turning)}, DEFAULT_SPEED),)
    ground = tuple(members.get(GROUND, ()))
    return ForeignMechanism(
        title, SOURCE, "m", points, ground, links, slides=slides, drives=drives, gravity=True, notes=tuple(notes)
    )  # linkage_sim always applies gravity along -y


def _points(body: Mapping[str, Any]) -> dict[str, complex]:
    tables = (body.get("attachment_points") or {}, body.get("coupler_points") or {})
    return {name: complex(*place) for table in tables for name, place in table.items()}


def _mass(parts: Sequence[tuple[Mapping[str, Any], Place]]) -> tuple[float | None, complex | None, float | None]:
    """Return mass, centre of mass and inertia of the bodies that form a link, including point masses.

    Return (None, None, None) if the mass is zero.
    """
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


def _links_of_bodies(local: Mapping[str, Any], joints: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """Return, for each body, the body that represents the link to which the body belongs.

    Bodies that fixed joints connect form one link. If the ground is one of the connected bodies, the ground represents
    the link; otherwise, the first body does.
    """
    link_of_body = {body: body for body in local}
    for each in joints.values():
        if each["type"] == "fixed":
            one, other = link_of_body[each["body_i"]], link_of_body[each["body_j"]]
            keep, merged = (other, one) if other == GROUND else (one, other)
            link_of_body = {body: keep if now == merged else now for body, now in link_of_body.items()}
    return link_of_body


def _shared(joints: Mapping[str, Mapping[str, Any]]) -> dict[tuple[str, str], str]:
    """Return a name for each pair (body, point) at a pin or fixed joint. Joined points have the same name."""
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
    """Return the initial positions of all bodies, and whether linkage_sim would find the same positions.

    A file of linkage_sim contains no positions. In the returned positions, all joints are closed, and all drivers have
    their initial angles. Like linkage_sim, this function starts Newton's method with every body at the origin. If
    Newton's method fails, the search continues from random positions.
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
        """Return the gaps of all joints [m], and the angular errors of joints and drivers [rad]."""
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
    """Find positions with closed joints by Newton's method with minimum-norm steps. Return None without convergence."""
    steps = DIFFERENCE * np.diag(np.tile([size, size, 1.0], len(x) // 3))
    for _ in range(MAX_STEPS):
        gap = gaps(x)
        if np.linalg.norm(gap) < MAX_RESIDUAL:
            return x
        slopes = [(gaps(x + step) - gaps(x - step)) / (2.0 * step.sum()) for step in steps]
        x = x - np.linalg.lstsq(np.transpose(slopes), gap, rcond=DIFFERENCE)[0]
    return None


def _searched(gaps: Callable[[Any], Any], bodies: int, size: float) -> Any:
    """Find positions with closed joints by least squares, starting from random positions."""
    from scipy.optimize import least_squares

    random, scale = np.random.default_rng(0), np.tile([size, size, np.pi], bodies)
    for _ in range(TRIES):
        start = scale * random.uniform(-1, 1, 3 * bodies)
        best = least_squares(gaps, start, x_scale=scale, xtol=1e-15, ftol=1e-15, gtol=1e-15)
        if np.abs(best.fun).max(initial=0) < MAX_GAP * max(size, 1.0):
            return best.x
    raise ExchangeError("the bodies of this file of linkage_sim cannot be assembled")
