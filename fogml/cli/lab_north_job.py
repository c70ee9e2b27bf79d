"""The job of ``fogml lab north``."""

from __future__ import annotations

from typing import Any

from fogml.cli.lab import WAYS, NorthSettings
from fogml.cli.lab_outputs import say_where, tell
from fogml.cli.runs import open_run
from fogml.cli.terminal import Terminal, number
from fogml.errors import InputError, known_are
from fogml.json_files import finite_json
from fogml.lab.north import Drift, Scheme, check_sense, horizontal_rate
from fogml.lab.north_json import recorded_north_json, simulated_north_json
from fogml.report.words import duration


def north_and_write(settings: NorthSettings, terminal: Terminal) -> None:
    """Find north in a recorded run or in a simulation, write it where a folder is named, and print it."""
    _check(settings)

    def make() -> dict[str, Any]:
        return finite_json(_recorded(settings, terminal) if settings.positions else _simulated(settings))

    def page(values: dict[str, Any]) -> str:
        from fogml.report import north_page

        return north_page(values)

    values = tell("north", make, page, settings.in_full(), settings.out, terminal)
    _print(values, terminal)
    terminal.result(values)
    say_where("north", settings.out, terminal)


def _check(settings: NorthSettings) -> None:
    check_sense(settings.sense)
    if settings.positions and settings.azimuth is not None:
        raise InputError("--positions and --azimuth: one is recorded, the other simulated; give one of them")
    if settings.latitude is not None:
        horizontal_rate(settings.latitude)
    if settings.positions:
        return
    if settings.azimuth is None or settings.latitude is None:
        raise InputError("give a run with --positions, or --azimuth and --latitude for a simulation")
    if abs(settings.azimuth) > 1e6 or settings.azimuth != settings.azimuth:
        raise InputError(f"azimuth {settings.azimuth:g} deg: a finite number is needed")
    if not 0.0 <= settings.noise < float("inf"):
        raise InputError(f"noise {settings.noise:g} deg/sqrt(h): a finite number, not negative, is needed")
    if settings.way not in WAYS:
        raise InputError(f"no way '{settings.way}'; {known_are(settings.way, WAYS)}")


def _recorded(settings: NorthSettings, terminal: Terminal) -> dict[str, Any]:
    assert settings.positions
    with terminal.work(f"reading {settings.positions}"):
        run = open_run(settings.positions, repair=settings.repair)
    return recorded_north_json(
        run,
        sense=settings.sense,
        order_deg=tuple(settings.order),
        method=settings.method,
        settle_s=settings.settle,
        latitude_deg=settings.latitude,
    )


def _simulated(settings: NorthSettings) -> dict[str, Any]:
    assert settings.azimuth is not None and settings.latitude is not None
    scheme = Scheme(
        tuple(settings.order), settings.sense, settings.dwell, settings.transfer, start_s=settings.start
    )
    return simulated_north_json(
        scheme,
        settings.azimuth,
        settings.latitude,
        Drift(settings.drift, tuple(settings.transients)),
        way=settings.way,
        coarse_dwell_s=settings.coarse,
        random_walk_deg_sqrt_h=settings.noise,
    )


def _print(values: dict[str, Any], terminal: Terminal) -> None:
    se = f" ± {number(values['se'])}" if values["se"] is not None else ""
    if values["kind"] == "recorded":
        terminal.say(f"{values['source']}: azimuth {values['azimuth_deg']:.5f}{se} deg ({values['method']})")
        drift, drift_se = values["drift_deg_h_per_h"], values["drift_se"]
        if drift is not None:
            terminal.say(f"linear drift {number(drift)} ± {number(drift_se)} deg/h per h")
            terminal.say(f"a plain seek is off by {number(values['error_deg'])} deg for it")
    else:
        terminal.say(
            f"simulated at {values['true_azimuth_deg']:g} deg: found {values['azimuth_deg']:.5f}{se} deg "
            f"({values['way']}), error {number(values['error_deg'])} deg"
        )
        rows = [
            [
                name,
                *(
                    number(told[key])
                    for key in ("dwell_s", "error_deg", "greatest_error_deg", "rms_error_deg", "rms_se")
                ),
            ]
            for name, told in values["ways"].items()
        ]
        header = [
            "way",
            "dwell [s]",
            "error here [deg]",
            "greatest [deg]",
            "rms [deg]",
            "se of noise, rms [deg]",
        ]
        terminal.table(f"Ways to spend {duration(values['duration_s'])}", header, rows)
    azimuths = [", ".join(f"{a:.2f}" for a in values[f"{k}_azimuth_deg"]) for k in ("quiet", "worst")]
    quiet, worst = (f"{told} deg" if told else "none" for told in azimuths)
    terminal.say(f"quiet azimuths {quiet}; worst {worst}")
    for note in values["notes"]:
        terminal.say(note)
