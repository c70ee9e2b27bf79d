"""The page of ``fogml inspect``: what is in the runs, before any model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from fogml.arrays import FloatArray, IndexArray
from fogml.numerals import MISSING, duration, listed, number, percent, plural, stated
from fogml.report import style
from fogml.report.page import Drawing, Tile, render
from fogml.report.style import Segment, in_order, regime_word, rounded_up, shade, time_unit
from fogml.report.tables import Table, noticed
from fogml.runs.regimes import regimes
from fogml.runs.run import Run
from fogml.signals import large
from fogml.signals.averages import block_averages
from fogml.signals.drawn import drawn
from fogml.validation.inspection import column_statistics, inspection_json

_REGIMES_LISTED = 40
_GAPS_LISTED = 12


def inspect_page(runs: Run | Sequence[Run], inspection: Mapping[str, Any] | None = None) -> str:
    """The self-contained HTML page of what is in runs.

    Parameters
    ----------
    runs
        The runs, for the figures.
    inspection
        Their values in schema ``fogml.inspect/1``; made from the runs where not given.
    """
    runs = [runs] if isinstance(runs, Run) else list(runs)
    values = inspection_json(runs) if inspection is None else inspection
    inspected = [
        _inspected(index, run, told)
        for index, (run, told) in enumerate(zip(runs, values["runs"], strict=True), start=1)
    ]
    name = listed([run.name for run in runs])
    return render("inspect.html", title=f"{name} – what is in it", name=name, runs=inspected)


def _inspected(index: int, run: Run, told: Mapping[str, Any]) -> dict[str, Any]:
    """What the page shows of one run."""
    segments, gaps = told["regimes"]["list"], told["gaps"]["list"]
    return {
        "name": run.name,
        "anchor": f"run-{index}",
        "verdict": _verdict(told),
        "tiles": _tiles(told),
        "drawing": recording(run),
        "columns": _columns(told),
        "regimes": _regimes(segments[:_REGIMES_LISTED]),
        "regimes_more": max(int(told["regimes"]["count"]) - _REGIMES_LISTED, 0),
        "gaps": _gaps(gaps[:_GAPS_LISTED]),
        "gaps_more": max(int(told["gaps"]["count"]) - _GAPS_LISTED, 0),
        "findings": noticed(told["findings"]),
        "about": _about(told),
    }


def _verdict(told: Mapping[str, Any]) -> str:
    spans = [
        f"{name} from {number(found['least'])} to {number(found['greatest'])} °C"
        for name, found in told["temperatures"].items()
    ]
    seconds = told["regimes"]["seconds"]
    total = sum(seconds.values())
    spent = [
        f"{_stay_word(name, bool(spans))} {percent(seconds[name] / total)}"
        for name in in_order(name for name, time in seconds.items() if time and total)
    ]
    parts = [f"{plural(told['rows'], 'sample')} over {duration(told['span_s'])}"]
    parts.append(listed(spans, 6) if spans else "no temperature recorded")
    if spent:
        parts.append(listed(spent, 6))
    found = len(told["findings"])
    return (
        "; ".join(parts) + ". " + (f"{plural(found, 'finding')} below." if found else "Nothing was noticed.")
    )


def _stay_word(regime: str, with_temperature: bool) -> str:
    """A regime in words; without temperatures no stay is known to be a soak."""
    return regime_word(regime) if with_temperature or regime != "soak" else "at rest"


def _tiles(told: Mapping[str, Any]) -> list[Tile]:
    gaps = told["gaps"]
    rates = [found for found in told["temperatures"].values() if found["fastest_rise"] is not None]
    tiles = [
        Tile("Span", duration(told["span_s"]), note=plural(told["rows"], "sample")),
        Tile("Sample interval", duration(told["sample_s"]), note="median"),
        Tile(
            "Gaps",
            str(gaps["count"]),
            "",
            f"the longest {duration(gaps['longest_s'])}" if gaps["count"] else "over 3 median intervals",
        ),
    ]
    if told["temperatures"]:
        widest = max(told["temperatures"].items(), key=lambda item: item[1]["span"])
        tiles.append(Tile("Temperature span", number(widest[1]["span"]), "°C", widest[0]))
    if rates:
        rise, fall = max(r["fastest_rise"] for r in rates), min(r["fastest_fall"] for r in rates)
        tiles.append(
            Tile(
                "Fastest change",
                number(max(rise, -fall)),
                "°C/min",
                f"rise {number(rise)}, fall {number(fall)}",
            )
        )
    return tiles


def _columns(told: Mapping[str, Any]) -> Table:
    rows = [
        (
            column["name"],
            column["unit"] or MISSING,
            *column_statistics(column, 4),
            column["meaning"],
        )
        for column in told["columns"]
    ]
    return Table("Column | Unit | >Least | >Greatest | >Mean | >Standard deviation | What it is", rows)


def _regimes(segments: Sequence[Mapping[str, Any]]) -> Table | None:
    if not segments:
        return None
    with_temperature = "temperature_from" in segments[0]
    temperatures = " | >T from [°C] | >T to [°C] | >T mean [°C]" if with_temperature else ""
    rows = []
    for segment in segments:
        cells = [
            _stay_word(segment["regime"], with_temperature),
            stated(round(segment["from_s"], 3)),
            stated(round(segment["to_s"], 3)),
            duration(segment["to_s"] - segment["from_s"]),
        ]
        if with_temperature:
            cells += [number(segment[f"temperature_{end}"], 4) for end in ("from", "to", "mean")]
        rows.append(tuple(cells))
    return Table(f"Regime | >From [s] | >To [s] | >Lasts{temperatures}", rows)


def _gaps(gaps: Sequence[Mapping[str, Any]]) -> Table | None:
    if not gaps:
        return None
    rows = [(str(gap["row"]), stated(round(gap["after_s"], 3)), duration(gap["length_s"])) for gap in gaps]
    return Table(">First row after the gap | >Begins after [s] | >Lasts", rows)


def _about(told: Mapping[str, Any]) -> list[tuple[str, str]]:
    rows = [(key.replace("_", " "), str(value)) for key, value in told["facts"].items()]
    earth = told["earth_rate_deg_h"]
    known = "not known; latitude and input_axis in the side file tell it" if earth is None else ""
    rows.append(("Earth rate along the input axis", known or f"{number(earth, 5)} deg/h"))
    rows.append(("SHA-256 of the columns", str(told["sha256"])))
    return rows


RATE_WINDOW_S = 60.0
_BRIDGED = 5.0
"""Averages are joined over gaps up to this many averaging times."""
_AVERAGES = 1000


def recording(run: Run) -> Drawing:
    """Output, temperatures, table rate and temperature rates of a run in time, regimes shaded."""
    rates = temperature_rates(run)
    shown = {
        f"gyro [{run.gyro_unit}]": True,
        (warmth := "temperature [°C]"): bool(run.temperature_columns),
        (change := "change [°C/min]"): bool(rates),
        (table := "table [deg/s]"): bool(np.any(run.rate)),
    }
    rows = [title for title, there in shown.items() if there]
    per_unit, unit = time_unit(run.span_s)
    figure = style.stacked({**dict.fromkeys(rows, 1.2), rows[0]: 1.6}, f"time [{unit}]", 0.035)
    time = large.each(lambda seconds: seconds / per_unit, run.time)
    _output(figure, run, time, per_unit)
    for index, name in enumerate(run.temperature_columns):
        looks = style.SERIES[index % 7], 1.6, style.DASHES[index % 7]
        x, y = drawn(time, run.temperature(name), gaps=run.gap_starts)
        trace = style.line(x, y, name, *looks, legendgroup=name, showlegend=True)
        figure.add_trace(trace, rows.index(warmth) + 1, 1)
        if name in rates:
            rate_time, rate, gaps = rates[name]
            x, y = drawn(rate_time / per_unit, rate, gaps=gaps)
            trace = style.line(x, y, name, *looks, legendgroup=name, showlegend=False)
            figure.add_trace(trace, rows.index(change) + 1, 1)
    if table in rows:
        x, y = drawn(time, run.rate, gaps=run.gap_starts)
        trace = style.line(x, y, "table rate", style.BLACK, 1.2, showlegend=False)
        figure.add_trace(trace, rows.index(table) + 1, 1)
    named = shade(figure, regime_segments(run, per_unit))
    style.styled(figure, 120 + 165 * len(rows), hovermode="x", legend={"y": 1.06})
    words = ", ".join(regime_word(name) for name in named) or "none"
    held = {name: run.temperature(name) for name in run.temperature_columns}
    spans = [f"{name} {number(float(x.min()))} to {number(float(x.max()))} °C" for name, x in held.items()]
    broken = f"{plural(len(run.gap_starts), 'gap')}, drawn as gaps. " if len(run.gap_starts) else ""
    return Drawing(
        figure,
        alt=(
            f"{run.name} over {duration(run.span_s)}: output from {number(float(run.gyro.min()))} to "
            f"{number(float(run.gyro.max()))} {run.gyro_unit}"
            + (f"; {listed(spans, 8)}" if spans else "")
            + f". Bands behind: {words}."
        ),
        caption=(
            f"Every sample's extremes are kept in the drawing. {broken}"
            + (f"Change: slope between averages over {number(_rate_window(run))} s. " if rates else "")
            + f"Shaded: {words}."
        ),
    )


def _output(figure: go.Figure, run: Run, time: FloatArray, per_unit: float) -> None:
    x, y = drawn(time, run.gyro, gaps=run.gap_starts)
    figure.add_trace(style.line(x, y, "output, all samples", style.TRAINING, 0.8), 1, 1)
    window_s = rounded_up(max(run.span_s / _AVERAGES, 20.0 * run.sample_s, 1e-6))
    means = block_averages(run.time, run.gyro, window_s=window_s) if run.span_s > 4.0 * window_s else None
    if means is not None and len(means) > 2:
        gaps = np.flatnonzero(np.diff(means.time_s) > _BRIDGED * window_s) + 1
        x, y = drawn(means.time_s / per_unit, means.values[0], gaps=gaps)
        name = f"output, {number(window_s)} s averages"
        figure.add_trace(style.line(x, y, name, style.BEFORE, 1.6), 1, 1)


def _rate_window(run: Run) -> float:
    return max(RATE_WINDOW_S, rounded_up(max(2.0 * run.sample_s, run.span_s / _AVERAGES, 1e-6)))


def temperature_rates(run: Run) -> dict[str, tuple[FloatArray, FloatArray, IndexArray]]:
    """Per temperature the times [s] and rates [degC/min] between averages, and where gaps end."""
    names = run.temperature_columns
    if not names:
        return {}
    means = block_averages(run.time, *(run.temperature(name) for name in names), window_s=_rate_window(run))
    if len(means) < 3:
        return {}
    steps = np.diff(means.time_s)
    middle = 0.5 * (means.time_s[1:] + means.time_s[:-1])
    near = steps <= 1.5 * np.median(steps)
    gaps = np.flatnonzero(np.diff(np.cumsum(~near)[near]) > 0) + 1
    return {
        name: (middle[near], (60.0 * np.diff(values) / steps)[near], gaps)
        for name, values in zip(names, means.values, strict=True)
    }


def regime_segments(run: Run, per_unit: float) -> list[Segment]:
    """The regimes of a run on a time axis of so many seconds per unit; no soaks without temperatures."""
    last = len(run) - 1
    return [
        (name, float(run.time[start]) / per_unit, float(run.time[min(stop, last)]) / per_unit)
        for name, start, stop in regimes(run).segments()
        if run.temperature_columns or name != "soak"
    ]
