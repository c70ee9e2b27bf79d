"""A kind of unknown as columns of each run, and the series that such columns are made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fogml.gap.observation import Observation
from fogml.runs.run import FloatArray
from fogml.twin.memory import Memory

EDGES_S = (30.0, 120.0, 600.0, 2400.0)
"""Time constants of what a change of rate or of another input leaves [s]."""
BANDS_S = (30.0, 100.0, 300.0, 1000.0, 3000.0, 10000.0)
"""Time constants between which past temperatures are told apart [s]."""
Kind = tuple[str, str, list[FloatArray]]
"""A group's name, what it looks like, and its columns on each run."""


@dataclass(frozen=True)
class Group:
    """A kind of unknown.

    Attributes
    ----------
    name
        Of the kind.
    looks_like
        In plain words.
    columns
        For each run the columns [deg/h], shape (m, k); of no particular size.
    price
        What having looked for it in the data costs its evidence [nats].
    """

    name: str
    looks_like: str
    columns: tuple[FloatArray, ...]
    price: float = 0.0


def side_by_side(parts: Sequence[FloatArray]) -> tuple[FloatArray, ...]:
    """Columns of each run by itself, zero on the others, shape (m_r, all columns) each."""
    starts = np.cumsum([0, *(part.shape[1] for part in parts)])
    blocks = []
    for part, first in zip(parts, starts):
        block = np.zeros((len(part), int(starts[-1])))
        block[:, first : first + part.shape[1]] = part
        blocks.append(block)
    return tuple(blocks)


def lag(o: Observation, values: FloatArray, time_constant_s: float) -> FloatArray:
    """A first-order lag of a series of rows, shape (m,)."""
    return Memory().lag("lag", o.time, values, time_constant_s)


def temperature_rate(o: Observation, name: str = "T") -> FloatArray:
    """Rate of a temperature over a minute or so [degC/min], shape (m,)."""
    # Of readings as they are the nominal replay holds the noise as well.
    return 60.0 * (o.smooth(name) - lag(o, o.smooth(name), 100.0)) / 100.0


def shared_differences(observations: Sequence[Observation]) -> list[str]:
    """Temperatures besides the leading one that every run has, for their differences from it."""
    held = [_differences(o) for o in observations]
    return [name for name in held[0] if all(name in names for names in held)]


def _differences(o: Observation) -> list[str]:
    names = ("T_out", "T_case", "T_electronics", "T_chamber")
    held = [name for name in names if name in o.run.columns]
    if "T_out" not in held and "T2" in o.run.columns:
        held.insert(0, "T_out")
    return held
