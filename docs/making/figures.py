"""Reference of the figures, from their registry, and of the fields along a beam."""

from rows import row

from elastic import FIELDS
from kinelast import read_scene, shipped_scenes
from kinelast.figures.registry import figures_of
from kinelast.scene.data import Scene
from kinelast.scene.limits import Output
from kinelast.values.figure import Figure

INTRO = """# Figures

A *figure* is a result with a key. Reports, `summary.json`, sweeps, optima, sensitivities, tolerances, speeds and
`[limits.figures]` use this key, or `KEY.ITEM` for one item, as in `deflection.coupler`. The registry
(`kinelast/figures/registry.py`) has one entry per figure. *On request* figures are computed only if named. Figures
*in a row* are in the row of a design by default. *Rigid* figures do not depend on the elasticity of the links. *Limit*
is the key of the figure under `[limits]`.

"""
HEAD = (
    "| key | figure | unit | one per | over positions | on request | in a row | rigid | limit |\n"
    + "| --- " * 9
    + "|\n"
)
FIELD_HEAD = "## Fields along a beam\n\n| key | symbol | field | unit |\n| --- | --- | --- | --- |\n"


def all_figures() -> dict[str, Figure]:
    """Return all figures by key, including the figures of a point and of an angle output."""
    outputs = (Output("link", "point", False), Output("link", "", False))
    return {each.key: each for output in outputs for each in figures_of(output)}


def page() -> str:
    """Return the page of all figures."""
    scenes = [read_scene(path) for path in shipped_scenes().values() if path.parent.name == "mechanisms"]
    rows = "".join(_row(each, scenes) for each in all_figures().values())
    fields = "".join(row((f"`{each.key}`", each.symbol, each.name, each.unit)) for each in FIELDS.values())
    return f"{INTRO}{HEAD}{rows}\n{FIELD_HEAD}{fields}"


def _row(figure: Figure, scenes: list[Scene]) -> str:
    yes = {True: "yes", False: ""}
    cells = (f"`{figure.key}`", figure.name, _units(figure, scenes), str(figure.of), figure.over, yes[figure.asked],
             yes[figure.listed], yes[figure.rigid], f"`{figure.limit}`" if figure.limit else "")  # fmt: skip
    return row(cells)


def _units(figure: Figure, scenes: list[Scene]) -> str:
    """Unit of a figure, or all its units in the shipped scenes if it depends on the item."""
    if isinstance(figure.unit, str):
        return "m or rad" if figure.key in OF_OUTPUT else figure.unit
    return " or ".join(sorted({unit for scene in scenes for unit in figure.unit(scene)}))


OF_OUTPUT = ("output_error", "residual")
"""Figures with the unit of the output: a length for a point, an angle for a link."""
