"""A run made ready for a diagnosis: usable samples, averaged to a bounded number of rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.gap.block_means import BlockMeans
from fogml.gap.model import GyroModel, ModelOnRun
from fogml.gap.readings import smoothed
from fogml.gap.row_responses import RowResponses
from fogml.runs.regimes import regimes
from fogml.runs.run import FloatArray, Run

LARGEST_ROWS = 8192
"""A run with more samples is averaged over blocks of neighbours down to about this many rows."""
ROW_S = 10.0
"""Rows need be no shorter: the fastest line of the catalogue has a period of five of them [s]."""
ENOUGH_ROWS = 2048
"""A short run's rows are shorter than that, until there are about so many."""
FEWEST_ROWS = 32
SHORTEST_S = 600.0
"""A run must last this long to say anything about temperature effects [s]."""


class Unusable(InputError):
    """A run that a diagnosis can't use; others may do."""


@dataclass(frozen=True, eq=False)
class Observation:
    """One run as a diagnosis sees it: m rows, each the mean over a block of samples.

    Attributes
    ----------
    run
        The run's usable samples, n.
    model
        The model with the run's inputs.
    width
        Samples of a block.
    starts, stops
        First sample of each block and the one after its last, shape (m,); blocks don't reach over
        gaps, nor into what the model's memory hides after one.
    """

    run: Run
    model: ModelOnRun
    width: int
    starts: NDArray[np.intp]
    stops: NDArray[np.intp]

    def __len__(self) -> int:
        return len(self.starts)

    def averaged(self, values: FloatArray) -> FloatArray:
        """Block means of a series over the samples, shape (n,) to (m,)."""
        if self.width == 1:
            return np.asarray(values[self.starts])
        return self._means(values)

    @cached_property
    def _means(self) -> BlockMeans:
        return BlockMeans(self.starts, self.stops, np.ones(len(self.run), dtype=np.intp))

    def response(self, id: str, shape: Mapping[str, float], constants: Mapping[str, float]) -> FloatArray:
        """Response of each row per unit of a candidate's amplitude [deg/h], shape (m,)."""
        return self.responses.of(id, shape, constants)

    @cached_property
    def responses(self) -> RowResponses:
        """How responses come to the rows."""
        return RowResponses(self)

    @cached_property
    def time(self) -> FloatArray:
        """Mean time of each row [s], shape (m,)."""
        return self.averaged(self.run.time)

    @cached_property
    def recorded(self) -> FloatArray:
        """Recorded output [deg/h], shape (m,)."""
        return self.averaged(self.run.gyro_deg_h)

    @cached_property
    def regime(self) -> NDArray[np.int8]:
        """Regime of each row's first sample, shape (m,); see `fogml.runs.regimes`."""
        return regimes(self.run).labels[self.starts]

    @cached_property
    def temperature(self) -> FloatArray:
        """Temperature T of each row [degC], shape (m,)."""
        return self.averaged(self.run.temperature())

    def smooth(self, name: str = "T") -> FloatArray:
        """A temperature of each row free of its readings' noise [degC], shape (m,)."""
        if name not in self._smooth:
            self._smooth[name] = self.averaged(smoothed(self.run, self.run.temperature(name)))
        return self._smooth[name]

    @cached_property
    def _smooth(self) -> dict[str, FloatArray]:
        return {}

    @property
    def row_s(self) -> float:
        """Averaging time of a row [s]."""
        return self.width * self.run.sample_s


def observe(run: Run, model: GyroModel, *, largest_rows: int = LARGEST_ROWS) -> Observation:
    """A run made ready.

    Raises
    ------
    Unusable
        If it is too short, holds no usable sample, or lacks what the model needs.
    """
    run = run.without_dropouts
    usable = _usable(run)
    if not usable.any():
        empty = [name for name, values in run.columns.items() if not np.isfinite(values).any()]
        what = f"column '{empty[0]}' holds no number" if empty else "no row has a number in every column"
        raise Unusable(f"{run.name}: {what}; a diagnosis needs time, gyro and temperatures side by side")
    if not usable.all():
        run = Run(
            name=run.name,
            columns={name: values[usable] for name, values in run.columns.items()},
            facts=run.facts,
            gyro_unit=run.gyro_unit,
        )
    if run.span_s < SHORTEST_S:
        raise Unusable(f"{run.name}: lasts {run.span_s:.0f} s; a diagnosis needs at least {SHORTEST_S:.0f} s")
    slow_enough = min(round(ROW_S / run.sample_s), len(run) // ENOUGH_ROWS)
    width = max(1, -(-len(run) // largest_rows), slow_enough)
    starts, stops = _blocks(run, width, model.memory_s)
    if len(starts) < FEWEST_ROWS:
        raise Unusable(f"{run.name}: its stretches between gaps are too short for a replay")
    try:
        on_run = model.on(run)
    except InputError as error:
        raise Unusable(str(error)) from None
    return Observation(run, on_run, width, starts, stops)


def _blocks(run: Run, width: int, memory_s: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Blocks of each stretch from where the model's memory reaches no further back than its start."""
    starts, stops = [], []
    for part in run.stretches:
        first = part.start + int(np.searchsorted(run.time[part], run.time[part.start] + memory_s))
        begins = np.arange(first, part.stop, width)
        starts.append(begins)
        stops.append(np.minimum(begins + width, part.stop))
    return np.concatenate(starts), np.concatenate(stops)


def _usable(run: Run) -> NDArray[np.bool_]:
    """Samples with a number in every column."""
    usable = np.ones(len(run), dtype=np.bool_)
    for values in run.columns.values():
        usable &= np.isfinite(values)
    return usable
