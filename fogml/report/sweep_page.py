"""The page of ``fogml sweep``: history, what mattered, Pareto set, and the winner judged once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from fogml.numerals import MISSING, averages, number, percent, plural
from fogml.report import figures_judgement, style
from fogml.report.page import Drawing, Tile, render
from fogml.report.style import log_axis
from fogml.report.tables import Row, Table, metrics_table
from fogml.report.verdict import seen_told, worst_run
from fogml.tuning.winner import DEFAULT
from fogml.validation.results import Judgement

_COSTS = {"bytes": "weights [byte]", "operations": "operations per sample"}
_MOST_PARAMETERS = 12


def history(study: Mapping[str, Any]) -> Drawing:
    """Held-out rms of each trial in the order begun, the best so far, and where trials were pruned."""
    trials = study["trials"]
    whole = [trial for trial in trials if trial["state"] == "complete"]
    pruned = [trial["number"] for trial in trials if trial["state"] == "pruned"]
    numbers, errors = [t["number"] for t in whole], np.array([t["rms"] for t in whole])
    figure = go.Figure()
    for place, model in enumerate(sorted({trial["model"] for trial in whole})):
        own = [trial for trial in whole if trial["model"] == model]
        x, y = [t["number"] for t in own], [t["rms"] for t in own]
        looks = style.SERIES[place % 7], style.MARKERS[place % 7], 8
        figure.add_trace(style.points(x, y, model, *looks, text=[t["features"] for t in own]))
    best = np.minimum.accumulate(errors)
    figure.add_trace(style.line(numbers, best, "best so far", style.BLACK, 1.5, line_shape="hv"))
    low, high = float(errors.min()), float(errors.max())
    axis = log_axis(low, max(high, 1.02 * low), room=0.12)
    if pruned:
        low_end, high_end = axis["range"]
        below = [10.0 ** (low_end + 0.03 * (high_end - low_end))] * len(pruned)
        figure.add_trace(style.points(pruned, below, "pruned or refused", style.PURPLE, "line-ns-open"))
    figure.update_xaxes(title_text="trial")
    figure.update_yaxes(title_text="held-out rms [deg/h], logarithmic", **axis)
    style.styled(figure, 400)
    return Drawing(
        figure,
        alt=f"Held-out rms of {plural(len(whole), 'trial')}; the best has {number(low)} deg/h.",
        caption=(
            f"Each trial's rms on {parts_held_out(study)}; their noise is in it. "
            "Ticks below: trials that were pruned or could not be fitted."
        ),
    )


def parts_held_out(study: Mapping[str, Any]) -> str:
    """What trials are judged on, with the averaging time, which is not that of a test run's figures."""
    seconds = study.get("held_out_averaging_s")
    return f"held-out {study['folds']}" + ("" if seconds is None else f", {averages(seconds)}")


def importance_bars(study: Mapping[str, Any]) -> Drawing | None:
    """Share of each parameter in what the error varies by; None where too few trials tell."""
    shares = dict(list(study["importance"].items())[:_MOST_PARAMETERS])
    if not shares:
        return None
    figure = go.Figure(
        go.Bar(
            x=[100.0 * share for share in shares.values()],
            y=list(shares),
            orientation="h",
            marker={"color": style.SKY_BLUE},
            text=[f"\u2002{percent(share, 0)}" for share in shares.values()],
            textposition="outside",
            cliponaxis=False,
        )
    )
    figure.update_xaxes(title_text="share of the error's variation [%]", range=[0, 105])
    figure.update_yaxes(autorange="reversed", showgrid=False)
    style.styled(figure, 110 + 30 * len(shares), bargap=0.35)
    told = "; ".join(f"{name} {percent(share, 0)}" for name, share in shares.items())
    return Drawing(
        figure,
        alt=f"What the held-out error varies by: {told}.",
        caption=(
            "By a random forest of the whole trials: how much worse it foretells the logarithm of the error "
            "when a parameter's values are exchanged among trials."
        ),
    )


