"""The page of ``fogml fleet``: every unit at one look."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from urllib.parse import quote

from fogml.fleet.summary import in_order_of_serial, label_of
from fogml.fleet.tasks import DONE
from fogml.report.figures_fleet import by_unit, constants, distribution
from fogml.report.fleet_diagnosis import apart_facts, line_figure, line_sentences, line_table, named_causes
from fogml.report.page import Tile, render
from fogml.report.tables import Row, Table
from fogml.report.words import MISSING, averages, number, percent, plural

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
    judged = [unit for unit in order if unit["after"] is not None]
    outliers = {item["unit"] for item in fleet["outliers"]}
    return render(
        "fleet.html",
        title=f"{name} – fleet",
        name=name,
        verdict=_verdict(fleet),
        tiles=_tiles(fleet),
        distribution=distribution(fleet) if judged else None,
        by_unit=by_unit(fleet, order, outliers) if judged else None,
        constants=constants(fleet) if "constants" in fleet else None,
        trends=_trends(fleet) if "constants" in fleet else None,
        outliers=[(item["unit"], item["why"]) for item in fleet["outliers"]],
        again=[(f"{item['unit']} ({item['job']})", item["why"]) for item in fleet["again"]],
        table=_table(order),
        batch=batch,
        line=_line(fleet),
    )


def _line(fleet: Mapping[str, Any]) -> dict[str, Any] | None:
    """What the units' diagnoses tell together; None where none was diagnosed."""
    line = fleet.get("diagnosis")
    if line is None:
        return None
    causes = bool(named_causes(line))
    return {
        "sentences": line_sentences(line),
        "figure": line_figure(line) if causes else None,
        "table": line_table(line) if causes else None,
        "apart": apart_facts(line),
    }


def _verdict(fleet: Mapping[str, Any]) -> list[str]:
    done, failed = fleet["counts"].get("done", 0), fleet["counts"].get("failed", 0)
    sentences = []
    before, after = fleet["distribution"]["before"], fleet["distribution"]["after"]
    if before:
        sentences.append(
            f"{plural(done, 'unit')} done; the median unit goes from {number(before['median'])} to "
            f"{number(after['median'])} deg/h rms ({_over(fleet)}), over a floor of "
            f"{number(fleet['distribution']['floor']['median'])} deg/h."
        )
    else:
        sentences.append(f"{plural(done, 'unit')} done.")
    if failed:
        sentences.append(f"{plural(failed, 'unit')} could not be done.")
    again = {item["unit"] for item in fleet["again"]}
    if again:
        sentences.append(f"{plural(len(again), 'unit needs', 'units need')} another run.")
    return sentences


def _over(fleet: Mapping[str, Any]) -> str:
    times = {unit["averaging_s"] for unit in fleet["units"] if unit["averaging_s"]}
    return averages(times.pop()) if len(times) == 1 else "averages"


def _tiles(fleet: Mapping[str, Any]) -> list[Tile]:
    counts, spread = fleet["counts"], fleet["distribution"]
    failed = counts.get("failed", 0)
    tiles = [
        Tile(
            "Units",
            str(len(fleet["units"])),
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
    tiles.append(Tile("Need another run", str(len({item["unit"] for item in fleet["again"]}))))
    return tiles


def _trends(fleet: Mapping[str, Any]) -> Table:
    found = fleet["constants"]
    rows = []
    for place, trend in enumerate(found["trends"]):
        rows.append(
            Row(
                (
                    "constant" if trend["name"] == "1" else trend["name"],
                    number(found["mean"][place]),
                    number(found["std"][place]),
                    number(trend["per_unit"]),
                    number(trend["probability"], 2),
                    "drift seen" if trend["seen"] else "none seen",
                )
            )
        )
    columns = (
        ("Constant", "", "text"),
        ("Fleet mean", "deg/h per unit of the term", "figure"),
        ("Between units, 1 σ", "", "figure"),
        ("Per serial number", "", "figure"),
        ("Probability by chance", "", "figure"),
        ("Trend", "", "text"),
    )
    return Table(columns, tuple(rows), "Slope by Theil and Sen, probability by Kendall's rank correlation.")


def _table(order: list[Mapping[str, Any]]) -> Table:
    rows = []
    for unit in order:
        told = unit["reason"] or unit["verdict"].replace("_", " ") or unit["model"]
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
        ("Unit", "", "text"),
        ("Job", "", "text"),
        ("Status", "", "text"),
        ("Rms before", "deg/h", "figure"),
        ("Rms after", "deg/h", "figure"),
        ("Floor", "deg/h", "figure"),
        ("Outside training", "", "figure"),
        ("Model, verdict or reason", "", "text"),
    )
    return Table(columns, tuple(rows), "Every unit, its worst test run.", sortable=True)


def _status(unit: Mapping[str, Any]) -> str:
    """How a unit's job ended, in words."""
    if unit["verdict"] == "incomplete":
        return "limits not all tested"
    return str(unit["status"]) if unit["met"] is not False else "limit not met"
