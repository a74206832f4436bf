"""Only required packages are imported, and packages import each other in one direction."""

import os
import subprocess
import sys

import pytest

HEAVY = {
    "scipy",
    "skfem",
    "meshio",
    "pyvista",
    "vtk",
    "vtkmodules",
    "tomlkit",
    "matplotlib",
    "imageio",
    "pint",
    "jinja2",
    "msgspec",
}
OURS = ("rigid", "elastic", "symbols", "machine", "fem_check", "animations", "exchange", "kinelast", "live")

CANTILEVER = """
from elastic import *
from rigid import *
arm = Link("arm", {"O": 0, "A": 2.0}, (Beam("O", "A", 5.0),))
turning = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 2})
solved = deflection(motion(turning, [0.0, 1.0], 3.0), [Section(EA=1e6, EI=1e3)])
extremes(solved), sample(solved, "w", [0.0, 0.5, 1.0]), reactions(solved.motion)
"""
HELP = "from kinelast.cli.command import main; assert main([{!r}]) == 0"


def imported(program):
    """Return the top-level packages that a program imports in a fresh interpreter."""
    show = "import sys; print('#', *{name.partition('.')[0] for name in sys.modules})"
    run = subprocess.run(
        [sys.executable, "-c", f"{program}\n{show}"], capture_output=True, text=True, check=True, timeout=60
    )
    return set(run.stdout.splitlines()[-1].split()[1:])


@pytest.mark.parametrize(
    ("program", "needed"),
    [
        ("import rigid", {"msgspec", "numpy", "rigid"}),
        ("import elastic", {"msgspec", "numpy", "rigid", "elastic"}),
        (CANTILEVER, {"msgspec", "numpy", "rigid", "elastic"}),
        ("import machine", {"msgspec", "numpy", "rigid", "machine"}),
        ("import fem_check", {"msgspec", "numpy", "rigid", "elastic", "fem_check"}),
        ("import animations", {"msgspec", "numpy", "rigid", "elastic", "symbols", "animations"}),
        ("import exchange", {"msgspec", "numpy", "exchange"}),
        ("import kinelast", {"kinelast"}),
        (HELP.format("--help"), {"kinelast", "argparse", "msgspec"}),
        (HELP.format("--list"), {"kinelast", "argparse", "msgspec", "tomllib"}),
    ],
    ids=lambda asked: asked if isinstance(asked, str) and len(asked) < 20 else "",
)
def test_nothing_is_imported_that_is_not_needed(program, needed):
    """The program imports exactly these packages out of numpy, the heavy packages and our own."""
    found = imported(program)
    assert needed <= found
    assert found & (HEAVY | {"numpy"} | set(OURS)) == needed & (HEAVY | {"numpy"} | set(OURS))


def test_rigid_and_elastic_import_only_numpy_and_msgspec():
    """rigid and elastic need only numpy and msgspec, apart from the standard library and packages of a bare start."""
    more = imported("import elastic") - imported("pass") - set(sys.stdlib_module_names)
    needed = {name for name in more if not name.startswith("_")} - {"typing_extensions"}  # optional for msgspec
    assert needed == {"msgspec", "numpy", "rigid", "elastic"}


THREADS = """
import numpy as np
from threadpoolctl import threadpool_info
import kinelast
import kinelast.figures.cycle as cycle
import kinelast.answers.theory as theory
def reported(when):
    print(when, *(each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"))
def watched(solved):
    def call(*given, **named):
        reported(solved.__name__)
        return solved(*given, **named)
    return call
theory.elastodynamic = watched(theory.elastodynamic)
cycle.buckling_ratio = watched(cycle.buckling_ratio)
reported("before")
kinelast.deflection(kinelast.load("steel_four_bar"))
kinelast.answer(kinelast.load("steel_four_bar"), theory="quasi-static").figures["buckling"]
reported("after")
"""


@pytest.mark.slow
def test_vibration_and_buckling_keep_to_one_thread_though_numpy_was_there_first():
    """If numpy was loaded first, the environment has no effect; the caller's setting is restored."""
    environment = {name: value for name, value in os.environ.items() if name != "OMP_NUM_THREADS"}
    environment |= {"OPENBLAS_NUM_THREADS": "2", "MKL_NUM_THREADS": "2"}
    run = subprocess.run(
        [sys.executable, "-c", THREADS], capture_output=True, text=True, check=True, timeout=60, env=environment
    )
    found = {when: set(counts) for when, *counts in map(str.split, run.stdout.splitlines())}
    if "2" not in found["before"]:
        pytest.skip("the linear algebra of this machine has no threads to spare")
    assert found["elastodynamic"] == found["buckling_ratio"] == {"1"}
    assert found["before"] <= found["after"]


def test_without_threadpoolctl_the_threads_are_not_limited():
    program = "import sys; sys.modules['threadpoolctl'] = None; import kinelast; "
    program += "kinelast.answer(kinelast.load('steel_four_bar'), theory='quasi-static')"
    environment = {name: value for name, value in os.environ.items() if name != "OMP_NUM_THREADS"}
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60, env=environment)
