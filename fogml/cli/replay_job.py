"""The job of ``fogml replay``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.cli.runs import open_run
from fogml.cli.terminal import Terminal, number
from fogml.cli.twin_commands import ReplaySettings
from fogml.errors import InputError
from fogml.json_files import check_finite
from fogml.runs.columns import REPLAYED
from fogml.runs.run import Run
from fogml.runs.simulated_output import at_times_of, is_simulator_output, read_gnss_ins_sim
from fogml.runs.writing import BlockWriter, carried_cells, header_cells
from fogml.twin.replay import replay
from fogml.twin.replay_after import Storage, replay_after
from fogml.twin.truth import Truth, read_truth
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin, twin_names


def replay_and_write(settings: ReplaySettings, terminal: Terminal) -> None:
    """Replay a run, write it with the column ``replayed``, and print how far the two are apart."""
    if not settings.twin:
        raise InputError("no twin is given; name a file or one of " + ", ".join(twin_names()))
    if not settings.run:
        raise InputError("no run is given; name the run to replay")
    if settings.after and settings.truth:
        raise InputError("--after takes recorded runs, and --truth the truth of one; give one of the two")
    if not settings.out:
        raise InputError("no --out is given; name the file to write, .csv or .parquet")
    out = Path(settings.out)
    for what, given in (("the run itself", settings.run), ("the truth", settings.truth)):
        if given and out.exists() and Path(given).exists() and out.samefile(given):
            raise InputError(f"{out}: is {what}; choose another --out")
    elsewhere = settings.twin not in twin_names() and is_simulator_output(settings.twin)
    if elsewhere and (settings.only or settings.truth or settings.after):
        raise InputError(f"{settings.twin}: a simulator's output takes no --only, --truth or --after")
    twin = None if elsewhere else load_twin(settings.twin)
    with terminal.work(f"reading {settings.run}") as work:
        run = open_run(settings.run, repair=settings.repair)
        truth = read_truth(settings.truth) if settings.truth else None
        work.doing("replaying")
        if twin is None:
            replayed = _given_by(settings.twin, settings.gyro_axis, run)
        else:
            replayed = _replayed(settings, twin, run, truth)
        values = _values(settings, Path(settings.twin).name if twin is None else twin.name, run, replayed)
        check_finite(values, run.name)
        work.doing(f"writing {out.name}")
        with settings.written_beside(out, "replay"):
            _write(run, replayed, out)
    _print(settings, values, terminal)


def _replayed(settings: ReplaySettings, twin: Twin, run: Run, truth: Truth | None) -> FloatArray:
    if not settings.after:
        return replay(twin, run, only=settings.only, truth=truth)
    after = [open_run(path, repair=settings.repair) for path in settings.after]
    storage = Storage(settings.storage_temperature)
    return replay_after(twin, run, after, only=settings.only, storage=storage)


def _given_by(path: str, axis: str | None, run: Run) -> FloatArray:
    """What another simulator gave for a run [deg/h], shape (n,)."""
    if Path(path).is_dir():
        return at_times_of(run, *read_gnss_ins_sim(path, axis), path)
    given = open_run(path, axis=axis)
    return at_times_of(run, given.time, given.gyro_deg_h, path)


def _write(run: Run, replayed: FloatArray, out: Path) -> None:
    recorded = {cell: run.columns[name] for name, cell in header_cells(run).items() if name != REPLAYED}
    with BlockWriter(out, run.facts) as writer:
        writer.write({**recorded, "replayed [deg/h]": replayed}, carried_cells(run))


def _values(settings: ReplaySettings, twin: str, run: Run, replayed: FloatArray) -> dict[str, Any]:
    assert settings.out
    values: dict[str, Any] = {
        "schema": "fogml.replay/1",
        "run": run.name,
        "out": Path(settings.out).name,
        "twin": twin,
        "only": settings.only,
        "rows": len(run),
        "unit": "deg/h",
        "replayed_rms": _rms(replayed),
    }
    if settings.only is None:
        gap = run.gyro_deg_h - replayed if _in_rate(run) else None
        values["gap_mean"] = float(gap.mean()) if gap is not None else None
        values["gap_rms"] = _rms(gap) if gap is not None else None
    return values


def _print(settings: ReplaySettings, values: dict[str, Any], terminal: Terminal) -> None:
    if settings.only is not None:
        terminal.say(f"{settings.only} changes {values['run']} by {number(values['replayed_rms'])} deg/h rms")
    else:
        mean, rms = number(values["gap_mean"]), number(values["gap_rms"])
        terminal.say(
            f"{values['run']} replayed by {values['twin']}: recorded less replayed is {mean} deg/h in the "
            f"mean, {rms} deg/h rms over single samples"
        )
    terminal.say(f"Written to {settings.out}")
    terminal.result(values)


def _in_rate(run: Run) -> bool:
    """Whether the output is known as a rate."""
    return run.gyro_unit == "deg/h" or run.facts.scale_factor is not None


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values * values)))
