"""A small sweep to test with: closed forms that take no time, or fail where they are told to."""

from __future__ import annotations

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
    """Tip deflection of cantilevers under a load, whose length grows with the number: w = F l^3 / (3 EI)."""

    seconds: float = 0.0  # that a chunk takes
    fails: frozenset[int] = frozenset()  # first designs of chunks that fail
    kills: Path | None = None  # a file that is there until the first process has died
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
    """The steel four-bar at 12 positions with a [sweep], in a file."""
    text = file_text(shipped_scenes()["steel_four_bar"]).replace("positions = 360", "positions = 12")
    path.write_text(text + sweep)
    return path


IDENTITY = {"scene": "a word for its text", "options": {"positions": 72}}


def tree(folder):
    """All files of a folder with their bytes."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


class Printed(Progress):
    """Sentences, printed."""

    def tell(self, sentence):
        print(sentence, flush=True)


def main(folder, count, chunk, jobs, seconds, store):
    """A sweep in a process of its own, to be ended from outside; it goes on with what is there."""
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
