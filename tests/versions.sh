#!/usr/bin/env bash
# The suite with the oldest dependencies that pyproject.toml allows, and with the newest on every newer Python that is there:
# tests/versions.sh [PYTHON FOR THE OLDEST] [PYTHONS FOR THE NEWEST], each in a virtual environment of its own in build/.
set -euo pipefail
cd "$(dirname "$0")/.."
export PYTHONDONTWRITEBYTECODE=1 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

tried() { # NAME PYTHON [OLDEST]: installs all but the linters, and tests
    local place="build/versions/$1" wanted
    rm -rf "$place"
    "$2" -m venv "$place"
    mapfile -t wanted < <("$2" - "${3:-}" <<'PYTHON'
import sys
import tomllib

with open("pyproject.toml", "rb") as file:
    project = tomllib.load(file)["project"]
linters = ("ruff", "mypy", "import-linter")
tests = [each for each in project["optional-dependencies"]["test"] if not each.startswith(linters)]
for each in (*project["dependencies"], *tests):
    print(each.replace(">=", "==") if sys.argv[1] else each)
PYTHON
    )
    "$place/bin/pip" install --quiet "${wanted[@]}"
    "$place/bin/pip" install --quiet --editable .
    echo "+ $1: $("$place/bin/python" --version), ${wanted[*]}"
    "$place/bin/python" -m pytest -q -n auto -p no:cacheprovider || failed+=("$1")
}

failed=()
tried oldest "${1:-python3.11}" oldest
for python in ${2:-python3.12 python3.13 python3.14}; do
    if "$python" --version > /dev/null 2>&1; then tried "newest-${python##*/}" "$python"; else echo "not there: $python"; fi
done
echo "failed: ${failed[*]:-none}"
[ ${#failed[@]} = 0 ]
