"""Contributions of links and joints to the error of the output."""

from typing import Any, cast

import numpy as np
from msgspec.structs import replace

from elastic import Deflection, deflection, displacement_of
from elastic.assessment import angle_error
from elastic.links import AddedLoads, map_loads
from kinelast.answers.results import Results
from kinelast.reports.report import LinkShare
from kinelast.scene.data import scene_deflection
from kinelast.scene.limits import Output
from kinelast.values.reading import Reading, known
from rigid import posture
from rigid.arrays import Numbers, Reals

ROUND_OFF = 1e-9  # a smaller rest that no link or joint contributes, relative to the error, is round-off


def output_shares(results: Results, output: Output, error: Reading) -> list[LinkShare]:
    """Return the contributions of flexible links and joints to the error of the output, when this error is largest.

    In a statically determinate mechanism, displacements are linear in the compliances. Doubling the stiffness of a link
    removes half of its contribution, so the contribution is exactly twice the change in the error. If the output is a
    point, only the component in the direction of its total displacement is used. The difference between the error and
    the sum of the contributions is listed as "others". It is due to prescribed strains, gaps of joints, rotations of
    links and statically indeterminate forces.

    Parameters
    ----------
    error
        Largest error of the output, with the time at which it occurs.
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
    """Return the deflection at an instant for several designs.

    The first design is the scene itself. In each other design, one link or joint is twice as stiff.
    """
    scene, designs = results.scene, 1 + len(links) + len(joints)

    def compliance(part: int) -> Reals:
        """Return the compliance of one link or joint in all designs, relative to its compliance in the first design."""
        return np.where(np.arange(designs) == 1 + part, 0.5, 1.0)[:, None]

    sections = []
    for (at, _), section in zip(results.mechanism.beams, scene.sections, strict=True):
        factor = 1.0 / compliance(links.index(at)) if at in links else np.ones((designs, 1))
        sections.append(replace(section, EA=section.EA * factor, EI=section.EI * factor, kGA=section.kGA * factor))
    stiffened = {**scene.joints}
    for number, name in enumerate(joints, len(links)):
        own, softness = scene.joints[name], cast(Any, compliance(number))  # the solver also accepts arrays
        stiffened[name] = replace(own, translation=own.translation * softness, rotation=own.rotation * softness)
    at, instant = int(np.argmin(np.abs(results.motion.time - time))), np.array([time])
    at_hand = results.motion.time[at] == time  # true if this instant is a position of the run, whose branch is known
    moved = scene.course.near(instant, posture(results.motion, [at])) if at_hand else scene.course.at(instant)
    plain = scene_deflection(scene, moved)
    more = (results.answer.at(plain) if results.answer else plain).added
    return deflection(moved, sections, stiffened, None if more is None else _for_designs(more, designs))


def _for_designs(loads: AddedLoads, designs: int) -> AddedLoads:
    """Return the loads at one instant, repeated for all designs."""

    def repeated(part: Any) -> Numbers:
        wide = np.broadcast_to(part, (*np.shape(part)[:-1], 1))
        return np.repeat(wide[..., None, :], designs, axis=-2)

    return map_loads(repeated, loads)


def _error(output: Output, bent: Deflection, error: Reading) -> tuple[float, Reals]:
    """Return the error of the output in the first design, and its errors in the other designs."""
    if not output.point:
        turned = angle_error(bent, output.link, str(error.point))[:, 0]
        return float(turned[0]), turned[1:]
    moved = displacement_of(bent, output.link, output.point)[:, 0]
    along = (np.conj(moved[0] / abs(moved[0])) * moved).real
    return float(along[0]), along[1:]
