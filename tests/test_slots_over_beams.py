"""A block passes from beam to beam along its slot as along one beam."""

from itertools import pairwise

import numpy as np
import pytest
from mechanisms import at_speed
from scene_texts import TEE

from elastic import PRIMARY, Section, Taper, deflection, sample
from elastic.elastodynamics import elastodynamic
from elastic.vibration import natural_frequencies
from fem_check import compare, solve
from kinelast.runs import require_on_beams
from kinelast.scene.data import scene_motion
from kinelast.scene.document import scene_from_text
from kinelast.values.error import SceneError
from rigid import Beam, Friction, Link, Mechanism, MechanismError, PinDrive, PointLoad, Slider, motion

LENGTH = 0.6
CUTS = (0.35, 0.5, 0.9)
SECTION = Section(EA=1e6, EI=1e3)


def quick_return(cuts=(), stem=False, friction=None, reach=LENGTH):
    """Return a crank's block in the slot of an elastic lever of one or several beams, optionally with a stem."""
    points = {"D": 0.0, **{f"P{k}": cut * LENGTH for k, cut in enumerate(cuts)}, "E": reach}
    names = list(points)
    beams = [Beam(*ends, 2.0) for ends in pairwise(names)]
    if stem:
        points["T"] = points["P0"] + 0.1j
        beams.append(Beam("P0", "T", 2.0))
    crank = 0.3j + 0.1 * np.exp(0.1j)
    links = (
        Link("ground", {"O": 0.3j, "D": 0}),
        Link("crank", {"O": 0, "A": 0.1}, (Beam("O", "A", 1.0),)),
        Link("lever", points, tuple(beams)),
        Link("block", {"A": 0}),
    )
    drawing = {"O": 0.3j, "A": crank, **{name: place * crank / abs(crank) for name, place in points.items()}}
    slot = Slider("slot", "block", "lever", "A", 0.0, 1.0)
    loads = (PointLoad("lever", "E", 50 + 20j),)
    made = Mechanism(links, (PinDrive("crank", "O"),), drawing, (slot,), -9.81j, loads, friction=friction or {})
    return motion(made, np.linspace(0.1, 6.3, 41), 9.0, 3.0), [SECTION] * (len(beams) + 1)


@pytest.mark.parametrize("friction", [{}, {"slot": Friction(0.2), "D": Friction(0.1, 0.02)}])
def test_as_along_one_beam(friction):
    whole, cut = (deflection(*quick_return(cuts, friction=friction)) for cuts in ((), CUTS))
    assert {block.beam for block in cut.blocks} == {1, 2, 3}
    marks, xi = (0.0, *CUTS, 1.0), np.array([0.1, 0.4, 0.77, 0.99])
    for field in PRIMARY:
        found = np.array([sample(cut, field, xi)[beam] for beam in range(1, 5)])
        along = [sample(whole, field, low + xi * (high - low))[1] for low, high in pairwise(marks)]
        np.testing.assert_allclose(found, along, atol=1e-12 * np.abs(along).max(), err_msg=field)
    omega = [natural_frequencies(*quick_return(cuts), modes=1, positions=4).omega for cuts in ((), CUTS)]
    np.testing.assert_allclose(*omega, rtol=1e-6)


def test_vibrating_as_along_one_beam():
    """The steady state of a lever under the block is the same for one beam and two."""
    xi, found = np.array([0.1, 0.4, 0.77, 0.99]), []
    for cuts in ((), (0.35,)):
        made, sections = quick_return(cuts)
        period, motion_at = 2 * np.pi / 9.0, at_speed(made.mechanism, 9.0, 0.1)
        found.append(
            elastodynamic(
                motion_at(period * np.arange(12) / 12), motion_at, period, sections[:1] * (len(cuts) + 2), damping=1e-3
            ).deflection
        )
    whole, cut = found
    for field, off in (("M", 3e-3), ("w", 1e-4)):
        along = np.array([sample(whole, field, low + xi * (high - low))[1] for low, high in ((0, 0.35), (0.35, 1))])
        np.testing.assert_allclose(sample(cut, field, xi)[1:], along, atol=off * np.abs(along).max(), err_msg=field)


@pytest.mark.parametrize("stem", [False, True])
def test_finite_elements_agree(stem):
    course, sections = quick_return(CUTS, stem, {"slot": Friction(0.2)})
    assert compare(deflection(course, sections), solve(course, sections, 4)).passed


def test_a_tapered_beam_out_of_the_blocks_reach_is_allowed():
    course, sections = quick_return(CUTS)
    tapered = Section(1e6, 1e3, taper=Taper(EI=(1.0, -0.5)))
    assert np.isfinite(deflection(course, [*sections[:-1], tapered]).w).all()
    with pytest.raises(MechanismError, match="is tapered"):
        deflection(course, [*sections[:2], tapered, *sections[3:]])


def test_positions_beyond_the_last_beam_are_unknown():
    bent = deflection(*quick_return(CUTS[:2], reach=0.33))
    off = np.isnan(bent.blocks[0].xi)
    assert 0 < off.sum() < len(off)
    np.testing.assert_array_equal(np.isnan(bent.w).any(axis=(0, 1)), off)


def test_in_a_scene():
    scene = scene_from_text(TEE)
    course = scene_motion(scene)
    bent = deflection(course, scene.sections)
    require_on_beams(scene, bent)
    assert {block.beam for block in bent.blocks} == {1, 2}
    assert compare(bent, solve(course, scene.sections, 4)).passed
    short = scene_from_text(TEE.replace("U = [0.06, 0.12]", "U = [0.06, 0.07]"))
    with pytest.raises(SceneError, match="leaves the beam"):
        require_on_beams(short, deflection(scene_motion(short), short.sections))
