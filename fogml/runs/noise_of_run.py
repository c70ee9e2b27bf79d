"""Allan deviation and noise terms of a run, gaps and moving temperature respected."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.intervals import LEVEL
from fogml.numerals import percent, short
from fogml.runs.exchange import runs_of
from fogml.runs.findings import beside_drift
from fogml.runs.noise_series import (
    LOST,
    NoiseSeries,
    joined,
    rows_at_rest,
    series_of,
    spectrum_of_runs,
)
from fogml.runs.noise_words import coarse_steps, doubts_of, gaps_of, model_told, rounded_log, words_of
from fogml.runs.run import Run
from fogml.signals import large
from fogml.signals.allan import AllanResult, allan_deviation
from fogml.signals.averages import block_averages
from fogml.signals.noise_terms import NoiseTerms, noise_terms
from fogml.signals.whiteness import stationarity

SCHEMA = "fogml.noise/1"
MOVING_DEGC = 0.5
"""Span of minute averages from which a temperature counts as moving [degC]."""
UNEVEN = 0.1
"""Spread of the sample intervals, relative to the median, from which a run is irregular."""
SAME_INTERVAL = 0.01
"""Relative difference of sample intervals up to which runs may share terms."""
NOISE_NAMES = {2: "quantisation", 0: "white", -1: "flicker", -2: "random walk"}
"""Kinds of noise by the exponent of the rate's power spectral density."""
_ROUND = np.array([1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0])


def noise_report(
    run: Run | Sequence[Run], overlapping: bool = True, taus: ArrayLike | None = None
) -> dict[str, Any]:
    """Allan deviation and IEEE 952 terms of a run, as JSON-ready values (``fogml.noise/1``).

    The reference rate is taken off first. Stretches between gaps are never joined, and where the
    table turns and stands, only the rows at rest count. Values that a log repeats count once, and terms are
    those ahead of an output filter, where the data show one. K and R are null where a temperature of the
    unit moves by more than 0.5 degC, as drift can't be told from them there.

    Parameters
    ----------
    run
        A run, or several of one gyro and sample interval whose terms are shared: replicates.
    overlapping
        Whether the windows of the listed deviations overlap.
    taus
        Averaging times to list [s]; by default 1, 1.5, 2, 3, 4, 5, 6, 8 in every decade.

    Returns
    -------
    dict
        ``schema, run, unit, serial_number, axis, overlapping, level, sample_s, span_s, stretches, gaps,
        mean, taus_s, adev, ci, n, edf, noise, terms, misfit, fit_p_value, holds_from_s, filter, hold,
        correlated, sinusoids, model, stationarity, minimum, runs, warnings, findings, notes``: deviations
        and mean in deg/h, terms in their units, `noise` the kind of noise that each interval stands on,
        `model` the deviations of the fitted model behind its filter and ahead of it, `runs` the terms of
        each of several runs.

    Raises
    ------
    InputError
        If the output is in counts without a scale factor, a run is too short, or sample intervals differ.
    """
    runs = runs_of(run)
    if not runs:
        raise InputError("no run is given; name one")
    series = [series_of(one) for one in runs]
    first = series[0]
    for other in series[1:]:
        if abs(other.new_s / first.new_s - 1.0) > SAME_INTERVAL:
            raise InputError(
                f"{other.run.name}: new values {other.new_s:g} s apart, in {first.run.name} {first.new_s:g} "
                "s: runs can share noise terms only at one sample interval; give them one by one"
            )
    values, segments = joined(series)

    def allan(times: ArrayLike, overlap: bool) -> AllanResult:
        try:
            return allan_deviation(values, first.sample_s, times, overlap, segments=segments, level=LEVEL)
        except InputError as problem:
            raise InputError(f"{first.run.name}: {problem}") from None

    default = _default_times(first.sample_s, max(part.stop - part.start for part in segments))
    whole = allan(default, True)
    listed = whole if overlapping and taus is None else allan(default if taus is None else taus, overlapping)
    moves = [moving_temperatures(one) for one in runs]
    moving: dict[str, float] = {}
    for one in moves:
        moving |= one
    unread = dict.fromkeys(("K", "R"), "not read from a run with moving temperature") if moving else {}
    if any(len(set(large.extremes(one.gyro))) == 1 for one in runs):
        unread = dict.fromkeys("QNBKR", "not read from an output that stands still")
    spectrum = spectrum_of_runs(series, [bool(one) for one in moves])
    least, drifts = first.new_s, any(map(bool, moves))
    terms = noise_terms(spectrum, whole, LEVEL, least_tau_s=least, ramps=len(series), drifts=drifts)
    alone = [_alone(one, bool(m)) for one, m in zip(series, moves)] if len(series) > 1 else []
    steady = stationarity(first.stretches, first.new_s) if len(series) == 1 else None
    warnings = [
        *(
            warning
            for one, spans in zip(series, moves)
            for warning in _warnings(one.run, spans, one.segments, one.sample_s)
        ),
        *(warning for one in series for warning in coarse_steps(one) or rounded_log(one, terms)),
        *doubts_of(terms, steady, alone),
    ]
    notes = [one.facts.notes for one in runs if one.facts.notes]
    return {
        "schema": SCHEMA,
        "run": ", ".join(one.name for one in runs),
        "unit": "deg/h",
        "serial_number": runs[0].facts.unit,
        "axis": runs[0].facts.axis,
        "overlapping": overlapping,
        "level": LEVEL,
        "sample_s": first.sample_s,
        "span_s": sum(one.span_s for one in runs),
        "stretches": len(segments),
        "gaps": gaps_of(runs),
        "mean": float(sum(one.gyro_deg_h.sum() for one in runs)) / sum(map(len, runs)),
        "taus_s": [float(f"{tau:.9g}") for tau in listed.taus_s],
        "adev": listed.adev.tolist(),
        "ci": np.column_stack((listed.lower, listed.upper)).tolist(),
        "n": listed.n.tolist(),
        "edf": listed.edf.tolist(),
        "noise": [NOISE_NAMES[exponent] for exponent in listed.exponent.tolist()],
        "terms": _terms(terms, unread),
        **model_told(terms, listed.taus_s, first),
        "stationarity": None if steady is None else asdict(steady),
        "minimum": {"adev": terms.minimum_adev, "tau_s": float(f"{terms.minimum_tau_s:.9g}")},
        "runs": [{"run": one.run.name, "terms": _terms(told, unread)} for one, told in zip(series, alone)],
        "warnings": warnings,
        "findings": [finding.as_dict() for one in runs for finding in beside_drift(one.findings)],
        "notes": [*notes, *words_of(terms, first, runs), *(warning["message"] for warning in warnings)],
    }


