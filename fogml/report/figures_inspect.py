"""Figures of a run as it was recorded: output, temperatures, rate, and how fast they change."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from fogml.report import style
from fogml.report.page import Drawing
from fogml.report.shading import Segment, regime_word, shade
from fogml.report.style import rounded_up, time_unit
from fogml.report.words import duration, listed, number, plural
from fogml.runs.regimes import regimes
from fogml.runs.run import Run
from fogml.signals import large
from fogml.signals.averages import block_averages
from fogml.signals.drawn import drawn

FloatArray = NDArray[np.float64]
RATE_WINDOW_S = 60.0
_BRIDGED = 5.0
"""Averages are joined over gaps up to this many averaging times."""
_AVERAGES = 1000


def recording(run: Run) -> Drawing:
    """Output, temperatures, table rate and temperature rates of a run in time, regimes shaded."""
    rates = temperature_rates(run)
    rows = ["gyro"]
    rows += ["temperature"] if run.temperature_columns else []
    rows += ["change"] if rates else []
    rows += ["rate"] if np.any(run.rate) else []
    figure = make_subplots(
        rows=len(rows),
        cols=1,
        shared_xaxes=True,
        vertical_spacing=0.035,
        row_heights=[1.6, *[1.2] * (len(rows) - 1)],
    )
    per_unit, unit = time_unit(run.span_s)
    time = large.each(lambda seconds: seconds / per_unit, run.time)
    _output(figure, run, time, per_unit)
    for index, name in enumerate(run.temperature_columns):
        place = rows.index("temperature") + 1
        x, y = drawn(time, run.temperature(name), gaps=run.gap_starts)
        _line(figure, place, x, y, name, index)
        if name in rates:
            rate_time, rate, gaps = rates[name]
            x, y = drawn(rate_time / per_unit, rate, gaps=gaps)
            _line(figure, rows.index("change") + 1, x, y, name, index, legend=False)
    if "rate" in rows:
        x, y = drawn(time, run.rate, gaps=run.gap_starts)
        line = {"color": style.BLACK, "width": 1.2}
        trace = go.Scatter(x=x, y=y, mode="lines", name="table rate", line=line, showlegend=False)
        figure.add_trace(trace, row=rows.index("rate") + 1, col=1)
    titles = {
        "gyro": f"gyro [{run.gyro_unit}]",
        "temperature": "temperature [°C]",
        "change": "change [°C/min]",
        "rate": "table [deg/s]",
    }
    for place, name in enumerate(rows, start=1):
        figure.update_yaxes(title_text=titles[name], row=place, col=1)
    figure.update_xaxes(title_text=f"time [{unit}]", row=len(rows), col=1)
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
    line = {"color": style.TRAINING, "width": 0.8}
    figure.add_trace(go.Scatter(x=x, y=y, mode="lines", name="output, all samples", line=line), row=1, col=1)
    window_s = rounded_up(max(run.span_s / _AVERAGES, 20.0 * run.sample_s, 1e-6))
    means = block_averages(run.time, run.gyro, window_s=window_s) if run.span_s > 4.0 * window_s else None
    if means is not None and len(means) > 2:
        gaps = np.flatnonzero(np.diff(means.time_s) > _BRIDGED * window_s) + 1
        x, y = drawn(means.time_s / per_unit, means.values[0], gaps=gaps)
        line = {"color": style.BEFORE, "width": 1.6}
        name = f"output, {number(window_s)} s averages"
        figure.add_trace(go.Scatter(x=x, y=y, mode="lines", name=name, line=line), row=1, col=1)


def _line(
    figure: go.Figure, row: int, x: FloatArray, y: FloatArray, name: str, index: int, legend: bool = True
) -> None:
    line = {"color": style.SERIES[index % 7], "dash": style.DASHES[index % 7], "width": 1.6}
    trace = go.Scatter(x=x, y=y, mode="lines", name=name, line=line, legendgroup=name, showlegend=legend)
    figure.add_trace(trace, row=row, col=1)


def _rate_window(run: Run) -> float:
    return max(RATE_WINDOW_S, rounded_up(max(2.0 * run.sample_s, run.span_s / _AVERAGES, 1e-6)))


def temperature_rates(run: Run) -> dict[str, tuple[FloatArray, FloatArray, NDArray[np.intp]]]:
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
    """The regimes of a run on a time axis of so many seconds per unit."""
    last = len(run) - 1
    return [
        (name, float(run.time[start]) / per_unit, float(run.time[min(stop, last)]) / per_unit)
        for name, start, stop in regimes(run).segments()
    ]
