"""Settings of the commands on drift models: ``train``, ``compare``, ``compensate``, ``export``, ``sweep``."""

from __future__ import annotations

import re
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, PlainSerializer, ValidationError

from fogml.cli import options
from fogml.cli.settings import Settings, placed, setting
from fogml.errors import known_are, quoted
from fogml.strict import first_fault
from fogml.tracking import shown_tracker
from fogml.tuning.plan import Space


class TrainSettings(options.LimitSettings):
    """Fit a drift model on some runs and judge it on others.

    Writes model/, report.json, report.html, report.xlsx and train.config.yaml; certificate.html where
    limits are given. Exit status 1 if the design index or a limit is not met.
    """

    job: ClassVar[str] = "fogml.cli.train_job:train"
    runs: options.Runs = []
    test: options.Tests = []
    model: options.Model = "auto"
    features: options.Features = None
    parameters: options.Parameters = {}
    train_again: bool = setting(
        False,
        "Search sizes and features on training folds until the design index is met there.",
        "--train-again/--train-once",
    )
    from_diagnosis: str | None = setting(
        None,
        "Compensate the causes that a diagnosis named: its folder; 'auto' is judged beside it.",
        metavar="DIR",
        reads=True,
        lost="no such folder; name the one that 'fogml diagnose' wrote",
    )
    causes: list[str] = setting(
        [],
        "With --from-diagnosis these causes in place of those named; may be repeated.",
        "--cause",
        metavar="EFFECT",
        known=options.EFFECTS,
    )
    navigation: float | None = setting(
        None, "Show what the drift costs a navigator there.", metavar="LATITUDE"
    )
    axis: options.Axis = None
    repair: options.Repair = False
    strict: options.Strict = False
    any_unit: options.AnyUnit = False
    out: options.Folder = "train-results"


class CompareSettings(options.LimitSettings):
    """Judge every model and baseline on the same split, in one table.

    Writes compare.json, compare.html and compare.config.yaml. A model that can't be fitted to these runs is
    reported with its reason. Exit status 1 if the design index or a limit is stated and no model
    meets it.
    """

    job: ClassVar[str] = "fogml.cli.compare_job:compare_and_write"
    runs: options.Runs = []
    test: options.TestsIfAny = []
    leave_one_out: bool = setting(
        False, "Without --test: judge each run by models fitted on the others.", "--leave-one-out/--split"
    )
    models: Annotated[list[str], options.NAMES] = setting(
        ["all"],
        'Names with commas between, or "all".',
        metavar="NAME,...",
        as_text=True,
        known="fogml.models.names:model_names",
    )
    features: options.Features = None
    axis: options.Axis = None
    repair: options.Repair = False
    strict: options.Strict = False
    any_unit: options.AnyUnit = False
    out: options.Folder = "compare-results"


class CompensateSettings(Settings):
    """Apply a model to a run of any length, in bounded memory.

    The file written holds the run's columns and 'drift [deg/h]', 'gyro_compensated [deg/h]' and
    'flag': 0 good, 1 outside what the model was trained on, 2 a window not full (there the static part) or a
    memory not settled (there what the run tells of it).
    """

    job: ClassVar[str] = "fogml.cli.model_jobs:compensate_and_write"
    run: str | None = placed(
        None,
        "RUN",
        "The run to compensate.",
        **options.RUN,
        needed="no run is given; name the run to compensate",
    )
    model: str | None = setting(
        None,
        "Folder of the model, or of the results that hold it.",
        metavar="DIR",
        reads=True,
        needed="no --model is given; name the folder of the model, e.g. train-results/model",
        lost=options.LOST_MODEL,
    )
    any_unit: options.AnyUnit = False
    axis: options.Axis = None
    repair: options.Repair = False
    out: options.FileToWrite = None


def _several(value: object) -> object:
    return [value] if isinstance(value, str) else value


def _one_as_text(value: list[str]) -> str | list[str]:
    return value[0] if len(value) == 1 else value


