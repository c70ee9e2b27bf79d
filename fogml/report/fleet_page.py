"""The page of ``fogml fleet``: every unit at one look."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from typing import Any
from urllib.parse import quote

import plotly.graph_objects as go

from fogml.fleet.summary import judged_once, label_of, told_of, unit_of
from fogml.fleet.tasks import DONE
from fogml.numerals import MISSING, averages, in_order_of_serial, listed, number, percent, plural
from fogml.report import style
from fogml.report.figures_fleet import by_unit, constants, distribution
from fogml.report.page import Drawing, Tile, render
from fogml.report.tables import Row, Table

_PAGES = {
    "train": "report.html",
    "compare": "compare.html",
    "diagnose": "gap.html",
    "acceptance": "acceptance.html",
}
"""Page in a unit's folder, by its job."""


def fleet_page(fleet: Mapping[str, Any], name: str = "fleet", batch: str | None = None) -> str:
    """The self-contained HTML page of a ``fleet.json``.

    Parameters
    ----------
    fleet
        Schema ``fogml.fleet/1``.
    name
        The manifest's name.
    batch
        Page of the batch of its acceptance reports, if there is one.
    """
    order = sorted(fleet["units"], key=lambda unit: in_order_of_serial(label_of(unit)))
    outliers = {item["unit"] for item in fleet["outliers"]}
    return render(
        "fleet.html",
        title=f"{name} – fleet",
        name=name,
        verdict=_verdict(fleet),
        tiles=_tiles(fleet),
        distribution=distribution(fleet) if fleet["distribution"]["after"] else None,
        by_unit=by_unit(fleet, order, outliers) if fleet["distribution"]["after"] else None,
        constants=constants(fleet) if "constants" in fleet else None,
        trends=_trends(fleet) if "constants" in fleet else None,
        outliers=[(item["unit"], item["why"]) for item in fleet["outliers"]],
        again=[(f"{item['unit']} ({item['job']})", item["why"]) for item in fleet["again"]],
        table=units_table(order),
        batch=batch,
        line=_line(fleet),
    )


def _line(fleet: Mapping[str, Any]) -> dict[str, Any] | None:
    """What the units' diagnoses tell together; None where none was diagnosed."""
    line = fleet.get("diagnosis")
    if line is None:
        return None
    causes = bool(named_causes(line))
    # Units that stand apart, and why; those of one kind and cause together, sizes each alone.
    together: dict[tuple[str, ...], list[str]] = defaultdict(list)
    for one in line["apart"]:
        together[one["kind"], one["effect"], one["why"]].append(one["unit"])
    return {
        "sentences": line_sentences(line),
        "figure": line_figure(line) if causes else None,
        "table": line_table(line) if causes else None,
        "apart": [(listed(units, 8), f"{effect}: {why}") for (_, effect, why), units in together.items()],
    }


def _verdict(fleet: Mapping[str, Any]) -> list[str]:
    done, failed = fleet["counts"].get("done", 0), fleet["counts"].get("failed", 0)
    what = "unit" if len(set(map(unit_of, fleet["units"]))) == len(fleet["units"]) else "job"
    sentences = []
    before, after = fleet["distribution"]["before"], fleet["distribution"]["after"]
    if before:
        sentences.append(
            f"{plural(done, what)} done; the median unit goes from {number(before['median'])} to "
            f"{number(after['median'])} deg/h rms ({_over(fleet)}), over a floor of "
            f"{number(fleet['distribution']['floor']['median'])} deg/h."
        )
    else:
        sentences.append(f"{plural(done, what)} done.")
    if failed:
        sentences.append(f"{plural(failed, what)} could not be done.")
    again = {item["unit"] for item in fleet["again"]}
    if again:
        sentences.append(f"{plural(len(again), 'unit needs', 'units need')} attention.")
    return sentences


def _over(fleet: Mapping[str, Any]) -> str:
    times = {unit["averaging_s"] for unit in judged_once(fleet["units"])}
    return averages(times.pop()) if len(times) == 1 else "averages"


