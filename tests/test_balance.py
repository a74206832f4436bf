"""Joint forces change the momentum of all masses by Newton-Euler laws, and the check detects wrong laws."""

from functools import partial

import numpy as np
import pytest
from msgspec.structs import replace
from tiers import in_tiers

import rigid.kinematics
import rigid.kinetostatics.loads
from elastic import deflection
from elastic.elastodynamics import (
    correction,
    deflection_at,
    elastodynamic,
    equations_of_motion,
    reduction,
    solution,
    transient,
    vibration_loads,
)
from fem_check.balance import balance
from kinelast import load, shipped_scenes
from kinelast.cli.command import main
from rigid import Lump

KNOWN = 1e-8  # error of time derivatives if accelerations come from integration


def quasi_static(name, positions=24):
    scene = load(name)
    course = scene.course
    bent = deflection(course.at(course.times(positions)), scene.sections, joints=scene.joints)
    return balance(bent, course.near, course.span)


@pytest.mark.parametrize("name", in_tiers(shipped_scenes(), 6, 10))
def test_every_shipped_scene_passes(name):
    kept = quasi_static(name)
    assert kept.passed
    assert kept.compared > 10 or name == "five_points"
    assert kept.opening < 1e-14
    assert max(kept.velocity, kept.force, kept.moment) < KNOWN * (10 if name == "andrews_squeezer" else 1)


@pytest.fixture
def flipped(monkeypatch):
    """Reverses the sign of the rotary inertia of lumps."""
    right = rigid.kinetostatics.loads.mass_constants

    def wrong(mechanism, ndim):
        mass, first, second = right(mechanism, ndim)
        turning = np.reshape([sum(lump.inertia for lump in link.lumps) for link in mechanism.links], (-1, 1))
        return mass, first, second - 2 * turning

    monkeypatch.setattr(rigid.kinetostatics.loads, "mass_constants", wrong)


@pytest.mark.usefixtures("flipped")
def test_a_wrong_sign_of_rotary_inertia_is_detected():
    kept = quasi_static("andrews_driven")
    assert not kept.passed
    assert kept.moment > 1e-3


@pytest.mark.usefixtures("flipped")
def test_the_command_reports_a_failed_momentum_check(tmp_path, capsys):
    assert main(["andrews_driven", "--check", "--positions", "24", "-o", str(tmp_path)]) == 1
    assert "check FAILED (momentum OFF BY " in capsys.readouterr().out


def test_a_wrong_motion_is_detected(monkeypatch):
    right = rigid.kinematics.motion
    scene = load("steel_four_bar")
    course = scene.course
    moved = course.at(course.times(24))
    for wrong, field in (
        (replace(moved, velocity=1.001 * moved.velocity), "velocity"),
        (replace(moved, acceleration=moved.acceleration + 0.1), "force"),
        (replace(moved, turning=moved.turning + 1j), "moment"),
        (replace(moved, origin=moved.origin * (1 + 1e-5j)), "opening"),
    ):
        bent = deflection(wrong, scene.sections)
        kept = balance(bent, course.near)
        assert not kept.passed
        assert getattr(kept, field) > 1e-6
    assert right is rigid.kinematics.motion


def test_missing_gravity_is_detected():
    scene = load("press_sweep")
    course = scene.course
    bent = deflection(course.at(course.times(24)), scene.sections)
    light = replace(bent.motion, mechanism=replace(bent.motion.mechanism, gravity=0.0))
    assert not balance(replace(bent, motion=light), course.near).passed


def loaded():
    """The steel four-bar with a wheel at a joint."""
    scene = load("steel_four_bar")
    coupler = next(link for link in scene.mechanism.links if link.name == "coupler")
    wheel = replace(coupler, lumps=(Lump("B", 0.08, 4e-5),))
    links = tuple(wheel if link is coupler else link for link in scene.mechanism.links)
    return replace(scene, course=replace(scene.course, mechanism=replace(scene.mechanism, links=links)))


def vibrating(**options):
    """Return the balance of a vibrating answer solved to 1e-6."""
    scene = loaded()
    course = scene.course
    moved = course.at(course.times(180))
    found = elastodynamic(moved, course.at, course.period, scene.sections, scene.joints, 4e-5, 1e-6)
    return balance(found.deflection, course.near, cycle=course.period, tolerance=1e-3, **options)


def test_vibrating_links_pass():
    """To first order in the displacements; a quasi-static answer lacks a tenth of the forces."""
    kept = vibrating()
    assert kept.passed
    assert kept.largest < 1e-4
    scene = loaded()
    course = scene.course
    still = deflection(course.at(course.times(180)), scene.sections)
    assert balance(still, course.near, cycle=course.period).force > 1e-2


def test_a_halved_vibrating_lump_is_detected(monkeypatch):
    right = equations_of_motion.masses

    def halved(structure):
        weights = right(structure)
        weights[-2] /= 2
        return weights

    for module in (correction, equations_of_motion, reduction, vibration_loads):
        monkeypatch.setattr(module, "masses", halved)
    kept = vibrating()
    assert not kept.passed
    assert kept.force > 1e-2


def test_a_wrong_sign_of_the_gyroscopic_term_is_detected(monkeypatch):
    """The sign is wrong in the equations, but not in the loads of the solution."""
    right = solution.motion_terms

    def flipped(*given):
        terms = right(*given)
        return replace(terms, inertial_damping=-terms.inertial_damping)

    monkeypatch.setattr(solution, "motion_terms", flipped)
    assert not vibrating().passed


def in_transient(name="lightest_arm"):
    """Return the balance of links that vibrate from rest without a cycle, solved to 1e-6."""
    scene = load(name) if name == "lightest_arm" else loaded()
    course = scene.course
    span = 0.5 if name == "lightest_arm" else 0.4 * course.period
    moved = course.at(np.linspace(0.0, span, 61))
    found = transient(moved, course.at, scene.sections, scene.joints, 4e-5, 1e-6)
    near = partial(deflection_at, found), found.edges
    return balance(found.deflection, course.near, tolerance=1e-3, transient=near), found.deflection, course


@pytest.mark.parametrize("name", ["lightest_arm", pytest.param("steel_four_bar", marks=pytest.mark.slow)])
def test_transient_vibration_passes(name):
    kept, bent, course = in_transient(name)
    assert kept.compared > 30
    assert kept.passed
    assert kept.largest < 3e-4
    assert balance(bent, course.near).force > 1e-2  # as if displacements had no momentum


@pytest.mark.slow
def test_a_wrong_sign_of_the_gyroscopic_term_is_detected_in_a_transient(monkeypatch):
    right = solution.motion_terms
    monkeypatch.setattr(
        solution,
        "motion_terms",
        lambda *given: replace(right(*given), inertial_damping=-right(*given).inertial_damping),
    )
    kept, *_ = in_transient("steel_four_bar")
    assert kept.compared > 30
    assert not kept.passed
