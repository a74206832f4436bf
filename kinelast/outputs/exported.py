"""Conversion of a mechanism to the data that the exporters for other programs need."""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from exchange import Drive, ForeignGear, ForeignLink, ForeignLoad, ForeignMechanism, ForeignSlider, Slot, to_and_fro
from kinelast.scene.data import Scene, scene_motion
from rigid import (
    ConstantSpeed,
    Gear,
    Link,
    Mechanism,
    Motion,
    PinDrive,
    PointLoad,
    RepeatedLaw,
    SegmentedLaw,
    SliderDrive,
    Spring,
    TorsionSpring,
    position_of,
)
from rigid.constants import mass_moments

MIN_STROKE = 1e-6  # a motion law counts as oscillating if |sum of strokes| / largest |stroke| is below this limit
STANDARD_GRAVITY = -9.81j  # [m/s^2]
POSITIONS = 360  # number of positions per cycle at which the position of a pin in its slot is evaluated


def exchanged(scene: Scene) -> ForeignMechanism:
    """Return the mechanism of a scene in the initial position, for export to other programs.

    The unit of length is the millimetre, or the inch if the report uses inches. Links that are welded together become
    one link with the sum of the masses. If the block of a slider has only one pin, a slot replaces the slider and the
    block, and the mass of the block is placed at the pin. Beam sections, springs and varying loads are omitted.
    """
    unit, scale = ("in", 1 / 0.0254) if scene.report_units == "in" else ("mm", 1e3)
    motion = scene_motion(scene, POSITIONS)
    mechanism = motion.mechanism
    blocks = {slider.link for slider in mechanism.sliders if len(_link(mechanism, slider.link).points) == 1}
    called = {link.name: link.name for link in mechanism.links}
    order = list(called)
    for weld in mechanism.welds:
        one, other = called[weld.link], called[weld.on]
        if order.index(other) < order.index(one):
            one, other = other, one
        called = {name: one if now == other else now for name, now in called.items()}
    points: dict[str, Any] = {}
    members: dict[str, dict[str, None]] = {}
    for number, link in enumerate(mechanism.links):
        points |= {point: scale * position_of(motion, number, point) for point in link.points}
        if link.name not in blocks:
            members.setdefault(called[link.name], {}).update(dict.fromkeys(link.points))
    ground, *links = members
    slots, slides = _sliding(motion, members, called, blocks, scale)
    drives = tuple(
        _drive(drive, law, called, unit, scale) for drive, law in zip(mechanism.drives, scene.course.laws, strict=True)
    )
    inertias = _inertias(motion, called, scale)
    own_blocks = [(slider.link, slots[slider.name]) for slider in mechanism.sliders if slider.name in slots]
    masses = {slot.point: inertias[block][0] for block, slot in own_blocks if inertias[block][0]}
    own_links = {name: ForeignLink(tuple(members[name]), *inertias[name]) for name in links}
    return ForeignMechanism(
        scene.title, "kinelast", unit, {name: complex(np.ravel(places)[0]) for name, places in points.items()},
        tuple(members[ground]), own_links, slots, slides,
        drives, tuple(_wheels(gear, called) for gear in mechanism.gears), scene.output.point if scene.output else "",
        masses, _steady_loads(motion, called, slots), bool(complex(mechanism.gravity)),
    )  # fmt: skip


def changed_laws(scene: Scene) -> list[str]:
    """Return words on the swinging drives for which the exported swing has another law of time.

    The exported swing has the same strokes, each a harmonic curve, with one mean speed.
    """
    words = []
    for drive, law in zip(scene.mechanism.drives, scene.course.laws, strict=True):
        if not isinstance(law, RepeatedLaw) or not isinstance(law.law, SegmentedLaw):
            continue
        speeds = [abs(float(segment.rise)) / float(segment.duration) for segment in law.law.segments]
        harmonic = all(segment.curve == "harmonic" for segment in law.law.segments)
        if not harmonic or np.ptp(speeds) > MIN_STROKE * max(speeds):
            words.append(f'the law of time of the drive "{drive.name}", which keeps its strokes and its duration')
    return words


def left_out(scene: Scene) -> list[str]:
    """Return words on the loads and the gravity of a scene that the export with constant forces leaves out."""
    mechanism, words = scene.mechanism, []
    for load in mechanism.loads:
        name = getattr(load, "link", "")
        if isinstance(load, Spring | TorsionSpring):
            words.append(f"the spring on {name}")
        elif not isinstance(load, PointLoad) or load.law is not None:
            words.append(f"the load on {name} that is distributed or varies")
        elif load.moment:
            words.append(f"the moment on {name}")
    if (gravity := complex(mechanism.gravity)) and abs(gravity - STANDARD_GRAVITY) > 0.01 * abs(STANDARD_GRAVITY):
        words.append("the value of gravity (PMKS+ takes 9.81 m/s² downwards)")
    return words


