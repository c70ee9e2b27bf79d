"""The index page of ``fogml demo``: the axes side by side, with links to their pages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from plotly.subplots import make_subplots

from fogml.arrays import FloatArray
from fogml.numerals import MISSING, averages, listed, number
from fogml.report import style
from fogml.report.page import Drawing, render
from fogml.report.tables import Table, columns_of
from fogml.report.verdict import advice_words, worst_run
from fogml.signals.drawn import DRAWN_POINTS, min_max_indices
from fogml.validation.advice import advice_on
from fogml.validation.results import AveragedSeries, Judgement


def index_page(
    judgements: Mapping[str, Judgement],
    links: Mapping[str, str] | None = None,
    *,
    title: str = "Demonstration",
    beside: Mapping[str, Mapping[str, Judgement]] | None = None,
) -> str:
    """The self-contained HTML page that leads to one page per axis.

    Parameters
    ----------
    judgements
        By axis.
    links
        Axis to the address of its page; ``x/report.html`` and so on where not given.
    title
        Heading.
    beside
        Name of another model to its judgements by axis, on the same runs; shown in the table.
    """
    links = links or {axis: f"{axis}/report.html" for axis in judgements}
    found = {axis: _loop(judgement) for axis, judgement in judgements.items()}
    told = dict.fromkeys(
        str(note)
        for judgement in judgements.values()
        for note in (*judgement.notes, *(n for run in (*judgement.train, *judgement.test) for n in run.notes))
    )
    return render(
        "index.html",
        title=f"fogml – {title}",
        name=title,
        verdict=_verdict(judgements, found),
        links=[
            (axis, links[axis], _words(judgement), advice_words(advice_on(judgement)))
            for axis, judgement in judgements.items()
        ],
        table=axes_table(judgements, beside or {}),
        drawing=loops(judgements),
        notes=list(told),
    )


def _loop(judgement: Judgement) -> Loop | None:
    return loop_between(judgement.train[0].series, judgement.test[0].series)


def _verdict(judgements: Mapping[str, Judgement], found: Mapping[str, Loop | None]) -> list[str]:
    parts = []
    for axis, judgement in judgements.items():
        worst = worst_run(judgement.test)
        parts.append(f"{number(worst.after.rms)} of {number(worst.before.rms)} deg/h on axis {axis}")
    over = averages(next(iter(judgements.values())).test[0].averaging_s)
    sentence = f"On a run it has not seen, the model leaves {listed(parts)} (rms, {over})."
    widest = max(
        ((axis, loop) for axis, loop in found.items() if loop), key=lambda item: item[1].widest, default=None
    )
    if widest is None or widest[1].rms < 2.0 * worst_run(judgements[widest[0]].test).floor:
        return [sentence]
    axis, loop = widest
    return [
        sentence,
        f"On axis {axis} the two runs lie up to {number(loop.widest)} deg/h apart at equal temperature: "
        "a loop that no polynomial in T closes.",
    ]


def _words(judgement: Judgement) -> str:
    worst = worst_run(judgement.test)
    kind = judgement.model.get("kind")
    return (
        f"{kind}, rms {number(worst.after.rms)} of {number(worst.before.rms)} deg/h, "
        f"noise floor {number(worst.floor)} deg/h"
    )


def axes_table(judgements: Mapping[str, Judgement], beside: Mapping[str, Mapping[str, Judgement]]) -> Table:
    """Each axis' worst test run before and after, by its model and by those beside it."""
    rows = []
    for axis, judgement in judgements.items():
        worst, loop = worst_run(judgement.test), _loop(judgement)
        others = [
            number(worst_run(by_axis[axis].test).after.rms) if axis in by_axis else MISSING
            for by_axis in beside.values()
        ]
        rows.append(
            (
                axis,
                str(judgement.model.get("kind")),
                number(worst.before.rms),
                *others,
                number(worst.after.rms),
                number(worst.after.bias_stability),
                number(worst.floor),
                number(loop.rms) if loop else MISSING,
            )
        )
    test = next(iter(judgements.values())).test[0]
    tests = listed([run.run for judgement in judgements.values() for run in judgement.test], 6)
    return Table(
        (
            *columns_of("Axis | Model | >Rms before [deg/h]"),
            *((f"Rms, {name}", "deg/h", "figure") for name in beside),
            *columns_of(
                ">Rms after [deg/h] | >Bias stability after [deg/h] | >Noise floor [deg/h] | "
                ">Distance of the runs at equal T, rms [deg/h]"
            ),
        ),
        rows,
        f"On {tests}, {averages(test.averaging_s)}.",
    )


