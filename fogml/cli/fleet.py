"""``fogml fleet``: the same job for every unit of a manifest."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


@app.command()
def fleet(
    manifest: Annotated[
        Path | None,
        typer.Argument(metavar="MANIFEST", help="CSV or YAML of units: unit, job, train, test, axis."),
    ] = None,
    model: Annotated[str | None, typer.Option("--model", help="Name of the model (auto).")] = None,
    features: options.Features = None,
    parameters: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Parameter of the model; may be repeated."),
    ] = None,
    prior: Annotated[
        Path | None,
        typer.Option("--prior", metavar="FLEET.JSON", help="Draw constants to those of an earlier fleet."),
    ] = None,
    form: Annotated[
        str | None, typer.Option("--form", help="Features that the units' constants are compared in.")
    ] = None,
    twin: Annotated[str | None, typer.Option("--twin", help="Twin that is diagnosed against.")] = None,
    workers: Annotated[int | None, typer.Option("--workers", help="Processes on this machine (1).")] = None,
    cluster: Annotated[
        str | None, typer.Option("--cluster", metavar="tcp://HOST:PORT", help="Scheduler of a Dask cluster.")
    ] = None,
    device: Annotated[
        str | None,
        typer.Option("--device", help="Train the units' RBF networks in batches there: cpu, cuda."),
    ] = None,
    batch: Annotated[int | None, typer.Option("--batch", help="Units in one batch (64).")] = None,
    design_index: options.DesignIndex = None,
    limit: options.Limits = None,
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
    """Do the same job for every unit of a manifest, in parallel, here or on a cluster.

    The same command goes on where it was interrupted; a bad unit is reported and the rest go on.
    Writes fleet.json, fleet.html, fleet.xlsx and one folder per unit. Exit status 1 if a unit
    failed or misses a limit.
    """
    from fogml.cli.fleet_job import FleetSettings, fleet_and_write

    settings = FleetSettings.gather(
        config,
        {
            "manifest": str(manifest) if manifest else None,
            "model": model,
            "features": features,
            "parameters": parameters,
            "prior": str(prior) if prior else None,
            "form": form,
            "twin": twin,
            "workers": workers,
            "cluster": cluster,
            "device": device,
            "batch": batch,
            "design_index": design_index,
            "limits": limit,
            "averaging": averaging,
            "noise": noise,
            "repair": options.repairing(repair, repair_anyway),
            "strict": strict,
            "any_unit": any_unit,
            "out": str(out) if out else None,
            "seed": seed,
        },
    )
    if not fleet_and_write(settings, Terminal(as_json, quiet)):
        raise typer.Exit(1)
