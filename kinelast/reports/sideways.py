"""Finding on buckling normal to the plane of motion, which a planar analysis does not include."""

from collections.abc import Iterator

import numpy as np

from kinelast.answers.results import Results
from kinelast.values.numbers import number
from kinelast.values.reading import CAUTION, POOR, Finding

WATCH = 0.5  # largest ratio of compression to the Euler load of pinned ends without a finding
SOFTER = 1.0 + 1e-9  # a section is softer normal to the plane if the ratio of its second moments of area is larger
CLAMPED = 4.0  # critical load of clamped ends / critical load of pinned ends


def sideways_findings(results: Results) -> Iterator[Finding]:
    """Yield a finding if a link may buckle normal to the plane of motion.

    If the second moment of area for bending normal to the plane is unknown, it is estimated as A b^2/12 from the area A
    and the width b of a section, as for a rectangle. The joints may hold the ends of the link between two limits: free
    to turn normal to the plane (pinned), and clamped.
    """
    ratios = np.nan_to_num(results.cycle.euler_ratio).max(axis=-1, initial=0.0)
    sideways = []
    for ratio, section in zip(ratios.tolist(), results.deflection.sections, strict=True):
        known = section.width, section.area, section.inertia, section.sideways
        width, area, inertia, own = (float(np.ravel(each)[0]) for each in known)
        across = area * width**2 / 12.0 if np.isnan(own) else own
        softer = inertia / across if across > 0.0 else 0.0
        sideways.append(ratio * softer if softer > SOFTER else 0.0)
    if not max(sideways, default=0.0) > WATCH:
        return
    worst = int(np.nanargmax(sideways))
    pinned, name = sideways[worst], results.scene.member_names[worst]
    text = (
        f"{name} may buckle normal to the plane of motion, which this planar analysis does not include: its compression"
        f" is {number(pinned, 2)} times its Euler load in that direction if its ends can turn, and"
        f" {number(pinned / CLAMPED, 2)} times the critical load if they cannot. Make it wider."
    )
    level = POOR if pinned >= CLAMPED else CAUTION
    yield Finding(level, "Sideways buckling", text, f"{name}: make it wider")
