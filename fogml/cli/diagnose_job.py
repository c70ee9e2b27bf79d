"""The job of ``fogml diagnose``; runs of several units share causes and have a folder each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from fogml.cli.from_diagnosis import not_compensated, with_brought
from fogml.cli.lab_settings import family_of
from fogml.cli.runs import Check, no_check, open_noise, open_runs
from fogml.cli.terminal import Terminal
from fogml.cli.twin_commands import DiagnoseSettings
from fogml.errors import InputError
from fogml.fleet.manifest import folder_names
from fogml.gap.diagnosis import diagnose
from fogml.gap.model import TwinModel
from fogml.gap.own_simulator import ByColumn, by_column, has_column
from fogml.gap.result import Diagnosis
from fogml.gap.units import UnitsDiagnosis, diagnose_units
from fogml.json_files import finite_json, write_json
from fogml.numerals import listed, probability_words, unit_words, with_error
from fogml.outputs import whole_folder
from fogml.runs.columns import REPLAYED
from fogml.runs.run import Run
from fogml.twin.twin_file import load_twin


def _diagnose_several(
    settings: DiagnoseSettings,
    model: TwinModel,
    runs: Sequence[Run],
    held_out: Sequence[Run],
    noise: Run | None,
    tell: Callable[[str], None],
) -> UnitsDiagnosis:
    """The diagnosis of several units.

    Raises
    ------
    InputError
        If a rehearsal is asked for, or as `fogml.gap.units.diagnose_units`.
    """
    if settings.rehearse:
        raise InputError("--rehearse: of one unit at a time; these runs are of several")
    return diagnose_units(
        model,
        runs,
        held_out,
        noise=[noise] if noise else [],
        without=settings.without,
        seed=settings.seed,
        cost_of_false_name=settings.cost_of_false_name,
        progress=tell,
    )


def write_several(
    folder: Path,
    found: UnitsDiagnosis,
    model: TwinModel,
    write: Callable[[Path, Diagnosis], None],
) -> None:
    """``units.json``, its page, and for each unit a folder with what a diagnosis of it alone writes."""
    from fogml.report.axes_page import units_page

    names = folder_names(list(found.by_unit))
    values = finite_json(found.as_dict() | {"folders": dict(zip(found.by_unit, names))})
    write_json(folder / "units.json", values)
    (folder / UNITS_PAGE).write_text(units_page(values, _words(found)), encoding="utf-8")
    for name, own in zip(names, found.by_unit.values()):
        (folder / name).mkdir()
        write(folder / name, own)
        own.write_model(model, folder / name / "twin.yaml")


def print_several(found: UnitsDiagnosis, terminal: Terminal) -> None:
    """Each unit's verdict, and what is shared."""
    for unit, words in _words(found).items():
        terminal.say(f"{unit}: {words}; fitted: {_used(found.by_unit[unit])}")
    for line in found.lines():
        terminal.say(line)


def _used(found: Diagnosis) -> str:
    """The runs that were fitted, and those held out."""
    return listed(found.fit) + ("" if found.held_out_is_part else f"; held out: {listed(found.held_out)}")


def _words(found: UnitsDiagnosis) -> dict[str, str]:
    """Each unit's verdict and what is named."""
    told = {}
    for unit, own in found.by_unit.items():
        named = (
            ", ".join(f"{f.effect} ({probability_words(f.probability)})" for f in own.named)
            or "nothing named"
        )
        told[unit] = f"{own.verdict.replace('_', ' ')}; {named}"
    return told


NEXT_RUN = "next-run.yaml"
"""The programme of a run that would tell more, for ``fogml simulate``."""
UNITS_PAGE = "units.html"
"""The page that leads to those of several units."""
WHAT_IF = "what-if.html"
"""The page on which the sizes of effects are moved."""


