"""Allan deviation and noise terms of a run, gaps and moving temperature respected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogml.errors import InputError
from fogml.runs.run import FloatArray, Run
from fogml.signals.allan import AllanResult, allan_deviation
from fogml.signals.averages import block_averages
from fogml.signals.holds import hold_of
from fogml.signals.noise_spectrum import Spectrum, spectrum_of
from fogml.signals.noise_terms import NoiseTerms, noise_terms
from fogml.signals.stationarity import Stationarity, stationarity

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
DOUBT = 1e-3
"""Chance of a warning that a right model, or a steady run, gets."""
SAME_INTERVAL = 0.01
"""Relative difference of sample intervals up to which runs may share terms."""
HOLD_ROWS = 100_000
"""Samples that are enough to tell whether a log repeats values."""
MOST_LINES = 5
"""Sinusoids that are listed."""
Z90 = 1.6448536269514722
NOISE_NAMES = {2: "quantisation", 0: "white", -1: "flicker", -2: "random walk"}
"""Kinds of noise by the exponent of the rate's power spectral density."""
_ROUND = np.array([1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0])


@dataclass(frozen=True)
class _Series:
    """A run's samples that count: those that are new, by stretches without gaps."""

    run: Run
    sample_s: float
    segments: list[slice]
    hold: float
    stretches: list[FloatArray]
    times: list[FloatArray]

    @property
    def new_s(self) -> float:
        """Interval between new values [s]."""
        return self.sample_s * self.hold


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
    runs = [run] if isinstance(run, Run) else list(run)
    if not runs:
        raise InputError("no run is given; name one")
    series = [_series(one) for one in runs]
    first = series[0]
    for other in series[1:]:
        if abs(other.new_s / first.new_s - 1.0) > SAME_INTERVAL:
            raise InputError(
                f"{other.run.name}: new values {other.new_s:g} s apart, in {first.run.name} {first.new_s:g} "
                "s: runs can share noise terms only at one sample interval; give them one by one"
            )
    values, segments = _joined(series)

    def allan(times: ArrayLike, overlap: bool) -> AllanResult:
        try:
            return allan_deviation(values, first.sample_s, times, overlap, segments=segments, level=LEVEL)
        except InputError as problem:
            raise InputError(f"{first.run.name}: {problem}") from None

    default = _default_times(first.sample_s, max(part.stop - part.start for part in segments))
    whole = allan(default, True)
    listed = whole if overlapping and taus is None else allan(default if taus is None else taus, overlapping)
    terms = noise_terms(_spectrum(series), whole, LEVEL, least_tau_s=first.new_s)
    moving: dict[str, float] = {}
    for one in runs:
        moving |= _moving_temperatures(one)
    alone = [_alone(one) for one in series] if len(series) > 1 else []
    steady = stationarity(first.stretches, first.new_s) if len(series) == 1 else None
    warnings = [
        *(
            warning
            for one in series
            for warning in _warnings(one.run, _moving_temperatures(one.run), one.segments)
        ),
        *_doubts(terms, steady, alone),
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
        "gaps": _gaps(runs),
        "mean": float(np.mean(np.concatenate([one.gyro_deg_h for one in runs]))),
        "taus_s": [float(f"{tau:.9g}") for tau in listed.taus_s],
        "adev": listed.adev.tolist(),
        "ci": np.column_stack((listed.lower, listed.upper)).tolist(),
        "n": listed.n.tolist(),
        "edf": listed.edf.tolist(),
        "noise": [NOISE_NAMES[exponent] for exponent in listed.exponent.tolist()],
        "terms": _terms(terms, moving),
        **_model(terms, listed.taus_s, first),
        "stationarity": None if steady is None else asdict(steady),
        "minimum": {"adev": terms.minimum_adev, "tau_s": float(f"{terms.minimum_tau_s:.9g}")},
        "runs": [{"run": one.run.name, "terms": _terms(told, moving)} for one, told in zip(series, alone)],
        "warnings": warnings,
        "findings": [finding.as_dict() for one in runs for finding in one.findings],
        "notes": [*notes, *_words(terms, first, runs), *(warning["message"] for warning in warnings)],
    }


