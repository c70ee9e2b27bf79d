"""What a gyro's runs tell of each quantity of its acceptance report, before and after compensation."""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fogml.errors import InputError, listed
from fogml.lab.acceptance_rows import TERMS, Limit, Limits
from fogml.lab.rate_json import rate_json
from fogml.lab.rate_pieces import earth_deg_h, find_plateaus, merged
from fogml.numerals import number
from fogml.runs.noise_of_run import moving_temperatures, noise_report
from fogml.runs.run import Run
from fogml.runs.turning import least_rate_deg_s, turning, white_noise
from fogml.validation.certified import of_10_s, over_temperature
from fogml.validation.metrics import SETTLED_SHARE, repeatability_of
from fogml.validation.results import Repeatability, RunJudgement, SoakBias, SpreadOverRuns
from fogml.validation.soaks import (
    EQUAL_TEMPERATURE_DEGC,
    Soak,
    hysteresis,
    temperature_sensitivity,
)

_APPROACH = {"up": "up", "down": "down", "none": "start"}


def soak_table(judged: Sequence[RunJudgement]) -> list[dict[str, Any]]:
    """One line a soak temperature, ascending: biases up, down and at the start [deg/h], and hysteresis.

    Of each run alone that holds several temperatures, where a run holds both ways; else of all runs
    together. Soaks of the same temperature and way are averaged.
    """
    groups = [(one.run, list(one.soaks)) for one in judged if one.soaks]
    if any({soak.approach for soak in soaks} >= {"up", "down"} for _, soaks in groups):
        groups = [(run, soaks) for run, soaks in groups if len(_by_temperature(soaks)) > 1]
    else:
        groups = [(one.run, list(one.soaks)) for one in known_earth(judged) if one.soaks]
        together = [soak for _, soaks in groups for soak in soaks]
        groups = [("all runs together" if len(groups) > 1 else groups[0][0], together)] if groups else []
    return [_line(run, group) for run, soaks in groups for group in _by_temperature(soaks)]


def soaks_tell(judged: Sequence[RunJudgement]) -> dict[str, tuple[float, float]]:
    """Temperature sensitivity and hysteresis of the soaks of all runs together, before and after."""
    soaks = [soak for one in judged for soak in one.soaks]
    held = [
        Soak(np.empty(0, np.intp), one.temperature, one.approach)  # type: ignore[arg-type]
        for one in soaks
    ]
    found = {}
    for key, figure in (("temperature_sensitivity", temperature_sensitivity), ("hysteresis", hysteresis)):
        pair = [figure(held, [getattr(one, when) for one in soaks]) for when in ("before", "after")]
        if pair[0] is not None and pair[1] is not None:
            found[key] = (pair[0], pair[1])
    return found


def _by_temperature(soaks: list[SoakBias]) -> list[list[SoakBias]]:
    order = sorted(soaks, key=lambda one: one.temperature)
    groups: list[list[SoakBias]] = []
    for soak in order:
        if groups and soak.temperature - groups[-1][0].temperature <= EQUAL_TEMPERATURE_DEGC:
            groups[-1].append(soak)
        else:
            groups.append([soak])
    return groups


def _line(run: str, group: list[SoakBias]) -> dict[str, Any]:
    line: dict[str, Any] = {
        "run": run,
        "temperature_degC": float(np.mean([one.temperature for one in group])),
    }
    for when in ("before", "after"):
        told: dict[str, float | None] = {}
        for approach, name in _APPROACH.items():
            values = [getattr(one, when) for one in group if one.approach == approach]
            told[name] = float(np.mean(values)) if values else None
        up, down = told["up"], told["down"]
        told["hysteresis"] = None if up is None or down is None else abs(up - down)
        line[when] = told
    return line


_OF_RUNS = (
    "bias",
    "bias_stability",
    "bias_stability_10s",
    "temperature_sensitivity",
    "hysteresis",
    "scale_factor_error",
    "scale_factor_nonlinearity",
    "scale_factor_asymmetry",
)
"""Figures of `fogml.validation.results.Metrics`: of the run that is furthest beyond the limit, or largest."""
_MOST_NAMES = 3


@dataclass(frozen=True)
class Figure:
    """What the runs tell of a quantity: before and after compensation, the run it is from, and a remark.

    `at_most` or `at_least` where they tell only that it is no more, or no less, than that; `ci90` is the 90 %
    interval of the figure after compensation, where it has one.
    """

    before: float | None
    after: float
    of: str
    remark: str = ""
    at_most: bool = False
    at_least: bool = False
    ci90: tuple[float, float] | None = None


