"""Contributions of the links and joints to the error of the output."""

from dataclasses import replace
from typing import Any, cast

import numpy as np

from elastic import Deflection, deflection, displacement_of
from elastic.assessment import angle_error
from elastic.links import AddedLoads, map_loads
from kinelast.figures.report import LinkShare
from kinelast.figures.results import Results
from kinelast.scene.data import scene_deflection
from kinelast.scene.limits import Output
from kinelast.scene.reading import Reading, known
from rigid import posture
from rigid.arrays import Numbers, Reals

ROUND_OFF = 1e-9  # remainder / error below which the remainder is neglected


def output_shares(results: Results, output: Output, error: Reading) -> list[LinkShare]:
    """Return the contributions of links and soft joints to the error of the output at the moment of the largest error.

    In a statically determinate mechanism, displacements are linear in the compliances. Doubling the stiffness of a link
    removes half of its contribution, so the contribution is exactly twice the difference. For a point it is the
    component along the total displacement. The remainder is called "others": prescribed strains, gaps of joints,
    rotated links, statically indeterminate forces.

    Parameters
    ----------
    error
        The largest error of the output, with its time.
    """
    if not error.value or not error.time or not results.mechanism.beams:
        return []
    pairs = zip(results.mechanism.beams, results.scene.sections, strict=True)
    links = list(dict.fromkeys(at for (at, _), section in pairs if np.isfinite(section.EI)))
    joints = [name for name, own in results.scene.joints.items() if own.translation or own.rotation]
    if not links and not joints:
        return []
    time = error.time.value
    assert time is not None
    total, parts = _error(output, _stiffened(results, links, joints, time), error)
    shares = 2.0 * (total - parts)
    names = [*(results.mechanism.links[at].name for at in links), *(f"joint {name}" for name in joints)]
    rows = list(zip(names, shares, strict=True))
    rest = total - shares.sum()
    if abs(rest) > ROUND_OFF * abs(total):
        rows.append(("others", rest))
    return [LinkShare(link=name, value=known(share), unit=error.unit) for name, share in rows]


def _stiffened(results: Results, links: list[int], joints: list[str], time: float) -> Deflection:
    """Return the deflection at an instant: the first design is unchanged, each other has one part twice as stiff."""
    scene, designs = results.scene, 1 + len(links) + len(joints)

    def compliance(part: int) -> Reals:
        """Return the compliance of a link or joint in all designs, relative to the first."""
        return np.where(np.arange(designs) == 1 + part, 0.5, 1.0)[:, None]

    sections = []
    for (at, _), section in zip(results.mechanism.beams, scene.sections, strict=True):
        factor = 1.0 / compliance(links.index(at)) if at in links else np.ones((designs, 1))
        sections.append(replace(section, EA=section.EA * factor, EI=section.EI * factor, kGA=section.kGA * factor))
    stiffened = {**scene.joints}
    for number, name in enumerate(joints, len(links)):
        own, softness = scene.joints[name], cast(Any, compliance(number))  # these equations also hold for arrays
        stiffened[name] = replace(own, translation=own.translation * softness, rotation=own.rotation * softness)
    at, instant = int(np.argmin(np.abs(results.motion.time - time))), np.array([time])
    at_hand = results.motion.time[at] == time  # this position was computed, so its branch is known
    moved = scene.course.near(instant, posture(results.motion, [at])) if at_hand else scene.course.at(instant)
    plain = scene_deflection(scene, moved)
    more = (results.answer.at(plain) if results.answer else plain).added
    return deflection(moved, sections, stiffened, None if more is None else _for_designs(more, designs))


def _for_designs(loads: AddedLoads, designs: int) -> AddedLoads:
    """Return the loads at one instant for all designs."""

    def repeated(part: Any) -> Numbers:
        wide = np.broadcast_to(part, (*np.shape(part)[:-1], 1))
        return np.repeat(wide[..., None, :], designs, axis=-2)

    return map_loads(repeated, loads)


def _error(output: Output, bent: Deflection, error: Reading) -> tuple[float, Reals]:
    """Return the error of the first design, and the errors with each link stiffened."""
    if not output.point:
        turned = angle_error(bent, output.link, str(error.point))[:, 0]
        return float(turned[0]), turned[1:]
    moved = displacement_of(bent, output.link, output.point)[:, 0]
    along = (np.conj(moved[0] / abs(moved[0])) * moved).real
    return float(along[0]), along[1:]
