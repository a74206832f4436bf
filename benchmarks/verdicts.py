"""Verdicts "acceptable" on random scenes, compared with a reference of 16 times the positions and a better theory.

    python benchmarks/verdicts.py [SCENES] [SEED] [FILE]    (continues the file, one row a scene)
    python benchmarks/verdicts.py show SEED NUMBER

Scenes are linkages with plates and blocks, five-bars, arms of two drives, cylinders and cams. They have rigid or
elastic links, constant speeds or laws, springs, friction, loads and gravity, and 12 to 72 positions. Limits are 0.7 to
1.5 times the figures of a coarse answer.

The reference uses elastodynamic theory for a quasi-static answer and geometrically exact theory for an elastodynamic
one. For a geometrically exact answer it asks for an accuracy of 0.5 %. It contradicts "acceptable" if its own verdict,
with its own error, is "not acceptable". Beside the file of rows, FILE-summary.csv has the counts.
"""

import cmath
import csv
import math
import sys
import time
import tomllib
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import measuring
import numpy as np
from drawn_scenes import text_of
from random_mechanisms import Drawn, drawn
from scipy.stats import beta

from kinelast.answers.results import Results
from kinelast.figures.measures import measures_of
from kinelast.figures.registry import figures_of
from kinelast.reports.limits import VERDICTS, acceptance
from kinelast.runs import computed
from kinelast.scene.data import ELASTODYNAMIC, GEOMETRICALLY_EXACT, QUASI_STATIC, scene_deflection, scene_motion
from kinelast.scene.document import scene_from_text
from kinelast.tasks.request import Request, RequestError
from kinelast.values.error import SceneError
from kinelast.values.figure import LEAST, MOST
from rigid import MechanismError

SEED, SCENES = 33, 10_000
POSITIONS = 12, 72
REFINEMENT = 16  # positions of the reference / positions of the scene
FACTORS = 0.7, 1.5  # limit / figure of the coarse answer
ACCURACY = 0.005  # of the reference
RIGID = 0.8  # share of scenes with rigid links, which take a tenth of the time
ELASTIC_WITH_FRICTION = 0.03  # share of the elastic scenes; they take many seconds
MAX_SECONDS = 6.0  # processor time of a scene
CURVES = "cycloidal", "polynomial-345", "harmonic", "modified-sine", "trapezoidal-velocity", "constant-acceleration"
NEXT = {QUASI_STATIC: ELASTODYNAMIC, ELASTODYNAMIC: GEOMETRICALLY_EXACT}
HEAD = ("number", "kind", "verdict", "theory", "limits", "reference", "by", "s")
TARGET = measuring.RESULTS / "verdicts.csv"
Tables = dict[str, Any]


def drawn_text(seed: int, number: int) -> tuple[str, str]:
    """Return the kind and the text of a scene without limits."""
    random = np.random.default_rng((seed, number))
    tables: Tables | None = None
    kind: Callable[[Any], Tables | None] = _linkage
    while tables is None:
        kind = random.choice(KINDS, p=SHARES)
        tables = kind(random)
    tables.setdefault("run", {})["positions"] = int(random.integers(POSITIONS[0], POSITIONS[1] + 1))
    return str(tables["title"]), text_of(plain(tables))


def plain(value: Any) -> Any:
    """Return tables with numpy scalars replaced by Python's."""
    match value:
        case dict():
            return {str(key): plain(each) for key, each in value.items()}
        case list() | tuple():
            return [plain(each) for each in value]
    return value.item() if isinstance(value, np.generic) else value


def _linkage(random: Any) -> Tables | None:
    """Return a four-bar, slider-crank or six-bar with its crank at constant speed or by a law."""
    case = drawn(random)
    if case is None:
        return None
    case_speed = case.speed * 10 ** random.uniform(-1.5, 0.0)
    tables, features = _of_mechanism(case), [case.kind]
    drive: Tables = {"link": "crank", "speed": case_speed}
    if random.random() < 0.35:
        drive = {"link": "crank", **_law(random, 2 * math.pi / case_speed, random.uniform(0.5, 2.0))}
        features.append("law")
    tables["drives"] = [drive]
    _with_features(random, tables, features, case_speed)
    tables["title"] = ": ".join(features)
    return tables