def diagnose_and_write(
    settings: DiagnoseSettings, terminal: Terminal, check: Check = no_check
) -> Diagnosis | UnitsDiagnosis:
    """Diagnose, write ``gap.json``, ``gap.html`` and ``twin.yaml``, and print the verdict.

    Of runs of several units each has them in a folder of its own, beside ``units.json`` and its page. `check`
    is called with the runs before they are diagnosed.
    """
    both = sorted(set(settings.runs) & set(settings.held_out))
    if both:
        raise InputError(f"{', '.join(both)}: both a fit run and held out; hold out another run")
    model, family = TwinModel(load_twin(settings.twin)), family_of(settings.lab)
    with whole_folder(settings.out) as folder:
        runs = open_runs(settings.runs, terminal, repair=settings.repair, beside=settings.held_out)
        held_out = open_runs(settings.held_out, terminal, repair=settings.repair, beside=settings.runs)
        check((*runs, *held_out))
        noise = open_noise(settings.noise, terminal, (*runs, *held_out), repair=settings.repair)
        recorded, kept_back = runs, held_out
        column = _column(settings, model, runs, held_out, terminal)
        if column is not None:
            model, runs, held_out = column.model, column.fit, column.held_out
        if len({run.facts.unit for run in runs if run.facts.unit}) > 1:
            with terminal.work("diagnosing") as work:
                several = _diagnose_several(settings, model, runs, held_out, noise, work.doing)
                work.doing("writing")
                write_several(folder, several, model, write_gap)
                settings.write_into(folder, "diagnose")
            print_several(several, terminal)
            terminal.result(several.as_dict())
            terminal.say(f"Written to {settings.out}: open {Path(settings.out) / UNITS_PAGE}")
            return several
        with terminal.work("diagnosing") as work:
            found = diagnose(
                model,
                runs,
                held_out,
                noise=noise,
                without=settings.without,
                seed=settings.seed,
                plan=settings.next_run,
                family=family,
                rehearsed=settings.rehearse,
                cost_of_false_name=settings.cost_of_false_name,
                courses=True,
                progress=work.doing,
            )
            work.doing("compensating")
            found = with_brought(found, recorded, kept_back, noise)
            found = found if column is None else column.shown(found)
            work.doing("writing")
            write_gap(folder, found)
            settings.write_into(folder, "diagnose")
            used = {run.name for run in runs} - {name for name, _ in found.unusable}
            told = found.write_model(model, folder / "twin.yaml", [run for run in runs if run.name in used])
    _print(found, terminal)
    for said in told:
        terminal.say(f"{said}.")
    terminal.result(found.as_dict())
    terminal.say(
        f"Written to {settings.out}: open {Path(settings.out) / 'gap.html'}, and {WHAT_IF} to try sizes"
    )
    return found


def _column(
    settings: DiagnoseSettings, model: TwinModel, runs: list[Run], held_out: list[Run], terminal: Terminal
) -> ByColumn | None:
    """What takes the twin's place where the runs say themselves what a simulator gives for them."""
    if not any(REPLAYED in run.columns for run in (*runs, *held_out)):
        return None
    if settings.twin != "nominal":
        terminal.note(f"the runs' column 'replayed' is not used: --twin {settings.twin} replays them")
        return None
    return by_column(model.twin, runs, held_out) if has_column([*runs, *held_out]) else None


def write_gap(folder: Path, found: Diagnosis) -> None:
    """``gap.json``, its page, that of what-ifs, and the programme of a further run."""
    from fogml.report.gap_page import gap_page

    write_json(folder / "gap.json", found.as_dict())
    (folder / "gap.html").write_text(gap_page(found), encoding="utf-8")
    if found.counterfactuals:
        from fogml.report.gap_page import counterfactual_page

        (folder / WHAT_IF).write_text(counterfactual_page(found), encoding="utf-8")
    if found.separating_run is not None:
        (folder / NEXT_RUN).write_text(found.separating_run.programme, encoding="utf-8")


def _print(found: Diagnosis, terminal: Terminal) -> None:
    from fogml.report.gap_tables import how_far_table
    from fogml.report.gap_tables_ahead import compensation_table, rehearsal_table
    from fogml.report.gap_words import titles

    terminal.say(f"Fitted: {_used(found)}")
    terminal.say(f"Verdict: {found.verdict.replace('_', ' ')}")
    if found.found:
        rows = [
            [
                f.effect,
                ", ".join([*f.others, *(f"{m} (left out)" for m in f.left_out)]) or "–",
                probability_words(f.probability),
                f"{with_error(f.amplitude.value, f.amplitude.se)} {unit_words(f.amplitude.unit)}",
            ]
            for f in found.found
        ]
        terminal.table("Effects found", ["effect", "can't be told from", "probability", "amplitude"], rows)
    for f in found.suspected:
        terminal.say(
            f"Suspected, and not sure enough to be named: {' or '.join(f.members)} "
            f"({probability_words(f.probability)})"
        )
    if found.unknown.probability >= 0.05:
        likely = probability_words(found.unknown.probability)
        terminal.say(f"Unknown: probability {likely}; {found.unknown.looks_like}")
    if found.how_far:
        terminal.show(how_far_table(found))
    names = titles(found)
    if (brought := found.compensation) is not None:
        if brought.note:
            terminal.say(f"What compensation would bring is not known: {brought.note}")
        terminal.show(compensation_table(found, names))
        for said in not_compensated(brought) if brought.held_out else ():
            terminal.say(f"{said[0].upper()}{said[1:]}.")
        if brought.held_out and brought.counted:
            terminal.say("Such a model: fogml train RUN... --test RUN --from-diagnosis DIR")
    if (run := found.separating_run) is not None:
        verb = "would show" if run.aim == "show" else "would tell apart"
        terminal.say(f"Next: a programme of {run.hours:.1f} h {verb} {', '.join(run.separates)}: {NEXT_RUN}")
    for said in found.headline:
        terminal.say(said)
    terminal.show(rehearsal_table(found.rehearsal, names), "What these runs would name")
    if found.held_out_is_part:
        terminal.say("No run was held out: the last stretch of the last run was kept back for the figures.")
    for name, reason in found.unusable:
        terminal.note(f"{name} not used: {reason}")
