"""Figures of a blind score: reliability, open set, confusion, strata."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import plotly.graph_objects as go

from fogml.report import style
from fogml.report.page import Drawing
from fogml.report.words import number, percent

_HEIGHT = 420
_CHANCE = {"color": style.GREY, "width": 1.2, "dash": "dash"}


def reliability_plot(bins: Sequence[Mapping[str, Any]], error: float | None) -> Drawing:
    """Stated probability against frequency, with Wilson intervals and the diagonal."""
    figure = go.Figure()
    figure.add_trace(go.Scatter(x=[0, 1], y=[0, 1], mode="lines", name="as stated", line=_CHANCE))
    found = [part["found"] for part in bins]
    figure.add_trace(
        go.Scatter(
            x=[part["stated"] for part in bins],
            y=found,
            error_y={
                "array": [part["high"] - part["found"] for part in bins],
                "arrayminus": [part["found"] - part["low"] for part in bins],
            },
            mode="markers+text",
            text=[str(part["n"]) for part in bins],
            textposition="bottom right",
            textfont={"size": 11},
            marker={"size": 9, "color": style.BLUE},
            name="found, 95 % interval; the number is how many",
        )
    )
    figure.update_xaxes(title_text="stated probability", range=[-0.02, 1.08])
    figure.update_yaxes(title_text="share that is true", range=[-0.1, 1.04])
    style.styled(figure, _HEIGHT)
    return Drawing(
        figure,
        alt=f"Reliability diagram of {len(bins)} bins; expected calibration error {number(error)}.",
        caption="Every listed effect. Below the diagonal: more certain than right.",
        half=True,
    )


def open_set_plot(curves: Mapping[str, Mapping[str, Sequence[float]]], areas: Mapping[str, Any]) -> Drawing:
    """True against false positives on the unknown's probability, a line per method."""
    figure = go.Figure()
    figure.add_trace(go.Scatter(x=[0, 1], y=[0, 1], mode="lines", name="chance", line=_CHANCE))
    shown = [(name, curve) for name, curve in curves.items() if len(curve["false_positive"]) > 2]
    for place, (name, curve) in enumerate(shown):
        figure.add_trace(
            go.Scatter(
                x=list(curve["false_positive"]),
                y=list(curve["true_positive"]),
                mode="lines",
                name=f"{name} ({number(areas.get(name))})",
                line={
                    "color": style.SERIES[place % len(style.SERIES)],
                    "dash": style.DASHES[place % len(style.DASHES)],
                    "width": 2.4 if place == 0 else 1.4,
                },
            )
        )
    figure.update_xaxes(title_text="share of cases without an unknown above the threshold", range=[-0.01, 1])
    figure.update_yaxes(title_text="share of cases with one", range=[0, 1.01])
    style.styled(figure, _HEIGHT)
    told = ", ".join(f"{name} {number(areas.get(name))}" for name, _ in shown) or "none has one"
    return Drawing(
        figure,
        alt=f"Open-set curves; area under each: {told}.",
        caption="In brackets the area under the curve. Methods that say the same everywhere are not drawn.",
        half=True,
    )


def confusion_plot(values: Mapping[str, Any]) -> Drawing:
    """Which effect was answered where one is missing, in shares of each row."""
    counts = values["counts"]
    totals = [max(sum(row), 1) for row in counts]
    shares = [[count / total for count in row] for row, total in zip(counts, totals)]
    figure = go.Figure(
        go.Heatmap(
            z=shares,
            x=list(values["answered"]),
            y=list(values["true"]),
            text=[[str(count) if count else "" for count in row] for row in counts],
            texttemplate="%{text}",
            textfont={"size": 10},
            colorscale=[[0.0, "#FFFFFF"], [0.5, style.SKY_BLUE], [1.0, style.BLUE]],
            zmin=0.0,
            zmax=1.0,
            xgap=1,
            ygap=1,
            colorbar={"title": {"text": "share"}, "thickness": 12},
            hovertemplate="%{y}: answered %{x}, %{text} of the cases<extra></extra>",
        )
    )
    figure.update_yaxes(autorange="reversed", title_text="truly missing", tickfont={"size": 11})
    figure.update_xaxes(title_text="answered", tickangle=-60, tickfont={"size": 11})
    style.styled(figure, 260 + 20 * len(values["true"]))
    right = sum(row[i] for i, row in enumerate(counts))
    total = sum(map(sum, counts))
    return Drawing(
        figure,
        alt=f"Confusion over {total} cases with one missing effect: {right} in a named class.",
        caption=(
            "Cases with one missing effect. A hit is an effect that is in a named class; otherwise the most "
            "certain name counts, or unknown, or nothing. Numbers are cases, colours shares of a row."
        ),
    )


def strata_plot(rows: Sequence[Mapping[str, Any]]) -> Drawing:
    """How some figures grow better with the strength of what is missing."""
    figure = go.Figure()
    told = []
    for place, row in enumerate(rows):
        parts = row["by_stratum"]
        if not parts:
            continue
        names, values = list(parts), [part["value"] for part in parts.values()]
        figure.add_trace(
            go.Scatter(
                x=names,
                y=values,
                error_y={
                    "array": [(p["high"] or 0.0) - (p["value"] or 0.0) for p in parts.values()],
                    "arrayminus": [(p["value"] or 0.0) - (p["low"] or 0.0) for p in parts.values()],
                    "thickness": 1,
                },
                mode="lines+markers",
                name=row["words"].replace(", d′ > 10", ""),
                line={"color": style.SERIES[place % 7], "dash": style.DASHES[place % 7]},
                marker={"symbol": style.MARKERS[place % 7], "size": 8},
            )
        )
        told.append(f"{row['words']}: {', '.join(percent(value) for value in values)}")
    figure.update_xaxes(title_text="d′ of the weakest missing effect", type="category")
    figure.update_yaxes(title_text="share of cases", range=[-0.02, 1.02])
    # Room between the legend and the tools that appear above it.
    style.styled(figure, _HEIGHT + 40, margin={"t": 84})
    return Drawing(
        figure,
        alt="Figures by stratum of d′. " + "; ".join(told),
        caption="d′: length of what is missing, whitened, less what the nominal constants make up for.",
    )
