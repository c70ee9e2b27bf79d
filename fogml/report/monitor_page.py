"""The pages of ``fogml monitor``: the fleet at one look, and a page per unit."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fogml import __version__
from fogml.fleet.summary import label_of
from fogml.folders import safe_name
from fogml.numerals import against, in_order_of_serial, number, percent, plural, stated
from fogml.report.monitor_words import (
    FIGURE_WORDS,
    alarm_words,
    calibration_words,
    evidence,
    levels,
    outlier_words,
    run_figures,
    shown_figure,
    state_words,
    unit_label,
)
from fogml.report.page import Tile, render
from fogml.report.tables import Table


def unit_file(unit: Mapping[str, Any]) -> str:
    """Name of a unit's page, unlike every other's."""
    label = label_of(unit)
    digest = hashlib.sha256(f"{unit['unit']}\0{unit['axis']}".encode()).hexdigest()[:8]
    return f"{safe_name(label, '-', 80).strip('-.')}-{digest}.html"


def made_here(page: Path) -> bool:
    """Whether a page is there that this version of fogml has made."""
    try:
        with open(page, "rb") as file:
            return f'content="fogml {__version__}"'.encode() in file.read(1000)
    except OSError:
        return False


def monitor_page(monitor: Mapping[str, Any]) -> str:
    """The self-contained HTML page of a ``monitor.json``, schema ``fogml.monitor/1``."""
    units = sorted(monitor["units"], key=lambda unit: in_order_of_serial(label_of(unit)))
    changed = [unit for unit in units if unit["state"] == "alarm"]
    early = [unit for unit in units if unit["state"] == "baseline"]
    every = monitor["runs_between_false_alarms"]
    runs = sum(len(unit["runs"]) for unit in units)
    if changed:
        verdict = [f"{plural(len(changed), 'unit has', 'units have')} changed."]
    elif len(early) == len(units):
        verdict = ["No change can be told yet: all runs are the first ones of their units."]
    else:
        verdict = ["No unit has changed."]
    if 0 < len(early) < len(units):
        verdict.append(
            f"Of {plural(len(early), 'unit')} only the first runs are there, which tell no change."
        )
    verdict.append(
        f"{plural(len(units), 'unit')} with {plural(runs, 'run')}; where runs are alike and "
        f"independent, one in {stated(every)} gives a false alarm, at most."
    )
    verdict.append(
        "A bias that wanders as flicker counts as no change, so that steps of a few deviations are found "
        "late or not at all; --no-wander finds them."
        if monitor["wander"]
        else "The bias is taken not to wander from run to run (--no-wander): one that does raises alarms."
    )
    return render(
        "monitor.html",
        title="Units in service",
        name="Units in service",
        verdict=verdict,
        tiles=[
            Tile("Units", str(len(units))),
            Tile(
                "Changed",
                str(len(changed)),
                "",
                f"{len(early)} can't be told yet" if early else "by all runs so far",
                "missed" if changed else "" if len(early) == len(units) else "met",
            ),
            Tile("Runs", str(runs), "", f"{monitor['runs']['added']} new"),
        ],
        refused=[(each["run"], each["reason"]) for each in monitor.get("refused", ())],
        changed=[(unit_label(unit), alarm_words(unit["alarms"][-1])) for unit in changed],
        levels=levels(units),
        links=[(unit_label(unit), f"units/{unit_file(unit)}", state_words(unit)) for unit in units],
    )


def unit_page(unit: Mapping[str, Any], limit: float) -> str:
    """The self-contained HTML page of one unit of a ``monitor.json``."""
    label = unit_label(unit)
    last = unit["runs"][-1]
    beyond = last["beyond_interval"]
    since = "; of the runs since the change" if unit["alarms"] else ""
    return render(
        "monitor_unit.html",
        title=f"{label} in service",
        name=label,
        verdict=_verdict(unit),
        tiles=[
            Tile("Runs", str(len(unit["runs"]))),
            Tile("Bias left, last run", number(last["level"]), "deg/h"),
            Tile(
                "Evidence of change",
                against(unit["statistic"][-1], limit),
                "",
                f"alarm at {stated(limit)}{since}",
            ),
            Tile("Outside training, last run", percent(last["outside_training"])),
            *(
                []
                if beyond is None
                else [Tile("Averages beyond the interval", percent(beyond), "", "10 % is usual")]
            ),
        ],
        alarms=[alarm_words(alarm) for alarm in unit["alarms"]],
        notes=[*map(outlier_words, unit["outliers"]), *unit["notes"]],
        figures=run_figures(unit),
        evidence=evidence(unit, limit),
        table=_table(unit),
    )


def _verdict(unit: Mapping[str, Any]) -> list[str]:
    if unit["alarms"]:
        figure = FIGURE_WORDS[unit["alarms"][-1]["figure"]]
        return [f"Changed: {figure}.", "Diagnose the runs since then, and calibrate the unit again."]
    if unit["state"] == "baseline":
        return ["Too few runs to tell a change: the first ones show what is usual."]
    told = calibration_words(unit)
    return ["Not changed.", *([told] if told else [])]


def _table(unit: Mapping[str, Any]) -> Table:
    rows = [
        (
            run["run"],
            (run["started"] or "–")[:16].replace("T", " "),
            *(number(shown_figure(run, name)) for name in FIGURE_WORDS),
            percent(run["outside_training"]),
        )
        for run in unit["runs"]
    ]
    columns = (
        "Run | Began | >Bias [deg/h] | >Slope, temperature [deg/h/°C] | "
        ">Slope, rate [deg/h/(°C/min)] | >Scatter [deg/h] | >Scale factor error [ppm] | "
        ">Outside training"
    )
    return Table(columns, rows, "What the model leaves on each run, in the order of time.")
