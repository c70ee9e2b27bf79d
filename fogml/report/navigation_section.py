"""The part of a judgement's page that says what the drift costs in navigation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from fogml.report import style
from fogml.report.page import Drawing
from fogml.report.tables import Row, Table
from fogml.report.words import averages, number

SHOWN_AXIS = "north"
"""Of the recorded drift's figure: a north gyro's drift takes a navigator furthest in a day."""


@dataclass(frozen=True)
class NavigationSection:
    """What the page shows of one test run: recorded drift as a figure, a constant one as a table."""

    run: str
    drawing: Drawing
    table: Table


def navigation_sections(costs: Mapping[str, Any]) -> list[NavigationSection]:
    """A section for each test run from what :func:`fogml.lab.navigation_cost.navigation_costs` gives."""
    return [
        NavigationSection(run["run"], navigation_figure(run, costs["latitude_deg"]), _table(run, costs))
        for run in costs["test"]
    ]


def navigation_figure(run: Mapping[str, Any], latitude_deg: float) -> Drawing:
    """Position and heading of a navigator at rest, driven by the drift before and after compensation."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.08)
    hours = np.asarray(run["time_h"])
    last: dict[str, float] = {}
    for when, colour, dash in (("before", style.BEFORE, "dot"), ("after", style.AFTER, "solid")):
        told = run[when][SHOWN_AXIS]
        line = {"color": colour, "width": 2, "dash": dash}
        figure.add_trace(
            go.Scatter(x=hours, y=told["position_km"], mode="lines", name=when, line=line), row=1, col=1
        )
        figure.add_trace(
            go.Scatter(x=hours, y=told["heading_deg"], mode="lines", line=line, showlegend=False),
            row=2,
            col=1,
        )
        last[when] = told["position_km"][-1]
    figure.update_yaxes(title_text="position error [km]", row=1, col=1)
    figure.update_yaxes(title_text="heading error [deg]", row=2, col=1)
    figure.update_xaxes(title_text="time [h]", row=2, col=1)
    style.styled(figure, 480)
    return Drawing(
        figure,
        alt=(
            f"Errors of a navigator at rest whose {SHOWN_AXIS} gyro drifts as in {run['run']}: after "
            f"{number(float(hours[-1]))} h the position is off by {number(last['before'])} km before and "
            f"{number(last['after'])} km after compensation."
        ),
        caption=(
            f"The recorded drift ({averages(run['averaging_s'])}, floor {number(run['floor'])} deg/h) as "
            f"that of the {SHOWN_AXIS} gyro, the others perfect, undamped, latitude {latitude_deg:g}°, no "
            "error at the start. Dotted: before, solid: after compensation."
        ),
    )


def _table(run: Mapping[str, Any], costs: Mapping[str, Any]) -> Table:
    rows = []
    for axis in costs["axes"]:
        for kind, unit in (("position_km", "km"), ("heading_deg", "deg")):
            cells = [
                f"{number(before)} → {number(after)}".replace(" × ", "\u00a0×\u00a0")
                for before, after in zip(
                    run["constant"]["before"][axis][kind], run["constant"]["after"][axis][kind], strict=True
                )
            ]
            rows.append(Row((f"{axis} gyro, {kind.partition('_')[0]}", unit, *cells)))
    before, after = (run["constant"][when] for when in ("before", "after"))
    return Table(
        columns=(
            ("Constant drift of", "", "text"),
            ("Unit", "", "text"),
            *((f"{hours:g} h", "", "figure pair") for hours in costs["hours"]),
        ),
        rows=tuple(rows),
        caption=(
            f"Largest error until then, before → after, for a constant drift of the rms: "
            f"{number(before['drift_deg_h'])} → {number(after['drift_deg_h'])} deg/h. A gyrocompass "
            f"alignment with an east gyro that drifts so is off by "
            f"{number(before['gyrocompass_heading_deg'])} → {number(after['gyrocompass_heading_deg'])} deg."
        ),
    )
