"""The page of ``fogml sweep``: history, what mattered, Pareto set, and the winner judged once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fogml.report import figures_judgement
from fogml.report.figures_sweep import history, importance_bars, pareto_front
from fogml.report.page import Tile, render
from fogml.report.tables import Row, Table, columns_of, metrics_table
from fogml.report.verdict import worst_run
from fogml.report.words import MISSING, averages, number, plural
from fogml.tuning.references import DEFAULT
from fogml.validation.results import Judgement

_MOST_ROWS = 30


def sweep_page(study: Mapping[str, Any], judgement: Judgement | None = None) -> str:
    """The self-contained HTML page of a ``sweep.json``.

    Parameters
    ----------
    study
        Schema ``fogml.study/1``.
    judgement
        The winner on the test runs; None where there are none.
    """
    worst = worst_run(judgement.test) if judgement is not None else None
    return render(
        "sweep.html",
        title=f"{study['study']} – sweep",
        study=study,
        verdict=_verdict(study, judgement),
        tiles=_tiles(study, judgement),
        winner=_winner(study),
        history=history(study),
        importance=importance_bars(study),
        pareto=pareto_front(study),
        pareto_table=_pareto_table(study),
        judged=[] if judgement is None else [(run.run, metrics_table(run)) for run in judgement.test],
        in_time=None
        if worst is None or judgement is None
        else figures_judgement.drift_in_time(worst, judgement.model.get("interval")),
        refused=_refused(study),
        notes=[] if judgement is None else [str(note) for note in judgement.notes],
    )


def standing(winner: Mapping[str, Any]) -> list[str]:
    """Sentences that say first that nothing beats the default, and what the winner is worse than on the
    parts held out."""
    stays = "No trial beats the default polynomial beyond noise on the parts held out: it stays the winner."
    return [stays] * (winner.get("reference") == DEFAULT) + [
        f"The winner is worse than {against['reference']} on the parts held out: "
        f"{number(winner['bias_stability'])} against {number(against['bias_stability'])} deg/h about each "
        f"run's mean, {'beyond' if against['beyond_noise'] else 'within'} noise."
        for against in winner.get("against", [])
        if against["winner_worse"]
    ]


def _name(trial: Mapping[str, Any]) -> str:
    parameters = ", ".join(f"{key} {_plain(value)}" for key, value in trial["parameters"].items())
    text = f"{trial['model']} of {trial['features']}" if trial["features"] else "the training mean"
    return f"{text} ({parameters})" if parameters else text


def _plain(value: Any) -> str:
    return number(value) if isinstance(value, float) else str(value)


def _verdict(study: Mapping[str, Any], judgement: Judgement | None) -> list[str]:
    counts, best = study["counts"], study["winner"]
    finished = counts["complete"] + counts["pruned"]
    sentences = [
        *standing(best),
        f"Of {plural(finished, 'trial')}, {_name(best)} wins: {number(best['rms'])} deg/h rms on held-out "
        f"{study['folds']}, with {plural(best['bytes'], 'byte')} of weights.",
    ]
    if judgement is None:
        sentences.append("No test run was stated, so it is not judged yet.")
        return sentences
    worst = worst_run(judgement.test)
    sentences.append(
        f"Judged once, on {worst.run}, it leaves {number(worst.after.rms)} of {number(worst.before.rms)} "
        f"deg/h rms ({averages(worst.averaging_s)}); the noise floor is {number(worst.floor)} deg/h."
    )
    return sentences


def _tiles(study: Mapping[str, Any], judgement: Judgement | None) -> list[Tile]:
    counts, best = study["counts"], study["winner"]
    tiles = [
        Tile(
            "Trials", str(counts["complete"] + counts["pruned"]), "", f"{counts['pruned']} pruned or refused"
        ),
        Tile("Winner, held out", number(best["rms"]), "deg/h", f"rms on held-out {study['folds']}"),
        Tile("Weights", str(best["bytes"]), "byte", f"{best['operations']} operations per sample"),
    ]
    if judgement is not None:
        worst = worst_run(judgement.test)
        over = averages(worst.averaging_s)
        tiles += [
            Tile("Rms before", number(worst.before.rms), "deg/h", f"test run, {over}"),
            Tile(
                "Rms after",
                number(worst.after.rms),
                "deg/h",
                f"test run, {over}",
                "" if worst.after.rms <= worst.before.rms else "missed",
            ),
            Tile("Noise floor", number(worst.floor), "deg/h", over),
        ]
    return tiles


def _winner(study: Mapping[str, Any]) -> list[tuple[str, str]]:
    best = study["winner"]
    rows = [
        ("model", best["model"]),
        ("features", best["features"] or MISSING),
        *((name, _plain(value)) for name, value in best["parameters"].items()),
        ("trial", str(best["number"])),
        ("trained on", ", ".join(study["train"])),
        ("study", f"{study['study']} in {study['storage']}"),
    ]
    return rows


def _pareto_table(study: Mapping[str, Any]) -> Table:
    rows = []
    for place in study["pareto"][:_MOST_ROWS]:
        trial = study["trials"][place]
        name = f"{_name(trial)} – {trial['reference']}" if trial.get("reference") else _name(trial)
        cells = (
            name,
            number(trial["rms"], 4),
            number(trial.get("bias_stability"), 4),
            str(trial["bytes"]),
            str(trial["operations"]),
        )
        rows.append(Row(cells, "chosen" if trial["number"] == study["winner"]["number"] else ""))
    columns = columns_of(
        "Model | >Held-out rms [deg/h] | >About each run's mean [deg/h] | >Weights [byte] | "
        ">Operations [per sample]"
    )
    return Table(columns, rows, "The Pareto set, the least error first.")


def _refused(study: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Reasons why trials could not be fitted, each once."""
    told: dict[str, str] = {}
    for trial in study["trials"]:
        if trial["reason"] and not trial["reason"].startswith("beaten"):
            told.setdefault(trial["reason"], f"trial {trial['number']}")
    return [(name, reason) for reason, name in told.items()]
