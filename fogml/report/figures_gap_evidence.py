"""Figures of a diagnosis' evidence: candidates, amplitudes by run, constants, the check of the noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from fogml.gap.result import CandidateEvidence, Found, NoiseReport
from fogml.gap.result_parts import ConstantFit
from fogml.intervals import Z90, Z95
from fogml.numerals import number, unit_words, with_error
from fogml.report import style
from fogml.report.gap_words import STATUS_WORDS, title_of
from fogml.report.page import Drawing
from fogml.report.style import log_axis

SHOWN = 16
"""Candidates that the figure shows, the best first, and all that are named."""
LEAST_LENGTH = 3.0
"""Length under which the runs could not show an effect."""
_LEAST_DRAWN = 0.1
_LOOKS = {
    "named": (style.MODEL, ""),
    "possible": (style.ORANGE, "x"),
    "no_sign": (style.SKY_BLUE, "/"),
    "undetectable": (style.GREY, "."),
}
_GAIN_TICKS = (-10, -3, 0, 3, 10, 30, 100, 300, 1000, 3000, 10000, 100000, 1000000)


def shown_evidence(evidence: Sequence[CandidateEvidence]) -> list[CandidateEvidence]:
    """The candidates with the largest gain, and all that are named; none that no run can tell at all."""
    seen = [e for e in evidence if e.status != "in_constants"]
    return [e for i, e in enumerate(seen) if i < SHOWN or e.status == "named"]


def evidence_bars(evidence: Sequence[CandidateEvidence]) -> Drawing:
    """What each candidate alone gains, and what the runs could show of it."""
    shown = shown_evidence(evidence)
    labels = [e.title for e in shown]
    figure = make_subplots(
        rows=1, cols=2, shared_yaxes=True, horizontal_spacing=0.03, column_widths=[0.6, 0.4]
    )
    for status, (colour, pattern) in _LOOKS.items():
        rows = [e for e in shown if e.status == status]
        if rows:
            figure.add_bar(
                x=[_folded(e.gain) for e in rows],
                y=[e.title for e in rows],
                orientation="h",
                name=STATUS_WORDS[status],
                marker={
                    "color": colour,
                    "pattern": {"shape": pattern, "fillmode": "overlay", "fgcolor": "white", "size": 6},
                },
                customdata=[number(e.gain) for e in rows],
                hovertemplate="%{y}: %{customdata} nats<extra></extra>",
                row=1,
                col=1,
            )
    lengths = [max(e.usual_length, _LEAST_DRAWN) for e in shown]
    for words, symbol, small in (
        ("what the runs could show", "diamond-open", False),
        (f"under {_LEAST_DRAWN:g}", "triangle-left", True),
    ):
        rows = [e for e in shown if (e.usual_length < _LEAST_DRAWN) is small]
        if rows:
            x, y = [max(e.usual_length, _LEAST_DRAWN) for e in rows], [e.title for e in rows]
            trace = style.points(x, y, words, style.BLACK, symbol, 9, 1.8, showlegend=small)
            figure.add_trace(trace, row=1, col=2)
    figure.add_vline(x=LEAST_LENGTH, row=1, col=2, line=style.FLOOR_LINE)
    low, high = _folded(min(0.0, *(e.gain for e in shown))), _folded(max(3.0, *(e.gain for e in shown)))
    room = 0.04 * (high - low)
    ticks = [t for t in _GAIN_TICKS if low - room <= _folded(t) <= high + room]
    figure.update_xaxes(
        title_text="log evidence gained [nats]",
        tickvals=[_folded(t) for t in ticks],
        ticktext=[str(t).replace("-", "−") for t in ticks],
        range=[low - room, high + room],
        row=1,
        col=1,
    )
    figure.update_xaxes(
        title_text="usual length [1]",
        row=1,
        col=2,
        **log_axis(min(1.0, *lengths), max(10.0, *lengths)),
    )
    figure.add_vline(x=0.0, row=1, col=1, line={"color": style.BLACK, "width": 1})
    figure.update_yaxes(categoryorder="array", categoryarray=labels[::-1], type="category")
    style.styled(figure, 120 + 25 * len(shown), bargap=0.3, barmode="overlay", legend={"y": 1.01})
    best = "; ".join(f"{e.title} {number(e.gain)} nats ({STATUS_WORDS[e.status]})" for e in shown[:5])
    return Drawing(
        figure,
        alt=f"Gain in log evidence of each candidate by itself, and what the runs could show of it. {best}.",
        caption=(
            "Left: how much better each candidate, by itself, explains the fit runs than the twin's "
            "constants and noise do (its shape averaged over its range; the scale is linear near 0, "
            "logarithmic beyond). A candidate that is not named can gain too: it resembles what is. Right: "
            "the length, in standard deviations of the noise, that its usual size would have in these runs "
            f"once the constants are fitted; left of the dashed line at {LEAST_LENGTH:g} the runs "
            "could not show it. One that is far larger than usual can be named all the same."
        ),
    )


def _folded(gain: float) -> float:
    """Linear about 0 and logarithmic far from it, so that 3 and 3000 nats are seen side by side."""
    return math.copysign(math.log10(1.0 + abs(gain)), gain)


def amplitude_by_run(found: Found, names: dict[str, str]) -> Drawing:
    """An effect's amplitude from each run alone, and from all together."""
    unit = unit_words(found.amplitude.unit) or "1"
    labels = [item.run for item in found.by_run]
    figure = go.Figure()
    value, se = found.amplitude.value, found.amplitude.se
    figure.add_vrect(
        x0=value - Z90 * se, x1=value + Z90 * se, fillcolor="rgba(0, 158, 115, 0.18)", line_width=0
    )
    figure.add_vline(x=value, line={"color": style.AFTER, "width": 1.6})
    values, errors = [item.value for item in found.by_run], [item.se for item in found.by_run]
    figure.add_trace(_estimates("one run alone", labels, values, errors))
    figure.add_vline(x=0.0, line={"color": style.BLACK, "width": 1, "dash": "dot"})
    figure.update_xaxes(title_text=f"amplitude [{unit}]")
    figure.update_yaxes(categoryorder="array", categoryarray=labels[::-1], type="category")
    style.styled(figure, 96 + 32 * len(labels), margin={"t": 12})
    title = title_of(found.effect, names)
    agree = "agree" if found.consistent else "do not agree"
    told = "; ".join(f"{item.run} {with_error(item.value, item.se)}" for item in found.by_run)
    return Drawing(
        figure,
        alt=f"Amplitude of {title} by run, which {agree}: {told} {unit}.",
        caption=(
            f"{title}: dots, from each run that can show it, by itself; band, from all together. "
            "90 % intervals."
        ),
        half=True,
    )


