"""What a judgement holds: numbers for the JSON, and averaged series for the figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray
from fogml.numerals import short
from fogml.pictures import AFTER, BEFORE, Panel, Pictured, in_time
from fogml.runs.facts import Facts
from fogml.runs.findings import Finding, saturated, standstill


@dataclass(frozen=True)
class Metrics:
    """Figures of the averages over ``averaging_s``, in deg/h; rms**2 = bias**2 + bias_stability**2.

    ``scale_factor_error`` (over all turns, with its sign), ``scale_factor_error_largest`` (of
    single turns, without), ``scale_factor_nonlinearity`` and ``scale_factor_asymmetry`` in ppm,
    ``temperature_sensitivity`` in deg/h/degC, ``hysteresis`` in deg/h, ``turn_on_time`` in s (infinite
    where the bias does not settle within the run); None where the run does not tell.
    """

    bias: float
    bias_stability: float
    range: float
    rms: float
    bias_stability_10s: float | None = None
    scale_factor_error: float | None = None
    scale_factor_error_largest: float | None = None
    scale_factor_nonlinearity: float | None = None
    scale_factor_asymmetry: float | None = None
    temperature_sensitivity: float | None = None
    hysteresis: float | None = None
    turn_on_time: float | None = None


@dataclass(frozen=True)
class BeforeAfter:
    """A figure before and after compensation."""

    before: float
    after: float


@dataclass(frozen=True)
class SpreadOverRuns(BeforeAfter):
    """A standard deviation over runs before and after compensation, each with its 90 % interval.

    The intervals are by chi-square, of runs that are independent: six runs tell a deviation to within
    0.67 and 2.1 times.
    """

    before_ci90: tuple[float, float]
    after_ci90: tuple[float, float]


@dataclass(frozen=True)
class Repeatability:
    """Spread over test runs of one unit and axis: of the bias [deg/h], and of the scale factor [ppm].

    ``power_cycles`` tells whether every run states its power-on; the scale factor's is None where
    a run has no turns.
    """

    runs: int
    power_cycles: bool
    bias: SpreadOverRuns
    scale_factor: SpreadOverRuns | None


@dataclass(frozen=True)
class AveragedSeries:
    """Averages over ``averaging_s``, for figures; every array has shape (m,).

    ``before`` and ``after`` in deg/h, ``drift`` what the model takes away between them, ``lower``
    and ``upper`` the 90 % prediction interval of ``after`` about zero, ``temperature`` in degC,
    ``rate`` of temperature in degC/min, ``time`` in s, ``regime`` the names of the regimes,
    ``flag`` 0, 1 or 2 as in compensate.
    """

    time: FloatArray
    temperature: FloatArray
    rate: FloatArray
    before: FloatArray
    after: FloatArray
    drift: FloatArray
    lower: FloatArray
    upper: FloatArray
    regime: NDArray[np.str_]
    flag: NDArray[np.int8]

    def by_regime(self) -> dict[str, dict[str, float]]:
        """By regime its share of the averages, and their rms about the reference before and after [deg/h]."""
        told = {}
        for name in dict.fromkeys(self.regime.tolist()):
            chosen = self.regime == name
            before, after = (float(np.sqrt(np.mean(v[chosen] ** 2))) for v in (self.before, self.after))
            told[name] = {"share": float(chosen.mean()), "before": before, "after": after}
        return told


@dataclass(frozen=True)
class SoakBias:
    """Mean error over a soak before and after compensation [deg/h], its temperature [degC], and how it came.

    ``approach`` is ``up`` or ``down`` after a ramp that led to it, ``none`` at the start of a run.
    """

    temperature: float
    approach: str
    before: float
    after: float


@dataclass(frozen=True)
class RunJudgement:
    """One model on one run.

    ``facts`` are the run's, ``table_rates`` the least and the greatest rate of the table [deg/s], None where
    none is recorded. ``floor`` is the noise at ``averaging_s`` [deg/h] as `fogml.signals.floor` defines it,
    with its 90 % interval and where it comes from; ``noise`` the run's own Allan terms with their intervals
    and the raw minimum, as in ``noise.json``, None where the run is too short for them. ``short_averages`` is
    how many averages over 10 s there are, ``short_freedom`` the degrees of freedom of their deviation,
    ``scale_factor_se`` and ``scale_factor_half_width`` the standard error of the scale factor error after
    compensation and the half-width of its 90 % interval [ppm], by what the turns scatter about it,
    ``soaks`` the bias at each soak, ``not_settled`` the share of the rows used at which a window was not
    wholly full or a memory still went by what was before the run, ``coverage`` the share of averages within
    the model's 90 % interval, over the time that this is of; None where it states none.
    """

    run: str
    unit: str | None
    axis: str | None
    averaging_s: float
    before: Metrics
    after: Metrics
    floor: float
    outside_training: float
    rows_used: int
    rows_left_out: int
    bias_reference: str  # "earth rate" or "training mean"
    series: AveragedSeries
    noise: Mapping[str, Any] | None = None
    findings: tuple[Finding, ...] = ()
    notes: tuple[str, ...] = ()
    power_on_known: bool = False
    facts: Facts = field(default_factory=Facts)
    table_rates: tuple[float, float] | None = None
    floor_ci90: tuple[float, float] | None = None
    floor_source: str = "the run itself"
    short_averages: int = 0
    short_freedom: float = 0.0
    scale_factor_se: float | None = None
    scale_factor_half_width: float | None = None
    soaks: tuple[SoakBias, ...] = ()
    not_settled: float = 0.0
    coverage: float | None = None

    @property
    def still(self) -> tuple[str, float] | None:
        """What is said of an output that stands still, and the share of the samples that do; else None."""
        found = standstill(self.findings)
        if found is None:
            return None
        return found.message, self._share(found.count)

    @property
    def saturated(self) -> tuple[str, float] | None:
        """What is said of an output at its range's ends at rest, and the share of the samples; else None."""
        found = saturated(self.findings)
        return None if found is None else (found[0], self._share(found[1]))

    def _share(self, samples: int) -> float:
        return samples / max(self.rows_used + self.rows_left_out, samples)


