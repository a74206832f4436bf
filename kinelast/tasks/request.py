"""Options of the command: `Request` has the options for each scene, `Batch` has the options for the whole run.

Each field of these classes is an option of the command line.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

from kinelast import tasks
from kinelast.tasks import Option, at_least, checks, option, size, speeds

if TYPE_CHECKING:
    from kinelast.scene.data import Scene, Theory

MAX_POSITIONS = 1_000_000  # largest value of --positions, and of the key `positions` under [run] in a scene file
MAX_STATIONS = 10_001
MAX_SAMPLES = 1_000_000
STYLES = ("plain", "solid")
FORMATS = ("mp4", "gif", "png")
SHELLS = ("bash", "zsh", "fish")
ALWAYS = ("report.html", "positions.csv")
"""Files in the results of every scene, in addition to summary.json."""
SCENE, CHECKING, PICTURES, DESIGNS, RUNNING = GROUPS = ("scene", "checks", "pictures", "designs", "running")


class RequestError(ValueError):
    """Error for a request that cannot be fulfilled."""


@dataclass(frozen=True)
class Request:
    """Options for each scene. The results of a scene depend only on its file and on these options."""

    # fmt: off
    positions: int | None = option(SCENE, "number of positions over the cycle, instead of the number in the scene", "N",
        read=at_least(1, MAX_POSITIONS))
    changes: tuple[str, ...] = option(SCENE,
        'replace a number of the scene, as in "links.rod.length=330 mm"; repeatable', "PATH=VALUE", flags=("--set",),
        many=True, default=())
    theory: str | None = option(SCENE, "theory of the deflection, instead of the theory in the scene",
        choices=("quasi-static", "elastodynamic", "geometrically-exact"))
    accuracy: float | None = option(SCENE,
        'largest allowed error, as in "2 %": uses the cheapest theory that reaches it', "SHARE",
        read=tasks.share)
    units: str | None = option(SCENE,
        "units of the report and of positions.csv, instead of the units in the scene [SI]",
        choices=("SI", "mm", "in"))
    refine: bool = option(SCENE, "also search for the largest values between the positions")
    reachable: bool = option(SCENE, "leave out positions that the mechanism cannot reach")
    speeds: tuple[float, float, int, str] | None = option(SCENE,
        'largest values as functions of the drive speed, as in "20 rad/s : 200 rad/s : 100" (speeds.csv, .svg)',
        "FROM:TO:COUNT", read=speeds, writes=("speeds.csv", "speeds.svg"))
    tables: tuple[str, ...] = option(SCENE,
        "also write every table in other formats: parquet, html, xlsx (an unknown name lists all)", "FORMAT,...",
        read=tasks.names, default=())
    motion: bool = option(SCENE,
        "also write the motion at every position: drives, links, points, joints and their forces (motion.csv)",
        writes=("motion.csv",))
    columns: tuple[str, ...] = option(SCENE,
        'write only these columns of positions.csv and motion.csv, as in "B.*,crank.effort"', "PATTERN,...",
        read=tasks.names, default=())
    fields: bool = option(SCENE, "also write all fields along all links (fields.npz)", writes=("fields.npz",))
    stations: int = option(SCENE, "number of stations along a link for --fields", "N", read=at_least(2, MAX_STATIONS),
        belongs="fields", default=101)
    checks: tuple[int | str, ...] = option(CHECKING,
        f"compare with finite elements, ELEMENTS per beam [{tasks.ELEMENTS}]; nonlinear: the whole mechanism with "
        "vibration and displacements of any size; solid: plane-stress elements (check.json)",
        "ELEMENTS|nonlinear|solid,...", flags=("--check",), read=checks, bare=(tasks.ELEMENTS,), many=True,
        default=(), writes=("check.json",))
    handout: bool = option(PICTURES,
        "also write one page to print: verdict, picture, limits, assumptions, checks (report.pdf)", flags=("--print",),
        writes=("report.pdf",))
    stills: bool = option(PICTURES, "also draw curves, maps and the mechanism as SVG for print (stills/*.svg)",
        writes=("stills",))
    dxf: bool = option(PICTURES,
        "also draw the links with their holes and the paths of all points (links.dxf, links.svg)",
        writes=("links.dxf", "links.svg"))
    mesh: bool = option(PICTURES, "also write a mesh for every position, for ParaView (mesh/*.vtu)", writes=("mesh",))
    animate: tuple[str, ...] = option(PICTURES,
        "movies: deflection, slope, bending-moment, ... (an unknown name lists all)", "DIAGRAM,...",
        read=tasks.diagrams, default=())
    frames: int | None = option(PICTURES, "number of frames of a movie [one per position, at most 120]", "N",
        read=at_least(1), belongs="animate")
    picture: str = option(PICTURES, "file format of movies; png writes single frames", flags=("--format",),
        choices=FORMATS, belongs="animate", default=FORMATS[0])
    fps: float | None = option(PICTURES, "frames per second [25]", "N", read=tasks.positive,
        belongs="animate")
    size: tuple[int, int] | None = option(PICTURES, "size of a picture in pixels [1280x720]", "WxH", read=size,
        belongs="animate")
    style: str = option(PICTURES, "solid draws the links as shaded bodies, coloured by the field", choices=STYLES,
        belongs="animate", default=STYLES[0])
    exaggeration: float | None = option(PICTURES, "scale of the deformation in a picture [chosen automatically]", "N",
        read=tasks.positive, belongs="animate")
    background: str | None = option(PICTURES, 'background of a picture, as in "black" or "#ffffff" [white]', "COLOUR",
        read=tasks.colour, belongs="animate")
    show: tuple[str, ...] | None = option(PICTURES,
        "contents of a picture: names (of points), links, peak, drives, paths, deformed; none [names,peak,drives]",
        "WHAT,...", read=tasks.shown, belongs="animate")
    balance: bool = option(DESIGNS,
        "best counterweights, discs and springs to balance the shaking force and moment, gravity and the drives; also "
        "writes a scene with counterweights that --optimize improves (balance.toml)", writes=("balance.toml",))
    sensitivities: bool = option(DESIGNS, "derivatives of all figures with respect to all numbers (sensitivities.*)",
        writes=("sensitivities.csv", "sensitivities.svg"))
    tolerances: bool = option(DESIGNS, "ranges of all figures within [tolerances] (tolerances.*)",
        writes=("tolerances.csv", "tolerances.svg"))
    samples: int | None = option(DESIGNS, "number of sampled designs for --tolerances [2048]", "N",
        read=at_least(16, MAX_SAMPLES), belongs="tolerances")
    optimize: bool = option(DESIGNS, "best design for [optimize], also as a separate scene (optimum.toml)",
        writes=("optimum.csv", "optimum.toml"))
    # fmt: on

    @property
    def elements(self) -> int | None:
        """Number of finite elements per beam for the check, or None if the check is not requested."""
        return next((check for check in self.checks if isinstance(check, int)), None)

    @property
    def nonlinear(self) -> bool:
        """True if the nonlinear check is requested.

        The nonlinear check computes the whole mechanism with vibration and displacements of any size.
        """
        return "nonlinear" in self.checks

    @property
    def solid(self) -> bool:
        """True if the check of the links by plane-stress elements is requested."""
        return "solid" in self.checks

    def theory_of(self, scene: Scene) -> Theory:
        """Return the theory and accuracy that the options request. Without these options, return those of the scene."""
        if self.theory is None and self.accuracy is None:
            return scene.theory
        from msgspec import structs

        return structs.replace(scene.theory, name=self.theory, accuracy=self.accuracy)


@dataclass(frozen=True)
class Batch:
    """Options for the run over all scenes, such as scene files, kind of run, and folder for the results."""

    # fmt: off
    scenes: tuple[str, ...] = option(SCENE,
        "a scene file (.toml), a folder or pattern of scene files, a shipped scene, or a report (.html)", "SCENE",
        flags=("scenes",), many=True, default=())
    new: str | None = option(SCENE, "write a first scene, NAME.toml, and stop", "NAME")
    copy: str | None = option(SCENE, "write a copy of a shipped scene, SCENE.toml, and stop", "SCENE")
    foreign: str | None = option(SCENE,
        "write the scene of another program's mechanism and stop: PMKS+ (file or link), Linkage, pylinkage, mec2, "
        "linkage_sim, DXF", "FILE", flags=("--import",))
    elastic: bool = option(SCENE,
        "with --import: write FILE_elastic.toml, in which links with a given mass also bend, as uniform bars",
        belongs="foreign")
    export: str | None = option(SCENE,
        "write the scene's mechanism for another program and stop: PMKS+ (.pmks), Linkage (.linkage2)", "FILE")
    structure: bool = option(CHECKING, "only report mobility, loops and groups, and draw the skeleton diagram",
        writes=("structure.txt", "skeleton.svg"))
    live: bool = option(SCENE,
        "edit the scene, or a new one, in the browser, and see it move and bend")
    sweep: bool = option(DESIGNS, "compute the designs of [sweep] (designs.csv)")
    design: int | None = option(DESIGNS,
        "only write the scene of one design of [sweep] (SCENE_design_N.toml)", "N", read=at_least(0))
    most: int = option(DESIGNS, "maximum number of designs in a sweep", "N", read=at_least(1), default=10_000_000)
    pages: int = option(DESIGNS,
        "number of designs of a sweep that get a report: the best one and the Pareto front", "N",
        read=at_least(0), default=20)
    scheduler: str | None = option(DESIGNS,
        'address of a dask scheduler whose workers compute the designs of a sweep, as in "tcp://host:8786"', "ADDRESS",
        belongs="sweep")
    out: Path = option(RUNNING,  # noqa: RUF009 - a Path is immutable
        "folder for the results", "OUT", flags=("-o", "--out"), read=Path, default=Path("deflection-report"))
    jobs: int = option(RUNNING, "number of processes for scenes or designs; 0: one per core", "N",
        read=at_least(0), default=1)
    resume: bool = option(RUNNING,
        "skip scenes and parts of a sweep that already have results for the same file and options")
    quiet: bool = option(RUNNING, "print only errors")
    list: bool = option(RUNNING,
        "list the shipped scenes and stop; --list sections or --list materials: list the names that a scene can use")
    completion: str | None = option(RUNNING, "print the completion script of a shell, and stop",
        choices=SHELLS)
    version: bool = option(RUNNING, "print the version and stop")
    # fmt: on


def options_of(*lists: type) -> dict[str, Option]:
    """Return the options of `Request`, `Batch` or both, by field name."""
    found = {each.name: each.metadata["option"] for one in lists for each in fields(one)}
    return {name: replace(each, flags=each.flags or (f"--{name}",)) for name, each in found.items()}


def written() -> set[str]:
    """Return the names of all files and folders that the results of a scene can contain, except movies."""
    return {*ALWAYS, *(name for each in options_of(Request, Batch).values() for name in each.writes)}
