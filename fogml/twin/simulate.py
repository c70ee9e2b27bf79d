"""Simulation: a programme and a twin give a run, and the truth behind it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from fogml.errors import InputError, known_are
from fogml.runs.columns import KNOWN, header, is_temperature, of_a_sensor
from fogml.runs.facts import Facts, ScaleFactor
from fogml.runs.possible import check_columns
from fogml.runs.run import FloatArray, Run
from fogml.twin.chain import ChainOutput
from fogml.twin.programme import Programme, load_programme
from fogml.twin.recorder import Samples, Worked, looks_ahead_s
from fogml.twin.replay_after import Storage
from fogml.twin.truth import TIME_ON, Truth, written_time_on
from fogml.twin.twin import Twin
from fogml.twin.twin_file import as_twin
from fogml.twin.world import World

Done = TypeVar("Done")
DEFAULT_COLUMNS = (
    "T_in",
    "T_out",
    "T_case",
    "T_electronics",
    "T_chamber",
    "rate",
    "angle",
    "power",
    "supply",
    "humidity",
    "compressor",
    "heater",
    "fan",
)
"""What is recorded beside time and gyro unless told otherwise."""
DEFAULT_FACTS = Facts(axis="x", latitude=39.9, input_axis="up")
BLOCK_ROWS = 3 << 14
"""Samples worked out at once: many enough that two threads seldom wait for each other's turn."""
_ROUNDED = 1e-6
"""Of a count: what a rate's digits leave of it."""


@dataclass(frozen=True, eq=False)
class Simulation:
    """A simulated run, the truth behind it where that was asked for, and the world that it left."""

    run: Run
    truth: Truth | None = None
    world: World | None = field(default=None, repr=False)


def simulate(
    programme: Programme | str | Mapping[str, Any] | Sequence[Any],
    twin: Twin | str | Path,
    *,
    sample_s: float = 1.0,
    seed: int = 0,
    columns: Sequence[str] | None = None,
    facts: Facts | None = None,
    truth: bool = False,
    after: Simulation | None = None,
    storage: Storage | None = None,
) -> Simulation:
    """Run a twin through a programme.

    Parameters
    ----------
    programme
        A programme, the name or file of one, or its steps.
    twin
        A twin, or the name or file of one.
    sample_s
        Sample interval [s].
    seed
        Of noise and sensors; the same seed gives the same run.
    columns
        What to record beside time and gyro, by the run format's names; `DEFAULT_COLUMNS` if None.
    facts
        Set-up facts; if None latitude 39.9 deg and an input axis that is up. Unless stated, that and power-on
        are as the programme says, the unit is the twin's name and the notes say what was simulated.
    truth
        Whether to keep every node and every effect's contribution, as the run before has to have done.
    after
        The run of the same unit before: what the unit remembers goes on from it, over the time that the facts
        ``started`` of both tell. What is drawn at each power-on then follows from the first run's seed.
    storage
        Where the unit is between; off at 25 degC if None.

    Returns
    -------
    Simulation
        Samples in which the unit is off are not recorded: it gives no output, but remembers temperature.

    Raises
    ------
    InputError
        If something can't be recorded, the seed is negative, or the unit is never on.
    """
    before = None if after is None else after.world
    world = world_of(
        programme, twin, sample_s, seed, columns, facts, truth=truth, before=before, storage=storage
    )
    kept: dict[str, FloatArray] = {}
    kept_truth: dict[str, FloatArray] = {}
    length, rows = len(world.timeline), 0

    def keep(recorded: dict[str, FloatArray], true: Truth | None) -> None:
        nonlocal rows
        count = len(recorded["time"])
        for target, block in ((kept, recorded), (kept_truth, true.columns() if true else {})):
            for name, values in block.items():
                whole = target.setdefault(name, np.empty(length) if count < length else values)
                if whole is not values:
                    whole[rows : rows + count] = values
        rows += count

    for _ in _blocks(world, keep):
        pass
    if not rows:
        raise _never_on(world)
    columns_kept = {name: values[:rows] for name, values in kept.items()}
    check_columns(world.twin.name, columns_kept)
    run = Run.derived(world.twin.name, columns_kept, world.facts, world.gyro_unit)
    if not truth:
        return Simulation(run, None, world)
    from fogml.twin.truth import truth_from_columns

    true = truth_from_columns({cell: values[:rows] for cell, values in kept_truth.items()})
    return Simulation(run, true, world)


def write_world(
    world: World, path: str | Path, truth_path: str | Path | None = None, progress: Any = None
) -> int:
    """Write what is recorded of a world that goes by, block by block in bounded memory.

    Parameters
    ----------
    world
        One that has not begun, of `world_of`.
    path
        The run, ``.csv`` or ``.parquet``; the same numbers as those of `simulate`.
    truth_path
        Where the truth of every node and effect goes, if anywhere; the world is one that was asked for it.
    progress
        Called with the number of samples after each block, if given.

    Returns
    -------
    int
        How many samples were recorded.

    Raises
    ------
    InputError
        If the unit is never on, or a file can't be written.
    """
    from fogml.runs.writing import BlockWriter

    rows = 0
    with ExitStack() as stack:
        writer = stack.enter_context(BlockWriter(path, world.facts))
        truth_writer = None
        if truth_path is not None:
            truth_writer = stack.enter_context(BlockWriter(truth_path))

        def write(recorded: dict[str, FloatArray], true: Truth | None) -> int:
            count = len(recorded["time"])
            if count:
                _write(writer, truth_writer, recorded, true, world.gyro_unit)
            return count

        left = len(world.timeline)
        for count in _blocks(world, write):
            rows += count
            if progress is not None:
                progress(min(BLOCK_ROWS, left))
                left -= min(BLOCK_ROWS, left)
        if not rows:
            raise _never_on(world)
    return rows


