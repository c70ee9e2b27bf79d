"""``fogml compensate``: apply a model to a run of any length."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


@app.command()
def compensate(
    run: Annotated[str | None, typer.Argument(metavar="RUN", help="The run to compensate.")] = None,
    model: Annotated[str | None, typer.Option("--model", help="Folder of the model: DIR/model.")] = None,
    any_unit: options.AnyUnit = None,
    repair: options.Repair = None,
    repair_anyway: options.RepairAnyway = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="File to write: .csv or .parquet.")] = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Apply a model to a run of any length, in bounded memory.

    The file written holds the run's columns and 'drift [deg/h]', 'gyro_compensated [deg/h]' and
    'flag': 0 good, 1 outside what the model was trained on, 2 window not full (the static part).
    """
    from fogml.cli.compensate_job import CompensateSettings, compensate_and_write

    settings = CompensateSettings.gather(
        config,
        {
            "run": run,
            "model": model,
            "any_unit": any_unit,
            "repair": options.repairing(repair, repair_anyway),
            "out": str(out) if out else None,
            "seed": seed,
        },
    )
    compensate_and_write(settings, Terminal(as_json, quiet))
