"""Completion scripts for shells. A script completes options, values of options, shipped scenes and files."""

from collections.abc import Sequence
from shlex import quote

from kinelast.tasks.request import Batch, Request, options_of

COMMANDS = ("kinelast", "deflection-report")
BASH = """\
_kinelast() {{
    local IFS=$'\\n' word="${{COMP_WORDS[COMP_CWORD]}}"
    case "${{COMP_WORDS[COMP_CWORD-1]}}" in
{choices}
    esac
    case "$word" in
        -*) COMPREPLY=($(compgen -W {flags} -- "$word")) ;;
        *) COMPREPLY=($(compgen -W {scenes} -- "$word") $(compgen -f -- "$word")) ;;
    esac
}}
complete -o filenames -F _kinelast {commands}"""


def script(shell: str, scenes: Sequence[str]) -> str:
    """Return the completion script for bash, zsh or fish.

    Parameters
    ----------
    scenes
        Names of the shipped scenes.
    """
    return _fish(scenes) if shell == "fish" else _bash(scenes, shell == "zsh")


def _options() -> list[tuple[str, str, Sequence[str], bool]]:
    """Return, for each flag, the flag, its help text, its choices, and True if the flag takes a value."""
    return [
        (flag, option.help, option.choices, option.takes_value)
        for option in options_of(Request, Batch).values()
        for flag in option.flags
        if flag.startswith("-")
    ]


def _bash(scenes: Sequence[str], in_zsh: bool) -> str:
    """Return the script for bash. In zsh, the same script runs with the compatibility functions of zsh for bash."""
    line = '        {}) COMPREPLY=($(compgen -W {} -- "$word")); return ;;'
    options = _options()
    text = BASH.format(
        choices="\n".join(line.format(flag, _lines(words)) for flag, _, words, _ in options if words),
        flags=_lines([flag for flag, *_ in options] + ["--help"]),
        scenes=_lines(scenes),
        commands=" ".join(COMMANDS),
    )
    return f"autoload -U +X compinit bashcompinit && compinit && bashcompinit\n{text}" if in_zsh else text


def _lines(words: Sequence[str]) -> str:
    return "$'" + "\\n".join(words) + "'"


def _fish(scenes: Sequence[str]) -> str:
    lines = []
    for command in COMMANDS:
        lines.append(f"complete -c {command} -a {quote(' '.join(scenes))} -d 'shipped scene'")
        for flag, words, choices, takes in _options():
            name = f"-l {flag[2:]}" if flag.startswith("--") else f"-s {flag[1:]}"
            value = f" -x -a {quote(' '.join(choices))}" if choices else " -r" if takes else ""
            lines.append(f"complete -c {command} {name}{value} -d {quote(words)}")
    return "\n".join(lines)
