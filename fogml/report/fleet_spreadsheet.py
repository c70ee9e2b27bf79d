"""``fleet.xlsx``: a fleet's units, constants and what was noticed, as sheets to go on calculating with."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fogml.report.spreadsheet import whole_workbook

_UNIT_COLUMNS = (
    ("unit", "unit"),
    ("axis", "axis"),
    ("job", "job"),
    ("status", "status"),
    ("model", "model"),
    ("run", "worst test run"),
    ("averaging_s", "averaging [s]"),
    ("before", "rms before [deg/h]"),
    ("after", "rms after [deg/h]"),
    ("floor", "noise floor [deg/h]"),
    ("outside_training", "outside training"),
    ("met", "limits met"),
    ("verdict", "verdict"),
    ("reason", "reason"),
    ("folder", "folder"),
)


_CAUSE_COLUMNS = (
    *("effect", "place", "units_named", "units_told", "prevalence", "shared"),
    *("amplitude", "amplitude_se", "between_units", "unit", "energy_share", "gap_rms_without"),
)


def fleet_spreadsheet(fleet: Mapping[str, Any], path: str | Path) -> None:
    """Write a ``fleet.json`` as an Excel workbook that appears whole or not at all.

    Parameters
    ----------
    fleet
        Schema ``fogml.fleet/1``.
    path
        The file, ending in ``.xlsx``.

    Raises
    ------
    InputError
        If the folder is missing or can't be written.
    """
    with whole_workbook(path) as writer:
        sheet = writer.sheet("Units")
        rows = [[unit[key] for key, _ in _UNIT_COLUMNS] for unit in fleet["units"]]
        writer.table(sheet, [head for _, head in _UNIT_COLUMNS], rows)
        sheet.set_column(0, len(_UNIT_COLUMNS) - 1, 16)
        sheet.freeze_panes(1, 1)
        if "diagnosis" in fleet:
            sheet = writer.sheet("Causes")
            rows = [[one[key] for key in _CAUSE_COLUMNS] for one in fleet["diagnosis"]["causes"]]
            writer.table(sheet, [key.replace("_", " ") for key in _CAUSE_COLUMNS], rows)
        if "constants" in fleet:
            found = fleet["constants"]
            sheet = writer.sheet("Constants")
            heads = [
                "unit",
                *found["names"],
                *(f"{name}, standard error" for name in found["names"]),
                "distance",
            ]
            table = zip(found["units"], found["values"], found["se"], found["distance"], strict=True)
            writer.table(sheet, heads, [[unit, *own, *se, far] for unit, own, se, far in table])
            sheet.set_column(0, len(heads) - 1, 16)
            sheet.freeze_panes(1, 1)
        sheet = writer.sheet("Noticed")
        noticed = [(item["unit"], "needs another run", item["why"]) for item in fleet["again"]]
        noticed += [(item["unit"], "unlike the others", item["why"]) for item in fleet["outliers"]]
        writer.table(sheet, ("unit", "what", "why"), noticed)
        sheet.set_column(0, 1, 20)
        sheet.set_column(2, 2, 100)