def _estimates(
    name: str, labels: Sequence[str], values: Sequence[float], errors: Sequence[float]
) -> go.Scatter:
    """A row for each value, with its interval of 90 %."""
    bars = {"type": "data", "array": [Z90 * se for se in errors], "width": 5}
    return style.points(values, labels, name, style.BEFORE, error_x=bars, showlegend=False)


def constants_moved(constants: Sequence[ConstantFit]) -> Drawing:
    """How far each constant moved from its prior, in the prior's standard deviations."""
    shown = [c for c in constants if c.prior_sd > 0.0]
    labels = [c.name for c in shown]
    figure = go.Figure()
    for reach, tint in ((2.0, "rgba(0, 114, 178, 0.08)"), (1.0, "rgba(0, 114, 178, 0.14)")):
        figure.add_vrect(x0=-reach, x1=reach, fillcolor=tint, line_width=0)
    moved = [(c.value - c.prior_mean) / c.prior_sd for c in shown]
    figure.add_trace(_estimates("fitted", labels, moved, [c.se / c.prior_sd for c in shown]))
    figure.update_xaxes(title_text="fitted less prior mean [prior standard deviations]")
    figure.update_yaxes(categoryorder="array", categoryarray=labels[::-1], type="category")
    style.styled(figure, 110 + 27 * len(shown), margin={"t": 12})
    far = [name for name, distance in zip(labels, moved) if abs(distance) > 3.0]
    return Drawing(
        figure,
        alt="Constants less their prior means, in prior standard deviations: "
        + "; ".join(f"{name} {number(distance)}" for name, distance in zip(labels, moved))
        + ".",
        caption="Fitted with 90 % intervals; bands: one and two standard deviations of the prior. An "
        "interval as wide as the prior says that these runs tell nothing of that constant."
        + (f" Beyond three: {', '.join(far)}." if far else ""),
        half=True,
    )


