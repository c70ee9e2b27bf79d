"""``fogml import``: a logger's file into the run format."""

from __future__ import annotations

from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


@app.command("import")
def import_(
    file: Annotated[str | None, typer.Argument(metavar="FILE", help="The logger's file.")] = None,
    profile: Annotated[
        str | None, typer.Option("--profile", help="Name of a profile that ships, or a YAML file.")
    ] = None,
    axis: Annotated[str | None, typer.Option("--axis", help="One axis of the profile (all).")] = None,
    repair: options.Repair = None,
    repair_anyway: options.RepairAnyway = None,
    out: options.Out = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Bring a logger's file into the run format.

    Writes one run for each leg and axis, STEM[-LEG][-AXIS].csv, with its side file; with --repair one for
    each restart of the clock.
    """
    from fogml.cli.import_job import ImportSettings, import_and_write

    settings = ImportSettings.gather(
        config,
        {
            "file": file,
            "profile": profile,
            "axis": axis,
            "repair": options.repairing(repair, repair_anyway),
            "out": str(out) if out else None,
            "seed": seed,
        },
    )
    import_and_write(settings, Terminal(as_json, quiet))
