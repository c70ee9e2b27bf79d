"""Allan deviation and noise terms of a run, as ``noise.json`` gives them."""

from __future__ import annotations

from typing import Any

import numpy as np

from fogml.runs.run import FloatArray, Run
from fogml.signals.allan import AllanResult, allan_deviation
from fogml.signals.noise_terms import NoiseTerms, noise_terms
from fogml.validation.report_json import finite_json

NOISE_SCHEMA = "fogml.noise/1"
LEVEL = 0.9
"""Coverage of the intervals."""
MOVING_DEGC = 1.0
"""Temperature span from which K and R are the drift's and not the noise's [degC]."""
ROUND_TIMES = (1.0, 2.0, 3.0, 6.0)
"""Averaging times in each decade [s] beside the octaves: 1, 10 and 60 s are asked for by name."""
IRREGULAR = 0.01
"""Relative spread of the sample intervals within stretches from which the run says so."""


def noise_json(run: Run, *, overlapping: bool = True) -> dict[str, Any]:
    """Allan deviation and noise terms of a run as JSON-ready values, schema ``fogml.noise/1``.

    The reference rate is taken off first. Stretches between gaps are never joined. The terms are
    always read from overlapping windows at octaves.

    Parameters
    ----------
    overlapping
        Whether the windows of ``adev`` overlap.

    Raises
    ------
    InputError
        If the output is in counts without a scale factor, or the run is too short.
    """
    error = run.error_deg_h
    octaves = _allan(run, error, "octave")
    shown = _allan(run, error, _times(octaves), overlapping)
    terms = noise_terms(octaves, level=LEVEL)
    moving = bool(run.temperature_columns) and float(np.ptp(run.temperature("T"))) > MOVING_DEGC
    values = {
        "schema": NOISE_SCHEMA,
        "run": run.name,
        "unit": "deg/h",
        "serial_number": run.facts.unit,
        "axis": run.facts.axis,
        "overlapping": overlapping,
        "level": LEVEL,
        "sample_s": run.sample_s,
        "span_s": run.span_s,
        "stretches": len(run.stretches),
        # Sample intervals are differences of times; their rounding is no part of the averaging time.
        "taus_s": [float(f"{tau:.9g}") for tau in shown.taus_s],
        "adev": shown.adev,
        "ci": np.column_stack((shown.lower, shown.upper)),
        "n": shown.n,
        "terms": _terms(terms, moving),
        "misfit": terms.misfit,
        "minimum": {"adev": terms.minimum_adev, "tau_s": terms.minimum_tau_s},
        "findings": [finding.as_dict() for finding in run.findings],
        "notes": _notes(run, moving),
    }
    return finite_json(values)


def _allan(run: Run, error: FloatArray, taus: Any, overlapping: bool = True) -> AllanResult:
    return allan_deviation(error, run.sample_s, taus, overlapping, segments=run.stretches, level=LEVEL)


def _times(octaves: AllanResult) -> FloatArray:
    """The octaves and round times between them [s]."""
    first, last = octaves.taus_s[0], octaves.taus_s[-1]
    decades = 10.0 ** np.arange(np.floor(np.log10(first)), np.ceil(np.log10(last)) + 1)
    round_times = np.outer(decades, ROUND_TIMES).ravel()
    inside = round_times[(round_times >= first) & (round_times <= last)]
    return np.union1d(octaves.taus_s, inside)


def _terms(found: NoiseTerms, moving: bool) -> dict[str, Any]:
    terms = {}
    for name, term in found.terms.items():
        values: dict[str, Any] = {
            "value": term.value,
            "ci": [term.lower, term.upper],
            "unit": term.unit,
            "fitted": term.fitted,
        }
        if moving and name in ("K", "R"):
            values |= {"value": None, "ci": [None, None]}
        terms[name] = values
    return terms


def _notes(run: Run, moving: bool) -> list[str]:
    notes = [run.facts.notes] if run.facts.notes else []
    if moving:
        notes.append(
            f"The temperature moves by {np.ptp(run.temperature('T')):.3g} degC: rate random walk K and rate "
            "ramp R can't be told from drift and are not given; give a run at constant temperature."
        )
    intervals = np.delete(np.diff(run.time), run.gap_starts - 1)
    if len(intervals) and float(intervals.std()) > IRREGULAR * run.sample_s:
        notes.append(
            f"Samples are not evenly spaced; averaging times take them as {run.sample_s:.6g} s apart."
        )
    return notes
