"""``fogml simulate``: a synthetic run from a programme and a twin."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


@app.command()
def simulate(
    simulation: Annotated[
        Path | None, typer.Argument(metavar="CONFIG", help="YAML file of schema fogml.simulate/1.")
    ] = None,
    programme: Annotated[
        str | None, typer.Option("--programme", metavar="NAME|FILE", help="Chamber and table programme.")
    ] = None,
    twin: Annotated[str | None, typer.Option("--twin", metavar="NAME|FILE", help="The twin.")] = None,
    sample_s: Annotated[
        float | None, typer.Option("--sample", metavar="SECONDS", help="Sample interval (1).")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Run to write: .csv or .parquet.")] = None,
    truth: Annotated[
        Path | None,
        typer.Option("--truth", help="File for the truth of nodes and effects: .csv or .parquet."),
    ] = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """A synthetic run from a programme and a twin.

    It is written block by block. The run holds what was recorded; --truth keeps every node and every
    effect's contribution apart.
    Samples in which the unit is off are not recorded.
    """
    from fogml.cli.simulate_job import SimulateSettings, simulate_and_write
    from fogml.errors import InputError

    if simulation is not None and config is not None:
        raise InputError("CONFIG and --config are the same file; give one of them")
    settings = SimulateSettings.gather(
        simulation or config,
        {
            "programme": programme,
            "twin": twin,
            "sample_s": sample_s,
            "out": str(out) if out else None,
            "truth": str(truth) if truth else None,
            "seed": seed,
        },
    )
    simulate_and_write(settings, Terminal(as_json, quiet))
