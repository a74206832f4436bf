"""The libraries of PMKS+ and Linkage move as their own files say.

Each file is read a second time here, as conditions on the positions of its points: lengths, slots, gears, drives.
Positions that start as drawn, satisfy all conditions and do not jump are the motion of that file. The files come from
the folder in KINELAST_DRAWINGS or from GitHub; without both, the tests are skipped.
"""

import os
import re
import urllib.request
from cmath import rect
from http.client import HTTPException
from math import sqrt
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import kinelast
from exchange.reading import of_text
from kinelast.cli.imported import imported
from rigid import position_of

TEMPLATES = "src/app/component/MODALS/templates"
COMMITS = {
    "PMKS+": "PMKS-Web/Planar-Mechanism-Kinematic-Simulator/08d8feb494f5122a0ad85a68757391b7fe88059d",
    "PMKS+ of 2024": "PMKS-Web/PMKSWeb/84b8d2b903e092bff2bef0f1c3f7780b1313a57b",
    "Linkage": "EvanWang1997/Linkage/1e791b2ed58d678c2f305d5c29881424801ec569",
}
FILES = {"PMKS+": f"{TEMPLATES}/template-linkages.ts", "PMKS+ of 2024": f"{TEMPLATES}/templates.component.ts",
         "Linkage": "examples_xml.h"}  # fmt: skip
COUNT = {"PMKS+": 25, "PMKS+ of 2024": 7, "Linkage": 47}
REFUSED = {"TRAMMEL_XML": "are drawn in line, so the side on which they fold is ambiguous: move the drawing"}
DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
TOLERANCE = 2e-3  # of the file's unit and of its size: places have three decimals, and slots are straightened
POSITIONS = 720


def mechanisms(name):
    """Texts of the mechanisms in a source file, by their names there."""
    path = f"{COMMITS[name]}/{FILES[name]}"
    if folder := os.environ.get("KINELAST_DRAWINGS"):
        text = (Path(folder) / path).read_text()
    else:
        try:
            with urllib.request.urlopen(f"https://raw.githubusercontent.com/{path}", timeout=10) as answer:
                text = answer.read().decode()
        except (OSError, HTTPException) as error:
            pytest.skip(f"GitHub cannot be reached: {error}")
    if name != "Linkage":
        found = re.findall(r"(?:^ {2}|case )'?([\w-]+)'?:\s+(?:content =\s+)?'([^']+,[^']+)'[,;]$", text, re.MULTILINE)
        return dict(found)
    bodies = re.split(r"#define (\w+_XML) ", text)[1:]
    return {
        key: re.search("<linkage2.*</linkage2>", each, re.DOTALL)[0].replace("\\\n", "").replace('\\"', '"')
        for key, each in zip(bodies[::2], bodies[1::2], strict=True)
    }


def line(at, a, b):
    """Unit vectors from a to b."""
    return (at[b] - at[a]) / abs(at[b] - at[a])


def rigid(at, points):
    """Deviation of a link's points from their first places, moved with the line through two of them."""
    points = [point for point in points if point in at]  # a scene has no points of the frame that nothing needs
    if not points:
        return
    a = points[0]
    b = max(points, key=lambda point: abs(at[point][0] - at[a][0]))
    for point in points:
        if point != a:
            there = at[a] + (at[point][0] - at[a][0]) * line(at, a, b) / line(at, a, b)[0]
            yield at[point] - there


def beside(at, point, a, b):
    """Distance of a point from the line through a and b."""
    yield ((at[point] - at[a]) * line(at, a, b).conjugate()).imag


def turned(at, a, b):
    """Angle of the line from a to b, from its first one."""
    angle = np.unwrap(np.angle(at[b] - at[a]))
    return angle - angle[0]


def number(text):
    value = 0
    for digit in text.removeprefix("0"):
        value = 64 * value + DIGITS.index(digit)
    return (-value if text.startswith("0") else value) / 1000


