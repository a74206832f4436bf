"""The bound on beams above which vibration and buckling of a mechanism are not looked at."""

from __future__ import annotations

from collections import Counter

from rigid import Mechanism

MOST_BEAMS = 64  # of some 18 coordinates each: matrices of these take 1.5 GB, and half a minute


def too_many_beams(mechanism: Mechanism) -> str:
    """Why vibration and buckling of a mechanism are not looked at, in words; empty where they are."""
    beams = Counter(mechanism.links[link].name for link, _ in mechanism.beams)
    if beams.total() <= MOST_BEAMS:
        return ""
    link, most = beams.most_common(1)[0]
    count = f"{beams.total()} beams"
    where = f'of which {most} are in the link "{link}": expected {MOST_BEAMS} at most'
    return f"vibration and buckling are not looked at in {count}, {where}"
