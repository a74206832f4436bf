"""Import of mechanisms from the program pylinkage (its package `mechanism`): JSON with joints and links."""

import math
from collections.abc import Mapping
from typing import Any

from exchange.foreign_mechanism import Drive, ForeignLink, ForeignMechanism, Names, Slot, link_with

SOURCE = "pylinkage"
# assumed speed of a driven link, because pylinkage stores the angle per step without the duration of a step
TURN = "60 rpm"


def of_pylinkage(data: Mapping[str, Any], title: str) -> ForeignMechanism:
    """Return the mechanism in a JSON object of pylinkage."""
    names, called, notes = Names(), Names(["ground"]), ["pylinkage has no unit of length: millimetres are assumed"]
    joints = {str(each["id"]): each for each in data["joints"]}
    points = {names(key, each.get("name", "")): complex(*map(float, each["position"])) for key, each in joints.items()}
    grounded = {key for key, each in joints.items() if each["type"] == "ground"}
    links: dict[str, ForeignLink] = {}
    drives = []
    for each in data["links"]:
        shared = tuple(map(str, each["joints"]))
        if each["type"] == "ground":
            grounded |= set(shared)
            continue
        link = called(each["id"], each.get("name", ""))
        links[link] = ForeignLink(tuple(names(key) for key in shared))
        if each["type"] in ("driver", "arc_driver"):
            at = str(each.get("motor_joint") or next(key for key in shared if key in grounded))
            grounded.add(at)
            drives.append(_drive(each, link, names(at), notes))
    for key, each in joints.items():
        if each["type"] == "tracker":
            host = link_with(links, names(each["ref_joint1_id"]), names(each["ref_joint2_id"]))
            if host is None:
                notes.append(f"the tracker {names(key)} is left out, because it is on no link")
                points.pop(names(key))
            elif names(key) not in links[host].points:
                links[host] = ForeignLink((*links[host].points, names(key)))
    slots = {}
    for key, each in joints.items():
        if each["type"] == "prismatic":
            host = link_with(links, names(key))
            if host is None:
                notes.append(f"the slider {names(key)} is left out, because it is on no link")
            else:
                slots[f"slot_{names(key)}"] = Slot(names(key), host, "ground", complex(*map(float, each["axis"])))
    fixed = tuple(names(key) for key in joints if key in grounded)
    links = {name: body for name, body in links.items() if not set(body.points) <= set(fixed)}
    return ForeignMechanism(
        str(data.get("name") or title), SOURCE, "mm", points, fixed, links, slots, {}, tuple(drives), notes=tuple(notes)
    )


def _drive(each: Mapping[str, Any], link: str, at: str, notes: list[str]) -> Drive:
    joint = {"link": link, "at": at}
    sense = math.copysign(1, each.get("angular_velocity") or 1)
    if each["type"] == "driver":
        notes.append(f"{link} turns at {TURN}: assumed, because pylinkage stores angles per step")
        return Drive(joint, TURN if sense > 0 else f"-{TURN}")
    swing = math.degrees(float(each["arc_end"]) - float(each["arc_start"]))
    at_start = math.degrees(float(each.get("initial_angle") or each["arc_start"]) - float(each["arc_start"]))
    notes.append(f"{link} swings over its arc in 1 s and back: assumed, because pylinkage stores angles per step")
    ways = [by for by in (swing - at_start, -swing, at_start) if abs(by) > 1e-9]
    return Drive(joint, law=tuple({"curve": "harmonic", "duration": "1 s", "by": f"{by:.12g} deg"} for by in ways))
