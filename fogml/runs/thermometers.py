"""Thermometers that read, but not well; and what those of training runs showed, as limits for later.

Single readings that stand out, and steps too coarse for a rate. Columns of what a drift may follow.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import counted
from fogml.numerals import short
from fogml.runs.columns import is_temperature
from fogml.runs.dropouts import RULE, DropoutRule
from fogml.runs.findings import Finding
from fogml.runs.outliers import OUTLIER_SIGMA, find_outliers
from fogml.runs.run import Run
from fogml.settings_check import check_numbers
from fogml.signals import large
from fogml.signals.memory import Lag
from fogml.strict import Strict

LEAST_SPIKE_DEGC = 0.5
"""A reading that stands out by less [degC] moves a rate of temperature by less than ramps differ."""
RATE_WINDOW_S = 64.0
"""Window of a rate of temperature in features that state none [s]."""
SLOW_RATE_DEGC_MIN = 0.1
"""Error of a rate from which on a coarse thermometer is told [degC/min]: a tenth of a usual ramp."""
LEAST_LEVELS = 8
"""Readings of fewer values are of a temperature that hardly moves, or of a set-point."""
MOST_CHANGES = 0.25
"""Where more of the readings differ from the one before, noise rounds the steps off."""


def spiked(run: Run) -> Iterator[Finding]:
    """Readings over 8 robust sigma off their neighbours that step less than a dropout."""
    for name in run.temperature_columns:
        values, bad = run.columns[name], run.dropouts(name)
        # What stands out from the median of five is at most two steps from it.
        if all(
            np.abs(steps).max(initial=0.0) < 0.5 * LEAST_SPIKE_DEGC for _, steps in large.differences(values)
        ):
            continue
        found, _ = find_outliers(values)
        if bad is not None:
            found = found[~bad[found]]
        off = _off(values, found)
        found, off = found[off >= LEAST_SPIKE_DEGC], off[off >= LEAST_SPIKE_DEGC]
        if len(found):
            row, count = int(found[0]), len(found)
            readings = counted(count, "reading")
            message = (
                f"{readings} of '{name}' over {OUTLIER_SIGMA:g} robust sigma off their neighbours, by up to "
                f"{short(off.max())} degC, the first {values[row]:.6g} at {run.time[row]:.10g} s; kept: they "
                "count as temperature and as its rate"
            )
            yield Finding("temperature_outliers", message, column=name, row=row + 1, count=count)


def _off(values: FloatArray, places: IndexArray) -> FloatArray:
    """How far readings are off the median of five, and off lines through the two before and the two after.

    The least of the three, so that a turn of the temperature, which goes on from one side, is none.
    """
    place = places[:, None] + np.array([-2, -1, 0, 1, 2])
    near = values[np.clip(place, 0, len(values) - 1)]
    own = near[:, 2]
    before, after = 2.0 * near[:, 1] - near[:, 0], 2.0 * near[:, 3] - near[:, 4]
    sides = np.abs(np.column_stack((own - before, own - after)))
    sides[:, 0][places < 2] = np.inf
    sides[:, 1][places > len(values) - 3] = np.inf
    return np.minimum(np.abs(own - np.median(near, axis=1)), sides.min(axis=1))


def coarse(run: Run) -> Iterator[Finding]:
    """Thermometers of the coil whose steps make a rate of temperature wrong.

    Of a mean of readings in steps q while less than a step passes, the error has the deviation q / sqrt(12);
    of the rate by two neighbouring windows w, q / sqrt(6) / w.
    """
    for name in dict.fromkeys(one for what in ("T", "T_in", "T_out") for one in run.sensors(what)):
        values = run.columns[name]
        step = resolution(values)
        error = 60.0 * step / np.sqrt(6.0) / RATE_WINDOW_S
        if error < SLOW_RATE_DEGC_MIN or not _in_steps(values, step):
            continue
        message = (
            f"'{name}' is recorded in steps of {short(step)} degC: a rate of temperature over "
            f"{RATE_WINDOW_S:g} s is off by {short(error, 2)} degC/min (one sigma), and its "
            "coefficient by more "
            f"than is stated; record more digits, or take longer windows: dT[block, {_long_enough(step):g} s]"
        )
        yield Finding("coarse_thermometer", message, column=name, count=len(values))


def _long_enough(step: float) -> float:
    """Window, in whole minutes, whose rates are off by less than is told [s]."""
    return 60.0 * float(np.ceil(step / np.sqrt(6.0) / SLOW_RATE_DEGC_MIN))


def _in_steps(values: FloatArray, step: float) -> bool:
    """Whether readings are multiples of a step apart, of several levels, and stay at each for some time."""
    changes, low, high = 0, values[0], values[0]
    for part in large.pieces(values, overlap=1):
        steps = np.diff(values[part])
        if np.any(np.abs(steps - step * np.round(steps / step)) > 0.01 * step):
            return False
        changes += int(np.count_nonzero(steps))
        low, high = min(low, values[part].min()), max(high, values[part].max())
    return changes < MOST_CHANGES * len(values) and (high - low) / step > LEAST_LEVELS - 1.5


def resolution(values: FloatArray) -> float:
    """Smallest step of a column that is not zero; 0 where it never moves."""
    least = np.inf
    for _, steps in large.differences(values):
        least = min(least, float(np.min(np.abs(steps), where=steps != 0.0, initial=np.inf)))
    return least if np.isfinite(least) else 0.0


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

    def __post_init__(self) -> None:
        check_numbers(self)


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
        starts = np.flatnonzero(np.diff(np.floor((time - time[0]) / averaging_s), prepend=-1.0))
        counts = np.diff(np.append(starts, len(time)))
        return cls(starts, counts, np.add.reduceat(time, starts) / counts, np.diff(time))

    def fastest(self, values: FloatArray) -> float:
        """Fastest rate of averages that follow each other [degC/s]."""
        if len(values) < 2:
            return 0.0
        means = np.add.reduceat(values, self.starts) / self.counts
        return float(np.max(np.abs(np.diff(means)) / np.diff(self.middle_s), initial=0.0))


_LAGS_S = (60.0, 300.0, 1200.0, 3600.0)
"""Time constants of the temperature's lags that a drift may follow [s]: those of coils and housings."""
_COARSE = 4096
"""Rows at which the slow temperatures are worked out, at least."""


def leading_temperature(run: Run) -> FloatArray | None:
    """``T`` of a run, or the first of its temperatures where it gives none [degC], shape (n,)."""
    names = ["T"] if run.sensors("T") else run.temperature_columns[:1]
    return run.temperature(names[0]) if names else None


def thermal_columns(run: Run) -> Callable[[FloatArray], FloatArray]:
    """Columns that a drift with a run's temperature may follow, at times [s], shape (times, columns).

    They are kept out where a run's own noise is told beside its drift.
    """
    temperature = leading_temperature(run)
    if temperature is None:
        raise ValueError(f"{run.name} holds no temperature")
    at = np.arange(0, len(run), max(len(run) // _COARSE // 2, 1))
    counts = np.diff(np.append(at, len(run)))
    coarse, time = (np.add.reduceat(values, at) / counts for values in (temperature, run.time))
    large.release()
    t = (coarse - coarse.mean()) / (float(np.std(coarse)) or 1.0)
    step = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    lags = [Lag(max(lag_s, step), step).push(time, t)[0] for lag_s in _LAGS_S]
    table = np.column_stack((t, t**2, t**3, *lags, t * (t - lags[0]), t * (t - lags[1])))

    def columns(times_s: FloatArray) -> FloatArray:
        return np.column_stack([np.interp(times_s, time, column) for column in table.T])

    return columns
