"""The figures of a run's error: bias, bias stability, range, rms, what soaks and turns tell, repeatability.

Bias repeatability is the standard deviation of the bias over power cycles, at least 6; scale
factor repeatability is ``std(K) / mean(K)``. Runs that state their power-on are power cycles; where fewer
than 6 do, every run counts, and whether the unit was switched off between them is not known.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError, counted
from fogml.numerals import percent
from fogml.runs.run import Run
from fogml.signals.averages import BlockAverages, block_averages, freedom_of_deviation
from fogml.signals.distributions import deviation_within
from fogml.validation.results import Metrics, Repeatability, RunJudgement, SoakBias, SpreadOverRuns
from fogml.validation.scale_factor import (
    LEAST_SHARE,
    find_ladder,
    find_steps,
    ladder_figures,
    scale_factor_error,
)
from fogml.validation.soaks import find_soaks, hysteresis, temperature_sensitivity

SETTLED_SHARE = 0.25
"""The last quarter of a run's averages tells the settled bias."""
LEAST_AVERAGES = 8


def check_turn_on_band(band: float | None, runs: Iterable[Run] | None = None) -> None:
    """Raise `InputError` for a band that is no positive number of deg/h, or that no run of `runs` answers."""
    if band is not None and not (math.isfinite(band) and band > 0.0):
        raise InputError(f"turn-on band {band:g} deg/h: a positive number is needed")
    if band is not None and runs is not None and all(run.facts.powered_on is None for run in runs):
        raise InputError(
            f"turn-on band {band:g} deg/h: no run states when the gyro was switched on; write "
            "'powered_on: SECONDS' into a side file, on the run's own clock, or leave the band out"
        )


def turn_on_time(
    time_s: FloatArray, averages: FloatArray, powered_on_s: float, band_deg_h: float, averaging_s: float
) -> float | None:
    """Time from power-on until the averages stay within the band about their settled value [s].

    The settled value is the mean of the last quarter of the averages. Where the band is entered
    lies between two averages, and is interpolated.

    Parameters
    ----------
    time_s
        Mean time of each average [s], shape (m,).
    averages
        Averages of the error [deg/h], shape (m,).
    powered_on_s
        Time of power-on on the same clock [s].
    band_deg_h
        Greatest distance from the settled value [deg/h].
    averaging_s
        Averaging time [s].

    Returns
    -------
    float or None
        Infinite where the last quarter itself leaves the band, so the run does not settle. None
        where the averages don't tell: fewer than 8 after power-on, or none of them outside the
        band though the first is not right after power-on.
    """
    on = time_s >= powered_on_s
    time, values = time_s[on], averages[on]
    if len(values) < LEAST_AVERAGES:
        return None
    first_settled = len(values) - int(SETTLED_SHARE * len(values))
    away = values - values[first_settled:].mean()
    outside = np.flatnonzero(np.abs(away) > band_deg_h)
    if len(outside) == 0:
        # Settled before the first average ended; which says little where that came late.
        at_once = float(time[0]) - powered_on_s
        return at_once if at_once <= averaging_s else None
    last = int(outside[-1])
    if last >= first_settled:
        return math.inf
    edge = math.copysign(band_deg_h, away[last])
    share = (away[last] - edge) / (away[last] - away[last + 1])
    return float(time[last] + share * (time[last + 1] - time[last]) - powered_on_s)


SHORT_AVERAGING_S = 10.0


@dataclass(frozen=True)
class AverageFigures:
    """Figures of averages [deg/h]: ``rms**2 = bias**2 + bias_stability**2``."""

    bias: float
    bias_stability: float
    range: float
    rms: float


def figures_of_averages(averages: ArrayLike) -> AverageFigures:
    """Bias, bias stability, range and rms of consecutive averages.

    Parameters
    ----------
    averages
        Averages of the error [deg/h], shape (m,), m >= 1. The bias stability is their standard
        deviation over m (not m - 1), so that the squares add up to the rms.
    """
    values = np.asarray(averages, dtype=np.float64)
    bias = float(values.mean())
    stability = float(values.std())
    return AverageFigures(
        bias=bias,
        bias_stability=stability,
        range=float(values.max() - values.min()),
        rms=float(np.hypot(bias, stability)),
    )


