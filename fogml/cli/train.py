"""``fogml train``: fit on some runs, judge on others."""

from __future__ import annotations

from typing import Annotated, ClassVar

from fogml.cli import options
from fogml.cli.given import option


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
    train_again: Annotated[
        bool,
        option(
            "Search sizes and features on training folds until the design index is met there.",
            "--train-again/--train-once",
        ),
    ] = False
    from_diagnosis: Annotated[
        str | None,
        option(
            "Compensate the causes that a diagnosis named: its folder; 'auto' is judged beside it.",
            metavar="DIR",
            reads=True,
        ),
    ] = None
    causes: Annotated[
        list[str],
        option(
            "With --from-diagnosis these causes in place of those named; may be repeated.",
            "--cause",
            metavar="EFFECT",
            known=options.EFFECTS,
        ),
    ] = []
    navigation: Annotated[
        float | None, option("Show what the drift costs a navigator there.", metavar="LATITUDE")
    ] = None
    axis: options.Axis = None
    repair: options.Repair = False
    strict: options.Strict = False
    any_unit: options.AnyUnit = False
    out: options.Folder = "train-results"
