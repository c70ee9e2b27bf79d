"""The jobs of ``fogml lab``: misalignment, rate, north, acceptance, batch."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fogml.cli.lab import (
    WAYS,
    AcceptanceSettings,
    BatchSettings,
    MisalignmentSettings,
    NorthSettings,
    RateSettings,
)
from fogml.cli.runs import Check, no_check, open_each, open_model, open_noise, open_run, open_runs, tell
from fogml.cli.terminal import Terminal
from fogml.errors import InputError, known_are
from fogml.lab.misalignment_input import read_measurements
from fogml.lab.misalignment_json import misalignment_json
from fogml.lab.north import Drift, Scheme, check_sense, horizontal_rate
from fogml.lab.north_json import recorded_north_json, simulated_north_json
from fogml.lab.rate_json import rate_json
from fogml.lab.rate_tests import Criteria
from fogml.lab.rate_words import verdict_sentences

if TYPE_CHECKING:
    from fogml.models.base import DriftModel


def misalignment_and_write(settings: MisalignmentSettings, terminal: Terminal) -> None:
    """Find scale factor and misalignment, write them where a folder is named, and print them."""
    file = str(settings.file)

    def make() -> dict[str, Any]:
        with terminal.work(f"reading {file}"):
            return misalignment_json(read_measurements(file, settings.state_angles), settings.cross_tilt)

    page = "fogml.report.misalignment_page:misalignment_page"
    tell("lab misalignment", settings, terminal, make, page, _print_misalignment)


def _print_misalignment(values: dict[str, Any], terminal: Terminal) -> None:
    from fogml.report.misalignment_page import methods_table, result_table

    synthetic = " (synthetic data)" if values["synthetic"] else ""
    title = f"{values['source']}: scale factor and misalignment, four states{synthetic}"
    terminal.show(result_table(values), title)
    terminal.show(methods_table(values), "Methods on the same turns")
    for note in values["notes"]:
        terminal.say(note)


def rate_and_write(settings: RateSettings, terminal: Terminal) -> None:
    """Read the tests on a rate table, write them where a folder is named, and print them."""
    page = "fogml.report.rate_page:rate_page"
    tell("lab rate", settings, terminal, lambda: _values(settings, terminal), page, _print_rate)


def _values(settings: RateSettings, terminal: Terminal) -> dict[str, Any]:
    criteria = Criteria(
        answers=settings.answers,
        dead=settings.dead,
        range_error=settings.range_error,
        small=settings.small,
    )
    if settings.twin is None:
        with terminal.work("reading"):
            runs = open_each(settings.runs, repair=settings.repair)
        source = ", ".join(run.name for run in runs)
        return rate_json(runs, source=source, settle_s=settings.settle, criteria=criteria)
    from fogml.lab.rate_programmes import rate_runs
    from fogml.twin.twin_file import load_twin

    twin = load_twin(settings.twin)
    with terminal.work(f"testing {twin.name}"):
        runs = rate_runs(twin, greatest_deg_s=settings.greatest, noise=settings.noise, seed=settings.seed)
        return rate_json(
            runs, source=f"Twin {twin.name}", settle_s=settings.settle, criteria=criteria, twin=twin
        )


def _print_rate(values: dict[str, Any], terminal: Terminal) -> None:
    from fogml.report.rate_page import result_table

    terminal.say(" ".join(verdict_sentences(values)))
    synthetic = " (synthetic data)" if values["synthetic"] else ""
    terminal.show(result_table(values), f"{values['source']}: tests on a rate table{synthetic}")
    _say_noticed(values, terminal)


def _say_noticed(values: dict[str, Any], terminal: Terminal) -> None:
    for note in values["notes"]:
        terminal.say(note)
    for finding in values.get("findings", ()):
        terminal.say(f"{finding['run']}: {finding['message']}")


def north_and_write(settings: NorthSettings, terminal: Terminal) -> None:
    """Find north in a recorded run or in a simulation, write it where a folder is named, and print it."""
    _check(settings)

    def make() -> dict[str, Any]:
        return _recorded(settings, terminal) if settings.positions else _simulated(settings)

    tell("lab north", settings, terminal, make, "fogml.report.north_page:north_page", _print_north)


def _check(settings: NorthSettings) -> None:
    check_sense(settings.sense)
    if settings.positions and settings.azimuth is not None:
        raise InputError("--positions and --azimuth: one is recorded, the other simulated; give one of them")
    if settings.latitude is not None:
        horizontal_rate(settings.latitude)
    if settings.positions:
        return
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


def _print_north(values: dict[str, Any], terminal: Terminal) -> None:
    from fogml.report.north_page import headline_tiles, verdict_sentences, ways_table

    terminal.say(" ".join(verdict_sentences(values)))
    terminal.tiles(headline_tiles(values))
    terminal.show(ways_table(values))
    azimuths = [", ".join(f"{a:.2f}" for a in values[f"{k}_azimuth_deg"]) for k in ("quiet", "worst")]
    quiet, worst = (f"{told} deg" if told else "none" for told in azimuths)
    terminal.say(f"quiet azimuths {quiet}; worst {worst}")
    _say_noticed(values, terminal)


def acceptance_and_write(settings: AcceptanceSettings, terminal: Terminal) -> bool:
    """Test a gyro's runs, write the report where a folder is named, print it; whether all limits are met."""
    from fogml.lab.acceptance import ACCEPTED, NO_LIMITS

    values = write_report(
        settings,
        terminal,
        lambda: None if settings.model is None else open_model(settings.model, terminal),
    )
    return values["verdict"] in (ACCEPTED, NO_LIMITS)