def _of_mechanism(case: Drawn) -> Tables:
    """Return the tables of a random mechanism: points, links, sections and material."""
    mechanism = case.mechanism
    steel = case.material == "steel"
    E, density, strength = (210e9, 7850.0, 355e6) if steel else (70e9, 2700.0, 240e6)
    tables: Tables = {
        "title": "",
        "materials": {"own": {"E": E, "density": density, "poisson": 0.3, "yield": strength}},
        "sections": {},
        "points": {name: _xy(place) for name, place in mechanism.drawing.items()},
        "links": {"ground": {"points": list(mechanism.links[0].points)}},
    }
    beam = 0
    for link in mechanism.links[1:]:
        own: Tables = {"points": list(link.points)}
        if link.beams:
            section = case.sections[beam]
            depth = math.sqrt(12 * float(section.EI) / float(section.EA))
            tables["sections"][link.name] = {"shape": "rectangle", "depth": depth,
                                             "width": float(section.EA) / E / depth}  # fmt: skip
            own |= {"section": link.name, "material": "own"}
            if len(link.points) > 2:
                own["beams"] = [[each.start, each.end] for each in link.beams]
            beam += len(link.beams)
        else:
            own["mass"] = sum(float(lump.mass) for lump in link.lumps)
        tables["links"][link.name] = own
    for slider in mechanism.sliders:
        tables["sliders"] = {slider.name: {"link": slider.link, "through": slider.point,
                                           "direction": _xy(slider.direction)}}  # fmt: skip
    return tables


def _xy(place: Any) -> list[float]:
    return [complex(place).real, complex(place).imag]


def _law(random: Any, duration: float, by: float) -> Tables:
    """Return a law: rise, dwell and return, repeated; or one rise and a dwell."""
    curve = str(random.choice(CURVES))
    part, by = duration * random.uniform(0.2, 0.6), by * random.choice([-1, 1])
    there = {"curve": curve, "duration": part, "by": by}
    stop = {"curve": "dwell", "duration": part * random.uniform(0.1, 1.0)}
    if random.random() < 0.3:
        return {"law": [there, stop]}
    return {"law": [there, stop, {**there, "by": -by}, stop], "repeat": True}


def _with_features(random: Any, tables: Tables, features: list[str], speed: float) -> None:
    """Add rigid links, gravity, loads, springs and friction at random."""
    moving = [name for name in tables["links"] if name != "ground"]
    run = tables.setdefault("run", {})
    run["damping_ratio"] = float(10 ** random.uniform(-2, -1))
    if random.random() < 0.4:
        run["gravity"] = [0.0, -9.81]
    sizes = dict(tables["sections"])
    elastic = [name for name in moving if "section" in tables["links"][name]]
    if elastic and random.random() < RIGID:
        chosen = elastic if random.random() < 0.9 else [str(random.choice(elastic))]
        features.append("rigid" if chosen is elastic else "one rigid")
        for name in chosen:
            own, size = tables["links"][name], tables["sections"][name]
            mass = tables["materials"]["own"]["density"] * size["depth"] * size["width"] * _span(tables, name)
            for key in ("section", "material", "beams"):
                own.pop(key, None)
            own |= {"rigid": True, "mass": mass, "center": str(random.choice(own["points"]))}
    last = moving[-1]
    point = tables["links"][last]["points"][-1]
    size = max(_weight(tables, sizes), 1e-3) * 10 ** random.uniform(0, 2)
    if random.random() < 0.4:
        features.append("load")
        load: Tables = {"link": last, "point": point, "force": _xy(cmath.rect(size, random.uniform(0, 2 * math.pi)))}
        draw = random.random()
        if draw < 0.25:
            load["resists"] = "one way"
        elif draw < 0.6:
            period = 2 * math.pi / speed
            at = np.sort(random.uniform(0, period, 3))
            load |= {"table": [[0.0, 0.0], *([float(x), float(random.uniform(-1, 1))] for x in at), [period, 0.0]],
                     "extend": "hold"}  # fmt: skip
        tables["loads"] = [load]
    if random.random() < 0.25:
        features.append("spring")
        z, anchor = (complex(*tables["points"][name]) for name in (point, tables["links"]["ground"]["points"][0]))
        length = abs(z - anchor) * random.uniform(0.3, 1.2)
        tables["springs"] = [{"link": last, "point": point, "anchor": tables["links"]["ground"]["points"][0],
                              "length": length, "stiffness": size / max(abs(z - anchor), 1e-6)}]  # fmt: skip
    if random.random() < (0.25 if "rigid" in features else ELASTIC_WITH_FRICTION):
        features.append("friction")
        linked = [name for link in tables["links"].values() for name in link["points"]]
        joints = [name for name in tables["points"] if linked.count(name) > 1]
        smallest = min((each["depth"] for each in sizes.values()), default=0.01)
        for name in random.choice(joints, min(2, len(joints)), replace=False):
            own = {"friction": random.uniform(0.02, 0.2), "radius": smallest * random.uniform(0.2, 1)}
            tables.setdefault("joints", {})[str(name)] = own


