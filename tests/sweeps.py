"""A small sweep in closed form that can be slow, fail or be killed."""

import os
import signal
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from kinelast import shipped_scenes
from kinelast.scene.text import file_text
from kinelast.tasks.progress import Progress


@dataclass(frozen=True)
class Parabolas:
    """Tip deflection of cantilevers of increasing length, w = F l^3 / (3 EI)."""

    seconds: float = 0.0  # duration of a chunk
    fails: frozenset[int] = frozenset()  # first designs of the chunks that fail
    kills: Path | None = None  # exists until the first process is killed
    units: dict[str, str] = field(default_factory=lambda: {"length": "m", "tip": "m"})

    def __call__(self, first, last):
        time.sleep(self.seconds)
        if first in self.fails:
            raise ValueError(f"no design {first}")
        if self.kills is not None and self.kills.exists() and first > 0:
            self.kills.unlink()
            os.kill(os.getpid(), signal.SIGKILL)
        number = np.arange(first, last)
        length = 0.1 + 1e-3 * number
        tip = np.where(number % 7 == 3, np.nan, 20.0 * length**3 / (3 * 37.8))
        reasons = ['does not reach, at "B"' if one % 7 == 3 else "" for one in number]
        return {"length": length, "tip": tip, "class": number % 3}, reasons


def swept_scene(path, sweep):
    """Write the steel four-bar with 12 positions and a [sweep] to a file."""
    text = file_text(shipped_scenes()["steel_four_bar"]).replace("positions = 360", "positions = 12")
    path.write_text(text + sweep)
    return path


IDENTITY = {"scene": "a word for its text", "options": {"positions": 72}}


def tree(folder):
    """Return all files of a folder with their bytes."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


class Printed(Progress):
    """Print progress as sentences."""

    def tell(self, sentence):
        print(sentence, flush=True)


def main(folder, count, chunk, jobs, seconds, store):
    """Run or resume a sweep in this process, so that a test can end it from outside."""
    from kinelast.sweep import store as stores
    from kinelast.sweep.running import run_plan
    from kinelast.tasks.progress import stoppable

    stores.MAX_CSV = 10**9 if store == "csv" else 0
    with stoppable():
        run_plan(
            int(count),
            Parabolas(float(seconds)),
            Path(folder),
            IDENTITY,
            int(chunk),
            jobs=int(jobs),
            progress=Printed(),
            resume=True,
        )


if __name__ == "__main__":
    main(*sys.argv[1:])
