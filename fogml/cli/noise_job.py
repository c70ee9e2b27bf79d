"""The job of ``fogml noise``."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from fogml.cli.results import tell
from fogml.cli.run_commands import NoiseSettings
from fogml.cli.runs import check_named_once, open_run
from fogml.cli.terminal import Terminal, number
from fogml.errors import InputError
from fogml.report.words import duration
from fogml.runs.noise_of_run import noise_report
from fogml.runs.run import Run


def noise_and_write(settings: NoiseSettings, terminal: Terminal) -> None:
    """Tell the noise of a run, write it where an output folder is named, and print it."""
    if not settings.run:
        raise InputError("no run is given; name one")
    if settings.to is not None:
        from fogml.export.noise_parameters import check_target

        check_target(settings.to)

    def beside(values: dict[str, Any], folder: Path) -> None:
        for name, text in _for_others(settings, values):
            (folder / name).write_text(text, encoding="utf-8")

    def show(values: dict[str, Any], terminal: Terminal) -> None:
        _print(values, terminal)
        for name, text in _for_others(settings, values):
            terminal.say(f"{name}:\n{text}")

    make = partial(_noise, settings, terminal)
    tell("noise", settings, terminal, make, "fogml.report.noise_page:noise_page", show, beside)


def _for_others(settings: NoiseSettings, values: dict[str, Any]) -> list[tuple[str, str]]:
    """File name and text for the program that is asked for, if any is."""
    from fogml.export.noise_parameters import noise_text

    return [] if settings.to is None else [noise_text(values, settings.to)]


def _noise(settings: NoiseSettings, terminal: Terminal) -> dict[str, Any]:
    paths = [settings.run] if isinstance(settings.run, str) else list(settings.run or ())
    check_named_once(paths)
    with terminal.work(f"reading {paths[0]}") as work:
        runs = []
        for path in paths:
            work.doing(f"reading {path}")
            runs.append(open_run(path, repair=settings.repair, axis=settings.axis))
        work.doing("averaging")
        values = noise_report(runs, overlapping=settings.overlapping)
        if len(runs) == 1:
            values["floor"] = _floor(runs[0], values["taus_s"])
        return values


def _floor(run: Run, taus_s: Sequence[float]) -> dict[str, Any] | None:
    """The noise floor as drift models are held against, from their usual averaging time on."""
    from fogml.signals.averages import AVERAGING_S
    from fogml.validation.floors import floors_over

    longest = 0.5 * run.span_s
    times = [AVERAGING_S, *(tau for tau in taus_s if AVERAGING_S < tau <= longest)]
    found = floors_over(run, AVERAGING_S, times)
    if not found:
        return None
    return {
        "averaging_s": times,
        "value": [floor.value for floor in found],
        "ci": [[floor.lower, floor.upper] for floor in found],
        "unit": "deg/h",
        "source": found[0].source,
    }


def _print(values: dict[str, Any], terminal: Terminal) -> None:
    kind = "overlapping" if values["overlapping"] else "not overlapping"
    rows = [
        [f"{tau:.6g}", number(adev), number(low), number(high)]
        for tau, adev, (low, high) in zip(values["taus_s"], values["adev"], values["ci"], strict=True)
    ]
    level = f"{values['level']:.0%}"
    terminal.table(
        f"{values['run']}: Allan deviation, {kind}",
        ["tau [s]", "deviation [deg/h]", f"{level} from", "to"],
        rows,
    )
    rows = [
        [name, number(term["value"]), number(term["ci"][0]), number(term["ci"][1]), term["unit"]]
        for name, term in values["terms"].items()
    ]
    terminal.table("IEEE 952 terms", ["term", "value", f"{level} from", "to", "unit"], rows)
    if len(values["runs"]) > 1:
        rows = [
            [
                one["run"],
                *(number(one["terms"]["N"][key]) for key in ("value",)),
                *map(number, one["terms"]["N"]["ci"]),
            ]
            for one in values["runs"]
        ]
        terminal.table("N of each run alone [deg/sqrt(h)]", ["run", "N", f"{level} from", "to"], rows)
    floor = values.get("floor")
    if floor:
        low, high = floor["ci"][0]
        over = duration(floor["averaging_s"][0])
        terminal.say(
            f"noise floor of averages over {over}: {number(floor['value'][0])} deg/h "
            f"({level} from {number(low)} to {number(high)}), from {floor['source']}"
        )
    minimum = values["minimum"]
    terminal.say(f"minimum: {number(minimum['adev'])} deg/h at {duration(minimum['tau_s'])}")
    for text in (*values["notes"], *(finding["message"] for finding in values["findings"])):
        terminal.say(text)
