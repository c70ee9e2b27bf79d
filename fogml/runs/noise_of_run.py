"""Allan deviation and noise terms of a run, gaps and moving temperature respected."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogml.errors import InputError
from fogml.runs.run import FloatArray, Run
from fogml.signals.allan import AllanResult, allan_deviation
from fogml.signals.averages import block_averages
from fogml.signals.noise_terms import NoiseTerms, noise_terms

SCHEMA = "fogml.noise/1"
LEVEL = 0.9
"""Coverage of the intervals."""
MOVING_DEGC = 0.5
"""Span of minute averages from which a temperature counts as moving [degC]."""
AT_REST_DEG_S = 1e-3
"""Table rate under which the table stands [deg/s]."""
UNEVEN = 0.1
"""Spread of the sample intervals, relative to the median, from which a run is irregular."""
LOST = 1e-3
"""Share of lost samples from which the mean sample interval stands for the median."""
NOISE_NAMES = {2: "quantisation", 0: "white", -1: "flicker", -2: "random walk"}
"""Kinds of noise by the exponent of the rate's power spectral density."""
_ROUND = np.array([1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0])


def noise_report(run: Run, overlapping: bool = True, taus: ArrayLike | None = None) -> dict[str, Any]:
    """Allan deviation and IEEE 952 terms of a run, as JSON-ready values (``fogml.noise/1``).

    The reference rate is taken off first. Stretches between gaps are never joined, and where the
    table turns and stands, only the rows at rest count. The terms always come from overlapping
    windows over the default times. K and R are null where a temperature of the unit moves by
    more than 0.5 degC, as drift can't be told from them there.

    Parameters
    ----------
    overlapping
        Whether the windows of the listed deviations overlap.
    taus
        Averaging times to list [s]; by default 1, 1.5, 2, 3, 4, 5, 6, 8 in every decade.

    Returns
    -------
    dict
        ``schema, run, unit, serial_number, axis, overlapping, level, sample_s, span_s, stretches,
        mean, taus_s, adev, ci, n, edf, noise, terms, misfit, minimum, warnings, findings,
        notes``: deviations and mean in deg/h, terms in their units, `noise` the kind of noise
        that each interval stands on.

    Raises
    ------
    InputError
        If the output is in counts without a scale factor, or the run is too short.
    """
    segments = _stretches_at_rest(run)
    if max((part.stop - part.start for part in segments), default=0) < 3:
        raise InputError(
            f"{run.name}: too short for an Allan deviation: at least 3 samples without a gap are "
            "needed; give a longer run"
        )
    sample_s = _sample_interval(run, segments)
    error = run.error_deg_h

    def allan(times: ArrayLike, overlap: bool) -> AllanResult:
        try:
            return allan_deviation(error, sample_s, times, overlap, segments=segments, level=LEVEL)
        except InputError as problem:
            raise InputError(f"{run.name}: {problem}") from None

    default = _default_times(sample_s, max(part.stop - part.start for part in segments))
    whole = allan(default, True)
    listed = whole if overlapping and taus is None else allan(default if taus is None else taus, overlapping)
    terms = noise_terms(whole, LEVEL)
    moving = _moving_temperatures(run)
    warnings = _warnings(run, moving, segments)
    return {
        "schema": SCHEMA,
        "run": run.name,
        "unit": "deg/h",
        "serial_number": run.facts.unit,
        "axis": run.facts.axis,
        "overlapping": overlapping,
        "level": LEVEL,
        "sample_s": sample_s,
        "span_s": run.span_s,
        "stretches": len(segments),
        "mean": float(np.mean(run.gyro_deg_h)),
        "taus_s": [float(f"{tau:.9g}") for tau in listed.taus_s],
        "adev": listed.adev.tolist(),
        "ci": np.column_stack((listed.lower, listed.upper)).tolist(),
        "n": listed.n.tolist(),
        "edf": listed.edf.tolist(),
        "noise": [NOISE_NAMES[exponent] for exponent in listed.exponent.tolist()],
        "terms": _terms(terms, moving),
        "misfit": terms.misfit,
        "minimum": {"adev": terms.minimum_adev, "tau_s": float(f"{terms.minimum_tau_s:.9g}")},
        "warnings": warnings,
        "findings": [finding.as_dict() for finding in run.findings],
        "notes": [
            *([run.facts.notes] if run.facts.notes else []),
            *(warning["message"] for warning in warnings),
        ],
    }


