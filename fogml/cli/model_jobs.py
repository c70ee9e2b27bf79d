"""The jobs of ``fogml compensate`` and ``fogml export``: what is made of a saved model."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fogml.arrays import IntArray
from fogml.cli.each_axis import axis_folders
from fogml.cli.model_commands import CompensateSettings, ExportJobSettings
from fogml.cli.runs import note_wrong, open_blocks, open_model, open_runs
from fogml.cli.terminal import Terminal, Work
from fogml.errors import InputError
from fogml.json_files import write_json
from fogml.numerals import percent, short
from fogml.outputs import whole_folder
from fogml.runs.findings import dead_words
from fogml.runs.run import Run

if TYPE_CHECKING:
    from fogml.models.base import DriftModel

FLAGS = ("good", "outside_training", "window_not_full")
"""What the flags 0, 1 and 2 mean, in JSON."""
_WORDS = ("good", "outside training", "window or memory not settled")


def compensate_and_write(settings: CompensateSettings, terminal: Terminal) -> None:
    """Compensate a run block by block into a file, and print how many samples got which flag."""
    from fogml.runs.checks import check_run

    assert settings.run and settings.model and settings.out
    out = Path(settings.out)
    # The run is looked into first: one of three axes takes a model each.
    blocks = iter(open_blocks(settings.run, repair=settings.repair, axis=settings.axis))
    begun = list(islice(blocks, 1))
    for first in begun:
        note_wrong(first.name, check_run(first), terminal)
    model = open_model(settings.model, terminal)
    notes = [note for first in begun for note in model.check_applies(first, settings.any_unit)]
    for note in notes:
        terminal.note(note)
    total = _expected_rows(settings.run)
    with (
        settings.written_beside(out, "compensate"),
        terminal.work(f"compensating {settings.run}", total=total) as work,
    ):
        counts, still = _compensate(model, chain(begun, blocks), out, notes, work)
    if still is not None:
        terminal.note(f"{Path(settings.run).name}: {dead_words(still)}")
    memories = [atom.text for atom in model.features_.atoms if atom.settles] if model.features_ else []
    _print_compensated(settings, model.describe()["kind"], memories, counts, notes, terminal)


def _compensate(
    model: DriftModel, blocks: Iterable[Run], out: Path, notes: Sequence[str], work: Work
) -> tuple[IntArray, float | None]:
    """Write the compensated run; how many samples got each flag, shape (3,), and an output's only value.

    Whether the model applies is known, and in `notes`, which go to the run's own.
    """
    from fogml.models.compensation import compensate_blocks
    from fogml.runs.writing import BlockWriter, carried_cells, header_cells

    counts = np.zeros(len(FLAGS), dtype=np.int64)
    low, high = np.inf, -np.inf
    written: Future[None] | None = None
    with ExitStack() as stack:
        for block, compensation in compensate_blocks(model, blocks, any_unit=True):
            if written is None:
                facts = block.facts
                if notes:
                    told = "; ".join((*([facts.notes] if facts.notes else []), *notes))
                    facts = facts.model_copy(update={"notes": told})
                writer = stack.enter_context(BlockWriter(out, facts))
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


def _print_compensated(
    settings: CompensateSettings,
    kind: str,
    memories: list[str],
    counts: IntArray,
    notes: list[str],
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
        "notes": notes,
    }
    terminal.table(
        f"{values['run']} compensated by {kind}, written to {settings.out}",
        ["flag", "samples", "share"],
        [
            [f"{flag} {name}", str(count), f"{percent(count / max(rows, 1))}"]
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
        from fogml.runs.column_files import parquet_rows

        return float(parquet_rows(path))
    if path.suffix.lower() not in (".csv", ".txt") or not path.is_file():
        return None
    with path.open("rb") as file:
        head = file.read(1 << 16)
    lines = head.count(b"\n")
    return path.stat().st_size / len(head) * lines if lines else None


def export_and_write(settings: ExportJobSettings, terminal: Terminal) -> dict[str, Any]:
    """Export a model into ``settings.out``, whole or not at all, and print what came of it."""
    from fogml.export.c_axes import export_axes
    from fogml.export.export import export_model
    from fogml.export.settings import TABLE_TARGETS, ExportSettings
    from fogml.export.tables import TableSettings, export_tables

    with whole_folder(settings.out) as folder:
        models = [open_model(path, terminal) for named in settings.model for path in axis_folders(named)]
        _check_form(settings, len(models))
        train = _training_runs(settings, models, terminal)
        wanted = ExportSettings(
            settings.to,
            settings.dtype,
            settings.bytes,
            settings.tolerance,
            settings.with_pipeline,
            settings.sample_s,
            settings.seed,
        )
        with terminal.work(f"exporting {models[0].describe()['kind']} to {settings.to}"):
            matrix = None if settings.matrix is None else Path(settings.matrix)
            if settings.to in TABLE_TARGETS:
                tables = TableSettings(
                    settings.to, settings.dtype, settings.breakpoints, settings.tolerance, matrix
                )
                report = export_tables(models, folder, tables, train)
            elif len(models) > 1:
                report = export_axes(models, folder, wanted, train, matrix)
            else:
                report = export_model(models[0], folder, wanted, train)
        write_json(folder / "export.json", report)
        settings.write_into(folder, "export")
    if settings.to in TABLE_TARGETS:
        _print_tables(settings, report, terminal)
    else:
        for axis, told in report.get("axes", {"": report}).items():
            _print_export(settings, told, terminal, f"axis {axis}: " if axis else "")
    terminal.result(report)
    return report


def _training_runs(
    settings: ExportJobSettings, models: Sequence[DriftModel], terminal: Terminal
) -> list[Run]:
    """The training runs; of files of three gyros one for each model's axis."""
    from fogml.runs.three_axes import SeveralAxes

    if not settings.train:
        return []
    read = partial(open_runs, settings.train, terminal, repair=settings.repair)
    try:
        return read()
    except SeveralAxes:
        axes = dict.fromkeys(model.card_.axis for model in models)
        return [run for axis in axes for run in read(axis=axis)]


