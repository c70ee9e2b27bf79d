"""The page of ``fogml compare``: every model on the same split, the best first."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from fogml.numerals import MISSING, averages, listed, number, percent
from fogml.report import style
from fogml.report.page import Drawing, render
from fogml.report.style import log_axis, segments_of, shade, time_unit
from fogml.report.tables import Row, Table, columns_of
from fogml.report.verdict import floor_told, own_noise, seen_told, stated_limits, unseen, worst_run
from fogml.signals.drawn import drawn, gap_starts
from fogml.validation.advice import output_reasons
from fogml.validation.floors import made_worse
from fogml.validation.results import Judgement, RunJudgement

CHOOSER = "auto"
"""The model that chooses among the others on the training runs alone."""
_WITHIN = 1.02
"""Models whose rms differs by less than this are as good as each other on one test run."""


def compare_page(judgements: Mapping[str, Judgement], failed: Mapping[str, str] | None = None) -> str:
    """The self-contained HTML page of a comparison.

    Parameters
    ----------
    judgements
        By model name, all on the same runs; at least one.
    failed
        Model name to the reason why it could not be fitted or judged.
    """
    order = ranked(judgements)
    first = judgements[order[0]]
    best = [name for name in order if name not in BASELINES] or order
    shown = list(dict.fromkeys([*best[:3], *(name for name in (CHOOSER,) if name in judgements)]))
    runs = ", ".join(run.run for run in first.test)
    return render(
        "compare.html",
        title=f"{runs} – models compared",
        name=runs,
        verdict=_verdict(judgements, order),
        chosen=_chosen(judgements),
        test_runs=[run.run for run in first.test],
        unseen=unseen(first),
        train_runs=[run.run for run in first.train],
        averaging_s=first.test[0].averaging_s,
        table=models_table(judgements, order),
        runs_table=_runs_table(judgements, order) if len(first.test) > 1 else None,
        bars=rms_bars(judgements, order),
        residuals=residuals_in_time(judgements, shown, worst_run(first.test).run),
        failed=dict(failed or {}),
        notes=list(dict.fromkeys(first.notes)),
    )


def ranked(judgements: Mapping[str, Judgement]) -> list[str]:
    """Model names by the rms after on their worst test run, the smallest first."""

    def rms(name: str) -> float:
        value = worst_run(judgements[name].test).after.rms
        return value if math.isfinite(value) else math.inf

    return sorted(judgements, key=rms)


def _verdict(judgements: Mapping[str, Judgement], order: list[str]) -> list[str]:
    best = worst_run(judgements[order[0]].test)
    sentences = [
        *doubts_of(judgements[order[0]]),
        f"{order[0]} leaves least: rms {number(best.after.rms)} deg/h of {number(best.before.rms)} deg/h on "
        f"{best.run} ({averages(best.averaging_s)}); {floor_told(best)}.",
        own_noise(best),
    ]
    close = [
        name for name in order[1:] if worst_run(judgements[name].test).after.rms <= _WITHIN * best.after.rms
    ]
    if close:
        sentences.append(f"Within 2 % of it: {listed(close, 6)}.")
    if "mean" in judgements:
        least = worst_run(judgements["mean"].test).after.rms
        worst = {n: worst_run(judgements[n].test) for n in order if n not in BASELINES}
        harm = [n for n, run in worst.items() if made_worse(run, least, run.after.rms)]
        if harm:
            sentences.append(f"Worse than no drift model (mean): {listed(harm, 6)}.")
    return sentences


def doubts_of(judgement: Judgement) -> list[str]:
    """What makes the figures of every model doubtful, in sentences."""
    return [*dict.fromkeys(one.sentence for one in output_reasons(judgement)), *seen_told(judgement)]


def _chosen(judgements: Mapping[str, Judgement]) -> str:
    if CHOOSER not in judgements:
        return ""
    auto = judgements[CHOOSER]
    model = auto.model
    features = ", ".join(str(name) for name in model.get("features") or ()) or "no features"
    place = ranked(judgements).index(CHOOSER) + 1
    return (
        f"auto chose {model.get('kind')} ({features}) by folds of the training runs alone; on the test runs "
        f"it comes in place {place} of {len(judgements)}."
    )


def models_table(judgements: Mapping[str, Judgement], order: list[str]) -> Table:
    """What each model leaves on its worst test run, and what it costs."""
    with_limits = any(stated_limits(judgement) for judgement in judgements.values())
    rows = []
    for name in order:
        judgement = judgements[name]
        worst = worst_run(judgement.test)
        model = judgement.model
        cells = [
            name,
            number(worst.after.rms),
            number(worst.after.rms / worst.floor if worst.floor > 0 else None),
            number(worst.after.bias),
            number(worst.after.bias_stability),
            number(worst.after.range),
            percent(worst.outside_training),
            MISSING if model.get("parameters") is None else str(model["parameters"]),
            MISSING if model.get("bytes") is None else str(model["bytes"]),
        ]
        if with_limits:
            cells.append("✓ met" if judgement.met else "✗ not met")
        mark = "chosen" if name == CHOOSER else "baseline" if name in BASELINES else ""
        rows.append(Row(tuple(cells), mark))
    worst = worst_run(judgements[order[0]].test)
    columns = (
        "Model | >Rms [deg/h] | >Rms over floor | >Bias [deg/h] | >Bias stability [deg/h] | "
        ">Range [deg/h] | >Outside training | >Parameters | >Weights [byte]"
        + (" | Limits" if with_limits else "")
    )
    several = (
        ", the worst test run of each model" if len(judgements[order[0]].test) > 1 else f" on {worst.run}"
    )
    return Table(
        columns,
        rows,
        f"What is left{several}, {averages(worst.averaging_s)}. Noise floor {number(worst.floor)} deg/h.",
    )


def _runs_table(judgements: Mapping[str, Judgement], order: list[str]) -> Table:
    runs = judgements[order[0]].test
    rows = [Row(("noise floor", *(number(run.floor) for run in runs)), "baseline")]
    for name in order:
        by_run = {run.run: run.after.rms for run in judgements[name].test}
        cells = (name, *(number(by_run.get(run.run)) for run in runs))
        rows.append(Row(cells, "chosen" if name == CHOOSER else ""))
    return Table(
        (*columns_of("Model"), *((run.run, "deg/h", "figure") for run in runs)),
        rows,
        f"Rms after on each test run, {averages(runs[0].averaging_s)}.",
    )


BASELINES = ("none", "mean")
_MOST_SERIES = 4


def rms_bars(judgements: Mapping[str, Judgement], order: Sequence[str]) -> Drawing:
    """Rms of the worst test run per model as bars, each test run as a mark, and the floor."""
    worst = [max(run.after.rms for run in judgements[name].test) for name in order]
    stability = [max(run.after.bias_stability for run in judgements[name].test) for name in order]
    runs = judgements[order[0]].test
    floor = max(run.floor for run in runs)
    figure = go.Figure(
        go.Bar(
            x=worst,
            y=list(order),
            orientation="h",
            name="rms",
            text=[f"\u2002\u2002{number(value)}" for value in worst],
            textposition="outside",
            cliponaxis=False,
            marker={
                "color": [style.TRAINING if name in BASELINES else style.SKY_BLUE for name in order],
                "pattern": {"shape": ["/" if name in BASELINES else "" for name in order], "size": 5},
            },
        )
    )
    figure.add_trace(style.points(stability, list(order), "bias stability", style.BLACK, "diamond"))
    figure.add_vline(x=floor, line=style.FLOOR_LINE)
    figure.add_trace(style.floor_in_legend())
    # Bars have no zero on a logarithmic axis: they begin at a round number below everything.
    least = min((v for v in (floor, *worst, *stability) if v > 0), default=1.0)
    figure.update_xaxes(
        title_text="left on the worst test run [deg/h], logarithmic",
        **log_axis(0.5 * least, 1.3 * max(worst)),
    )
    figure.update_yaxes(autorange="reversed", showgrid=False)
    style.styled(figure, 130 + 30 * len(order), bargap=0.35)
    over = averages(runs[0].averaging_s)
    return Drawing(
        figure,
        alt=(
            f"What each model leaves, rms of {over}, the best first: "
            + "; ".join(f"{name} {number(value)} deg/h" for name, value in zip(order, worst, strict=True))
            + f". Noise floor {number(floor)} deg/h."
        ),
        caption=(
            over.capitalize()
            + (", each model's worst test run" if len(runs) > 1 else "")
            + f". Dashed: the noise floor, {number(floor)} deg/h. "
            "Hatched: the baselines without a drift model."
        ),
    )


def residuals_in_time(judgements: Mapping[str, Judgement], names: Sequence[str], run: str) -> Drawing:
    """What the named models leave of one test run, one panel each on the same scale."""
    shown: list[tuple[str, RunJudgement]] = []
    for name in names[:_MOST_SERIES]:
        shown += [(name, judged) for judged in judgements[name].test if judged.run == run]
    figure = make_subplots(
        rows=len(shown), cols=1, shared_xaxes=True, shared_yaxes="all", vertical_spacing=0.16 / len(shown)
    )
    for row, (name, judged) in enumerate(shown, start=1):
        series = judged.series
        per_unit, unit = time_unit(float(np.ptp(series.time)))
        x, y = drawn(series.time / per_unit, series.after, gaps=gap_starts(series.time))
        trace = style.line(x, y, name, style.SERIES[row - 1], 1.4, showlegend=False)
        figure.add_trace(trace, row=row, col=1)
        style.floor_lines(figure, judged.floor, row)
        figure.update_yaxes(title_text=f"{name}<br>[deg/h]", title_font_size=12, row=row, col=1)
    series = shown[0][1].series
    shade(figure, segments_of(series.time / per_unit, series.regime))
    figure.update_xaxes(title_text=f"time [{unit}]", row=len(shown), col=1)
    style.styled(figure, 130 + 130 * len(shown), margin={"t": 54})  # regimes' names below the tools
    left = [f"{name} {number(judged.after.rms)} deg/h" for name, judged in shown]
    first = shown[0][1]
    return Drawing(
        figure,
        alt=f"What is left of {run} in time, on one scale. Rms: {listed(left)}.",
        caption=(
            f"{run}: what is left, {averages(first.averaging_s)}, all on the same scale. "
            f"Dashed: the noise floor of ± {number(first.floor)} deg/h. Rms: {listed(left)}."
        ),
    )
