"""The job of ``fogml export``."""

from __future__ import annotations

from typing import Any, ClassVar

from fogml.cli.runs import open_runs
from fogml.cli.settings import Settings, absolute
from fogml.cli.terminal import Terminal
from fogml.errors import InputError
from fogml.json_files import write_json
from fogml.outputs import whole_folder


class ExportJobSettings(Settings):
    """Settings of ``fogml export``."""

    path_keys: ClassVar[tuple[str, ...]] = ("model", "train")
    model: str | None = None
    to: str = "c"
    dtype: str | None = None
    bytes: int | None = None
    with_pipeline: bool = False
    tolerance: float | None = None
    sample_s: float | None = None
    train: list[str] = []
    out: str = "export-results"

    def in_full(self) -> ExportJobSettings:
        """The settings with every path in full."""
        assert self.model is not None
        paths = {"model": absolute(self.model), "out": absolute(self.out)}
        return self.model_copy(update={**paths, "train": [absolute(path) for path in self.train]})


def export_and_write(settings: ExportJobSettings, terminal: Terminal) -> dict[str, Any]:
    """Export a model into ``settings.out``, whole or not at all, and print what came of it."""
    from fogml.export.export import ExportSettings, export_model
    from fogml.models.saved import load_model

    if not settings.model:
        raise InputError("no model is given; name the folder of the model, e.g. train-results/model")
    with whole_folder(settings.out) as folder:
        model = load_model(settings.model)
        train = open_runs(settings.train, terminal) if settings.train else []
        wanted = ExportSettings(
            settings.to,
            settings.dtype,
            settings.bytes,
            settings.tolerance,
            settings.with_pipeline,
            settings.sample_s,
            settings.seed,
        )
        with terminal.work(f"exporting {model.kind} to {settings.to}"):
            report = export_model(model, folder, wanted, train)
        write_json(folder / "export.json", report)
        settings.write_into(folder, "export")
    _print(settings, report, terminal)
    terminal.result(report)
    return report


def _print(settings: ExportJobSettings, report: dict[str, Any], terminal: Terminal) -> None:
    difference, tolerance = report["largest_difference"], report["tolerance"]
    rows = [
        ["number format", report["dtype"]],
        ["weights", f"{report['bytes_weights']} bytes"],
        ["largest difference in the trained box", f"{difference:.2g} deg/h (allowed {tolerance:.2g})"],
        ["operations per sample", str(report["operations_per_sample"])],
    ]
    if pruning := report.get("pruning"):
        text = f"{pruning['bytes_whole']} to {report['bytes_weights']} bytes, "
        text += f"rms {pruning['rms_difference']:.2g} deg/h"
        rows.append(["pruned", text])
    accuracy = report["accuracy"]
    if "rms_model" in accuracy:
        text = f"{accuracy['rms_model']:.4g} deg/h with the model, "
        text += f"{accuracy['rms_exported']:.4g} with the export"
        rows.append([f"rms of {accuracy['averaging_s']:g} s averages on training folds", text])
    if size := report.get("cortex_m4"):
        rows.append(["Cortex-M4", f"{size['flash_bytes']} bytes of flash, {size['ram_bytes']} of RAM"])
    elif report["to"] == "c":
        rows.append(["Cortex-M4", "not measured: arm-none-eabi-gcc is not installed"])
    if beyond := report.get("beyond_the_box"):
        rows.append(["beyond the trained box", beyond])
    terminal.table(f"{report['model']['kind']} exported to {settings.out}", ["", ""], rows)