def _span(tables: Tables, link: str) -> float:
    places = [complex(*tables["points"][name]) for name in tables["links"][link]["points"]]
    return max(abs(one - other) for one in places for other in places)


def _weight(tables: Tables, sizes: Tables) -> float:
    density = tables["materials"]["own"]["density"]
    return 9.81 * sum(density * each["depth"] * each["width"] * _span(tables, name) for name, each in sizes.items())


def _bars(random: Any, places: dict[str, complex], ground: list[str], bars: dict[str, list[str]]) -> Tables:
    """Return the tables of steel bars between points."""
    slender = 10 ** random.uniform(1.2, 2.0)
    sections, links = {}, {"ground": {"points": ground}}
    for name, ends in bars.items():
        length = max(abs(places[one] - places[other]) for one in ends for other in ends)
        depth = math.sqrt(12) * length / (slender * 2 ** random.uniform(-0.5, 0.5))
        sections[name] = {"shape": "rectangle", "depth": depth, "width": depth * random.uniform(0.3, 1.5)}
        links[name] = {"points": ends, "section": name, "material": "own"}
    return {
        "title": "",
        "materials": {"own": {"E": 210e9, "density": 7850.0, "poisson": 0.3, "yield": 355e6}},
        "sections": sections,
        "points": {name: _xy(place) for name, place in places.items()},
        "links": links,
    }


def _lowest(tables: Tables) -> float:
    """Estimate the lowest natural frequency: each bar as a cantilever [rad/s]."""
    lowest = math.inf
    for name, own in tables["sections"].items():
        lowest = min(lowest, 3.516 * own["depth"] / math.sqrt(12) * math.sqrt(210e9 / 7850) / _span(tables, name) ** 2)
    return lowest


def _arm(random: Any) -> Tables:
    """Return an arm with two drives by laws and a load at its tip."""
    upper, fore = 10 ** random.uniform(-1, 0, 2)
    first, second = random.uniform(0, 6.28), random.uniform(-2, 2)
    A = cmath.rect(upper, first)
    places = {"O": 0j, "A": A, "B": A + cmath.rect(fore, first + second)}
    tables = _bars(random, places, ["O"], {"upper": ["O", "A"], "fore": ["A", "B"]})
    duration = 2 * math.pi / _lowest(tables) * 10 ** random.uniform(0.7, 2.5)
    laws = _law(random, duration, random.uniform(0.2, 1.5))
    scaled = [{**part, "by": part["by"] * random.uniform(-1, 1)} if "by" in part else part for part in laws["law"]]
    if laws.get("repeat"):
        scaled = [scaled[0], laws["law"][1], {**scaled[0], "by": -scaled[0]["by"]}, laws["law"][3]]
    tables["drives"] = [{"link": "upper", **laws}, {"link": "fore", "on": "upper", **laws, "law": scaled}]
    features = ["arm"]
    _with_features(random, tables, features, 2 * math.pi / duration)
    return {**tables, "title": ": ".join(features)}


def _five_bar(random: Any) -> Tables | None:
    """Return a five-bar with two cranks at speeds of a simple ratio."""
    size = 10 ** random.uniform(-1, 0)
    far, r1, r2 = size * random.uniform(0.8, 1.4), size * random.uniform(0.1, 0.25), size * random.uniform(0.1, 0.25)
    A, B = (cmath.rect(r, random.uniform(0, 6.28)) for r in (r1, r2))
    B += far
    rod = (far + r1 + r2) / 2 * random.uniform(1.15, 1.6)
    apart, middle = abs(B - A), (A + B) / 2
    P = middle + 1j * (B - A) / apart * math.sqrt(rod**2 - apart**2 / 4)
    places = {"O": 0j, "D": complex(far), "A": A, "B": B, "P": P}
    bars = {"crank": ["O", "A"], "second": ["D", "B"], "rod": ["A", "P"], "reach": ["B", "P"]}
    tables = _bars(random, places, ["O", "D"], bars)
    speed = _lowest(tables) * 10 ** random.uniform(-3, -1)
    ratio = float(random.choice([1, -1, 2, -2, 0.5]))
    tables["drives"] = [{"link": "crank", "speed": speed}, {"link": "second", "speed": ratio * speed}]
    features = ["five-bar"]
    _with_features(random, tables, features, speed)
    return {**tables, "title": ": ".join(features)}


