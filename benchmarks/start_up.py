"""From the shell: whole processes of the command, and what their imports cost."""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from typing import Any

import measuring

REPORT = "from kinelast.cli.command import main; import sys; sys.exit(main(sys.argv[1:]))"
DEEP = 2


WITH_BYTE_CODE = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
TRIES = 9


def run(*arguments: str, options: Sequence[str] = ()) -> subprocess.CompletedProcess[str]:
    call = [sys.executable, *options, "-c", *arguments]
    return subprocess.run(call, capture_output=True, text=True, check=True, timeout=300, env=WITH_BYTE_CODE)


def processor_seconds(arguments: Sequence[str]) -> float:
    """Least processor time of a process among some tries: others who use the machine make it more."""
    used = []
    for _ in range(TRIES):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        run(*arguments)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(used)


def commands(folder: str) -> dict[str, list[str]]:
    scene = ["steel_four_bar", "-o", folder, "--quiet"]
    return {
        "python -c pass": ["pass"],
        "import numpy": ["import numpy"],
        "import elastic": ["import elastic"],
        "deflection-report --help": [REPORT, "--help"],
        "deflection-report --list": [REPORT, "--list"],
        "deflection-report steel_four_bar": [REPORT, *scene],
        "... --theory quasi-static": [REPORT, *scene, "--theory", "quasi-static"],
        "deflection-report utenov_four_bar": [REPORT, "utenov_four_bar", *scene[1:]],
        "... utenov_four_bar --theory quasi-static": [
            REPORT,
            "utenov_four_bar",
            *scene[1:],
            "--theory",
            "quasi-static",
        ],
        "... --fields": [REPORT, *scene, "--fields"],
        "... --check": [REPORT, *scene, "--check"],
        "... --mesh": [REPORT, *scene, "--mesh", "--positions", "36"],
        "... --animate deflection --frames 24": [REPORT, *scene, "--animate", "deflection", "--frames", "24"],
    }


def imports(arguments: Sequence[str]) -> list[dict[str, Any]]:
    """Packages by what they take, those that they import included."""
    lines = run(*arguments, options=["-X", "importtime"]).stderr.splitlines()
    found = {}
    for line in lines:
        match = re.match(r"import time:\s+(\d+) \|\s+(\d+) \|(\s+)(\S+)", line)
        if match and "." not in match[4] and int(match[2]) > 2000:
            found[match[4]] = int(match[2]) / 1000
    return [{"package": name, "ms": time} for name, time in sorted(found.items(), key=lambda item: -item[1])[:14]]


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        rows = []
        for name, arguments in commands(folder).items():
            try:
                time = measuring.seconds(lambda arguments=arguments: run(*arguments), 0.0)
            except subprocess.CalledProcessError as failure:
                words = failure.stderr.strip().splitlines()
                words = words or ["failed"]
                rows.append({"process": name, "s": None, "processor [s]": None, "note": words[-1][:60]})
                continue
            rows.append({"process": name, "s": time, "processor [s]": processor_seconds(arguments), "note": ""})
        command = commands(folder)
        tables = {
            "processes": rows,
            "imports of --help": imports(command["deflection-report --help"]),
            "imports of a report": imports(command["deflection-report steel_four_bar"]),
            "imports of a report with --check": imports(command["... --check"]),
        }
    notes = [
        "medians of five processes, the files warm in the system's cache, byte code written",
        f"processor time: the least of {TRIES}",
    ]
    measuring.report("start_up", "Start-up: what a command costs as a whole process", tables, notes)
    with measuring.figure("start_up", size=(8, 4)) as axis:
        timed = [row for row in rows if row["s"]][::-1]
        axis.barh([row["process"] for row in timed], [row["s"] for row in timed])
        axis.set(xlabel="seconds, whole process")


if __name__ == "__main__":
    main()
