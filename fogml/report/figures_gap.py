"""Figures of a diagnosis on its runs: how far the gap closes, in time, and against temperature."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from fogml.arrays import FloatArray
from fogml.gap.result import Diagnosis
from fogml.gap.result_parts import GapSegment, HowFar, RunSeries, TemperatureExcess
from fogml.numerals import averages, listed, number, plural
from fogml.report import style
from fogml.report.figures_judgement import STEADY_DEG_C_PER_MIN
from fogml.report.page import Drawing
from fogml.report.style import log_axis, regime_word, segments_of, shade, time_unit
from fogml.runs.regimes import Regimes
from fogml.signals.drawn import DRAWN_POINTS, drawn, gap_starts, min_max_indices

_RECALIBRATED = style.BLUE
_STAGES = (
    ("before", "nominal", "diamond-open", style.BEFORE),
    ("recalibrated", "recalibrated", "square-open", _RECALIBRATED),
    ("after", "with what was found", "circle", style.AFTER),
)


def how_far_strip(items: Sequence[HowFar], named: bool) -> Drawing:
    """Rms on each held-out run: nominal, recalibrated, with the effects, and the floor."""
    labels = [item.run for item in items]
    figure = go.Figure()
    for item in items:
        x = [item.before, item.recalibrated, item.after]
        figure.add_trace(style.line(x, [item.run] * 3, None, style.GREY, 1.2, **style.SILENT))
    for key, words, symbol, colour in _STAGES:
        if key != "after" or named:
            x = [getattr(item, key) for item in items]
            figure.add_trace(style.points(x, labels, words, colour, symbol, 12, 2))
    floors = [item.floor for item in items]
    figure.add_trace(style.points(floors, labels, "noise floor", style.FLOOR, "line-ns-open", 18, 2.5))
    values = [v for i in items for v in (i.before, i.recalibrated, i.after, i.floor) if v > 0.0] or [1.0]
    over = averages(items[0].averaging_s)
    figure.update_xaxes(title_text=f"rms of {over} [deg/h]", **log_axis(min(values), max(values)))
    figure.update_yaxes(autorange="reversed", type="category")
    style.styled(figure, 108 + 30 * len(items), margin={"t": 30, "b": 44})
    told = "; ".join(
        f"{i.run}: nominal {number(i.before)}, recalibrated {number(i.recalibrated)}, "
        + (f"with what was found {number(i.after)}, " if named else "")
        + f"floor {number(i.floor)} deg/h"
        for i in items
    )
    return Drawing(figure, alt=f"How far the gap closes on held-out data, rms of {over}. {told}.")


def run_in_time(series: RunSeries, segments: Sequence[GapSegment], named: bool) -> Drawing:
    """Temperature, recorded with replayed, and the gap before and after with its segments, in time."""
    per_unit, unit = time_unit(float(np.ptp(series.time_s)))
    time = series.time_s / per_unit
    gaps = gap_starts(series.time_s) if len(time) > 2 else np.empty(0, dtype=np.intp)
    panels = {"T [°C]": 0.75, "error [deg/h]": 1.3, "gap before [deg/h]": 1.15}
    if named:
        panels["gap after [deg/h]"] = 1.15
    figure = style.stacked(panels, f"time [{unit}]", 0.04, title_font_size=12)

    def line(row: int, values: FloatArray, name: str, *looks: Any) -> None:
        trace = style.line(*drawn(time, values, gaps=gaps), name, *looks, showlegend=row == 2)
        figure.add_trace(trace, row=row, col=1)

    line(1, series.temperature_degc, "temperature", style.BLUE, 1.6)
    line(2, series.replayed_before, "nominal twin", style.GREY, 1.6, "dot")
    line(2, series.recorded, "recorded", style.BEFORE, 1.3)
    line(2, series.replayed_recalibrated, "recalibrated twin", style.SKY_BLUE, 2.0, "dashdot")
    line(3, series.gap_recalibrated, "gap, recalibrated", style.BEFORE, 1.3)
    if named:
        line(2, series.replayed_after, "with what was found", style.MODEL, 2.0, "dash")
        line(4, series.gap_after, "gap, with what was found", style.AFTER, 1.3)
    off_panel = _output_range(figure, series, 2)
    low, high = _gap_range(series)
    for row in range(3, len(panels) + 1):
        figure.update_yaxes(range=[low, high], row=row, col=1)
        style.floor_lines(figure, series.floor, row)
    figure.add_trace(style.floor_in_legend(), row=3, col=1)
    _mark_segments(figure, segments, per_unit, low + 0.96 * (high - low))
    tinted = shade(figure, segments_of(time, np.asarray(Regimes.names)[series.regime]))
    style.styled(figure, 150 + 135 * len(panels), legend={"y": 1.06}, hovermode="x")
    return Drawing(
        figure,
        alt=_time_alt(series, segments, named),
        caption=_time_caption(series, segments, named, off_panel, [regime_word(name) for name in tinted]),
    )


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _output_range(figure: go.Figure, series: RunSeries, row: int) -> list[str]:
    """Scale the panel to what was recorded and fitted; what runs off it, in words."""
    shown = np.concatenate([series.recorded, series.replayed_recalibrated, series.replayed_after])
    low, high = float(np.min(shown)), float(np.max(shown))
    inner = [float(q) for q in np.quantile(shown, (0.1, 0.9))]
    off = []
    if high - low > 8.0 * (inner[1] - inner[0]) > 0.0:
        # A scale factor's error in turns hides all else.
        reach = 1.5 * (inner[1] - inner[0])
        off.append(f"Peaks run off the panel, from {number(low)} to {number(high)} deg/h.")
        low, high = max(inner[0] - reach, low), min(inner[1] + reach, high)
    level = float(np.median(series.replayed_before))
    if level < low or level > high:
        if max(high, level) - min(low, level) <= 2.5 * (high - low):
            low, high = min(low, level), max(high, level)
        else:
            off.append(f"The nominal replay, about {number(level)} deg/h, lies off the panel.")
    room = 0.08 * (high - low) or 1.0
    figure.update_yaxes(range=[low - room, high + room], row=row, col=1)
    return off


def _gap_range(series: RunSeries) -> tuple[float, float]:
    """Both gap panels on one scale, with room for the segments' marks."""
    both = np.concatenate([series.gap_recalibrated, series.gap_after])
    low = min(float(np.min(both)), -1.4 * series.floor)
    high = max(float(np.max(both)), 1.4 * series.floor)
    return low - 0.06 * (high - low), high + 0.16 * (high - low)


