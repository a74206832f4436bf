"""Series of VTU files of the deformed, moving beams for ParaView."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from elastic import FIELDS, PRIMARY, Deflection, sample
from fem_check.linear.solution import Solution
from rigid import Reals, position_of
from rigid.arrays import Complexes, Integers


def write_vtu_series(
    answer: Deflection | Solution, folder: Path | str, name: str = "beams", stations: Sequence[float] | None = None
) -> Path:
    """Write one VTU file per position, and a .pvd file that lists them by time.

    The points of the meshes lie on the undeformed beams. The point data are:

    - `displacement`: vector to the deformed point [m], which ParaView's filter "Warp By Vector" can exaggerate,
    - `deformed`: position of the deformed point [m],
    - the main fields of `elastic.FIELDS` by key, or N, V, M, u, w and phi for a finite element solution.

    The cell data `beam` is the index in `Mechanism.beams`. Positions without a solution are skipped.

    Parameters
    ----------
    answer
        Closed-form or finite element solution of one design.
    folder
        Folder for the files, created if it does not exist.
    name
        Prefix of the file names `name.pvd`, `name_0000.vtu`, ...
    stations
        Values of xi = x'/l of the points on each beam of a Deflection, by default 21 evenly spaced points. A Solution
        is written at its nodes.

    Returns
    -------
    Path of the .pvd file.

    Raises
    ------
    ValueError
        If there are several designs, or stations are given for a Solution.
    """
    motion = answer.motion
    if len(motion.columns) > 1:
        raise ValueError(f"{motion.columns[0]} designs: a series of meshes contains only one")
    xi, fields = _sampled(answer, stations)
    with np.errstate(invalid="ignore"):
        start, way = _places(answer)
        places = start[..., None] + way[..., None] * xi
        moved = (way / np.abs(way))[..., None] * (fields["u"] + 1j * fields["w"])
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    cells, numbers = _cells(len(places), len(xi))
    digits = max(4, len(str(len(motion.time) - 1)))
    listed = []
    for k in np.flatnonzero(np.isfinite(moved).all(axis=(0, 2))):
        file = f"{name}_{k:0{digits}}.vtu"
        points = {"displacement": _space(moved[:, k]), "deformed": _space(places[:, k] + moved[:, k])}
        data = points | {field: values[:, k].ravel() for field, values in fields.items()}
        _write(folder / file, _space(places[:, k]), ("line", cells), {"beam": numbers}, data)
        listed.append((float(motion.time[k]), file))
    return _collection(folder / f"{name}.pvd", listed)


def _sampled(answer: Deflection | Solution, stations: Sequence[float] | None) -> tuple[Reals, dict[str, Reals]]:
    """Sample the fields at stations, shape (beams, positions, stations)."""
    if isinstance(answer, Deflection):
        xi = np.linspace(0.0, 1.0, 21) if stations is None else np.asarray(stations, float)
        return xi, {key: sample(answer, key, xi) for key, field in FIELDS.items() if field.main}
    if stations is not None:
        raise ValueError("stations: a finite element solution is written at its nodes")
    return answer.xi, {field: getattr(answer, field) for field in PRIMARY}


def _places(answer: Deflection | Solution) -> tuple[Complexes, Complexes]:
    """Return the starts of the undeformed beams and the vectors to their ends [m], complex, (beams, positions)."""
    motion = answer.motion
    beams = motion.mechanism.beams
    starts = [position_of(motion, at, beam.start) for at, beam in beams]
    ends = [position_of(motion, at, beam.end) for at, beam in beams]
    start, end = (np.array(points, complex).reshape(len(beams), *motion.columns) for points in (starts, ends))
    return start, end - start


def _cells(beams: int, stations: int) -> tuple[Integers, Integers]:
    """Return the line cells between neighbouring points, and the beam index of each cell."""
    first = (np.arange(beams)[:, None] * stations + np.arange(stations - 1)).ravel()
    return np.column_stack((first, first + 1)), np.repeat(np.arange(beams), stations - 1)


def _space(plane: Any) -> Reals:
    """Convert complex vectors in the plane to vectors in space, shape (n, 3)."""
    flat = np.ravel(plane)
    return np.column_stack((flat.real, flat.imag, np.zeros(len(flat))))


def _write(
    path: Path, points: Reals, cells: tuple[str, Integers], numbers: Mapping[str, Integers], data: Mapping[str, Reals]
) -> None:
    import meshio

    of_cells = {name: [values] for name, values in numbers.items()}
    mesh = meshio.Mesh(points, [cells], point_data=dict(data), cell_data=of_cells)
    meshio.write(path, mesh, file_format="vtu")


def _collection(path: Path, files: Sequence[tuple[float, str]]) -> Path:
    """Write the .pvd file, which lists the VTU files by time."""
    root = ElementTree.Element("VTKFile", type="Collection", version="0.1", byte_order="LittleEndian")
    collection = ElementTree.SubElement(root, "Collection")
    for time, file in files:
        ElementTree.SubElement(collection, "DataSet", timestep=repr(time), group="", part="0", file=file)
    ElementTree.indent(root)
    ElementTree.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)
    return path
