"""Positions of all links and joints of a mechanism, without velocities, and the tooth contacts of its gears."""

import numpy as np
from msgspec import Struct

from rigid.arrays import Complex, Complexes
from rigid.joints import Joint, JointPlace, Placed, point_of
from rigid.mechanism import Mechanism
from rigid.teeth import Teeth, pitch_reach, wheel_push


class Posture(Struct, frozen=True, eq=False):
    """Positions of all links of a mechanism.

    Attributes
    ----------
    origin
        Origin of each link's axes (complex) [m], shape (links, ...), in the order of `Mechanism.links`.
    direction
        Unit vector of each link's x axis (complex), shape (links, ...).
    """

    mechanism: Mechanism
    origin: Complexes
    direction: Complexes

    def place(self, link: int, local: Complex) -> Complexes:
        """Return the position of a point given in link axes [m], shape (...)."""
        return np.asarray(self.origin[link] + self.direction[link] * local)

    def point(self, link: str, point: str) -> Complexes:
        """Return the position of a link's point given by name [m], shape (...)."""
        number = self.mechanism.index[link]
        return self.place(number, self.mechanism.links[number].points[point])

    def __repr__(self) -> str:
        return f"Posture({len(self.origin)} links, columns {self.origin.shape[1:]})"


def posture(motion: Placed, places: object = ...) -> Posture:
    """Return the postures of a motion at all columns, or at the selected ones."""
    at = (slice(None), *places) if isinstance(places, tuple) else (slice(None), places)
    return Posture(motion.mechanism, np.asarray(motion.origin)[at], np.asarray(motion.direction)[at])


def joint_place(placed: Placed, joint: Joint) -> JointPlace:
    """Return a joint of two placed links."""
    return joint.place(placed, None if joint.gear is None else teeth_of(placed, joint))


def teeth_of(placed: Placed, joint: Joint) -> Teeth | None:
    """Return the tooth contact of a joint that follows a gear, or None if there is no pitch point.

    There is a pitch point if one carrier link holds both wheels, or wheel and rack, by pins or sliders. Wheels with a
    ratio of 1 or with coincident axes have no pitch point.
    """
    gear = joint.gear
    if gear is None or gear.pressure_angle is None or not {joint.parent, joint.child} & set(gear.ends):
        return None
    carrier, wheel, sense = joint.parent, joint.child, 1
    if carrier not in gear.ends:
        carrier, wheel, sense = wheel, carrier, -1
    driver, slope = gear.driver, float(np.tan(gear.pressure_angle))
    leads = driver.parent == carrier
    body = driver.child if leads else driver.parent
    # rate of the follower / rate of the driving body, both relative to the carrier
    rate = sense * joint.sense * gear.ratio * (1 if leads else -1)
    at = wheel if joint.turns else joint.block
    centre = point_of(placed, at, joint.at(at))
    hub = point_of(placed, body, driver.at(body))
    if not joint.turns and not driver.turns:
        return None
    if not joint.turns:
        along = joint.along(placed)
        reach_body = -1j * rate * along
        reach = hub + reach_body - centre
        apart = (-1j * slope * np.sign(rate)) * along
    elif not driver.turns:
        reach = -1j / rate * driver.along(placed)
        reach_body = centre + reach - hub
        along, apart = wheel_push(reach, slope, ring=False)
    else:
        if rate == 1 or np.all(driver.at(carrier) == joint.at(carrier)):
            return None
        reach = pitch_reach(hub - centre, rate)
        reach_body = rate * reach
        along, apart = wheel_push(reach, slope, ring=0 < rate < 1)
    arm = hub - placed.origin[body] + reach_body
    return Teeth(wheel, sense, body, arm, reach_body, reach, along, apart)