def _inertias(motion: Motion, called: Mapping[str, str], scale: float) -> dict[str, tuple[float, complex, float]]:
    """Return the mass [kg], the centre of mass and the moment of inertia [kg m^2] of each link, by name of the link.

    The centre of mass is a complex number in the length unit of the export, at the initial position. The moment of
    inertia refers to the centre of mass.
    """
    parts: dict[str, list[tuple[float, complex, float]]] = {}
    for number, link in enumerate(motion.mechanism.links):
        mass, first, second = (complex(np.ravel(each)[0]) for each in mass_moments(link))
        middle = first / mass if mass else 0j
        origin, turn = (complex(np.ravel(each)[0]) for each in (motion.origin[number], motion.direction[number]))
        about_center = second.real - mass.real * abs(middle) ** 2
        parts.setdefault(called[link.name], []).append((mass.real, origin + turn * middle, about_center))
    inertias = {}
    for name, lumps in parts.items():
        whole = sum(lump[0] for lump in lumps)
        center = sum(mass * place for mass, place, _ in lumps) / whole if whole else lumps[0][1]
        inertia = sum(about + mass * abs(place - center) ** 2 for mass, place, about in lumps)
        inertias[name] = whole, scale * center, inertia
    return inertias


def _steady_loads(motion: Motion, called: Mapping[str, str], slots: Mapping[str, Slot]) -> tuple[ForeignLoad, ...]:
    """Return the constant forces at points of links, as complex numbers in the axes of the ground.

    If a force turns with a link, its components in the initial position are returned. A force on a block that a slot
    replaces acts on the link with the pin in the slot.
    """
    sliders = motion.mechanism.sliders
    called = {**called, **{slider.link: slots[slider.name].link for slider in sliders if slider.name in slots}}
    loads = []
    for load in motion.mechanism.loads:
        if isinstance(load, PointLoad) and load.law is None and complex(load.force):
            turn = motion.direction[motion.mechanism.index[load.link]][0] if load.turning else 1.0
            loads.append(ForeignLoad(called[load.link], load.point, complex(load.force * turn), load.turning))
    return tuple(loads)


def _link(mechanism: Mechanism, name: str) -> Link:
    return mechanism.links[mechanism.index[name]]


def _sliding(
    motion: Motion, members: Mapping[str, Any], called: Mapping[str, str], blocks: Collection[str], scale: float
) -> tuple[dict[str, Slot], dict[str, ForeignSlider]]:
    """Return the slots that replace sliders, and the remaining sliders. The keys are the names of the sliders."""
    slots, slides = {}, {}
    mechanism = motion.mechanism
    for slider in mechanism.sliders:
        on, at = mechanism.index[slider.on], mechanism.index[slider.link]
        along = motion.direction[on] * slider.direction
        (pin, *_) = _link(mechanism, slider.link).points
        others = [name for name, own in members.items() if pin in own and name != called[slider.on]]
        if slider.link in blocks and others:
            way = np.conj(motion.direction[on]) * (position_of(motion, at, pin) - motion.origin[on])
            travel = scale * (np.conj(slider.direction) * (way - way[0])).real
            reach = float(travel.min()), float(travel.max())
            slots[slider.name] = Slot(pin, others[0], called[slider.on], complex(along[0]), reach)
        else:
            names = called[slider.link], called[slider.on]
            slides[slider.name] = ForeignSlider(*names, slider.point, complex(along[0]))
    return slots, slides


def _joint(drive: PinDrive | SliderDrive, called: Mapping[str, str]) -> dict[str, str]:
    if isinstance(drive, SliderDrive):
        return {"slider": drive.slider}
    return {"link": called[drive.link], "on": called[drive.on], "at": drive.at}


def _drive(drive: PinDrive | SliderDrive, law: Any, called: Mapping[str, str], unit: str, scale: float) -> Drive:
    """Return a drive with a constant speed or an oscillating motion law. Any other motion law is omitted."""
    if isinstance(law, RepeatedLaw) and isinstance(law.law, SegmentedLaw):
        duration = sum(float(segment.duration) for segment in law.law.segments)
        per_unit, unit = (180 / np.pi, "deg") if drive.turns else (scale, unit)
        strokes = [per_unit * stroke for stroke in _swing(law.law)]
        speed = sum(map(abs, strokes)) / duration
        return Drive(_joint(drive, called), law=to_and_fro(strokes, speed, unit) if strokes else ())
    if not isinstance(law, ConstantSpeed):
        return Drive(_joint(drive, called))
    speed = float(law.speed)
    words = f"{speed * 30 / np.pi:.12g} rpm" if drive.turns else f"{speed * scale:.12g} {unit}/s"
    return Drive(_joint(drive, called), words)


def _swing(law: SegmentedLaw) -> list[float]:
    """Return the strokes of a law that oscillates between two limits without a dwell.

    For any other motion law, return an empty list.
    """
    strokes: list[float] = []
    for segment in law.segments:
        rise = float(segment.rise)
        if strokes and strokes[-1] * rise > 0:
            strokes[-1] += rise
        else:
            strokes.append(rise)
    closed = abs(sum(strokes)) < MIN_STROKE * max(map(abs, strokes))
    return strokes if closed and len(strokes) <= 3 and all(strokes) else []


def _wheels(gear: Gear, called: Mapping[str, str]) -> ForeignGear:
    ends = _joint(gear.driver, called), _joint(gear.follower, called)
    return ForeignGear(*ends, float(gear.ratio), gear.pressure_angle is not None)
