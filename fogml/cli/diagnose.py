"""``fogml diagnose``: where the gap lies, which effect causes it, how far it closes."""

from __future__ import annotations

from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


@app.command()
def diagnose(
    runs: Annotated[list[str] | None, typer.Argument(metavar="RUN...", help="Runs to fit on.")] = None,
    held_out: Annotated[
        list[str] | None,
        typer.Option("--held-out", metavar="RUN", help="Run for the final figure; may be repeated."),
    ] = None,
    noise: Annotated[
        str | None, typer.Option("--noise", metavar="RUN", help="Static run of the unit, for its noise.")
    ] = None,
    twin: Annotated[
        str | None, typer.Option("--twin", metavar="TWIN", help="Twin file, or one that ships (nominal).")
    ] = None,
    without: Annotated[
        list[str] | None,
        typer.Option("--without", metavar="EFFECT", help="Effect that is no candidate; may be repeated."),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            "--method",
            metavar="METHOD",
            help="'diagnosis', or 'families': each effect in whatever form its family has (diagnosis).",
        ),
    ] = None,
    cost: Annotated[
        float | None,
        typer.Option(
            "--cost-of-false-name",
            metavar="RATIO",
            help="Of 'families': a false name costs so many times what a missed one does (1).",
        ),
    ] = None,
    rehearse: Annotated[
        bool | None,
        typer.Option("--rehearse", help="Of 'families': what these runs would name of each candidate."),
    ] = None,
    repair: options.Repair = None,
    repair_anyway: options.RepairAnyway = None,
    out: options.Out = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Where the gap between twin and recordings lies, which effect causes it, how far it closes.

    Writes gap.json, gap.html, twin.yaml (the twin with the effect added), diagnose.config.yaml and, where a
    further run would tell more, next-run.yaml (its programme, for fogml simulate).
    """
    from fogml.cli.diagnose_job import DiagnoseSettings, diagnose_and_write

    settings = DiagnoseSettings.gather(
        config,
        {
            "runs": runs,
            "held_out": held_out,
            "noise": noise,
            "twin": twin,
            "without": without,
            "method": method,
            "cost_of_false_name": cost,
            "rehearse": rehearse,
            "repair": options.repairing(repair, repair_anyway),
            "out": str(out) if out else None,
            "seed": seed,
        },
    )
    diagnose_and_write(settings, Terminal(as_json, quiet))
