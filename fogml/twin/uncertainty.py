"""What is not known of a twin: the covariance of its parameters, and effects that may act."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.signals.distributions import root_of


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
        if matrix.shape != (count, count) or not np.isfinite(matrix).all():
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
        off = root_of(self.covariance) @ rng.standard_normal(len(self.names))
        return dict(zip(self.names, off.tolist()))

    def without(self, *starts: str) -> Uncertainty:
        """That of the parameters whose names don't begin so: the rows and columns of the others go."""
        kept = [number for number, name in enumerate(self.names) if not name.startswith(starts)]
        names = tuple(self.names[number] for number in kept)
        return Uncertainty(names, self.covariance[np.ix_(kept, kept)], self.source)


@dataclass(frozen=True)
class Suspected:
    """An effect that may act, not sure enough to be on: its probability, amplitude and shape."""

    probability: float
    amplitude: float
    shape: Mapping[str, float]

    def __post_init__(self) -> None:
        if not 0.0 <= self.probability <= 1.0:
            raise InputError(f"probability is {self.probability:g}; it lies between 0 and 1")
