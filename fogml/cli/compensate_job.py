"""The job of ``fogml compensate``."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fogml.arrays import IntArray
from fogml.cli.model_commands import CompensateSettings
from fogml.cli.runs import note_wrong, open_blocks
from fogml.cli.terminal import Terminal, Work
from fogml.errors import InputError
from fogml.runs.findings import dead_words
from fogml.runs.run import Run

if TYPE_CHECKING:
    from fogml.models.base import DriftModel

FLAGS = ("good", "outside_training", "window_not_full")
"""What the flags 0, 1 and 2 mean, in JSON."""
_WORDS = ("good", "outside training", "window or memory not settled")


def compensate_and_write(settings: CompensateSettings, terminal: Terminal) -> None:
    """Compensate a run block by block into a file, and print how many samples got which flag."""
    from fogml.models.saved import load_model

    if not settings.run:
        raise InputError("no run is given; name the run to compensate")
    if not settings.model:
        raise InputError("no --model is given; name the folder of the model, e.g. train-results/model")
    if not settings.out:
        raise InputError("no --out is given; name the file to write, .csv or .parquet")
    out = Path(settings.out)
    if out.exists() and Path(settings.run).exists() and out.samefile(settings.run):
        raise InputError(f"{out}: is the run itself; choose another --out")
    # The run is looked into first: one of three axes takes a model each.
    blocks = iter(open_blocks(settings.run, repair=settings.repair, axis=settings.axis))
    begun = list(islice(blocks, 1))
    for first in begun:
        note_wrong(first, terminal)
    model = load_model(settings.model)
    total = _expected_rows(settings.run)
    with (
        settings.written_beside(out, "compensate"),
        terminal.work(f"compensating {settings.run}", total=total) as work,
    ):
        counts, still = _compensate(model, chain(begun, blocks), out, settings.any_unit, work)
    if still is not None:
        terminal.note(f"{Path(settings.run).name}: {dead_words(still)}")
    memories = [atom.text for atom in model.features_.atoms if atom.settles] if model.features_ else []
    _print(settings, model.describe()["kind"], memories, counts, terminal)


def _compensate(
    model: DriftModel, blocks: Iterable[Run], out: Path, any_unit: bool, work: Work
) -> tuple[IntArray, float | None]:
    """Write the compensated run; how many samples got each flag, shape (3,), and an output's only value."""
    from fogml.models.compensation import compensate_blocks
    from fogml.runs.writing import BlockWriter, carried_cells, header_cells

    counts = np.zeros(len(FLAGS), dtype=np.int64)
    low, high = np.inf, -np.inf
    written: Future[None] | None = None
    with ExitStack() as stack:
        for block, compensation in compensate_blocks(model, blocks, any_unit=any_unit):
            if written is None:
                writer = stack.enter_context(BlockWriter(out, block.facts))
                # Compressing takes as long as the rest: a block is written beside the next one's work.
                beside = stack.enter_context(ThreadPoolExecutor(max_workers=1))
            else:
                written.result()
            recorded = {cell: block.columns[name] for name, cell in header_cells(block).items()}
            written = beside.submit(
                writer.write, {**recorded, **compensation.columns()}, carried_cells(block)
            )
            counts += np.bincount(compensation.flag, minlength=len(FLAGS))
            low, high = min(low, float(block.gyro.min())), max(high, float(block.gyro.max()))
            work.advance(len(block))
        if written is None:
            raise InputError("the run holds no samples, there is nothing to compensate")
        written.result()
    return counts, low if low == high else None


def _print(
    settings: CompensateSettings,
    kind: str,
    memories: list[str],
    counts: IntArray,
    terminal: Terminal,
) -> None:
    assert settings.run and settings.out
    rows = int(counts.sum())
    values = {
        "schema": "fogml.compensate/1",
        "run": Path(settings.run).name,
        "out": Path(settings.out).name,
        "model": kind,
        "rows": rows,
        "flags": {name: int(count) for name, count in zip(FLAGS, counts, strict=True)},
    }
    terminal.table(
        f"{values['run']} compensated by {kind}, written to {settings.out}",
        ["flag", "samples", "share"],
        [
            [f"{flag} {name}", str(count), f"{count / max(rows, 1):.1%}"]
            for flag, (name, count) in enumerate(zip(_WORDS, counts, strict=True))
        ],
    )
    if memories and counts[2]:
        terminal.say(
            f"{', '.join(memories)}: go by what was before the run until they have settled, a lag after "
            "three time constants, a play once its input has moved by twice its half width. Until then (flag "
            "2) the drift is taken off as far as the run tells it; `fogml train` tells what is left there."
        )
    terminal.result(values)


def _expected_rows(run: str) -> float | None:
    """About how many rows a file holds, for the time left; None where that would take reading it."""
    path = Path(run)
    if path.suffix.lower() == ".parquet" and path.is_file():
        from fogml.runs.parquet_files import parquet_rows

        return float(parquet_rows(path))
    if path.suffix.lower() not in (".csv", ".txt") or not path.is_file():
        return None
    with path.open("rb") as file:
        head = file.read(1 << 16)
    lines = head.count(b"\n")
    return path.stat().st_size / len(head) * lines if lines else None
