"""The job of ``fogml plan``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from fogml.cli.terminal import Terminal
from fogml.cli.twin_commands import PlanSettings
from fogml.gap.planning.plan import plan_runs
from fogml.gap.planning.plan_result import Plan, plan_values, programme_file, simulation_file
from fogml.json_files import write_json
from fogml.numerals import short
from fogml.outputs import whole_folder
from fogml.runs.facts import Facts, facts_from
from fogml.twin.simulate import DEFAULT_FACTS
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin, twin_dict
from fogml.yaml_text import yaml_text


def plan_and_write(settings: PlanSettings, terminal: Terminal) -> Plan:
    """Plan, write ``programme.yaml``, ``plan.json`` and ``plan.html``, and print what is expected."""
    twin = load_twin(settings.twin)
    place = facts_from({"latitude": settings.latitude, "input_axis": settings.input_axis or "up"}, "settings")
    facts = DEFAULT_FACTS.model_copy(update={"latitude": place.latitude, "input_axis": place.input_axis})
    family = settings.family()
    with whole_folder(settings.out) as folder:
        with terminal.work("planning") as work:
            plan = plan_runs(
                twin,
                settings.want,
                separate=settings.separate,
                hours=family.hours,
                criterion=settings.criterion,  # type: ignore[arg-type]
                runs=settings.runs,
                limits=family.limits,
                facts=facts,
                mountings=None if settings.input_axis else ("up", "north"),
                power_steps=family.power_steps,
                lab=family.lab,
                columns=settings.columns or None,
                seed=settings.seed,
                rehearsed=True,
                progress=work.doing,
            )
        values = plan_values(plan)
        _write(folder, settings, twin, plan, values)
    _print(values, terminal)
    terminal.result(values)
    terminal.say(f"Written to {settings.out}: open {Path(settings.out) / 'plan.html'}")
    return plan


def _write(folder: Path, settings: PlanSettings, twin: Twin, plan: Plan, values: dict[str, Any]) -> None:
    from fogml.report.plan_page import plan_page

    full = settings.in_full()
    # A simulation has the heat that was planned with, and records what the plan counts on.
    same = plan.acting.plant == twin.plant
    acting = full.twin if same else twin_dict(replace(twin, plant=plan.acting.plant))
    common = {"twin": acting} | ({"columns": settings.columns} if settings.columns else {})
    for place, run in enumerate(plan.runs):
        (folder / programme_file(place)).write_text(run.programme.as_yaml(), encoding="utf-8")
        simulation = _simulation(place, run.facts, common)
        (folder / simulation_file(place)).write_text(simulation, encoding="utf-8")
    write_json(folder / "plan.json", values)
    (folder / "plan.html").write_text(plan_page(values), encoding="utf-8")
    full.write_into(folder, "plan")


def _simulation(place: int, facts: Facts, common: Mapping[str, Any]) -> str:
    """A configuration of ``fogml simulate`` that runs a programme with the plan's set-up."""
    values = {
        "schema": "fogml.simulate/1",
        "programme": programme_file(place),
        "facts": facts.as_dict(),
        **common,
    }
    head = f"# Rehearse it with  fogml simulate {simulation_file(place)} --out run.csv\n"
    return head + yaml_text(values)


def _print(values: dict[str, Any], terminal: Terminal) -> None:
    from fogml.report.plan_page import planned_rehearsal, verdict_sentences, wanted_table

    for run in values["runs"]:
        terminal.say(f"{run['programme']}: {short(run['hours'])} h, {run['summary']}")
    terminal.say(" ".join(verdict_sentences(values)))
    terminal.show(wanted_table(values), "Expected standard errors")
    terminal.show(planned_rehearsal(values), "What a diagnosis of these runs would name")
    for text in values["assumed"]:
        terminal.note(f"assumed: {text}")