def write_report(
    settings: AcceptanceSettings,
    terminal: Terminal,
    model_of: Callable[[], DriftModel | None],
    check: Check = no_check,
) -> dict[str, Any]:
    """The report of the runs that are named, written where a folder is named, and printed.

    Parameters
    ----------
    settings, terminal
        As of the command.
    model_of
        Gives the drift model that the unit is used with, once limits are read.
    check
        Called with the runs before they are tested.
    """
    from fogml.lab.acceptance import acceptance_json
    from fogml.lab.acceptance_rows import read_limits

    def make() -> dict[str, Any]:
        limits = None if settings.limits is None else read_limits(settings.limits)
        # Runs of three gyros are told by reading them, before one model is looked for.
        runs = open_runs(settings.runs, terminal, repair=settings.repair, axis=settings.axis, drift=False)
        model = model_of()
        check(runs)
        noise = open_noise(settings.noise, terminal, runs, repair=settings.repair, axis=settings.axis)
        with terminal.work("testing"):
            return acceptance_json(
                runs,
                model,
                limits,
                averaging_s=settings.averaging,
                turn_on_band=settings.turn_on_band,
                noise=noise,
                date=settings.date,
            )

    def sheets(values: dict[str, Any], folder: Path) -> None:
        from fogml.report.spreadsheets import acceptance_spreadsheet

        acceptance_spreadsheet(values, folder / "acceptance.xlsx")

    page = "fogml.report.acceptance_page:acceptance_page"
    return tell("lab acceptance", settings, terminal, make, page, _print, sheets)


def _print(values: dict[str, Any], terminal: Terminal) -> None:
    from fogml.numerals import unit_words
    from fogml.report.acceptance_page import VERDICTS, figure_words, limit_words, named

    rows = []
    for row in values["rows"]:
        if row["tested"]:
            met = {True: "met", False: "NOT met", None: ""}[row["met"]]
            figures = [figure_words(row, "before"), figure_words(row, "after")]
            rows.append([row["name"], *figures, unit_words(row["unit"]), limit_words(row), met])
    terminal.table(
        f"{named(values)}: acceptance", ["quantity", "before", "after", "unit", "limit", "outcome"], rows
    )
    lacking = [row["name"] for row in values["rows"] if not row["tested"]]
    if lacking:
        terminal.say(f"Not tested: {', '.join(lacking)}")
    _, sign, words = VERDICTS[values["verdict"]]
    terminal.say(f"{sign} {words}: {'; '.join(values['reasons'])}")


def batch_and_write(settings: BatchSettings, terminal: Terminal) -> bool:
    """Gather reports, write the batch where a folder is named, print it; whether all are accepted."""
    from fogml.lab.acceptance import ACCEPTED
    from fogml.lab.batch import batch_json, read_reports, report_files

    def make() -> dict[str, Any]:
        home = None if settings.out is None else Path(settings.out)
        files, lacking = report_files(settings.reports)
        return batch_json(read_reports(files), home, lacking)

    def page(values: dict[str, Any]) -> str:
        from fogml.report.acceptance_page import batch_page

        return batch_page(values, settings.title)

    def sheets(values: dict[str, Any], folder: Path) -> None:
        from fogml.report.spreadsheets import batch_spreadsheet

        batch_spreadsheet(values, folder / "batch.xlsx")

    values = tell("lab batch", settings, terminal, make, page, _print_batch, sheets)
    return values["counts"][ACCEPTED] == len(values["units"]) and not values["without_report"]


def _print_batch(values: dict[str, Any], terminal: Terminal) -> None:
    from fogml.report.acceptance_page import distribution_table, verdict_sentences

    terminal.show(distribution_table(values))
    for sentence in (*verdict_sentences(values), *values["notes"]):
        terminal.say(sentence)
