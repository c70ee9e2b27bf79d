"""Colours, markers and axes of every figure: told apart without colour as well."""

from __future__ import annotations

from typing import Any

import plotly.graph_objects as go

# Okabe and Ito's palette, distinct under the common colour deficiencies
# (M. Okabe and K. Ito, "Color Universal Design", 2008).
BLACK = "#000000"
ORANGE = "#E69F00"
SKY_BLUE = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILION = "#D55E00"
PURPLE = "#CC79A7"
GREY = "#8A9099"

# What a thing is drawn in, the same on every page.
BEFORE = "#3B4048"
AFTER = GREEN
MODEL = VERMILION
FLOOR = BLACK
TRAINING = "#9AA1AA"
WARMING = VERMILION
COOLING = BLUE
STEADY = GREY

SERIES = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY_BLUE, BLACK)
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot", "solid")
MARKERS = ("circle", "diamond-open", "triangle-up", "square-open", "cross", "x", "star-open")

# Pale tints for bands behind curves; each band also bears its name where it is wide enough.
REGIME_TINTS = {
    "start_up": "rgba(240, 228, 66, 0.28)",
    "ramp_up": "rgba(213, 94, 0, 0.13)",
    "ramp_down": "rgba(0, 114, 178, 0.13)",
    "soak": "rgba(0, 0, 0, 0.00)",
    "after_ramp": "rgba(0, 158, 115, 0.13)",
    "turning": "rgba(204, 121, 167, 0.30)",
}
REGIME_WORDS = {
    "start_up": "start-up",
    "ramp_up": "ramp up",
    "ramp_down": "ramp down",
    "soak": "soak",
    "after_ramp": "after a ramp",
    "turning": "turning",
}

FLOOR_LINE = {"color": FLOOR, "width": 1.2, "dash": "dash"}

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', Arial, sans-serif"
_INK = "#1F2328"
_GRID = "#E4E7EB"
_AXIS_LINE = "#9AA1AA"


def _axis() -> dict[str, Any]:
    return {
        "showgrid": True,
        "gridcolor": _GRID,
        "linecolor": _AXIS_LINE,
        "showline": True,
        "mirror": True,
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": _AXIS_LINE,
        "zeroline": False,
        "automargin": True,
        "title": {"standoff": 8},
    }


TEMPLATE = go.layout.Template(
    layout={
        "font": {"family": FONT, "size": 13, "color": _INK},
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "colorway": list(SERIES),
        "xaxis": _axis(),
        "yaxis": _axis(),
        "margin": {"l": 64, "r": 16, "t": 34, "b": 48},
        "legend": {
            "orientation": "h",
            "x": 0.0,
            "xanchor": "left",
            "y": 1.02,
            "yanchor": "bottom",
            "traceorder": "normal",
            "itemwidth": 40,
        },
        "hoverlabel": {"font": {"family": FONT, "size": 12}},
        "separators": ".\u202f",
    }
)


def floor_in_legend() -> go.Scatter:
    """A trace without points that gives the floor's line a place in the legend."""
    return go.Scatter(x=[None], y=[None], mode="lines", name="noise floor", line=FLOOR_LINE)


def ring(size: int) -> dict[str, Any]:
    """The marker that sets one point off from others, of so many px."""
    return {"symbol": "circle-open", "size": size, "color": VERMILION, "line": {"width": 2.5}}


def styled(figure: go.Figure, height: int, **layout: Any) -> go.Figure:
    """Put the house style on a figure, with its height in px and further layout settings."""
    figure.update_layout(template=TEMPLATE, height=height, **layout)
    return figure