def _mark_segments(figure: go.Figure, segments: Sequence[GapSegment], per_unit: float, height: float) -> None:
    x = [end for s in segments for end in (s.from_s / per_unit, s.to_s / per_unit, None)]
    if x:
        y = [height, height, None] * len(segments)
        figure.add_trace(style.line(x, y, "over the floor", style.VERMILION, 7), row=3, col=1)


def _time_alt(series: RunSeries, segments: Sequence[GapSegment], named: bool) -> str:
    low, high = float(np.min(series.temperature_degc)), float(np.max(series.temperature_degc))
    told = (
        f"{series.run} against time, {averages(series.averaging_s)}: temperature from {number(low)} to "
        f"{number(high)} °C; recorded with replayed; gap of the recalibrated twin, rms "
        f"{number(_rms(series.gap_recalibrated))} deg/h"
    )
    if named:
        told += f", and with what was found, rms {number(_rms(series.gap_after))} deg/h"
    return told + f"; floor {number(series.floor)} deg/h. {plural(len(segments), 'segment')} marked."


def _time_caption(
    series: RunSeries, segments: Sequence[GapSegment], named: bool, off_panel: list[str], tinted: list[str]
) -> str:
    told = [
        f"{averages(series.averaging_s).capitalize()}. Error: gyro less reference rate, recorded and "
        "replayed; gap: recorded less replayed, before with the constants fitted"
        + (", after with what was found as well, on the same scale." if named else ".")
    ]
    told += off_panel
    told.append(f"Dashed: the noise floor of ± {number(series.floor)} deg/h.")
    if series.role == "fit":
        told.append(
            f"Thick bars: the {plural(len(segments), 'segment')} in which the gap exceeds the floor."
            if segments
            else "No segment of 600 s or more exceeds the floor."
        )
    else:
        told.append("Held out: it took part in nothing but this.")
    if tinted:
        told.append(f"Shaded: {listed(tinted, 6)}.")
    return " ".join(told)


