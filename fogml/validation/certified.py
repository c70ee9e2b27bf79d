"""What a certificate states of a run: set-up, and figures with their uncertainty."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.runs.temperature_motion import LEAST_TRAVEL_DEGC
from fogml.signals.averages import freedom_of_deviation
from fogml.signals.distributions import deviation_within
from fogml.validation.results import RunJudgement


@dataclass(frozen=True)
class Deviation:
    """Standard deviation of n averages over n - 1 [deg/h], and its 90 % interval.

    The interval is by chi-square with the degrees of freedom that the averages' spectrum leaves
    (`fogml.signals.averages.freedom_of_deviation`): n - 1 where they are independent, fewer where the bias
    wanders. Under a strong random walk it holds two thirds to four fifths.
    """

    value: float
    ci90: tuple[float, float]
    n: int


def sample_deviation(values: FloatArray) -> Deviation | None:
    """Of averages [deg/h], shape (n,); None of fewer than three."""
    if len(values) < 3:
        return None
    value = float(np.std(values, ddof=1))
    return Deviation(value, deviation_within(value, freedom_of_deviation(values)), len(values))


def at_constant_temperature(run: RunJudgement) -> FloatArray | None:
    """Averages after compensation in the longest soak [deg/h], shape (m,); None where there is no soak.

    Of one in which temperature went further than a wobble of a stay, so slowly that no ramp was told or
    during a gap, it is the longest part in which it did not.
    """
    temperature, is_soak = run.series.temperature, run.series.regime == "soak"
    best, first, least, most = slice(0, 0), 0, np.inf, -np.inf
    for place, (value, stays) in enumerate(zip(temperature.tolist(), is_soak.tolist())):
        if not stays:
            first, least, most = place + 1, np.inf, -np.inf
            continue
        least, most = min(least, value), max(most, value)
        while most - least > LEAST_TRAVEL_DEGC:
            first += 1
            held = temperature[first : place + 1]
            least, most = float(held.min()), float(held.max())
        if place + 1 - first > best.stop - best.start:
            best = slice(first, place + 1)
    return np.asarray(run.series.after[best]) if best.stop else None


def over_temperature(run: RunJudgement) -> Deviation | None:
    """Bias stability over temperature: of all averages after compensation."""
    return sample_deviation(run.series.after)


def held_constant(run: RunJudgement) -> Deviation | None:
    """Bias stability at constant temperature: in the longest soak."""
    values = at_constant_temperature(run)
    return None if values is None else sample_deviation(values)


def of_10_s(run: RunJudgement) -> Deviation | None:
    """Bias stability of 10 s averages; None where samples are too far apart or too few."""
    stability, n = run.after.bias_stability_10s, run.short_averages
    if stability is None or n < 3:
        return None
    # The figures' own is over n.
    value = stability * float(np.sqrt(n / (n - 1)))
    return Deviation(value, deviation_within(value, run.short_freedom or n - 1.0), n)


def set_up(run: RunJudgement) -> dict[str, Any]:
    """Where the data come from, start, span, rates and attitude, ready for JSON."""
    series, facts = run.series, run.facts
    attitude = facts.as_dict()
    return {
        "synthetic": facts.synthetic,
        "started": attitude.get("started"),
        "span_h": float(np.ptp(series.time) + run.averaging_s) / 3600.0,
        "temperature_degC": [float(series.temperature.min()), float(series.temperature.max())],
        "temperature_rate_degC_min": float(np.abs(series.rate).max(initial=0.0)),
        "table_rate_deg_s": None if run.table_rates is None else list(run.table_rates),
        "input_axis": attitude.get("input_axis"),
        "latitude": facts.latitude,
    }


def with_uncertainty(run: RunJudgement) -> dict[str, Any]:
    """Figures after compensation over n - 1 with their intervals [deg/h], ready for JSON.

    Null where the run does not tell; ``scale_factor_error_se`` and its interval's half-width are in ppm.
    """
    figures = {
        "bias_stability_over_temperature": over_temperature(run),
        "bias_stability_at_constant_temperature": held_constant(run),
        "bias_stability_10s": of_10_s(run),
    }
    told = {name: None if found is None else asdict(found) for name, found in figures.items()}
    return {
        **told,
        "scale_factor_error_se": run.scale_factor_se,
        "scale_factor_error_half_width_90": run.scale_factor_half_width,
    }
