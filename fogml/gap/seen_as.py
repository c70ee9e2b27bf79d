"""Effects that a diagnosis sees in another way than a simulation: lines of any phase, delays, steps."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fogml.runs.run import FloatArray
from fogml.signals.waves import sine
from fogml.twin.effect import Effect
from fogml.twin.quantities import Quantity

_PHASE = Quantity("phase", "deg", (0.0, 360.0), (0.0, 360.0), "at the first sample", default=0.0)


@dataclass(frozen=True)
class Line:
    """The sinusoidal noise as a candidate: its phase is another one on each run."""

    declared: Effect
    drawn_per_run: bool = True
    shape: tuple[Quantity, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "shape", (*self.declared.shape, _PHASE))

    def __getattr__(self, name: str) -> Any:
        return getattr(self.declared, name)


@dataclass(frozen=True)
class Delay:
    """A delay of the record as a candidate: its response is not in proportion to its size."""

    declared: Effect
    amplitudes: tuple[float, ...] = (-200.0, -60.0, -10.0, 0.1, 10.0, 60.0, 200.0)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.declared, name)


@dataclass(frozen=True)
class Steps:
    """Coarse steps of the sensors as a candidate: where it responds, the record itself shows them."""

    declared: Effect
    log_prior: float = math.log(18.0)
    """Of it over that of other candidates: as likely as not."""

    def __getattr__(self, name: str) -> Any:
        return getattr(self.declared, name)


AS_CANDIDATE = {"sinusoidal": Line, "logger_skew": Delay, "sensor_quantisation": Steps}
"""Effects that a diagnosis sees in another way than a simulation does."""


def line_response(shape: Mapping[str, float], time: FloatArray) -> FloatArray:
    """Response of a line per unit of its amplitude [deg/h], from the first sample on; shape (n,)."""
    if len(time) == 0:
        return np.zeros(0)
    return sine(shape["frequency"] * (time - time[0]) + shape.get("phase", 0.0) / 360.0)
