"""The options of the deflection-report command."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

ELEMENTS = 16
STATIONS = 101
FORMATS = ("mp4", "gif", "png")
STYLES = ("plain", "solid")
MOST_POSITIONS = 1_000_000  # as for [run] positions in a scene
MOST_STATIONS = 10_001
MOST_ELEMENTS = 4096
MOST_SPEEDS = 10_000
MOST_DESIGNS = 10_000_000
DESIGN_PAGES = 20
MOST_SAMPLES = 1_000_000
UNITS = ("SI", "mm", "in")
MOST_PIXELS = 7680
CHECKS = ("nonlinear", "solid")
THEORIES = ("quasi-static", "elastodynamic")
EPILOG = """\
exit status: 0 fine, 1 a check failed, 2 bad input (the other scenes were still computed), 3 an error of the program,
130 interrupted, 128 and a signal's number where that ended the run (143: SIGTERM)

examples:
  deflection-report steel_four_bar
  deflection-report quick_return --structure
  deflection-report mine.toml --check --animate deflection --frames 120 -o results
  deflection-report steel_four_bar --accuracy "2 %%" --check nonlinear
  deflection-report designs --jobs 0 --resume --quiet
"""


def parsed(argv: Sequence[str]) -> argparse.Namespace:
    """The options in some arguments.

    Raises
    ------
    SystemExit
        Help was asked for and printed, or the arguments are wrong and that was said.
    """
    parser = _parser()
    options = parser.parse_args(_with_elements(argv))
    for given, needed, why in (
        (options.stations, options.fields, "--stations belongs to --fields, which is not asked for"),
        (options.frames, options.animate, "--frames belongs to --animate, which is not asked for"),
        (options.format, options.animate, "--format belongs to --animate, which is not asked for"),
        (options.samples, options.tolerances, "--samples belongs to --tolerances, which is not asked for"),
        *(
            (getattr(options, name), options.animate, f"--{name} belongs to --animate, which is not asked for")
            for name in ("fps", "size", "exaggeration", "background", "style", "show")
        ),
    ):
        if given is not None and not needed:
            parser.error(why)
    if options.scheduler and not options.sweep:
        parser.error("--scheduler belongs to --sweep, which is not asked for")
    if options.set and (options.sweep or options.design is not None or options.structure):
        parser.error("--set belongs to a report: a sweep varies numbers by [sweep]")
    if options.theory and options.accuracy:
        parser.error("--accuracy chooses the theory: leave out --theory or --accuracy")
    options.stations = options.stations or STATIONS
    options.format = options.format or FORMATS[0]
    options.style = options.style or STYLES[0]
    return options


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="deflection-report",
        description="How much the links of a moving planar mechanism bend, turn and stretch under their own inertia.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("scenes", nargs="*", metavar="SCENE", help="a scene file (.toml), a folder or pattern of such, a shipped scene")
    add(
        "-o",
        "--out",
        type=Path,
        default=Path("deflection-report"),
        metavar="OUT",
        help="folder for the results [%(default)s]",
    )
    add("--list", action="store_true", help="list the shipped scenes and stop")
    add(
        "--positions",
        type=_at_least(1, MOST_POSITIONS),
        metavar="N",
        help="positions over the cycle, instead of the scene's own",
    )
    add("--fields", action="store_true", help="also write all fields along all links (fields.npz)")
    add(
        "--stations",
        type=_at_least(2, MOST_STATIONS),
        metavar="N",
        help=f"stations along a link for --fields [{STATIONS}]",
    )
    add(
        "--check",
        nargs="?",
        type=_checks,
        const=(ELEMENTS,),
        default=(),
        metavar="ELEMENTS|nonlinear|solid,...",
        help=f"compare with finite elements, so many to a beam [{ELEMENTS}]; with the whole mechanism vibrating and "
        "displaced as far as it will; with links as plane bodies (check.json)",
    )
    add(
        "--speeds",
        type=_speeds,
        metavar="FROM:TO:COUNT",
        help='largest values against the speed of the drive, as in "20 rad/s : 200 rad/s : 100" (speeds.csv, .svg)',
    )
    add("--theory", choices=THEORIES, help="of motion, instead of the scene's own")
    add(
        "--accuracy",
        type=_share,
        metavar="SHARE",
        help='how far the answer may be off, as in "2 %%": takes the cheapest theory that gets there',
    )
    add(
        "--animate",
        type=_names,
        default=(),
        metavar="DIAGRAM,...",
        help="movies: deflection, slope, bending-moment, ... (an unknown name lists all)",
    )
    add("--frames", type=_at_least(1), metavar="N", help="frames of a movie [one a position, 120 at most]")
    add("--format", choices=FORMATS, help=f"of the movies; png: stills [{FORMATS[0]}]")
    _add_film_options(add)
    add("--mesh", action="store_true", help="also write a mesh for every position, for ParaView (mesh/*.vtu)")
    add(
        "--stills", action="store_true", help="also draw curves, maps and the mechanism as SVG for print (stills/*.svg)"
    )
    add("--sweep", action="store_true", help="compute the designs of the scene's [sweep] instead (designs.csv)")
    add(
        "--design",
        type=_at_least(0),
        metavar="N",
        help="write the scene of one design of the scene's [sweep] instead (SCENE_design_N.toml)",
    )
    add(
        "--most",
        type=_at_least(1),
        default=MOST_DESIGNS,
        metavar="N",
        help="designs that a sweep may have [%(default)s]",
    )
    add(
        "--pages",
        type=_at_least(0),
        default=DESIGN_PAGES,
        metavar="N",
        help="designs of a sweep with a report of their own: the best, and those on its front [%(default)s]",
    )
    add(
        "--scheduler",
        metavar="ADDRESS",
        help='of dask, as "tcp://host:8786": its workers compute the designs of a sweep instead',
    )
    add(
        "--set",
        action="append",
        default=[],
        metavar="PATH=VALUE",
        help='what if: another number for one of the scene, as in "links.rod.length=330 mm"; as often as needed',
    )
    add("--units", choices=UNITS, help="of the page and of positions.csv, instead of the scene's own [SI]")
    add("--structure", action="store_true", help="tell mobility, loops and groups instead, and draw the skeleton")
    add("--refine", action="store_true", help="search the largest values between the positions too")
    add("--reachable", action="store_true", help="leave out positions that the mechanism cannot reach")
    add("--sensitivities", action="store_true", help="how every figure changes with every number (sensitivities.*)")
    add("--tolerances", action="store_true", help="ranges of all figures under [tolerances] (tolerances.*)")
    add(
        "--samples",
        type=_at_least(16, MOST_SAMPLES),
        metavar="N",
        help="designs to sample for --tolerances [2048]",
    )
    add("--optimize", action="store_true", help="the best design by [optimize], as a scene of its own (optimum.toml)")
    add(
        "--jobs",
        type=_at_least(0),
        default=1,
        metavar="N",
        help="processes: scenes, or designs of a sweep, side by side; 0: as many as cores [%(default)s]",
    )
    add(
        "--resume",
        action="store_true",
        help="skip scenes, and parts of a sweep, whose results are there, from the same file and options",
    )
    add("--quiet", action="store_true", help="print nothing but errors")
    add("--version", action="store_true", help="print the version and stop")
    return parser


def _add_film_options(add: Callable[..., object]) -> None:
    """How films look."""
    add("--fps", type=_positive, metavar="N", help="frames of a movie shown in a second [25]")
    add("--size", type=_size, metavar="WxH", help="of a picture in pixels [1280x720]")
    add("--style", choices=STYLES, help=f"solid: links as shaded bodies in the colours of the field [{STYLES[0]}]")
    add(
        "--exaggeration",
        type=_positive,
        metavar="N",
        help="of deformed links in a picture [what shows them]",
    )
    add("--background", type=_colour, metavar="COLOUR", help='of a picture, as in "black" or "#ffffff" [white]')
    add(
        "--show",
        type=_shown,
        metavar="WHAT,...",
        help="in a picture: names (of points), links, peak, drives, paths, deformed; none [names,peak,drives]",
    )


def _with_elements(argv: Sequence[str]) -> list[str]:
    """The arguments, with the number of elements filled in where a scene follows a bare --check."""
    following = (*argv[1:], "")
    return [
        f"--check={ELEMENTS}" if word == "--check" and not _is_checks(after) else word
        for word, after in zip(argv, following, strict=False)
    ]


def _is_checks(text: str) -> bool:
    return all(word.isdecimal() or word in CHECKS for word in text.split(","))


def _checks(text: str) -> tuple[int | str, ...]:
    """Checks that are asked for: elements to a beam, "nonlinear", "solid"."""
    found = [word if word in CHECKS else _at_least(1, MOST_ELEMENTS)(word) for word in text.split(",")]
    if sum(isinstance(one, int) for one in found) > 1:
        raise argparse.ArgumentTypeError(f"expected one number of elements, not {text!r}")
    return tuple(found)


def _speeds(text: str) -> tuple[float, float, int]:
    from kinelast.scene.quantities import Speed

    try:
        low, high, count = text.split(":")
        first, last = (float(Speed.read(_bare(word))) for word in (low, high))
        if not 0 < first < last or not 2 <= int(count) <= MOST_SPEEDS:
            raise ValueError
        return first, last, int(count)
    except ValueError:
        told = 'two speeds above 0, the greater one last, and how many, as in "20 rad/s : 200 rad/s : 100"'
        raise argparse.ArgumentTypeError(f"expected {told}, not {text!r}") from None


def _bare(word: str) -> str | float:
    try:
        return float(word)
    except ValueError:
        return word.strip()


def _share(text: str) -> float:
    from kinelast.scene.quantities import Share

    try:
        return float(Share.read(text if text.endswith("%") else float(text)))
    except ValueError:
        raise argparse.ArgumentTypeError(f'expected a share, as in "2 %" or 0.02, not {text!r}') from None


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"expected a number above 0, not {text!r}")
    return value


def _size(text: str) -> tuple[int, int]:
    try:
        width, height = (int(word) for word in text.lower().split("x"))
        if min(width, height) < 160 or max(width, height) > MOST_PIXELS or width % 2 or height % 2:
            raise ValueError
    except ValueError:
        told = f'two even numbers of pixels from 160 to {MOST_PIXELS}, as in "1920x1080"'
        raise argparse.ArgumentTypeError(f"expected {told}, not {text!r}") from None
    return width, height


def _colour(text: str) -> str:
    from animations.paints import colour

    try:
        colour(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


def _shown(text: str) -> tuple[str, ...]:
    from animations import SHOWN

    found = () if text.strip() == "none" else _names(text)
    for word in found:
        if word not in SHOWN:
            raise argparse.ArgumentTypeError(f"{word!r} cannot be shown: choose from none, {', '.join(SHOWN)}")
    return found


def _at_least(least: int, most: int | None = None) -> Callable[[str], int]:
    def count(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = least - 1
        if value < least or (most is not None and value > most):
            bounds = f"from {least} up" if most is None else f"from {least} to {most}"
            raise argparse.ArgumentTypeError(f"expected a whole number {bounds}, not {text!r}")
        return value

    return count


def _names(text: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(word.strip() for word in text.split(",") if word.strip()))
