"""Figures of the misalignment procedure: slopes over the tilts, and the joint confidence region."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from fogml.report import style
from fogml.report.page import Drawing
from fogml.report.words import number


def slopes_over_tilts(values: Mapping[str, Any]) -> Drawing:
    """Slopes with the fitted curves above, what is left of them below."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, row_heights=[0.62, 0.38], vertical_spacing=0.08)
    largest = max(abs(s) for state in values["states"] for s in state["slopes"])
    left = 0.0
    for index, state in enumerate(values["states"]):
        tilts = np.asarray(state["tilts_deg"])
        fine = np.linspace(tilts.min(), tilts.max(), 91)
        terms = [np.cos(np.radians(fine)), np.sin(np.radians(fine)), np.ones_like(fine)]
        curve = sum(c * term for c, term in zip(state["coefficients"], terms))
        colour, name = style.SERIES[index], f"state {state['state']}"
        line = {"color": colour, "dash": style.DASHES[index], "width": 1.6}
        marker = {"symbol": style.MARKERS[index], "size": 9, "color": colour}
        figure.add_trace(
            go.Scatter(x=fine, y=curve, mode="lines", line=line, showlegend=False, hoverinfo="skip"),
            row=1,
            col=1,
        )
        figure.add_trace(
            go.Scatter(x=tilts, y=state["slopes"], mode="markers", name=name, marker=marker), row=1, col=1
        )
        residuals = 1e6 * np.asarray(state["residuals"]) / values["K"]
        left = max(left, float(np.abs(residuals).max()))
        figure.add_trace(
            go.Scatter(x=tilts, y=residuals, mode="markers", marker=marker, showlegend=False), row=2, col=1
        )
    figure.update_yaxes(title_text=f"slope [{values['unit']}]", row=1, col=1)
    figure.update_yaxes(title_text="left over [ppm of K]", row=2, col=1)
    figure.update_xaxes(title_text="tilt of the fixture [deg]", row=2, col=1)
    style.styled(figure, 560)
    return Drawing(
        figure,
        alt=(
            f"Output slope against tilt for the four states, up to {number(largest)} {values['unit']}, each "
            f"on a curve of cosine and sine; what is left over is at most {number(left)} ppm of K."
        ),
        caption="Markers: measured; lines: fitted. Below, what the fit leaves: a pattern there is no noise.",
    )


def region_figure(values: Mapping[str, Any]) -> Drawing | None:
    """The joint region of both components, with what the other methods say; None without standard errors."""
    region = values.get("region")
    if not region:
        return None
    outline = np.asarray(region["outline_deg"])
    figure = go.Figure()
    figure.add_trace(
        go.Scatter(
            x=outline[:, 0],
            y=outline[:, 1],
            mode="lines",
            fill="toself",
            fillcolor="rgba(0, 114, 178, 0.18)",
            line={"color": style.BLUE, "width": 1.4},
            name=f"{region['level']:.0%} region",
        )
    )
    figure.add_trace(
        go.Scatter(
            x=[values["delta_x_deg"]],
            y=[values["delta_y_deg"]],
            mode="markers",
            name="four states",
            marker={"symbol": "cross", "size": 11, "color": style.BLUE},
        )
    )
    figure.update_xaxes(title_text="misalignment x [deg]", tickformat=".6~g", nticks=5)
    figure.update_yaxes(title_text="misalignment y [deg]", tickformat=".6~g")
    style.styled(figure, 420)
    long, short = region["half_axes_deg"]
    return Drawing(
        figure,
        alt=(
            f"Joint {region['level']:.0%} confidence region of the two components about "
            f"{number(values['delta_x_deg'], 5)} and {number(values['delta_y_deg'], 5)} deg: an ellipse with "
            f"half-axes of {number(long)} and {number(short)} deg."
        ),
        caption="Both components at once lie in the ellipse at the stated confidence.",
        half=True,
    )
