"""What a fleet's diagnoses tell together, on the fleet's page: words, table and figure."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import plotly.graph_objects as go

from fogml.report import style
from fogml.report.page import Drawing
from fogml.report.tables import Row, Table
from fogml.report.words import MISSING, listed, number, percent, plural

_SHOWN = 20
"""Causes of the figure; the table holds all."""


def named_causes(line: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Causes that the diagnosis of one unit at least is sure enough of to name."""
    return [cause for cause in line["causes"] if cause["units_named"]]


def line_sentences(line: Mapping[str, Any]) -> list[str]:
    """What the line shares and what to change first."""
    shared = [cause["effect"] for cause in line["causes"] if cause["shared"]]
    told = [
        f"Of {plural(line['units'], 'diagnosed unit')} more than half share {', '.join(shared)}."
        if shared
        else f"No cause is shared by more than half of {plural(line['units'], 'diagnosed unit')}."
    ]
    # What may be nothing is no reason to change anything.
    first = next((cause for cause in line["causes"] if cause["energy_share_ci90"][0] > 0.0), None)
    if first is not None:
        low, high = first["energy_share_ci90"]
        told.append(
            f"Change first: {first['effect']} ({first['place']}). It makes {percent(first['energy_share'])} "
            f"of the line's gap (90 %: {percent(low)} … {percent(high)}); without it the gap goes from "
            f"{number(line['gap_rms'])} to {number(first['gap_rms_without'])} deg/h rms."
        )
    for cause in line["causes"]:
        for known in cause["depends_on"]:
            shares = ", ".join(f"{value} {percent(share)}" for value, share in known["prevalence"].items())
            told.append(
                f"How common {cause['effect']} is depends on {known['name']} (probability "
                f"{number(known['probability'], 3)}): {shares}."
            )
    unknown = line["unknown"]
    low, high = unknown["prevalence_ci90"]
    told.append(
        f"Something that no known cause explains is in {percent(low)} … {percent(high)} of the units."
    )
    return told


def line_table(line: Mapping[str, Any]) -> Table:
    """Every cause that is named in a unit."""
    rows = []
    for cause in named_causes(line):
        size = MISSING
        if cause["amplitude"] is not None:
            between = f", between units {number(cause['between_units'])}" if cause["between_units"] else ""
            size = f"{number(cause['amplitude'])} ± {number(cause['amplitude_se'])} {cause['unit']}{between}"
        common, energy = cause["prevalence_ci90"], cause["energy_share_ci90"]
        cells = (
            cause["effect"],
            "yes" if cause["shared"] else "no",
            f"{cause['units_named']} of {cause['units_told']}",
            f"{percent(cause['prevalence'])} ({percent(common[0])} … {percent(common[1])})",
            size,
            f"{percent(cause['energy_share'])} ({percent(energy[0])} … {percent(energy[1])})",
            number(cause["gap_rms_without"]),
            cause["place"],
        )
        rows.append(Row(cells))
    columns = (
        ("Cause", "", "text"),
        ("Shared", "", "text"),
        ("Units that have it", "of those that could show it", "text"),
        ("Share of the line", "90 %", "text"),
        ("Size", "", "text"),
        ("Of the line's gap", "90 %", "text"),
        ("Gap without it", "deg/h rms", "figure"),
        ("Place", "", "text"),
    )
    others = len(line["causes"]) - len(rows)
    more = (
        f" {plural(others, 'more is', 'more are')} hinted at and named in none: fleet.json." if others else ""
    )
    return Table(columns, tuple(rows), f"Causes of the line, what makes most of its gap first.{more}")


def line_figure(line: Mapping[str, Any]) -> Drawing:
    """What each cause makes of the line's gap, and how common it is."""
    causes = named_causes(line)[:_SHOWN][::-1]
    names = [cause["effect"] for cause in causes]
    figure = go.Figure()
    for key, words, colour, symbol in (
        ("energy_share", "of the line's gap", style.BLUE, "circle"),
        ("prevalence", "of the line's units", style.VERMILION, "diamond-open"),
    ):
        middle = [100.0 * cause[key] for cause in causes]
        ends = [[100.0 * end for end in cause[f"{key}_ci90"]] for cause in causes]
        figure.add_trace(
            go.Scatter(
                x=middle,
                y=names,
                mode="markers",
                name=words,
                marker={"size": 9, "color": colour, "symbol": symbol},
                error_x={
                    "type": "data",
                    "symmetric": False,
                    "array": [max(high - m, 0.0) for m, (_, high) in zip(middle, ends, strict=True)],
                    "arrayminus": [max(m - low, 0.0) for m, (low, _) in zip(middle, ends, strict=True)],
                    "thickness": 1,
                    "width": 3,
                    "color": colour,
                },
            )
        )
    figure.update_xaxes(title_text="share [%]", range=[0, 102])
    style.styled(figure, 130 + 34 * len(names))
    first = causes[-1]
    return Drawing(
        figure,
        alt=(
            f"Causes of {plural(line['units'], 'unit')}: {first['effect']} makes "
            f"{percent(first['energy_share'])} of the gap."
        ),
        caption=(
            "What each cause makes of the line's gap, and in how many of its units it acts; bars: 90 %. "
            "Common and large is what to change in production; rare and large is what to sort out."
        ),
    )


def apart_facts(line: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Units that stand apart, and why; those of one kind and cause together, sizes each alone."""
    together: dict[tuple[str, ...], list[str]] = defaultdict(list)
    for one in line["apart"]:
        together[one["kind"], one["effect"], one["why"]].append(one["unit"])
    return [(listed(units, 8), f"{effect}: {why}") for (_, effect, why), units in together.items()]