def variance_ratios(noise: NoiseReport) -> Drawing:
    """Variance of block means of the innovations over what the noise model expects."""
    scales, ratios = np.asarray(noise.scales_s), np.asarray(noise.variance_ratio)
    blocks = np.maximum(noise.samples * scales[0] / scales, 1.0)
    reach = Z95 * np.sqrt(2.0 / blocks)
    dots = {"symbol": "circle", "size": 8, "color": style.BEFORE}
    joined: dict[str, Any] = {"mode": "lines+markers", "marker": dots}
    data = style.line(scales, ratios, "held-out data", style.BEFORE, 1.2, **joined)
    figure = go.Figure([_band(scales, np.maximum(1.0 - reach, 0.02), 1.0 + reach), data])
    figure.add_hline(y=1.0, line=style.FLOOR_LINE)
    seen = [0.5, 2.0, *(float(r) for r in ratios if r > 0.05)]
    figure.update_xaxes(title_text="time scale [s]", **log_axis(float(scales[0]), float(scales[-1])))
    figure.update_yaxes(title_text="variance / expected [1]", **log_axis(min(seen), max(seen)))
    style.styled(figure, 320)
    told = "; ".join(f"{s:g} s {number(float(r))}" for s, r in zip(scales, ratios, strict=True))
    return Drawing(
        figure,
        alt=f"Variance of the whitened held-out gap over the expected one, by time scale: {told}.",
        caption="Variance of the whitened gap on held-out data, by time scale; 1 is as the noise model "
        "expects. Too much at long scales: something slow is left, or the noise is more than was fitted.",
        half=True,
    )


def autocorrelations(noise: NoiseReport) -> Drawing:
    """Autocorrelation of the innovations on held-out data."""
    lags = np.asarray(noise.lags_s)
    reach = np.full(len(lags), Z95 / math.sqrt(max(noise.samples, 1)))
    data = style.points(lags, list(noise.autocorrelation), "held-out data", style.BEFORE, size=8)
    figure = go.Figure([_band(lags, -reach, reach), data])
    figure.add_hline(y=0.0, line={"color": style.BLACK, "width": 1})
    high = max(0.1, *(1.15 * abs(v) for v in noise.autocorrelation))
    figure.update_xaxes(title_text="lag [s]", **log_axis(float(lags[0]), float(lags[-1])))
    figure.update_yaxes(title_text="autocorrelation [1]", range=[-high, high])
    style.styled(figure, 320)
    told = "; ".join(f"{lag:g} s {number(v, 2)}" for lag, v in zip(lags, noise.autocorrelation, strict=True))
    return Drawing(
        figure,
        alt=f"Autocorrelation of the whitened held-out gap by lag: {told}.",
        caption="Autocorrelation of the whitened gap on held-out data; a right noise model leaves none.",
        half=True,
    )


def _band(x: np.ndarray, low: np.ndarray, high: np.ndarray) -> go.Scatter:
    outline = np.concatenate([x, x[::-1]]), np.concatenate([high, low[::-1]])
    return style.band(*outline, "95 % of right models", "rgba(0, 158, 115, 0.20)")
