"""The job of ``fogml export``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fogml.cli.each_axis import axis_folders
from fogml.cli.model_commands import ExportJobSettings
from fogml.cli.runs import open_runs
from fogml.cli.terminal import Terminal
from fogml.errors import InputError
from fogml.json_files import write_json
from fogml.numerals import short
from fogml.outputs import whole_folder

if TYPE_CHECKING:
    from fogml.models.base import DriftModel
    from fogml.runs.run import Run


def export_and_write(settings: ExportJobSettings, terminal: Terminal) -> dict[str, Any]:
    """Export a model into ``settings.out``, whole or not at all, and print what came of it."""
    from fogml.export.c_axes import export_axes
    from fogml.export.export import export_model
    from fogml.export.settings import TABLE_TARGETS, ExportSettings
    from fogml.export.tables import TableSettings, export_tables
    from fogml.models.saved import load_model

    if not settings.model:
        raise InputError("no model is given; name the folder of the model, e.g. train-results/model")
    with whole_folder(settings.out) as folder:
        models = [load_model(path) for named in settings.model for path in axis_folders(named)]
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
            _print(settings, told, terminal, f"axis {axis}: " if axis else "")
    terminal.result(report)
    return report


def _training_runs(
    settings: ExportJobSettings, models: Sequence[DriftModel], terminal: Terminal
) -> list[Run]:
    """The training runs; of files of three gyros one for each model's axis."""
    from fogml.runs.three_axes import SeveralAxes

    if not settings.train:
        return []
    try:
        return open_runs(settings.train, terminal)
    except SeveralAxes:
        axes = dict.fromkeys(model.card_.axis for model in models)
        return [run for axis in axes for run in open_runs(settings.train, terminal, axis=axis)]


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
            text = (
                f"{short(loss['rms_model'], 4)} deg/h with the model, "
                f"{short(loss['rms_exported'], 4)} with the table"
            )
            rows.append([f"rms of {loss['averaging_s']:g} s averages on the training runs", text])
        if told["leaves_out"]:
            rows.append(["leaves out", ", ".join(told["leaves_out"])])
        title = f"axis {axis}: {told['model']['kind']} as {report['to']}, written to {settings.out}"
        terminal.table(title, ["", ""], rows)


def _print(settings: ExportJobSettings, report: dict[str, Any], terminal: Terminal, lead: str = "") -> None:
    difference, tolerance = report["largest_difference"], report["tolerance"]
    rows = [
        ["number format", report["dtype"]],
        ["weights", f"{report['bytes_weights']} bytes"],
        [
            "largest difference in the trained box",
            f"{short(difference, 2)} deg/h (allowed {short(tolerance, 2)})",
        ],
    ]
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
