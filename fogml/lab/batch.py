"""A batch of units from their acceptance reports: yield, distribution of figures, and who fails on what."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from os.path import relpath
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from fogml.errors import InputError, listed
from fogml.intervals import LEVEL
from fogml.json_files import finite_json, json_object, read_json
from fogml.lab.acceptance import ACCEPTED, INCOMPLETE, NO_LIMITS, REJECTED
from fogml.lab.acceptance import SCHEMA as ACCEPTANCE
from fogml.lab.acceptance_rows import QUANTITIES
from fogml.numerals import in_order_of_serial

SCHEMA = "fogml.batch/1"
REPORT = "acceptance.json"
_SHARES = {"least": 0.0, "q10": 0.1, "median": 0.5, "q90": 0.9, "largest": 1.0}
BOUNDS = ("at_most", "at_least")
"""Keys of a row whose figure is a bound alone."""
_ROW = ("quantity", "tested", "limit", "met")
_ORDER = {REJECTED: 0, INCOMPLETE: 1, NO_LIMITS: 2, ACCEPTED: 3}


def read_reports(paths: Sequence[str | Path]) -> list[tuple[Path, dict[str, Any]]]:
    """Acceptance reports by their files; a folder stands for those that `report_files` finds in it.

    Raises
    ------
    InputError
        If one is missing or none, or two are of the same unit and axis.
    """
    found: list[tuple[Path, dict[str, Any]]] = []
    of: dict[tuple[Any, Any], Path] = {}
    for file in report_files(paths)[0]:
        values = read_json(file, "name acceptance reports (acceptance.json) or their folders")
        held = json_object(values, str(file), ACCEPTANCE, "'fogml lab acceptance' writes one")
        _check_whole(held, file)
        who = held.get("serial_number"), held.get("axis")
        if who in of:
            told = " ".join(str(part) for part in who if part) or "no unit by name"
            raise InputError(f"{file} and {of[who]} are both of {told}; give one report a gyro")
        of[who] = file
        found.append((file, dict(held)))
    return found


def report_files(paths: Sequence[str | Path]) -> tuple[list[Path], list[str]]:
    """Files of reports, and names of folders without one.

    A folder stands for the report in it, or for those in its own folders, as of three axes or a fleet.

    Raises
    ------
    InputError
        If no folder holds a report and no file is named.
    """
    files: list[Path] = []
    lacking: list[str] = []
    for path in map(Path, paths):
        inner = [path / REPORT] if (path / REPORT).is_file() else sorted(path.glob(f"*/{REPORT}"))
        files += inner if path.is_dir() else [path]
        if path.is_dir() and not inner:
            lacking.append(path.resolve().name)
    if not files:
        raise InputError(f"{paths[0]}: holds no {REPORT}; name acceptance reports or their folders")
    return files, lacking


def _check_whole(report: Mapping[str, Any], file: Path) -> None:
    """Hold that a report has what a batch reads of it."""
    rows, verdict = report.get("rows"), report.get("verdict")
    told = [isinstance(report.get(key, 0), str | None) for key in ("serial_number", "axis", "date")]
    whole = all(told) and isinstance(report.get("reasons"), list) and isinstance(verdict, str)
    whole = whole and _tells_how(report)
    if not (whole and verdict in _ORDER and isinstance(rows, list) and all(map(_is_row, rows))):
        raise InputError(f"{file}: parts of an acceptance report lack; 'fogml lab acceptance' writes it anew")


def _tells_how(report: Mapping[str, Any]) -> bool:
    """Whether a report tells its averages, limits, and hashes of its runs."""
    runs, limits = report.get("runs"), report.get("limits", "")
    hashed = isinstance(runs, list) and all(
        isinstance(run, dict) and {"run", "sha256"} <= set(run) for run in runs
    )
    limited = limits is None or (isinstance(limits, dict) and {"file", "sha256", "document"} <= set(limits))
    return hashed and limited and isinstance(report.get("averaging_s"), int | float)


def _is_row(row: Any) -> bool:
    figures = [row.get(key, "") for key in ("before", "after")] if isinstance(row, dict) else [""]
    return all(isinstance(one, int | float | None) for one in figures) and {*_ROW} <= set(row)


def batch_json(
    reports: Sequence[tuple[Path, Mapping[str, Any]]], home: Path | None = None, lacking: Sequence[str] = ()
) -> dict[str, Any]:
    """The batch of some acceptance reports.

    Parameters
    ----------
    reports
        As `read_reports` gives them.
    home
        Folder of the batch's page, from which the units' pages are linked; absolute links if None.
    lacking
        Names of units that should have a report and have none.

    Returns
    -------
    dict
        Schema ``fogml.batch/1``: ``counts`` of verdicts, ``yield`` with its 90 % interval, ``quantities``
        with distribution of sizes, limit, how many are over it and of how many the figure is an upper or
        lower bound alone (``at_most``, ``at_least``), ``units`` with those rejected first,
        ``without_report`` units that have none, ``notes`` on runs that stand in several reports and on what
        reports are not alike in, ``synthetic`` where any run is.
    """
    units = [_unit(file, report, home) for file, report in reports]
    units.sort(key=_place)
    counts = Counter(one["verdict"] for one in units)
    judged = counts[ACCEPTED] + counts[REJECTED]
    low, high = _interval(counts[ACCEPTED], judged) if judged else (None, None)
    values = {
        "schema": SCHEMA,
        "counts": {name: counts[name] for name in _ORDER},
        "yield": {
            "share": counts[ACCEPTED] / judged if judged else None,
            "ci90": [low, high],
            "judged": judged,
        },
        "quantities": _quantities([report for _, report in reports]),
        "units": units,
        "without_report": list(lacking),
        "notes": [*_runs_twice(reports), *_not_alike(reports)],
        "synthetic": any(bool(report.get("synthetic")) for _, report in reports),
    }
    return finite_json(values)


def _label(report: Mapping[str, Any]) -> str:
    return " ".join(str(part) for part in (report["serial_number"], report["axis"]) if part) or "not stated"


def _runs_twice(reports: Sequence[tuple[Path, Mapping[str, Any]]]) -> list[str]:
    """Runs that stand in reports of several gyros, which no recording of one does."""
    of: dict[str, dict[str, str]] = defaultdict(dict)
    for _, report in reports:
        for run in report["runs"]:
            of[run["sha256"]][_label(report)] = str(run["run"])
    shared: dict[tuple[str, ...], set[str]] = defaultdict(set)
    for names in of.values():
        if len(names) > 1:
            shared[tuple(names)] |= set(names.values())
    return [
        f"{listed(gyros, 8)}: the same recordings stand in the report of each ({listed(sorted(runs), 3)}): "
        "one of them at most was tested on its own"
        for gyros, runs in shared.items()
    ]


def _not_alike(reports: Sequence[tuple[Path, Mapping[str, Any]]]) -> list[str]:
    """What keeps figures of several reports from being compared: ways in which they were made."""
    notes = []
    for what, way in _WAYS.items():
        by_way: dict[str, list[str]] = defaultdict(list)
        for _, report in reports:
            by_way[way(report)].append(_label(report))
        (most, _), *others = sorted(by_way.items(), key=lambda one: -len(one[1])) or [("", [])]
        if others:
            told = "; ".join(f"{name} for {listed(gyros, 8)}" for name, gyros in others)
            notes.append(
                f"{what} not the same for all units: {most}, but {told}; their figures stand side by side"
            )
    return notes


def _limits_named(report: Mapping[str, Any]) -> str:
    limits = report["limits"]
    return (
        "none" if limits is None else f"{limits['document'] or limits['file']} ({str(limits['sha256'])[:8]})"
    )


def _earth(report: Mapping[str, Any]) -> str:
    known = any(run.get("bias_reference") == "earth rate" for run in report["runs"])
    return "taken off the bias" if known else "left in the bias"


_WAYS: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "Averages are": lambda report: f"{report['averaging_s']:g} s",
    "Compensation is": lambda report: "none" if report.get("model") is None else "by a model",
    "Limits are": _limits_named,
    "Earth rate is": _earth,
}


def _interval(part: int, whole: int) -> tuple[float, float]:
    """The exact 90 % interval of a share (Clopper and Pearson, Biometrika 26, 1934)."""
    from scipy.stats import binomtest

    found = binomtest(part, whole).proportion_ci(LEVEL, method="exact")
    return float(found.low), float(found.high)


def _place(unit: Mapping[str, Any]) -> tuple[int, Any]:
    """Sort key: rejected units first, then by serial number and axis."""
    return _ORDER[unit["verdict"]], in_order_of_serial(f"{unit['serial_number']} {unit['axis']}")


def figure_of(row: Mapping[str, Any]) -> float | None:
    """The figure that counts: after compensation where there is a model, else as it is."""
    value = row["after"] if row["after"] is not None else row["before"]
    return None if value is None else float(value)


def _unit(file: Path, report: Mapping[str, Any], home: Path | None) -> dict[str, Any]:
    page = file.with_suffix(".html").absolute()
    link = page.as_uri() if home is None else quote(Path(relpath(page, home.absolute())).as_posix())
    return {
        "serial_number": report["serial_number"] or "not stated",
        "axis": report["axis"] or "",
        "verdict": report["verdict"],
        "reasons": report["reasons"],
        "date": report["date"],
        "page": link,
        "figures": {row["quantity"]: figure_of(row) for row in report["rows"] if row["tested"]},
        "missed": [row["quantity"] for row in report["rows"] if row["met"] is False],
        **{bound: [row["quantity"] for row in report["rows"] if row.get(bound)] for bound in BOUNDS},
    }


def _quantities(reports: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Of each quantity that any unit was tested for: the sizes of its figures, and the limit."""
    told = []
    for quantity in QUANTITIES:
        rows = [row for report in reports for row in report["rows"] if row["quantity"] == quantity.key]
        held = [figure for row in rows if (figure := figure_of(row)) is not None]
        if not held:
            continue
        limits = [row["limit"] for row in rows]
        quantiles = np.quantile(np.abs(held), list(_SHARES.values()))
        told.append(
            {
                "quantity": quantity.key,
                "name": quantity.name,
                "unit": quantity.unit,
                "tested": len(held),
                "distribution": dict(zip(_SHARES, map(float, quantiles), strict=True)),
                "limit": limits[0] if all(limit == limits[0] for limit in limits) else None,
                "limits_differ": any(limit != limits[0] for limit in limits),
                "over": sum(row["met"] is False for row in rows),
                **{bound: sum(bool(row.get(bound)) for row in rows) for bound in BOUNDS},
            }
        )
    return told