def _series(run: Run) -> _Series:
    segments = _stretches_at_rest(run)
    if max((part.stop - part.start for part in segments), default=0) < 3:
        raise InputError(
            f"{run.name}: too short for an Allan deviation: at least 3 samples without a gap are "
            "needed; give a longer run"
        )
    sample_s = _sample_interval(run, segments)
    error = run.error_deg_h
    longest = max(segments, key=lambda part: part.stop - part.start)
    hold = hold_of(error[longest][:HOLD_ROWS]).samples
    if hold == 1.0:
        return _Series(
            run, sample_s, segments, 1.0, [error[s] for s in segments], [run.time[s] for s in segments]
        )
    rows = [s.start + hold_of(error[s]).rows for s in segments]
    return _Series(run, sample_s, segments, hold, [error[r] for r in rows], [run.time[r] for r in rows])


def _joined(series: Sequence[_Series]) -> tuple[FloatArray, list[slice]]:
    """Errors of all runs one after the other, and their stretches."""
    if len(series) == 1:
        return series[0].run.error_deg_h, series[0].segments
    starts = np.cumsum([0, *(len(one.run) for one in series[:-1])]).tolist()
    segments = [
        slice(at + part.start, at + part.stop) for at, one in zip(starts, series) for part in one.segments
    ]
    return np.concatenate([one.run.error_deg_h for one in series]), segments


def _spectrum(series: Sequence[_Series]) -> Spectrum:
    """Spectrum of all stretches, each run with a ramp of its own."""
    columns = []
    for place, one in enumerate(series):
        for time in one.times:
            ramp = np.zeros((len(time), len(series)))
            ramp[:, place] = time
            columns.append(ramp)
    stretches = [part for one in series for part in one.stretches]
    return spectrum_of(stretches, series[0].new_s, columns)


def _alone(series: _Series) -> NoiseTerms:
    values, segments = _joined([series])
    times = _default_times(series.sample_s, max(part.stop - part.start for part in segments))
    allan = allan_deviation(values, series.sample_s, times, segments=segments, level=LEVEL)
    return noise_terms(_spectrum([series]), allan, LEVEL, least_tau_s=series.new_s)


def _gaps(runs: Sequence[Run]) -> dict[str, Any]:
    """Number of gaps and what they lost [s]."""
    lost = [
        float(np.sum(run.time[run.gap_starts] - run.time[run.gap_starts - 1] - run.sample_s)) for run in runs
    ]
    return {"count": sum(len(run.gap_starts) for run in runs), "lost_s": sum(lost)}


def _model(terms: NoiseTerms, taus_s: FloatArray, series: _Series) -> dict[str, Any]:
    """What the fit says beside the terms."""
    told: dict[str, Any] = {
        "misfit": terms.misfit,
        "fit_p_value": terms.fit_p_value,
        "holds_from_s": max(terms.holds_from_s, series.new_s),
        "filter": None,
        "hold": None if series.hold == 1.0 else {"samples": series.hold, "interval_s": series.new_s},
        "correlated": None,
        "sinusoids": [],
        "model": {
            "adev": terms.deviation(taus_s).tolist(),
            "ahead_of_filter": terms.deviation(taus_s, filtered=False).tolist(),
        },
    }
    if terms.search is None:
        return told
    best, sample_s = terms.search.best, terms.search.spectrum.sample_s
    corner = best.filter.corner_cycles(best.log_corner)
    if best.filter.kind != "none":
        told["filter"] = {
            "kind": best.filter.kind,
            "order": best.filter.order,
            "words": best.filter.words(),
            "corner_hz": None if corner is None else corner / sample_s,
            "probability": float(
                sum(
                    weight
                    for candidate, weight in zip(terms.search.candidates, terms.search.weights)
                    if candidate.fit.filter.kind == best.filter.kind
                    and candidate.fit.filter.order == best.filter.order
                )
            ),
        }
    elif not np.all(best.used):
        top = float(terms.search.spectrum.frequency_hz[best.used].max())
        told["filter"] = {
            "kind": "other",
            "words": "of no form that is known here",
            "corner_hz": None,
            "above_hz": top,
        }
    if best["G"] > 0.0:
        told["correlated"] = {
            "deviation": float(np.sqrt(best["G"])),
            "correlation_s": best.terms.correlation_s,
        }
    told["sinusoids"] = [asdict(line) for line in terms.search.spectrum.lines[:MOST_LINES]]
    return told


