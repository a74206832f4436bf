"""Random geared mechanisms, and their free bodies by Newton-Euler equations.

These references do not use the program. Positions and accelerations are closed forms of the drive coordinates. Forces
of pins, guides, teeth and drives solve one system with three equations per body.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from msgspec import Struct

from rigid import Gear, Link, Lump, Mechanism, PinDrive, PointLoad, Slider, SliderDrive

GRAVITY = 1.3 - 9.81j
POSITIONS = 7


@dataclass
class Body:
    """Moving body: hub [m], hub acceleration, angle, angular velocity and acceleration at all positions."""

    name: str
    hub: Any
    hub_acceleration: Any
    angle: Any
    omega: Any
    epsilon: Any
    mass: float
    inertia: float
    offset: complex
    moment: float = 0.0

    @property
    def center(self) -> Any:
        """Centre of mass [m]."""
        return self.hub + np.exp(1j * self.angle) * self.offset

    @property
    def load(self) -> Any:
        """Weight and inertia force [N]."""
        turned = (1j * self.epsilon - self.omega**2) * np.exp(1j * self.angle) * self.offset
        return self.mass * (GRAVITY - self.hub_acceleration - turned)

    @property
    def couple(self) -> Any:
        """Given moment and inertia moment about the centre of mass [N m]."""
        return self.moment - self.inertia * self.epsilon


@dataclass
class Mesh:
    """Teeth on `follower` by `driver` (None: ground) at `pitch`: unit `tangent`, and `away` from the driver."""

    follower: str
    driver: str | None
    pitch: Any
    tangent: Any
    away: Any


class Train(Struct):
    """A mechanism, its drive coordinates and rates of shape (drives, positions), and its free bodies.

    `pins`: child, parent (None: ground), place. `guides`: body, place, direction. `drives`: body, parent, and None
    for a moment or the direction of a force.
    """

    mechanism: Mechanism
    drive: Any
    rate: Any
    rate2: Any
    bodies: list[Body]
    pins: list[tuple[str, str | None, Any]]
    meshes: list[Mesh]
    drives: list[tuple[str, str | None, complex | None]]
    guides: list[tuple[str, Any, complex]] = []
    angle: float = np.radians(20.0)


@dataclass
class Free:
    """Forces on the children [N] (complex) and moments [N m] at each position."""

    pins: Any
    meshes: Any
    efforts: Any
    guides: Any
    ground: Any
    ground_moment: Any


def free_bodies(train: Train) -> Free:
    """Return all forces at all positions."""
    found = [_at(train, k) for k in range(POSITIONS)]
    return Free(*(np.array(part) for part in zip(*found, strict=True)))


def _at(train: Train, k: int) -> tuple[Any, ...]:
    """Solve one position; the loaded flanks are those with pushing forces."""
    flanks = [1.0] * len(train.meshes)
    for _ in range(len(flanks) + 1):
        found, pushes = _solved(train, k, flanks)
        wrong = [number for number, push in enumerate(pushes) if push * flanks[number] < 0]
        if not wrong:
            break
        flanks[wrong[0]] *= -1
    assert not wrong
    return found


def _solved(train: Train, k: int, flanks: list[float]) -> tuple[Any, Any]:
    numbers = {body.name: row for row, body in enumerate(train.bodies)}
    unknowns: list[list[tuple[str | None, complex, complex, float]]] = []
    for child, parent, place in train.pins:
        unknowns += [
            [(child, place_of(place, k), way, 0.0), (parent, place_of(place, k), -way, 0.0)] for way in (1, 1j)
        ]
    lines = []
    for mesh, flank in zip(train.meshes, flanks, strict=True):
        pitch, tangent, away = (place_of(part, k) for part in (mesh.pitch, mesh.tangent, mesh.away))
        lines.append(np.cos(train.angle) * tangent + flank * np.sin(train.angle) * away)
        unknowns.append([(mesh.follower, pitch, lines[-1], 0.0), (mesh.driver, pitch, -lines[-1], 0.0)])
    for body, place, way in train.guides:
        spot = place_of(place, k)
        unknowns += [
            [(body, spot, 1j * way, 0.0), (None, spot, -1j * way, 0.0)],
            [(body, spot, 0.0, 1.0), (None, spot, 0.0, -1.0)],
        ]
    for body, parent, way in train.drives:
        spot = place_of(train.bodies[numbers[body]].hub, k)
        force, moment = (0.0, 1.0) if way is None else (way, 0.0)
        unknowns.append([(body, spot, force, moment), (parent, spot, -force, -moment)])
    matrix, right = np.zeros((3 * len(numbers), len(unknowns))), np.zeros(3 * len(numbers))
    ground = np.zeros((3, len(unknowns)))
    for column, acts in enumerate(unknowns):
        for body, place, force, moment in acts:
            if body is None:
                ground[:, column] += [np.real(force), np.imag(force), moment + (np.conj(place) * force).imag]
            else:
                row = 3 * numbers[body]
                arm = place - train.bodies[numbers[body]].center[k]
                about = moment + (np.conj(arm) * force).imag
                matrix[row : row + 3, column] += [np.real(force), np.imag(force), about]
    for row, body in enumerate(train.bodies):
        load = place_of(body.load, k)
        right[3 * row : 3 * row + 3] = [-load.real, -load.imag, -place_of(body.couple, k)]
    assert matrix.shape[0] == matrix.shape[1]
    amount = np.linalg.solve(matrix, right)
    pins, teeth, guides = 2 * len(train.pins), len(train.meshes), 2 * len(train.guides)
    pushes = amount[pins : pins + teeth]
    onto = ground @ amount
    held = amount[pins + teeth : pins + teeth + guides]
    return (
        amount[0:pins:2] + 1j * amount[1:pins:2],
        pushes * lines,
        amount[pins + teeth + guides :],
        held,
        onto[0] + 1j * onto[1],
        onto[2],
    ), pushes


def place_of(values: Any, k: int) -> Any:
    """Return the value at position k."""
    return np.broadcast_to(values, (POSITIONS,))[k]


class _Made:
    """Random dimensions."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.links: list[Link] = []
        self.bodies: list[Body] = []
        self.loads: list[PointLoad] = []

    def number(self, low: float, high: float) -> float:
        return float(self.random.uniform(low, high))

    def way(self) -> complex:
        return complex(np.exp(1j * self.number(0, 2 * np.pi)))

    def course(self, drives: int = 1, size: float = 1.0) -> tuple[Any, Any, Any]:
        return tuple(size * self.random.uniform(-width, width, (drives, POSITIONS)) for width in (3.0, 20.0, 90.0))  # type: ignore[return-value]

    def body(
        self, name: str, points: dict[str, complex], hub: Any, hub_acceleration: Any, turn: Any, load: bool
    ) -> None:
        """Add a link with an eccentric lump, and its free body; `turn` has angle and rates."""
        first = next(iter(points))
        mass, inertia = self.number(0.2, 2.0), self.number(1e-3, 1e-2)
        offset = self.number(0.005, 0.03) * self.way()
        moment = self.number(-8.0, 8.0) if load else 0.0
        self.links.append(Link(name, points, (), (Lump(first, mass, inertia, offset),)))
        if load:
            self.loads.append(PointLoad(name, first, moment=moment))
        self.bodies.append(Body(name, hub, hub_acceleration, *turn, mass, inertia, offset, moment))

    def mechanism(
        self, ground: dict[str, complex], drives: Any, gears: Any, sliders: Any = (), **drawing: complex
    ) -> Any:
        places = {**ground, **drawing}
        links = (Link("ground", ground), *self.links)
        return Mechanism(links, drives, places, sliders, GRAVITY, tuple(self.loads), gears)