def _cylinder(random: Any) -> Tables:
    """Return a boom lifted by a cylinder."""
    size = 10 ** random.uniform(-0.5, 0.3)
    P, lean = size * complex(random.uniform(0.3, 0.6), random.uniform(-0.3, -0.05)), random.uniform(0.2, 0.7)
    C, E = (cmath.rect(size * share, lean) for share in (random.uniform(0.5, 0.7), random.uniform(0.9, 1.2)))
    way = (C - P) / abs(C - P)
    places = {"O": 0j, "P": P, "C": C, "E": E, "T": P + 0.6 * (C - P)}
    tables = _bars(random, places, ["O", "P"], {"boom": ["O", "C", "E"], "tube": ["P", "T"], "rod": ["C"]})
    tables["links"]["boom"]["beams"] = [["O", "C"], ["C", "E"]]
    tables["links"]["tube"] = {"points": ["P", "T"], "rigid": True, "mass": random.uniform(1, 5) * size, "center": "T"}
    tables["sections"].pop("tube")
    tables["links"]["rod"] = {"points": ["C"], "mass": random.uniform(1, 5) * size}
    tables["sections"].pop("rod")
    tables["sliders"] = {"piston": {"link": "rod", "on": "tube", "through": "C", "direction": _xy(way)}}
    tables["cylinders"] = {"own": {"bore": 0.06 * size, "rod": 0.03 * size, "length": abs(C - P)}}
    duration = 2 * math.pi / _lowest(tables) * 10 ** random.uniform(1.0, 2.5)
    tables["drives"] = [{"slider": "piston", "cylinder": "own",
                         **_law(random, duration, size * random.uniform(0.05, 0.25))}]  # fmt: skip
    features = ["cylinder"]
    _with_features(random, tables, features, 2 * math.pi / duration)
    weight = _weight(tables, tables["sections"]) * 10 ** random.uniform(0, 1)
    load = {"link": "boom", "point": "E", "force": [0.0, -weight]}
    return {**tables, "loads": [load], "title": ": ".join(features)}


def _cam(random: Any) -> Tables:
    """Return a rocker moved by a cam."""
    size = 10 ** random.uniform(-1.3, -0.5)
    R = complex(size * random.uniform(0.6, 1.0))
    T = size * complex(-random.uniform(0.8, 1.2), random.uniform(0, 0.2))
    places = {"O": 0j, "R": R, "T": T, "C": R - 1j * size * random.uniform(0.5, 0.8)}
    tables = _bars(random, places, ["O", "C"], {"rocker": ["R", "O", "T"]})
    tables["links"]["rocker"]["beams"] = [["O", "R"], ["O", "T"]]
    duration = 2 * math.pi / _lowest(tables) * 10 ** random.uniform(1.0, 2.5)
    law = _law(random, duration, random.uniform(0.1, 0.4))
    part, stop = law["law"][:2]
    tables["drives"] = [{"link": "rocker", "law": [part, stop, {**part, "by": -part["by"]}, stop], "repeat": True}]
    tables["cams"] = {"own": {"follower": "rocker", "centre": "C", "roller": "R", "roller_radius": 0.1 * size,
                              "width": 0.1 * size, "material": "own"}}  # fmt: skip
    features = ["cam"]
    _with_features(random, tables, features, 2 * math.pi / duration)
    return {**tables, "title": ": ".join(features)}


KINDS = _linkage, _arm, _five_bar, _cylinder, _cam
SHARES = 0.6, 0.1, 0.1, 0.1, 0.1


def with_limits(text: str, random: Any) -> str:
    """Add one or two limits to a text, at random factors of figures of a coarse answer."""
    scene = scene_from_text(text)
    results = Results(scene, scene_deflection(scene, scene_motion(scene)))
    figures = [each for each in figures_of(scene.output) if not (each.asked or each.exact or each.here or each.whole)]
    known = {}
    for name, measure in measures_of(scene, figures).items():
        value = abs(float(np.ravel(measure.of(results.cycle)[0])[0]))
        if math.isfinite(value) and value > 1e-12:
            known[name] = value, measure.figure.over
    usual = [name for name in known if name.split(".")[0] in USUAL]
    names = [*random.choice(sorted(known), 1)] + ([*random.choice(sorted(usual), 1)] if usual else [])
    bounds: Tables = {}
    for name in names[int(random.integers(0, len(names))) :]:
        value, over = known[name]
        factor = float(random.uniform(*FACTORS))
        least = over == LEAST or (over == MOST and random.random() < 0.5)
        bounds[str(name)] = {"least": value / factor} if least else {"most": value * factor}
    return text + text_of(plain({"limits": {"figures": bounds}}))


