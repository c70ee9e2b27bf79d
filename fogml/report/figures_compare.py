"""Figures of several models on the same split: bars with the floor, and the best ones' residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from fogml.report import style
from fogml.report.page import Drawing
from fogml.report.shading import segments_of, shade
from fogml.report.style import log_axis, time_unit
from fogml.report.words import averages, listed, number
from fogml.signals.drawn import drawn, gap_starts
from fogml.validation.results import Judgement, RunJudgement

BASELINES = ("none", "mean")
_MOST_SERIES = 4


def rms_bars(judgements: Mapping[str, Judgement], order: Sequence[str]) -> Drawing:
    """Rms of the worst test run per model as bars, each test run as a mark, and the floor.

    Parameters
    ----------
    judgements
        By model name.
    order
        Names, the best first.
    """
    worst = [max(run.after.rms for run in judgements[name].test) for name in order]
    stability = [max(run.after.bias_stability for run in judgements[name].test) for name in order]
    runs = judgements[order[0]].test
    floor = max(run.floor for run in runs)
    figure = go.Figure(
        go.Bar(
            x=worst,
            y=list(order),
            orientation="h",
            name="rms",
            text=[f"\u2002\u2002{number(value)}" for value in worst],
            textposition="outside",
            cliponaxis=False,
            marker={
                "color": [style.TRAINING if name in BASELINES else style.SKY_BLUE for name in order],
                "pattern": {"shape": ["/" if name in BASELINES else "" for name in order], "size": 5},
            },
        )
    )
    figure.add_trace(
        go.Scatter(
            x=stability,
            y=list(order),
            mode="markers",
            name="bias stability",
            marker={"symbol": "diamond", "size": 9, "color": style.BLACK},
        )
    )
    figure.add_vline(x=floor, line=style.FLOOR_LINE)
    figure.add_trace(style.floor_in_legend())
    # Bars have no zero on a logarithmic axis: they begin at a round number below everything.
    least = min(floor, min(v for v in (*worst, *stability) if v > 0))
    figure.update_xaxes(
        title_text="left on the worst test run [deg/h], logarithmic",
        **log_axis(0.5 * least, 1.3 * max(worst)),
    )
    figure.update_yaxes(autorange="reversed", showgrid=False)
    style.styled(figure, 130 + 30 * len(order), bargap=0.35)
    over = averages(runs[0].averaging_s)
    return Drawing(
        figure,
        alt=(
            f"What each model leaves, rms of {over}, the best first: "
            + "; ".join(f"{name} {number(value)} deg/h" for name, value in zip(order, worst, strict=True))
            + f". Noise floor {number(floor)} deg/h."
        ),
        caption=(
            over.capitalize()
            + (", each model's worst test run" if len(runs) > 1 else "")
            + f". Dashed: the noise floor, {number(floor)} deg/h. "
            "Hatched: the baselines without a drift model."
        ),
    )


def residuals_in_time(judgements: Mapping[str, Judgement], names: Sequence[str], run: str) -> Drawing:
    """What the named models leave of one test run, one panel each on the same scale."""
    shown: list[tuple[str, RunJudgement]] = []
    for name in names[:_MOST_SERIES]:
        shown += [(name, judged) for judged in judgements[name].test if judged.run == run]
    figure = make_subplots(
        rows=len(shown), cols=1, shared_xaxes=True, shared_yaxes="all", vertical_spacing=0.16 / len(shown)
    )
    for row, (name, judged) in enumerate(shown, start=1):
        series = judged.series
        per_unit, unit = time_unit(float(np.ptp(series.time)))
        x, y = drawn(series.time / per_unit, series.after, gaps=gap_starts(series.time))
        line = {"color": style.SERIES[row - 1], "width": 1.4}
        figure.add_trace(
            go.Scatter(x=x, y=y, mode="lines", name=name, line=line, showlegend=False), row=row, col=1
        )
        for value in (judged.floor, -judged.floor):
            figure.add_hline(y=value, row=row, col=1, line=style.FLOOR_LINE)
        figure.update_yaxes(title_text=f"{name}<br>[deg/h]", title_font_size=12, row=row, col=1)
    series = shown[0][1].series
    shade(figure, segments_of(series.time / per_unit, series.regime))
    figure.update_xaxes(title_text=f"time [{unit}]", row=len(shown), col=1)
    style.styled(figure, 110 + 130 * len(shown))
    left = [f"{name} {number(judged.after.rms)} deg/h" for name, judged in shown]
    first = shown[0][1]
    return Drawing(
        figure,
        alt=f"What is left of {run} in time, on one scale. Rms: {listed(left)}.",
        caption=(
            f"{run}: what is left, {averages(first.averaging_s)}, all on the same scale. "
            f"Dashed: the noise floor of ± {number(first.floor)} deg/h. Rms: {listed(left)}."
        ),
    )