def pair(seed: int, internal: bool = False) -> Train:
    """Return two wheels on the ground, or a wheel and a ring, each of which can be the driver."""
    made = _Made(seed)
    q, v, a = made.course()
    one, way, r1, r2 = made.number(-0.2, 0.2) + 0.1j, made.way(), made.number(0.03, 0.06), made.number(0.09, 0.15)
    if internal and seed % 2:
        r1, r2 = r2, r1
    other = one + (r2 - r1 if internal else r1 + r2) * way
    if internal and r1 > r2:
        other = one + (r1 - r2) * way
    ratio = r1 / r2 if internal else -r1 / r2
    made.body("one", {"O": 0.0}, one, 0.0, (q[0], v[0], a[0]), load=False)
    made.body("two", {"W": 0.0}, other, 0.0, (ratio * q[0], ratio * v[0], ratio * a[0]), load=True)
    mesh = gear_mesh("two", "one", other, one, r2, r1, internal)
    gear = Gear(PinDrive("one", "O"), PinDrive("two", "W"), ratio)
    mechanism = made.mechanism({"O": one, "W": other}, (PinDrive("one", "O"),), (gear,))
    pins = [("one", None, one), ("two", None, other)]
    return Train(mechanism, q, v, a, made.bodies, pins, [mesh], [("one", None, None)])


