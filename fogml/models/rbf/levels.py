"""Training rows as a search sees them: averaged to some coarseness, standardised."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogml.models.rbf.blocks import AveragedRows
from fogml.models.rbf.objective import Objective
from fogml.models.rbf.stopping import Watch, held_out_rows

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]


@dataclass(frozen=True)
class Frame:
    """Mean and standard deviation of the inputs, shape (k,), and of the target."""

    shift: FloatArray
    scale: FloatArray
    target_shift: float
    target_scale: float

    @classmethod
    def of(cls, inputs: FloatArray, target: FloatArray) -> Frame:
        """The frame of training rows; what does not vary is left unscaled."""
        shift, scale = inputs.mean(axis=0), inputs.std(axis=0)
        scale = np.where(scale > 1e-12 * np.maximum(np.abs(shift), 1e-300), scale, 1.0)
        deviation = float(target.std())
        return cls(shift, scale, float(target.mean()), deviation if deviation > 0.0 else 1.0)


class Level:
    """Training rows averaged to some coarseness, standardised.

    Parameters
    ----------
    rows
        Averaged rows.
    frame
        Standardisation of inputs and target.
    seen
        Indices of the network's inputs.
    device, dtype
        Where torch works the objective out, and in what.
    """

    def __init__(self, rows: AveragedRows, frame: Frame, seen: IndexArray, device: str, dtype: str) -> None:
        inputs = (rows.inputs - frame.shift) / frame.scale
        self.linear = np.column_stack([inputs, np.ones(len(inputs))])
        self.inputs = np.ascontiguousarray(inputs[:, seen])
        self.target = (rows.target - frame.target_shift) / frame.target_scale
        self.in_time, self.per_row = rows.in_time, rows.per_row
        self._device, self._dtype = device, dtype

    def __len__(self) -> int:
        return len(self.target)

    def objective(self, evidence: bool, share: float) -> tuple[Objective, Watch | None]:
        """The objective, and what watches a descent where it is not the evidence."""
        fitted, held = held_out_rows(len(self), everything=evidence)
        rows = self.inputs[fitted], self.linear[fitted], self.target[fitted]
        objective = Objective(*rows, evidence=evidence, device=self._device, dtype=self._dtype)
        objective.share = share
        if evidence:
            return objective, None
        return objective, Watch(objective, self.inputs[held], self.linear[held], self.target[held])
