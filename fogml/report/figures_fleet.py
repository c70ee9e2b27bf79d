"""Figures of a fleet: what units had and have left, and their constants over serial numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import takewhile
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from fogml.fleet.summary import judged_once, label_of
from fogml.numerals import number, plural
from fogml.report import style
from fogml.report.page import Drawing
from fogml.report.style import log_axis

_COLUMNS = 2
_LONGEST_LABEL = 16
"""Characters of a serial number on an axis: written upright, 7 px each, they leave two thirds of the
height of 360 px to the figure."""


def distribution(fleet: Mapping[str, Any]) -> Drawing:
    """Rms before and after of all units, as cumulated shares, with the median floor."""
    judged = judged_once(fleet["units"])
    figure = go.Figure()
    shares = 100.0 * (np.arange(len(judged)) + 0.5) / len(judged)
    for key, name, colour, dash in (
        ("before", "before", style.TRAINING, "dash"),
        ("after", "after", style.GREEN, "solid"),
    ):
        values = sorted(unit[key] for unit in judged)
        stairs = {"color": colour, "dash": dash, "shape": "hv"}
        figure.add_scatter(
            x=values, y=shares, mode="lines+markers", name=name, line=stairs, marker={"size": 5}
        )
    floor = fleet["distribution"]["floor"]["median"]
    figure.add_vline(x=floor, line=style.FLOOR_LINE)
    figure.add_trace(style.floor_in_legend())
    every = [unit[key] for unit in judged for key in ("before", "after")] + [floor]
    figure.update_xaxes(
        title_text="rms on the worst test run [deg/h], logarithmic",
        **log_axis(*every),
    )
    figure.update_yaxes(title_text="units at or below [%]", range=[0, 100])
    style.styled(figure, 360)
    before, after = fleet["distribution"]["before"], fleet["distribution"]["after"]
    return Drawing(
        figure,
        alt=(
            f"Rms of {plural(len(judged), 'unit')}: median {number(before['median'])} before and "
            f"{number(after['median'])} deg/h after, median noise floor {number(floor)}."
        ),
        caption="Each unit's worst test run. Dashed line: the units' median noise floor.",
    )


def by_unit(fleet: Mapping[str, Any], order: Sequence[Mapping[str, Any]], outliers: set[str]) -> Drawing:
    """Rms before and after and the floor of each unit, in order of serial numbers."""
    units = judged_once(order)
    labels = [label_of(unit) for unit in units]
    figure = go.Figure()
    for key, symbol, colour in (
        ("before", "circle-open", style.TRAINING),
        ("after", "circle", style.GREEN),
        ("floor", "line-ew-open", style.BLACK),
    ):
        name = "noise floor" if key == "floor" else key
        figure.add_trace(style.points(labels, [unit[key] for unit in units], name, colour, symbol))
    odd = {label_of(unit): unit["after"] for unit in units if label_of(unit) in outliers}
    if odd:
        figure.add_trace(style.ring(list(odd), list(odd.values()), "unlike the others", 17))
    every = [v for unit in units for v in (unit["before"], unit["after"], unit["floor"]) if v]
    figure.update_yaxes(title_text="rms [deg/h], logarithmic", **log_axis(*every))
    serial_axis(figure, labels)
    style.styled(figure, 400)
    return Drawing(
        figure,
        alt=f"Rms before and after of {plural(len(units), 'unit')} in order of serial numbers.",
        caption="Each unit's worst test run, in order of serial numbers.",
    )


def constants(fleet: Mapping[str, Any]) -> Drawing:
    """The units' constants in the common form over serial numbers, with the fleet's spread."""
    found = fleet["constants"]
    names, labels = found["names"], found["units"]
    rows = -(-len(names) // _COLUMNS)
    figure = make_subplots(
        rows=rows,
        cols=_COLUMNS,
        shared_xaxes=True,
        horizontal_spacing=0.16,
        vertical_spacing=0.24 / rows,
        # Above the panels: beside one, on paper, it would lie on that to the left.
        subplot_titles=["constant [deg/h]" if n == "1" else f"{n} [deg/h per its unit]" for n in names],
    )
    figure.update_annotations(font_size=12)
    values, errors = np.array(found["values"]), np.array(found["se"])
    for place in range(len(names)):
        row, column = place // _COLUMNS + 1, place % _COLUMNS + 1
        mean, std = found["mean"][place], found["std"][place]
        bars = {"type": "data", "array": errors[:, place], "thickness": 1, "width": 2}
        own = values[:, place]
        trace = style.points(labels, own, None, style.BLUE, size=7, error_y=bars, showlegend=False)
        figure.add_trace(trace, row, column)
        for end in (mean - 2 * std, mean + 2 * std):
            figure.add_hline(y=end, line=style.FLOOR_LINE, row=row, col=column)
    serial_axis(figure, labels, most=16)
    for row in range(1, rows):
        figure.update_xaxes(title_text="", row=row)
    # Long ones would lie on each other; it is the same of all.
    figure.update_xaxes(title_text="", col=2)
    style.styled(figure, 90 + 170 * rows)
    moving = [trend["name"] for trend in found["trends"] if trend["seen"]]
    told = f"Drift over serial numbers is seen in {', '.join(moving)}." if moving else "No drift is seen."
    return Drawing(
        figure,
        alt=f"Constants of {plural(len(labels), 'unit')} in the form {found['features']}. {told}",
        caption=(
            "The form's constants from each unit's training runs, drawn to the fleet where they tell little, "
            "with standard errors; the constant is at the fleet's mean temperature and rate. Dashed: two "
            f"standard deviations of the fleet. {told}"
        ),
    )


def serial_axis(figure: go.Figure, labels: Sequence[str], most: int = 24) -> None:
    """An axis of serial numbers, of which as many are written as there is room for, `most` on paper.

    Of long ones what all begin with is written once, beside the axis, and of the rest the end.
    """
    step = max(1, -(-len(labels) // most))
    ends = min(labels, default=""), max(labels, default="")
    shared = "".join(a for a, _ in takewhile(lambda pair: pair[0] == pair[1], zip(*ends)))
    shared = shared.rstrip("0123456789") if len(labels) > 1 else ""
    if max(map(len, labels), default=0) <= _LONGEST_LABEL:
        shared = ""
    rest = [label.removeprefix(shared) for label in labels]
    words = [label if len(label) <= _LONGEST_LABEL else "…" + label[1 - _LONGEST_LABEL :] for label in rest]
    if shared:
        begins = shared if len(shared) <= 3 * _LONGEST_LABEL else shared[: 3 * _LONGEST_LABEL] + "…"
        figure.update_xaxes(title_text=f"unit, behind {begins}")
    figure.update_xaxes(
        type="category",
        categoryorder="array",
        categoryarray=list(labels),
        tickmode="array",
        tickvals=list(labels)[::step],
        ticktext=words[::step],
        tickangle=-90 if len(labels) > 8 or max(map(len, words), default=0) > _LONGEST_LABEL // 2 else 0,
    )