def gear_mesh(
    follower: str, driver: str | None, own: Any, led: Any, radius: float, driving: float, internal: bool = False
) -> Mesh:
    """Return the mesh of wheels with centres `own` and `led`; an internal mesh pushes the smaller wheel inwards."""
    towards = (own - led) / np.abs(own - led)
    if not internal:
        return Mesh(follower, driver, led + driving * towards, -1j * towards, towards)
    if radius > driving:  # in the ring beyond the driver, which is pushed towards the ring's centre
        return Mesh(follower, driver, led - driving * towards, -1j * towards, -towards)
    return Mesh(follower, driver, own + radius * towards, 1j * towards, -towards)


def internal_pair(seed: int) -> Train:
    """Return a wheel and a ring, each of which can be the driver."""
    return pair(seed, internal=True)


def idler_chain(seed: int) -> Train:
    """Return three wheels on the ground."""
    made = _Made(seed)
    q, v, a = made.course()
    radii = [made.number(0.03, 0.1) for _ in range(3)]
    places = [0.1 + 0.2j]
    for k in (1, 2):
        places.append(places[-1] + (radii[k - 1] + radii[k]) * made.way())
    rates = [1.0, -radii[0] / radii[1], radii[0] / radii[2]]
    names, points = ("one", "idler", "two"), ("O", "I", "W")
    for name, point, place, rate in zip(names, points, places, rates, strict=True):
        made.body(name, {point: 0.0}, place, 0.0, (rate * q[0], rate * v[0], rate * a[0]), load=name == "two")
    gears = tuple(
        Gear(PinDrive(names[k - 1], points[k - 1]), PinDrive(names[k], points[k]), -radii[k - 1] / radii[k])
        for k in (1, 2)
    )
    meshes = [gear_mesh(names[k], names[k - 1], places[k], places[k - 1], radii[k], radii[k - 1]) for k in (1, 2)]
    mechanism = made.mechanism(dict(zip(points, places, strict=True)), (PinDrive("one", "O"),), gears)
    pins = [(name, None, place) for name, place in zip(names, places, strict=True)]
    return Train(mechanism, q, v, a, made.bodies, pins, meshes, [("one", None, None)])


def planetary(seed: int) -> Train:
    """Return an arm with a planet around a sun on the ground, in a rotating ring."""
    made = _Made(seed)
    q, v, a = made.course()
    sun, planet, center = made.number(0.03, 0.08), made.number(0.02, 0.06), 0.2 - 0.1j
    ring, length = sun + 2 * planet, sun + planet
    e = np.exp(1j * q[0])
    hub, spun = center + length * e, length * e * (1j * a[0] - v[0] ** 2)
    rate = 1 + sun / planet, 1 + sun / ring  # Willis
    made.body("arm", {"O": 0.0, "P": length}, center, 0.0, (q[0], v[0], a[0]), load=False)
    made.body("planet", {"P": 0.0}, hub, spun, tuple(rate[0] * x for x in (q[0], v[0], a[0])), load=False)
    made.body("ring", {"O": 0.0}, center, 0.0, tuple(rate[1] * x for x in (q[0], v[0], a[0])), load=True)
    gears = (
        Gear(PinDrive("ground", "O", "arm"), PinDrive("planet", "P", "arm"), -sun / planet),
        Gear(PinDrive("planet", "P", "arm"), PinDrive("ring", "O", "arm"), planet / ring),
    )
    meshes = [
        gear_mesh("planet", None, hub, center, planet, sun),
        gear_mesh("ring", "planet", center, hub, ring, planet, internal=True),
    ]
    mechanism = made.mechanism({"O": center}, (PinDrive("arm", "O"),), gears, P=center + length)
    pins = [("arm", None, center), ("planet", "arm", hub), ("ring", "arm", center)]
    return Train(mechanism, q, v, a, made.bodies, pins, meshes, [("arm", None, None)])


