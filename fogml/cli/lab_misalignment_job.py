"""The job of ``fogml lab misalignment``."""

from __future__ import annotations

import math
from typing import Any

from fogml.cli.lab import MisalignmentSettings
from fogml.cli.lab_outputs import say_where, tell
from fogml.cli.terminal import Terminal, number
from fogml.errors import InputError
from fogml.json_files import finite_json
from fogml.lab.misalignment_input import read_measurements
from fogml.lab.misalignment_json import misalignment_json


def misalignment_and_write(settings: MisalignmentSettings, terminal: Terminal) -> None:
    """Find scale factor and misalignment, write them where a folder is named, and print them."""
    if not settings.file:
        raise InputError("no file is given; name the table of turns and rests")
    file = settings.file

    def make() -> dict[str, Any]:
        with terminal.work(f"reading {file}"):
            measured = read_measurements(file, settings.state_angles)
            return finite_json(misalignment_json(measured, settings.cross_tilt))

    def page(values: dict[str, Any]) -> str:
        from fogml.report import misalignment_page

        return misalignment_page(values)

    values = tell("misalignment", make, page, settings.in_full(), settings.out, terminal)
    _print(values, terminal)
    terminal.result(values)
    say_where("misalignment", settings.out, terminal)


def _print(values: dict[str, Any], terminal: Terminal) -> None:
    se, intervals = values["se"], values["intervals"]
    rows = [
        [label, *_figures(values[key], se.get(key), intervals.get(key)), unit]
        for label, key, unit in (
            ("scale factor K", "K", values["unit"]),
            ("delta x", "delta_x_deg", "deg"),
            ("delta y", "delta_y_deg", "deg"),
            ("delta", "delta_deg", "deg"),
        )
    ]
    fixture_se = se.get("fixture_error_deg", [None, None])
    for axis, value, error in zip("xy", values["fixture_error_deg"], fixture_se, strict=True):
        rows.append([f"fixture error {axis}", *_figures(value, error, None), "deg"])
    level = f"{values['level']:.0%}"
    terminal.table(
        f"{values['source']}: scale factor and misalignment, four states"
        + (" (synthetic data)" if values["synthetic"] else ""),
        ["quantity", "value", "standard error", f"{level} from", "to", "unit"],
        rows,
    )
    rows = [
        [
            m["name"],
            f"{m['K']:.9g}",
            *(number(m[key]) for key in ("K_difference_ppm", "delta_x_deg", "delta_y_deg")),
        ]
        for m in values["methods"]
    ]
    header = ["method", f"K [{values['unit']}]", "K less four states [ppm]", "delta x [deg]", "delta y [deg]"]
    terminal.table("Methods on the same turns", header, rows)
    for note in values["notes"]:
        terminal.say(note)


def _figures(value: float, error: float | None, ends: list[float] | None) -> list[str]:
    """Value, standard error and interval, to the first digit of the standard error."""
    places = 6 if not error else max(-math.floor(math.log10(error)), 0)
    told = [f"{end:.{places}f}" for end in ends] if ends else ["–", "–"]
    return [f"{value:.{places}f}", "–" if error is None else f"{error:.2g}", *told]
