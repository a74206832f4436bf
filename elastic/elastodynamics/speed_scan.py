"""Fast scan of many speeds with few coordinates, to find peaks and unstable ranges.

The vibrating coordinates are the modes with the mean mass of the cycle. The other coordinates follow quasi-statically
the inertia of these modes at every position (inverse iteration) and the loads. A scan takes a tenth of the time of a
full solution. Its largest values are accurate to about 1 %, and its frequencies to 0.1 %. It only guides the search and
is not reported.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from elastic.elastodynamics.equations_of_motion import Problem
from elastic.elastodynamics.speed_settings import SPEEDS
from elastic.elastodynamics.strains import rigidities, strain_rows
from elastic.elastodynamics.time_elements import Equations, periodic_amplitudes
from elastic.elastodynamics.time_grid import interpolation, scheme
from rigid import Motion
from rigid.arrays import Reals
from rigid.kinetostatics import beam_directions


@dataclass(frozen=True, eq=False)
class Scan:
    """Results of a scan at several speeds.

    Attributes
    ----------
    ratio
        Relative speeds in ascending order, shape (speeds,).
    largest
        Largest deflection w [m], chord deflection [m], and strain of the outer fibres, shape (3, beams, speeds).
    growth
        Growth of the least stable free vibration per cycle, shape (speeds,).
    nearness
        1 / distance of the nearest Floquet multiplier from 1, shape (speeds,). It has a peak if a harmonic coincides
        with a mode.
    """

    ratio: Reals
    largest: Reals
    growth: Reals
    nearness: Reals

    def with_more(self, other: Scan) -> Scan:
        """Merge two scans in order of ascending speed."""
        ratio, first = np.unique(np.concatenate((self.ratio, other.ratio)), return_index=True)
        pairs = zip([*vars(self).values()][1:], [*vars(other).values()][1:], strict=True)
        return Scan(ratio, *(np.concatenate(pair, axis=-1)[..., first] for pair in pairs))


@dataclass(frozen=True)
class Resonance:
    """Natural mode with the largest vibration, and the nearest harmonic of the cycle.

    Attributes
    ----------
    harmonic
        Harmonic of the cycle nearest to the mean frequency of the mode.
    mode
        Number of the mode, from 1.
    beam
        Index of the beam with the largest strain energy of the mode.
    met
        True if the harmonic coincides with the mean frequency, within 0.3 cycle frequencies, see `SpeedSettings`.
    """

    harmonic: int
    mode: int
    beam: int
    met: bool


@dataclass(frozen=True, eq=False)
class SpeedScan:
    """Equations for q coordinates at the P points of the grid, in powers of the speed.

    Attributes
    ----------
    problem
        Equations of motion from which the equations are derived.
    equations
        Mass, damping and stiffness, shape (3, P, q, q), and load, shape (3, P, q).
    static
        Amplitudes that follow quasi-statically, per power of the speed, shape (P, r, 3).
    basis
        Amplitudes per coordinate, shape (P, r, q).
    looked_at
        Fields of `Scan.largest` per coordinate and power of the speed, each (some points, beams places, q + 3).
    """

    problem: Problem
    equations: Equations
    static: Reals
    basis: Reals
    looked_at: tuple[Reals, ...]

    def at(self, ratios: Any, on_speed: Callable[[int, int], None] | None = None) -> Scan:
        """Scan several speeds; `on_speed` is called with the number of finished speeds and the total."""
        speeds, parts = np.unique(ratios), []
        together = max(1, min(SPEEDS.speeds_at_once, SPEEDS.max_points // len(self.basis)))
        for first in range(0, len(speeds), together):
            if on_speed:
                on_speed(first, len(speeds))
            parts.append(self._at(speeds[first : first + together]))
        largest, growth, nearness = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
        return Scan(speeds, largest, growth, nearness)

    def _at(self, speeds: Reals) -> tuple[Reals, Reals, Reals]:
        multipliers, x = self._solved(speeds)
        some = x[:, (SPEEDS.point_stride - 1) :: SPEEDS.point_stride]
        amounts = np.concatenate((some, self._powers(speeds)[:, None] + 0 * some[..., :1]), axis=-1)
        amounts = np.ascontiguousarray(np.moveaxis(amounts, 0, -1))
        beams = len(self.problem.terms.kinematics.structure.sections)
        largest = np.array(
            [np.abs(rows @ amounts).max(axis=0).reshape(beams, -1, len(speeds)).max(axis=1) for rows in self.looked_at]
        )
        return largest, np.abs(multipliers).max(axis=1), 1.0 / np.abs(1.0 - multipliers).min(axis=1)

    @staticmethod
    def _powers(speeds: Reals) -> Reals:
        return speeds[:, None] ** np.arange(3)

    def _solved(self, speeds: Reals) -> tuple[Any, Reals]:
        """Return the Floquet multipliers, and the amplitudes of the coordinates, shape (speeds, P, q)."""
        powers = self._powers(speeds)
        each = (np.tensordot(powers, part, 1) for part in vars(self.equations).values())
        stacked = Equations(*(part.reshape(-1, *part.shape[2:]) for part in each))
        return periodic_amplitudes(self.problem.terms.grid, stacked)

    @cached_property
    def modes(self) -> tuple[Reals, Reals, tuple[int, ...]]:
        """Natural modes at every point with locked drives.

        Returns
        -------
        Natural frequencies in ascending order [rad/s], shape (P, q), coordinates per mode with unit mass, shape (P, q,
        q), and indices of the beams with the largest strain energy.
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
        """Return the natural mode with the largest vibration at a speed, and the harmonic nearest to its frequency."""
        grid, speeds = self.problem.terms.grid, np.array([ratio])
        omega, shapes, beams = self.modes
        period = float(np.ptp(grid.edges))
        weights = (grid.steps[:, None] * scheme(grid.stages).once[-1]).ravel() / period
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
        """Return the amplitudes of the coordinates without vibration, shape (speeds, P, q)."""
        across = self.basis.swapaxes(-1, -2) @ self.problem.terms.elastic
        load = np.tensordot(self._powers(speeds), self.equations.load, 1)
        return np.asarray(np.linalg.solve(across @ self.basis, load[..., None])[..., 0])