def sun_driven(seed: int) -> Train:
    """Return a sun that drives a planet in a ring on the ground, and so the arm of the planet."""
    return _epicyclic(seed, drives=1)


def differential(seed: int) -> Train:
    """Return a driven sun and a driven ring, which move a planet and its arm."""
    return _epicyclic(seed, drives=2)


def _epicyclic(seed: int, drives: int) -> Train:
    """Return an arm and its planet, each of which drives the gear of the other."""
    made = _Made(seed)
    q, v, a = made.course(drives)
    sun, planet, center = made.number(0.03, 0.08), made.number(0.02, 0.06), 0.2 - 0.1j
    ring, length = sun + 2 * planet, sun + planet
    suns, rings = [x[0] for x in (q, v, a)], [x[1] if drives == 2 else 0 * x[0] for x in (q, v, a)]
    arms = [(sun * x + ring * y) / (sun + ring) for x, y in zip(suns, rings, strict=True)]  # Willis
    planets = [(1 + sun / planet) * z - sun / planet * x for x, z in zip(suns, arms, strict=True)]
    e = np.exp(1j * arms[0])
    hub, spun = center + length * e, length * e * (1j * arms[2] - arms[1] ** 2)
    made.body("sun", {"O": 0.0}, center, 0.0, tuple(suns), load=False)
    if drives == 2:
        made.body("ring", {"O": 0.0}, center, 0.0, tuple(rings), load=False)
    made.body("arm", {"O": 0.0, "P": length}, center, 0.0, tuple(arms), load=True)
    made.body("planet", {"P": 0.0}, hub, spun, tuple(planets), load=False)
    outer = "ring" if drives == 2 else "ground"
    gears = (
        Gear(PinDrive("sun", "O", "arm"), PinDrive("planet", "P", "arm"), -sun / planet),
        Gear(PinDrive("planet", "P", "arm"), PinDrive("arm", "O", outer), -planet / ring),
    )
    held = None if drives == 1 else "ring"
    meshes = [
        gear_mesh("planet", "sun", hub, center, planet, sun),
        gear_mesh("planet", held, hub, center, planet, ring, internal=True),
    ]
    movers = ["sun", "ring"][:drives]
    moved = tuple(PinDrive(name, "O") for name in movers)
    mechanism = made.mechanism({"O": center}, moved, gears, P=center + length)
    pins = [*((name, None, center) for name in movers), ("arm", held, center), ("planet", "arm", hub)]
    return Train(mechanism, q, v, a, made.bodies, pins, meshes, [(name, None, None) for name in movers])


def wheels_on_an_arm(seed: int) -> Train:
    """Return a driven arm with two wheels, the first of which is driven."""
    made = _Made(seed)
    q, v, a = made.course(2)
    radii, first, center = (made.number(0.03, 0.1), made.number(0.03, 0.1)), made.number(0.05, 0.2), -0.1j
    second = first + sum(radii) * made.way()
    e = np.exp(1j * q[0])
    turned = e * (1j * a[0] - v[0] ** 2)
    ratio = -radii[0] / radii[1]
    made.body("arm", {"O": 0.0, "P": first, "Q": second}, center, 0.0, (q[0], v[0], a[0]), load=False)
    hubs = center + first * e, center + second * e
    made.body("one", {"P": 0.0}, hubs[0], first * turned, tuple(x[0] + x[1] for x in (q, v, a)), load=False)
    made.body("two", {"Q": 0.0}, hubs[1], second * turned, tuple(x[0] + ratio * x[1] for x in (q, v, a)), load=True)
    drives = PinDrive("arm", "O"), PinDrive("one", "P", "arm")
    gears = (Gear(PinDrive("one", "P", "arm"), PinDrive("two", "Q", "arm"), ratio),)
    mechanism = made.mechanism({"O": center}, drives, gears, P=center + first, Q=center + second)
    mesh = gear_mesh("two", "one", hubs[1], hubs[0], radii[1], radii[0])
    pins = [("arm", None, center), ("one", "arm", hubs[0]), ("two", "arm", hubs[1])]
    return Train(mechanism, q, v, a, made.bodies, pins, [mesh], [("arm", None, None), ("one", "arm", None)])


