"""Independent branch tracker for planar mechanisms: verified steps of all links at once, without the program's code.

The unknowns q are the positions and angles of all links except the ground and the crank. The equations F(q, t) = 0 are
those of the joints in ground coordinates; t is the crank's angle. From a known q0 at t0 the branch stays, for all t up
to t0 + h, in a ball of radius r about the tangent q0 + v (t - t0). Let A be the inverse of F_q at q0. The lengths of
the rotating vectors bound the second derivatives of F, so that

    |A F(q0 + v s, t0 + s)| <= m s^2 / 2,   |A (F_q(q0 + v s + d, t0 + s) - F_q(q0, t0))| <= z s + k |d|.

By the Newton-Kantorovich theorem, h < 1 / (z + sqrt(k m)) suffices. Each step is as long as this bound permits. Steps
get short near a singular position, and arbitrarily short at the end of the branch.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

SAFETY = 0.8  # step / longest verified step
MIN_STEP = 1e-11  # [rad] the branch ends if the step gets shorter
MAX_SLIDE = 0.5  # [m] displacement of a slide in a step, for mechanisms of about 1 m
MAX_STEPS = 10_000  # per turn
INFINITY = 1e3  # [m] a link beyond this distance runs to infinity, for mechanisms of about 1 m
STEPS_PER_METRE = 100  # additional steps of a link that runs to infinity
MAX_CORRECTIONS = 12  # of Newton's method
TOLERANCE = 3e-13  # of Newton's method


@dataclass(frozen=True)
class Body:
    """Points of a link in its own axes, and its drawn position and angle."""

    points: dict[str, complex]
    origin: complex
    angle: float


@dataclass(frozen=True)
class Tie:
    """A pin between two bodies, or, with a line in the axes of the first, a slide of the second along it."""

    one: int
    other: int
    at_one: complex
    at_other: complex
    line: complex = 0.0


@dataclass(frozen=True)
class Track:
    """Positions and angles of all bodies at the requested crank angles, shape (bodies, angles).

    Values beyond the `end` [rad] are nan; `end` is inf if the branch does not end. `shortest` is the shortest step
    [rad]. `unsure` is the uncertainty of the end if a link runs to infinity [rad].
    """

    origin: Any
    angle: Any
    end: float
    steps: int
    shortest: float
    unsure: float = 0.0


@njit(cache=True)
def _equations(q, t, crank, ends, arms, lines, turns, F, J, Ft):  # type: ignore[no-untyped-def]  # noqa: PLR0912, PLR0915
    """Compute the gaps of all ties and their derivatives by q and t. Body -1 is the ground, -2 the crank."""
    J[:] = 0.0
    Ft[:] = 0.0
    for i in range(len(ends)):
        at = np.zeros((2, 2))
        arm = np.zeros((2, 2))
        angle = np.zeros(2)
        for k in range(2):
            body = ends[i, k]
            x, y, th = 0.0, 0.0, 0.0
            if body >= 0:
                x, y, th = q[3 * body], q[3 * body + 1], q[3 * body + 2]
            elif body == -2:
                x, y, th = crank[0], crank[1], t
            c, s = np.cos(th), np.sin(th)
            ax, ay = arms[i, 2 * k], arms[i, 2 * k + 1]
            arm[k, 0], arm[k, 1] = c * ax - s * ay, s * ax + c * ay
            at[k, 0], at[k, 1] = x + arm[k, 0], y + arm[k, 1]
            angle[k] = th
        r = 2 * i
        if lines[i, 0] == 0.0 and lines[i, 1] == 0.0:
            for d in range(2):
                F[r + d] = at[1, d] - at[0, d]
            for k in range(2):
                sign = 2.0 * k - 1.0
                body = ends[i, k]
                if body >= 0:
                    J[r, 3 * body] += sign
                    J[r + 1, 3 * body + 1] += sign
                    J[r, 3 * body + 2] -= sign * arm[k, 1]
                    J[r + 1, 3 * body + 2] += sign * arm[k, 0]
                elif body == -2:
                    Ft[r] -= sign * arm[k, 1]
                    Ft[r + 1] += sign * arm[k, 0]
            continue
        c, s = np.cos(angle[0]), np.sin(angle[0])
        ux, uy = c * lines[i, 0] - s * lines[i, 1], s * lines[i, 0] + c * lines[i, 1]
        wx, wy = at[1, 0] - at[0, 0], at[1, 1] - at[0, 1]
        F[r] = ux * wy - uy * wx
        F[r + 1] = angle[1] - angle[0] - turns[i]
        one, other = ends[i, 0], ends[i, 1]
        # gap across the line; the line rotates with the first body about the body's origin
        by_one = -(ux * arm[0, 0] + uy * arm[0, 1]) - (ux * wx + uy * wy)
        by_other = ux * arm[1, 0] + uy * arm[1, 1]
        if one >= 0:
            J[r, 3 * one] += uy
            J[r, 3 * one + 1] -= ux
            J[r, 3 * one + 2] += by_one
            J[r + 1, 3 * one + 2] -= 1.0
        elif one == -2:
            Ft[r] += by_one
            Ft[r + 1] -= 1.0
        if other >= 0:
            J[r, 3 * other] -= uy
            J[r, 3 * other + 1] += ux
            J[r, 3 * other + 2] += by_other
            J[r + 1, 3 * other + 2] += 1.0
        elif other == -2:
            Ft[r] += by_other
            Ft[r + 1] += 1.0


@njit(cache=True)
def _rate(body, v):  # type: ignore[no-untyped-def]
    """Angular rate of a body per t, and 1 if its angle is unknown."""
    if body >= 0:
        return abs(v[3 * body + 2]), 1.0
    return (1.0, 0.0) if body == -2 else (0.0, 0.0)


@njit(cache=True)
def _second(q, t, v, crank, ends, arms, lines, M, B, K):  # type: ignore[no-untyped-def]
    """Bound the second derivatives of every equation: along the tangent, mixed, and within the unit ball."""
    for i in range(len(ends)):
        turn = np.zeros(2)
        free = np.zeros(2)
        size = np.zeros(2)
        for k in range(2):
            turn[k], free[k] = _rate(ends[i, k], v)
            size[k] = np.hypot(arms[i, 2 * k], arms[i, 2 * k + 1])
        r = 2 * i
        if lines[i, 0] == 0.0 and lines[i, 1] == 0.0:
            for d in range(2):
                M[r + d] = size[0] * turn[0] ** 2 + size[1] * turn[1] ** 2
                B[r + d] = size[0] * turn[0] * free[0] + size[1] * turn[1] * free[1]
                K[r + d] = size[0] * free[0] + size[1] * free[1]
            continue
        moved, loose, apart = 0.0, 0.0, 0.0
        place = np.zeros((2, 2))
        for k in range(2):
            body = ends[i, k]
            if body >= 0:
                moved += np.hypot(v[3 * body], v[3 * body + 1])
                loose += 1.5  # root of two, rounded up
                place[k] = q[3 * body : 3 * body + 2]
            elif body == -2:
                place[k] = crank
        apart = np.hypot(place[1, 0] - place[0, 0], place[1, 1] - place[0, 1]) + MAX_SLIDE
        # gap = Im(conj(e1 l) (w + e2 p)) with the vector w between the origins
        both, slack = turn[0] + turn[1], free[0] + free[1]
        M[r] = apart * turn[0] ** 2 + 2 * turn[0] * moved + size[1] * both**2
        B[r] = apart * turn[0] * free[0] + turn[0] * loose + free[0] * moved + size[1] * both * slack
        K[r] = apart * free[0] + 2 * free[0] * loose + size[1] * slack**2
        M[r + 1] = B[r + 1] = K[r + 1] = 0.0


@njit(cache=True)
def _track(q, t, angles, crank, ends, arms, lines, turns, found):  # type: ignore[no-untyped-def]  # noqa: PLR0915
    """Follow the branch to the angles in order; return its end, the steps, the shortest step and an error code."""
    n = len(q)
    F, Ft = np.zeros(n), np.zeros(n)
    J = np.zeros((n, n))
    M, B, K = np.zeros(n), np.zeros(n), np.zeros(n)
    steps, shortest, start = 0, np.inf, t
    for _ in range(MAX_CORRECTIONS):
        _equations(q, t, crank, ends, arms, lines, turns, F, J, Ft)
        change = np.linalg.solve(J, -F)
        q = q + change
        if np.abs(change).max() < TOLERANCE:
            break
    for number in range(len(angles)):
        while True:
            left = angles[number] - t
            if left == 0.0:
                break
            way = 1.0 if left > 0 else -1.0
            _equations(q, t, crank, ends, arms, lines, turns, F, J, Ft)
            A = np.linalg.inv(J)
            if not np.isfinite(A).all():
                return t, steps, 0.0, 0
            v = -A @ Ft
            _second(q, t, v, crank, ends, arms, lines, M, B, K)
            size = np.abs(A)
            m, z, k = (size @ M).max(), (size @ B).max(), (size @ K).max()
            root = np.sqrt(k * m)
            h = SAFETY / (z + root)
            fast = np.abs(v).max()
            far = np.abs(q).max()
            if far > INFINITY:
                return t + way * far / fast, steps, far / fast, 4
            # the bound of a slide holds only within MAX_SLIDE
            h = min(h, MAX_SLIDE / (4.0 * fast + 1e-300), 0.1)
            shortest = min(shortest, h)
            if h < MIN_STEP:
                return t, steps, shortest, 0
            last = h >= abs(left)
            h = min(h, abs(left))
            y = 0.5 * m * h * h
            s = 1.0 - z * h
            # radius of the ball that the Newton map maps into itself
            r = (s - np.sqrt(max(s * s - 2.0 * k * y, 0.0))) / k if k > 0 else y / s
            guess = q + way * h * v
            t = angles[number] if last else t + way * h
            here = guess.copy()
            good = False
            for _ in range(MAX_CORRECTIONS):
                _equations(here, t, crank, ends, arms, lines, turns, F, J, Ft)
                change = np.linalg.solve(J, -F)
                here = here + change
                if np.abs(change).max() < TOLERANCE * max(1.0, size.max()):
                    good = True
                    break
            if not good or not np.abs(here - guess).max() <= r + 1e-11 * size.max() or r > MAX_SLIDE / 4:
                return t - way * h, steps, shortest, 1 if good else 2
            q = here
            steps += 1
            if steps > MAX_STEPS * (1.0 + abs(t - start) / (2 * np.pi)) + STEPS_PER_METRE * far:
                return t, steps, shortest, 3
        found[number] = q
    return np.inf, steps, shortest, 0


def tracked(bodies: Sequence[Body], ties: Sequence[Tie], crank: int, start: float, angles: Any) -> Track:
    """Follow a mechanism from its drawing; body 0 is the ground, `crank` rotates about its own origin."""
    number = {0: -1, crank: -2}
    for at in range(len(bodies)):
        if at not in number:
            number[at] = len(number) - 2
    free = [at for at in range(len(bodies)) if number[at] >= 0]
    q = np.array([value for at in free for value in (bodies[at].origin.real, bodies[at].origin.imag, bodies[at].angle)])
    ends = np.array([[number[tie.one], number[tie.other]] for tie in ties])
    arms = np.array([[tie.at_one.real, tie.at_one.imag, tie.at_other.real, tie.at_other.imag] for tie in ties])
    lines = np.array([[complex(tie.line).real, complex(tie.line).imag] for tie in ties])
    angle = [start if at == crank else body.angle for at, body in enumerate(bodies)]
    turns = np.array([angle[tie.other] - angle[tie.one] for tie in ties])
    foot = np.array([bodies[crank].origin.real, bodies[crank].origin.imag])
    angles = np.asarray(angles, float)
    found = np.full((len(angles), len(q)), np.nan)
    if 2 * len(ties) != len(q):
        raise ValueError(f"{2 * len(ties)} equations for {len(q)} unknowns")
    end, steps, shortest, astray = _track(q, float(start), angles, foot, ends, arms, lines, turns, found)
    if astray not in (0, 4):
        raise ArithmeticError(f"step not verified at {end}: code {astray}")
    origin = np.zeros((len(bodies), len(angles)), complex)
    turned = np.zeros((len(bodies), len(angles)))
    origin[crank], turned[crank] = bodies[crank].origin, angles
    for k, at in enumerate(free):
        origin[at], turned[at] = found[:, 3 * k] + 1j * found[:, 3 * k + 1], found[:, 3 * k + 2]
    return Track(origin, turned, float(end), int(steps), float(shortest), 2.0 * shortest if astray == 4 else 0.0)
