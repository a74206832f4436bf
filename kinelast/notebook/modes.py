"""Natural frequencies, damping ratios and mode shapes of a scene."""

import math
from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from elastic.elastodynamics import NaturalModes, natural_modes
from kinelast.answers.bounds import damping_of
from kinelast.figures.beam_limits import too_many_beams
from kinelast.notebook import STATIONS, PartsByName, SceneMotion, motion, rigid_line, scene_of, unknown_name
from kinelast.scene.data import Scene
from kinelast.scene.document import Document
from kinelast.tasks.progress import one_thread
from kinelast.values.numbers import percent, quantity
from rigid.arrays import Complexes, Reals

MODES, POSITIONS = 3, 24  # default number of modes and of positions


class ModeShapes(Struct, frozen=True, eq=False):
    """Mode shapes of a beam at 101 stations, evenly spaced from end to end.

    Attributes
    ----------
    line
        Positions on the axis of the rigid beam [m], complex, shape (positions, stations).
    displacement
        Displacement from the rigid beam, complex, shape (modes, positions, stations). Each mode is scaled so that the
        largest displacement of all beams is 1.
    """

    line: Complexes
    displacement: Complexes

    def __repr__(self) -> str:
        modes, positions, _ = self.displacement.shape
        return f"ModeShapes({modes} modes, {positions} positions: line [m], displacement [1])"


class NaturalFrequencies(PartsByName, Struct, frozen=True, eq=False):
    """Natural frequencies and modes of a scene with locked drives.

    The mode shapes of a beam are items, such as `result["coupler"]`.

    Attributes
    ----------
    motion
        Motion at the positions for which the frequencies are computed.
    modes
        Result of `elastic.elastodynamics.natural_modes`. It also contains `shape_error`.
    """

    motion: SceneMotion
    modes: NaturalModes

    @property
    def omega(self) -> Reals:
        """Natural frequencies [rad/s], ascending, shape (modes, positions)."""
        return self.modes.omega

    @property
    def frequency(self) -> Reals:
        """Natural frequencies [Hz], shape (modes, positions)."""
        return self.omega / math.tau

    @property
    def damping(self) -> Reals:
        """Damping ratios, shape (modes, positions)."""
        return self.modes.damping

    def __getitem__(self, label: str) -> ModeShapes:
        if label not in self.keys():
            raise KeyError(unknown_name(label, self))
        beam = self.keys().index(label)
        return ModeShapes(rigid_line(self.motion, beam), self.modes.displacement[:, beam])

    def __iter__(self) -> Iterator[str]:
        yield from self.motion.scene.labels

    def __repr__(self) -> str:
        lowest = [quantity(float(np.nanmin(row)), "Hz") for row in self.frequency if np.isfinite(row).any()]
        damped = f"; damping ratio from {percent(float(np.nanmin(self.damping)))}" if lowest else ""
        words = f"at least {', '.join(lowest)}" if lowest else "no mode"
        return f'NaturalFrequencies("{self.motion.scene.name}": {words} at {len(self.motion.time)} positions{damped})'


@one_thread()
def natural_frequencies(scene: Scene | Document, modes: int = MODES, positions: int = POSITIONS) -> NaturalFrequencies:
    """Return natural frequencies, damping ratios and mode shapes at evenly spaced positions with locked drives.

    The scene gives the damping: the key `damping` of a material or, by default, `damping_ratio` at the lowest
    frequency.

    Raises
    ------
    SceneError
        A position is unreachable.
    TypeError, ValueError
        `scene` is neither a scene nor a document, a number is not positive, or there are no beams or too many beams.
    """
    given = scene_of(scene)
    if modes < 1:
        raise ValueError(f"modes: expected 1 or more, got {modes}")
    if not given.labels:
        raise ValueError("no link has a section: expected beams that can vibrate")
    if many := too_many_beams(given.mechanism):
        raise ValueError(many)
    moved = motion(given, positions)
    solved = natural_modes(moved, given.sections, modes, given.joints, damping_of(given), stations=STATIONS)
    return NaturalFrequencies(moved, solved)
