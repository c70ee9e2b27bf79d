"""The jobs of ``fogml simulate`` and ``fogml replay``."""

from __future__ import annotations

import os
from collections import Counter
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.cli.runs import note_findings, open_run
from fogml.cli.terminal import Terminal
from fogml.cli.twin_commands import ReplaySettings, SimulateSettings
from fogml.errors import InputError
from fogml.json_files import check_finite
from fogml.numerals import duration, number, plural
from fogml.outputs import check_room
from fogml.runs.columns import REPLAYED
from fogml.runs.facts import facts_from
from fogml.runs.other_rate import at_times_of, is_simulator_output, read_gnss_ins_sim
from fogml.runs.run import Run
from fogml.runs.writing import IN_BLOCKS, BlockWriter, carried_cells, checked_suffix, header_cells
from fogml.twin.draws import drawn_twin
from fogml.twin.programme import load_programme
from fogml.twin.replay import replay
from fogml.twin.replay_after import Storage, replay_after
from fogml.twin.simulate import default_facts, world_of, write_world
from fogml.twin.truth import Truth, read_truth
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin, twin_dict, twin_names
from fogml.twin.world import World

DRAW_APART = 1000
"""Seeds of drawn units are so far apart: a file of several runs takes one for each."""


def simulate_and_write(settings: SimulateSettings, terminal: Terminal) -> None:
    """Simulate block by block into a file, and print what was written."""
    if settings.draws:
        _simulate_draws(settings, terminal)
        return
    if settings.runs:
        _simulate_runs(settings, terminal)
        return
    if settings.programme is None:
        raise InputError("no programme is given; state 'programme' in the file, or --programme")
    if not settings.out:
        raise InputError("no --out is given; name the run to write, .csv or .parquet")
    out = Path(settings.out)
    if settings.truth is not None and os.path.abspath(settings.truth) == os.path.abspath(out):
        raise InputError(f"{out}: is the run and the truth; choose another --truth")
    programme, twin = load_programme(settings.programme), load_twin(settings.twin)
    facts = default_facts(programme) if settings.facts is None else facts_from(settings.facts, "facts")
    with settings.written_beside(out, "simulate"):
        world = world_of(
            programme,
            twin,
            settings.sample_s,
            settings.seed,
            settings.columns,
            facts,
            truth=settings.truth is not None,
        )
        rows = _simulate_into(out, world, settings.truth, terminal)
    _print_simulation(settings, world, rows, terminal)


def _simulate_into(out: Path, world: World, truth: str | None, terminal: Terminal) -> int:
    samples = len(world.timeline)
    # A cell of a text is a digit and a mark at least, and no format holds a sample in less than a byte.
    least_bytes = 2 * (len(world.columns) + 2) if out.suffix.lower() == ".csv" else 1
    check_room(out, float(samples) * least_bytes, f"{samples:.3g} samples", "state a longer --sample")
    with terminal.work(f"simulating {world.timeline.programme.name}", total=samples) as work:
        return write_world(world, out, truth, work.advance)


def _simulate_draws(settings: SimulateSettings, terminal: Terminal) -> None:
    """Simulate units drawn from the twin's uncertainty, each into files of its own number."""
    if not settings.out and not settings.runs:
        raise InputError("no --out is given; name the run to write, .csv or .parquet")
    twin, width = load_twin(settings.twin), len(str(settings.draws))
    several = Collected(terminal)
    for unit in range(1, settings.draws + 1):

        def numbered(path: str | None, tag: str = f"{unit:0{width}d}") -> str | None:
            return path and str(Path(path).with_name(f"{Path(path).stem}-{tag}{Path(path).suffix}"))

        runs = [
            run.model_copy(update={"out": numbered(run.out), "truth": numbered(run.truth)})
            for run in settings.runs
        ]
        drawn = {"twin": twin_dict(drawn_twin(twin, settings.seed, unit)), "draws": 0, "runs": runs}
        files = {"out": numbered(settings.out), "truth": numbered(settings.truth)}
        own_seed = {"seed": settings.seed + unit * DRAW_APART}
        simulate_and_write(settings.model_copy(update={**drawn, **files, **own_seed}), several)
    values = {"schema": "fogml.simulation/1", "twin": twin.name, "draws": several.values}
    terminal.result(values)


class Collected(Terminal):
    """Prints as another does, and keeps results to be told together.

    Attributes
    ----------
    values
        Results so far.
    """

    def __init__(self, terminal: Terminal) -> None:
        super().__init__(terminal.as_json, terminal.quiet)
        self.values: list[object] = []

    def result(self, values: object) -> None:
        """Kept."""
        self.values.append(values)


