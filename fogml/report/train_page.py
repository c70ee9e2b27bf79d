"""The page of ``fogml train``: a model fitted on some runs, judged on others, at one look."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fogml.numerals import against, averages, listed, number, percent, plural, stated, unit_of
from fogml.report import figures_judgement, style
from fogml.report.page import Drawing, Tile, render
from fogml.report.tables import (
    Table,
    beside_table,
    candidates_table,
    coefficients_table,
    columns_of,
    metrics_table,
    noticed,
    repeatability_table,
    runs_table,
)
from fogml.report.verdict import (
    advice_words,
    does_harm,
    model_card,
    stated_limits,
    subject,
    unseen,
    unsettled,
    verdict,
    worst_run,
)
from fogml.validation.advice import advice_on, which_to_use
from fogml.validation.results import Judgement, RunJudgement


def train_page(
    judgement: Judgement, navigation: Mapping[str, Any] | None = None, documentation: str | None = None
) -> str:
    """The self-contained HTML page of a judgement.

    Parameters
    ----------
    judgement
        As :func:`fogml.validation.judge.judge` gives it.
    documentation
        The block of text for a firmware file, where the model has a compact form.
    navigation
        What the drift costs a navigator, as :func:`fogml.lab.navigation.navigation_costs` gives it.
    """
    name = subject(judgement)
    return render(
        "train.html",
        title=f"{name} – drift model judged",
        name=name,
        judgement=judgement,
        advice=advice_words(advice_on(judgement)),
        verdict=verdict(judgement),
        limits=stated_limits(judgement),
        tiles=headline_tiles(judgement),
        sections=[_section(index, run, judgement) for index, run in enumerate(judgement.test, start=1)],
        test_table=runs_table(judgement.test),
        beside=beside_table(judgement),
        which=which_to_use(judgement)[1],
        repeatability=repeatability_table(judgement.repeatability),
        unseen=unseen(judgement),
        train_table=runs_table(
            judgement.train,
            ", on the runs that the model was fitted to: how well it was fitted",
        ),
        card=model_card(judgement.model),
        coefficients=coefficients_table(judgement.model),
        candidates=candidates_table(judgement.model),
        train_findings=[(run.run, noticed(run.findings)) for run in judgement.train if run.findings],
        notes=_notes(judgement),
        unit_of=unit_of,
        # Of each test run the recorded drift as a figure, a constant one as a table.
        navigation=[
            (run["run"], navigation_figure(run, navigation["latitude_deg"]), _table(run, navigation))
            for run in navigation["test"]
        ]
        if navigation
        else [],
        documentation=documentation,
    )


def headline_tiles(judgement: Judgement) -> list[Tile]:
    """Before, after, floor and improvement of the worst test run."""
    worst = worst_run(judgement.test)
    over = averages(worst.averaging_s)
    on = f"{worst.run}, {over}" if len(judgement.test) > 1 else over
    ratio = worst.before.rms / worst.after.rms if worst.after.rms > 0 else float("inf")
    gain = (
        f"{number(ratio, 2)} × smaller" if ratio >= 1 else f"{number(1 / ratio, 2)} × larger" if ratio else ""
    )
    tiles = [
        Tile("Rms before", number(worst.before.rms), "deg/h", on),
        Tile("Rms after", number(worst.after.rms), "deg/h", gain, "missed" if does_harm(worst) else ""),
        Tile("Bias stability after", number(worst.after.bias_stability), "deg/h", over),
        Tile("Noise floor", number(worst.floor), "deg/h", over),
        Tile("Outside training", percent(worst.outside_training), "", "of the samples judged"),
    ]
    index = judgement.design_index
    if index is not None:
        tiles.append(
            Tile(
                "Design index",
                against(index.value, index.limit),
                "deg/h",
                f"{'✓ met' if index.met else '✗ not met'}, limit {stated(index.limit)}",
                "met" if index.met else "missed",
            )
        )
    return tiles


def _section(index: int, judged: RunJudgement, judgement: Judgement) -> dict[str, Any]:
    """What the page shows of one test run."""
    return {
        "judged": judged,
        "anchor": f"test-{index}",
        "in_time": figures_judgement.drift_in_time(judged, judgement.model.get("interval")),
        "against_temperature": (
            figures_judgement.drift_against_temperature(judged, judgement.train)
            if figures_judgement.has_temperature(judged.series)
            else None
        ),
        "by_regime": figures_judgement.rms_by_regime(judged),
        "metrics": metrics_table(judged),
        "findings": noticed(judged.findings),
        "left_out": " ".join(filter(None, (_left_out(judged), unsettled(judged)))),
    }


def _left_out(judged: RunJudgement) -> str:
    if not judged.rows_left_out:
        return ""
    share = judged.rows_left_out / (judged.rows_used + judged.rows_left_out)
    return (
        f"{plural(judged.rows_left_out, 'sample')} ({percent(share)}) left out: the features' windows were "
        "not full there, or the turntable was changing its rate."
    )


def _notes(judgement: Judgement) -> list[str]:
    """Every note once: the judgement's, the model's, then the runs', with the names of those it holds for."""
    by_note: dict[str, list[str]] = {}
    of_runs = set()
    for run in (*judgement.train, *judgement.test):
        for note in run.notes:
            # Some notes begin with the run's name already.
            bare = note.removeprefix(f"{run.run}: ")
            of_runs.add(f"{run.run}: {bare}")
            by_note.setdefault(bare, []).append(run.run)
    told = [*judgement.notes, *(note for note in judgement.model.get("notes", ()) if note not in of_runs)]
    told += [f"{listed(list(dict.fromkeys(names)))}: {note}" for note, names in by_note.items()]
    return list(dict.fromkeys(str(note) for note in told))


