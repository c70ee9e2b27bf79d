"""A run made ready for a diagnosis: usable samples, averaged to a bounded number of rows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.gap.model import GyroModel, ModelOnRun
from fogml.runs.regimes import regimes
from fogml.runs.run import FloatArray, Run

LARGEST_ROWS = 8192
"""A run with more samples is averaged over blocks of neighbours down to about this many rows."""
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
    starts
        First sample of each block, shape (m,); blocks don't reach over gaps.
    """

    run: Run
    model: ModelOnRun
    width: int
    starts: NDArray[np.intp]

    def __len__(self) -> int:
        return len(self.starts)

    def averaged(self, values: FloatArray) -> FloatArray:
        """Block means of a series over the samples, shape (n,) to (m,)."""
        if self.width == 1:
            return values
        return np.asarray(np.add.reduceat(values, self.starts) / self.counts)

    @cached_property
    def counts(self) -> NDArray[np.intp]:
        """Samples in each block, shape (m,)."""
        return np.diff(self.starts, append=len(self.run))

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
    width = max(1, -(-len(run) // largest_rows))
    starts = np.concatenate([np.arange(part.start, part.stop, width) for part in run.stretches])
    try:
        on_run = model.on(run)
    except InputError as error:
        raise Unusable(str(error)) from None
    return Observation(run, on_run, width, starts)


def _usable(run: Run) -> NDArray[np.bool_]:
    """Samples with a number in every column."""
    usable = np.ones(len(run), dtype=np.bool_)
    for values in run.columns.values():
        usable &= np.isfinite(values)
    return usable
