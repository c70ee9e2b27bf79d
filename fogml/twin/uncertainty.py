"""What is not known of a twin: the covariance of its constants, effects that are suspected, and twins drawn.

In a twin file::

    uncertainty:
      source: diagnosis of a.csv and b.csv
      parameters: [nominal.b0, effects.thermal_hysteresis.amplitude, plant.case]
      covariance: [[1.0e-4, ...], ...]     # in the units in which the file states them
    suspected:
      glass_transition: {probability: 0.3, amplitude: {value: 0.1, unit: deg/h}, ...}
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fogml.errors import InputError
from fogml.runs.run import FloatArray


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Covariance of a twin's parameters about the values that it states.

    Attributes
    ----------
    names
        Of the parameters, by their places in a twin file.
    covariance
        In the units of the file, shape (k, k).
    source
        Where it comes from.
    """

    names: tuple[str, ...]
    covariance: FloatArray
    source: str = ""

    def __post_init__(self) -> None:
        matrix = np.asarray(self.covariance, dtype=np.float64)
        count = len(self.names)
        if len(set(self.names)) < count:
            raise InputError("uncertainty: a parameter is named twice")
        if matrix.shape != (count, count):
            raise InputError(
                f"uncertainty: a covariance of {count} rows of {count} numbers was expected, one for each "
                "parameter"
            )
        scale = np.sqrt(np.maximum(np.diag(matrix), 0.0))
        scale[scale == 0.0] = 1.0
        unit = matrix / np.outer(scale, scale)
        if not np.allclose(unit, unit.T, atol=1e-6) or np.linalg.eigvalsh(unit).min(initial=0.0) < -1e-6:
            raise InputError("uncertainty: the covariance is not one: symmetric, no variance below 0")
        object.__setattr__(self, "covariance", 0.5 * (matrix + matrix.T))

    def drawn(self, rng: np.random.Generator) -> dict[str, float]:
        """How far each parameter is from its value, in one draw."""
        values, vectors = np.linalg.eigh(self.covariance)
        off = vectors @ (np.sqrt(np.maximum(values, 0.0)) * rng.standard_normal(len(values)))
        return dict(zip(self.names, off.tolist()))


@dataclass(frozen=True)
class Suspected:
    """An effect that may act, not sure enough to be on: its probability, amplitude and shape."""

    probability: float
    amplitude: float
    shape: Mapping[str, float]

    def __post_init__(self) -> None:
        if not 0.0 <= self.probability <= 1.0:
            raise InputError(f"probability is {self.probability:g}; it lies between 0 and 1")
