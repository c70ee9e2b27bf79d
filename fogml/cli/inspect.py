"""``fogml inspect``: what is in a run."""

from __future__ import annotations

from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


@app.command()
def inspect(
    runs: Annotated[list[str] | None, typer.Argument(metavar="RUN...", help="Runs to look into.")] = None,
    repair: options.Repair = None,
    repair_anyway: options.RepairAnyway = None,
    strict: options.Strict = None,
    out: options.Out = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Say what is in a run: columns, span, gaps, soaks and ramps, faults.

    With --out, writes inspect.json, inspect.html and inspect.config.yaml.
    """
    from fogml.cli.inspect_job import InspectSettings, inspect_and_write

    settings = InspectSettings.gather(
        config,
        {
            "runs": runs,
            "repair": options.repairing(repair, repair_anyway),
            "strict": strict,
            "out": str(out) if out else None,
            "seed": seed,
        },
    )
    inspect_and_write(settings, Terminal(as_json, quiet))
