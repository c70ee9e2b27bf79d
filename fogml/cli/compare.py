"""``fogml compare``: every model and baseline on the same split."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import BeforeValidator

from fogml.cli import options
from fogml.cli.given import option


class CompareSettings(options.LimitSettings):
    """Judge every model and baseline on the same split, in one table.

    Writes compare.json, compare.html and compare.config.yaml. A model that can't be fitted to these runs is
    reported with its reason. Exit status 1 if the design index or a limit is stated and no model
    meets it.
    """

    job: ClassVar[str] = "fogml.cli.compare_job:compare_and_write"
    runs: options.Runs = []
    test: options.Tests = []
    leave_one_out: Annotated[
        bool,
        option("Without --test: judge each run by models fitted on the others.", "--leave-one-out/--split"),
    ] = False
    models: Annotated[
        list[str],
        BeforeValidator(options.names_list),
        option(
            'Names with commas between, or "all".',
            metavar="NAME,...",
            as_text=True,
            known="fogml.models.names:MODEL_NAMES",
        ),
    ] = ["all"]
    features: options.Features = None
    axis: options.Axis = None
    repair: options.Repair = False
    strict: options.Strict = False
    any_unit: options.AnyUnit = False
    out: options.Folder = "compare-results"