def figures_of(
    before: Sequence[Run],
    after: Sequence[Run],
    judged: Sequence[RunJudgement],
    noise: Run | None,
    limits: Limits,
    turned: Container[str] = (),
    brief: Container[str] = (),
) -> Iterator[tuple[str, Figure]]:
    """Each quantity that the runs tell.

    Parameters
    ----------
    before, after
        The runs as they are, and as compensation leaves them.
    judged
        Their judgements, in the same order.
    noise
        A static run for the noise terms; by default one of the runs.
    limits
        Of a figure of single runs that is told which violates its limit most.
    turned, brief
        Names of runs with turns whose rests tell no bias, and of all runs that tell none.
    """
    rested = [one for one in judged if one.run not in brief]
    small = {run.name for run in before if small_rates(run)}
    steady = [one for one in rested if one.run not in small] or rested
    # Rates about zero spoil these: what a gyro does not see of them is no instability.
    often = [one for one in judged if one.run not in turned and one.run not in small] or steady
    biased = {"bias": known_earth(steady), "bias_stability": steady, "bias_stability_10s": often}
    for key in _OF_RUNS:
        told = [one for one in biased.get(key, judged) if getattr(one.after, key) is not None]
        if told:
            limit = limits.by_quantity.get(key)
            factors = [_of_few(key, one) for one in told]
            values = [factor * getattr(one.after, key) for factor, one in zip(factors, told, strict=True)]
            place = _furthest(values, limit)
            worst = told[place]
            was = factors[place] * getattr(worst.before, key)
            yield key, Figure(was, values[place], worst.run, ci90=_within(key, worst))
    yield from _turn_on(rested, limits)
    for key, pair in soaks_tell(known_earth(steady)).items():
        if all(getattr(one.after, key) is None for one in rested):
            yield key, Figure(*pair, "all runs together")
    spread = repeatability_of(known_earth(rested))
    if spread is not None:
        yield "bias_repeatability", _repeated(spread.bias, _over(spread))
    spread = repeatability_of(judged)
    if spread is not None and spread.scale_factor is not None:
        yield "scale_factor_repeatability", _repeated(spread.scale_factor, _over(spread))
    yield from _of_rates(before, after)
    yield from _of_noise(before, after, noise)


def _furthest(values: Sequence[float], limit: Limit | None) -> int:
    """Which value is furthest beyond the limit, or largest."""
    beyond = [0.0 if limit is None else limit.excess(value) for value in values]
    return max(range(len(values)), key=lambda one: (beyond[one], abs(values[one])))


def _turn_on(judged: Sequence[RunJudgement], limits: Limits) -> Iterator[tuple[str, Figure]]:
    """The longest turn-on time; of a run that does not settle it is at least what comes before its end."""
    key = "turn_on_time"
    told = [one for one in judged if one.after.turn_on_time is not None]
    if not told:
        return
    unsettled = {one.run: _unsettled_s(one) for one in told if one.after.turn_on_time == np.inf}
    times = [unsettled.get(one.run, one.after.turn_on_time or 0.0) for one in told]
    place = _furthest(times, limits.by_quantity.get(key))
    worst = told[place]
    was = worst.before.turn_on_time
    remarks = [f"the longest of {len(told)} runs"] if len(told) > 1 else []
    if unsettled:
        names = listed(unsettled, _MOST_NAMES)
        remarks.append(f"{names}: not settled within the run, as where its temperature moves")
    yield (
        key,
        Figure(
            unsettled.get(worst.run) if was == np.inf else was,
            times[place],
            worst.run,
            "; ".join(remarks),
            at_least=bool(unsettled),
        ),
    )


def _unsettled_s(run: RunJudgement) -> float:
    """From power-on to the averages' last quarter [s], in which a run that does not settle is outside."""
    on, times = run.facts.powered_on or 0.0, run.series.time
    since = times[times >= on] - on
    return float(since[len(since) - int(SETTLED_SHARE * len(since)) - 1])


def _of_few(key: str, run: RunJudgement) -> float:
    """What makes a deviation over n averages that of the standards, over n - 1; 1 for other figures."""
    counts = {"bias_stability": len(run.series.after), "bias_stability_10s": run.short_averages}
    n = counts.get(key, 0)
    return float(np.sqrt(n / (n - 1.0))) if n > 1 else 1.0


