"""``fogml lab``: procedures of a laboratory: misalignment, tests on a rate table, north seeking."""

from __future__ import annotations

from typing import Annotated

import typer

from fogml.cli import options
from fogml.cli.terminal import Terminal

app = typer.Typer(**options.APP_SETTINGS, no_args_is_help=True)


@app.callback()
def lab() -> None:
    """Procedures of a laboratory: misalignment, tests on a rate table, north seeking."""


@app.command()
def misalignment(
    file: Annotated[
        str | None,
        typer.Argument(
            metavar="FILE",
            help="Table with state, tilt [deg], rate [deg/s], output [unit], and segment or time.",
        ),
    ] = None,
    cross_tilt: Annotated[
        bool | None,
        typer.Option(
            "--cross-tilt/--no-cross-tilt",
            help="Fit a constant over the tilts for a fixture tilted across (where the data show one).",
        ),
    ] = None,
    state_angles: Annotated[
        str | None,
        typer.Option(
            "--state-angles",
            metavar="DEG,...",
            help="Turn of the gyro in its mounting plane in states 1 to 4, clockwise as seen from +z "
            "(0,180,270,90), where FILE has no column state_angle [deg].",
        ),
    ] = None,
    out: options.Out = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Scale factor and input-axis misalignment, decoupled over four mounting states.

    In state 2 the gyro is turned clockwise in its mounting plane, seen from +z, by 180 deg, for state 3 by 90
    deg more, for state 4 by 180 deg more; other turns are stated. Turns the data contradict are an error.
    With --out, writes misalignment.json, misalignment.html and lab-misalignment.config.yaml.
    """
    from fogml.cli.lab_misalignment_job import MisalignmentSettings, misalignment_and_write

    settings = MisalignmentSettings.gather(
        config,
        {
            "file": file,
            "cross_tilt": cross_tilt,
            "state_angles": state_angles,
            "out": str(out) if out else None,
            "seed": seed,
        },
    )
    misalignment_and_write(settings, Terminal(as_json, quiet))


@app.command()
def rate(
    runs: Annotated[
        list[str] | None,
        typer.Argument(metavar="RUN...", help="Runs on a rate table, with the column rate as commanded."),
    ] = None,
    twin: Annotated[
        str | None, typer.Option("--twin", metavar="NAME|FILE", help="Test a twin in place of recorded runs.")
    ] = None,
    greatest: Annotated[
        float | None,
        typer.Option("--greatest", metavar="DEG/S", help="With --twin: greatest rate tested (500)."),
    ] = None,
    noise: Annotated[
        bool | None,
        typer.Option("--noise/--no-noise", help="With --twin: its noise too; else its effects alone."),
    ] = None,
    settle: Annotated[
        float | None,
        typer.Option("--settle", metavar="S", help="Left out at the begin of each rate (2 samples)."),
    ] = None,
    answers: Annotated[
        float | None,
        typer.Option("--answers", metavar="SHARE", help="Share of the expected output that counts (0.5)."),
    ] = None,
    dead: Annotated[
        float | None,
        typer.Option("--dead", metavar="SHARE", help="Share of the expected change that is dead (0.1)."),
    ] = None,
    range_error: Annotated[
        float | None,
        typer.Option("--range-error", metavar="SHARE", help="Deviation that ends the range (0.01)."),
    ] = None,
    small: Annotated[
        float | None,
        typer.Option("--small", metavar="SHARE", help="Of the greatest rate: rates about zero (0.02)."),
    ] = None,
    repair: options.Repair = None,
    repair_anyway: options.RepairAnyway = None,
    out: options.Out = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Scale factor, range, threshold, dead zone, resolution, bandwidth, slew, temperature sensitivity.

    From runs that hold any of the tests, or of a twin (--twin; synthetic). With --out, writes rate.json,
    rate.html and lab-rate.config.yaml.
    """
    from fogml.cli.lab_rate_job import RateSettings, rate_and_write

    settings = RateSettings.gather(
        config,
        {
            "runs": runs,
            "twin": twin,
            "greatest": greatest,
            "noise": noise,
            "settle": settle,
            "answers": answers,
            "dead": dead,
            "range_error": range_error,
            "small": small,
            "repair": options.repairing(repair, repair_anyway),
            "out": str(out) if out else None,
            "seed": seed,
        },
    )
    rate_and_write(settings, Terminal(as_json, quiet))


@app.command()
def north(
    positions: Annotated[
        str | None,
        typer.Option(
            "--positions", metavar="FILE", help="A run with a column position, 1 to 4, or the table's angle."
        ),
    ] = None,
    azimuth: Annotated[
        float | None, typer.Option("--azimuth", metavar="DEG", help="Simulate a seek at this azimuth.")
    ] = None,
    latitude: Annotated[float | None, typer.Option("--latitude", metavar="DEG", help="Latitude.")] = None,
    dwell: Annotated[float | None, typer.Option("--dwell", metavar="S", help="In a position (60).")] = None,
    transfer: Annotated[
        float | None, typer.Option("--transfer", metavar="S", help="Time to the next position (0).")
    ] = None,
    drift: Annotated[
        float | None, typer.Option("--drift", metavar="DEG/H/H", help="Linear drift of the bias.")
    ] = None,
    transient: Annotated[
        list[str] | None,
        typer.Option("--transient", metavar="DEG/H,S", help="Exponential from power-on; may be repeated."),
    ] = None,
    start: Annotated[
        float | None, typer.Option("--start", metavar="S", help="Begin of the seek after power-on (0).")
    ] = None,
    random_walk: Annotated[
        float | None, typer.Option("--noise", metavar="DEG/SQRT(H)", help="Angle random walk, for se.")
    ] = None,
    sense: Annotated[
        str | None, typer.Option("--sense", metavar="cw|ccw", help="Way the positions are taken (cw).")
    ] = None,
    order: Annotated[
        str | None, typer.Option("--order", metavar="DEG,...", help="Angles of the positions (0,90,180,270).")
    ] = None,
    way: Annotated[
        str | None,
        typer.Option(
            "--way", metavar="NAME", help="plain, drift-observing, palindrome, coarse-fine (plain)."
        ),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            "--method", metavar="NAME", help="With --positions: auto, plain, drift-observing (auto)."
        ),
    ] = None,
    settle: Annotated[
        float | None,
        typer.Option("--settle", metavar="S", help="With --positions: left out at each begin (0)."),
    ] = None,
    coarse: Annotated[
        float | None, typer.Option("--coarse", metavar="S", help="Time in a coarse position (6).")
    ] = None,
    repair: options.Repair = None,
    repair_anyway: options.RepairAnyway = None,
    out: options.Out = None,
    seed: options.Seed = None,
    config: options.Config = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """North from several positions, and what a drift does to it: the error, and where it is nothing.

    Either from a recorded run (--positions) or simulated (--azimuth and --latitude). With --out, writes
    north.json, north.html and lab-north.config.yaml.
    """
    from fogml.cli.lab_north_job import NorthSettings, north_and_write

    settings = NorthSettings.gather(
        config,
        {
            "positions": positions,
            "azimuth": azimuth,
            "latitude": latitude,
            "dwell": dwell,
            "transfer": transfer,
            "drift": drift,
            "transients": transient,
            "start": start,
            "noise": random_walk,
            "sense": sense,
            "order": order,
            "way": way,
            "method": method,
            "settle": settle,
            "coarse": coarse,
            "repair": options.repairing(repair, repair_anyway),
            "out": str(out) if out else None,
            "seed": seed,
        },
    )
    north_and_write(settings, Terminal(as_json, quiet))
