"""Figures of north seeking: the error around the circle, and over latitude and dwell."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go

from fogml.report import style
from fogml.report.page import Drawing
from fogml.report.words import number


def error_by_azimuth(values: Mapping[str, Any]) -> Drawing | None:
    """A plain seek's error around the circle with quiet and worst azimuths; None where nothing is told."""
    circle = values.get("errors_by_azimuth")
    if not circle:
        return None
    azimuth, error = np.asarray(circle["azimuth_deg"]), np.asarray(circle["error_deg"])
    figure = go.Figure()
    figure.add_trace(
        go.Scatter(
            x=azimuth, y=error, mode="lines", name="plain seek", line={"color": style.BLUE, "width": 2}
        )
    )
    quiet = values["quiet_azimuth_deg"] if values.get("way", "plain") == "plain" else []
    if quiet:
        figure.add_trace(
            go.Scatter(
                x=quiet,
                y=[0.0] * len(quiet),
                mode="markers",
                name="quiet azimuth",
                marker={"symbol": "circle", "size": 11, "color": style.GREEN},
            )
        )
    here = values.get("true_azimuth_deg", values["azimuth_deg"])
    at = float(np.interp(here, azimuth, error, period=360.0))
    figure.add_trace(
        go.Scatter(
            x=[here],
            y=[at],
            mode="markers",
            name="this seek",
            marker={"symbol": "diamond-open", "size": 12, "color": style.VERMILION, "line": {"width": 2}},
        )
    )
    figure.update_xaxes(title_text="azimuth [deg clockwise from north]", range=[0, 360], dtick=45)
    figure.update_yaxes(title_text="error of the azimuth [deg]", tickformat=".3~g")
    style.styled(figure, 400)
    places = " and ".join(f"{a:.1f}" for a in quiet)
    zero = f"; it is nothing at {places} deg" if quiet else ""
    return Drawing(
        figure,
        alt=(
            f"Error of a plain seek against azimuth: between {number(float(error.min()))} and "
            f"{number(float(error.max()))} deg{zero}."
        ),
        caption="Closed form. Dots: azimuths at which this drift does nothing.",
    )


def error_map(values: Mapping[str, Any]) -> Drawing | None:
    """Greatest error of a plain seek over latitude and dwell; None for a recorded seek."""
    told = values.get("maps")
    if not told:
        return None
    greatest = np.asarray(told["greatest_error_deg"])
    dwells = [f"{d:g}" for d in told["dwell_s"]]
    latitudes = [f"{latitude:g}" for latitude in told["latitude_deg"]]
    # Every cell bears its number: nothing has to be read from a colour.
    text = [[number(v, 2) for v in row] for row in greatest]
    figure = go.Figure(
        go.Heatmap(
            x=dwells,
            y=latitudes,
            z=np.log10(np.maximum(greatest, 1e-12)),
            text=text,
            texttemplate="%{text}",
            colorscale="Cividis",
            showscale=False,
            hovertemplate="dwell %{x} s, latitude %{y} deg: %{text} deg<extra></extra>",
        )
    )
    figure.update_xaxes(title_text="dwell in each position [s]", type="category")
    figure.update_yaxes(title_text="latitude [deg]", type="category")
    style.styled(figure, 560)
    return Drawing(
        figure,
        alt=(
            f"Greatest error over the circle for latitudes from {latitudes[0]} to {latitudes[-1]} deg and "
            f"dwells from {dwells[0]} to {dwells[-1]} s: {number(float(greatest.min()))} to "
            f"{number(float(greatest.max()))} deg, larger at high latitude."
        ),
        caption="Numbers: greatest error of a plain seek over all azimuths [deg], for this page's drift.",
    )