SHOWN_AXIS = "north"
"""Of the recorded drift's figure: a north gyro's drift takes a navigator furthest in a day."""


def navigation_figure(run: Mapping[str, Any], latitude_deg: float) -> Drawing:
    """Position and heading of a navigator at rest, driven by the drift before and after compensation."""
    figure = style.stacked({"position error [km]": 1.0, "heading error [deg]": 1.0}, "time [h]", 0.08)
    hours = np.asarray(run["time_h"])
    last: dict[str, float] = {}
    for when, colour, dash in (("before", style.BEFORE, "dot"), ("after", style.AFTER, "solid")):
        told = run[when][SHOWN_AXIS]
        looks = colour, 2, dash
        figure.add_trace(style.line(hours, told["position_km"], when, *looks), 1, 1)
        figure.add_trace(style.line(hours, told["heading_deg"], None, *looks, showlegend=False), 2, 1)
        last[when] = told["position_km"][-1]
    style.styled(figure, 480)
    return Drawing(
        figure,
        alt=(
            f"Errors of a navigator at rest whose {SHOWN_AXIS} gyro drifts as in {run['run']}: after "
            f"{number(float(hours[-1]))} h the position is off by {number(last['before'])} km before and "
            f"{number(last['after'])} km after compensation."
        ),
        caption=(
            f"The recorded drift ({averages(run['averaging_s'])}, floor {number(run['floor'])} deg/h) as "
            f"that of the {SHOWN_AXIS} gyro, the others perfect, undamped, latitude {latitude_deg:g}°, no "
            "error at the start. Dotted: before, solid: after compensation."
        ),
    )


def _table(run: Mapping[str, Any], costs: Mapping[str, Any]) -> Table:
    rows = []
    for axis in costs["axes"]:
        for kind, unit in (("position_km", "km"), ("heading_deg", "deg")):
            cells = [
                f"{number(before)} → {number(after)}".replace(" × ", "\u00a0×\u00a0")
                for before, after in zip(
                    run["constant"]["before"][axis][kind], run["constant"]["after"][axis][kind], strict=True
                )
            ]
            rows.append((f"{axis} gyro, {kind.partition('_')[0]}", unit, *cells))
    before, after = (run["constant"][when] for when in ("before", "after"))
    return Table(
        columns=(
            *columns_of("Constant drift of | Unit"),
            *((f"{hours:g} h", "", "figure pair") for hours in costs["hours"]),
        ),
        rows=rows,
        caption=(
            f"Largest error until then, before → after, for a constant drift of the rms: "
            f"{number(before['drift_deg_h'])} → {number(after['drift_deg_h'])} deg/h. A gyrocompass "
            f"alignment with an east gyro that drifts so is off by "
            f"{number(before['gyrocompass_heading_deg'])} → {number(after['gyrocompass_heading_deg'])} deg."
        ),
    )
