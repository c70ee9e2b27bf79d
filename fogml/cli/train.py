"""``fogml train``: fit on some runs, judge on others."""

from __future__ import annotations

from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


@app.command(cls=options.TestRunsCommand)
def train(
    runs: Annotated[list[str] | None, typer.Argument(metavar="RUN...", help="Training runs.")] = None,
    test: options.Tests = None,
    model: Annotated[str | None, typer.Option("--model", help="Name of the model (auto).")] = None,
    features: options.Features = None,
    parameters: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Parameter of the model; may be repeated."),
    ] = None,
    design_index: options.DesignIndex = None,
    limit: options.Limits = None,
    turn_on_band: options.TurnOnBand = None,
    train_again: Annotated[
        bool | None,
        typer.Option(
            "--train-again/--train-once",
            help="Search sizes and features on training folds until the design index is met there.",
        ),
    ] = None,
    averaging: options.Averaging = None,
    noise: options.Noise = None,
    navigation: Annotated[
        float | None,
        typer.Option("--navigation", metavar="LATITUDE", help="Show what the drift costs a navigator there."),
    ] = None,
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
    """Fit a drift model on some runs and judge it on others.

    Writes model/, report.json, report.html, report.xlsx and train.config.yaml; certificate.html where
    limits are given. Exit status 1 if the design index or a limit is not met.
    """
    from fogml.cli.train_job import TrainSettings, train_and_write

    settings = TrainSettings.gather(
        config,
        {
            "runs": runs,
            "test": test,
            "model": model,
            "features": features,
            "parameters": parameters,
            "design_index": design_index,
            "limits": limit,
            "turn_on_band": turn_on_band,
            "train_again": train_again,
            "averaging": averaging,
            "noise": noise,
            "navigation": navigation,
            "repair": options.repairing(repair, repair_anyway),
            "strict": strict,
            "any_unit": any_unit,
            "out": str(out) if out else None,
            "seed": seed,
        },
    )
    judgement = train_and_write(settings, Terminal(as_json, quiet))
    if not judgement.met:
        raise typer.Exit(1)
