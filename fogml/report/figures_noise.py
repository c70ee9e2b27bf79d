"""Allan deviation with its intervals, the terms as slopes, and the minimum."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go

from fogml.arrays import FloatArray
from fogml.numerals import lowest_from, number, percent
from fogml.report import style
from fogml.report.page import Drawing
from fogml.report.style import log_axis

TERM_WORDS = {
    "Q": "quantisation",
    "N": "angle random walk",
    "B": "bias instability",
    "K": "rate random walk",
    "R": "rate ramp",
}
_FLICKER_FLOOR = float(np.sqrt(2 * np.log(2) / np.pi))
_URAD_IN_DEG_H_S = 180.0 / np.pi * 1e-6 * 3600.0


def term_deviation(name: str, coefficient: float, taus_s: FloatArray) -> FloatArray:
    """Allan deviation [deg/h] of one IEEE 952 term alone at averaging times [s].

    Parameters
    ----------
    name
        Q, N, B, K or R.
    coefficient
        In urad, deg/sqrt(h), deg/h, deg/h/sqrt(h) and deg/h/h.
    taus_s
        Shape (m,).
    """
    hours = taus_s / 3600.0
    if name == "Q":
        return np.sqrt(3.0) * coefficient * _URAD_IN_DEG_H_S / taus_s
    if name == "N":
        return coefficient / np.sqrt(hours)
    if name == "B":
        return np.full_like(taus_s, _FLICKER_FLOOR * coefficient)
    if name == "K":
        return coefficient * np.sqrt(hours / 3.0)
    return coefficient * hours / np.sqrt(2.0)


def allan_plot(noise: Mapping[str, Any]) -> Drawing:
    """Log-log Allan deviation of a ``noise.json``, with terms that the data support."""
    taus = np.asarray(noise["taus_s"], dtype=np.float64)
    adev = np.asarray(noise["adev"], dtype=np.float64)
    figure = go.Figure()
    intervals = np.asarray(noise["ci"], dtype=np.float64) if len(noise.get("ci", ())) == len(taus) else None
    if intervals is not None and len(taus):
        outline = np.concatenate([taus, taus[::-1]]), np.concatenate([intervals[:, 1], intervals[::-1, 0]])
        words = f"{percent(float(noise.get('level', 0.9)), 0)} interval"
        figure.add_trace(style.band(*outline, words, "rgba(0, 114, 178, 0.20)"))
    shown = _term_lines(figure, noise, taus, adev)
    shown += _model_lines(figure, noise, taus)
    shown += _floor_line(figure, noise)
    dotted: dict[str, Any] = {"mode": "lines+markers", "marker": {"size": 5}}
    figure.add_trace(style.line(taus, adev, "Allan deviation", style.BLUE, 2, **dotted))
    minimum = noise.get("minimum") or {}
    if minimum.get("adev"):
        x, y = [minimum["tau_s"]], [minimum["adev"]]
        looks: dict[str, Any] = {"symbol": "star", "size": 14, "edge": 1, "marker_line_color": style.BLACK}
        figure.add_trace(style.points(x, y, "minimum", style.YELLOW, **looks))
    figure.update_xaxes(title_text="averaging time τ [s]", **log_axis(taus[0], taus[-1], room=0.03))
    figure.update_yaxes(
        title_text="Allan deviation [deg/h]", **log_axis(*_span(adev, intervals, noise.get("floor")))
    )
    style.styled(figure, 560)
    first, last = (f"{number(adev[i])} deg/h at {number(taus[i])} s" for i in (0, -1))
    lowest = (
        f", with its minimum of {number(minimum['adev'])} deg/h at {number(minimum['tau_s'])} s"
        if minimum.get("adev")
        else ""
    )
    return Drawing(
        figure,
        alt=f"Allan deviation against averaging time, both logarithmic: from {first} to {last}{lowest}.",
        caption=(
            "Lines without markers: each term alone, at the value in the table. "
            + shown
            + (
                f" Star: the lowest deviation that enough averages support{lowest_from(noise)}."
                if lowest
                else ""
            )
        ),
    )


def _model_lines(figure: go.Figure, noise: Mapping[str, Any], taus: FloatArray) -> str:
    """Draw the fitted model and shade where its terms alone do not make the curve; say so."""
    model = noise.get("model") or {}
    told = ""
    if len(model.get("adev", ())) == len(taus):
        figure.add_trace(style.line(taus, model["adev"], "noise model", style.BLACK, 1.2))
        told = " Thin black: the fitted model"
        if noise.get("filter") and noise["filter"]["kind"] != "other":
            told += f" behind its output filter ({noise['filter']['words']})"
        told += "."
    holds = noise.get("holds_from_s")
    if holds and len(taus) and holds > taus[0] * 1.001:
        figure.add_vrect(x0=taus[0], x1=holds, fillcolor="rgba(0, 0, 0, 0.07)", line_width=0, layer="below")
        why = (
            "values are repeated"
            if noise.get("hold") and not noise.get("filter")
            else "the output is filtered"
        )
        told += f" Shaded: up to {number(holds)} s {why}, and the terms alone do not make the curve."
    return told


def _floor_line(figure: go.Figure, noise: Mapping[str, Any]) -> str:
    """Draw the noise floor of averages with its interval, where there is one; say so."""
    floor = noise.get("floor")
    if not floor:
        return ""
    times, intervals = floor["averaging_s"], np.asarray(floor["ci"], dtype=np.float64)
    for side in (0, 1):
        line = {**style.FLOOR_LINE, "width": 0.6}
        figure.add_scatter(
            x=times, y=intervals[:, side], mode="lines", line=line, showlegend=False, hoverinfo="skip"
        )
    figure.add_scatter(
        x=times,
        y=floor["value"],
        mode="lines" if len(times) > 1 else "markers",
        name="noise floor",
        line=style.FLOOR_LINE,
        marker={"symbol": "line-ew-open", "size": 14, "color": style.FLOOR_LINE["color"]},
    )
    return (
        f" Dashed: the noise floor that drift models are held against, with its interval: the standard "
        f"deviation of averages, {number(floor['value'][0])} deg/h over {number(times[0])} s; unlike the "
        "Allan deviation it counts what moves averages slowly, drift with temperature kept out."
    )


def _term_lines(figure: go.Figure, noise: Mapping[str, Any], taus: FloatArray, adev: FloatArray) -> str:
    """Draw the terms; say which are drawn."""
    drawn = []
    for index, (name, words) in enumerate(TERM_WORDS.items()):
        term = noise.get("terms", {}).get(name) or {}
        value = term.get("value")
        if not value or (term.get("ci") or [1.0])[0] == 0:
            continue
        alone = term_deviation(name, float(value), taus)
        # Only where it matters: a line far below the curve would squeeze the axis.
        near = alone > 0.2 * adev
        if not near.any():
            continue
        drawn.append(name)
        dash = ("dot", "dash", "longdash", "dashdot", "longdashdot")[index]
        looks = style.SERIES[(index + 1) % 7], 1.6, dash
        figure.add_trace(style.line(taus[near], alone[near], f"{name} {words}", *looks))
    if not drawn:
        return "The data support none."
    return (
        "Terms that the data do not support, or that stay far below the curve, are not drawn."
        if len(drawn) < len(TERM_WORDS)
        else ""
    )


def _span(
    adev: FloatArray, intervals: FloatArray | None, floor: Mapping[str, Any] | None = None
) -> tuple[float, float]:
    """From the lowest to the highest value, intervals included up to a decade beyond the curve."""
    drawn = np.concatenate([adev, floor["value"]]) if floor else adev
    positive = drawn[drawn > 0]
    if positive.size == 0:
        return 0.1, 10.0
    low, high = float(positive.min()), float(positive.max())
    if intervals is None:
        return low, high
    lower, upper = intervals[intervals[:, 0] > 0, 0], intervals[np.isfinite(intervals[:, 1]), 1]
    return (
        max(float(lower.min(initial=low)), low / 10.0),
        min(float(upper.max(initial=high)), high * 10.0),
    )