class RunMetrics:
    """The figures of any error series over the same rows of one run.

    Windows, soaks and turns are found once, so that before and after are treated alike.

    Parameters
    ----------
    run
        The run.
    used
        Rows that count for all but the scale factor, shape (n,): windows full, transitions of the
        table cut, at rest where the run both stands and turns.
    averaging_s
        Averaging time [s].
    full
        Rows whose windows are full, shape (n,), turning or not; all of them by default.
    turn_on_band
        Band about the settled bias that tells the turn-on time [deg/h]; None: not told.

    Raises
    ------
    InputError
        If the averaging time is shorter than a sample interval, or the run holds fewer than two
        averages.
    """

    def __init__(
        self,
        run: Run,
        used: BoolArray,
        averaging_s: float,
        *,
        full: BoolArray | None = None,
        turn_on_band: float | None = None,
    ) -> None:
        check_turn_on_band(turn_on_band)
        self._turn_on_band = turn_on_band
        if not (np.isfinite(averaging_s) and averaging_s > 0.0):
            raise InputError(f"averaging time {averaging_s} s: a positive number of seconds is needed")
        if averaging_s < run.sample_s * (1.0 - 1e-9):
            raise InputError(
                f"{run.name}: averages over {averaging_s:g} s are asked for, but samples are "
                f"{run.sample_s:g} s apart; choose a longer --averaging"
            )
        self.run = run
        self.used = used
        self.averaging_s = averaging_s
        self._time = run.time[used]
        self._soaks = find_soaks(run, used, least_s=averaging_s)
        self._steps = find_steps(run, np.ones(len(run), dtype=bool) if full is None else full)
        self._ladder = find_ladder(self._steps) if self._steps is not None else None
        found = len(self.averages(self._time))
        if found < 2:
            raise InputError(
                f"{run.name}: {counted(int(used.sum()), 'usable row')} give {counted(found, 'average')} "
                f"over {averaging_s:g} s, at least 2 are needed; choose a shorter --averaging or a longer run"
            )

    @property
    def notes(self) -> tuple[str, ...]:
        """What the figures leave out, in words."""
        if self._steps is None:
            return ()
        small = len(np.unique(self._steps.turn[~self._steps.large]))
        if not small:
            return ()
        return (
            f"{small} turns below {percent(LEAST_SHARE, 0)} of the greatest rate tell nonlinearity and "
            "asymmetry; the largest scale factor error of single turns leaves them out for their noise",
        )

    @property
    def short_averages(self) -> int:
        """How many averages over 10 s there are; 0 where samples are too far apart."""
        return len(self._short(self._time))

    def scale_factor_spread(self, error_deg_h: FloatArray) -> tuple[float | None, float | None]:
        """Standard error and 90 % half-width of the scale factor error of an error series [ppm]."""
        if self._steps is None:
            return None, None
        found = scale_factor_error(self._steps, error_deg_h)
        return found.se, found.half_width

    def short_freedom(self, error_deg_h: FloatArray) -> float:
        """Degrees of freedom of the bias stability at 10 s; 0 where there is none."""
        averages = self._short(error_deg_h[self.used])
        return freedom_of_deviation(averages) if len(averages) else 0.0

    def averages(self, *columns: FloatArray, window_s: float | None = None) -> BlockAverages:
        """Averages over the averaging time of columns that hold the used rows only."""
        return block_averages(self._time, *columns, window_s=window_s or self.averaging_s)

    def coverage(self, error_deg_h: FloatArray, half_width: FloatArray, over_s: float) -> float | None:
        """Share of averages that lie within an interval about zero; None where it has no width.

        Parameters
        ----------
        error_deg_h, half_width
            Error series and half-width of the interval [deg/h] of the whole run, shape (n,).
        over_s
            Time that the interval is of averages over [s], whatever that of the figures is.
        """
        columns = (error_deg_h[self.used], half_width[self.used])
        error, half = self.averages(*columns, window_s=over_s).values
        return float(np.mean(np.abs(error) <= half)) if np.any(half > 0.0) else None

    def soak_biases(self, before_deg_h: FloatArray, after_deg_h: FloatArray) -> tuple[SoakBias, ...]:
        """Mean errors over each soak of error series of the whole run [deg/h], shape (n,)."""
        return tuple(
            SoakBias(
                soak.temperature,
                soak.approach,
                float(before_deg_h[soak.rows].mean()),
                float(after_deg_h[soak.rows].mean()),
            )
            for soak in self._soaks
        )

    def figures(self, error_deg_h: FloatArray) -> Metrics:
        """The figures of an error series [deg/h] of the whole run, shape (n,)."""
        error = error_deg_h[self.used]
        averages = self.averages(error)
        main = figures_of_averages(averages.values[0])
        biases = [float(error_deg_h[soak.rows].mean()) for soak in self._soaks]
        scale = scale_factor_error(self._steps, error_deg_h) if self._steps is not None else None
        ladder = None
        if self._steps is not None and self._ladder is not None:
            ladder = ladder_figures(self._ladder, self._steps.of(error_deg_h))
        return Metrics(
            bias=main.bias,
            bias_stability=main.bias_stability,
            range=main.range,
            rms=main.rms,
            bias_stability_10s=self._short_stability(error),
            scale_factor_error=scale.overall if scale else None,
            scale_factor_error_largest=scale.largest if scale else None,
            scale_factor_nonlinearity=ladder.nonlinearity if ladder else None,
            scale_factor_asymmetry=ladder.asymmetry if ladder else None,
            temperature_sensitivity=temperature_sensitivity(self._soaks, biases),
            hysteresis=hysteresis(self._soaks, biases),
            turn_on_time=self._turn_on_time(averages),
        )

    def _turn_on_time(self, averages: BlockAverages) -> float | None:
        """Time from the stated power-on until the bias stays within the stated band [s]."""
        powered_on = self.run.facts.powered_on
        if self._turn_on_band is None or powered_on is None:
            return None
        (values,) = averages.values
        return turn_on_time(averages.time_s, values, powered_on, self._turn_on_band, self.averaging_s)

    def _short(self, values: FloatArray) -> FloatArray:
        """Averages over 10 s of used rows; none where that holds fewer than two samples."""
        if self.run.sample_s > SHORT_AVERAGING_S / 2.0:
            return np.empty(0)
        return self.averages(values, window_s=SHORT_AVERAGING_S).values[0]

    def _short_stability(self, error: FloatArray) -> float | None:
        """Bias stability at 10 s; None where fewer than two averages tell it."""
        averages = self._short(error)
        return figures_of_averages(averages).bias_stability if len(averages) > 1 else None


