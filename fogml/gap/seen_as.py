"""Effects that a diagnosis sees in another way than a simulation: lines of any phase, ramps, delays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import Effect
from fogml.twin.quantities import Quantity

RESPONDING = ("rate_ramp", "sinusoidal")
"""Noise effects with a response; the others show in the noise alone."""
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


AS_CANDIDATE = {"sinusoidal": Line, "logger_skew": Delay}
"""Effects that a diagnosis sees in another way than a simulation does."""


def noise_response(id: str, shape: Mapping[str, float], time: FloatArray) -> FloatArray:
    """Response of a noise effect per unit of its amplitude [deg/h], shape (n,); zeros where it has none."""
    if len(time) == 0:
        return np.zeros(0)
    since = time - time[0]
    if id == "rate_ramp":
        return since / 3600.0
    if id == "sinusoidal":
        angle = 2.0 * np.pi * shape["frequency"] * since + np.radians(shape.get("phase", 0.0))
        return np.asarray(np.sin(angle))
    return np.zeros(len(time))
