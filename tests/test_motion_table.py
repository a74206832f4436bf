"""motion.csv lists the kinematics and forces of each drive, link, point and joint."""

import numpy as np
import pytest

from kinelast import load
from kinelast.answers.results import Results
from kinelast.cli.command import main
from kinelast.outputs.positions import motion_table
from kinelast.outputs.table import csv_rows
from kinelast.runs import computed
from kinelast.tasks.request import Request

MANY = 720


def columns_of(results: Results) -> dict[str, np.ndarray]:
    return {column.name: column.values for column in motion_table(results).columns}


@pytest.fixture(scope="module", params=["quick_return", "steel_four_bar"])
def table(request):
    """Quasi-static answer over a full turn, so that differences between neighbours are derivatives."""
    scene = load(request.param)
    results = computed(scene, Request(positions=MANY, theory="quasi-static"))
    return results, columns_of(results)


def slope_of(values, time):
    """Return the derivative of a periodic function by sixth-order central differences."""
    values = np.asarray(values)
    steps = ((1, 45.0), (2, -9.0), (3, 1.0))
    return sum(c * (np.roll(values, -k) - np.roll(values, k)) for k, c in steps) / (60 * (time[1] - time[0]))


def test_rates_are_derivatives(table):
    results, columns = table
    time = columns["time"]
    inner = slice(4, -4)  # without the jump in angles at the end of a turn
    for link in results.mechanism.links[1:]:
        for value, rate in (("theta", "omega"), ("omega", "alpha")):
            expected = slope_of(columns[f"{link.name}.{value}"], time)[inner]
            size = np.abs(columns[f"{link.name}.{rate}"]).max()
            np.testing.assert_allclose(columns[f"{link.name}.{rate}"][inner], expected, atol=1e-6 * size + 1e-6)
    for point in ("A", "B", "D"):
        for axis in "xy":
            if f"{point}.{axis}" in columns:
                for value, rate in (("", "v"), ("v", "a")):
                    expected = slope_of(columns[f"{point}.{value}{axis}"], time)
                    np.testing.assert_allclose(columns[f"{point}.{rate}{axis}"], expected, rtol=1e-6, atol=1e-4)


def test_forces_of_a_pin_on_its_links_cancel(table):
    _, columns = table
    joints = {name.partition(".Fx_on_")[0] for name in columns if ".Fx_on_" in name}
    assert joints
    for joint in joints:
        links = [name.partition(".Fx_on_")[2] for name in columns if name.startswith(f"{joint}.Fx_on_")]
        for axis in "xy":
            forces = [columns[f"{joint}.F{axis}_on_{link}"] for link in links]
            np.testing.assert_allclose(np.sum(forces, axis=0), 0.0, atol=1e-9 * np.abs(forces).max())


def test_forces_along_and_across_a_link_are_rotated_components(table):
    results, columns = table
    for joint in ("A", "D"):
        for link in results.mechanism.links[1:]:
            if f"{joint}.Fx_on_{link.name}" in columns:
                angle = columns[f"{link.name}.theta"]
                x, y = (columns[f"{joint}.F{axis}_on_{link.name}"] for axis in "xy")
                size = np.hypot(x, y).max()
                along = columns[f"{joint}.Falong_on_{link.name}"]
                across = columns[f"{joint}.Facross_on_{link.name}"]
                np.testing.assert_allclose(along, x * np.cos(angle) + y * np.sin(angle), atol=1e-12 * size)
                np.testing.assert_allclose(across, y * np.cos(angle) - x * np.sin(angle), atol=1e-12 * size)


def test_mean_power_without_losses_is_zero(table):
    _, columns = table
    power = columns["crank.power"]
    assert abs(power.mean()) < 1e-9 * np.abs(power).max()


def test_transmission_angle_of_the_four_bar():
    """The law of cosines gives the angle from the diagonal between crank pin and rocker pivot."""
    scene = load("steel_four_bar")
    results = computed(scene, Request(positions=24, theory="quasi-static"))
    columns = columns_of(results)
    points = {name: columns[f"{name}.x"] + 1j * columns[f"{name}.y"] for name in ("A", "B")}
    pin = scene.mechanism.links[0].points["D"]
    diagonal, coupler, rocker = (abs(points["A"] - pin), abs(points["B"] - points["A"]), abs(points["B"] - pin))
    cosine = (coupler**2 + rocker**2 - diagonal**2) / (2 * coupler * rocker)
    np.testing.assert_allclose(columns["B.transmission_angle"], np.arccos(np.abs(cosine)), atol=1e-12)


def test_forces_on_three_links_at_a_pin_cancel():
    """The sum is zero for either choice of the two links of a joint."""
    scene = load("andrews_squeezer")
    columns = columns_of(computed(scene, Request(positions=5, theory="quasi-static")))
    joint = max({name.partition(".")[0] for name in columns if ".Fx_on_" in name},
                key=lambda each: sum(name.startswith(f"{each}.Fx_on_") for name in columns))  # fmt: skip
    forces = [values for name, values in columns.items() if name.startswith(f"{joint}.Fx_on_")]
    assert len(forces) > 2
    np.testing.assert_allclose(np.sum(forces, axis=0), 0.0, atol=1e-12 * np.abs(forces).max())


def test_columns_can_be_selected(tmp_path, capsys):
    call = ["steel_four_bar", "--positions", "8", "--theory", "quasi-static", "--motion", "-o", str(tmp_path)]
    assert main([*call, "--columns", "B.*x,crank.power"]) in (0, 1)
    headings = csv_rows((tmp_path / "steel_four_bar" / "motion.csv").read_bytes())[0]
    assert headings == ["time [s]", "B.x [m]", "B.vx [m/s]", "B.ax [m/s^2]", "B.dx [m]", "crank.power [W]"]
    assert csv_rows((tmp_path / "steel_four_bar" / "positions.csv").read_bytes())[0] == ["time [s]", "B.dx [m]"]
    assert main([*call, "--columns", "crank.powr"]) == 2
    assert 'no column matches "crank.powr"; did you mean "crank.power"?' in capsys.readouterr().err
