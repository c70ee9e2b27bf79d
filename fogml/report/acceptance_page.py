"""The acceptance report as a page that prints on one to three sheets of A4, and the page of a batch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from fogml.lab.acceptance_rows import BY_KEY
from fogml.numerals import MISSING, against, listed, number, percent, plural, short, stated, unit_words
from fogml.pictures import Curve, line_figure
from fogml.report import style
from fogml.report.page import Tile, render
from fogml.report.tables import Row, Table, columns_of

VERDICTS = {
    "accepted": ("met", "✓", "Accepted"),
    "rejected": ("missed", "✗", "Rejected"),
    "incomplete": ("care", "!", "Incomplete"),
    "no_limits": ("care", "!", "No limits stated"),
}
"""Verdicts as they are shown: colour's class, sign, words."""


def acceptance_page(values: Mapping[str, Any]) -> str:
    """The self-contained HTML page of an ``acceptance.json`` (schema ``fogml.acceptance/1``)."""
    kind, sign, words = VERDICTS[values["verdict"]]
    name = named(values)
    return render(
        "acceptance.html",
        title=f"{name} – acceptance report",
        name=name,
        values=values,
        verdict={"kind": kind, "sign": sign, "words": words},
        about=_about(values),
        rows=[_shown(row) for row in values["rows"]],
        compensated=values["model"] is not None,
        limited=values["limits"] is not None,
        soaks=_soaks(values),
        figure=_figure(values),
        runs=_runs(values),
        files=files_of(values),
    )


def named(values: Mapping[str, Any]) -> str:
    """Unit and axis."""
    unit, axis = values["serial_number"] or "unit not stated", values["axis"]
    return f"{unit}, axis {axis}" if axis else str(unit)


def limit_words(told: Mapping[str, Any]) -> str:
    """The limit of a quantity as people write it."""
    if told["limit"] is None:
        return ""
    low, high = told["limit"]["from"], told["limit"]["to"]
    if low is None:
        return f"≤ {stated(high)}"
    if high is None:
        return f"≥ {stated(low)}"
    if low == -high:
        return f"{'±' if BY_KEY[told['quantity']].signed else '≤'} {stated(high)}"
    return f"{stated(low)} … {stated(high)}"


def figure_words(row: Mapping[str, Any], when: str) -> str:
    """A row's figure as people write it: one that is only known to be no more or less with its sign."""
    return bounded(row[when], bool(row.get("at_most")), bool(row.get("at_least")), row["limit"])


def bounded(
    value: float | None, at_most: bool, at_least: bool, limit: Mapping[str, float | None] | None = None
) -> str:
    """A figure, with the sign of what is only known to be no more, or no less; bare where both are mixed."""
    if value is None:
        return number(value)
    sign = "" if at_most == at_least else "≤ " if at_most else "≥ "
    return f"{sign}{against(value, *(limit or {}).values())}"


