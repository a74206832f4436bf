"""Fast scan of many speeds with few coordinates, to find peaks and unstable ranges.

The vibrating coordinates are the lowest vibration modes, computed with the mass matrix averaged over the cycle. The
other coordinates respond quasi-statically to the loads, and to the inertia of these modes at every position (inverse
iteration). A scan takes a tenth of the time of a full solution. It determines the largest values to about 1 %, and the
frequencies to 0.1 %. A scan only guides the search for special speeds; its results are not reported.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple

from elastic.elastodynamics.equations_of_motion import Problem
from elastic.elastodynamics.speed_settings import SPEEDS
from elastic.elastodynamics.strains import rigidities, strain_rows
from elastic.elastodynamics.time_elements import Equations, periodic_amplitudes
from elastic.elastodynamics.time_grid import interpolation, scheme
from rigid import Motion
from rigid.arrays import Reals
from rigid.kinetostatics import beam_directions


class Scan(Struct, frozen=True, eq=False):
    """Results of a scan at several speeds.

    Attributes
    ----------
    ratio
        Speeds, relative to the speed of the given motion, in ascending order, shape (speeds,).
    largest
        Largest values of three fields: deflection w [m], chord deflection [m], and strain of the outer fibres [1],
        shape (3, beams, speeds).
    growth
        Factor by which the least stable free vibration grows per cycle, shape (speeds,).
    """

    ratio: Reals
    largest: Reals
    growth: Reals

    def with_more(self, other: Scan) -> Scan:
        """Merge two scans, and sort the speeds in ascending order."""
        ratio, first = np.unique(np.concatenate((self.ratio, other.ratio)), return_index=True)
        pairs = zip(astuple(self)[1:], astuple(other)[1:], strict=True)
        return Scan(ratio, *(np.concatenate(pair, axis=-1)[..., first] for pair in pairs))


class Resonance(Struct, frozen=True):
    """Natural mode with the largest vibration energy, and the nearest harmonic of the cycle.

    Attributes
    ----------
    harmonic
        Harmonic of the cycle with the frequency that is nearest to the mean frequency of the mode.
    mode
        Number of the mode, from 1.
    beam
        Index of the beam in which the mode has the largest strain energy.
    coincides
        True if the frequency of the harmonic equals the mean frequency of the mode, to within
        `SPEEDS.max_resonance_distance`.
    """

    harmonic: int
    mode: int
    beam: int
    coincides: bool


class SpeedScan(Struct, frozen=True, eq=False, dict=True):
    """Equations for q vibrating coordinates at the P points of a grid, as quadratic polynomials in the speed.

    Attributes
    ----------
    problem
        Equations for all r coordinates, from which the equations for q coordinates are derived.
    equations
        Mass, damping and stiffness, shape (3, P, q, q), and load, shape (3, P, q). The first axis runs over the
        coefficients of the powers 0, 1 and 2 of the speed.
    static
        Quasi-static response of the omitted coordinates to the loads, for each power of the speed, shape (P, r, 3).
    basis
        Values of all r coordinates per unit of each vibrating coordinate, shape (P, r, q).
    monitored_fields
        The fields whose largest values are in `Scan.largest`, per unit of each vibrating coordinate and for each term
        of `static`, each of shape (selected points, beams * stations, q + 3).
    """

    problem: Problem
    equations: Equations
    static: Reals
    basis: Reals
    monitored_fields: tuple[Reals, ...]

    def at(self, ratios: Any, on_speed: Callable[[int, int], None] | None = None) -> Scan:
        """Scan several relative speeds.

        `on_speed` is called with the number of finished speeds and the total number of speeds.
        """
        speeds, parts = np.unique(ratios), []
        together = max(1, min(SPEEDS.speeds_at_once, SPEEDS.max_points // len(self.basis)))
        for first in range(0, len(speeds), together):
            if on_speed:
                on_speed(first, len(speeds))
            parts.append(self._at(speeds[first : first + together]))
        return Scan(speeds, *(np.concatenate(part, axis=-1) for part in zip(*parts, strict=True)))

    def _at(self, speeds: Reals) -> tuple[Reals, Reals]:
        multipliers, x = self._solved(speeds)
        some = x[:, (SPEEDS.point_stride - 1) :: SPEEDS.point_stride]
        amounts = np.concatenate((some, self._powers(speeds)[:, None] + 0 * some[..., :1]), axis=-1)
        amounts = np.ascontiguousarray(np.moveaxis(amounts, 0, -1))
        beams = len(self.problem.terms.kinematics.structure.sections)
        largest = np.array(
            [
                np.abs(rows @ amounts).max(axis=0).reshape(beams, -1, len(speeds)).max(axis=1)
                for rows in self.monitored_fields
            ]
        )
        return largest, np.abs(multipliers).max(axis=1)

    @staticmethod
    def _powers(speeds: Reals) -> Reals:
        return speeds[:, None] ** np.arange(3)

    def _solved(self, speeds: Reals) -> tuple[Any, Reals]:
        """Return the Floquet multipliers, shape (speeds, 2 q), and the coordinates, shape (speeds, P, q)."""
        powers = self._powers(speeds)
        each = (np.tensordot(powers, part, 1) for part in astuple(self.equations))
        stacked = Equations(*(part.reshape(-1, *part.shape[2:]) for part in each))
        return periodic_amplitudes(self.problem.terms.grid, stacked)

    @cached_property
    def modes(self) -> tuple[Reals, Reals, tuple[int, ...]]:
        """Natural modes at every point with locked drives.

        Returns
        -------
        Three things: the natural frequencies in ascending order [rad/s], shape (P, q); the mode shapes with unit modal
        mass, shape (P, q, q), in which rows are coordinates and columns are modes; and for each mode, the index of the
        beam in which it has the largest strain energy.
        """
        terms, across = self.problem.terms, self.basis.swapaxes(-1, -2)
        root = np.linalg.inv(np.linalg.cholesky(across @ terms.elastic @ self.basis)).swapaxes(-1, -2)
        squared, vectors = np.linalg.eigh(root.swapaxes(-1, -2) @ across @ terms.mass @ self.basis @ root)
        omega = 1.0 / np.sqrt(np.maximum(squared[:, ::-1], np.finfo(float).tiny))
        shapes = root @ vectors[..., ::-1] * omega[:, None]
        structure = terms.kinematics.structure
        strains = strain_rows(structure, terms.kinematics.basis)
        strains = (strains[1:] if strains.ndim == 3 else strains) @ self.basis @ shapes
        energy = (rigidities(structure)[:, None] * np.square(strains)).mean(axis=0)
        beams, points = structure.weights.shape
        of_beams = energy[: 3 * beams * points].reshape(3, beams, points, -1).sum(axis=(0, 2))
        return omega, shapes, tuple(int(beam) for beam in of_beams.argmax(axis=0))

    def resonance(self, ratio: float) -> Resonance:
        """Return the natural mode with the largest vibration energy at a speed.

        The result also contains the harmonic of the cycle that is nearest to the mode.
        """
        grid, speeds = self.problem.terms.grid, np.array([ratio])
        omega, shapes, beams = self.modes
        period = float(np.ptp(grid.edges))
        weights = (grid.steps[:, None] * scheme(grid.stages).integral[-1]).ravel() / period
        vibrating = (self._solved(speeds)[1] - self._quasi_static(speeds))[0]
        across = self.basis.swapaxes(-1, -2)
        amounts = shapes.swapaxes(-1, -2) @ (across @ self.problem.terms.mass @ self.basis @ vibrating[..., None])
        mode = int((weights @ np.square(omega * amounts[..., 0])).argmax())
        multiple = float(weights @ omega[:, mode]) * period / (2 * np.pi * ratio)
        harmonic = max(round(multiple), 1)
        return Resonance(
            harmonic, mode + 1, beams[mode], bool(abs(multiple - harmonic) < SPEEDS.max_resonance_distance)
        )

    def _quasi_static(self, speeds: Reals) -> Reals:
        """Return the quasi-static values of the coordinates, shape (speeds, P, q)."""
        across = self.basis.swapaxes(-1, -2) @ self.problem.terms.elastic
        load = np.tensordot(self._powers(speeds), self.equations.load, 1)
        return np.asarray(np.linalg.solve(across @ self.basis, load[..., None])[..., 0])


def mean_frequencies(problem: Problem) -> Reals:
    """Return the natural frequencies for the mass matrix averaged over the cycle, ascending [rad/s], shape (r,)."""
    diagonal = np.diagonal(problem.terms.elastic, axis1=-2, axis2=-1)
    return np.sqrt(diagonal.reshape(-1, diagonal.shape[-1]).mean(axis=0))


def speed_scan(motion: Motion, problems: Sequence[Problem], highest: float) -> SpeedScan:
    """Set up the equations for a few coordinates as polynomials in the speed.

    Parameters
    ----------
    motion
        Rigid motion at the nodes of the grid.
    problems
        Equations of motion at three speeds. They determine the equations at all speeds, because the equations are
        quadratic polynomials in the speed.
    highest
        Highest relative speed that will be scanned.
    """
    problem = problems[0]
    terms, omega = problem.terms, mean_frequencies(problem)
    inverse = np.linalg.inv(np.vander([each.speed for each in problems], 3, increasing=True))
    mass, damping, stiffness, load = (
        np.tensordot(inverse, np.array([getattr(each.equations, name) for each in problems]), 1)
        for name in problem.equations.__struct_fields__
    )
    count = _mode_count(omega, SPEEDS.highest_harmonic * highest * 2 * np.pi / float(np.ptp(terms.grid.edges)))
    basis: Reals = np.broadcast_to(np.eye(len(omega))[:, :count], (len(terms.mass), len(omega), count))
    for _ in range(SPEEDS.inverse_iterations):
        bent = np.linalg.solve(terms.elastic, terms.mass @ basis)
        # normalise the basis so that its first rows (the vibrating coordinates) are the unit matrix again
        basis = np.asarray(bent @ np.linalg.inv(bent[:, :count]), float)
    rate, bend = terms.grid.rates(terms.grid.with_start(basis))
    across = basis.swapaxes(-1, -2)
    equations = Equations(
        across @ mass @ basis,
        across @ (2 * mass @ rate + damping @ basis),
        across @ (mass @ bend + damping @ rate + stiffness @ basis),
        np.asarray((across @ load[..., None])[..., 0], float),
    )
    static_amplitudes, projection = np.linalg.solve(terms.elastic, np.moveaxis(load, 0, -1)), across @ terms.elastic
    static: Reals = np.asarray(
        static_amplitudes - basis @ np.linalg.solve(projection @ basis, projection @ static_amplitudes), float
    )
    both = np.concatenate((basis, static), axis=-1)[SPEEDS.point_stride - 1 :: SPEEDS.point_stride]
    monitored = tuple(rows @ both for rows in _monitored_fields(problem, motion))
    return SpeedScan(problem, equations, static, basis, monitored)


def _mode_count(omega: Reals, reach: float) -> int:
    """Return the number of vibrating modes.

    These are the modes up to the frequency `reach`, and also the next higher modes as long as their frequencies are
    close to each other.
    """
    count = max(int((omega <= reach).sum()), min(SPEEDS.min_modes, len(omega)))
    while count < len(omega) and omega[count] < SPEEDS.min_mode_ratio * omega[count - 1]:
        count += 1
    return count


def _monitored_fields(problem: Problem, motion: Motion) -> list[Reals]:
    """Return the fields from which `Scan.largest` is computed, per unit of each coordinate.

    Each has the shape (selected points, beams * stations, r).
    """
    kinematics, selected = problem.terms.kinematics, slice(SPEEDS.point_stride, None, SPEEDS.point_stride)
    structure = kinematics.structure
    across = (np.conj(beam_directions(motion)).T[selected, :, None, None] * kinematics.unit.beams[selected]).imag
    begin, end = (interpolation(structure.xi, np.array([place])) @ across for place in (0.0, 1.0))
    share = structure.xi[:, None]
    chord = across - begin * (1 - share) - end * share
    strains = strain_rows(structure, kinematics.basis)
    strains = np.broadcast_to(strains[selected] if strains.ndim == 3 else strains, (len(across), *strains.shape[-2:]))
    stretch, curvature = (
        strains[:, k * structure.weights.size : (k + 1) * structure.weights.size].reshape(across.shape) for k in (0, 1)
    )
    fibres = np.array([_fibre(section) for section in structure.sections])[:, None, None] * curvature
    fields = across, chord, np.concatenate((stretch + fibres, stretch - fibres), axis=2)
    return [field.reshape(len(across), -1, across.shape[-1]) for field in fields]


def _fibre(section: Any) -> float:
    """Return the distance of the outer fibre from the beam axis [m].

    For a section without dimensions, return the radius of gyration instead, or 0 if this is unknown too.
    """
    fibre, stretched, bent = (float(np.ravel(getattr(section, name))[0]) for name in ("fibre", "EA", "EI"))
    if np.isfinite(fibre):
        return fibre
    return float(np.sqrt(bent / stretched)) if np.isfinite(stretched) and np.isfinite(bent) else 0.0
