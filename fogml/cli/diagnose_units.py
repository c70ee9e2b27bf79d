"""``fogml diagnose`` on runs of several units: causes shared, a folder for each unit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from fogml.cli.diagnose import DiagnoseSettings
from fogml.cli.terminal import Terminal
from fogml.errors import InputError
from fogml.fleet.manifest import folder_names
from fogml.gap.model import TwinModel
from fogml.gap.result import Diagnosis
from fogml.gap.units import UnitsDiagnosis, diagnose_units
from fogml.json_files import write_json
from fogml.runs.run import Run


def of_several_units(runs: Sequence[Run]) -> bool:
    """Whether the runs to fit on are of more than one unit."""
    return len({run.facts.unit for run in runs if run.facts.unit}) > 1


def diagnose_several(
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
    """``units.json``, and for each unit a folder with what a diagnosis of it alone would write."""
    names = folder_names(list(found.by_unit))
    write_json(folder / "units.json", found.as_dict() | {"folders": dict(zip(found.by_unit, names))})
    for name, own in zip(names, found.by_unit.values()):
        (folder / name).mkdir()
        write(folder / name, own)
        own.write_model(model, folder / name / "twin.yaml")


def print_several(found: UnitsDiagnosis, terminal: Terminal) -> None:
    """Each unit's verdict, and what is shared."""
    for unit, own in found.by_unit.items():
        named = ", ".join(f"{f.effect} ({f.probability:.2f})" for f in own.named) or "nothing named"
        terminal.say(f"{unit}: {own.verdict.replace('_', ' ')}; {named}")
    for line in found.lines():
        terminal.say(line)
