"""``fogml plan``: programmes that make wanted parameters identifiable."""

from __future__ import annotations

from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS)


@app.command()
def plan(
    want: Annotated[
        list[str] | None,
        typer.Option(
            "--want",
            metavar="EFFECT|CONSTANT",
            help="Effect, nominal constant (k1), or EFFECT.PARAMETER to be known; may be repeated.",
        ),
    ] = None,
    separate: Annotated[
        list[str] | None,
        typer.Option(
            "--separate",
            metavar="A,B",
            help="Effects to be told apart; one alone is to be shown; repeatable.",
        ),
    ] = None,
    hours: Annotated[
        float | None, typer.Option("--hours", metavar="HOURS", help="Longest time of a run (24).")
    ] = None,
    criterion: Annotated[
        str | None,
        typer.Option(
            "--criterion",
            metavar="D|A",
            help="D: volume of the confidence ellipsoid (default); A: mean square of the standard errors.",
        ),
    ] = None,
    number: Annotated[
        int | None, typer.Option("--runs", metavar="N", help="How many runs, planned in turn (1).")
    ] = None,
    twin: Annotated[
        str | None, typer.Option("--twin", metavar="TWIN", help="Twin file, or one that ships (nominal).")
    ] = None,
    coldest: Annotated[
        float | None, typer.Option("--coldest", metavar="DEGC", help="Lowest temperature (-40).")
    ] = None,
    hottest: Annotated[
        float | None, typer.Option("--hottest", metavar="DEGC", help="Highest temperature (60).")
    ] = None,
    input_axis: Annotated[
        str | None,
        typer.Option(
            "--input-axis",
            metavar="WAY",
            help="up, down, north ...: the mounting; up or north is tried else.",
        ),
    ] = None,
    latitude: Annotated[
        float | None, typer.Option("--latitude", metavar="DEG", help="Of the lab (39.9).")
    ] = None,
    power_steps: Annotated[
        bool | None,
        typer.Option("--power-steps/--no-power-steps", help="Whether the unit's power may be switched."),
    ] = None,
    out: options.Out = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Programmes that make wanted parameters identifiable, with expected standard errors.

    Searches rates, limits, soaks, a minor loop, table rates, power steps, fan and yaw. Writes
    programme.yaml for fogml simulate, plan.json, plan.html and plan.config.yaml.
    """
    from fogml.cli.plan_job import PlanSettings, plan_and_write

    settings = PlanSettings.gather(
        config,
        {
            "want": want,
            "separate": separate,
            "hours": hours,
            "criterion": criterion,
            "runs": number,
            "twin": twin,
            "coldest": coldest,
            "hottest": hottest,
            "input_axis": input_axis,
            "latitude": latitude,
            "power_steps": power_steps,
            "out": str(out) if out else None,
            "seed": seed,
        },
    )
    plan_and_write(settings, Terminal(as_json, quiet))
