"""``fogml replay``: a twin's output for a run's inputs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


@app.command()
def replay(
    twin: Annotated[
        str | None, typer.Argument(metavar="TWIN", help="A twin file, or the name of one that ships.")
    ] = None,
    run: Annotated[str | None, typer.Argument(metavar="RUN", help="The run whose inputs to take.")] = None,
    only: Annotated[
        str | None, typer.Option("--only", metavar="EFFECT", help="The difference that one effect makes.")
    ] = None,
    truth: Annotated[
        str | None, typer.Option("--truth", help="Truth of a simulated run, in place of its columns.")
    ] = None,
    after: Annotated[
        list[str] | None,
        typer.Option(
            "--after",
            metavar="RUN",
            help="The unit's run before, whose memory goes on; may be repeated. Each states 'started'.",
        ),
    ] = None,
    storage_temperature: Annotated[
        float | None,
        typer.Option("--storage-temperature", metavar="DEGC", help="Where the unit was between runs (25)."),
    ] = None,
    repair: options.Repair = None,
    repair_anyway: options.RepairAnyway = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="File to write: .csv or .parquet.")] = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """A twin's output for a run's inputs, or what one effect changes.

    The output is the one without noise. The file written holds the run's columns and 'replayed [deg/h]'.
    """
    from fogml.cli.replay_job import ReplaySettings, replay_and_write

    settings = ReplaySettings.gather(
        config,
        {
            "twin": twin,
            "run": run,
            "only": only,
            "truth": truth,
            "after": after,
            "storage_temperature": storage_temperature,
            "repair": options.repairing(repair, repair_anyway),
            "out": str(out) if out else None,
            "seed": seed,
        },
    )
    replay_and_write(settings, Terminal(as_json, quiet))
