"""The command's arguments as a request and a batch, by a parser that is made of their fields."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from kinelast.scene.error import likely
from kinelast.tasks import Option, OptionError, are_checks
from kinelast.tasks.request import GROUPS, Batch, Request, options_of

EPILOG = """\
exit status: 0 fine, 1 a check failed, 2 bad input (the other scenes were still computed), 3 an error of the program,
130 interrupted, 128 and a signal's number where that ended the run (143: SIGTERM)

examples:
  deflection-report steel_four_bar
  deflection-report quick_return --structure
  deflection-report mine.toml --check --animate deflection --frames 120 -o results
  deflection-report steel_four_bar --accuracy "2 %" --check nonlinear
  deflection-report designs --jobs 0 --resume --quiet
"""


def parsed(argv: Sequence[str]) -> tuple[Request, Batch]:
    """The request and the batch of some arguments.

    Raises
    ------
    SystemExit
        Help was asked for and printed, or the arguments are wrong and that was said.
    """
    known = options_of(Batch, Request)
    parser = _parser(known)
    words, behind = _parted(argv)
    space, unknown = parser.parse_known_intermixed_args(_with_bare(words, known))
    given: dict[str, Any] = {
        name: tuple(value) if known[name][0].many else value for name, value in vars(space).items()
    }
    given["scenes"] = (*given.get("scenes", ()), *behind)
    if unknown:
        _refuse(parser, unknown[0].partition("=")[0])
    _require_fitting(parser, given, known)
    mine = options_of(Request)
    return (
        Request(**{name: value for name, value in given.items() if name in mine}),
        Batch(**{name: value for name, value in given.items() if name not in mine}),
    )


def _parted(argv: Sequence[str]) -> tuple[Sequence[str], Sequence[str]]:
    """The arguments before "--", and the scenes behind it."""
    at = argv.index("--") if "--" in argv else len(argv)
    return argv[:at], argv[at + 1 :]


def _parser(known: dict[str, tuple[Option, Any]]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="deflection-report",
        usage="deflection-report SCENE ... [options]",
        description="How much the links of a moving planar mechanism bend, turn and stretch under their own inertia.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        argument_default=argparse.SUPPRESS,
    )
    groups = {group: parser.add_argument_group(group) for group in GROUPS}
    for name, (option, default) in known.items():
        flags = option.flags or (f"--{name}",)
        words: dict[str, Any] = {"help": _help(option, default)}
        if option.metavar or option.choices:
            words |= {"metavar": option.metavar or None, "type": _typed(option.read), "choices": option.choices or None}
        if not flags[0].startswith("-"):
            words["nargs"] = "*"
        else:
            words["dest"] = name
            if option.bare is not None:
                words |= {"nargs": "?", "const": option.bare}
            elif option.many:
                words["action"] = "append"
            elif not (option.metavar or option.choices):
                words["action"] = "store_true"
        groups[option.group].add_argument(*flags, **words)
    return parser


def _help(option: Option, default: Any) -> str:
    return (f"{option.help} [{default}]" if option.shows else option.help).replace("%", "%%")


def _typed(read: Callable[[str], Any]) -> Callable[[str], Any]:
    """A reader that raises its message as argparse's error, so that it is printed."""

    def value(text: str) -> Any:
        try:
            return read(text)
        except OptionError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return value


def _with_bare(argv: Sequence[str], known: dict[str, tuple[Option, Any]]) -> list[str]:
    """The arguments, with its value filled in where a scene follows a bare --check."""
    bare = {flag: option.bare for option, _ in known.values() if option.bare is not None for flag in option.flags}
    following = (*argv[1:], "")
    return [
        f"{word}={','.join(map(str, bare[word]))}" if word in bare and not are_checks(after) else word
        for word, after in zip(argv, following, strict=False)
    ]


def _refuse(parser: argparse.ArgumentParser, word: str) -> NoReturn:
    """End with a message on an option that there is none of."""
    flags = [flag for action in parser._actions for flag in action.option_strings if flag.startswith("--")]
    parser.error(f'there is no option "{word}"{likely(word, flags) or "; --help lists all"}')


def _require_fitting(
    parser: argparse.ArgumentParser, given: dict[str, Any], known: dict[str, tuple[Option, Any]]
) -> None:
    """End with a message where options do not go together."""
    for name in given:
        option = known[name][0]
        if option.belongs and not given.get(option.belongs):
            flag = (option.flags or (f"--{name}",))[0]
            parser.error(f"{flag} belongs to --{option.belongs}, which is not asked for")
    if "changes" in given and given.keys() & {"sweep", "design", "structure"}:
        parser.error("--set belongs to a report: a sweep varies numbers by [sweep]")
    if "theory" in given and "accuracy" in given:
        parser.error("--accuracy chooses the theory: leave out --theory or --accuracy")
