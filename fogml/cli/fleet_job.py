"""The job of ``fogml fleet``, with the batch of its acceptance reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fogml.cli.fleet_unit import UnitWork
from fogml.cli.run_commands import FleetSettings
from fogml.cli.terminal import UNITS_SHOWN, Terminal, Work
from fogml.errors import InputError
from fogml.fleet.engines import run_tasks
from fogml.fleet.manifest import Unit, read_manifest
from fogml.fleet.tasks import DONE, FLEET, Task, full_disk
from fogml.folders import refuse_file
from fogml.json_files import finite_json, read_json, write_json
from fogml.locks import sole_writer
from fogml.outputs import whole_folder
from fogml.runs.sources import run_sources, sources_stamp
from fogml.tracking import Tracker


def batch_of(units: Sequence[Mapping[str, Any]], home: Path) -> dict[str, Any] | None:
    """The batch of the units whose acceptance report is there, schema ``fogml.batch/1``; None without one.

    Raises
    ------
    InputError
        If a unit's report was taken away or changed by hand.
    """
    from fogml.fleet.summary import label_of
    from fogml.lab.batch import batch_json, read_reports

    asked = [unit for unit in units if unit["job"] == "acceptance"]
    done = [unit for unit in asked if unit["status"] == DONE]
    if not done:
        return None
    lacking = [label_of(unit) for unit in asked if unit["status"] != DONE]
    return batch_json(read_reports([home / unit["folder"] for unit in done]), home, lacking)


def write_batch(batch: Mapping[str, Any], folder: Path, name: str) -> None:
    """Write batch.json, batch.html and batch.xlsx into a folder."""
    from fogml.report.acceptance_page import batch_page
    from fogml.report.spreadsheets import batch_spreadsheet

    write_json(folder / "batch.json", batch)
    (folder / "batch.html").write_text(batch_page(batch, name), encoding="utf-8")
    batch_spreadsheet(batch, folder / "batch.xlsx")


def fleet_and_write(settings: FleetSettings, terminal: Terminal) -> bool:
    """Do every unit's job, write the fleet's results, print them; whether all are done and meet limits."""
    assert settings.manifest
    units = read_manifest(settings.manifest)
    _check(settings, units)
    tasks = _tasks(settings, units)
    home = Path(settings.out)
    refuse_file(home)
    with sole_writer(home), terminal.work("fleet", total=len(tasks)) as work:
        outcomes = _run(settings, tasks, work, terminal)
    from fogml.fleet.summary import fleet_json
    from fogml.report.fleet_page import fleet_page
    from fogml.report.spreadsheets import fleet_spreadsheet

    values = finite_json(fleet_json(outcomes, {**settings.for_units(), "prior": settings.prior}))
    batch = batch_of(values["units"], home)
    name = Path(settings.manifest).name
    page = fleet_page(values, name, None if batch is None else "batch.html")
    try:
        with whole_folder(settings.out, shared=True) as folder:
            write_json(folder / FLEET, values, indent=1)
            (folder / "fleet.html").write_text(page, encoding="utf-8")
            fleet_spreadsheet(values, folder / "fleet.xlsx")
            if batch is not None:
                write_batch(batch, folder, Path(settings.manifest).stem)
            settings.write_into(folder, "fleet")
    except OSError as error:
        raise full_disk(settings.out, error) from error
    _print(values, terminal)
    if batch is not None:
        _print_batch(batch, terminal)
    terminal.result(values)
    pages = [str(home / page) for page in ("fleet.html", "batch.html")[: 1 if batch is None else 2]]
    terminal.say(f"Written to {settings.out}: open {' and '.join(pages)}")
    return all(unit["status"] == DONE and unit["met"] is not False for unit in values["units"])


def _tasks(settings: FleetSettings, units: Sequence[Unit]) -> list[Task]:
    shared = None if settings.prior is None else _shared(settings.prior)
    # Workers elsewhere find files by whole paths; results depend on what files hold, not on where they lie.
    work = UnitWork(settings.in_full().for_units(), settings.form, shared)
    own = settings.for_units()
    files = {key: own[key] for key in settings.path_keys if own.get(key) and Path(own[key]).is_file()}
    stamps = {f"{key} file": sources_stamp(run_sources(file)) for key, file in files.items()}
    told = {**own, **dict.fromkeys(files), "shared": shared, **stamps}
    # Units that are done are known by their settings: workers write into one folder, wherever they run.
    return [Task(unit, work, str(Path(settings.out).absolute()), told) for unit in units]


def _check(settings: FleetSettings, units: Sequence[Unit]) -> None:
    """Check what can be checked before a run is read."""
    from fogml.features.parse import parse_features
    from fogml.models.names import make_model

    parse_features(settings.form)
    if settings.acceptance_limits is not None:
        from fogml.lab.acceptance_rows import read_limits

        read_limits(settings.acceptance_limits)
    if settings.prior is not None:
        _check_prior(settings, units)
    if settings.device is not None:
        _check_device(settings)
    make_model(settings.model, settings.features, settings.seed, settings.for_units()["parameters"])


def _check_prior(settings: FleetSettings, units: Sequence[Unit]) -> None:
    """Hold that there are models to be drawn to the fleet's, and that nothing else says what they are."""
    if not any(unit.job == "train" or (unit.job == "acceptance" and unit.train) for unit in units):
        raise InputError("--prior: is for the job 'train', which no unit of the manifest has; leave it out")
    others = {
        "--model": settings.model != "auto",
        "--features": settings.features is not None,
        "--set": bool(settings.parameters),
        "--device": settings.device is not None,
    }
    for name, given in others.items():
        if given:
            raise InputError(f"{name}: with --prior the earlier fleet makes the model; leave one of them out")


