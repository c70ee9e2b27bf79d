"""What a noise report says beside the terms: its model, and whether what they assume holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.intervals import Z90
from fogml.numerals import percent, plural, short
from fogml.runs.noise_series import HOLD_ROWS, NoiseSeries
from fogml.runs.run import Run
from fogml.runs.steps import hardly_moved, recorded_step
from fogml.signals.distributions import chi2_sf
from fogml.signals.noise_terms import NoiseTerms
from fogml.signals.whiteness import Stationarity

DOUBT = 1e-3
"""Chance of a warning that a right model, or a steady run, gets."""
ROUNDED = 0.01
"""Share of N that rounding makes from which it is told."""
SLOW_FILTER = 0.1
"""Share of the longest run: terms behind a filter that hold from later on are of a drift (filters take s)."""
MOST_LINES = 5
"""Sinusoids that are listed."""
_URAD = np.pi / 180.0 / 3600.0 * 1e6


def gaps_of(runs: Sequence[Run]) -> dict[str, Any]:
    """Number of gaps and what they lost [s]."""
    lost = [
        float(np.sum(run.time[run.gap_starts] - run.time[run.gap_starts - 1] - run.sample_s)) for run in runs
    ]
    return {"count": sum(len(run.gap_starts) for run in runs), "lost_s": sum(lost)}


def model_told(terms: NoiseTerms, taus_s: FloatArray, series: NoiseSeries) -> dict[str, Any]:
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


def words_of(terms: NoiseTerms, series: NoiseSeries, runs: Sequence[Run]) -> list[str]:
    """What a reader should know of the data before the figures."""
    words = []
    if series.hold != 1.0:
        words.append(
            f"Each value stands for {short(series.hold)} samples: the log reads faster than the gyro gives "
            f"new values, every {short(series.new_s)} s. Terms are of the new values."
        )
    told = model_told(terms, np.array([series.sample_s]), series)["filter"]
    if told is not None and told["kind"] == "other":
        words.append(
            f"Above {short(told['above_hz'])} Hz the spectrum has a form of its own (a filter, a dither, a "
            f"resonance): it is left out, and the terms hold for averaging "
            f"times from {short(terms.holds_from_s)} s on."
        )
    elif told is not None:
        corner = f" at {short(told['corner_hz'])} Hz" if told["corner_hz"] else ""
        words.append(
            f"The output is filtered ({told['words']}{corner}): terms are of the noise ahead of the filter, "
            f"and the Allan deviation shows them from {short(max(terms.holds_from_s, series.new_s))} s on."
        )
        longest = max(float(np.ptp(run.time)) for run in runs)
        if terms.holds_from_s > SLOW_FILTER * longest:
            words.append(
                "No gyro's filter is that slow against its run: the output drifts, as with a temperature "
                "that is not recorded, and N is that drift's. For N record it, or keep it constant."
            )
    gaps = gaps_of(runs)
    if gaps["count"]:
        words.append(
            f"{plural(gaps['count'], 'gap')} ({short(gaps['lost_s'], 4)} s lost): no average and no "
            "difference crosses one."
        )
    return words


def coarse_steps(series: NoiseSeries) -> list[dict[str, str]]:
    """A warning where samples hardly leave a step of the output, so that its rounding is no white noise."""
    values = max(series.stretches, key=len)[:HOLD_ROWS]
    step = recorded_step(values)
    if not hardly_moved(values, step):
        return []
    angle = step * series.new_s
    message = (
        f"The output comes in steps of {short(step)} deg/h ({short(angle)} arcsec a sample), and its noise "
        "hardly moves it from one to the next: what rounding makes is then no white noise, and Q and N may "
        "be off by more than their intervals. Steps of an angle make a Q of "
        f"{short(angle * _URAD / 12.0**0.5)} urad; record more slowly, or finer, for N."
    )
    return [{"code": "coarse_steps", "message": message}]


def rounded_log(series: NoiseSeries, terms: NoiseTerms) -> list[dict[str, str]]:
    """A warning where the steps that an output is logged in, if rounded to, make part of N."""
    step = recorded_step(max(series.stretches, key=len)[:HOLD_ROWS])
    white = 3600.0 * terms.terms["N"].fitted ** 2 / series.new_s
    # What is rounded is even over a step; an angle that is counted makes Q instead.
    share = step**2 / 12.0 / white if white > 0.0 else 0.0
    less = 1.0 - max(1.0 - share, 0.0) ** 0.5
    if less < ROUNDED or share >= 1.0 or terms.terms["Q"].lower > 0.0:
        return []
    message = (
        f"The output comes in steps of {short(step)} deg/h: if the log rounds to them, and no angle is "
        f"counted, N holds the rounding too, and that of the gyro itself is {percent(less)} less."
    )
    return [{"code": "rounded_log", "message": message}]


def doubts_of(
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
                    f"{percent(2.0 * terms.misfit)} where chance explains less (p = "
                    f"{short(terms.fit_p_value, 1)}). "
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
                    f"The noise changes during the run: its size at {short(steady.tau_s)} s in the three "
                    f"thirds is {thirds} of the whole run's (p = {short(steady.p_value, 1)}). "
                    "The terms are means over it."
                ),
            }
        )
    if alone:
        told = [term for one in alone if (term := one.terms["N"]).lower > 0.0]
        logarithms = np.array([np.log(term.fitted) for term in told])
        errors = np.array([np.log(term.upper / term.lower) for term in told]) / (2.0 * Z90)
        if len(told) > 1:
            mean = np.average(logarithms, weights=errors**-2)
            p_value = float(chi2_sf(float(np.sum(((logarithms - mean) / errors) ** 2)), len(told) - 1))
            if p_value < DOUBT:
                span = f"{short(np.exp(logarithms.min()))} to {short(np.exp(logarithms.max()))}"
                warnings.append(
                    {
                        "code": "replicates_differ",
                        "message": (
                            f"The runs do not share one N: alone they give {span} deg/sqrt(h) "
                            f"(p = {short(p_value, 1)}). Look at each run's terms, not at the shared ones."
                        ),
                    }
                )
    return warnings
