"""``acceptance.xlsx``, ``batch.xlsx`` and ``fleet.xlsx``: reports as sheets to go on calculating with."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

from fogml.escaping import cell_text
from fogml.lab.batch import BOUNDS
from fogml.report.acceptance_page import VERDICTS, files_of, named
from fogml.report.spreadsheet import whole_workbook

_HEADS = ("quantity", "name", "IEEE Std 952", "clause", "GJB 2426A", "unit", "before", "after")
_MORE = ("limit from", "limit to", "met", "of", "remark")


def acceptance_spreadsheet(values: Mapping[str, Any], path: str | Path) -> None:
    """Write an ``acceptance.json`` (schema ``fogml.acceptance/1``) as a workbook, whole or not at all."""
    with whole_workbook(path) as writer:
        sheet = writer.sheet("Acceptance")
        sheet.write_string(0, 0, cell_text(named(values)), writer.title)
        sheet.write_string(
            1, 0, cell_text(f"{VERDICTS[values['verdict']][2]}: {'; '.join(values['reasons'])}")
        )
        keys = ("quantity", "name", "ieee_952", "clause", "gjb_2426a", "unit", "before", "after")
        rows = []
        for row in values["rows"]:
            limit = row["limit"] or {"from": None, "to": None}
            met = row["met"] if row["tested"] else "not tested"
            open_end = "at most; " if row.get("at_most") else "at least; " if row.get("at_least") else ""
            remark = f"{open_end}{row['remark']}"
            rows.append((*(row[key] for key in keys), limit["from"], limit["to"], met, row["of"], remark))
        writer.table(sheet, (*_HEADS, *_MORE), rows, 3)
        sheet.set_column(0, 4, 24)
        sheet.set_column(5, 12, 14)
        # Without a model there is nothing after it.
        told = list(
            product(
                ("before", "after") if values["model"] else ("before",), ("start", "up", "down", "hysteresis")
            )
        )
        heads = [f"{part} {when} [deg/h]" for when, part in told]
        lines = [
            [line["run"], line["temperature_degC"], *(line[when][part] for when, part in told)]
            for line in values["soaks"]
        ]
        writer.table_sheet("Soaks", ("run", "temperature [degC]", *heads), lines, (18,))
        runs = [
            (run["run"], run["started"], run["span_h"], *run["temperature_degC"], run["sha256"])
            for run in values["runs"]
        ]
        columns = ("run", "started", "length [h]", "T from [degC]", "T to [degC]", "SHA-256")
        writer.table_sheet("Runs", columns, runs, (20,))
        limits = values["limits"] or {}
        stated = [("date of issue", values["date"])]
        stated += [(key, limits.get(key)) for key in ("customer", "document")]
        stated += [(f"SHA-256 of {name}", digest) for name, digest in files_of(values)]
        stated += [("note", note) for note in values["notes"]]
        writer.table_sheet("Stands on", ("what", "value"), stated, (40,))


def batch_spreadsheet(values: Mapping[str, Any], path: str | Path) -> None:
    """Write a ``batch.json`` (schema ``fogml.batch/1``), one line a unit; as `acceptance_spreadsheet`."""
    with whole_workbook(path) as writer:
        heads = {"serial_number": "unit", "axis": "axis", "verdict": "verdict", "why": "reasons"}
        heads |= {one["quantity"]: f"{one['name']} [{one['unit']}]" for one in values["quantities"]}
        bounds = {bound: f"told as {bound.replace('_', ' ')}" for bound in BOUNDS}
        heads |= {bound: head for bound, head in bounds.items() if any(one[bound] for one in values["units"])}
        rows = [
            {**one["figures"], **one, "why": "; ".join(one["reasons"])}
            | {bound: ", ".join(one[bound]) for bound in BOUNDS}
            for one in values["units"]
        ]
        writer.table_sheet("Units", heads, rows, (18,)).freeze_panes(1, 1)
        shares = ("least", "q10", "median", "q90", "largest")
        same = ("unit", "tested", *shares, "limit_from", "limit_to", "over", *BOUNDS)
        told = [{**one, **one["distribution"], **_ends(one)} for one in values["quantities"]]
        names = {"name": "quantity", **{key: key.replace("_", " ") for key in same}}
        names |= {key: f"{key} of sizes" for key in shares}
        writer.table_sheet("Distribution", names, told, (18,))
        if values["notes"]:
            writer.table_sheet("Noticed", ("what",), [(note,) for note in values["notes"]], (120,))


def _ends(quantity: Mapping[str, Any]) -> dict[str, float | str | None]:
    """The ends of a quantity's limit."""
    limit = dict.fromkeys(("from", "to"), "they differ" if quantity["limits_differ"] else None)
    return {f"limit_{end}": told for end, told in (quantity["limit"] or limit).items()}


_UNIT_COLUMNS = {
    **{key: key for key in ("unit", "axis", "job", "status", "model")},
    "run": "worst test run",
    "averaging_s": "averaging [s]",
    "before": "rms before [deg/h]",
    "after": "rms after [deg/h]",
    "floor": "noise floor [deg/h]",
    "outside_training": "outside training [share]",
    "met": "limits met",
    **{key: key for key in ("verdict", "reason", "folder")},
}
_ASKED = ("design_index", "limits", "acceptance_limits")
"""Settings of a fleet that state limits; where none does, none is met."""
_CAUSE_COLUMNS = (
    *("effect", "place", "units_named", "units_told", "prevalence", "shared"),
    *("amplitude", "amplitude_se", "between_units", "unit", "energy_share", "gap_rms_without"),
)


def fleet_spreadsheet(fleet: Mapping[str, Any], path: str | Path) -> None:
    """Write a ``fleet.json`` (schema ``fogml.fleet/1``) as `acceptance_spreadsheet`."""
    with whole_workbook(path) as writer:
        asked = any(fleet["settings"].get(name) for name in _ASKED)
        units = [unit if asked else {**unit, "met": None} for unit in fleet["units"]]
        writer.table_sheet("Units", _UNIT_COLUMNS, units, (16,)).freeze_panes(1, 1)
        if "diagnosis" in fleet:
            heads = {key: key.replace("_", " ") for key in _CAUSE_COLUMNS}
            writer.table_sheet("Causes", heads, fleet["diagnosis"]["causes"])
        if "constants" in fleet:
            found = fleet["constants"]
            told = [
                f"{name}{what} [deg/h{'' if name == '1' else ' per its unit'}]"
                for what in ("", ", standard error")
                for name in found["names"]
            ]
            names = ["unit", *told, "distance"]
            table = zip(found["units"], found["values"], found["se"], found["distance"], strict=True)
            rows = [[unit, *own, *se, far] for unit, own, se, far in table]
            writer.table_sheet("Constants", names, rows, (16,)).freeze_panes(1, 1)
        noticed = [(item["unit"], "needs attention", item["why"]) for item in fleet["again"]]
        noticed += [(item["unit"], "unlike the others", item["why"]) for item in fleet["outliers"]]
        writer.table_sheet("Noticed", ("unit", "what", "why"), noticed, (20, 20, 100))
