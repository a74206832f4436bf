"""Contributions of the links to the error of the output."""

from dataclasses import replace
from typing import Any

import numpy as np

from elastic import Deflection, deflection, displacement_of
from elastic.assessment import angle_error
from elastic.links import AddedLoads, map_loads
from kinelast.figures.report import LinkShare
from kinelast.figures.results import Results
from kinelast.scene.limits import Output
from kinelast.scene.reading import Reading, known
from rigid import posture
from rigid.arrays import Numbers, Reals

ROUND_OFF = 1e-9  # remainder relative to the error


def output_shares(results: Results, output: Output, error: Reading) -> list[LinkShare]:
    """Return the contribution of each link to the error of the output at the moment of the largest error.

    In a statically determinate mechanism, displacements are linear in the compliances. Doubling the stiffness of a link
    removes half of its contribution, so the contribution is exactly twice the difference. For a point it is the
    component along the total displacement. The remainder is called "others": prescribed strains, soft joints,
    statically indeterminate forces.

    Parameters
    ----------
    error
        The largest error.
    """
    if not error.value or not error.time or not results.mechanism.beams:
        return []
    pairs = zip(results.mechanism.beams, results.scene.sections, strict=True)
    links = list(dict.fromkeys(at for (at, _), section in pairs if np.isfinite(section.EI)))
    if not links:
        return []
    time = error.time.value
    assert time is not None
    total, parts = _error(output, _stiffened(results, links, time), error)
    shares = 2.0 * (total - parts)
    rows = [(results.mechanism.links[at].name, share) for at, share in zip(links, shares, strict=True)]
    rest = total - shares.sum()
    if abs(rest) > ROUND_OFF * abs(total):
        rows.append(("others", rest))
    return [LinkShare(link=name, value=known(share), unit=error.unit) for name, share in rows]


def _stiffened(results: Results, links: list[int], time: float) -> Deflection:
    """Return the deflection at an instant: the first design is unchanged, the others have one link twice as stiff."""
    scene = results.scene
    sections = []
    for (at, _), section in zip(results.mechanism.beams, scene.sections, strict=True):
        factor = np.array([1.0, *(2.0 if at == other else 1.0 for other in links)])[:, None]
        sections.append(replace(section, EA=section.EA * factor, EI=section.EI * factor, kGA=section.kGA * factor))
    at, instant = int(np.argmin(np.abs(results.motion.time - time))), np.array([time])
    at_hand = results.motion.time[at] == time  # this position was computed, so its branch is known
    moved = scene.course.near(instant, posture(results.motion, [at])) if at_hand else scene.course.at(instant)
    more = results.deflection.added
    return deflection(moved, sections, scene.joints, None if more is None else _of_position(more, at, len(links) + 1))


def _of_position(loads: AddedLoads, at: int, designs: int) -> AddedLoads:
    """Return the loads at one position for all designs."""
    count = loads.q.shape[-1]

    def there(part: Any) -> Numbers:
        wide = np.broadcast_to(part, (*np.shape(part)[:-1], count))
        return np.repeat(wide[..., at, None, None], designs, axis=-2)

    return map_loads(there, loads)


def _error(output: Output, bent: Deflection, error: Reading) -> tuple[float, Reals]:
    """Return the unchanged error, and the error with each link stiffened."""
    if not output.point:
        turned = angle_error(bent, output.link, str(error.point))[:, 0]
        return float(turned[0]), turned[1:]
    moved = displacement_of(bent, output.link, output.point)[:, 0]
    along = (np.conj(moved[0] / abs(moved[0])) * moved).real
    return float(along[0]), along[1:]
