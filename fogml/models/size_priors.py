"""What sizes a mixed-effects drift model takes for granted."""

from __future__ import annotations

from dataclasses import dataclass

from fogml.settings_check import check_numbers


@dataclass(frozen=True)
class SizePriors:
    """Log-normal priors of the sizes, as shares of the standard deviation of the training averages.

    Attributes
    ----------
    linear, curved, other
        Medians for what is linear in a signal, its higher powers, and every other group of features: of a
        drift over temperature most is linear, a third curved, and rates, gradients and memories hold a
        tenth each (engineering values; tried on simulated units of the shipped tactical twin).
    shift, slow, fast
        Medians of a run's own shift, slow and faster drift.
    noise
        Median of the white noise of the averages.
    spread, own_spread, noise_spread
        Standard deviation of the logarithm of each size, of those of a run's own parts, and of the noise's: a
        factor of 2.2 either way, and of 20.
    offset
        Standard deviation of the constant; wide, so that it is free.
    """

    linear: float = 1.0
    curved: float = 0.3
    other: float = 0.1
    shift: float = 0.3
    slow: float = 0.2
    fast: float = 0.1
    noise: float = 0.05
    spread: float = 0.8
    own_spread: float = 0.8
    noise_spread: float = 3.0
    offset: float = 5.0

    def __post_init__(self) -> None:
        check_numbers(self)
