"""The batch of a fleet's acceptance reports, beside its own results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fogml.fleet.tasks import DONE
from fogml.json_files import write_json


def batch_of(units: Sequence[Mapping[str, Any]], home: Path) -> dict[str, Any] | None:
    """The batch of the units whose acceptance report is there, schema ``fogml.batch/1``; None without one.

    Parameters
    ----------
    units
        Of a ``fleet.json``.
    home
        The fleet's folder.

    Raises
    ------
    InputError
        If a unit's report was taken away or changed by hand.
    """
    from fogml.lab.batch import batch_json, read_reports

    done = [unit for unit in units if unit["job"] == "acceptance" and unit["status"] == DONE]
    return batch_json(read_reports([home / unit["folder"] for unit in done]), home) if done else None


def write_batch(batch: Mapping[str, Any], folder: Path, name: str) -> None:
    """Write batch.json, batch.html and batch.xlsx into a folder."""
    from fogml.report.acceptance_page import batch_page
    from fogml.report.spreadsheets import batch_spreadsheet

    write_json(folder / "batch.json", batch)
    (folder / "batch.html").write_text(batch_page(batch, name), encoding="utf-8")
    batch_spreadsheet(batch, folder / "batch.xlsx")
