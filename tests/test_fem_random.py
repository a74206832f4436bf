"""Closed forms and finite elements agree for random links.

Links are trees and closed frames of beams in any order and direction. Sections have slenderness 5 to 200, and may
have shear, free strain or a taper. Loads and lumps are anywhere, and mechanisms have pins, sliders and blocks on
beams.
"""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mechanisms import (
    elastic_guide,
    four_bar,
    inverted_slider_crank,
    lumps,
    replaced,
    six_bar,
    slider_crank,
    triad,
    with_link,
)
from msgspec.structs import replace
from tiers import in_tiers

from elastic import JointCompliance, Section, Taper, deflection
from fem_check import compare, solve
from rigid import Beam, LineLoad, Mechanism, MechanismError, PointLoad, motion

E = 210e9
SPREAD = settings(max_examples=40, deadline=None)
LINKS = {
    "four-bar": (four_bar, "coupler"),
    "slider-crank": (slider_crank, "rod"),
    "six-bar": (six_bar, "coupler"),
    "crank": (four_bar, "crank"),
    "rod through a rocker": (lambda count: inverted_slider_crank(sliding_rod=True, count=count), "rod"),
    "block on a lever": (elastic_guide, "rocker"),
    "group that is no dyad": (triad, "plate"),
}


@st.composite
def shapes(draw, link):
    """Draw the link with further points and beams between all points: a tree, sometimes closed."""
    size = max(abs(place) for place in link.points.values()) or 0.2
    points = dict(link.points)
    for number in range(draw(st.integers(0, 2))):
        place = complex(draw(st.floats(-1, 1)), draw(st.floats(-1, 1))) * size
        assume(min(abs(place - other) for other in points.values()) > 0.15 * size)
        points[f"X{number}"] = place
    names = draw(st.permutations(sorted(points)))
    ends = [(names[draw(st.integers(0, k - 1))], names[k]) for k in range(1, len(names))]
    kept = [tuple(sorted((beam.start, beam.end))) for beam in link.beams] if link.name == "rocker" else []
    ends = kept + [end for end in ends if tuple(sorted(end)) not in kept]
    spare = sorted({tuple(sorted((a, b))) for a in names for b in names if a != b} - {tuple(sorted(e)) for e in ends})
    if spare:
        ends += draw(st.lists(st.sampled_from(spare), max_size=2, unique=True))
    turned = [end[::-1] if draw(st.booleans()) else end for end in draw(st.permutations(ends))]
    taper = st.sampled_from([(1.0,), (1.0, -0.5), (0.4, 0.0, 1.0)])
    beams = tuple(Beam(*end, draw(st.floats(0.1, 2.0)), draw(taper)) for end in turned)
    return replace(link, points=points, beams=beams, lumps=lumps(draw(st.sampled_from(names)), 0.5))


@st.composite
def loads(draw, link):
    """Draw a point load and a line load, fixed or turning."""
    force = st.floats(-100, 100)
    at, number = draw(st.sampled_from(sorted(link.points))), draw(st.integers(0, len(link.beams) - 1))
    return (
        PointLoad(link.name, at, complex(draw(force), draw(force)), draw(force) / 10, turning=draw(st.booleans())),
        LineLoad(
            link.name,
            number,
            complex(draw(force), draw(force)),
            complex(draw(force), draw(force)),
            turning=draw(st.booleans()),
        ),
    )


@st.composite
def sections(draw, mechanism, taper=False):
    """Draw sections of steel bars; some have shear, some have free strain."""
    found = []
    for at, beam in mechanism.beams:
        points = mechanism.links[at].points
        radius = abs(points[beam.end] - points[beam.start]) / draw(st.floats(5, 200))
        EA = E * 12 * radius**2
        shear = draw(st.sampled_from([np.inf, 0.3, 0.05]))
        change = Taper((1.0, -0.4), (1.0, -0.9, 0.5), (1.0, 0.3)) if taper and draw(st.booleans()) else None
        found.append(
            Section(EA, EA * radius**2, EA * shear, draw(st.sampled_from([0.0, 1e-6])), taper=change)
        )  # strain of a steel bar after heating by 0.1 K; all others have the same
    return tuple(found)


@st.composite
def cases(draw, name, taper=False):
    """Draw a mechanism with one remade link, and some positions."""
    make, remade = LINKS[name]
    case = make(count=5)
    old = case.mechanism.links[case.mechanism.index[remade]]
    link = draw(shapes(old))
    try:
        mechanism: Mechanism = replaced(with_link(case.mechanism, link), loads=draw(loads(link)))
        turning = motion(mechanism, case.drive, np.full(case.drive.shape, draw(st.floats(-300, 300))))
    except MechanismError:
        assume(False)
    assume(turning.condition.max() < 1e4)
    return turning, draw(sections(mechanism, taper))


ORDER = sorted(LINKS, key=lambda name: (name not in ("four-bar", "slider-crank"), name == "group that is no dyad"))
PLACED = in_tiers(ORDER, 1, 3)


@pytest.mark.parametrize("name", PLACED)
@SPREAD
@given(st.data())
def test_random_links_agree(name, data):
    turning, own = data.draw(cases(name))
    found = solve(turning, own, data.draw(st.integers(1, 64)))
    comparison = compare(deflection(turning, own), found)
    assert comparison.passed, comparison.worst
    assert comparison.compared > 0


@pytest.mark.parametrize("name", in_tiers([name for name in ORDER if name != "block on a lever"], 1, 2))
@settings(max_examples=15, deadline=None)
@given(st.data())
def test_random_tapered_links_agree_with_fourth_order(name, data):
    """The error is below 1e-7 at 64 elements; its order is checked as long as it exceeds round-off."""
    turning, own = data.draw(cases(name, taper=True))
    exact = deflection(turning, own)
    errors = np.array([compare(exact, solve(turning, own, n)).relative.max(axis=1) for n in (16, 32, 64)])
    assert errors[-1].max() < 1e-7
    assert errors[:, :3].max() < 1e-7 or any(section.taper for section in own)
    resolved = errors[1] > 1e-8
    order = np.log2(errors[0][resolved] / errors[1][resolved])
    np.testing.assert_allclose(order, 4.0, atol=0.4)


@pytest.mark.parametrize("name", in_tiers(["four-bar", "slider-crank", "block on a lever"], 1, 1))
@settings(max_examples=25, deadline=None)
@given(st.data())
def test_random_links_with_soft_joints_agree(name, data):
    turning, own = data.draw(cases(name))
    small = st.floats(0.0, 1e-5)
    joints = {
        joint.name: JointCompliance(data.draw(small), data.draw(small), complex(data.draw(small), data.draw(small)))
        for joint in turning.structure.joints
        if data.draw(st.booleans())
    }
    comparison = compare(deflection(turning, own, joints=joints), solve(turning, own, 8, joints))
    assert comparison.passed, comparison.worst