def _alone(series: NoiseSeries, moves: bool) -> NoiseTerms:
    values, segments = joined([series])
    times = _default_times(series.sample_s, max(part.stop - part.start for part in segments))
    allan = allan_deviation(values, series.sample_s, times, segments=segments, level=LEVEL)
    spectrum = spectrum_of_runs([series], [moves])
    return noise_terms(spectrum, allan, LEVEL, least_tau_s=series.new_s, ramps=1, drifts=moves)


def _default_times(sample_s: float, samples: int) -> FloatArray:
    first, last = sample_s, sample_s * max(samples / 2, 1)
    decades = 10.0 ** np.arange(np.floor(np.log10(first)), np.ceil(np.log10(last)) + 1)
    times = np.outer(decades, _ROUND).ravel()
    # Round times only, brought to whole samples; the sample interval itself is the shortest.
    return np.union1d([sample_s], times[(times > first) & (times <= last)])


def moving_temperatures(run: Run) -> dict[str, float]:
    """Temperatures of the unit that move, with their spans [degC].

    The chamber's air counts only where nothing else is recorded: a unit does not follow its
    regulator's cycle.
    """
    names = [name for name in run.temperature_columns if name != "T_chamber"] or list(run.temperature_columns)
    if not names:
        return {}
    window_s = min(60.0, run.span_s / 4)
    averages = block_averages(run.time, *(run.temperature(name) for name in names), window_s=window_s)
    # Short stretches far apart may fill no window.
    told = averages.values if len(averages) else [run.temperature(name) for name in names]
    spans = {name: float(np.ptp(values)) for name, values in zip(names, told)}
    return {name: span for name, span in spans.items() if span > MOVING_DEGC}


def _terms(found: NoiseTerms, unread: Mapping[str, str]) -> dict[str, dict[str, Any]]:
    terms: dict[str, dict[str, Any]] = {}
    for name, term in found.terms.items():
        if name in unread:
            terms[name] = {
                "value": None,
                "ci": [None, None],
                "unit": term.unit,
                "fitted": None,
                "reason": unread[name],
            }
            continue
        terms[name] = {
            "value": term.value,
            "ci": [term.lower, term.upper],
            "unit": term.unit,
            "fitted": term.fitted,
        }
    return terms


def _warnings(
    run: Run, moving: dict[str, float], segments: list[slice], sample_s: float
) -> list[dict[str, str]]:
    warnings: list[dict[str, str]] = []
    if moving:
        spans = ", ".join(f"{name} by {short(span)} degC" for name, span in moving.items())
        message = (
            f"The temperature moves ({spans}): rate random walk K and rate ramp R can't be told from drift "
            "and are not given, and long averaging times hold the drift; give a run at constant temperature."
        )
        warnings.append({"code": "moving_temperature", "message": message})
    still = rows_at_rest(run)
    if not np.all(still):
        some = any(np.any(still[part]) for part in segments)
        message = (
            "The table turns in part of the run: only rows at rest count."
            if some
            else "The table turns all through the run: its own noise and the scale factor's count too."
        )
        warnings.append({"code": "turning", "message": message})
    if _spread(run) > UNEVEN * run.sample_s:
        message = (
            f"Samples are not evenly spaced: averaging times take them as {short(sample_s, 4)} s apart, as "
            "they are on average."
        )
        lost = 1.0 - (run.sample_s / sample_s) ** 0.5
        if lost > 0.5 * LOST:
            message += f" If rows are lost, N of the gyro itself is {percent(lost)} less."
        warnings.append({"code": "irregular_sampling", "message": message})
    return warnings


def _spread(run: Run) -> float:
    """Standard deviation of the sample intervals but for gaps [s]."""
    intervals = sum(part.stop - 1 - part.start for part in run.stretches)
    spent = sum(float(run.time[part.stop - 1] - run.time[part.start]) for part in run.stretches)
    mean = spent / max(intervals, 1)
    square = sum(
        float(np.sum((steps - mean) ** 2))
        for part in run.stretches
        for _, steps in large.differences(run.time[part])
    )
    return float(np.sqrt(square / max(intervals, 1)))