def rack(seed: int, drives: bool = False) -> Train:
    """Return a rack on the ground and a wheel; `drives` makes the rack the driver."""
    made = _Made(seed)
    radius, way, center, origin = made.number(0.03, 0.08), made.way(), 0.1 + 0.1j, -0.2 + 0.3j
    rho = radius if seed % 2 else -radius  # slide per angle
    turn = made.course()
    slide = tuple(rho * x for x in turn)
    side = -1j * way * np.sign(rho)
    made.body("wheel", {"W": 0.0}, center, 0.0, tuple(x[0] for x in turn), load=drives)
    made.body("rack", {"R": 0.0}, origin + slide[0][0] * way, slide[2][0] * way, (0.0, 0.0, 0.0), load=True)
    guide = Slider("guide", "rack", "ground", "R", origin, way)
    pin, sliding = PinDrive("wheel", "W"), SliderDrive("guide")
    gear = Gear(sliding, pin, 1 / rho) if drives else Gear(pin, sliding, rho)
    mechanism = made.mechanism({"W": center}, (sliding if drives else pin,), (gear,), (guide,), R=origin)
    pitch = center + radius * side
    mesh = (
        Mesh("wheel", "rack", pitch, np.sign(rho) * way, -side) if drives else Mesh("rack", "wheel", pitch, way, side)
    )
    driven = ("rack", None, way) if drives else ("wheel", None, None)
    guides = [("rack", origin + slide[0][0] * way, way)]
    return Train(
        mechanism, *(slide if drives else turn), made.bodies, [("wheel", None, center)], [mesh], [driven], guides
    )


def driving_rack(seed: int) -> Train:
    """Return a rack that drives a wheel."""
    return rack(seed, drives=True)


def cart(seed: int, by_wheel: bool = False) -> Train:
    """Return a driven cart on the ground with a rolling wheel, as if the ground were the driving rack."""
    made = _Made(seed)
    s, v, a = made.course(1, 0.1)
    radius, way, origin = made.number(0.03, 0.08), made.way(), 0.2 - 0.3j
    ratio = (1 if seed % 2 else -1) / radius
    hub = origin + s[0] * way
    made.body("cart", {"R": 0.0}, hub, a[0] * way, (0.0, 0.0, 0.0), load=True)
    made.body("wheel", {"R": 0.0}, hub, a[0] * way, tuple(ratio * x[0] for x in (s, v, a)), load=True)
    guide = Slider("guide", "cart", "ground", "R", origin, way)
    sliding, turning = SliderDrive("guide"), PinDrive("wheel", "R", "cart")
    gear = Gear(turning, sliding, 1 / ratio) if by_wheel else Gear(sliding, turning, ratio)
    mechanism = made.mechanism({}, (turning if by_wheel else sliding,), (gear,), (guide,), R=origin)
    # The rim is at rest at the contact: s way + i ratio s (pitch - hub) = 0.
    side = 1j * way / (ratio * radius)
    mesh = Mesh("wheel", None, hub + radius * side, -way * np.sign(ratio), -side)
    driven = ("wheel", "cart", None) if by_wheel else ("cart", None, way)
    course = [ratio * x for x in (s, v, a)] if by_wheel else (s, v, a)
    return Train(mechanism, *course, made.bodies, [("wheel", "cart", hub)], [mesh], [driven], [("cart", hub, way)])


def motor_cart(seed: int) -> Train:
    """Return a cart with a motor that drives its rolling wheel."""
    return cart(seed, by_wheel=True)


TRAINS: dict[str, Callable[[int], Train]] = {
    "external pair": pair,
    "internal pair": internal_pair,
    "idler chain": idler_chain,
    "planetary": planetary,
    "driven sun": sun_driven,
    "differential": differential,
    "wheels on an arm": wheels_on_an_arm,
    "driven rack": rack,
    "driving rack": driving_rack,
    "cart": cart,
    "motor cart": motor_cart,
}
