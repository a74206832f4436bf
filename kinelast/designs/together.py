"""Several searches at once, with their questions answered in one call for all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue
from typing import Any, TypeVar

Question = TypeVar("Question")
Answer = TypeVar("Answer")
Result = TypeVar("Result")


def batched(
    jobs: Sequence[Callable[[Callable[[Question], Answer]], Result]],
    answers: Callable[[list[Question]], list[Answer]],
) -> list[Result]:
    """Results of jobs that run side by side.

    A job is a function of what it asks its questions by. When each job that has not ended has asked one, all are
    answered by one call of `answers`, in the caller's thread and in the jobs' order: who is quick and who is slow makes
    no difference. What a job or `answers` raises ends all.
    """
    if not jobs:
        return []
    asked: SimpleQueue[tuple[int, Any]] = SimpleQueue()
    replies: list[SimpleQueue[Any]] = [SimpleQueue() for _ in jobs]

    def run(number: int) -> Result:
        def ask(question: Question) -> Answer:
            asked.put((number, question))
            reply = replies[number].get()
            if isinstance(reply, _Stop):
                raise _StoppedError
            answer: Answer = reply
            return answer

        try:
            return jobs[number](ask)
        finally:
            asked.put((number, _DONE))

    with ThreadPoolExecutor(len(jobs)) as pool:
        running = [pool.submit(run, number) for number in range(len(jobs))]
        try:
            _serve(asked, replies, answers)
        except BaseException:
            for reply in replies:  # one that waits, or will ask once more
                reply.put(_Stop())
            raise
        return [each.result() for each in running]


class _Stop:
    """Instead of an answer: there are no more."""


class _StoppedError(Exception):
    """Ends a job that waits for an answer that will not come."""


_DONE = object()


def _serve(
    asked: SimpleQueue[tuple[int, Any]], replies: Sequence[SimpleQueue[Any]], answers: Callable[[list[Any]], list[Any]]
) -> None:
    """Answer questions until all jobs have ended."""
    waiting: dict[int, Any] = {}
    running = len(replies)
    while running:
        number, question = asked.get()
        if question is _DONE:
            running -= 1
        else:
            waiting[number] = question
        if waiting and len(waiting) == running:
            numbers = sorted(waiting)
            for each, answer in zip(numbers, answers([waiting[each] for each in numbers]), strict=True):
                replies[each].put(answer)
            waiting.clear()
