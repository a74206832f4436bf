"""Import of models of mec2: JSON with nodes and constraints, from a file or from the <mec-2> element of a web page."""

import math
from collections.abc import Mapping
from typing import Any

from exchange.foreign_mechanism import Drive, ForeignLink, ForeignMechanism, ForeignSlider, Names, Slot

SOURCE = "mec2"
# maps the mec2 name of each curve to its name in a scene file
CURVES = {
    "linear": "constant-speed", "quadratic": "constant-acceleration", "harmonic": "harmonic", "sinoid": "cycloidal",
    "poly5": "polynomial-345", "const": "dwell",
}  # fmt: skip


def of_mec2(data: Mapping[str, Any], title: str) -> ForeignMechanism:
    """Return the mechanism in a JSON object of mec2."""
    point_names, link_names = Names(), Names(["ground"])
    notes = ["mec2 draws in pixels: 1 pixel is taken as 1 mm"]
    nodes = {str(each["id"]): each for each in data["nodes"]}
    points = {point_names(key): complex(each.get("x", 0), each.get("y", 0)) for key, each in nodes.items()}
    fixed_points = {point_names(key) for key, each in nodes.items() if each.get("base")}
    constraints = {str(each["id"]): each for each in data["constraints"]}
    members: dict[str, list[str]] = {}
    link_of: dict[str, str] = {}
    slots: dict[str, Slot] = {}
    slides: dict[str, ForeignSlider] = {}
    drives = []
    for key, each in constraints.items():
        if missing := [str(each[end]) for end in ("p1", "p2") if str(each[end]) not in nodes]:
            notes.append(f"constraint {key} is left out: there is no node {' and no '.join(missing)}")
            continue
        start, end = point_names(each["p1"]), point_names(each["p2"])
        length, angle = each.get("len") or {"type": "free"}, each.get("ori") or {"type": "free"}
        reference = link_of.get(str(angle.get("ref", "")))
        if (
            length["type"] == "const"
            and angle["type"] == "const"
            and reference
            and {start, end} & set(members[reference])
        ):
            members[reference] += [name for name in (start, end) if name not in members[reference]]
            link_of[key] = reference
        elif length["type"] == "const" and angle["type"] == "const" and not angle.get("ref") and start in fixed_points:
            fixed_points.add(end)
        elif length["type"] == "const" and not angle.get("ref"):
            link = link_of[key] = link_names(key)
            members[link] = [start, end]
            if angle["type"] == "drive":
                drives.append(_drive(angle, {"link": link, "at": start}, math.tau, "rad"))
        elif length["type"] in ("free", "drive") and angle["type"] == "const" and start in fixed_points:
            slots[link_names(f"{key} slot", f"slot_{key}")] = Slot(end, "", "ground", points[end] - points[start])
            if length["type"] == "drive":
                slides[link_names(f"{key} slide", f"slide_{key}")] = ForeignSlider(
                    "", "ground", end, points[end] - points[start]
                )
                drives.append(_drive(length, {"slider": f"slide_{key}"}, 100.0, "mm"))
        else:
            notes.append(
                f"constraint {key} is of a kind that is left out ({length['type']} length, {angle['type']} angle)"
            )
    links = {name: ForeignLink(tuple(own)) for name, own in members.items() if not set(own) <= fixed_points}
    if data.get("loads"):
        notes.append("loads of mec2 are left out: put them under [[loads]]")
    gravity = data.get("gravity")
    if isinstance(gravity, Mapping):
        notes.append("a gravity vector of mec2 is left out: put gravity = [0.0, -9.81] under [run]")
    unattached = [name for name, slot in slots.items() if _holder(slot, slides, links) is None]
    notes += [f"a slot is left out: no link has its point {slots.pop(name).point}" for name in unattached]
    slides, slots = _with_blocks(slides, slots, links, link_names)
    shown = (str(view.get("of")) for view in data.get("views", ()) if view.get("as") == "trace")
    traced = next((point_names(key) for key in shown if key in nodes and point_names(key) not in fixed_points), "")
    used = {name for body in links.values() for name in body.points} | fixed_points
    points = {name: place for name, place in points.items() if name in used}
    fixed = tuple(name for name in points if name in fixed_points)
    return ForeignMechanism(
        str(data.get("title") or data.get("id") or title), SOURCE, "mm", points, fixed, links, slots, slides,
        tuple(drives), traced=traced, gravity=gravity is True, notes=tuple(notes),
    )  # fmt: skip


def _with_blocks(
    slides: Mapping[str, ForeignSlider], slots: Mapping[str, Slot], links: dict[str, ForeignLink], link_names: Names
) -> tuple[dict[str, ForeignSlider], dict[str, Slot]]:
    """Return the sliders and slots, each with the name of the link that slides.

    The link of a slider is new: a block with a single point. The link of a slot is the first listed link that contains
    the pin of the slot. A slot is left out if no link contains the pin of the slot, or if a slider moves this pin.
    """
    driven = {slide.through for slide in slides.values()}
    blocks = {}
    for name, slide in slides.items():
        block = link_names(f"block {slide.through}", f"block_{slide.through}")
        links[block] = ForeignLink((slide.through,))
        blocks[name] = ForeignSlider(block, slide.on, slide.through, slide.direction)
    pins = {
        name: Slot(slot.point, holder, slot.on, slot.direction)
        for name, slot in slots.items()
        if slot.point not in driven and (holder := _holder(slot, {}, links))
    }
    return blocks, pins


def _holder(slot: Slot, slides: Mapping[str, ForeignSlider], links: Mapping[str, ForeignLink]) -> str | None:
    """Return the name of the first link at the pin of a slot.

    If there is no such link, return the name of a slider that moves the pin. If there is no slider either, return None.
    """
    sliding = (name for name, slide in slides.items() if slide.through == slot.point)
    return next((name for name, body in links.items() if slot.point in body.points), next(sliding, None))


def _drive(law_data: Mapping[str, Any], joint: dict[str, str], default: float, unit: str) -> Drive:
    """Return the drive of an angle or length that changes by `Dw` within `Dt` seconds.

    A linear change becomes a constant speed. Any other function, or a sequence of functions, becomes a law. `default`
    replaces a missing `Dw`.
    """
    time, by = float(law_data.get("Dt", 1)), float(law_data.get("Dw", default))
    kind = law_data.get("func", "linear")
    if kind == "linear":
        return Drive(joint, f"{by / time:.12g} {unit}/s")
    parts = law_data["args"] if kind == "seq" else [{"func": kind, "dt": time, "dz": 1}]
    total = sum(float(part["dt"]) for part in parts)
    law = []
    for part in parts:
        segment = {"curve": CURVES[part["func"]], "duration": f"{float(part['dt']) * time / total:.12g} s"}
        if part["func"] != "const":
            segment["by"] = f"{by * float(part.get('dz', 1)):.12g} {unit}"
        law.append(segment)
    return Drive(joint, law=tuple(law))
