"""Test in a child process whether this machine can render.

Without OpenGL, VTK ends the process instead of raising an error.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"
OFF_SCREEN = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")
TRIAL = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetSize(16, 16)
window.AddRenderer(vtkRenderer())
window.Render()
"""


class RenderingUnavailable(RuntimeError):  # noqa: N818 - names the condition, not an error
    """Rendering is impossible on this machine; the message names the library to install."""


@cache
def probe() -> str | None:
    """Find a kind of window that renders, in a child process, once per process.

    Returns
    -------
    VTK class name of the window, or None for VTK's default.

    Raises
    ------
    RenderingUnavailable
        No kind of window renders.
    """
    chosen: tuple[str | None, ...] = (None,)
    if sys.platform.startswith("linux") and WINDOW not in os.environ:
        chosen = (*OFF_SCREEN, None)  # these need no display; the one named in the environment may not exist
    for window in chosen:
        if _renders(window):
            return window
    raise RenderingUnavailable(
        "pictures need OpenGL, and rendering an empty window failed. On Debian or Ubuntu install it by "
        "`sudo apt install libegl1 libgl1`, or software rendering alone by `sudo apt install libosmesa6`. "
        "All else works without: motion, deflection, reports, tables, finite element checks and meshes."
    )


def _renders(window: str | None) -> bool:
    environment = os.environ if window is None else {**os.environ, WINDOW: window}
    try:
        trial = subprocess.run(
            [sys.executable, "-c", TRIAL], env=environment, capture_output=True, timeout=60, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return trial.returncode == 0


@contextmanager
def off_screen() -> Iterator[None]:
    """Use the window class that `probe` found, and raise VTK's errors at the end.

    Raises
    ------
    RenderingUnavailable
        See `probe`.
    RuntimeError
        VTK reported an error.
    """
    window = probe()
    import pyvista as pv

    before = os.environ.get(WINDOW)
    if window is not None:
        os.environ[WINDOW] = window
    try:
        with pv.VtkErrorCatcher(raise_errors=True, send_to_logging=False):
            yield
    finally:
        if window is not None and before is None:
            del os.environ[WINDOW]