def _shared(path: str) -> dict[str, Any]:
    values = read_json(Path(path), f"--prior takes a {FLEET}")
    if not isinstance(values, dict) or "shared" not in values:
        raise InputError(f"--prior {path}: tells no shared constants; a {FLEET} of three units or more does")
    from fogml.fleet.shared import shared_model

    shared_model(values["shared"])
    return dict(values["shared"])


def _check_device(settings: FleetSettings) -> None:
    import torch

    if settings.model != "rbf":
        raise InputError(f"--device is for RBF networks; '{settings.model}' is none: --model rbf")
    try:
        torch.zeros(1, device=settings.device)
    except (RuntimeError, AssertionError) as error:
        reason = str(error).split("\n")[0]
        raise InputError(f"--device {settings.device}: is not there ({reason}); cpu always is") from None


def _run(
    settings: FleetSettings, tasks: Sequence[Task], work: Work, terminal: Terminal
) -> list[dict[str, Any]]:
    tracker = None if settings.track is None else Tracker(settings.track, "fogml fleet", terminal.note)

    def told(outcome: dict[str, Any]) -> None:
        if tracker is not None and outcome["status"] == DONE:
            _track(tracker, outcome)
        label = f"{outcome['unit']} {outcome['axis']}".strip()
        work.advance(1.0, f"{label} {outcome['status']}")
        if outcome["status"] != DONE:
            terminal.note(f"{label}: {outcome['reason']}")

    return run_tasks(tasks, workers=settings.workers, cluster=settings.cluster, progress=told)


def _track(tracker: Tracker, outcome: dict[str, Any]) -> None:
    """Tell a tracker of a unit that is done."""
    from fogml.fleet.summary import label_of

    found = outcome["found"]
    worst = found.get("worst") or {}
    tracker.log(
        outcome["fingerprint"],
        label_of(outcome),
        {key: outcome[key] for key in ("unit", "axis", "job")} | {"model": found.get("model", "")},
        {name: worst.get(name) for name in ("before", "after", "floor", "outside_training")},
        {
            "verdict": str(found.get("verdict", "")),
            "met": str(found.get("met", "")),
            "folder": outcome["folder"],
        },
    )


def _print(values: dict[str, Any], terminal: Terminal) -> None:
    from fogml.report.fleet_page import units_table

    times = {unit["averaging_s"] for unit in values["units"] if unit["averaging_s"]}
    over = f", {times.pop():g} s averages" if len(times) == 1 else ""
    terminal.show(units_table(values["units"]), f"Worst test run of each unit{over}", UNITS_SHOWN)
    for key, what in (("outliers", "Unlike the others"), ("again", "Needs attention")):
        for item in values[key][:UNITS_SHOWN]:
            terminal.say(f"{what}: {item['unit']}: {item['why']}")
    most = max(len(values[key]) for key in ("units", "outliers", "again"))
    if most > UNITS_SHOWN:
        terminal.say(f"The first {UNITS_SHOWN} of each are shown; fleet.html and fleet.xlsx hold all.")


def _print_batch(batch: Mapping[str, Any], terminal: Terminal) -> None:
    from fogml.report.acceptance_page import verdict_sentences

    for sentence in (*verdict_sentences(batch), *batch["notes"]):
        terminal.say(sentence)