class ExportJobSettings(Settings):
    """Write a model's compact form, once it has been compared with the model.

    Writes fogml_model.* (C of three axes: fogml_axes.*), export.json and export.config.yaml. C code takes
    raw temperatures sample by sample; it is compiled and run against the model before it is written. Exit
    status 2, and nothing written, if it differs by more than the tolerance.

    Segments are a table of bias and scale factor over one temperature (CSV, JSON, C), fogml_segments.*; px4
    and ardupilot are parameter files with a cubic, fogml_px4.params and fogml_ardupilot.param. Both hold what
    the model says at rest.
    """

    job: ClassVar[str] = "fogml.cli.model_jobs:export_and_write"
    model: Annotated[
        list[str],
        BeforeValidator(_several, json_schema_input_type=str | list[str]),
        PlainSerializer(_one_as_text),
    ] = placed(
        [],
        "MODEL...",
        "Folder of the model, or of the results of three axes.",
        reads=True,
        needed="no model is given; name the folder of the model, e.g. train-results/model",
        lost=options.LOST_MODEL,
    )
    to: str = setting(
        "c",
        "c, onnx, json, mat; segments, px4 or ardupilot.",
        metavar="FORMAT",
        known=("c", "onnx", "json", "mat", "segments", "px4", "ardupilot"),
    )
    dtype: str | None = setting(
        None,
        "float64, float32, float16, int8, q15 or q31 (float32 of C and tables, else float64).",
        metavar="TYPE",
        known=("float64", "float32", "float16", "int8", "q15", "q31"),
    )
    bytes: int | None = setting(None, "Leave out centres or terms until the weights fit N bytes.")
    with_pipeline: bool = setting(
        False, "ONNX from the temperatures' window.", "--with-pipeline/--features-only"
    )
    tolerance: float | None = setting(
        None, "Largest difference from the model allowed; a share of its interval if none.", metavar="DEG/H"
    )
    sample_s: float | None = setting(
        None, "Sample interval on board; that of training if none.", metavar="SECONDS"
    )
    breakpoints: int | None = setting(None, "Of segments; as few as the tolerance allows.", metavar="K")
    matrix: str | None = setting(
        None,
        "3 x 3 matrix (YAML) that three axes are multiplied by.",
        metavar="FILE",
        reads=True,
        lost="no such file",
    )
    train: list[str] = setting(
        [],
        "The model's training runs, to prune and to judge on.",
        metavar="RUN...",
        spread=True,
        **options.RUN,
    )
    repair: options.Repair = False
    out: options.Folder = "export-results"


def _understood(value: Any) -> Space:
    """The space; a fault names its place."""
    try:
        return value if isinstance(value, Space) else Space.model_validate(value)
    except ValidationError as error:
        first = first_fault(error)
        if first["type"] == "missing":
            raise ValueError(f"nothing is given for '{first['loc'][-1]}'") from None
        if first["type"] == "extra_forbidden" and len(first["loc"]) == 1:
            key = str(first["loc"][0])
            known = known_are(key, Space.model_fields, "known keys")
            raise ValueError(f"unknown key {quoted(key)}; {known}") from None
        # What pydantic tried a value as stands among the keys.
        keys = [str(part) for part in first["loc"] if not re.search(r"\[|^Range$", str(part))]
        place = ".".join(keys)
        reason = str(first["ctx"]["error"]) if "error" in first.get("ctx", {}) else first["msg"]
        raise ValueError(f"{place}: {reason}" if place else reason) from None


class SweepSettings(Settings):
    """Search features, models and sizes on held-out parts of the training runs.

    The same command goes on with a study that was interrupted, and with --storage joins it from
    another machine. Writes best.yaml (a configuration of fogml train), sweep.json, sweep.html and
    sweep.config.yaml; the study itself is kept in --out unless --storage names a database.
    """

    job: ClassVar[str] = "fogml.cli.sweep_job:sweep_and_write"
    config_argument: ClassVar[str] = "YAML file of schema fogml.sweep/1."
    schema_: Literal["fogml.sweep/1"] = Field("fogml.sweep/1", alias="schema")
    name: str = setting("sweep", "Name of the study in its storage.", metavar="NAME")
    runs: list[str] = setting(
        [],
        "Training run; may be repeated.",
        "--run",
        metavar="RUN",
        **options.RUN,
        needed="no training run is given; state 'runs' in the file, or --run",
    )
    test: options.TestsIfAny = []
    space: Annotated[Space, BeforeValidator(_understood)]
    objectives: Annotated[list[str], options.NAMES] = ["rms"]
    folds: Literal["auto", "time", "runs"] = "auto"
    fold_count: int = 5
    trials: int = setting(50, "Trials to finish.")
    sampler: str = "tpe"
    prune: bool = True
    workers: options.Workers = 1
    storage: str | None = setting(
        None, "Database of the study, e.g. postgresql://user@host/db.", metavar="URL"
    )
    heartbeat_s: float = 10.0
    track: options.Track = None
    averaging: options.Averaging = 100.0
    repair: options.Repair = False
    out: options.Folder = "sweep-results"

    def check_given(self) -> None:
        """As `Settings.check_given`, and that a number of folds is of folds in time."""
        super().check_given()
        if self.folds == "runs" or (self.folds == "auto" and len(self.runs) > 1):
            self.refuse_idle(("fold_count",), "is of folds in time, and each run is one; state 'folds: time'")

    def as_written(self) -> dict[str, Any]:
        """The values of a configuration file; a password is never written."""
        from fogml.databases import without_password

        values = self.model_dump(mode="json", by_alias=True, exclude_none=True)
        if self.track is not None:
            values["track"] = shown_tracker(self.track)
        return values if self.storage is None else {**values, "storage": without_password(self.storage)}
