"""The job of ``fogml monitor``: units in service."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import Any

from fogml.cli.run_commands import MonitorSettings
from fogml.cli.runs import check_named_once, note_wrong, open_model, open_run
from fogml.cli.terminal import UNITS_SHOWN, Terminal
from fogml.errors import InputError, counted, in_one_line
from fogml.fleet.tasks import FAILED, FLEET
from fogml.folders import link_or_copy, refuse_file
from fogml.json_files import finite_json, read_json, write_json
from fogml.models.base import DriftModel
from fogml.monitor.evidence import ChangePrior
from fogml.monitor.monitor_json import monitor_json
from fogml.monitor.record import RunRecord, record_run
from fogml.monitor.store import open_store
from fogml.monitor.watch import watch
from fogml.numerals import against, in_order_of_serial, number, stated
from fogml.outputs import whole_folder
from fogml.runs.run import Run


def monitor_and_write(settings: MonitorSettings, terminal: Terminal) -> bool:
    """Keep new runs, judge every unit's, write and print it; whether all were used and no unit changed."""
    assert settings.model
    home = Path(settings.out)
    refuse_file(home)
    records, refused = _records(settings, terminal)
    place = settings.store or str(home / "store")
    with closing(open_store(place, settings.patience)) as store, terminal.work("keeping runs"):
        added = store.add(records) if records else 0
        held = store.records()
    if not held:
        raise InputError("no run is given, and the store holds none; name the runs to monitor")
    units = watch(
        held,
        runs_between_false_alarms=settings.false_alarm_every,
        bias_limit=settings.bias_limit,
        prior=ChangePrior() if settings.wander else ChangePrior().steady(),
    )
    every, repeated = settings.false_alarm_every, len(records) - added
    told = monitor_json(
        units,
        runs_between_false_alarms=every,
        wander=settings.wander,
        added=added,
        repeated=repeated,
        refused=refused,
    )
    values = finite_json(told)
    from fogml.report.monitor_page import monitor_page

    with terminal.work("drawing"), whole_folder(home, shared=True) as folder:
        write_json(folder / "monitor.json", values, indent=1)
        (folder / "monitor.html").write_text(monitor_page(values), encoding="utf-8")
        _write_units(values, home, folder / "units")
        settings.write_into(folder, "monitor")
    _print_monitor(values, terminal)
    terminal.result(values)
    terminal.say(f"Written to {settings.out}: open {home / 'monitor.html'}")
    return not refused and all(unit["state"] != "alarm" for unit in values["units"])


def _write_units(values: Mapping[str, Any], home: Path, folder: Path) -> None:
    """Write the units' pages; those of units of which nothing is new are the ones that are there.

    Of hundreds of units in service a command tells something new of a few.
    """
    from fogml.report.monitor_page import made_here, unit_file, unit_page

    known: dict[str, Any] = {}
    limit = values["runs_between_false_alarms"]
    try:
        before = read_json(home / "monitor.json", "run the command again")
        if before["runs_between_false_alarms"] == limit:
            known = {unit_file(unit): unit for unit in before["units"]}
    except (InputError, LookupError, TypeError, AttributeError):
        pass  # nothing that this command wrote
    folder.mkdir()
    for unit in values["units"]:
        name = unit_file(unit)
        there = home / "units" / name
        if known.get(name) == unit and made_here(there):
            link_or_copy(there, folder / name)
        else:
            (folder / name).write_text(unit_page(unit, limit), encoding="utf-8")


