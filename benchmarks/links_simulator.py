"""The simulator of the LINKS data set (Heyrani Nobari et al. 2022) beside this package, on its own kind of mechanisms.

`python benchmarks/links_simulator.py FOLDER`, with the path of a copy of its repository, which is no part of this one.
A mechanism of that data set is joints and bars: a motor turns a bar about the ground, every further joint hangs on two
earlier ones by a bar each. Both get the same random ones and turn them at the same 200 positions. It finds where the
joints are. Here the same bars, of steel, also get velocities, accelerations, loads, joint forces, and all six fields
along every bar.

Of its three solvers two are measured: the one for a mechanism at a time, on numpy, that its data set is made with, and,
where TensorFlow is installed, the one for batches of mechanisms of any structure, compiled, in single precision. What
else its file imports is not needed and may be missing.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import types
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import measuring
import numpy as np
from jobs import STEEL

from elastic import deflection
from rigid import Beam, Link, Mechanism, PinDrive, motion, position_of

POSITIONS, SPEED, MASS = 200, 10.0, 0.471  # of a turn, its end repeated, as there; [rad/s]; [kg/m]
THETA = np.linspace(0.0, 2.0 * np.pi, POSITIONS)
MARGIN = 0.9  # greatest cosine at a joint: nearer to stretched bars both lose digits
SOME, MANY = 20, 40  # mechanisms one by one, and in a batch
NEEDLESS = ("tqdm", "tqdm.autonotebook", "matplotlib", "matplotlib.pyplot", "matplotlib.animation",
            "matplotlib.patches", "sklearn", "sklearn.neighbors", "pymoo", "pymoo.factory", "requests", "svgpath2mpl",
            "tensorflow", "tensorflow.keras")  # fmt: skip


@dataclass(frozen=True, eq=False)
class Drawn:
    """Which joints have a bar between them, shape (N, N); where they are drawn, (N, 2); which are fixed, (N,)."""

    bars: Any
    places: Any
    fixed: Any


class _Nothing(types.ModuleType):
    """Stands for a package that is not installed: it has everything, and that does nothing."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *arguments, **_: arguments[0] if arguments else None


def simulator(folder: Path) -> tuple[Any, bool]:
    """Its file as a module, and whether TensorFlow is there."""
    there = True
    for name in NEEDLESS:
        try:
            importlib.import_module(name)
        except ImportError:
            there = there and not name.startswith("tensorflow")
            sys.modules[name] = _Nothing(name)
    sys.path.insert(0, str(folder))
    return importlib.import_module("sim"), there


def drawn(random: np.random.Generator, joints: int) -> Drawn:
    """A mechanism whose crank turns all the way: joint after joint, each where its two bars always reach."""
    bars, fixed = np.zeros((joints, joints)), np.zeros(joints, bool)
    at = np.zeros((joints, POSITIONS), complex)
    fixed[[0, 2]], bars[0, 1], bars[1, 0] = True, 1, 1
    at[0], at[1], at[2] = 0.4 + 0.4j, 0.4 + 0.4j + 0.1 * np.exp(1j * THETA), 0.7 + 0.45j
    joint = 3
    while joint < joints:
        place = complex(*random.random(2))
        if joint % 5 == 0:
            at[joint], fixed[joint] = place, True
            joint += 1
            continue
        one, two = random.choice(joint, 2, replace=False)
        if (fixed[one] and fixed[two]) or abs(at[one, 0] - at[two, 0]) < 0.05:
            continue
        course = _apex(at[one], at[two], place)
        if np.isfinite(course).all():
            at[joint] = course
            for other in (one, two):
                bars[joint, other] = bars[other, joint] = 1
            joint += 1
    return Drawn(bars, np.stack([at[:, 0].real, at[:, 0].imag], axis=1), fixed)


def _apex(one: Any, two: Any, place: complex) -> Any:
    """Where a joint goes that hangs on two others, shape (positions,); nan where its bars are almost in line."""
    long, short = abs(place - one[0]), abs(place - two[0])
    way = two - one
    cosine = (abs(way) ** 2 + long**2 - short**2) / (2 * abs(way) * long)
    between = (long**2 + short**2 - abs(way) ** 2) / (2 * long * short)
    side = np.sign((np.conj(way[0]) * (place - one[0])).imag)
    course = one + way / abs(way) * long * (cosine + 1j * side * np.sqrt(np.maximum(1 - cosine**2, 0.0)))
    return np.where((abs(cosine) < 1) & (abs(between) < MARGIN), course, np.nan)


def joint_places(sim: Any, mechanism: Drawn) -> Any:
    """Its answer for one mechanism: where the joints are, shape (joints, positions, 2)."""
    fixed = np.where(mechanism.fixed)[0]
    path, fine = sim.find_path(mechanism.bars, fixed_nodes=fixed)
    assert fine
    return sim.solve_rev_vectorized(path, mechanism.places, sim.get_G(mechanism.places), [0, 1], fixed, THETA)[0]


def batch_solver(sim: Any, batch: list[Drawn]) -> Callable[[], Any]:
    """Its answer for a batch, in single precision."""
    import tensorflow as tf

    bars = np.stack([one.bars for one in batch]).astype(np.float32)
    places = np.stack([one.places for one in batch])
    lengths = np.stack([sim.get_G(one) for one in places]).astype(np.float32)
    fixed = np.stack([one.fixed for one in batch]).astype(np.float32)[..., None]
    given = [tf.constant(each) for each in (bars, places.astype(np.float32), lengths, fixed, THETA.astype(np.float32))]
    return lambda: np.asarray(sim.solve_rev_vectorized_batch_GPU(*given)[0])


