"""The six fields at the nodes of all beams."""

from typing import Any

import numpy as np

from elastic import PRIMARY
from fem_check.linear.beams import LoadedBeams
from fem_check.linear.block import BlockResponse
from fem_check.linear.unit_beam import UnitBeam
from rigid import Reals


def fields_of(beams: LoadedBeams, spots: Reals, carried: Reals) -> dict[str, Reals]:
    """Compute N, V, M, u, w, phi at the nodes from unit responses and body motion.

    Parameters
    ----------
    spots
        Force and moment at the frame's spots, shape (3, spots, ..., positions).
    carried
        Displacement, in the ground's axes, and rotation of the bodies, shape (3, bodies, ..., positions).
    """
    length, count = beams.length, len(beams.length)
    move = np.conj(beams.axis) * (carried[0, :count] + 1j * carried[1, :count])
    turn = carried[2, :count]
    along = np.moveaxis(np.concatenate((length * beams.along, spots[:1, :count])), 0, -1)
    across = np.moveaxis(
        np.concatenate((length**2 * beams.across, [length * spots[1, :count], spots[2, :count]])), 0, -1
    )
    fields: dict[str, Reals] = {}
    shape = (*length.shape, len(beams.units[0].xi)) if beams.units else (0, *length.shape[1:], 1)
    for kind in beams.kinds if count else ():
        _add_kind(fields, beams, kind, along, across, shape)
    fields = fields or {field: np.zeros(shape) for field in PRIMARY}
    for spot, block in enumerate(beams.blocks, count):
        _add_block(fields, beams, block, spots[:, spot])
    xi = beams.units[0].xi if beams.units else np.zeros(1)
    fields["u"] += move.real[..., None] + (length * beams.strain)[..., None] * xi
    fields["w"] += move.imag[..., None] + (length * turn)[..., None] * xi
    fields["phi"] += turn[..., None]
    return fields


def _add_kind(
    fields: dict[str, Reals],
    beams: LoadedBeams,
    kind: tuple[UnitBeam, Any],
    along: Reals,
    across: Reals,
    shape: tuple[int, ...],
) -> None:
    """Add the responses of all beams that share a unit beam."""
    unit, numbers = kind
    along, across, length = along[numbers], across[numbers], beams.length[numbers][..., None]
    stretch, bend, shear = (row[numbers][..., None] for row in (beams.stretch, beams.bend, beams.shear))
    w = (across * (length**2 * bend)) @ unit.w
    if np.any(shear):
        w += (across[..., :-1] * shear) @ unit.slide
    values = {
        "N": along @ unit.N,
        "V": (across / length) @ unit.V,
        "M": across @ unit.M,
        "u": (along * (length * stretch)) @ unit.u,
        "w": w,
        "phi": (across * (length * bend)) @ unit.phi,
    }
    if isinstance(numbers, slice):
        fields.update(values)
        return
    for field, value in values.items():
        fields.setdefault(field, np.zeros(shape))[numbers] = value


def _add_block(fields: dict[str, Reals], beams: LoadedBeams, block: BlockResponse, load: Reals) -> None:
    """Add the response of a beam to its block."""
    k = block.beam
    length, stretch, bend, shear = (row[k][..., None] for row in (beams.length, beams.stretch, beams.bend, beams.shear))
    along, force, moment = (np.where(np.isnan(block.xi), np.nan, part)[..., None] for part in load)
    nodes = block.nodes
    fields["N"][k] += along * nodes["N"][0]
    fields["u"][k] += length * stretch * along * nodes["u"][0]
    fields["V"][k] += force * nodes["V"][0] + moment / length * nodes["V"][1]
    fields["M"][k] += length * force * nodes["M"][0] + moment * nodes["M"][1]
    fields["phi"][k] += length * bend * (length * force * nodes["phi"][0] + moment * nodes["phi"][1])
    bent = length**2 * bend * (length * force * nodes["w"][0] + moment * nodes["w"][1])
    fields["w"][k] += bent + length * shear * force * nodes["slide"][0]