def _check_form(settings: ExportJobSettings, models: int) -> None:
    """Hold that what is asked for is of the form asked for."""
    from fogml.export.settings import TABLE_TARGETS

    of_tables = settings.to in TABLE_TARGETS
    if not of_tables and settings.to != "c" and models > 1:
        forms = ", ".join(("c", *TABLE_TARGETS))
        raise InputError(f"--to {settings.to} takes one model; several axes go to {forms}")
    given = {
        "--bytes": settings.bytes is not None,
        "--with-pipeline": settings.with_pipeline,
        "--sample-s": settings.sample_s is not None,
    }
    several = settings.to == "c" and models > 1
    matrix = settings.matrix is not None and not several
    others = {"--breakpoints": settings.breakpoints is not None, "--matrix": matrix}
    for name, stated in (given if of_tables else others).items():
        if stated:
            of_one = " of one axis" if name == "--matrix" and settings.to == "c" else ""
            raise InputError(f"{name} is not for --to {settings.to}{of_one}; leave it out")
    if settings.breakpoints is not None and settings.to != "segments":
        raise InputError(f"--breakpoints is for --to segments; {settings.to} takes a cubic")


def _print_tables(settings: ExportJobSettings, report: dict[str, Any], terminal: Terminal) -> None:
    for axis, told in report["axes"].items():
        low, high = told["range_degc"]
        rms, largest = told["rms_difference_at_rest"], told["largest_difference_at_rest"]
        rows = [
            ["over", f"{told['thermometer']}, {short(low, 4)} to {short(high, 4)} degC"],
            ["off from the model at rest",
             f"rms {short(rms, 2)}, largest {short(largest, 2)} deg/h"],
        ]  # fmt: skip
        if "breakpoints" in told:
            rows.append(["breakpoints", f"{told['breakpoints']}, {told['bytes']} bytes"])
        if loss := told.get("accuracy"):
            form = "table" if "breakpoints" in told else "cubic"
            text = (
                f"{short(loss['rms_model'], 4)} deg/h with the model, "
                f"{short(loss['rms_exported'], 4)} with the {form}"
            )
            rows.append([f"rms of {loss['averaging_s']:g} s averages on the training runs", text])
        if told["leaves_out"]:
            rows.append(["leaves out", ", ".join(told["leaves_out"])])
        title = f"axis {axis}: {told['model']['kind']} as {report['to']}, written to {settings.out}"
        terminal.table(title, ["", ""], rows)


def _print_export(
    settings: ExportJobSettings, report: dict[str, Any], terminal: Terminal, lead: str = ""
) -> None:
    difference, tolerance = report["largest_difference"], report["tolerance"]
    rows = [
        ["number format", report["dtype"]],
        ["weights", f"{report['bytes_weights']} bytes"],
        [
            "largest difference measured in the trained box",
            f"{short(difference, 2)} deg/h (allowed {short(tolerance, 2)})",
        ],
    ]
    if (proven := report.get("fixed_point", {}).get("largest_difference_proven")) is not None:
        rows.append(["fixed point there, by proof", f"at most {short(proven, 2)} deg/h"])
    if fixed := report.get("fixed_point"):
        unit = fixed["compensated_unit_deg_h"]
        told = f"steps of {short(unit, 2)} deg/h, up to {short(2.0**31 * unit / 3600.0)} deg/s either way"
        rows.append(["outputs", told])
    if report["operations_per_sample"] is not None:
        rows.append(["operations per sample", str(report["operations_per_sample"])])
    if pruning := report.get("pruning"):
        text = f"{pruning['bytes_whole']} to {report['bytes_weights']} bytes, "
        text += f"rms {short(pruning['rms_difference'], 2)} deg/h off the model, "
        text += f"which moves by {short(pruning['model_deviation'], 2)} there ({pruning['chosen_on']})"
        rows.append(["pruned", text])
    accuracy = report.get("accuracy", {})
    if "rms_model" in accuracy:
        text = f"{short(accuracy['rms_model'], 4)} deg/h with the model, "
        text += f"{short(accuracy['rms_exported'], 4)} with the export"
        rows.append([f"rms of {accuracy['averaging_s']:g} s averages on training folds", text])
    if size := report.get("cortex_m4"):
        library = size["library_flash_bytes"]
        more = f" and {library} of the compiler's library" if library else ""
        told = f"{size['flash_bytes']} bytes of flash{more}, {size['ram_bytes']} of RAM"
        rows.append(["Cortex-M4", told])
        if size.get("instructions_per_sample"):
            rows.append(["Cortex-M4, a sample", f"{size['instructions_per_sample']} instructions"])
    elif report["to"] == "c":
        rows.append(["Cortex-M4", "not measured: arm-none-eabi-gcc is not installed"])
    if beyond := report.get("beyond_the_box"):
        rows.append(["beyond the trained box", beyond])
    terminal.table(f"{lead}{report['model']['kind']} exported to {settings.out}", ["", ""], rows)
    if pruning and pruning["rms_difference"] > 0.5 * pruning["model_deviation"]:
        how = "allow more" if settings.train else "allow more, or prune on its training runs (--train)"
        terminal.note(f"so few bytes leave out more than half of what the model moves by: {how}")