def mechanism_of(kind: Drawn, places: Any) -> Mechanism:
    """The same mechanism here: every bar a link with a beam.

    The places are complex, of shape (joints,) or (joints, designs, 1).
    """
    names = [f"J{joint}" for joint in range(len(kind.bars))]
    links = [Link("ground", {names[joint]: places[joint] for joint in np.where(kind.fixed)[0]})]
    for one, two in np.argwhere(np.triu(kind.bars)):
        points = {names[one]: 0.0, names[two]: abs(places[two] - places[one])}
        links.append(Link(f"{one}-{two}", points, (Beam(names[one], names[two], MASS),)))
    drawing = {name: complex(place) for name, place in zip(names, kind.places @ [1, 1j], strict=True)}
    return Mechanism(tuple(links), (PinDrive("0-1", "J0"),), drawing)


def moved(kind: Drawn, places: Any) -> Any:
    """Motion of a mechanism: places, velocities and accelerations."""
    return motion(mechanism_of(kind, places), THETA, SPEED)


def bent(kind: Drawn, places: Any) -> Any:
    """Motion, loads, joint forces and all fields of a mechanism, as polynomials."""
    course = moved(kind, places)
    return deflection(course, (STEEL,) * int(np.triu(kind.bars).sum()))


def difference(kind: Drawn, theirs: Any) -> float:
    """Greatest distance between a joint there and here, by the size of the drawing, which is 1."""
    course = moved(kind, kind.places @ [1, 1j])
    worst = 0.0
    for one, two in np.argwhere(np.triu(kind.bars)):
        for joint in (one, two):
            here = position_of(course, f"{one}-{two}", f"J{joint}")
            worst = max(worst, float(abs(here - theirs[joint] @ [1, 1j]).max()))
    return worst


def one_by_one(sim: Any, joints: int, random: np.random.Generator) -> dict[str, Any]:
    """Mechanisms each of a structure of its own: a row of the table."""
    kinds = [drawn(random, joints) for _ in range(SOME)]
    places = [kind.places @ [1, 1j] for kind in kinds]
    worst = max(difference(kind, joint_places(sim, kind)) for kind in kinds)
    taken = measuring.in_turn(
        {
            "LINKS": lambda: [joint_places(sim, kind) for kind in kinds],
            "motion": lambda: [moved(*each) for each in zip(kinds, places, strict=True)],
            "all": lambda: [bent(*each) for each in zip(kinds, places, strict=True)],
        }
    )
    unit = 1e6 / SOME / POSITIONS
    return {
        "joints": joints,
        "bars": int(np.mean([np.triu(kind.bars).sum() for kind in kinds])),
        "LINKS, numpy: positions [us a position]": unit * taken["LINKS"],
        "here: motion": unit * taken["motion"],
        "here: motion, loads, all fields": unit * taken["all"],
        "greatest difference": worst,
    }


def together(sim: Any, joints: int, random: np.random.Generator, compiled: bool) -> dict[str, Any]:
    """Mechanisms of one structure and many lengths: a row of the table."""
    kind = drawn(random, joints)
    places = (kind.places @ [1, 1j])[:, None] + 1e-3 * (random.random((joints, MANY)) - 0.5)
    batch = [Drawn(kind.bars, np.stack([one.real, one.imag], axis=1), kind.fixed) for one in places.T]
    axis = places[..., None]
    calls: dict[str, Callable[[], Any]] = {
        "LINKS": lambda: [joint_places(sim, one) for one in batch],
        "motion": partial(moved, kind, axis),
        "all": partial(bent, kind, axis),
    }
    if compiled:
        calls["compiled"] = batch_solver(sim, batch)
    taken = measuring.in_turn(calls, rounds=3)
    unit = 1e6 / MANY / POSITIONS
    row: dict[str, Any] = {"joints": joints, "LINKS, numpy: positions [us a position]": unit * taken["LINKS"]}
    if compiled:
        double = np.stack([joint_places(sim, one) for one in batch])
        row["LINKS, TensorFlow, float32: positions"] = unit * taken["compiled"]
        row["error of that"] = float(abs(calls["compiled"]() - double).max())
    return {
        **row,
        "here: motion": unit * taken["motion"],
        "here: motion, loads, all fields": unit * taken["all"],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="a copy of the repository")
    sim, compiled = simulator(parser.parse_args().folder)
    random = np.random.default_rng(12)
    sizes = (6, 10, 15, 20)
    tables = {
        "one by one": [one_by_one(sim, joints, random) for joints in sizes],
        "together": [together(sim, joints, random, compiled) for joints in sizes],
    }
    notes = [f"{SOME} mechanisms one by one, {MANY} of one structure together, {POSITIONS} positions each"]
    if compiled:
        from importlib import metadata

        notes.append(f"tensorflow {metadata.version('tensorflow-cpu')}, processor only, two threads")
    measuring.report("links_simulator", "Positions in LINKS beside positions and all fields here", tables, notes)


if __name__ == "__main__":
    main()
