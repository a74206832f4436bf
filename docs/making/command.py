"""Reference of the command: option, value, default, meaning and files, from the request classes."""

from rows import row

from kinelast.cli.terminal import EPILOG
from kinelast.tasks import Option
from kinelast.tasks.request import GROUPS, Batch, Request, options_of

HEAD = "| option | value | default | meaning | writes |\n| --- | --- | --- | --- | --- |\n"
TITLES = {"scene": "Scene", "checks": "Checks", "pictures": "Pictures", "designs": "Designs", "running": "Running"}


def page() -> str:
    """Return the page of all options."""
    known = options_of(Batch, Request)
    parts = [
        "# Options of the command\n\n`deflection-report SCENE ... [options]`, or `python -m kinelast`. "
        "`deflection-report --help` prints the same.\n"
    ]
    for group in GROUPS:
        rows = [_row(option) for option in known.values() if option.group == group]
        parts.append(f"## {TITLES[group]}\n\n{HEAD}{''.join(rows)}")
    status, _, examples = EPILOG.partition("examples:")
    statuses = status.strip().removeprefix("exit status: ").replace("\n", " ")
    lines = "\n".join(line.strip() for line in examples.strip().splitlines())
    return "\n".join([*parts, f"## Exit status\n\n{statuses}.\n", f"## Examples\n\n```\n{lines}\n```\n"])


def _row(option: Option) -> str:
    shown = "`SCENE ...`" if option.flags == ("scenes",) else ", ".join(f"`{flag}`" for flag in option.flags)
    value = " or ".join(f"`{each}`" for each in option.choices) if option.choices else f"`{option.metavar}`"
    value = value if option.choices or option.metavar else ""
    meaning, _, default_words = (
        option.help.removesuffix("]").partition(" [") if option.help.endswith("]") else (option.help, "", "")
    )
    default_words = default_words or (f"`{option.default}`" if option.default else "")
    cells = (shown, value + (", repeatable" if option.many else ""), default_words, meaning,
             ", ".join(f"`{file}`" for file in option.writes))  # fmt: skip
    return row(cells)
