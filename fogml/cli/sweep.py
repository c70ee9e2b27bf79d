"""``fogml sweep``: search features, models and sizes on held-out parts of the training runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


@app.command(cls=options.TestRunsCommand)
def sweep(
    sweep: Annotated[
        Path | None, typer.Argument(metavar="CONFIG", help="YAML file of schema fogml.sweep/1.")
    ] = None,
    runs: Annotated[
        list[str] | None, typer.Option("--run", metavar="RUN", help="Training run; may be repeated.")
    ] = None,
    test: options.Tests = None,
    trials: Annotated[int | None, typer.Option("--trials", help="Trials to finish (50).")] = None,
    workers: Annotated[int | None, typer.Option("--workers", help="Processes on this machine (1).")] = None,
    storage: Annotated[
        str | None,
        typer.Option(
            "--storage", metavar="URL", help="Database of the study, e.g. postgresql://user@host/db."
        ),
    ] = None,
    name: Annotated[str | None, typer.Option("--name", help="Name of the study in its storage.")] = None,
    averaging: options.Averaging = None,
    repair: options.Repair = None,
    repair_anyway: options.RepairAnyway = None,
    out: options.Out = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Search features, models and sizes on held-out parts of the training runs.

    The same command goes on with a study that was interrupted, and with --storage joins it from
    another machine. Writes best.yaml (a configuration of fogml train), sweep.json, sweep.html and
    sweep.config.yaml; the study itself is kept in --out unless --storage names a database.
    """
    from fogml.cli.sweep_job import SweepSettings, sweep_and_write
    from fogml.errors import InputError

    if sweep is not None and config is not None:
        raise InputError("CONFIG and --config are the same file; give one of them")
    settings = SweepSettings.gather(
        sweep or config,
        {
            "runs": runs,
            "test": test,
            "trials": trials,
            "workers": workers,
            "storage": storage,
            "name": name,
            "averaging": averaging,
            "repair": options.repairing(repair, repair_anyway),
            "out": str(out) if out else None,
            "seed": seed,
        },
    )
    sweep_and_write(settings, Terminal(as_json, quiet))
