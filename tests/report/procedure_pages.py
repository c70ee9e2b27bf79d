"""Pages of studies, plans and the laboratory's procedures, with long serial numbers.

``data/plan.json`` and ``data/sweep.json`` are what `fogml plan` and `fogml sweep` wrote, shortened.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from experiments.results import html_page
from fogml.benchmark.rounds import DESIGN, RULES
from fogml.benchmark.score import DriftMark, diagnosis_figures, drift_figures
from fogml.blind.scoring.values import score_values
from fogml.cli.docs_job import manual_folder, manual_page, options_page
from fogml.pictures import Curve, line_figure
from fogml.report.axes_page import axes_page, units_page
from fogml.report.benchmark_page import benchmark_page
from fogml.report.blind_page import blind_page
from fogml.report.effect_card import catalogue_page, effect_page
from fogml.report.plan_page import plan_page
from fogml.report.sweep_page import sweep_page
from fogml.runs.run import Run
from fogml.twin.pictures import allan_curve, card_values, pictures, rate_curves
from fogml.twin.registry import effects
from fogml.validation.inspection import inspection_json
from fogml.validation.report_json import judgement_json
from tests.blind.test_parts import marks_of
from tests.lab.test_batch import SERIAL, report
from tests.report import test_lab_pages as lab
from tests.report.judgements import judgement
from tests.report.pages import noise_values, recorded_run

DATA = Path(__file__).parent / "data"


def written(name: str) -> dict:
    """The JSON that a command wrote."""
    return dict(json.loads((DATA / f"{name}.json").read_text(encoding="utf-8")))


def benchmark(
    serial: str, groups: tuple[str, str] = ("thermal cycle, MEMS", "synthetic, second reality")
) -> str:
    """Entries that help and that do harm, with intervals and without, one of a long name."""
    drift = {
        name: [
            DriftMark(f"{k:04d}", groups[k % 2], 2.0, 2.0 * left * (1.0 + 0.3 * (k % 3)), 0.05, *stated)
            for k in range(8)
        ]
        for name, left, stated in (
            ("auto", 0.3, (0.9, 1.5, 404)),
            (f"network of {serial}", 1.4, (None, None, None)),
        )
    }
    marks = marks_of(range(1, 41))
    return benchmark_page(
        {
            "version": "0.2.0",
            "round": {
                "seed": 7,
                "closed": False,
                "made_by": "0.2.0",
                "rules": list(RULES),
                "design": DESIGN.stated(),
                "handout_sha256": "0f" * 32,
            },
            "cases": {
                "drift": {k: {"group": groups[k % 2], "averaging_s": 100.0} for k in range(8)},
                "diagnosis": dict.fromkeys(range(40)),
            },
            "drift": {name: {"figures": drift_figures(own)} for name, own in drift.items()},
            "diagnosis": {name: {"figures": diagnosis_figures(own)} for name, own in marks.methods.items()},
        }
    )


def three_axes(serial: str) -> dict[str, str]:
    """The index pages of commands on a file of three gyros."""
    run = recorded_run()
    run = Run.derived(f"{serial}.csv", run.columns, run.facts.model_copy(update={"unit": serial}))
    trained = judgement_json(judgement(unit=serial, outside=0.1))
    models = {"models": dict.fromkeys(("auto", "multipoint-5-3"), trained)}
    told = {"train": trained, "inspect": inspection_json([run, run]), "compare": models}
    links = {axis: f"{axis}/report.html" for axis in "xyz"}
    return {
        f"axes of {command}": axes_page({"command": command, "axes": dict.fromkeys("xyz", values)}, links)
        for command, values in told.items()
    }


def experiment(serial: str) -> str:
    """A page of results with a drawing and a table."""
    curve = Curve(np.arange(3.0), np.arange(3.0), "#000")
    drawing = str(line_figure([curve], "T [°C]", "left [deg/h]", serial))
    table = f"| unit | left [deg/h] |\n|---|---|\n| {serial} | 0.1 |\n"
    return html_page(f"# Figures of {serial}\n\n![curve](curve.svg)\n\n{table}", {"curve": drawing})


def procedure_pages() -> dict[str, str]:
    """Name to HTML of each page."""
    shown = [effects()[id] for id in ("shupe_pure", "loop_gain")]
    drawn = [(card_values(one), *pictures(one), rate_curves(one), allan_curve(one)) for one in shown]
    links = {axis: f"{axis}/noise.html" for axis in "xyz"}
    serial = SERIAL.format(7)
    names = [SERIAL.format(place) for place in range(3)]
    size = {"value": 0.0312, "se": 0.0041}
    units = {
        "units": dict.fromkeys(names, "explained"),
        "folders": {name: name for name in names},
        "shared": [
            {
                "effect": effect,
                "probability": 0.93,
                "sizes": dict.fromkeys(names[:2], size),
                "mean": size,
                "spread": 0.002,
                "next_unit": [-0.21, 0.9],
                "unit": "deg/h",
            }
            for effect in ("thermal_hysteresis", "modulation_amplitude_error")
        ],
    }
    return {
        "sweep": sweep_page(written("sweep"), judgement()),
        "plan": plan_page(written("plan")),
        "units": units_page(units, dict.fromkeys(units["units"], "explained; loop_gain (0.91)")),
        "blind": blind_page(score_values(marks_of(range(1, 41)))),
        "benchmark": benchmark(serial),
        "effect": effect_page(drawn[0][0], [drawn[0][1]], *drawn[0][2:]),
        "catalogue": catalogue_page(drawn),
        "misalignment": lab.misalignment(),
        "north": lab.simulated(),
        "north of a recording": lab.recorded(),
        "rate": lab.rates(serial),
        "train with navigation": lab.trained(),
        **three_axes(serial),
        "manual": manual_page(manual_folder(), {"options": options_page()}),
        "experiment": experiment(serial),
        "axes": axes_page(
            {"command": "noise", "axes": {axis: noise_values() | {"run": f"{serial}.csv"} for axis in links}},
            links,
        ),
        "axes accepted": axes_page(
            {"command": "lab acceptance", "axes": {axis: report(7, 0.01) for axis in links}}, links
        ),
    }