def _shown(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row of the main table in words."""
    ieee = row["ieee_952"] + (f" ({row['clause']})" if row["clause"] else "")
    outcome = {True: ("met", "✓ met"), False: ("missed", "✗ not met")}.get(row["met"], ("", ""))
    if row["limit"] is not None and row["met"] is None:
        outcome = ("care", "! open" if row["tested"] else "! not tested")
    return {
        "name": row["name"],
        "standards": " · ".join(part for part in (ieee, row["gjb_2426a"]) if part),
        "unit": unit_words(row["unit"]),
        "tested": row["tested"],
        "before": figure_words(row, "before"),
        "after": figure_words(row, "after"),
        "limit": limit_words(row),
        "kind": outcome[0],
        "outcome": outcome[1],
        "remark": ", ".join(part for part in (row["of"], row["remark"]) if part),
    }


def _about(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    limits, model = values["limits"], values["model"]
    dates = sorted({run["started"][:10] for run in values["runs"] if run["started"]})
    temperatures = [end for run in values["runs"] for end in run["temperature_degC"] if end is not None]
    tested = dates if len(dates) < 3 else [f"{dates[0]} to {dates[-1]}"]
    about = [("Tested", listed(tested, 2) if dates else "date not stated")]
    if temperatures:
        about.append(("Temperatures", f"{number(min(temperatures))} to {number(max(temperatures))} °C"))
    about.append(("Averages", f"{short(values['averaging_s'], 4)} s"))
    about.append(("Model", "none: output as it is" if model is None else str(model["kind"])))
    if limits is not None:
        by = [limits["document"] or limits["file"], limits["customer"]]
        about.append(("Limits", ", ".join(part for part in by if part)))
    return about


def _soaks(values: Mapping[str, Any]) -> Table | None:
    """Bias at each soak temperature."""
    lines = values["soaks"]
    if not lines:
        return None
    whens = ("before", "after") if values["model"] is not None else ("before",)
    several = len({line["run"] for line in lines}) > 1
    parts = [("start", "at the start"), ("up", "on the way up"), ("down", "on the way down")]
    parts = [part for part in parts if any(line["before"][part[0]] is not None for line in lines)]
    parts.append(("hysteresis", "hysteresis"))
    columns = [*columns_of("Run | >Soak [°C]" if several else ">Soak [°C]")]
    columns += [
        (f"{words}, {when}" if len(whens) > 1 else words, "deg/h", "figure")
        for when in whens
        for _, words in parts
    ]
    rows = [
        (
            *((line["run"],) if several else ()),
            f"{line['temperature_degC']:.1f}".replace("-", "−"),
            *(number(line[when][key]) for when in whens for key, _ in parts),
        )
        for line in lines
    ]
    return Table(columns, rows, f"Bias in the soaks of {listed(_names(lines), 3)}.")


def _names(lines: list[Mapping[str, Any]]) -> list[str]:
    return list(dict.fromkeys(str(line["run"]) for line in lines))


def _figure(values: Mapping[str, Any]) -> Markup | None:
    """Bias over soak temperature, up and down, before and after."""
    lines = values["soaks"]
    whens = [("before", style.BEFORE)] + ([("after", style.AFTER)] if values["model"] is not None else [])
    curves: list[Curve] = []
    for when, colour in whens:
        for way, dash in (("up", ""), ("down", "4 2.5")):
            label = f"{when}, way {way}" if len(whens) > 1 else f"way {way}"
            # A line joins soaks of one run: from one to the next the bias moves by more than temperature.
            for run in _names(lines):
                soaks = [one for one in lines if one["run"] == run and one[when][way] is not None]
                if soaks:
                    x, y = np.array(sorted((one["temperature_degC"], one[when][way]) for one in soaks)).T
                    curves.append(Curve(x, y, colour, dash, label=label, dots=True))
                    label = ""
    if not any(len(curve.x) > 1 for curve in curves):
        return None
    return line_figure(curves, "T [°C]", "bias [deg/h]", "Bias at each soak temperature, up and down")


def _runs(values: Mapping[str, Any]) -> Table:
    columns = "Run | Started | >Length [h] | >T from [°C] | >to [°C] | >Outside training"
    rows = [
        (
            run["run"],
            (run["started"] or MISSING)[:16].replace("T", " "),
            number(run["span_h"]),
            *(number(end) for end in run["temperature_degC"]),
            percent(run["outside_training"]) if values["model"] is not None else MISSING,
        )
        for run in values["runs"]
    ]
    return Table(columns, rows)


def files_of(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Name and SHA-256 of everything that the report stands on."""
    files = [(run["run"], run["sha256"]) for run in values["runs"]]
    if values["model"] is not None:
        files.append((f"model {values['model']['kind']}", values["model"]["sha256"]))
    if values["limits"] is not None:
        files.append((values["limits"]["file"], values["limits"]["sha256"]))
    return files


_MOST_COLUMNS = 6
"""Figures of a unit's line: as many as fit a sheet; the spreadsheet has all."""


def batch_page(values: Mapping[str, Any], name: str = "Batch") -> str:
    """The self-contained HTML page of a ``batch.json`` (schema ``fogml.batch/1``)."""
    shown = _in_order(values)
    return render(
        "batch.html",
        title=f"{name} – acceptance of a batch",
        name=name,
        verdict=verdict_sentences(values),
        values=values,
        tiles=_tiles(values),
        distribution=distribution_table(values),
        left_out=len(values["quantities"]) - len(shown),
        units=_units(values["units"], shown),
    )


def _in_order(values: Mapping[str, Any]) -> list[Mapping[str, Any]]:
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
            f"{percent(found['share'])} (90 % interval: {percent(low)} to {percent(high)})."
        )
    sentences = [first]
    for verdict, words in (("incomplete", "incomplete"), ("no_limits", "without limits")):
        if counts[verdict]:
            sentences.append(f"{plural(counts[verdict], 'unit')} {words}: not in the yield.")
    if lacking := values.get("without_report"):
        sentences.append(f"Without a report, and not in the yield: {listed(lacking, 8)}.")
    over = sorted((one for one in values["quantities"] if one["over"]), key=lambda one: -int(one["over"]))
    if over:
        told = [f"{one['name'][:1].lower()}{one['name'][1:]} ({one['over']})" for one in over]
        sentences.append(f"Units that miss a limit: {'; '.join(told)}.")
    return sentences


def _tiles(values: Mapping[str, Any]) -> list[Tile]:
    kinds = {"accepted": "met", "rejected": "missed"}
    return [
        Tile(VERDICTS[name][2], str(count), "", "", kinds.get(name, "") if count else "")
        for name, count in values["counts"].items()
        if count or name in kinds
    ]


def distribution_table(values: Mapping[str, Any]) -> Table:
    """How the units' figures spread, quantity by quantity, against the limits."""
    parts = ("least", "q10", "median", "q90", "largest")
    columns = "Quantity | Unit | >Units tested | >Least | >10 % | >Median | >90 % | >Largest | >Limit | >Over"
    rows = [
        (
            one["name"],
            unit_words(one["unit"]),
            str(one["tested"]),
            *(
                bounded(one["distribution"][p], bool(one["at_most"]), bool(one["at_least"]), one["limit"])
                for p in parts
            ),
            "they differ" if one["limits_differ"] else limit_words(one) or MISSING,
            str(one["over"]),
        )
        for one in values["quantities"]
    ]
    return Table(
        columns, rows, "Sizes of the figures that count: after compensation, where there is a model."
    )


def _units(units: Sequence[Mapping[str, Any]], shown: Sequence[Mapping[str, Any]]) -> Table:
    """A line for each unit, with its page, verdict and figures."""
    heads = tuple((one["name"], unit_words(one["unit"]), "figure") for one in shown)
    rows = []
    for unit in units:
        kind, sign, words = VERDICTS[unit["verdict"]]
        name = " ".join(part for part in (unit["serial_number"], unit["axis"]) if part)
        limits = {one["quantity"]: one["limit"] for one in shown}
        figures = {one["quantity"]: unit["figures"].get(one["quantity"]) for one in shown}
        told = [
            bounded(figure, key in unit["at_most"], key in unit["at_least"], limits[key])
            + (" ✗" if key in unit["missed"] else "")
            for key, figure in figures.items()
        ]
        cells = (name, f"{sign} {words}", *told)
        rows.append(Row(cells, link=unit["page"], badge=kind, keys=(name, words, *figures.values())))
    return Table((*columns_of("Unit | Verdict"), *heads), rows, sortable=True)