def pareto_front(study: Mapping[str, Any]) -> Drawing:
    """Held-out rms against weights and against operations, the Pareto set joined, the winner marked."""
    trials = [trial for trial in study["trials"] if trial["state"] == "complete"]
    front = [study["trials"][place] for place in study["pareto"]]
    best = study["winner"]
    figure = make_subplots(rows=1, cols=2, shared_yaxes=True, horizontal_spacing=0.04)
    for column, (cost, title) in enumerate(_COSTS.items(), start=1):
        for name, some, colour, symbol, size in (
            ("other trials", trials, style.TRAINING, "circle", 6),
            ("in the Pareto set", front, style.BLUE, "diamond", 10),
        ):
            x, y = [max(t[cost], 1) for t in some], [t["rms"] for t in some]
            told = [f"{t['model']}: {t['features']}" for t in some]
            trace = style.points(x, y, name, colour, symbol, size, text=told, showlegend=column == 1)
            figure.add_trace(trace, 1, column)
        trace = style.ring([max(best[cost], 1)], [best["rms"]], "winner", 18, showlegend=column == 1)
        figure.add_trace(trace, 1, column)
        values = [max(t[cost], 1) for t in trials]
        axis = log_axis(min(values), max(*values, 1.2 * min(values)), room=0.1)
        figure.update_xaxes(title_text=f"{title}, logarithmic", **axis, row=1, col=column)
    errors = [trial["rms"] for trial in trials]
    axis = log_axis(min(errors), max(*errors, 1.02 * min(errors)), room=0.12)
    figure.update_yaxes(**axis)
    figure.update_yaxes(title_text="held-out rms [deg/h], logarithmic", row=1, col=1)
    style.styled(figure, 420)
    named = ", ".join(objective["name"] for objective in study["objectives"])
    return Drawing(
        figure,
        alt=f"Held-out rms against size and operations; {plural(len(front), 'trial')} in the Pareto set.",
        caption=(
            f"Pareto set: trials that no other is at least as good as in every objective ({named}). The "
            "winner is the default, or the best of those that beat it beyond noise."
        ),
    )


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
        verdict=verdict_sentences(study, judgement),
        tiles=_tiles(study, judgement),
        winner=_winner(study),
        history=history(study),
        importance=importance_bars(study),
        pareto=pareto_front(study),
        pareto_table=pareto_table(study),
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
    # Worse by less than the digits told is no difference.
    left = number(winner.get("bias_stability"))
    stays = "No trial beats the default polynomial beyond noise on the parts held out: it stays the winner."
    return [stays] * (winner.get("reference") == DEFAULT) + [
        f"The winner is worse than {against['reference']} on the parts held out: "
        f"{left} against {number(against['bias_stability'])} deg/h about each "
        f"run's mean, {'beyond' if against['beyond_noise'] else 'within'} noise."
        for against in winner.get("against", [])
        if against["winner_worse"] and number(against["bias_stability"]) != left
    ]


def _name(trial: Mapping[str, Any]) -> str:
    parameters = ", ".join(f"{key} {_plain(value)}" for key, value in trial["parameters"].items())
    text = f"{trial['model']} of {trial['features']}" if trial["features"] else "the training mean"
    return f"{text} ({parameters})" if parameters else text


def _plain(value: Any) -> str:
    return number(value) if isinstance(value, float) else str(value)


def verdict_sentences(study: Mapping[str, Any], judgement: Judgement | None) -> list[str]:
    """What won, on what, and what it leaves of the test runs."""
    counts, best = study["counts"], study["winner"]
    finished = counts["complete"] + counts["pruned"]
    sentences = [
        *standing(best),
        f"Of {plural(finished, 'trial')}, {_name(best)} wins: {number(best['rms'])} deg/h rms on "
        f"{parts_held_out(study)}, with {plural(best['bytes'], 'byte')} of weights.",
    ]
    if judgement is None:
        sentences.append("No test run was stated, so it is not judged yet.")
        return sentences
    worst = worst_run(judgement.test)
    sentences.append(
        f"Judged once, on {worst.run}, it leaves {number(worst.after.rms)} of {number(worst.before.rms)} "
        f"deg/h rms ({averages(worst.averaging_s)}); the noise floor is {number(worst.floor)} deg/h."
    )
    return [*sentences, *seen_told(judgement)]


def _tiles(study: Mapping[str, Any], judgement: Judgement | None) -> list[Tile]:
    counts, best = study["counts"], study["winner"]
    tiles = [
        Tile(
            "Trials", str(counts["complete"] + counts["pruned"]), "", f"{counts['pruned']} pruned or refused"
        ),
        Tile("Winner, held out", number(best["rms"]), "deg/h", f"rms on {parts_held_out(study)}"),
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


def pareto_table(study: Mapping[str, Any]) -> Table:
    """Trials that none beats in every objective, the winner marked."""
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
    columns = (
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