def of_pmks(text):
    """Drawn places, conditions and drives of a mechanism of PMKS+; a slider is a joint, its pin and their block."""
    words = text.split(".")
    lists = [[]]
    for word in words[4:]:
        lists.append([]) if not word else lists[-1].append(word.split(","))
    drawn = {word[1]: complex(number(word[2]), number(word[3])) for word in lists[0]}
    marks = {word[1]: DIGITS.index(word[0][0]) for word in lists[0]}
    pin_of = {word[8]: word[7] for word in lists[1] if word[0][1] == "P"}
    links = [[pin_of.get(key, key) for key in word[7 : word.index("", 7)]] for word in lists[1]
             if word[0][1] != "P" and word[0][0] not in "NamgN4567"]  # fmt: skip
    rpm = number(words[2].split(",")[0]) * 1000 * (-1 if DIGITS.index(words[0][-1]) & 1 else 1)
    slides_at = number(words[1].split(",")[1]) if "," in words[1] else 5.0
    conditions = [lambda at, points=points: rigid(at, points) for points in links]
    drives = []
    for word in lists[0]:
        key, here = word[1], pin_of.get(word[1], word[1])
        slides, driven, fixed, welded = (marks[key] & bit for bit in (1, 2, 4, 8))
        carrier = word[6:8] if len(word) > 7 and word[5] else None
        own = next((points for points in links if here in points and not (carrier and set(carrier) <= {*points})), None)
        if slides:
            if carrier:
                conditions.append(lambda at, here=here, ends=carrier: beside(at, here, *ends))
            else:
                direction = rect(1, number(word[4]))
                conditions.append(lambda at, here=here, u=direction: [((at[here] - at[here][0]) * u.conjugate()).imag])
            if (welded or marks[here] & 8) and len(own) > 1:  # does not turn in its slot
                other = next(point for point in own if point != here)
                conditions.append(
                    lambda at, a=here, b=other, ends=carrier: [
                        (turned(at, a, b) - (turned(at, *ends) if ends else 0)) * abs(at[b] - at[a])[0]
                    ]
                )
            if driven:
                drives.append((None, here, carrier, slides_at))
        elif fixed:
            conditions.append(lambda at, here=here: [at[here] - at[here][0]])
        if driven and not slides:
            at_pin = [points for points in links if here in points]
            arms = [(here, next(point for point in points if point != here)) for points in at_pin]
            drives.append((arms[:1] if fixed else arms[:2], here, None, rpm))
    return drawn, conditions, drives


def of_linkage(text):
    """Drawn places, conditions and drives of a mechanism of Linkage."""
    root = ElementTree.fromstring(re.sub(r'(="[^"]*")(?=[A-Za-z_])', r"\1 ", text))
    parts = [each for each in root.findall("connector") if not int(each.get("layer") or 0) & 1]
    drawn = {f"P{each.get('id')}": complex(float(each.get("x")), float(each.get("y"))) for each in parts}
    members, conditions, drives = {}, [], []
    for each in root.findall("Link"):
        points = [f"P{one.get('id')}" for one in each.findall("connector") if f"P{one.get('id')}" in drawn]
        if not points or int(each.get("layer") or 0) & 1:
            continue
        if each.get("actuator") == "true":
            cycles = float(each.get("cpm"))
            drives.append(("throw", points, float(each.get("throw")) * np.sign(cycles), 60 / abs(cycles)))
        else:
            members[each.get("id")] = points
            conditions.append(lambda at, points=points: rigid(at, points))
    for each in root.findall("Link"):
        if each.get("fastenlink") in members and each.get("id") in members:
            both = {**dict.fromkeys(members[each.get("id")] + members[each.get("fastenlink")])}
            conditions.append(lambda at, points=both: rigid(at, points))
    anchors = {f"P{each.get('id')}" for each in parts if each.get("anchor") == "true"}
    conditions += [lambda at, key=key: [at[key] - at[key][0]] if key in at else [] for key in anchors]
    for each in parts:
        key = f"P{each.get('id')}"
        if each.get("input") == "true" and key in anchors:
            turning = [points for points in members.values() if key in points and not {*points} <= anchors]
            arms = [(key, next(point for point in points if point != key)) for points in turning]
            drives += [([arm], key, None, -float(each.get("rpm") or 15)) for arm in arms]
        ends = [f"P{one.get('id')}" for one in each.findall("slidelimit")] if each.get("slider") == "true" else []
        if len(ends) == 2:
            radius = abs(float(each.get("slideradius") or 0))
            conditions.append(
                (lambda at, key=key, ends=ends, r=radius: on_arc(at, key, *ends, r))
                if radius
                else (lambda at, key=key, ends=ends: beside(at, key, *ends))
            )
    conditions += [lambda at, ratio=ratio: geared(at, root, members, ratio) for ratio in root.iterfind("ratios/ratio")]
    return drawn, conditions, drives


