"""The twin on means over blocks of samples: what a slow effect's response may be taken on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogml.gap.shapes import is_angle, is_line
from fogml.runs.run import FloatArray
from fogml.twin.effect import Effect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Grade
from fogml.twin.registry import effect

SLOW_STAGES = ("thermal", "rig", "bias", "scale_factor")
"""Where effects act that meet neither the output nor a sensor's reading."""
FAST = ("output", "slopes")
"""What may change from sample to sample."""
TURNING = ("rate", "angle")
"""What does so only on a table that turns."""


def shapes_to_compare(declared: Effect, inputs: Inputs, grade: Grade) -> tuple[Mapping[str, float], ...]:
    """Shapes at which an effect's response on means has to agree with the mean of its response.

    The usual one and those with one parameter at an end of its range. None for an effect that may
    change within a block, nor for one of a single shape, where there is nothing to gain.
    """
    fast = FAST if stands_still(inputs) else (*FAST, *TURNING)
    if declared.stage not in SLOW_STAGES or set(fast) & set(declared.needs):
        return ()
    if not declared.shape or any(is_line(q) and q.unit in ("s", "Hz") for q in declared.shape):
        return ()
    usual = declared.default_shape(grade)
    shapes = [usual]
    for quantity in declared.shape:
        ends = (usual[quantity.name] + 90.0,) if is_angle(quantity) else quantity.range(grade)
        shapes += [usual | {quantity.name: end} for end in ends]
    return tuple(shapes)


def stands_still(inputs: Inputs) -> bool:
    """Whether the table does not turn."""
    angle = inputs.drives.get("angle")
    return not np.any(inputs.table_rate) and (angle is None or not np.any(np.diff(angle)))


class TwinOnMeans:
    """Responses of effects on block means of a run's inputs.

    Parameters
    ----------
    inputs
        Inputs over the samples, n.
    starts
        First sample of each block, shape (b,); a block ends where the next one starts.
    """

    def __init__(self, inputs: Inputs, starts: NDArray[np.intp]) -> None:
        counts = np.diff(starts, append=len(inputs))

        def mean(values: FloatArray) -> FloatArray:
            return np.asarray(np.add.reduceat(values, starts) / counts)

        self._inputs = MeanInputs(
            time=mean(inputs.time),
            temperatures={name: mean(t) for name, t in inputs.temperatures.items()},
            table_rate=mean(inputs.table_rate),
            earth_deg_h=inputs.earth_deg_h,
            facts=inputs.facts,
            powered_on_s=inputs.powered_on_s,
            power_ons_s=inputs.power_ons_s,
            coil=inputs.coil,
            light=inputs.light,
            epoch_s=inputs.epoch_s,
            drives={name: mean(drive) for name, drive in inputs.drives.items()},
            rate_window_s=inputs.rate_window_s,
            hindsight=inputs.hindsight,
            mean_dT=lambda name: mean(inputs.afresh().dT(name)),
        )

    def response(self, id: str, shape: Mapping[str, float], constants: Mapping[str, float]) -> FloatArray:
        """Change of the output per unit of an effect's amplitude [deg/h], shape (b,)."""
        return np.asarray(effect(id).response(self._inputs.afresh(), **shape), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class MeanInputs(Inputs):
    """Inputs over blocks.

    Attributes
    ----------
    mean_dT
        Block means of a temperature's rate over the samples [degC/min], by its name, shape (b,): the
        window of rates may be shorter than a block.
    """

    mean_dT: Callable[[str], FloatArray] | None = None

    def dT(self, name: str = "T") -> FloatArray:
        """Rate of a temperature [degC/min], shape (b,)."""
        if self.mean_dT is None or self.place(name) is None:
            return super().dT(name)
        key = f"dT({self.place(name)})"
        if key not in self.cache:
            self.cache[key] = self.mean_dT(name)
        return self.cache[key]