def _within(key: str, run: RunJudgement) -> tuple[float, float] | None:
    """90 % interval of a run's figure, as its certificate has it."""
    if key == "scale_factor_error" and run.scale_factor_half_width is not None:
        middle = run.after.scale_factor_error or 0.0
        return middle - run.scale_factor_half_width, middle + run.scale_factor_half_width
    told = {"bias_stability": over_temperature, "bias_stability_10s": of_10_s}
    found = told[key](run) if key in told else None
    return None if found is None else found.ci90


def known_earth(judged: Sequence[RunJudgement]) -> Sequence[RunJudgement]:
    """Runs whose Earth rate is known; all where it is of none, as then it is in every bias alike."""
    return [one for one in judged if one.bias_reference == "earth rate"] or judged


def _over(found: Repeatability) -> str:
    return f"{found.runs} {'power cycles' if found.power_cycles else 'runs'}"


def _repeated(found: SpreadOverRuns, over: str) -> Figure:
    low, high = found.after_ci90
    return Figure(
        found.before, found.after, over, f"90 % of {number(low)} to {number(high)}", ci90=(low, high)
    )


def small_rates(run: Run) -> bool:
    """Whether the table was told to turn at rates so small that they count as rest: a test of the threshold.

    Of a recorded rate, which has noise, that is not told.
    """
    if not run.rate.any() or white_noise(run.rate) > 0.0:
        return False
    plateaus = find_plateaus(run)
    rate = plateaus.rate - earth_deg_h(run)
    slow = np.abs(rate) < 3600.0 * least_rate_deg_s(run)
    return len(np.unique(merged(rate, plateaus.rate_error)[slow])) > 1


def _of_rates(before: Sequence[Run], after: Sequence[Run]) -> Iterator[tuple[str, Figure]]:
    """What the tests on a rate table tell."""
    try:
        told = [rate_json(runs, source="") for runs in (before, after)]
    except InputError:
        return
    names = {key: listed(runs, _MOST_NAMES) for key, runs in told[1]["told_by"].items()}
    sensed = [one["temperature_sensitivity"] for one in told]
    if all(sensed):
        before_ppm, after_ppm = (one["ppm_per_degC"] for one in sensed)
        remark = f"{len(sensed[0]['temperature'])} temperatures"
        yield (
            "scale_factor_temperature_sensitivity",
            Figure(before_ppm, after_ppm, names["temperature_sensitivity"], remark),
        )
    for key in ("threshold", "resolution"):
        ends = [(one[key]["below_deg_h"], one[key]["above_deg_h"]) for one in told if one[key] is not None]
        sizes = [below or above for below, above in ends if below or above]
        if len(sizes) == len(told):
            seen, over = ends[1]
            remark = f"above {number(over)}" if over else "the smallest that was tested"
            if not seen:
                remark = "none as small as that shows, and none above was tested"
            was, now = sizes
            yield key, Figure(was, now, names[key], remark, at_most=not over, at_least=not seen)


def _static(before: Sequence[Run], after: Sequence[Run]) -> list[tuple[Run, Run]]:
    """Runs that rest at constant temperature; a rate that is recorded of a table at rest is noise."""
    return [
        (run, left)
        for run, left in zip(before, after, strict=True)
        if not (turning(run).any() or small_rates(run) or moving_temperatures(run))
    ]


def _of_noise(before: Sequence[Run], after: Sequence[Run], noise: Run | None) -> Iterator[tuple[str, Figure]]:
    """Noise terms of a static run: that which is named, else the longest at constant temperature.

    Of one that is named and warms up those that are told all the same. A term that the run does not tell from
    the others stands with the upper end of its interval.
    """
    static = [(noise, noise)] if noise is not None else _static(before, after)
    if not static:
        return
    pair = max(static, key=lambda one: (one[0].span_s, one[0].hash))
    try:
        told = [noise_report(run)["terms"] for run in pair]
    except InputError:
        return
    for key, letter in TERMS.items():
        terms = [one[letter] for one in told]
        (_, high), (low, most) = (term["ci"] for term in terms)
        if all(term["value"] is not None for term in terms):
            remark = f"90 % of {number(low)} to {number(most)}"
            values = (terms[0]["value"], terms[1]["value"])
            yield key, Figure(*values, pair[0].name, remark, ci90=(low, most))
        elif all(term["ci"][1] for term in terms):
            remark = "not told from the other terms; upper end of the 90 % interval"
            yield key, Figure(high, most, pair[0].name, remark, at_most=True)
