"""Claim: a unit is a factor on every number: a power of two changes no digit, any other only the last ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mechanisms import ALL, motion_of, replaced

from elastic import PRIMARY, deflection
from rigid import LineLoad, PinDrive, PointLoad

EPS = np.finfo(float).eps
BOUND = 50
BY_ELIMINATION = ("triad", "six-bar, ring")  # whose linear systems are scaled by square roots, or iterated


def in_units(case, L, M, T):
    """The same case in other units: every number times its dimension."""
    force = M * L / T**2

    def link(one):
        beams = tuple(replace(beam, mass_per_length=beam.mass_per_length * (M / L)) for beam in one.beams)
        lumps = tuple(
            replace(lump, mass=lump.mass * M, inertia=lump.inertia * (M * L**2), offset=lump.offset * L)
            for lump in one.lumps
        )
        return replace(one, points={k: v * L for k, v in one.points.items()}, beams=beams, lumps=lumps)

    def section(one):
        return replace(one, EA=one.EA * force, EI=one.EI * (force * L**2), kGA=one.kGA * force)

    def load(one):
        if isinstance(one, LineLoad):
            return replace(one, start=one.start * (force / L), end=one.end * (force / L))
        assert isinstance(one, PointLoad)
        return replace(one, force=one.force * force, moment=one.moment * (force * L))

    mechanism = case.mechanism
    turns = np.array([isinstance(drive, PinDrive) for drive in mechanism.drives])[:, None]
    unit = np.where(turns, 1.0, L)
    return replace(
        case,
        mechanism=replaced(
            mechanism,
            links=tuple(link(one) for one in mechanism.links),
            sliders=tuple(replace(one, origin=one.origin * L) for one in mechanism.sliders),
            drawing={k: v * L for k, v in mechanism.drawing.items()},
            gravity=mechanism.gravity * (L / T**2),
            loads=tuple(load(one) for one in mechanism.loads),
        ),
        sections=tuple(
            replace(one, EA=one.EA * force, EI=one.EI * (force * L**2), kGA=one.kGA * force) for one in case.sections
        ),
        drive=case.drive * unit,
        rate=case.rate * unit / T,
        rate2=case.rate2 * unit / T**2,
    )


def dimension(L, M, T):
    force = M * L / T**2
    return {"N": force, "V": force, "M": force * L, "u": L, "w": L, "phi": 1.0}


class TestUnits:
    def solved(self, case):
        return deflection(motion_of(case), case.sections)

    @pytest.mark.parametrize("units", [(2.0**-20, 2.0**13, 2.0**-5), (2.0**30, 2.0**-40, 2.0**7)])
    @pytest.mark.parametrize("name", [name for name in ALL if name not in BY_ELIMINATION])
    def test_powers_of_two_change_no_digit(self, name, units):
        one, other = self.solved(ALL[name]()), self.solved(in_units(ALL[name](), *units))
        np.testing.assert_array_equal(other.motion.condition, one.motion.condition)
        for field in PRIMARY:
            np.testing.assert_array_equal(getattr(other, field), getattr(one, field) * dimension(*units)[field])

    @pytest.mark.parametrize("units", [(1e3, 1e-3, 1.0), (39.37007874, 2.20462262, 1e3), (1e-9, 1e6, 1e-6)])
    @pytest.mark.parametrize("name", ALL)
    def test_other_units_change_the_last_digits(self, name, units):
        """Millimetres and tonnes; inches, pounds, milliseconds; any."""
        one, other = self.solved(ALL[name]()), self.solved(in_units(ALL[name](), *units))
        condition = one.motion.condition.max()
        for field in PRIMARY:
            ours = getattr(one, field) * dimension(*units)[field]
            off = np.abs(getattr(other, field) - ours).max() / np.abs(ours).max()
            assert off < BOUND * EPS * condition, field