def _words(terms: NoiseTerms, series: _Series, runs: Sequence[Run]) -> list[str]:
    """What a reader should know of the data before the figures."""
    words = []
    if series.hold != 1.0:
        words.append(
            f"Each value stands for {series.hold:.3g} samples: the log reads faster than the gyro gives new "
            f"values, every {series.new_s:.3g} s. Terms are of the new values."
        )
    told = _model(terms, np.array([series.sample_s]), series)["filter"]
    if told is not None and told["kind"] == "other":
        words.append(
            f"Above {told['above_hz']:.3g} Hz the spectrum has a form of its own (a filter, a dither, a "
            f"resonance): it is left out, and the terms hold for averaging "
            f"times from {terms.holds_from_s:.3g} s on."
        )
    elif told is not None:
        corner = f" at {told['corner_hz']:.3g} Hz" if told["corner_hz"] else ""
        words.append(
            f"The output is filtered ({told['words']}{corner}): terms are of the noise ahead of the "
            f"filter, and the Allan deviation "
            f"shows them from {max(terms.holds_from_s, series.new_s):.3g} s on."
        )
    gaps = _gaps(runs)
    if gaps["count"]:
        words.append(
            f"{gaps['count']} gaps ({gaps['lost_s']:.4g} s lost): no average and no difference crosses one."
        )
    return words


def _doubts(
    terms: NoiseTerms, steady: Stationarity | None, alone: Sequence[NoiseTerms]
) -> list[dict[str, str]]:
    """Warnings on what the terms assume."""
    warnings = []
    if terms.fit_p_value < DOUBT:
        warnings.append(
            {
                "code": "model_misfit",
                "message": (
                    "The noise model does not describe this run: its spectrum is off by "
                    f"{2.0 * terms.misfit:.1%} where chance explains less (p = {terms.fit_p_value:.1g}). "
                    "Intervals are widened by that; look at the plot for where."
                ),
            }
        )
    if steady is not None and steady.p_value < DOUBT:
        thirds = ", ".join(f"{share:.2f}" for share in steady.thirds)
        warnings.append(
            {
                "code": "not_stationary",
                "message": (
                    f"The noise changes during the run: its size at {steady.tau_s:.3g} s in the three "
                    f"thirds is {thirds} of the whole run's (p = {steady.p_value:.1g}). "
                    "The terms are means over it."
                ),
            }
        )
    if alone:
        from scipy.stats import chi2

        told = [term for one in alone if (term := one.terms["N"]).lower > 0.0]
        logarithms = np.array([np.log(term.fitted) for term in told])
        errors = np.array([np.log(term.upper / term.lower) for term in told]) / (2.0 * Z90)
        if len(told) > 1:
            mean = np.average(logarithms, weights=errors**-2)
            p_value = float(chi2.sf(float(np.sum(((logarithms - mean) / errors) ** 2)), len(told) - 1))
            if p_value < DOUBT:
                span = f"{np.exp(logarithms.min()):.3g} to {np.exp(logarithms.max()):.3g}"
                warnings.append(
                    {
                        "code": "replicates_differ",
                        "message": (
                            f"The runs do not share one N: alone they give {span} deg/sqrt(h) "
                            f"(p = {p_value:.1g}). Look at each run's terms, not at the shared ones."
                        ),
                    }
                )
    return warnings


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