@dataclass(frozen=True)
class LimitOutcome:
    """A stated limit and what was reached; the largest value over the test runs."""

    quantity: str
    limit: float
    value: float
    met: bool


@dataclass(frozen=True, repr=False)
class Judgement(Pictured):
    """A model judged: what ``report.json`` says, and the series that its page draws."""

    model: dict[str, Any]  # kind, features, parameters, bytes, and what the model tells of itself
    train: tuple[RunJudgement, ...]
    test: tuple[RunJudgement, ...]
    design_index: LimitOutcome | None = None
    limits: tuple[LimitOutcome, ...] = ()
    notes: tuple[str, ...] = field(default=())
    repeatability: Repeatability | None = None
    beside: Mapping[str, tuple[RunJudgement, ...]] = field(default_factory=dict)
    """Other models on the same test runs, by name."""

    @property
    def met(self) -> bool:
        """Whether the design index and every stated limit are met."""
        stated = [*self.limits, *([self.design_index] if self.design_index else [])]
        return all(outcome.met for outcome in stated)

    def _heading(self) -> Sequence[str]:
        lines = [
            f"{run.run}: rms {short(run.before.rms)} → {short(run.after.rms)} deg/h, noise floor "
            f"{short(run.floor)}"
            for run in self.test
        ]
        return [f"{self.model['kind']}, judged", *lines]

    def _panels(self) -> Sequence[Panel]:
        panels = []
        for run in self.test:
            series, order = run.series, np.argsort(run.series.time)
            time, before, after = (x[order] for x in (series.time, series.before, series.after))
            curves = [in_time(time, before, "before", BEFORE), in_time(time, after, "after", AFTER)]
            if len(time):
                panels.append(Panel(curves, "time [h]", f"{run.run} [deg/h]"))
        return panels
