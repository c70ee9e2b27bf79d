"""``fogml export``: a model's compact weights, or C code, checked against the model."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import BeforeValidator, PlainSerializer

from fogml.cli import options
from fogml.cli.given import argument, option
from fogml.cli.settings import Settings


def _several(value: object) -> object:
    return [value] if isinstance(value, str) else value


def _one_as_text(value: list[str]) -> str | list[str]:
    return value[0] if len(value) == 1 else value


class ExportJobSettings(Settings):
    """Write a model's compact form, once it has been compared with the model.

    Writes fogml_model.* and export.json. C code takes raw temperatures sample by sample; it is
    compiled and run against the model before it is written. Exit status 2, and nothing written, if
    it differs by more than the tolerance.

    Segments are a table of bias and scale factor over one temperature (CSV, JSON, C); px4 and
    ardupilot are parameter files with a cubic. Both hold what the model says at rest.
    """

    job: ClassVar[str] = "fogml.cli.export_job:export_and_write"
    model: Annotated[
        list[str],
        BeforeValidator(_several),
        PlainSerializer(_one_as_text),
        argument("MODEL...", "Folder of the model, or of the results of three axes.", reads=True),
    ] = []
    to: Annotated[
        str,
        option(
            "c, onnx, json, mat; segments, px4 or ardupilot.",
            metavar="FORMAT",
            known=("c", "onnx", "json", "mat", "segments", "px4", "ardupilot"),
        ),
    ] = "c"
    dtype: Annotated[
        str | None,
        option(
            "float64, float32, float16, int8, q15 or q31.",
            metavar="TYPE",
            known=("float64", "float32", "float16", "int8", "q15", "q31"),
        ),
    ] = None
    bytes: Annotated[int | None, option("Leave out centres until the weights fit N bytes.")] = None
    with_pipeline: Annotated[
        bool, option("ONNX from the temperatures' window.", "--with-pipeline/--features-only")
    ] = False
    tolerance: Annotated[
        float | None, option("Largest difference from the model allowed.", metavar="DEG/H")
    ] = None
    sample_s: Annotated[
        float | None, option("Sample interval on board; that of training if none.", metavar="SECONDS")
    ] = None
    breakpoints: Annotated[
        int | None, option("Of segments; as few as the tolerance allows.", metavar="K")
    ] = None
    matrix: Annotated[
        str | None,
        option("3 x 3 matrix (YAML) that three axes are multiplied by.", metavar="FILE", reads=True),
    ] = None
    train: Annotated[
        list[str],
        option(
            "The model's training runs, to prune and to judge on.",
            metavar="RUN...",
            spread=True,
            reads=True,
            known=options.SHIPPED_RUNS,
        ),
    ] = []
    out: options.Folder = "export-results"
