"""The page of a batch: yield, what units fail on, distribution of figures, every unit with its page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fogml.report.acceptance_page import VERDICTS, limit_words
from fogml.report.page import Tile, render
from fogml.report.tables import Row, Table
from fogml.report.words import MISSING, number, percent, plural

_MOST_COLUMNS = 6
"""Figures of a unit's line: as many as fit a sheet; the spreadsheet has all."""


def batch_page(values: Mapping[str, Any], name: str = "Batch") -> str:
    """The self-contained HTML page of a ``batch.json`` (schema ``fogml.batch/1``)."""
    shown = _shown(values)
    return render(
        "batch.html",
        title=f"{name} – acceptance of a batch",
        name=name,
        verdict=verdict_sentences(values),
        tiles=_tiles(values),
        distribution=_distribution(values),
        left_out=len(values["quantities"]) - len(shown),
        units=_units(values["units"], shown),
    )


def _shown(values: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The quantities with a limit first, those that most units miss before the others."""
    order = sorted(values["quantities"], key=lambda one: (one["limit"] is None, -one["over"]))
    return order[:_MOST_COLUMNS]


def verdict_sentences(values: Mapping[str, Any]) -> list[str]:
    """Yield, what is incomplete, and what most fail on, in sentences."""
    counts, found = values["counts"], values["yield"]
    if found["share"] is None:
        first = f"None of {plural(len(values['units']), 'unit')} could be judged against limits."
    else:
        low, high = found["ci90"]
        first = (
            f"{counts['accepted']} of {plural(found['judged'], 'unit')} accepted: a yield of "
            f"{percent(found['share'])} (90 % of {percent(low)} to {percent(high)})."
        )
    sentences = [first]
    if counts["incomplete"]:
        sentences.append(f"{plural(counts['incomplete'], 'unit')} incomplete: not in the yield.")
    over = [one for one in values["quantities"] if one["over"]]
    if over:
        worst = max(over, key=lambda one: int(one["over"]))
        sentences.append(f"Most are rejected for {worst['name'][:1].lower()}{worst['name'][1:]}.")
    return sentences


def _tiles(values: Mapping[str, Any]) -> list[Tile]:
    kinds = {"accepted": "met", "rejected": "missed"}
    return [
        Tile(VERDICTS[name][2], str(count), "", "", kinds.get(name, "") if count else "")
        for name, count in values["counts"].items()
        if count or name in kinds
    ]


def _distribution(values: Mapping[str, Any]) -> Table:
    parts = ("least", "q10", "median", "q90", "largest")
    columns = (
        ("Quantity", "", "text"),
        ("Unit", "", "text"),
        ("Units tested", "", "figure"),
        *((head, "", "figure") for head in ("Least", "10 %", "Median", "90 %", "Largest")),
        ("Limit", "", "figure"),
        ("Over", "", "figure"),
    )
    rows = [
        Row(
            (
                one["name"],
                one["unit"],
                str(one["tested"]),
                *(number(one["distribution"][part]) for part in parts),
                limit_words(one["limit"]) or MISSING,
                str(one["over"]),
            )
        )
        for one in values["quantities"]
    ]
    return Table(
        columns, tuple(rows), "Sizes of the figures that count: after compensation, where there is a model."
    )


def _units(units: Sequence[Mapping[str, Any]], shown: Sequence[Mapping[str, Any]]) -> Table:
    """A line for each unit, with its page, verdict and figures."""
    heads = tuple((one["name"], one["unit"], "figure") for one in shown)
    rows = []
    for unit in units:
        kind, sign, words = VERDICTS[unit["verdict"]]
        name = " ".join(part for part in (unit["serial_number"], unit["axis"]) if part)
        figures = {one["quantity"]: unit["figures"].get(one["quantity"]) for one in shown}
        told = [number(figure) + (" ✗" if key in unit["missed"] else "") for key, figure in figures.items()]
        cells = (name, f"{sign} {words}", *told)
        rows.append(Row(cells, link=unit["page"], badge=kind, keys=(name, words, *figures.values())))
    return Table((("Unit", "", "text"), ("Verdict", "", "text"), *heads), tuple(rows), sortable=True)