def _default_times(sample_s: float, samples: int) -> FloatArray:
    first, last = sample_s, sample_s * max(samples / 2, 1)
    decades = 10.0 ** np.arange(np.floor(np.log10(first)), np.ceil(np.log10(last)) + 1)
    times = np.outer(decades, _ROUND).ravel()
    # Round times only, brought to whole samples; the sample interval itself is the shortest.
    return np.union1d([sample_s], times[(times > first) & (times <= last)])


def _stretches_at_rest(run: Run) -> list[slice]:
    """Stretches, cut down to rows at rest where the table both turns and stands."""
    at_rest = np.abs(run.rate) < AT_REST_DEG_S
    if np.all(at_rest) or not np.any(at_rest):
        return list(run.stretches)
    edges = np.flatnonzero(np.diff(at_rest)) + 1
    bounds = np.union1d(np.concatenate(([0], edges, run.gap_starts)), [len(run)])
    return [slice(int(a), int(b)) for a, b in pairwise(bounds) if at_rest[a]]


def _sample_interval(run: Run, segments: list[slice]) -> float:
    """Median sample interval [s], or the mean within stretches where lost samples make that longer."""
    steps = sum(part.stop - 1 - part.start for part in segments)
    spent = sum(float(run.time[part.stop - 1] - run.time[part.start]) for part in segments)
    even = abs(spent / steps / run.sample_s - 1.0) < LOST
    # Times are rounded numbers, and so is their difference.
    return float(f"{run.sample_s if even else spent / steps:.9g}")


def _moving_temperatures(run: Run) -> dict[str, float]:
    """Temperatures of the unit that move, with their spans [degC].

    The chamber's air counts only where nothing else is recorded: a unit does not follow its
    regulator's cycle.
    """
    names = [name for name in run.temperature_columns if name != "T_chamber"] or list(run.temperature_columns)
    if not names:
        return {}
    window_s = min(60.0, run.span_s / 4)
    averages = block_averages(run.time, *(run.columns[name] for name in names), window_s=window_s)
    spans = {name: float(np.ptp(values)) for name, values in zip(names, averages.values)}
    return {name: span for name, span in spans.items() if span > MOVING_DEGC}


def _terms(found: NoiseTerms, moving: dict[str, float]) -> dict[str, dict[str, Any]]:
    terms: dict[str, dict[str, Any]] = {}
    for name, term in found.terms.items():
        if moving and name in ("K", "R"):
            terms[name] = {
                "value": None,
                "ci": [None, None],
                "unit": term.unit,
                "fitted": None,
                "reason": "not read from a run with moving temperature",
            }
            continue
        terms[name] = {
            "value": term.value,
            "ci": [term.lower, term.upper],
            "unit": term.unit,
            "fitted": term.fitted,
        }
    return terms


def _warnings(run: Run, moving: dict[str, float], segments: list[slice]) -> list[dict[str, str]]:
    warnings: list[dict[str, str]] = []
    if moving:
        spans = ", ".join(f"{name} by {span:.3g} degC" for name, span in moving.items())
        message = (
            f"The temperature moves ({spans}): rate random walk K and rate ramp R can't be told from drift "
            "and are not given, and long averaging times hold the drift; give a run at constant temperature."
        )
        warnings.append({"code": "moving_temperature", "message": message})
    if not np.all(np.abs(run.rate) < AT_REST_DEG_S):
        some = any(np.any(np.abs(run.rate[part]) < AT_REST_DEG_S) for part in segments)
        message = (
            "The table turns in part of the run: only rows at rest count."
            if some
            else "The table turns all through the run: its own noise and the scale factor's count too."
        )
        warnings.append({"code": "turning", "message": message})
    intervals = np.delete(np.diff(run.time), run.gap_starts - 1)
    if _spread(intervals) > UNEVEN * run.sample_s:
        message = (
            f"Samples are not evenly spaced: averaging times take them as {run.sample_s:.4g} s apart, as "
            "they are on average."
        )
        warnings.append({"code": "irregular_sampling", "message": message})
    return warnings


def _spread(intervals: NDArray[np.float64]) -> float:
    return float(intervals.std()) if len(intervals) else 0.0
