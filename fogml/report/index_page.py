"""The index page of ``fogml demo``: the axes side by side, with links to their pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fogml.report.figures_index import Loop, loop_between, loops
from fogml.report.page import render
from fogml.report.tables import Row, Table
from fogml.report.verdict import advice_words, worst_run
from fogml.report.words import MISSING, averages, listed, number
from fogml.validation.advice import advice_on
from fogml.validation.results import Judgement


@dataclass(frozen=True)
class AxisLink:
    """An axis' page and what it says in a line."""

    axis: str
    href: str
    words: str
    advice: dict[str, Any]


def index_page(
    judgements: Mapping[str, Judgement],
    links: Mapping[str, str] | None = None,
    *,
    title: str = "Demonstration",
    beside: Mapping[str, Mapping[str, Judgement]] | None = None,
    notes: Sequence[str] = (),
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
    notes
        What the page should say of the recording.
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
            AxisLink(axis, links[axis], _words(judgement), advice_words(advice_on(judgement)))
            for axis, judgement in judgements.items()
        ],
        table=_table(judgements, beside or {}, found),
        drawing=loops(judgements),
        notes=[*notes, *told],
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


def _table(
    judgements: Mapping[str, Judgement],
    beside: Mapping[str, Mapping[str, Judgement]],
    found: Mapping[str, Loop | None],
) -> Table:
    rows = []
    for axis, judgement in judgements.items():
        worst, loop = worst_run(judgement.test), found[axis]
        others = [
            number(worst_run(by_axis[axis].test).after.rms) if axis in by_axis else MISSING
            for by_axis in beside.values()
        ]
        rows.append(
            Row(
                (
                    f"axis {axis}",
                    str(judgement.model.get("kind")),
                    number(worst.before.rms),
                    *others,
                    number(worst.after.rms),
                    number(worst.after.bias_stability),
                    number(worst.floor),
                    number(loop.rms) if loop else MISSING,
                )
            )
        )
    test = next(iter(judgements.values())).test[0]
    tests = listed([run.run for judgement in judgements.values() for run in judgement.test], 6)
    return Table(
        (
            ("Axis", "", "text"),
            ("Model", "", "text"),
            ("Rms before", "deg/h", "figure"),
            *((f"Rms, {name}", "deg/h", "figure") for name in beside),
            ("Rms after", "deg/h", "figure"),
            ("Bias stability after", "deg/h", "figure"),
            ("Noise floor", "deg/h", "figure"),
            ("Distance of the runs at equal T, rms", "deg/h", "figure"),
        ),
        tuple(rows),
        f"On {tests}, {averages(test.averaging_s)}.",
    )
