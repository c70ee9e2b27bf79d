"""What the thermometers of training runs showed, as limits of what the same ones can show later on."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from fogml.arrays import FloatArray, IndexArray
from fogml.runs.columns import is_temperature
from fogml.runs.dropouts import RULE, DropoutRule
from fogml.runs.run import Run
from fogml.strict import Strict


@dataclass(frozen=True)
class LimitSettings:
    """How far beyond training runs a thermometer is believed.

    Attributes
    ----------
    rate_margin
        Times the fastest trained rate of temperature: chambers' fast ramps are up to three times those that
        models are trained on.
    least_rate_degC_s
        Fastest rate at least [degC/s]: 5 degC/min, what usual chambers do; training runs may be slower.
    averaging_s
        Rates are of averages so long [s]: a thermometer's noise makes none.
    step_margin
        Times the largest trained step between neighbours beyond what that rate does: the noise of months is
        larger than that of hours.
    least_step_degC
        Step at least [degC]: that of the coarsest thermometers in use, such as an LM75.
    """

    rate_margin: float = 3.0
    least_rate_degC_s: float = 5.0 / 60.0
    averaging_s: float = 60.0
    step_margin: float = 2.0
    least_step_degC: float = 0.5


LIMITS = LimitSettings()


class SavedLimits(Strict):
    """Limits that training sets, as files hold them."""

    jump_degC: float = Field(gt=0.0)
    rate_degC_s: float = Field(gt=0.0)


def saved_limits(rule: DropoutRule) -> SavedLimits:
    """The limits of a rule that training sets."""
    return SavedLimits(jump_degC=rule.jump_degC, rate_degC_s=rule.rate_degC_s)


def rule_of(saved: SavedLimits) -> DropoutRule:
    """The rule with such limits."""
    return DropoutRule(jump_degC=saved.jump_degC, rate_degC_s=saved.rate_degC_s, noise_sigma=0.0)


def trained_limits(
    runs: Sequence[Run], names: Iterable[str], settings: LimitSettings = LIMITS
) -> DropoutRule:
    """What a thermometer can show, from training runs; no more than `RULE` allows where they keep to it.

    Parameters
    ----------
    runs
        Training runs.
    names
        What features take, by names in formulas; those that are no temperatures don't count.
    settings
        Margins.
    """
    step = rate = 0.0
    for run in runs:
        sensors = dict.fromkeys(s for name in names if is_temperature(name) for s in run.sensors(name))
        whole: _Averaging | None = None
        for sensor in sensors:
            values, bad = run.temperature(sensor), run.dropouts(sensor)
            if bad is None:
                whole = whole or _Averaging.of(run.time, settings.averaging_s)
                averaging = whole
            else:
                values, averaging = values[~bad], _Averaging.of(run.time[~bad], settings.averaging_s)
            fastest = min(averaging.fastest(values), RULE.rate_degC_s)
            rate = max(rate, fastest)
            moved = np.abs(np.diff(values)) - fastest * averaging.apart
            step = max(step, float(moved.max(initial=0.0)))
    # A thermometer that was noisier than any other in training may be so later on.
    most = RULE.jump_degC if step <= RULE.jump_degC else settings.step_margin * step
    return DropoutRule(
        jump_degC=min(max(settings.step_margin * step, settings.least_step_degC), most),
        rate_degC_s=min(max(settings.rate_margin * rate, settings.least_rate_degC_s), RULE.rate_degC_s),
        noise_sigma=0.0,
    )


@dataclass(frozen=True, eq=False)
class _Averaging:
    """Averages of rows: where each begins, how many rows it has, its mean time; time between rows [s]."""

    starts: IndexArray
    counts: IndexArray
    middle_s: FloatArray
    apart: FloatArray

    @classmethod
    def of(cls, time: FloatArray, averaging_s: float) -> _Averaging:
        if len(time) == 0:
            return cls(np.empty(0, np.intp), np.empty(0, np.intp), np.empty(0), np.empty(0))
        starts = np.flatnonzero(np.diff((time - time[0]) // averaging_s, prepend=-1.0))
        counts = np.diff(np.append(starts, len(time)))
        return cls(starts, counts, np.add.reduceat(time, starts) / counts, np.diff(time))

    def fastest(self, values: FloatArray) -> float:
        """Fastest rate of averages that follow each other [degC/s]."""
        if len(values) < 2:
            return 0.0
        means = np.add.reduceat(values, self.starts) / self.counts
        return float(np.max(np.abs(np.diff(means)) / np.diff(self.middle_s), initial=0.0))
