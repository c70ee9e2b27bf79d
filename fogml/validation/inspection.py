"""What is in a run, before any model: columns, span, temperatures, gaps, regimes, findings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.json_files import finite_json
from fogml.numerals import digits_between, number
from fogml.runs.columns import column_spec
from fogml.runs.regimes import regimes
from fogml.runs.run import Run
from fogml.runs.thermometers import leading_temperature
from fogml.signals import large
from fogml.signals.averages import block_averages

INSPECT_SCHEMA = "fogml.inspect/1"
RATE_WINDOW_S = 60.0
"""Temperature rates are slopes between averages over this time [s]."""
LONGEST_LIST = 1000
"""Gaps and regimes are listed up to this number; their count is always whole."""
STATISTICS = ("least", "greatest", "mean", "standard_deviation")
"""What is told of each column."""


def column_statistics(column: Mapping[str, Any], digits: int = 3) -> list[str]:
    """What is told of a column, `STATISTICS`, with digits that tell its ends apart."""
    more = digits_between(column["least"], column["greatest"], digits)
    *of_size, deviation = (column[key] for key in STATISTICS)
    return [*(number(value, more) for value in of_size), number(deviation, digits)]


def inspection_json(runs: Sequence[Run]) -> dict[str, Any]:
    """What is in each run as JSON-ready values, schema ``fogml.inspect/1``."""
    values: dict[str, Any] = {"schema": INSPECT_SCHEMA, "runs": [_run(run) for run in runs]}
    return finite_json(values)


def _run(run: Run) -> dict[str, Any]:
    return {
        "run": run.name,
        "rows": len(run),
        "span_s": run.span_s,
        "sample_s": run.sample_s,
        "serial_number": run.facts.unit,
        "axis": run.facts.axis,
        "facts": run.facts.as_dict(),
        "earth_rate_deg_h": run.facts.earth_rate_deg_h,
        "gyro_unit": run.gyro_unit,
        "columns": [_column(run, name, values) for name, values in run.without_dropouts.columns.items()],
        "temperatures": {name: _temperature(run, name) for name in run.temperature_columns},
        "gaps": _gaps(run),
        "regimes": _regimes(run),
        "findings": [finding.as_dict() for finding in run.findings],
        "sha256": run.hash,
    }


def _column(run: Run, name: str, values: FloatArray) -> dict[str, Any]:
    large.release()
    spec = column_spec(name)
    unit = run.gyro_unit if name == "gyro" else spec.internal if spec else None
    finite = np.isfinite(values)
    # Columns of which nothing is computed may hold infinite or missing values.
    told = finite.any()
    values = values if finite.all() or not told else values[finite]
    return {
        "name": name,
        "unit": unit,
        "meaning": spec.meaning
        if spec
        else "not a column of the run format; features that name it alone use it",
        "least": float(values.min()) if told else None,
        "greatest": float(values.max()) if told else None,
        "mean": _mean(values) if told else None,
        "standard_deviation": large.standard_deviation(values) if told else None,
    }


def _mean(values: FloatArray) -> float:
    """The mean, and 0 rather than what rounding leaves where values cancel."""
    mean, largest = float(values.mean()), float(max(-values.min(), values.max()))
    return 0.0 if abs(mean) <= np.finfo(np.float64).eps * largest else mean


def _temperature(run: Run, name: str) -> dict[str, Any]:
    """Range [degC] and fastest change [degC/min] of one temperature."""
    values = run.temperature(name)
    found: dict[str, Any] = {
        "least": float(values.min()),
        "greatest": float(values.max()),
        "span": float(np.ptp(values)),
        "fastest_rise": None,
        "fastest_fall": None,
    }
    means = block_averages(run.time, values, window_s=max(RATE_WINDOW_S, run.sample_s))
    if len(means) > 1:
        rates = np.diff(means.values[0]) / np.diff(means.time_s) * 60.0
        found["fastest_rise"] = float(max(rates.max(), 0.0))
        found["fastest_fall"] = float(min(rates.min(), 0.0))
    return found


def _gaps(run: Run) -> dict[str, Any]:
    after = run.gap_starts
    lengths = run.time[after] - run.time[after - 1]
    listed = [
        {"row": int(row) + 1, "after_s": float(run.time[row - 1]), "length_s": float(length)}
        for row, length in zip(after[:LONGEST_LIST], lengths[:LONGEST_LIST], strict=True)
    ]
    return {
        "count": len(after),
        "longest_s": float(lengths.max(initial=0.0)),
        "total_s": float(lengths.sum()),
        "stretches": len(run.stretches),
        "list": listed,
    }


def _regimes(run: Run) -> dict[str, Any]:
    """Time spent in each regime [s], and the regimes one after the other."""
    found = regimes(run)
    temperature = leading_temperature(run)
    # The time that a row stands for: up to the next row, gaps not counted.
    spent = np.zeros(len(found.names))
    for at, steps in large.differences(run.time):
        low, high = np.searchsorted(run.gap_starts - 1, [at, at + len(steps)])
        steps[run.gap_starts[low:high] - 1 - at] = run.sample_s
        spent += np.bincount(found.labels[at : at + len(steps)], steps, len(spent))
    spent[found.labels[-1]] += run.sample_s
    segments = []
    for name, start, stop in found.segments()[:LONGEST_LIST]:
        segment: dict[str, Any] = {
            "regime": name,
            "from_s": float(run.time[start]),
            "to_s": float(run.time[stop - 1]),
            "rows": int(stop - start),
        }
        if temperature is not None:
            segment["temperature_from"] = float(temperature[start])
            segment["temperature_to"] = float(temperature[stop - 1])
            segment["temperature_mean"] = float(temperature[start:stop].mean())
        segments.append(segment)
    return {
        "seconds": {name: float(time) for name, time in zip(found.names, spent, strict=True)},
        "count": len(found.segments()),
        "list": segments,
    }
