"""Many networks tuned in one tensor program.

A descent asks for its objective some hundreds of times, each a few products of small matrices.
Descents that run beside each other meet here: once all of them wait for a value, the values are
worked out together, networks of one shape as one batch, and every descent goes on with its own.
The descents themselves are those of single fits, so the networks are too.
"""

from __future__ import annotations

import threading
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from fogml.models.rbf.objective import Objective, Shape, Value

Result = TypeVar("Result")

_here = threading.local()
_MOST_VALUES = 1 << 27
# Numbers of one batch's design matrices: 1 GiB in float64.
_MOST_IN_CACHE = 1 << 16
# On a CPU a batch stays in the cache: 512 KiB.
_KEPT, _KEPT_IN_CACHE = 4, 128


@dataclass
class _Question:
    """A descent's objective and where it asks for its value."""

    objective: Objective
    shape: Shape
    value: Value | None = None
    error: BaseException | None = None

    @property
    def answered(self) -> bool:
        return self.value is not None or self.error is not None


class Together:
    """Where descents that run beside each other meet."""

    def __init__(self) -> None:
        self._meeting = threading.Condition()
        self._descending = 0
        self._waiting: list[_Question] = []
        self._stacks: dict[tuple[int, ...], Any] = {}

    @contextmanager
    def descending(self) -> Iterator[None]:
        """While this thread may ask for values, the others wait for it."""
        with self._meeting:
            self._descending += 1
        try:
            yield
        finally:
            with self._meeting:
                self._descending -= 1
                self._answer_if_all_wait()

    def value(self, objective: Objective, shape: Shape) -> Value:
        """The objective's value, once every other descent waits for one too."""
        question = _Question(objective, shape)
        with self._meeting:
            self._waiting.append(question)
            self._answer_if_all_wait()
            while not question.answered:
                self._meeting.wait()
        if question.error is not None:
            raise question.error
        assert question.value is not None
        return question.value

    def _answer_if_all_wait(self) -> None:
        if not self._waiting or len(self._waiting) < self._descending:
            return
        questions, self._waiting = self._waiting, []
        try:
            self._answer(questions)
        except BaseException as error:
            for question in questions:
                question.error = question.error or error
        self._meeting.notify_all()

    def _answer(self, questions: list[_Question]) -> None:
        from fogml.models.rbf.stacked import values_together

        groups = defaultdict(list)
        for question in questions:
            groups[(*question.objective.form, len(question.shape.centres))].append(question)
        for group in groups.values():
            first = group[0]
            per_network = first.objective.rows * (len(first.shape.centres) + first.objective.dimensions + 1)
            most = _MOST_IN_CACHE if first.objective.device_type == "cpu" else _MOST_VALUES
            step = max(1, most // per_network)
            for start in range(0, len(group), step):
                part = group[start : start + step]
                # In one order, so that what was stacked is found again.
                part.sort(key=lambda question: id(question.objective))
                stacked = self._stacked([question.objective for question in part])
                values = values_together(stacked, [question.shape for question in part])
                for question, value in zip(part, values, strict=True):
                    question.value = value

    def _stacked(self, objectives: list[Objective]) -> Any:
        from fogml.models.rbf.stacked import Stack

        key = tuple(id(objective) for objective in objectives)
        if key not in self._stacks:
            kept = _KEPT_IN_CACHE if objectives[0].device_type == "cpu" else _KEPT
            while len(self._stacks) >= kept:
                del self._stacks[next(iter(self._stacks))]
            self._stacks[key] = Stack(objectives)
        return self._stacks[key]


def joined() -> Together | None:
    """Where this thread's descents meet others; None where they run alone."""
    return getattr(_here, "together", None)


def fit_together(fits: Sequence[Callable[[], Result]]) -> list[Result]:
    """Call functions that fit networks, each in a thread, their descents sharing one tensor program.

    Parameters
    ----------
    fits
        Functions without arguments; what they fit does not depend on each other.

    Returns
    -------
    list
        What each returned, in order.

    Raises
    ------
    Exception
        The first that a function raised, once all have ended.
    """
    together = Together()
    results: list[Any] = [None] * len(fits)
    errors: list[BaseException] = []

    def run(place: int) -> None:
        _here.together = together
        try:
            results[place] = fits[place]()
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=run, args=(place,), daemon=True) for place in range(len(fits))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if errors:
        raise errors[0]
    return results
