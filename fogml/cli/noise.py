"""``fogml noise``: Allan deviation and noise terms of a run."""

from __future__ import annotations

from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


@app.command()
def noise(
    runs: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="RUN...", help="A run, best at constant temperature; several share their terms."
        ),
    ] = None,
    overlapping: Annotated[
        bool | None, typer.Option("--overlapping/--not-overlapping", help="Kind of estimator (overlapping).")
    ] = None,
    repair: options.Repair = None,
    repair_anyway: options.RepairAnyway = None,
    out: options.Out = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Allan deviation and the IEEE 952 noise terms with intervals.

    With --out, writes noise.json, noise.html and noise.config.yaml.
    """
    from fogml.cli.noise_job import NoiseSettings, noise_and_write

    settings = NoiseSettings.gather(
        config,
        {
            "run": runs,
            "overlapping": overlapping,
            "repair": options.repairing(repair, repair_anyway),
            "out": str(out) if out else None,
            "seed": seed,
        },
    )
    noise_and_write(settings, Terminal(as_json, quiet))
