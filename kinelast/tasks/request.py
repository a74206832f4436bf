"""Options of the command: `Request` has the options for each scene, `Batch` has the options for the whole run.

Each field of these classes is an option of the command line.
"""

from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from msgspec import Struct, structs

from kinelast import tasks
from kinelast.tasks import Option, at_least

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


class Request(Struct, frozen=True):
    """Options for each scene. The results of a scene depend only on its file and on these options."""

    # fmt: off
    positions: Annotated[int | None, Option(SCENE,
        "number of positions over the cycle, instead of the number in the scene", "N",
        read=at_least(1, MAX_POSITIONS))] = None
    changes: Annotated[tuple[str, ...], Option(SCENE,
        'replace a number of the scene, as in "links.rod.length=330 mm"; repeatable', "PATH=VALUE", flags=("--set",),
        many=True)] = ()
    theory: Annotated[str | None, Option(SCENE, "theory of the deflection, instead of the theory in the scene",
        choices=("quasi-static", "elastodynamic", "geometrically-exact"))] = None
    accuracy: Annotated[float | None, Option(SCENE,
        'largest allowed error, as in "2 %": uses the cheapest theory that reaches it', "SHARE",
        read=tasks.share)] = None
    units: Annotated[str | None, Option(SCENE,
        "units of the report and of positions.csv, instead of the units in the scene [SI]",
        choices=("SI", "mm", "in"))] = None
    refine: Annotated[bool, Option(SCENE, "also search for the largest values between the positions")] = False
    reachable: Annotated[bool, Option(SCENE, "leave out positions that the mechanism cannot reach")] = False
    speeds: Annotated[tuple[float, float, int, str] | None, Option(SCENE,
        'largest values as functions of the drive speed, as in "20 rad/s : 200 rad/s : 100" (speeds.csv, .svg)',
        "FROM:TO:COUNT", read=tasks.speeds, writes=("speeds.csv", "speeds.svg"))] = None
    tables: Annotated[tuple[str, ...], Option(SCENE,
        "also write every table in other formats: parquet, html, xlsx (an unknown name lists all)", "FORMAT,...",
        read=tasks.names)] = ()
    motion: Annotated[bool, Option(SCENE,
        "also write the motion at every position: drives, links, points, joints and their forces (motion.csv)",
        writes=("motion.csv",))] = False
    columns: Annotated[tuple[str, ...], Option(SCENE,
        'write only these columns of positions.csv and motion.csv, as in "B.*,crank.effort"', "PATTERN,...",
        read=tasks.names)] = ()
    fields: Annotated[bool, Option(SCENE,
        "also write all fields along all links (fields.npz)", writes=("fields.npz",))] = False
    stations: Annotated[int, Option(SCENE,
        "number of stations along a link for --fields", "N", read=at_least(2, MAX_STATIONS), belongs="fields")] = 101
    checks: Annotated[tuple[int | str, ...], Option(CHECKING,
        f"compare with finite elements, ELEMENTS per beam [{tasks.ELEMENTS}]; nonlinear: the whole mechanism with "
        "vibration and displacements of any size; solid: plane-stress elements (check.json)",
        "ELEMENTS|nonlinear|solid,...", flags=("--check",), read=tasks.checks, bare=(tasks.ELEMENTS,), many=True,
        writes=("check.json",))] = ()
    handout: Annotated[bool, Option(PICTURES,
        "also write one page to print: verdict, picture, limits, assumptions, checks (report.pdf)", flags=("--print",),
        writes=("report.pdf",))] = False
    stills: Annotated[bool, Option(PICTURES,
        "also draw curves, maps and the mechanism as SVG for print (stills/*.svg)", writes=("stills",))] = False
    dxf: Annotated[bool, Option(PICTURES,
        "also draw the links with their holes and the paths of all points (links.dxf, links.svg)",
        writes=("links.dxf", "links.svg"))] = False
    mesh: Annotated[bool, Option(PICTURES,
        "also write a mesh for every position, for ParaView (mesh/*.vtu)", writes=("mesh",))] = False
    animate: Annotated[tuple[str, ...], Option(PICTURES,
        "movies: deflection, slope, bending-moment, ... (an unknown name lists all)", "DIAGRAM,...",
        read=tasks.diagrams)] = ()
    frames: Annotated[int | None, Option(PICTURES,
        "number of frames of a movie [one per position, at most 120]", "N", read=at_least(1), belongs="animate")] = None
    picture: Annotated[str, Option(PICTURES, "file format of movies; png writes single frames", flags=("--format",),
        choices=FORMATS, belongs="animate")] = FORMATS[0]
    fps: Annotated[float | None, Option(PICTURES, "frames per second [25]", "N", read=tasks.positive,
        belongs="animate")] = None
    size: Annotated[tuple[int, int] | None, Option(PICTURES,
        "size of a picture in pixels [1280x720]", "WxH", read=tasks.size, belongs="animate")] = None
    style: Annotated[str, Option(PICTURES, "solid draws the links as shaded bodies, coloured by the field",
        choices=STYLES, belongs="animate")] = STYLES[0]
    exaggeration: Annotated[float | None, Option(PICTURES,
        "scale of the deformation in a picture [chosen automatically]", "N", read=tasks.positive,
        belongs="animate")] = None
    background: Annotated[str | None, Option(PICTURES,
        'background of a picture, as in "black" or "#ffffff" [white]', "COLOUR", read=tasks.colour,
        belongs="animate")] = None
    show: Annotated[tuple[str, ...] | None, Option(PICTURES,
        "contents of a picture: names (of points), links, peak, drives, paths, deformed; none [names,peak,drives]",
        "WHAT,...", read=tasks.shown, belongs="animate")] = None
    balance: Annotated[bool, Option(DESIGNS,
        "best counterweights, discs and springs to balance the shaking force and moment, gravity and the drives; also "
        "writes a scene with counterweights that --optimize improves (balance.toml)", writes=("balance.toml",))] = False
    sensitivities: Annotated[bool, Option(DESIGNS,
        "derivatives of all figures with respect to all numbers (sensitivities.*)",
        writes=("sensitivities.csv", "sensitivities.svg"))] = False
    tolerances: Annotated[bool, Option(DESIGNS, "ranges of all figures within [tolerances] (tolerances.*)",
        writes=("tolerances.csv", "tolerances.svg"))] = False
    samples: Annotated[int | None, Option(DESIGNS, "number of sampled designs for --tolerances [2048]", "N",
        read=at_least(16, MAX_SAMPLES), belongs="tolerances")] = None
    optimize: Annotated[bool, Option(DESIGNS, "best design for [optimize], also as a separate scene (optimum.toml)",
        writes=("optimum.csv", "optimum.toml"))] = False
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

    def theory_of(self, scene: "Scene") -> "Theory":
        """Return the theory and accuracy that the options request. Without these options, return those of the scene."""
        if self.theory is None and self.accuracy is None:
            return scene.theory
        return structs.replace(scene.theory, name=self.theory, accuracy=self.accuracy)