def against_temperature(found: Diagnosis) -> Drawing:
    """The gap of the fit runs against temperature, warming and cooling apart, before and after."""
    series = [s for s in found.series if s.role == "fit"]
    named = bool(found.named)
    columns = [("before", [s.gap_recalibrated for s in series])]
    if named:
        columns.append(("after", [s.gap_after for s in series]))
    figure = make_subplots(
        rows=1,
        cols=len(columns),
        horizontal_spacing=0.09,
        shared_yaxes=True,
        subplot_titles=("recalibrated", "with what was found") if named else None,
    )
    temperature = np.concatenate([s.temperature_degc for s in series])
    rate = np.concatenate([s.rate_degc_min for s in series])
    directions = (
        ("warming", style.WARMING, "triangle-up", rate > STEADY_DEG_C_PER_MIN),
        ("cooling", style.COOLING, "triangle-down-open", rate < -STEADY_DEG_C_PER_MIN),
        ("steady", style.STEADY, "circle-open", np.abs(rate) <= STEADY_DEG_C_PER_MIN),
    )
    for column, (_, parts) in enumerate(columns, start=1):
        values = np.concatenate(parts)
        for words, colour, symbol, chosen in directions:
            rows = np.flatnonzero(chosen)
            if rows.size == 0:
                continue
            rows = rows[min_max_indices(values[rows], DRAWN_POINTS // 2)]
            looks = style.grouped(words, column == 1) | {"marker_opacity": 0.6}
            trace = style.points(temperature[rows], values[rows], words, colour, symbol, 5.5, **looks)
            figure.add_trace(trace, row=1, col=column)
        if column == 1:
            _means(figure, found.where.temperature)
        floor = float(np.mean([s.floor for s in series]))
        style.floor_lines(figure, floor, 1, column)
    figure.add_trace(style.floor_in_legend(), row=1, col=1)
    figure.update_xaxes(title_text="T [°C]")
    figure.update_yaxes(title_text="gap [deg/h]", row=1, col=1)
    style.styled(figure, 430, legend={"y": 1.09}, margin={"t": 74})
    parted = _parted(found.where.temperature)
    return Drawing(
        figure,
        alt=f"Gap of the fit runs against temperature, warming and cooling apart. {parted}",
        caption=(
            f"{averages(series[0].averaging_s).capitalize()} of the fit runs; lines: means over spans of "
            f"temperature while it rises and while it falls. {parted} Where the two part, the gap depends on "
            f"more than the temperature. Dashed: the noise floor of ± {number(floor)} deg/h."
        ),
    )


def _means(figure: go.Figure, bins: Sequence[TemperatureExcess]) -> None:
    for words, colour, dash, key in (
        ("mean, warming", style.WARMING, "solid", "mean_up"),
        ("mean, cooling", style.COOLING, "dash", "mean_down"),
    ):
        points = [(0.5 * (b.from_degc + b.to_degc), getattr(b, key)) for b in bins]
        points = [(t, value) for t, value in points if value is not None]
        if points:
            x, y = zip(*points, strict=True)
            figure.add_trace(style.line(x, y, words, colour, 3, dash), row=1, col=1)


def _parted(bins: Sequence[TemperatureExcess]) -> str:
    """Where the means of warming and cooling part most."""
    both = [(b, b.mean_up - b.mean_down) for b in bins if b.mean_up is not None and b.mean_down is not None]
    if not both:
        return "No span of temperature was passed in both directions."
    widest, apart = max(both, key=lambda item: abs(item[1]))
    return (
        f"Warming less cooling is largest from {number(widest.from_degc)} to {number(widest.to_degc)} °C: "
        f"{number(apart)} deg/h."
    )
