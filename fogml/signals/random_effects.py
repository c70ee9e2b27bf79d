"""Random effects: the mean of several units' values, each with its standard error, and how far they differ.

Values are normal about the mean with a variance between units and each one's own, both by restricted
likelihood (R. R. Corbeil & S. R. Searle, Technometrics 18, 1976).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from fogml.intervals import LEVEL
from fogml.signals.distributions import normal_ppf, student_ppf


@dataclass(frozen=True)
class RandomEffects:
    """Mean of n values with its standard error, and their standard deviation `between` units; NaN of one."""

    mean: float
    se: float
    between: float
    count: int

    def interval(self, level: float = 0.9) -> tuple[float, float]:
        """Where the mean lies with a probability; by Student's t of as many units, of one by its error."""
        tail = 0.5 + 0.5 * level
        reach = float(student_ppf(tail, self.count - 1) if self.count > 1 else normal_ppf(tail)) * self.se
        return self.mean - reach, self.mean + reach

    def next_value(self, level: float = LEVEL) -> tuple[float, float]:
        """Where the next unit's true value lies with a probability; by Student's t of as many units."""
        reach = float(student_ppf(0.5 + 0.5 * level, self.count - 1)) * float(np.hypot(self.se, self.between))
        return self.mean - reach, self.mean + reach


def random_effects(values: ArrayLike, errors: ArrayLike) -> RandomEffects:
    """Mean and deviation between units of n values with standard errors, by restricted likelihood."""
    x, se = np.asarray(values, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    if len(x) == 1:
        return RandomEffects(float(x[0]), float(se[0]), float("nan"), 1)
    if not np.all(se > 0.0):
        # One that is told exactly: the values' own deviation is all there is.
        deviation = float(x.std(ddof=1))
        return RandomEffects(float(x.mean()), deviation / np.sqrt(len(x)), deviation, len(x))

    def mean_of(variance: float) -> tuple[float, float]:
        weights = 1.0 / (variance + se**2)
        return float(weights @ x / weights.sum()), float(weights.sum())

    def negative(variance: float) -> float:
        mean, total = mean_of(variance)
        spread = variance + se**2
        return 0.5 * float(np.sum(np.log(spread) + (x - mean) ** 2 / spread)) + 0.5 * np.log(total)

    # No deviation is larger than that of the values themselves, by a margin for few.
    top = 10.0 * float(np.var(x, ddof=1)) + 1e-300
    found = minimize_scalar(lambda root: negative(root**2), bounds=(0.0, np.sqrt(top)), method="bounded")
    variance = float(found.x**2) if found.fun < negative(0.0) else 0.0
    mean, total = mean_of(variance)
    return RandomEffects(mean, float(1.0 / np.sqrt(total)), float(np.sqrt(variance)), len(x))