class Batch(Struct, frozen=True):
    """Options for the run over all scenes, such as scene files, kind of run, and folder for the results."""

    # fmt: off
    scenes: Annotated[tuple[str, ...], Option(SCENE,
        "a scene file (.toml), a folder or pattern of scene files, a shipped scene, or a report (.html)", "SCENE",
        flags=("scenes",), many=True)] = ()
    new: Annotated[str | None, Option(SCENE, "write a first scene, NAME.toml, and stop", "NAME")] = None
    copy: Annotated[str | None, Option(SCENE, "write a copy of a shipped scene, SCENE.toml, and stop", "SCENE")] = None
    foreign: Annotated[str | None, Option(SCENE,
        "write the scene of another program's mechanism and stop: PMKS+ (file or link), Linkage, pylinkage, mec2, "
        "linkage_sim, DXF", "FILE", flags=("--import",))] = None
    elastic: Annotated[bool, Option(SCENE,
        "with --import: write FILE_elastic.toml, in which links with a given mass also bend, as uniform bars",
        belongs="foreign")] = False
    export: Annotated[str | None, Option(SCENE,
        "write the scene's mechanism for another program and stop: PMKS+ (.pmks), Linkage (.linkage2)", "FILE")] = None
    structure: Annotated[bool, Option(CHECKING,
        "only report mobility, loops and groups, and draw the skeleton diagram",
        writes=("structure.txt", "skeleton.svg"))] = False
    live: Annotated[bool, Option(SCENE,
        "edit the scene, or a new one, in the browser, and see it move and bend")] = False
    sweep: Annotated[bool, Option(DESIGNS, "compute the designs of [sweep] (designs.csv)")] = False
    design: Annotated[int | None, Option(DESIGNS,
        "only write the scene of one design of [sweep] (SCENE_design_N.toml)", "N", read=at_least(0))] = None
    most: Annotated[int, Option(DESIGNS, "maximum number of designs in a sweep", "N", read=at_least(1))] = 10_000_000
    pages: Annotated[int, Option(DESIGNS,
        "number of designs of a sweep that get a report: the best one and the Pareto front", "N",
        read=at_least(0))] = 20
    scheduler: Annotated[str | None, Option(DESIGNS,
        'address of a dask scheduler whose workers compute the designs of a sweep, as in "tcp://host:8786"', "ADDRESS",
        belongs="sweep")] = None
    out: Annotated[Path, Option(RUNNING,
        "folder for the results", "OUT", flags=("-o", "--out"), read=Path)] = Path("deflection-report")
    jobs: Annotated[int, Option(RUNNING, "number of processes for scenes or designs; 0: one per core", "N",
        read=at_least(0))] = 1
    resume: Annotated[bool, Option(RUNNING,
        "skip scenes and parts of a sweep that already have results for the same file and options")] = False
    quiet: Annotated[bool, Option(RUNNING, "print only errors")] = False
    list: Annotated[bool, Option(RUNNING,
        "list the shipped scenes and stop; --list sections or --list materials: list the names that a scene can use"
        )] = False
    completion: Annotated[str | None, Option(RUNNING, "print the completion script of a shell, and stop",
        choices=SHELLS)] = None
    version: Annotated[bool, Option(RUNNING, "print the version and stop")] = False
    # fmt: on


def options_of(*lists: type[Struct]) -> dict[str, Option]:
    """Return the options of `Request`, `Batch` or both, by field name."""
    options = {}
    for each in chain.from_iterable(map(structs.fields, lists)):
        (defined,) = each.type.__metadata__
        flags = defined.flags or (f"--{each.name}",)
        options[each.name] = structs.replace(defined, default=each.default, flags=flags)
    return options


def written() -> set[str]:
    """Return the names of all files and folders that the results of a scene can contain, except movies."""
    return {*ALWAYS, *(name for each in options_of(Request, Batch).values() for name in each.writes)}