def _write(
    writer: Any, truth_writer: Any, recorded: Mapping[str, FloatArray], true: Truth | None, unit: str
) -> None:
    cells = {TIME_ON if name == "time_on" else header(name): values for name, values in recorded.items()}
    if unit == "count":
        cells = {header("gyro", unit) if cell == header("gyro") else cell: v for cell, v in cells.items()}
    if TIME_ON in cells:
        cells[TIME_ON] = written_time_on(cells[TIME_ON])
    writer.write(cells, (TIME_ON,))
    if truth_writer is not None and true is not None:
        truth_writer.write(true.columns(), (TIME_ON,))


def _never_on(world: World) -> InputError:
    return InputError(f"{world.timeline.programme.name}: the unit is never on; add a step with 'power on'")


def default_facts(programme: Programme) -> Facts:
    """Set-up facts where none are stated: the gyro mounted as the programme says."""
    return DEFAULT_FACTS.model_copy(update={"input_axis": programme.input_axis or DEFAULT_FACTS.input_axis})


def world_of(
    programme: Any,
    twin: Twin | str | Path,
    sample_s: float,
    seed: int,
    columns: Sequence[str] | None,
    facts: Facts | None,
    *,
    truth: bool,
    before: World | None = None,
    storage: Storage | None = None,
) -> World:
    """A world that has not begun; parameters as `simulate`, `before` is that of the unit's run before."""
    programme = programme if isinstance(programme, Programme) else load_programme(programme)
    unit = as_twin(twin)
    facts = default_facts(programme) if facts is None else facts
    steps = "steps of its own" if programme.name == "programme" else f"programme {programme.name}"
    notes = f"synthetic: {steps}, twin {unit.name}, seed {seed}"
    usual = {"unit": unit.name, "notes": notes, "input_axis": programme.input_axis}
    stated = facts.model_copy(update={key: getattr(facts, key) or value for key, value in usual.items()})
    counts = unit.counts_per_deg_h(sample_s)
    if counts is not None:
        if stated.scale_factor is not None:
            raise InputError(
                "facts: 'scale_factor' follows from the effect 'output_counts' and the sample interval; "
                "leave it out"
            )
        stated = stated.model_copy(update={"scale_factor": ScaleFactor(value=counts)})
    names = tuple(DEFAULT_COLUMNS if columns is None else columns)
    for name in names:
        if not of_a_sensor(name):
            known = [key for key in KNOWN if of_a_sensor(key)]
            raise InputError(
                f"columns: '{name}' can't be recorded; {known_are(name, known)} and coil sensors T1, T2 ..."
            )
    if len(set(names)) < len(names):
        raise InputError("columns: one is named twice")
    return World(programme, unit, sample_s, seed, names, stated, truth, before, storage)


def _blocks(world: World, then: Callable[[dict[str, FloatArray], Truth | None], Done]) -> Iterator[Done]:
    """What `then` makes of the recorded columns, and of the truth, block after block."""
    clock = world.timeline
    ahead_s = looks_ahead_s(world.twin, clock.total_hours)
    rows = max(BLOCK_ROWS, math.ceil(ahead_s / clock.sample_s))
    blocks = world.samples(rows)

    def record(samples: Samples, chain: ChainOutput, later: Worked | None = None) -> Done:
        return then(*_recorded(world, samples, chain, later if ahead_s else None))

    if len(clock) <= rows:
        # A thread takes longer to start than a single block to work out.
        yield from (record(samples, world.output(samples)) for samples in blocks)
        return
    # Beside a block's output, the longest part: what acts on the next, what is recorded of the one before.
    with ThreadPoolExecutor(max_workers=2) as beside:
        ahead, behind = beside.submit(next, blocks, None), None
        held: Worked | None = None
        while (samples := ahead.result()) is not None:
            ahead = beside.submit(next, blocks, None)
            chain = world.output(samples)
            if behind is not None:
                yield behind.result()
            behind = None if held is None else beside.submit(record, *held, (samples, chain))
            held = samples, chain
        if behind is not None:
            yield behind.result()
        if held is not None:
            yield record(*held)


def _whole(counts: FloatArray) -> FloatArray:
    """Counts without the rounding of their way through a rate; a logger's means of them stay."""
    whole = np.rint(counts)
    return np.where(np.abs(counts - whole) < _ROUNDED, whole, counts)


def _recorded(
    world: World, samples: Samples, chain: ChainOutput, later: Worked | None
) -> tuple[dict[str, FloatArray], Truth | None]:
    inputs, on = samples.inputs, samples.on
    # On the run's own clock.
    time = inputs.time[on] - world.clock_s if world.clock_s else inputs.time[on]
    gyro = world.logged((samples, chain), later)
    if world.counts_per_deg_h is not None:
        gyro = _whole(gyro * world.counts_per_deg_h)
    recorded = {"time": time, "gyro": gyro}
    for name in world.columns:
        if is_temperature(name):
            recorded[name] = world.sensed(name, samples)[on]
        elif name == "rate":
            recorded[name] = inputs.table_rate[on]
        else:
            recorded[name] = inputs.drives[name][on]
    if world.power_cycles:
        recorded["time_on"] = inputs.time_on_s[on]
    if not world.truth:
        return recorded, None
    free = world.noise_free((samples, chain), later)
    others = world.other_contributions(samples, chain.output)

    def kept(columns: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        return {name: values[on] for name, values in columns.items()}

    return recorded, Truth(
        time,
        kept(inputs.temperatures),
        inputs.table_rate[on],
        kept(inputs.drives),
        inputs.time_on_s[on],
        free.output,
        samples.noise[on],
        {**kept(chain.contributions), **free.contributions, **kept(others)},
    )
