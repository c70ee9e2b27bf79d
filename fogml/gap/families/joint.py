"""Covariance of constants and causes together, in the terms of a twin file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fogml.gap.families.inference import Inference
from fogml.gap.families.linear_gaussian import Posterior
from fogml.gap.families.own_simulator import OwnEffect
from fogml.gap.model import EffectValue
from fogml.runs.run import FloatArray
from fogml.twin.effect import Effect
from fogml.twin.nominal import NAMES
from fogml.twin.uncertainty import Uncertainty

STEP = 0.02
"""Shapes are moved by this share of their range for the slope of a response."""
WIDE = 10.0
"""Prior standard deviation of an amplitude over its usual most, or its value: as good as free."""


def joint_uncertainty(found: Inference, values: Sequence[EffectValue]) -> Uncertainty | None:
    """Covariance of the nominal constants and of amplitudes and shapes about their values.

    Linear about them, given the noise; amplitudes also by what no form is known more exactly than. None of a
    laboratory's own simulator.
    """
    setting, held = found.setting, found.field
    if tuple(c.name for c in setting.constants) != NAMES:
        return None
    names = [f"nominal.{name}" for name in NAMES]
    scales, columns, extra = list(setting.deviations), [], dict[int, float]()
    fitted = setting.scene.runs[: setting.scene.fitted]
    for value in values:
        declared = setting.scene.candidates[value.id]
        if isinstance(declared, OwnEffect) or declared.drawn_per_run or declared.family == "line":
            continue
        _, most = declared.amplitude.range(setting.scene.grade)  # type: ignore[arg-type]
        extra[len(names)] = setting.priors.form_error * value.amplitude
        names.append(f"effects.{value.id}.amplitude")
        scales.append(WIDE * max(abs(value.amplitude), most))
        columns.append([r.response(declared, value.shape, None, setting.values) for r in fitted])
        for q in declared.shape:
            low, high = q.range(setting.scene.grade)  # type: ignore[arg-type]
            if high > low:
                names.append(f"effects.{value.id}.{q.name}")
                scales.append(0.5 * (high - low))
                columns.append(_slope(found, declared, value, q.name, STEP * (high - low), q.limits))
    count = len(NAMES)
    design = held.fixed
    if columns:
        by_run = [np.column_stack(parts) for parts in zip(*columns)]
        white = held.whitening.stacked(by_run) * np.array(scales[count:])
        design = np.concatenate([held.fixed, white], axis=1)
    covariance = Posterior.of(design, held.base.data).covariance
    kept = [*range(count), *range(held.fixed.shape[1], design.shape[1])]
    matrix = covariance[np.ix_(kept, kept)] * np.outer(scales, scales)
    for place, sd in extra.items():
        matrix[place, place] += sd**2
    return Uncertainty(tuple(names), matrix)


def _slope(
    found: Inference,
    declared: Effect,
    value: EffectValue,
    name: str,
    step: float,
    limits: tuple[float, float],
) -> list[FloatArray]:
    """Change of each fit run with a shape parameter [deg/h per its unit], by central differences."""
    runs = found.setting.scene.runs[: found.setting.scene.fitted]
    ends = [float(np.clip(value.shape[name] + by, *limits)) for by in (-step, step)]

    def response(at: float) -> list[FloatArray]:
        shape: Mapping[str, float] = {**value.shape, name: at}
        return [r.response(declared, shape, None, found.setting.values) for r in runs]

    low, high = (response(at) for at in ends)
    width = max(ends[1] - ends[0], 1e-12)
    return [value.amplitude * (b - a) / width for a, b in zip(low, high)]