def mean_frequencies(problem: Problem) -> Reals:
    """Return the frequencies with the mean mass of the cycle in ascending order [rad/s], shape (r,)."""
    diagonal = np.diagonal(problem.terms.elastic, axis1=-2, axis2=-1)
    return np.sqrt(diagonal.reshape(-1, diagonal.shape[-1]).mean(axis=0))


def speed_scan(motion: Motion, problems: Sequence[Problem], highest: float) -> SpeedScan:
    """Set up the equations for a few coordinates in powers of the speed.

    Parameters
    ----------
    motion
        Motion at the nodes of the grid.
    problems
        Equations of motion at three speeds, which suffice because they are quadratic in the speed.
    highest
        Highest speed of later scans.
    """
    problem = problems[0]
    terms, omega = problem.terms, mean_frequencies(problem)
    inverse = np.linalg.inv(np.vander([each.speed for each in problems], 3, increasing=True))
    mass, damping, stiffness, load = (
        np.tensordot(inverse, np.array([getattr(each.equations, name) for each in problems]), 1)
        for name in vars(problem.equations)
    )
    count = _vibrating(omega, SPEEDS.highest_harmonic * highest * 2 * np.pi / float(np.ptp(terms.grid.edges)))
    basis: Reals = np.broadcast_to(np.eye(len(omega))[:, :count], (len(terms.mass), len(omega), count))
    for _ in range(SPEEDS.inverse_iterations):
        bent = np.linalg.solve(terms.elastic, terms.mass @ basis)
        basis = np.asarray(bent @ np.linalg.inv(bent[:, :count]), float)  # mean modes remain, others follow
    rate, bend = terms.grid.rates(terms.grid.at_nodes(basis))
    across = basis.swapaxes(-1, -2)
    equations = Equations(
        across @ mass @ basis,
        across @ (2 * mass @ rate + damping @ basis),
        across @ (mass @ bend + damping @ rate + stiffness @ basis),
        np.asarray((across @ load[..., None])[..., 0], float),
    )
    still, strong = np.linalg.solve(terms.elastic, np.moveaxis(load, 0, -1)), across @ terms.elastic
    static: Reals = np.asarray(still - basis @ np.linalg.solve(strong @ basis, strong @ still), float)
    both = np.concatenate((basis, static), axis=-1)[SPEEDS.point_stride - 1 :: SPEEDS.point_stride]
    seen = tuple(rows @ both for rows in _looked_at(problem, motion))
    return SpeedScan(problem, equations, static, basis, seen)


def _vibrating(omega: Reals, reach: float) -> int:
    """Return the number of vibrating modes: those up to a frequency, and close neighbours of the last one."""
    count = max(int((omega <= reach).sum()), min(SPEEDS.min_modes, len(omega)))
    while count < len(omega) and omega[count] < SPEEDS.min_mode_ratio * omega[count - 1]:
        count += 1
    return count


def _looked_at(problem: Problem, motion: Motion) -> list[Reals]:
    """Return the fields of `Scan.largest` per amplitude, each of shape (some points, beams * places, r)."""
    kinds, some = problem.terms.kinematics, slice(SPEEDS.point_stride, None, SPEEDS.point_stride)
    structure = kinds.structure
    across = (np.conj(beam_directions(motion)).T[some, :, None, None] * kinds.unit.beams[some]).imag
    begin, end = (interpolation(structure.xi, np.array([place])) @ across for place in (0.0, 1.0))
    share = structure.xi[:, None]
    chord = across - begin * (1 - share) - end * share
    strains = strain_rows(structure, kinds.basis)
    strains = np.broadcast_to(strains[some] if strains.ndim == 3 else strains, (len(across), *strains.shape[-2:]))
    stretch, curvature = (
        strains[:, k * structure.weights.size : (k + 1) * structure.weights.size].reshape(across.shape) for k in (0, 1)
    )
    fibres = np.array([_fibre(section) for section in structure.sections])[:, None, None] * curvature
    fields = across, chord, np.concatenate((stretch + fibres, stretch - fibres), axis=2)
    return [field.reshape(len(across), -1, across.shape[-1]) for field in fields]


def _fibre(section: Any) -> float:
    """Return the distance of the outer fibres [m], or the radius of gyration for a section without dimensions."""
    fibre, stretched, bent = (float(np.ravel(getattr(section, name))[0]) for name in ("fibre", "EA", "EI"))
    if np.isfinite(fibre):
        return fibre
    return float(np.sqrt(bent / stretched)) if np.isfinite(stretched) and np.isfinite(bent) else 0.0
