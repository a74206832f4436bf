"""Conversion of the motion and deflection of a scene to pandas tables and xarray data sets."""

from typing import Any

import numpy as np
from msgspec.structs import replace

from elastic import FIELDS, sample
from kinelast.answers.results import Results
from kinelast.notebook import SceneDeflection, SceneMotion, point_names, shown
from kinelast.outputs.positions import motion_columns, motion_table, position_table
from kinelast.values.figure import drive_words

STATIONS = 21  # default number of stations along a beam
POINT = {"": ("position", "m"), "v": ("velocity", "m/s"), "a": ("acceleration", "m/s^2")}
LINK = {"angle": "rad", "angular_velocity": "rad/s", "angular_acceleration": "rad/s^2"}


def to_pandas(result: SceneMotion | SceneDeflection) -> Any:
    """Return a pandas table with one row per position, indexed by time. The names of the columns include their units.

    The table of a motion contains drives, links, points and joints, as in motion.csv. The table of a deflection has the
    same columns as positions.csv.

    Raises
    ------
    ModuleNotFoundError
        pandas is not installed.
    """
    _require_result(result)
    pandas = _module("pandas")
    if isinstance(result, SceneDeflection):
        table = position_table(_in_si(result))
        columns = {column.heading: column.values for column in table.columns}
    else:
        wide = result.columns
        columns = {
            f"{name} [{unit}]": np.broadcast_to(values, wide) for name, (values, unit) in motion_columns(result).items()
        }
    time = columns.pop("time [s]")
    return pandas.DataFrame(columns, index=pandas.Index(time, name="time [s]"))


def to_xarray(result: SceneMotion | SceneDeflection, stations: int = STATIONS) -> Any:
    """Return an xarray data set with coordinates. The units are attributes of the variables.

    The data set of a motion contains, at each position, the coordinates x and y of points, the angles of links, and the
    first and second time derivatives. The data set of a deflection contains each main field by beam, position and
    station. It also contains each column of motion.csv by position, e.g. joint forces.

    Raises
    ------
    ModuleNotFoundError
        xarray is not installed.
    """
    _require_result(result)
    xarray = _module("xarray")
    if isinstance(result, SceneMotion):
        data, names = _kinematics(result)
        coordinates = {"point": names[0], "link": names[1], **_shared(result)}
    else:
        data, coordinates = _fields(result, stations)
    return xarray.Dataset(data, coordinates, attrs={"title": result.scene.title})


def _fields(bent: SceneDeflection, stations: int) -> tuple[dict[str, Any], dict[str, Any]]:
    xi = np.linspace(0.0, 1.0, stations)
    axes = ("beam", "position", "station")
    data: dict[str, Any] = {
        key: (axes, sample(bent, key, xi), {"units": each.unit, "long_name": each.name})
        for key, each in FIELDS.items()
        if each.main
    }
    columns = {column.name: column for column in motion_table(_in_si(bent)).columns if column.name != "time"}
    data |= {name: ("position", column.values, {"units": column.unit}) for name, column in columns.items()}
    words = {"units": "m", "long_name": "distance along the beam"}
    along = (("beam", "station"), bent.length.reshape(-1, 1) * xi, words)
    share = ("station", xi, {"units": "1", "long_name": "fraction of the length"})
    return data, {"beam": list(bent.scene.labels), "xi": share, "x": along, **_shared(bent.motion)}


def _in_si(bent: SceneDeflection) -> Results:
    """Return the results of a deflection, with tables in SI units."""
    return Results(replace(bent.scene, report_units="SI"), bent)


def _kinematics(course: Any) -> tuple[dict[str, Any], tuple[list[str], list[str]]]:
    points = point_names(course.mechanism)
    links = list(course.mechanism.index)
    data: dict[str, Any] = {}
    for prefix, (name, unit) in POINT.items():
        values = np.array([np.broadcast_to(getattr(course[point], name), course.columns) for point in points])
        for axis, part in (("x", values.real), ("y", values.imag)):
            data[prefix + axis] = (("point", "position"), part, {"units": unit, "long_name": f"{name} along {axis}"})
    angle = np.unwrap(np.angle(course.direction))
    for (name, unit), values in zip(
        LINK.items(), (angle, course.angular_velocity, course.angular_acceleration), strict=True
    ):
        data[name] = (("link", "position"), values, {"units": unit, "long_name": name.replace("_", " ")})
    return data, (points, links)


def _shared(course: Any) -> dict[str, Any]:
    """Return the coordinates of the positions: time, and the coordinate of each drive."""
    found: dict[str, Any] = {"time": ("position", course.time, {"units": "s"})}
    for (name, kind, unit, _), values in zip(drive_words(course.mechanism), course.drive, strict=True):
        found[f"{name}_{kind}"] = ("position", values, {"units": unit, "long_name": f"{kind} of the drive {name}"})
    return found


def _require_result(result: object) -> None:
    if not isinstance(result, SceneMotion | SceneDeflection):
        raise TypeError(f"expected a motion or a deflection of a scene, got {shown(result)}")


def _module(name: str) -> Any:
    from importlib import import_module

    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(f"{name} is not installed: pip install {name}", name=name) from error