def geared(at, root, members, ratio):
    """Difference of the arcs that two wheels roll on each other, seen from the link that carries both."""
    wheels = [next(one for one in root.findall("Link") if one.get("id") == each.get("id")) for each in ratio]
    keys = [each.get("id") for each in wheels]
    pins = [members[key][0] for key in keys]
    carrier = next((points for key, points in members.items() if key not in keys and {*pins} <= {*points}), None)
    carried = turned(at, *pins) if carrier and pins[0] != pins[1] else 0.0
    arcs = []
    for wheel, pin, each in zip(wheels, pins, ratio, strict=True):
        own = members.get(wheel.get("fastenlink")) or next(
            (points for points in members.values() if pin in points and len(points) > 1 and points != carrier), None
        )
        if wheel.get("fastenconnector"):
            angle = 0.0
        elif own is None:
            return  # a wheel that moves no point
        else:
            angle = turned(at, own[0], next(point for point in own if point != own[0]))
        arcs.append(float(each.get("size")) * (angle - carried))
    yield arcs[0] + arcs[1] if ratio.get("type") == "gears" else arcs[0] - arcs[1]


def on_arc(at, point, a, b, radius):
    """Deviation from the radius of the arc through a and b: about the centre on the point's own circle."""
    half = (at[b] - at[a]) / 2
    height = sqrt(max(radius**2 - abs(half[0]) ** 2, 0.0))
    spans = [abs(at[point] - at[a] - half - side * height * 1j * half / abs(half)) for side in (1, -1)]
    yield min((span - span[0] for span in spans), key=lambda off: abs(off).max())


def check_drive(at, time, drive):
    """A drive has the speed of its file, or its mean speed between limits."""
    arms, here, ends, speed = drive
    if isinstance(arms, list) and not {point for arm in arms for point in arm} <= at.keys():
        return  # a link that is fastened to the frame
    if arms == "throw":
        length = abs(at[here[-1]] - at[here[0]])
        assert length[np.argmax(abs(length - length[0]))] - length[0] == pytest.approx(ends, rel=2e-3)
        assert time[np.argmax(abs(length - length[0]))] % speed == pytest.approx(speed / 2, rel=1e-2)
        return
    if arms is None:
        way = ((at[here] - at[ends[0]]) * line(at, *ends).conjugate()).real if ends else abs(at[here] - at[here][0])
        mean = np.abs(np.diff(way)).sum() / np.ptp(time)
        assert mean == pytest.approx(speed, rel=3e-2)
        return
    angle = sum(sign * turned(at, *arm) for sign, arm in zip((-1, 1) if len(arms) > 1 else (1,), arms, strict=True))
    rate = np.diff(angle) / np.diff(time) * 30 / np.pi
    if np.ptp(angle) > 2 * np.pi * 0.99:
        np.testing.assert_allclose(rate, speed, rtol=1e-3)
    else:
        assert np.sign(rate[rate != 0][0]) == np.sign(speed)
        assert np.abs(np.diff(angle)).sum() / np.ptp(time) * 30 / np.pi == pytest.approx(abs(speed), rel=3e-2)


def places_of(text):
    """Places of all named points, in the file's unit, and times over a cycle."""
    scene = kinelast.scene_from_text(text)
    motion = kinelast.scene_motion(scene, POSITIONS)
    unit = {"cm": 0.01, "mm": 0.001, "in": 0.0254}[re.search('units = "(.*)"', text)[1]]
    at = {}
    for number, one in enumerate(scene.mechanism.links):
        for point in one.points:
            at.setdefault(point, np.broadcast_to(position_of(motion, number, point) / unit, POSITIONS))
    return at, motion.time


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", FILES)
def test_a_library_of_another_program_moves_as_its_files_say(name):
    texts, refused = mechanisms(name), {}
    assert len(texts) == COUNT[name]
    for key, text in texts.items():
        first = imported(of_text(text, key))
        if first.reason:
            refused[key] = first.reason
            continue
        drawn, conditions, drives = (of_linkage if name == "Linkage" else of_pmks)(text)
        at, time = places_of(first.text)
        size = np.ptp([place.real for place in drawn.values()]) + np.ptp([place.imag for place in drawn.values()])
        for point in drawn.keys() & at.keys():
            assert abs(at[point][0] - drawn[point]) < TOLERANCE * max(size, 1), (key, point)
            one, two = (abs(at[point][stride:] - at[point][:-stride]).max() for stride in (1, 2))
            assert one < 0.75 * two or two < 1e-6 * size, (key, point)  # a jump is as long over two steps as over one
        for condition in conditions:
            for off in condition(at):
                assert abs(off).max() < 1e-6 * size, key
        for drive in drives:
            check_drive(at, time, drive)
    assert refused.keys() == {key for key in REFUSED if key in texts}
    assert all(REFUSED[key] in reason for key, reason in refused.items())
