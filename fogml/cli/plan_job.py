"""The job of ``fogml plan``."""

from __future__ import annotations

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
from fogml.twin.twin_file import load_twin
from fogml.yaml_text import yaml_text


def plan_and_write(settings: PlanSettings, terminal: Terminal) -> Plan:
    """Plan, write ``programme.yaml``, ``plan.json`` and ``plan.html``, and print what is expected."""
    twin = load_twin(settings.twin)
    place = facts_from({"latitude": settings.latitude, "input_axis": settings.input_axis or "up"}, "settings")
    facts = DEFAULT_FACTS.model_copy(update={"latitude": place.latitude, "input_axis": place.input_axis})
    with whole_folder(settings.out) as folder:
        with terminal.work("planning") as work:
            plan = plan_runs(
                twin,
                settings.want,
                separate=settings.separate,
                hours=settings.hours,
                criterion=settings.criterion,  # type: ignore[arg-type]
                runs=settings.runs,
                limits=(settings.coldest, settings.hottest),
                facts=facts,
                mountings=None if settings.input_axis else ("up", "north"),
                power_steps=settings.power_steps,
                seed=settings.seed,
                rehearsed=True,
                progress=work.doing,
            )
        values = plan_values(plan)
        _write(folder, settings, plan, values)
    _print(values, terminal)
    terminal.result(values)
    terminal.say(f"Written to {settings.out}: open {Path(settings.out) / 'plan.html'}")
    return plan


def _write(folder: Path, settings: PlanSettings, plan: Plan, values: dict[str, Any]) -> None:
    from fogml.report.plan_page import plan_page

    full = settings.in_full()
    for place, run in enumerate(plan.runs):
        (folder / programme_file(place)).write_text(run.programme.as_yaml(), encoding="utf-8")
        simulation = _simulation(place, full.twin, run.facts)
        (folder / simulation_file(place)).write_text(simulation, encoding="utf-8")
    write_json(folder / "plan.json", values)
    (folder / "plan.html").write_text(plan_page(values), encoding="utf-8")
    full.write_into(folder, "plan")


def _simulation(place: int, twin: str, facts: Facts) -> str:
    """A configuration of ``fogml simulate`` that runs a programme with the plan's set-up."""
    values = {
        "schema": "fogml.simulate/1",
        "programme": programme_file(place),
        "twin": twin,
        "facts": facts.as_dict(),
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
