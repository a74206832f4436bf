"""Reference of the figures, from their registry, and of the fields along a beam."""

from __future__ import annotations

from rows import row

from elastic import FIELDS
from kinelast import read_scene, shipped_scenes
from kinelast.figures.entry import Figure
from kinelast.figures.registry import figures_of
from kinelast.scene.data import Scene
from kinelast.scene.limits import Output

INTRO = """# Figures

Every figure has one entry in the registry (`kinelast/figures/registry.py`), from which reports, `summary.json`,
sweeps, optima, sensitivities, tolerances and speeds take it. `[sweep]`, `[optimize]`, `[sensitivities]` and the columns
of tables name it by its key, of one item as `KEY.ITEM`, as in `deflection.coupler`. *Asked for*: it is computed only
where it is named. *In a row*: it stands in the row of a design unasked. *Rigid*: it belongs to the motion of rigid
links, which no theory of the links changes.

"""
HEAD = (
    "| key | figure | unit | of every | over positions | asked for | in a row | rigid | limit |\n"
    + "| --- " * 9
    + "|\n"
)
FIELD_HEAD = "## Fields along a beam\n\n| key | symbol | field | unit |\n| --- | --- | --- | --- |\n"


def all_figures() -> dict[str, Figure]:
    """Figures by key, those of a point's and of an angle's output too."""
    outputs = (Output("link", "point", False), Output("link", "", False))
    return {each.key: each for output in outputs for each in figures_of(output)}


def page() -> str:
    """The page of all figures."""
    scenes = [read_scene(path) for path in shipped_scenes().values() if path.parent.name == "mechanisms"]
    rows = "".join(_row(each, scenes) for each in all_figures().values())
    fields = "".join(row((f"`{each.key}`", each.symbol, each.name, each.unit)) for each in FIELDS.values())
    return f"{INTRO}{HEAD}{rows}\n{FIELD_HEAD}{fields}"


def _row(figure: Figure, scenes: list[Scene]) -> str:
    yes = {True: "yes", False: ""}
    cells = (f"`{figure.key}`", figure.name, _units(figure, scenes), str(figure.of), figure.over, yes[figure.asked],
             yes[figure.told], yes[figure.rigid], f"`{figure.limit}`" if figure.limit else "")  # fmt: skip
    return row(cells)


def _units(figure: Figure, scenes: list[Scene]) -> str:
    """The unit, or the units that it has in the shipped scenes where it depends on the item."""
    if isinstance(figure.unit, str):
        return "m or rad" if figure.key in OF_OUTPUT else figure.unit
    return " or ".join(sorted({unit for scene in scenes for unit in figure.unit(scene)}))


OF_OUTPUT = ("output_error", "residual")
"""Figures whose unit is that of the output: a length of a point, an angle of a link."""