def _simulate_runs(settings: SimulateSettings, terminal: Terminal) -> None:
    """Simulate a unit's runs one after the other; what it remembers goes on from each to the next."""
    for key in ("programme", "out", "truth"):
        if getattr(settings, key) is not None:
            raise InputError(f"'{key}' is stated for the file and there are 'runs'; state it in each of them")
    twin, before = load_twin(settings.twin), None
    outs = [Path(run.out) for run in settings.runs]
    written = Counter(os.path.abspath(path) for run in settings.runs for path in (run.out, run.truth) if path)
    if twice := [path for path, times in written.items() if times > 1]:
        raise InputError(f"runs: two are written to {twice[0]}; give each 'out' and 'truth' its own name")
    kept = settings.storage
    storage = Storage(kept.temperature, kept.humidity, kept.power == "on")
    results = []
    with ExitStack() as stack:
        stack.enter_context(settings.written_beside(outs[0], "simulate"))
        for number, (run, out) in enumerate(zip(settings.runs, outs)):
            stated = run.facts if run.facts is not None else settings.facts
            programme = load_programme(run.programme)
            facts = default_facts(programme) if stated is None else facts_from(stated, "facts")
            before = world_of(
                programme,
                twin,
                settings.sample_s if run.sample_s is None else run.sample_s,
                settings.seed + number,
                settings.columns if run.columns is None else run.columns,
                facts.model_copy(update={"started": run.started}),
                truth=run.truth is not None,
                before=before,
                storage=storage,
            )
            rows = _simulate_into(out, before, run.truth, terminal)
            terminal.say(f"{rows} samples of {programme.name}, started {run.started}, written to {out}")
            _say_silent(before, terminal)
            results.append(
                {
                    "run": out.name,
                    "rows": rows,
                    "started": run.started.isoformat(),
                    "silent": list(before.silent),
                }
            )
    for note in twin.notes:
        terminal.say(note)
    values = {"schema": "fogml.simulation/1", "twin": twin.name, "runs": results, "notes": list(twin.notes)}
    terminal.result(values)


def _print_simulation(settings: SimulateSettings, world: World, rows: int, terminal: Terminal) -> None:
    assert settings.out
    programme, twin = world.timeline.programme, world.twin
    values = {
        "schema": "fogml.simulation/1",
        "run": Path(settings.out).name,
        "truth": Path(settings.truth).name if settings.truth else None,
        "rows": rows,
        "sample_s": settings.sample_s,
        "hours": programme.total_hours,
        "seed": settings.seed,
        "programme": programme.name,
        "twin": twin.name,
        "effects": list(twin.settings),
        "silent": list(world.silent),
        "notes": list(twin.notes),
    }
    terminal.say(
        f"{rows} samples every {settings.sample_s:g} s, {duration(programme.total_s)} of {programme.name}, "
        f"written to {settings.out}"
    )
    on = ", ".join(twin.settings) or "none"
    terminal.say(f"Twin {twin.name}, seed {settings.seed}; effects: {on}.")
    _say_silent(world, terminal)
    for note in twin.notes:
        terminal.say(note)
    if settings.truth:
        terminal.say(f"The truth of every node and effect is in {settings.truth}.")
    terminal.result(values)


def _say_silent(world: World, terminal: Terminal) -> None:
    """Name the effects that this programme gives nothing to act on, and rates that samples may miss."""
    name = world.timeline.programme.name
    if world.silent:
        terminal.say(f"On, but without any part in the output of {name}: {', '.join(world.silent)}.")
    if rates := world.timeline.short_rates:
        terminal.say(
            f"{name}: {plural(rates, 'rate')} of the table held for less than a sample of "
            f"{world.timeline.sample_s:g} s; gyro and rate are those at the samples, which may miss them."
        )


def replay_and_write(settings: ReplaySettings, terminal: Terminal) -> None:
    """Replay a run, write it with the column ``replayed``, and print how far the two are apart."""
    assert settings.twin and settings.run and settings.out
    if settings.after and settings.truth:
        raise InputError("--after takes recorded runs, and --truth the truth of one; give one of the two")
    out = Path(settings.out)
    elsewhere = settings.twin not in twin_names() and is_simulator_output(settings.twin)
    if elsewhere and (settings.only or settings.truth or settings.after):
        raise InputError(f"{settings.twin}: a simulator's output takes no --only, --truth or --after")
    twin = None if elsewhere else load_twin(settings.twin)
    if twin is not None:
        settings.refuse_idle(("gyro_axis",), "is of a simulator's output; leave it out with a twin")
    checked_suffix(out, IN_BLOCKS)
    with terminal.work(f"reading {settings.run}") as work:
        run = open_run(settings.run, repair=settings.repair)
        note_findings([run], terminal, drift=False)
        truth = read_truth(settings.truth) if settings.truth else None
        work.doing("replaying")
        if twin is None:
            replayed = _given_by(settings.twin, settings.gyro_axis, run)
        else:
            replayed = _replayed(settings, twin, run, truth)
        values = _replay_values(
            settings, Path(settings.twin).name if twin is None else twin.name, run, replayed
        )
        check_finite(values, run.name)
        work.doing(f"writing {out.name}")
        with settings.written_beside(out, "replay"):
            _write(run, replayed, out)
    _print_replay(settings, values, terminal)


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


def _replay_values(settings: ReplaySettings, twin: str, run: Run, replayed: FloatArray) -> dict[str, Any]:
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
        is_rate = run.gyro_unit == "deg/h" or run.facts.scale_factor is not None
        gap = run.gyro_deg_h - replayed if is_rate else None
        values["gap_mean"] = float(gap.mean()) if gap is not None else None
        values["gap_rms"] = _rms(gap) if gap is not None else None
    return values


def _print_replay(settings: ReplaySettings, values: dict[str, Any], terminal: Terminal) -> None:
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


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values * values)))