_BINS = 40
_IN_BIN = 6
_LEAST_IN_BIN = 3


@dataclass(frozen=True)
class Loop:
    """How far two runs are apart at equal temperature [deg/h]."""

    widest: float
    at_deg_c: float
    rms: float


def loop_between(first: AveragedSeries, second: AveragedSeries) -> Loop | None:
    """The distance of the drift of two runs at equal temperature, in bins of temperature.

    A function of temperature alone has one value there, so at least half of the distance is
    left in one of the runs whatever the function. None where they share no temperatures.
    """
    low = max(float(np.min(first.temperature)), float(np.min(second.temperature)))
    high = min(float(np.max(first.temperature)), float(np.max(second.temperature)))
    if not high > low:
        return None
    fewest = min(int(np.sum((t >= low) & (t <= high))) for t in (first.temperature, second.temperature))
    edges = np.linspace(low, high, int(np.clip(fewest // _IN_BIN, 1, _BINS)) + 1)
    means, counts = zip(*(_binned(series, edges) for series in (first, second)), strict=True)
    shared = np.minimum(*counts) >= _LEAST_IN_BIN
    if not shared.any():
        return None
    apart = np.abs(means[0] - means[1])[shared]
    middle = 0.5 * (edges[1:] + edges[:-1])[shared]
    widest = int(np.argmax(apart))
    return Loop(float(apart[widest]), float(middle[widest]), float(np.sqrt(np.mean(apart**2))))


def _binned(series: AveragedSeries, edges: FloatArray) -> tuple[FloatArray, FloatArray]:
    counts = np.histogram(series.temperature, edges)[0].astype(np.float64)
    sums = np.histogram(series.temperature, edges, weights=series.before)[0]
    return sums / np.maximum(counts, 1.0), counts


def loops(judgements: Mapping[str, Judgement]) -> Drawing:
    """Per axis, drift against temperature of training and test run, and what the model leaves."""
    axes = list(judgements)
    figure = make_subplots(
        rows=2,
        cols=len(axes),
        shared_xaxes=True,
        vertical_spacing=0.07,
        horizontal_spacing=0.08,
        column_titles=[f"axis {axis}" for axis in axes],
    )
    told = []
    for column, (axis, judgement) in enumerate(judgements.items(), start=1):
        train, test = judgement.train[0], judgement.test[0]
        for what, run, colour, symbol in (
            ("training", train, style.WARMING, "triangle-up"),
            ("test", test, style.COOLING, "triangle-down"),
        ):
            kept = min_max_indices(run.series.before, DRAWN_POINTS // 2)
            x, y = run.series.temperature[kept], run.series.before[kept]
            more = {
                "marker_opacity": 0.7,
                "hovertext": f"{what}: {run.run}",
                **style.grouped(what, column == 1),
            }
            figure.add_trace(style.points(x, y, f"{what} run", colour, symbol, 4.5, **more), 1, column)
        kept = min_max_indices(test.series.after, DRAWN_POINTS // 2)
        temperature, left = test.series.temperature[kept], test.series.after[kept]
        model, name = test.series.before[kept] - left, "model on the test run"
        looks = style.BLACK, 1.8
        figure.add_trace(
            style.line(temperature, model, name, *looks, **style.grouped(name, column == 1)), 1, column
        )
        more = style.grouped("left", column == 1) | {"marker_opacity": 0.8}
        trace = style.points(temperature, left, "left on the test run", style.AFTER, size=4.5, **more)
        figure.add_trace(trace, 2, column)
        style.floor_lines(figure, test.floor, 2, column)
        figure.update_xaxes(title_text="T [°C]", row=2, col=column)
        loop = loop_between(train.series, test.series)
        if loop is not None:
            told.append(f"axis {axis} up to {number(loop.widest)} deg/h, at {number(loop.at_deg_c)} °C")
    figure.add_trace(style.floor_in_legend(), row=2, col=1)
    figure.update_yaxes(title_text="drift [deg/h]", row=1, col=1)
    figure.update_yaxes(title_text="left [deg/h]", row=2, col=1)
    style.styled(figure, 620, legend={"y": 1.06}, margin={"t": 78})
    distance = f" At equal temperature the two runs differ: {'; '.join(told)}." if told else ""
    bound = (
        " A curve in T alone has one value at each temperature: whatever its degree, it leaves at least "
        "half of that distance in one of the runs."
    )
    return Drawing(
        figure,
        alt=f"Drift against temperature for {len(axes)} axes, training and test run.{distance}",
        caption=(
            f"Top: drift against temperature.{distance}{bound if told else ''} "
            "Bottom, on its own scale: what the model leaves; dashed, the noise floor."
        ),
    )