LEAST_RUNS = 6


def repeatability_of(test: Sequence[RunJudgement]) -> Repeatability | None:
    """Repeatability over test runs; None for fewer than 6, or for several units or axes.

    That of the scale factor is over those of them that hold turns, where 6 do.
    """
    cycles = [run for run in test if run.power_on_known]
    over = cycles if len(cycles) >= LEAST_RUNS else test
    if len(over) < LEAST_RUNS or len({(run.unit, run.axis) for run in over}) > 1:
        return None
    bias = _over_runs([[getattr(run, when).bias for run in over] for when in ("before", "after")], _spread)
    turned = [run for run in over if run.after.scale_factor_error is not None]
    scale = None
    if len(turned) >= LEAST_RUNS:
        errors = [[getattr(run, when).scale_factor_error for run in turned] for when in ("before", "after")]
        scale = _over_runs(errors, _relative_spread)
    return Repeatability(len(over), over is cycles, bias, scale)


def _over_runs(
    values: Sequence[Sequence[float]], spread: Callable[[Sequence[float]], float]
) -> SpreadOverRuns:
    before, after = map(spread, values)
    freedom = len(values[0]) - 1.0
    return SpreadOverRuns(before, after, deviation_within(before, freedom), deviation_within(after, freedom))


def _spread(values: Sequence[float]) -> float:
    return float(np.std(values, ddof=1))


def _relative_spread(errors_ppm: Sequence[float]) -> float:
    """``std(K) / mean(K)`` [ppm] of scale factors given as errors ``K - 1`` [ppm]."""
    return _spread(errors_ppm) / (1.0 + float(np.mean(errors_ppm)) / 1e6)
