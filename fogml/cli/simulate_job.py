"""The job of ``fogml simulate``."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from fogml.cli.terminal import Terminal, span
from fogml.cli.twin_commands import SimulateSettings
from fogml.errors import InputError
from fogml.runs.facts import facts_from
from fogml.twin.draws import drawn_twin
from fogml.twin.programme import load_programme
from fogml.twin.replay_after import Storage
from fogml.twin.simulate import default_facts, world_of, write_world
from fogml.twin.twin_file import load_twin, twin_dict
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
    if settings.truth is not None and Path(settings.truth).absolute() == out.absolute():
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
        with terminal.work(f"simulating {programme.name}", total=len(world.timeline)) as work:
            rows = write_world(world, out, settings.truth, work.advance)
    _print(settings, world, rows, terminal)


def _simulate_draws(settings: SimulateSettings, terminal: Terminal) -> None:
    """Simulate units drawn from the twin's uncertainty, each into files of its own number."""
    if not settings.out and not settings.runs:
        raise InputError("no --out is given; name the run to write, .csv or .parquet")
    twin, width = load_twin(settings.twin), len(str(settings.draws))
    several = Collected(terminal)
    for number in range(1, settings.draws + 1):

        def numbered(path: str | None, tag: str = f"{number:0{width}d}") -> str | None:
            return path and str(Path(path).with_name(f"{Path(path).stem}-{tag}{Path(path).suffix}"))

        runs = [
            run.model_copy(update={"out": numbered(run.out), "truth": numbered(run.truth)})
            for run in settings.runs
        ]
        drawn = {"twin": twin_dict(drawn_twin(twin, settings.seed, number)), "draws": 0, "runs": runs}
        files = {"out": numbered(settings.out), "truth": numbered(settings.truth)}
        own_seed = {"seed": settings.seed + number * DRAW_APART}
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
    if len({out.absolute() for out in outs}) < len(outs):
        raise InputError("runs: two of them are written to the same 'out'")
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
                run.sample_s or settings.sample_s,
                settings.seed + number,
                run.columns or settings.columns,
                facts.model_copy(update={"started": run.started}),
                truth=run.truth is not None,
                before=before,
                storage=storage,
            )
            with terminal.work(f"simulating {programme.name}", total=len(before.timeline)) as work:
                rows = write_world(before, out, run.truth, work.advance)
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


def _print(settings: SimulateSettings, world: World, rows: int, terminal: Terminal) -> None:
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
        f"{rows} samples every {settings.sample_s:g} s, {span(programme.total_s)} of {programme.name}, "
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
    """Name the effects that are on and that this programme gives nothing to act on."""
    if world.silent:
        name = world.timeline.programme.name
        terminal.say(f"On, but without any part in the output of {name}: {', '.join(world.silent)}.")
