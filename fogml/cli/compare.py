"""``fogml compare``: every model and baseline on the same split."""

from __future__ import annotations

from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


@app.command(cls=options.TestRunsCommand)
def compare(
    runs: Annotated[list[str] | None, typer.Argument(metavar="RUN...", help="Training runs.")] = None,
    test: options.Tests = None,
    leave_one_out: Annotated[
        bool | None,
        typer.Option(
            "--leave-one-out/--split", help="Without --test: judge each run by models fitted on the others."
        ),
    ] = None,
    models: Annotated[
        str | None, typer.Option("--models", help='Names with commas between, or "all" (all).')
    ] = None,
    features: options.Features = None,
    design_index: options.DesignIndex = None,
    limit: options.Limits = None,
    turn_on_band: options.TurnOnBand = None,
    averaging: options.Averaging = None,
    noise: options.Noise = None,
    repair: options.Repair = None,
    repair_anyway: options.RepairAnyway = None,
    strict: options.Strict = None,
    any_unit: options.AnyUnit = None,
    out: options.Out = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Judge every model and baseline on the same split, in one table.

    Writes compare.json, compare.html and compare.config.yaml. A model that can't be fitted to these runs is
    reported with its reason. Exit status 1 if the design index or a limit is stated and no model
    meets it.
    """
    from fogml.cli.compare_job import CompareSettings, compare_and_write

    settings = CompareSettings.gather(
        config,
        {
            "runs": runs,
            "test": test,
            "leave_one_out": leave_one_out,
            "models": models,
            "features": features,
            "design_index": design_index,
            "limits": limit,
            "turn_on_band": turn_on_band,
            "averaging": averaging,
            "noise": noise,
            "repair": options.repairing(repair, repair_anyway),
            "strict": strict,
            "any_unit": any_unit,
            "out": str(out) if out else None,
            "seed": seed,
        },
    )
    if not compare_and_write(settings, Terminal(as_json, quiet)):
        raise typer.Exit(1)
