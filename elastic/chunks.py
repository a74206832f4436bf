"""Deflections of any number of positions and designs, in chunks that fit the cache."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from elastic.beams.compliance import designs_of
from elastic.beams.section import JointCompliance, Section
from elastic.solution import Deflection, deflection
from rigid import Mechanism, motion_in_chunks
from rigid.arrays import ArrayLike
from rigid.chunks import columns_of, design_chunks
from rigid.positions import select_designs


def deflection_in_chunks(
    mechanism: Mechanism,
    sections: Sequence[Section],
    drive: ArrayLike,
    drive_rate: ArrayLike = 0.0,
    drive_acceleration: ArrayLike = 0.0,
    time: ArrayLike | None = None,
    joints: Mapping[str, JointCompliance] | None = None,
    columns: int | None = None,
) -> Iterator[Deflection]:
    """Yield `deflection(motion(...), sections)` chunk by chunk.

    Memory does not grow with the number of positions or designs. A chunk takes a third of the time of as many columns
    of one large batch.

    Parameters
    ----------
    mechanism, drive, drive_rate, drive_acceleration, time, columns
        See `rigid.motion_in_chunks`.
    sections
        One per beam; properties may have shape (designs, 1).
    joints
        See `deflection`.

    Yields
    ------
    Deflection of each chunk, in the order of `rigid.motion_in_chunks`.

    Examples
    --------
    Largest axial force at the root of an arm, over any number of positions:

    >>> from rigid import Beam, Link, Mechanism, PinDrive
    >>> arm = Link("arm", {"O": 0, "A": 2.0}, (Beam("O", "A", 5.0),))
    >>> turning = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 2})
    >>> chunks = deflection_in_chunks(turning, [Section(1e6, 1e3)], [0.1 * k for k in range(20)], 3.0, columns=8)
    >>> float(max(chunk.N[0].max() for chunk in chunks))
    90.0
    """
    count = np.shape(drive)[-1]
    columns = columns_of(mechanism, count) if columns is None else columns
    designs = np.broadcast_shapes(mechanism.designs, designs_of(tuple(sections)))
    for rows in design_chunks(designs, count, columns):
        block = select_designs(mechanism, rows, designs)
        beams = select_designs(tuple(sections), rows, designs)
        courses = motion_in_chunks(block, drive, drive_rate, drive_acceleration, time, columns)
        yield from map(partial(deflection, sections=beams, joints=joints), courses)