def _records(settings: MonitorSettings, terminal: Terminal) -> tuple[list[RunRecord], dict[str, str]]:
    """What is kept of each run, and why others can't be used; an error where none can."""
    assert settings.model
    check_named_once(settings.runs)
    model_of = _models(Path(settings.model), terminal)
    records, refused = [], dict[str, str]()
    with terminal.work("monitoring", total=len(settings.runs)) as work:
        for path in settings.runs:
            work.doing(f"monitoring {path}")
            try:
                records.append(_record(path, model_of, settings, terminal))
            except InputError as error:
                refused[str(path)] = str(error)
            work.advance()
    if len(refused) == 1 and not records:
        raise InputError(*refused.values())
    for reason in refused.values():
        terminal.note(f"not used: {reason}")
    if refused and not records:
        first = in_one_line(next(iter(refused.values())))
        raise InputError(f"none of {len(refused)} runs can be used; the first: {first}")
    return records, refused


def _record(
    path: str, model_of: Callable[[Run], DriftModel], settings: MonitorSettings, terminal: Terminal
) -> RunRecord:
    run = open_run(path, repair=settings.repair)
    note_wrong(run.name, run.findings, terminal)
    model, any_unit = model_of(run), settings.any_unit
    for told in model.check_applies(run, any_unit) if any_unit else ():
        terminal.note(told)
    return record_run(model, run, averaging_s=settings.averaging, any_unit=any_unit)


def _models(place: Path, terminal: Terminal) -> Callable[[Run], DriftModel]:
    """What gives a run's model: one for all, or of a fleet's results that of its unit and axis."""
    if not (place / FLEET).is_file():
        model = open_model(place, terminal)
        return lambda run: model
    fleet: dict[str, Any] = read_json(place / FLEET, "name the folder of a fleet's results")
    try:
        # Beside the job that trains a unit's model there may be others, which keep none; where it failed, the
        # folder may hold the model of an earlier one.
        folders = {
            (unit["unit"], unit["axis"]): folder
            for unit in fleet["units"]
            if unit.get("status") != FAILED and (folder := place / str(unit["folder"]) / "model").is_dir()
        }
    except (KeyError, TypeError, AttributeError):
        raise InputError(f"{place / FLEET}: lists no units; run the fleet again") from None
    load = cache(lambda folder: open_model(folder, terminal))

    def of_run(run: Run) -> DriftModel:
        unit, axis = run.facts.unit or "", run.facts.axis or ""
        folder = folders.get((unit, axis))
        if folder is None:
            raise InputError(
                f"{run.name}: of unit '{unit}', axis '{axis}', of which {place} holds no model; state 'unit' "
                "and 'axis' in its side file as the fleet's manifest does, of a job 'train' that is done"
            )
        return load(folder)

    return of_run


def _print_monitor(values: dict[str, Any], terminal: Terminal) -> None:
    from fogml.report.monitor_words import (
        alarm_words,
        calibration_words,
        outlier_words,
        state_words,
        unit_label,
    )

    # Those that changed come first: of many units not all are shown.
    units = sorted(
        values["units"],
        key=lambda unit: (unit["state"] != "alarm", in_order_of_serial(unit_label(unit))),
    )
    shown = units[:UNITS_SHOWN]
    limit = values["runs_between_false_alarms"]
    rows = []
    for unit in shown:
        last = unit["runs"][-1]
        rows.append(
            [
                unit_label(unit),
                str(len(unit["runs"])),
                number(last["level"]),
                against(unit["statistic"][-1], limit),
                state_words(unit),
            ]
        )
    terminal.table(
        f"Units in service; alarm at {stated(limit)}",
        ["unit", "runs", "last bias [deg/h]", "evidence", "state"],
        rows,
    )
    for unit in shown:
        label = unit_label(unit)
        calibration = "" if unit["alarms"] else calibration_words(unit)
        outliers = map(outlier_words, unit["outliers"])
        for text in (*map(alarm_words, unit["alarms"]), calibration, *outliers, *unit["notes"]):
            if text:
                terminal.say(f"{label}: {text}")
    if len(units) > len(shown):
        terminal.say(
            f"{len(shown)} of {len(units)} units are shown, those that changed first; monitor.html holds all."
        )
    told = values["runs"]
    terminal.say(f"{counted(told['added'], 'new run')} kept, {told['repeated']} there before")
