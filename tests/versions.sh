#!/usr/bin/env bash
# The suite with the oldest dependencies that pyproject.toml allows, and with the newest Python and dependencies:
# tests/versions.sh [PYTHON FOR THE OLDEST] [PYTHON FOR THE NEWEST], each in a virtual environment of its own in build/.
set -euo pipefail
cd "$(dirname "$0")/.."
export PYTHONDONTWRITEBYTECODE=1 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

tried() { # NAME PYTHON [CONSTRAINTS]: installs and tests
    local place="build/versions/$1"
    rm -rf "$place"
    "$2" -m venv "$place"
    "$place/bin/pip" install --quiet ${3:+--constraint "$3"} --editable ".[test]"
    echo "+ $1: $("$place/bin/python" --version), $("$place/bin/pip" list 2>/dev/null | grep -ciE '^[a-z]') packages"
    "$place/bin/python" -m pytest -q -p no:cacheprovider
}

mkdir -p build/versions
"${1:-python3.11}" - >build/versions/oldest.txt <<'PYTHON'
import re
import tomllib

with open("pyproject.toml", "rb") as file:
    project = tomllib.load(file)["project"]
for wanted in (*project["dependencies"], *project["optional-dependencies"]["test"]):
    print(re.sub(r"\[.*?\]", "", wanted).replace(">=", "=="))
PYTHON
tried oldest "${1:-python3.11}" build/versions/oldest.txt
tried newest "${2:-python3.13}"