def _tiles(fleet: Mapping[str, Any]) -> list[Tile]:
    counts, spread = fleet["counts"], fleet["distribution"]
    failed = counts.get("failed", 0)
    tiles = [
        Tile(
            "Units",
            str(len(set(map(unit_of, fleet["units"])))),
            "",
            f"{failed} failed" if failed else "all done",
            "missed" if failed else "",
        )
    ]
    for key, words in (("before", "Rms before"), ("after", "Rms after"), ("floor", "Noise floor")):
        if spread[key]:
            ends = f"{number(spread[key]['q10'])} … {number(spread[key]['q90'])}"
            tiles.append(Tile(f"{words}, median", number(spread[key]["median"]), "deg/h", f"8 in 10: {ends}"))
    tiles.append(Tile("Unlike the others", str(len({item["unit"] for item in fleet["outliers"]}))))
    tiles.append(Tile("Need attention", str(len({item["unit"] for item in fleet["again"]}))))
    return tiles


def _trends(fleet: Mapping[str, Any]) -> Table:
    found = fleet["constants"]
    rows = []
    for place, trend in enumerate(found["trends"]):
        rows.append(
            (
                "constant" if trend["name"] == "1" else trend["name"],
                number(found["mean"][place]),
                number(found["std"][place]),
                number(trend["per_unit"]),
                number(trend["probability"], 2),
                "drift seen" if trend["seen"] else "none seen",
            )
        )
    columns = (
        "Constant | >Fleet mean [deg/h per unit of the term] | >Between units, 1 σ | "
        ">Per serial number | >Probability by chance | Trend"
    )
    return Table(
        columns, rows, "Slope of units' own runs by Theil and Sen, probability by Kendall's rank correlation."
    )


def units_table(order: list[Mapping[str, Any]]) -> Table:
    """Every unit with its job, what came of it, and a link to its page."""
    rows = []
    for unit in order:
        told = unit["reason"] or told_of(unit)
        if unit["effects"]:
            told += f": {', '.join(unit['effects'])}"
        rows.append(
            Row(
                (
                    label_of(unit),
                    unit["job"],
                    _status(unit),
                    number(unit["before"]),
                    number(unit["after"]),
                    number(unit["floor"]),
                    percent(unit["outside_training"]),
                    told or MISSING,
                ),
                link=f"{quote(unit['folder'])}/{_PAGES[unit['job']]}" if unit["status"] == DONE else "",
                keys=(
                    label_of(unit),
                    unit["job"],
                    _status(unit),
                    *(unit[key] for key in ("before", "after", "floor", "outside_training")),
                    told,
                ),
            )
        )
    columns = (
        "Unit | Job | Status | >Rms before [deg/h] | >Rms after [deg/h] | >Floor [deg/h] | "
        ">Outside training | Model, verdict or reason"
    )
    return Table(columns, rows, "Every unit, its worst test run.", sortable=True)


def _status(unit: Mapping[str, Any]) -> str:
    """How a unit's job ended, in words."""
    if unit["verdict"] == "incomplete":
        return "incomplete"
    return str(unit["status"]) if unit["met"] is not False else "limit not met"


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
        else "Of no cause these runs show that it is shared by more than half of "
        f"{plural(line['units'], 'diagnosed unit')}."
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
            low, high = (number(end) for end in cause["amplitude_ci90"])
            size = f"{number(cause['amplitude'])} ({low} … {high}) {cause['unit']}{between}"
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
        rows.append(cells)
    columns = (
        "Cause | Shared | Units that have it [of those that could show it] | "
        "Share of the line [90 %] | Size [90 %] | Of the line's gap [90 %] | "
        ">Gap without it [deg/h rms] | Place"
    )
    others = len(line["causes"]) - len(rows)
    more = (
        f" {plural(others, 'more is', 'more are')} hinted at and named in none: fleet.json." if others else ""
    )
    return Table(columns, rows, f"Causes of the line, what makes most of its gap first.{more}")


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
        bars = style.error_bars(middle, ends, thickness=1, width=3, color=colour)
        figure.add_trace(style.points(middle, names, words, colour, symbol, error_x=bars))
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
