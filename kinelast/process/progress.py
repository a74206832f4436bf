"""Progress of a run: the listener that long work reports to."""

from __future__ import annotations


class Progress:
    """A listener who keeps it to himself; the command's shows a bar, or prints a line now and then."""

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Hear the stage of a run, how much of it is done, and how much is to be done."""

    def tell(self, sentence: str) -> None:
        """Hear a sentence for the user, on how long something takes or on kept results."""

    def within(self, name: str) -> Progress:
        """A listener to a part of the work, that hears its stages under a name."""
        return _Part(self, name)


class _Part(Progress):
    def __init__(self, whole: Progress, name: str) -> None:
        self._whole, self._name = whole, name

    def __call__(self, stage: str, done: int, total: int) -> None:
        self._whole(f"{self._name}: {stage}", done, total)

    def tell(self, sentence: str) -> None:
        self._whole.tell(f"{self._name}: {sentence}")


SILENT = Progress()
