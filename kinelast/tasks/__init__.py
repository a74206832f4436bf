"""Requests, tasks and outcomes; at the root an option of the command: a field of a request, its words, their value."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import MISSING, dataclass, field
from typing import Any

CHECKS = ("nonlinear", "solid")
ELEMENTS = 16  # to a beam, of a bare --check
MOST_ELEMENTS = 4096
MOST_PIXELS = 7680
MOST_SPEEDS = 10_000


class OptionError(ValueError):
    """The words of an option cannot be read."""


@dataclass(frozen=True)
class Option:
    """An option of the command line, as metadata of its field.

    Attributes
    ----------
    group
        Under which heading of the help it stands.
    help
        What it does; the default follows in brackets where `shows` says so.
    metavar
        What stands for its value in the help; empty of a switch.
    read
        From its word to its value; raises `OptionError`, with what was expected.
    flags
        Its names; where left out, that of the field.
    choices
        The words that there are, where they are few.
    belongs
        The field without which it means nothing.
    bare
        Its value where it is given without a word.
    many
        Whether it is given as often as needed, its values a tuple.
    shows
        Whether the help tells the field's default.
    writes
        Names of the files and folders that it adds to those of a scene.
    """

    group: str
    help: str
    metavar: str = ""
    read: Callable[[str], Any] = str
    flags: tuple[str, ...] = ()
    choices: Sequence[str] = ()
    belongs: str = ""
    bare: Any = None
    many: bool = False
    shows: bool = False
    writes: tuple[str, ...] = ()


def option(group: str, help: str, metavar: str = "", *, default: Any = MISSING, **words: Any) -> Any:  # noqa: A002
    """A field of a dataclass that is an option; without a metavar or choices it is a switch, False unless given."""
    if default is MISSING:
        default = None if metavar or words.get("choices") else False
    return field(default=default, metadata={"option": Option(group, help, metavar, **words)})


def at_least(least: int, most: int | None = None) -> Callable[[str], int]:
    """A whole number from one to another."""

    def count(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = least - 1
        if value < least or (most is not None and value > most):
            bounds = f"from {least} up" if most is None else f"from {least} to {most}"
            raise OptionError(f"expected a whole number {bounds}, not {text!r}")
        return value

    return count


def positive(text: str) -> float:
    """A number above 0."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise OptionError(f"expected a number above 0, not {text!r}")
    return value


def names(text: str) -> tuple[str, ...]:
    """Words between commas, each once."""
    return tuple(dict.fromkeys(word.strip() for word in text.split(",") if word.strip()))


def are_checks(text: str) -> bool:
    """Whether a word can only mean checks, and not a scene."""
    return all(word.isdecimal() or word in CHECKS for word in text.split(","))


def checks(text: str) -> tuple[int | str, ...]:
    """Checks: elements to a beam, "nonlinear", "solid"."""
    asked = [word if word in CHECKS else at_least(1, MOST_ELEMENTS)(word) for word in text.split(",")]
    if sum(isinstance(check, int) for check in asked) > 1:
        raise OptionError(f"expected one number of elements, not {text!r}")
    return tuple(asked)


def speeds(text: str) -> tuple[float, float, int]:
    """Two speeds [rad/s or m/s] and a count."""
    from kinelast.scene.quantities import Speed

    try:
        low, high, count = text.split(":")
        first, last = (float(Speed.read(_bare(word))) for word in (low, high))
        if not 0 < first < last or not 2 <= int(count) <= MOST_SPEEDS:
            raise ValueError
        return first, last, int(count)
    except ValueError:
        told = 'two speeds above 0, the greater one last, and how many, as in "20 rad/s : 200 rad/s : 100"'
        raise OptionError(f"expected {told}, not {text!r}") from None


def _bare(word: str) -> str | float:
    try:
        return float(word)
    except ValueError:
        return word.strip()


def share(text: str) -> float:
    """A share, also in per cent."""
    from kinelast.scene.quantities import Share

    try:
        return float(Share.read(text if text.endswith("%") else float(text)))
    except ValueError:
        raise OptionError(f'expected a share, as in "2 %" or 0.02, not {text!r}') from None


def size(text: str) -> tuple[int, int]:
    """Width and height in pixels."""
    try:
        width, height = (int(word) for word in text.lower().split("x"))
        if min(width, height) < 160 or max(width, height) > MOST_PIXELS or width % 2 or height % 2:
            raise ValueError
    except ValueError:
        told = f'two even numbers of pixels from 160 to {MOST_PIXELS}, as in "1920x1080"'
        raise OptionError(f"expected {told}, not {text!r}") from None
    return width, height


def colour(text: str) -> str:
    """A colour that pictures know."""
    from animations import colour

    try:
        colour(text)
    except ValueError as error:
        raise OptionError(str(error)) from None
    return text


def shown(text: str) -> tuple[str, ...]:
    """Names of the things shown in a picture besides the mechanism."""
    from animations import SHOWN

    words = () if text.strip() == "none" else names(text)
    for word in words:
        if word not in SHOWN:
            raise OptionError(f"{word!r} cannot be shown: choose from none, {', '.join(SHOWN)}")
    return words


def diagrams(text: str) -> tuple[str, ...]:
    """Names of diagrams that there are."""
    from animations import DIAGRAMS
    from elastic import FIELDS
    from kinelast.scene.error import likely

    asked = names(text)
    for name in asked:
        if name not in (*DIAGRAMS, *FIELDS):
            near = likely(name, DIAGRAMS).partition("; there is")[0]  # all are listed anyhow
            raise OptionError(f'there is no diagram "{name}"{near}; all: {", ".join(DIAGRAMS)}')
    return asked
