"""``fogml export``: a model's compact weights, or C code, checked against the model."""

from __future__ import annotations

from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


class TrainRunsCommand(typer.core.TyperCommand):
    """A command whose ``--train`` takes every value up to the next option."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        return super().parse_args(ctx, options.spread_values(args, "--train"))


@app.command(cls=TrainRunsCommand)
def export(
    model: Annotated[
        list[str] | None,
        typer.Argument(metavar="MODEL...", help="Folder of the model; of tables, up to three axes."),
    ] = None,
    to: Annotated[
        str | None, typer.Option("--to", help="c, onnx, json, mat; segments, px4 or ardupilot.")
    ] = None,
    dtype: Annotated[
        str | None, typer.Option("--dtype", help="float64, float32, float16, int8, q15 or q31.")
    ] = None,
    byte_budget: Annotated[
        int | None,
        typer.Option("--bytes", metavar="N", help="Leave out centres until the weights fit N bytes."),
    ] = None,
    with_pipeline: Annotated[
        bool | None,
        typer.Option("--with-pipeline/--features-only", help="ONNX from the temperatures' window."),
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option("--tolerance", metavar="DEG/H", help="Largest difference from the model allowed."),
    ] = None,
    breakpoints: Annotated[
        int | None,
        typer.Option("--breakpoints", metavar="K", help="Of segments; as few as the tolerance allows."),
    ] = None,
    matrix: Annotated[
        str | None,
        typer.Option(
            "--matrix", metavar="FILE", help="3 x 3 matrix (YAML) that three axes are multiplied by."
        ),
    ] = None,
    sample_s: Annotated[
        float | None,
        typer.Option("--sample-s", metavar="SECONDS", help="Sample interval on board (that of training)."),
    ] = None,
    train: Annotated[
        list[str] | None,
        typer.Option(
            "--train", metavar="RUN...", help="The model's training runs, to prune and to judge on."
        ),
    ] = None,
    out: options.Out = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Write a model's compact form, once it has been compared with the model.

    Writes fogml_model.* and export.json. C code takes raw temperatures sample by sample; it is
    compiled and run against the model before it is written. Exit status 2, and nothing written, if
    it differs by more than the tolerance.

    Segments are a table of bias and scale factor over one temperature (CSV, JSON, C); px4 and
    ardupilot are parameter files with a cubic. Both hold what the model says at rest.
    """
    from fogml.cli.export_job import ExportJobSettings, export_and_write

    settings = ExportJobSettings.gather(
        config,
        {
            "model": model,
            "to": to,
            "dtype": dtype,
            "bytes": byte_budget,
            "with_pipeline": with_pipeline,
            "tolerance": tolerance,
            "breakpoints": breakpoints,
            "matrix": matrix,
            "sample_s": sample_s,
            "train": train,
            "out": str(out) if out else None,
            "seed": seed,
        },
    )
    export_and_write(settings, Terminal(as_json, quiet))