USUAL = "deflection", "chord", "safety", "buckling", "stress", "joint_force", "drive_effort", "displacement"


def judged(text: str, **changes: Any) -> tuple[str, str, str]:
    """Return the verdict on a scene, the theory of its answer, and the limit or problem that decides."""
    results = computed(scene_from_text(text), Request(**changes))
    verdict = acceptance(results)
    theory = results.answer.theory if results.answer else "none"
    theory = theory if results.scene.labels else "rigid"
    broken = [each.name for each in verdict.limits or () if each.outcome == "not kept"]
    return verdict.verdict, theory, "; ".join(broken) or verdict.problem


def row_of(seed: int, number: int) -> Tables:
    """Return the row of a scene: its verdict, and the reference's verdict if it is "acceptable"."""
    begin = time.process_time()
    kind, text = drawn_text(seed, number)
    row: Tables = {"number": number, "kind": kind}
    try:
        text = with_limits(text, np.random.default_rng((seed, number, 1)))
        row["limits"] = text.count("most") + text.count("least")
        row["verdict"], row["theory"], row["by"] = judged(text)
        if row["verdict"] == VERDICTS["kept"]:
            row["reference"], _, row["by"] = judged(finer(text, row["theory"]))
    except (SceneError, RequestError, MechanismError, ValueError, measuring.TooLongError) as error:
        key = "reference" if "verdict" in row else "verdict"
        row |= {key: "left out", "by": (getattr(error, "problem", "") or str(error) or type(error).__name__)[:90]}
    return {**row, "s": round(time.process_time() - begin, 2)}


def finer(text: str, theory: str) -> str:
    """Return the text of the reference."""
    tables = tomllib.loads(text)
    tables["run"]["positions"] *= REFINEMENT
    if theory in NEXT:
        tables["run"]["theory"] = NEXT[theory]
    if theory == GEOMETRICALLY_EXACT:
        tables["run"]["accuracy"] = ACCURACY
    return text_of(tables)


def interval(wrong: int, count: int) -> tuple[float, float]:
    """95 % confidence interval of a share (Clopper-Pearson)."""
    low = 0.0 if wrong == 0 else float(beta.ppf(0.025, wrong, count - wrong + 1))
    high = 1.0 if wrong == count else float(beta.ppf(0.975, wrong + 1, count - wrong))
    return low, high


def totals(rows: list[Tables]) -> list[Tables]:
    """Counts by theory of the answer, and of all scenes."""
    table = []
    for theory in ("rigid", *NEXT, GEOMETRICALLY_EXACT, "all"):
        own = [row for row in rows if theory == "all" or row["theory"] == theory]
        kept = [row for row in own if row["verdict"] == VERDICTS["kept"]]
        checked = [row for row in kept if row["reference"] != "left out"]
        wrong = sum(row["reference"] == VERDICTS["not kept"] for row in checked)
        low, high = interval(wrong, len(checked)) if checked else (0.0, 1.0)
        table.append({"theory": theory, "scenes": len(own), "acceptable": len(kept), "with a reference": len(checked),
                      "contradicted": wrong, "95 % interval": f"{100 * low:.2g} to {100 * high:.2g} %"})  # fmt: skip
    return table


def main() -> None:
    if sys.argv[1:2] == ["show"]:
        seed, number = map(int, sys.argv[2:4])
        print(with_limits(drawn_text(seed, number)[1], np.random.default_rng((seed, number, 1))))
        return
    count, seed, path = (*sys.argv[1:], *(str(SCENES), str(SEED), str(TARGET))[len(sys.argv) - 1 :])
    target = Path(path)
    rows: list[Tables] = measuring.read_rows(target)
    warnings.simplefilter("ignore")
    with target.open("a", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, HEAD)
        if not rows:
            writer.writeheader()
        for number in range(len(rows), int(count)):
            with measuring.processor_limit(MAX_SECONDS):
                rows.append(dict.fromkeys(HEAD, "") | row_of(int(seed), number))
            writer.writerow(rows[-1])
            stream.flush()
    table = totals(rows)
    with target.with_stem(f"{target.stem}-summary").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, table[0])
        writer.writeheader()
        writer.writerows(table)
    print(measuring.as_text(table))
    print(Counter(row["verdict"] for row in rows), Counter(row["reference"] for row in rows))


if __name__ == "__main__":
    main()
