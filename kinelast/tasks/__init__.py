"""Command-line options: definition of an option, and functions that convert texts to values."""

from collections.abc import Callable, Sequence
from typing import Any

from msgspec import Struct

CHECKS = ("nonlinear", "solid")
ELEMENTS = 16  # default number of elements per beam for --check
MAX_ELEMENTS = 4096
MAX_PIXELS = 7680
MAX_SPEEDS = 10_000


class OptionError(ValueError):
    """Error for an option with an invalid value."""


class Option(Struct, frozen=True):
    """A command-line option, stored in the annotation of the field that holds its value.

    An option without `metavar` and `choices` is a switch.

    Attributes
    ----------
    group
        Heading under which the help lists the option.
    help
        Description.
    metavar
        Placeholder for the value in the help, such as "N". The placeholder of a switch is empty.
    default
        Value of the option if the command line does not contain the option. `options_of` takes it from the field.
    read
        Function that converts the text of an argument to the value. The function raises `OptionError` for an invalid
        text.
    flags
        Flags (default: "--" and the name of the field).
    choices
        Allowed values; empty if all values are allowed.
    belongs
        Name of another option that must be given together with the option; empty if there is none.
    bare
        Value of the option if its flag is given without a value.
    many
        True if the option can be repeated. The value of the option is then a tuple.
    writes
        Names of the files and folders that the option adds to the results of a scene.
    """

    group: str
    help: str
    metavar: str = ""
    default: Any = None
    read: Callable[[str], Any] = str
    flags: tuple[str, ...] = ()
    choices: Sequence[str] = ()
    belongs: str = ""
    bare: Any = None
    many: bool = False
    writes: tuple[str, ...] = ()

    @property
    def takes_value(self) -> bool:
        """True if the option takes a value, False if it is a switch."""
        return bool(self.metavar or self.choices)


def at_least(least: int, most: int | None = None) -> Callable[[str], int]:
    """Return a function that reads a whole number from `least` to `most` (default: no upper bound)."""

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
    """Read a positive number."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise OptionError(f"expected a number above 0, not {text!r}")
    return value


def names(text: str) -> tuple[str, ...]:
    """Split a text at commas, and remove duplicates."""
    return tuple(dict.fromkeys(word.strip() for word in text.split(",") if word.strip()))


def are_checks(text: str) -> bool:
    """Return True if the text after the option --check is a list of checks, and not the name of a scene."""
    return all(word.isdecimal() or word in CHECKS for word in text.split(","))


def checks(text: str) -> tuple[int | str, ...]:
    """Read a list of checks. Each check is "nonlinear", "solid" or the number of finite elements per beam."""
    requested = [word if word in CHECKS else at_least(1, MAX_ELEMENTS)(word) for word in text.split(",")]
    if sum(isinstance(check, int) for check in requested) > 1:
        raise OptionError(f"expected one number of elements, not {text!r}")
    return tuple(requested)


def speeds(text: str) -> tuple[float, float, int, str]:
    """Read the lowest speed, the highest speed and the number of speeds from a text such as "20 rad/s:200 rad/s:9".

    Returns
    -------
    Both speeds [rad/s or m/s], the number of speeds, and the unit of the highest speed as written.
    """
    from kinelast.values.quantities import Speed

    try:
        low, high, count = text.split(":")
        first, last = (Speed.read(_number_or_text(word)) for word in (low, high))
        if not 0 < first < last or not 2 <= int(count) <= MAX_SPEEDS:
            raise ValueError
        return float(first), float(last), int(count), last.written
    except ValueError:
        expected = 'two increasing speeds above 0 and a number of speeds, as in "20 rad/s : 200 rad/s : 100"'
        raise OptionError(f"expected {expected}, not {text!r}") from None


def _number_or_text(word: str) -> str | float:
    try:
        return float(word)
    except ValueError:
        return word.strip()


def share(text: str) -> float:
    """Read a fraction or a percentage, such as "0.02" or "2 %"."""
    from kinelast.values.quantities import Share

    try:
        return float(Share.read(text if text.endswith("%") else float(text)))
    except ValueError:
        raise OptionError(f'expected a share, as in "2 %" or 0.02, not {text!r}') from None


def size(text: str) -> tuple[int, int]:
    """Read width and height in pixels."""
    try:
        width, height = (int(word) for word in text.lower().split("x"))
        if min(width, height) < 160 or max(width, height) > MAX_PIXELS or width % 2 or height % 2:
            raise ValueError
    except ValueError:
        expected = f'two even numbers of pixels from 160 to {MAX_PIXELS}, as in "1920x1080"'
        raise OptionError(f"expected {expected}, not {text!r}") from None
    return width, height


def colour(text: str) -> str:
    """Return the name of a colour. Raise OptionError if there is no colour with this name."""
    from animations import colour

    try:
        colour(text)
    except ValueError as error:
        raise OptionError(str(error)) from None
    return text


def shown(text: str) -> tuple[str, ...]:
    """Read the names of the items that a picture shows in addition to the mechanism."""
    from animations import SHOWN

    words = () if text.strip() == "none" else names(text)
    for word in words:
        if word not in SHOWN:
            raise OptionError(f"{word!r} cannot be shown: choose from none, {', '.join(SHOWN)}")
    return words


def diagrams(text: str) -> tuple[str, ...]:
    """Read a list of diagrams."""
    from animations import DIAGRAMS
    from elastic import FIELDS
    from kinelast.values.error import likely

    requested = names(text)
    for name in requested:
        if name not in (*DIAGRAMS, *FIELDS):
            # cut the names from the advice, because the message below lists all names
            near = likely(name, DIAGRAMS).partition("; there is")[0]
            raise OptionError(f'there is no diagram "{name}"{near}; all: {", ".join(DIAGRAMS)}')
    return requested
