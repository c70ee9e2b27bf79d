"""Figures of one model on one run: drift in time, against temperature, and what is left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from fogml.arrays import FloatArray, IndexArray
from fogml.numerals import averages, number, percent
from fogml.report import style
from fogml.report.page import Drawing
from fogml.report.style import in_order, log_axis, regime_word, segments_of, shade, time_unit
from fogml.signals.drawn import DRAWN_POINTS, drawn, gap_starts, min_max_indices
from fogml.validation.results import AveragedSeries, RunJudgement

STEADY_DEG_C_PER_MIN = 0.05
"""Temperature rates within this are steady: neither warming nor cooling."""
_FLAGS = {1: ("outside training", "diamond-open", style.ORANGE), 2: ("not settled", "x", style.PURPLE)}
_DIRECTIONS = (
    ("warming", style.WARMING, "triangle-up", 1),
    ("cooling", style.COOLING, "triangle-down", -1),
    ("steady", style.STEADY, "circle-open", 0),
)


def over(judged: RunJudgement) -> str:
    """The averaging time of a run in words: ``100 s averages``."""
    return averages(judged.averaging_s)


def drift_in_time(judged: RunJudgement, interval: Mapping[str, Any] | None = None) -> Drawing:
    """Temperature, drift with the model over it, and what is left with its 90 % band, in time.

    ``interval`` is what the model tells of its band; named where it is for another averaging time.
    """
    series = judged.series
    per_unit, unit = time_unit(float(np.ptp(series.time)))
    time = series.time / per_unit
    gaps = gap_starts(series.time)
    warmed = {"T [°C]": 1.0} if has_temperature(series) else {}
    panels = {**warmed, "drift [deg/h]": 1.5, "left [deg/h]": 1.5}
    figure, last = style.stacked(panels, f"time [{unit}]", 0.045), len(panels)

    def line(row: int, values: FloatArray, name: str, *looks: Any) -> None:
        trace = style.line(*drawn(time, values, gaps=gaps), name, *looks, showlegend=row > last - 2)
        figure.add_trace(trace, row=row, col=1)

    if warmed:
        line(1, series.temperature, "temperature", style.BLUE, 1.6)
    line(last - 1, series.before, "drift before", style.BEFORE, 1.4)
    line(last - 1, series.before - series.after, "model", style.MODEL, 2, "dash")
    banded = bool(np.isfinite(series.upper).any())
    if banded:
        figure.add_trace(_band(time, series, gaps), row=last, col=1)
    line(last, series.after, "left after", style.AFTER, 1.4)
    _mark_flagged(figure, time, series, last)
    style.floor_lines(figure, judged.floor, last)
    figure.add_trace(style.floor_in_legend(), row=last, col=1)
    low, high = _left_span(judged)
    figure.update_yaxes(range=[low, high], row=last, col=1)
    clipped = banded and bool(np.nanmax(series.upper) > high or np.nanmin(series.lower) < low)
    named = shade(figure, segments_of(time, series.regime))
    style.styled(figure, 140 + 150 * last, legend={"y": 1.05}, hovermode="x")
    words = ", ".join(regime_word(name) for name in named)
    return Drawing(
        figure,
        alt=(
            f"{judged.run} against time, {over(judged)}: "
            + _temperature_words(series)
            + f"drift before over a range of {number(judged.before.range)} deg/h with the model over it; "
            f"what is left, over a range of {number(judged.after.range)} deg/h. Bands behind: {words}."
        ),
        caption=(
            f"{over(judged).capitalize()}. Drift before compensation with the model over it; below, on its "
            f"own scale, what is left{_band_words(judged, interval, clipped) if banded else ''}. Dashed: the "
            f"noise floor of ± {number(judged.floor)} deg/h. Shaded: {words}."
        ),
    )


def has_temperature(series: AveragedSeries) -> bool:
    """Whether the run recorded a temperature."""
    return bool(np.isfinite(series.temperature).any())


def _temperature_words(series: AveragedSeries) -> str:
    if not has_temperature(series):
        return ""
    low, high = float(np.nanmin(series.temperature)), float(np.nanmax(series.temperature))
    return f"temperature from {number(low)} to {number(high)} °C; "


def _left_span(judged: RunJudgement) -> tuple[float, float]:
    """From the least to the greatest of what is left, with the floor, and the band as far as twice that."""
    series = judged.series
    low = min(float(np.min(series.after)), -1.3 * judged.floor)
    high = max(float(np.max(series.after)), 1.3 * judged.floor)
    if np.isfinite(series.upper).any():
        reach = 2.0 * max(-low, high)
        low = min(low, max(float(np.nanmin(series.lower)), -reach))
        high = max(high, min(float(np.nanmax(series.upper)), reach))
    room = 0.06 * (high - low)
    return low - room, high + room


def _band_words(judged: RunJudgement, interval: Mapping[str, Any] | None, clipped: bool) -> str:
    seconds = float((interval or {}).get("averaging_s", judged.averaging_s))
    same = abs(seconds - judged.averaging_s) <= 1e-3 * judged.averaging_s
    told = [] if same else [f"of {averages(seconds)}"]
    told += ["it reaches beyond the panel"] if clipped else []
    return " with the model's 90 % band about zero" + (f" ({'; '.join(told)})" if told else "")


def _band(time: FloatArray, series: AveragedSeries, gaps: IndexArray) -> go.Scatter:
    """The prediction interval as one closed outline per stretch, so that no gap is filled."""
    sides_x: list[FloatArray] = []
    sides_y: list[FloatArray] = []
    pen_up = np.array([np.nan])
    for rows in np.split(np.arange(len(time)), gaps):
        points = max(DRAWN_POINTS * len(rows) // len(time), 4)
        lower, upper = (rows[min_max_indices(v[rows], points)] for v in (series.lower, series.upper))
        sides_x += [time[lower], time[upper][::-1], pen_up]
        sides_y += [series.lower[lower], series.upper[upper][::-1], pen_up]
    outline = np.concatenate(sides_x), np.concatenate(sides_y)
    return style.band(*outline, "90 % band", "rgba(0, 158, 115, 0.22)")


def _mark_flagged(figure: go.Figure, time: FloatArray, series: AveragedSeries, row: int) -> None:
    for flag, (words, symbol, colour) in _FLAGS.items():
        rows = np.flatnonzero(series.flag == flag)
        if rows.size:
            rows = rows[min_max_indices(series.after[rows], DRAWN_POINTS // 4)]
            trace = style.points(time[rows], series.after[rows], words, colour, symbol, 6, 1.2)
            figure.add_trace(trace, row=row, col=1)


def drift_against_temperature(judged: RunJudgement, train: Sequence[RunJudgement] = ()) -> Drawing:
    """Drift against temperature, warming and cooling apart: before with the model, and after."""
    series = judged.series
    figure = make_subplots(
        rows=1,
        cols=2,
        horizontal_spacing=0.14,
        subplot_titles=("before, with the model", "after, on its own scale"),
    )
    for other in train:
        kept = min_max_indices(other.series.before, DRAWN_POINTS // 4)
        x, y = other.series.temperature[kept], other.series.before[kept]
        looks = style.TRAINING, "x-thin-open", 6, 1
        told = style.grouped("train", other is train[0]) | {"hovertext": other.run}
        figure.add_trace(style.points(x, y, "training runs", *looks, **told), row=1, col=1)
    direction = direction_of(series)
    for words, colour, symbol, sign in _DIRECTIONS:
        rows = np.flatnonzero(direction == sign)
        if rows.size == 0:
            continue
        for column, values in ((1, series.before), (2, series.after)):
            kept = rows[min_max_indices(values[rows], DRAWN_POINTS // 2)]
            x, y = series.temperature[kept], values[kept]
            told = style.grouped(words, column == 1) | {"marker_opacity": 0.75}
            figure.add_trace(style.points(x, y, words, colour, symbol, 5.5, **told), row=1, col=column)
    x, y = drawn(series.time, series.before - series.after)
    temperature = np.interp(x, series.time, series.temperature)
    figure.add_trace(style.line(temperature, y, "model", style.BLACK, 1.8), row=1, col=1)
    style.floor_lines(figure, judged.floor, 1, 2)
    figure.add_trace(style.floor_in_legend(), row=1, col=2)
    figure.update_xaxes(title_text="T [°C]")
    figure.update_yaxes(title_text="drift [deg/h]", row=1, col=1)
    figure.update_yaxes(title_text="left [deg/h]", row=1, col=2)
    style.styled(figure, 430, legend={"y": 1.1}, margin={"t": 74})
    return Drawing(
        figure,
        alt=(
            f"{judged.run}: drift against temperature with warming and cooling apart. Before, the averages "
            f"range over {number(judged.before.range)} deg/h; after, over {number(judged.after.range)} deg/h."
        ),
        caption=(
            f"{over(judged).capitalize()}. Where warming and cooling part, drift depends on "
            "more than the temperature, and no curve in T alone can follow it. Dashed on the right: the "
            f"noise floor of ± {number(judged.floor)} deg/h."
        ),
    )


def direction_of(series: AveragedSeries) -> NDArray[np.int8]:
    """1 warming, -1 cooling, 0 steady (within 0.05 degC/min), shape (m,)."""
    rate = series.rate
    return np.where(rate > STEADY_DEG_C_PER_MIN, 1, np.where(rate < -STEADY_DEG_C_PER_MIN, -1, 0)).astype(
        np.int8
    )


def rms_by_regime(judged: RunJudgement) -> Drawing:
    """Rms of the averages in each regime, before and after, with the floor."""
    series = judged.series
    before, after = (float(np.sqrt(np.mean(v**2))) for v in (series.before, series.after))
    rows, told = [("whole run (100 %)", before, after)], series.by_regime()
    for name in in_order(list(told)):
        found = told[name]
        rows.append((f"{regime_word(name)} ({percent(found['share'])})", found["before"], found["after"]))
    labels = [row[0] for row in rows]
    figure = go.Figure()
    for index, (name, colour, symbol) in enumerate(
        (("before", style.BEFORE, "diamond-open"), ("after", style.AFTER, "circle")), start=1
    ):
        figure.add_trace(style.points([row[index] for row in rows], labels, name, colour, symbol, 11, 2))
    floor = judged.floor
    figure.add_vline(x=floor, line=style.FLOOR_LINE)
    figure.add_trace(style.floor_in_legend())
    values = [value for row in rows for value in row[1:] if value > 0] + [floor or 1.0]
    figure.update_xaxes(title_text="rms [deg/h]", **log_axis(min(values), max(values)))
    figure.update_yaxes(autorange="reversed")
    style.styled(figure, 120 + 38 * len(rows))
    worst = max(rows[1:], key=lambda row: row[2])
    return Drawing(
        figure,
        alt=(
            "Rms by regime, before and after: "
            + "; ".join(
                f"{words}: {number(before)} and {number(after)} deg/h" for words, before, after in rows
            )
            + f". Noise floor {number(floor)} deg/h."
        ),
        caption=(
            f"Rms of the {over(judged)} about the reference, by regime (with its share of the "
            f"run), and the noise floor of {number(floor)} deg/h. "
            f"Most is left in: {worst[0]}, {number(worst[2])} deg/h."
        ),
        half=True,
    )
