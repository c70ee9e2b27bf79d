"""A family: all that a cause can do, as blocks of columns over a run's inputs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from fogml.gap.families.places import Scene
from fogml.gap.families.rows import Rows
from fogml.runs.run import FloatArray


class Block(NamedTuple):
    """One member of a family, its few shapes given: columns of independent coefficients.

    ``columns`` [deg/h per unit] have shape (m, k), ``shape`` says which member, ``weight`` how likely it is.
    Of a ``positive`` one physics gives the first column's sign.
    """

    columns: FloatArray
    shape: Mapping[str, Any] = {}
    weight: float = 1.0
    positive: bool = False


Build = Callable[[Rows, Scene, Mapping[str, float]], Iterator[Block]]
"""Blocks of one run, the same on every run of a scene, at the nominal constants."""


@dataclass(frozen=True)
class Family:
    """What a cause can do.

    Attributes
    ----------
    id
        The effect's; of an unknown cause what it looks like.
    kind
        ``known`` may be named, ``unknown`` and ``plant`` may not; what is ``left_out`` by the user
        takes no part, and is asked whether it looks like what is named.
    build
        Its blocks on a run.
    words
        What it looks like, of an unknown.
    drawn_per_run
        Whether each run draws its coefficients anew.
    place
        Where it acts, for words.
    largest
        Usual most of a coefficient, in its unit, where no card says it.
    """

    id: str
    kind: Literal["known", "unknown", "plant", "left_out"]
    build: Build
    words: str = ""
    drawn_per_run: bool = False
    place: str = ""
    largest: float = math.inf


def column_block(*columns: FloatArray, positive: bool = False, **shape: Any) -> Block:
    """A block of columns of shape (m,) each."""
    return Block(np.column_stack(columns), shape, positive=positive)
