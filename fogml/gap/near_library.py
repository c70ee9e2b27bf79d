"""An unknown near to what is known: anything between the candidates, of no single one's form.

A ridge over the candidates' responses together. It competes with sets of two or three candidates that
would otherwise be named for an effect that none of them is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fogml.gap.group import Group
from fogml.gap.model import Candidate
from fogml.gap.observation import Observation
from fogml.gap.shapes import is_angle, is_line, usual_shape

NAME = "near_library"
LOW, HIGH = 0.15, 0.85
"""Places in a shape parameter's range at which responses are taken."""


def near_library(
    observations: Sequence[Observation],
    candidates: Mapping[str, Candidate],
    values: Mapping[str, float],
    grade: str,
) -> tuple[Group, ...]:
    """The group; none where no candidate acts on these runs.

    Parameters
    ----------
    observations
        The runs.
    candidates
        What may be named.
    values
        The constants at which candidates that act on inputs are taken.
    grade
        Whose ranges hold.
    """
    blocks = []
    for o in observations:
        columns = [
            o.response(id, shape, values)
            for id, candidate in candidates.items()
            for shape in _shapes(candidate, grade)
        ]
        blocks.append(np.column_stack(columns))
    size = np.sqrt(np.sum([np.sum(block**2, axis=0) for block in blocks], axis=0))
    used = size > 0.0
    if not used.any():
        return ()
    words = "is like a mixture of known effects, but of no single one's form"
    return (Group(NAME, words, tuple(block[:, used] / size[used] for block in blocks)),)


def _shapes(candidate: Candidate, grade: str) -> list[dict[str, float]]:
    """The usual shape and those with one parameter low or high; none for lines in time."""
    if any(is_line(q) for q in candidate.shape):
        return []
    usual = usual_shape(candidate, grade)
    shapes = [usual]
    for quantity in candidate.shape:
        low, high = quantity.range(grade)  # type: ignore[arg-type]
        if is_angle(quantity):
            ends = [usual[quantity.name] + 90.0]
        elif low > 0.0:
            ends = [float(low ** (1.0 - x) * high**x) for x in (LOW, HIGH)]
        else:
            ends = [float(low + x * (high - low)) for x in (LOW, HIGH)]
        shapes += [usual | {quantity.name: value} for value in ends]
    return shapes
