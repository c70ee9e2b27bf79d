"""The tables that several pages share: figures per run, metrics before and after, findings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from fogml.numerals import averages, label, number, percent, unit_of
from fogml.runs.findings import Finding
from fogml.validation.results import Judgement, Metrics, Repeatability, RunJudgement

Column = tuple[str, str, str]
"""Heading, unit, and ``text``, ``figure``, or ``figure pair`` of two that may stand below each other."""


@dataclass(frozen=True)
class Row:
    """A table's row.

    Attributes
    ----------
    cells
        Its cells as text.
    mark
        What sets it off: ``chosen`` or ``baseline``.
    link
        Page that its first cell leads to.
    badge
        Kind of the badge that its second cell is: ``met``, ``missed`` or ``care``.
    keys
        What it is sorted by, a number or a text for each cell; of texts, the cells.
    """

    cells: tuple[str, ...]
    mark: str = ""
    link: str = ""
    badge: str = ""
    keys: tuple[str | float | None, ...] = ()


class Table:
    """A table as a page shows it.

    Attributes
    ----------
    columns
        Every one has a heading. May be given as the text that `columns_of` reads.
    rows
        What is given as cells alone is a row as well.
    caption
        Above the table.
    sortable
        Whether a click on a heading sorts.

    Raises
    ------
    ValueError
        If a column has no heading.
    """

    def __init__(
        self,
        columns: str | Iterable[Column],
        rows: Iterable[Row | tuple[str, ...]],
        caption: str = "",
        sortable: bool = False,
    ) -> None:
        self.columns = columns_of(columns) if isinstance(columns, str) else tuple(columns)
        self.caption, self.sortable = caption, sortable
        self.rows = tuple(row if isinstance(row, Row) else Row(row) for row in rows)
        for place, (heading, _, _) in enumerate(self.columns, 1):
            if not heading.strip():
                raise ValueError(f"column {place} of the table '{caption}' has no heading")


def columns_of(headings: str) -> tuple[Column, ...]:
    """Columns from headings such as ``Run | >Bias [deg/h] | >>Rms [deg/h] | Remark``.

    Figures are set off by >, pairs of them that may stand below each other by >>.
    """
    kinds = ("text", "figure", "figure pair")
    columns = []
    for one in headings.split(" | "):
        heading = one.lstrip(">")
        name, _, unit = heading.removesuffix("]").partition(" [")
        columns.append((name, unit, kinds[len(one) - len(heading)]))
    return tuple(columns)


def reference_of(judged: RunJudgement) -> str:
    """What biases are relative to, in words."""
    return "known Earth rate" if judged.bias_reference == "earth rate" else "the training runs' mean"


def metrics_table(judged: RunJudgement) -> Table:
    """Every figure that the run tells, before and after, with the floor beside."""
    rows = []
    for field in fields(Metrics):
        before, after = getattr(judged.before, field.name), getattr(judged.after, field.name)
        same = field.name == "bias_stability_10s" and round(judged.averaging_s) == 10  # it stands above
        if (before is None and after is None) or same:
            continue
        floor = number(judged.floor) if field.name in ("bias_stability", "rms") else ""
        cells = (label(field.name), number(before), number(after), floor, unit_of(field.name))
        rows.append(cells)
    return Table(
        "Figure | >Before | >After | >Floor | Unit",
        rows,
        caption=f"{averages(judged.averaging_s)} where not said otherwise; "
        f"bias relative to {reference_of(judged)}.",
    )


def runs_table(runs: Sequence[RunJudgement], caption: str = "") -> Table:
    """One row per run: bias, bias stability, range and rms before and after, floor, outside.

    ``caption`` follows the averaging time in the table's caption.
    """
    rows = [
        (
            run.run,
            *(
                f"{number(getattr(run.before, name))} → {number(getattr(run.after, name))}"
                for name in ("bias", "bias_stability", "range", "rms")
            ),
            number(run.floor),
            percent(run.outside_training),
            f"{run.rows_used:,}".replace(",", "\u202f"),
        )
        for run in runs
    ]
    return Table(
        "Run | >Bias [deg/h] | >Bias stability [deg/h] | >Range [deg/h] | >Rms [deg/h] | "
        ">Noise floor [deg/h] | >Outside training | >Samples used",
        rows,
        caption=f"{averages(runs[0].averaging_s).capitalize()}, before → after{caption}.",
    )


def beside_table(judgement: Judgement) -> Table | None:
    """Rms of each test run before, by the model, by others beside it, and the floor; None without others."""
    if not judgement.beside:
        return None
    rows = [
        (
            run.run,
            *(number(v) for v in (run.before.rms, run.after.rms)),
            *(number(others[i].after.rms) for others in judgement.beside.values()),
            number(run.floor),
        )
        for i, run in enumerate(judgement.test)
    ]
    figures = ["before", judgement.model["kind"], *judgement.beside, "noise floor"]
    return Table(
        columns=(*columns_of("Run"), *((name.capitalize(), "deg/h", "figure") for name in figures)),
        rows=rows,
        caption=f"Rms of {averages(judgement.test[0].averaging_s)}, on the same rows.",
    )


def repeatability_table(found: Repeatability | None) -> Table | None:
    """Repeatability of bias and scale factor over test runs, where there are enough of them."""
    if found is None:
        return None
    told = {"bias_repeatability": found.bias, "scale_factor_repeatability": found.scale_factor}
    cycles = "power cycles" if found.power_cycles else "runs, each taken as one power cycle"
    return Table(
        "Figure | >Before | >After | Unit | After, 90 %",
        (
            (
                label(name),
                number(figure.before),
                number(figure.after),
                unit_of(name),
                " to ".join(map(number, figure.after_ci90)),
            )
            for name, figure in told.items()
            if figure is not None
        ),
        caption=f"Standard deviation over {found.runs} {cycles}.",
    )


def coefficients_of(model: Mapping[str, Any]) -> list[tuple[str, float, float | None]]:
    """Term, coefficient and standard error of a model that tells them; none of another."""
    told = model.get("coefficients") or {}
    return [
        (name, float(c["value"]), float(c["se"]) if c.get("se") is not None else None)
        if isinstance(c, Mapping)
        else (name, float(c), None)
        for name, c in told.items()
    ]


_OF_THE_OUTPUT = (
    "D is the output as recorded, in deg/h or counts. The terms add up to the compensated output, so the "
    "drift has the sign opposite to theirs."
)


def coefficients_table(model: Mapping[str, Any]) -> Table | None:
    """Coefficients with their standard errors, where the model tells them."""
    told = coefficients_of(model)
    if not told:
        return None
    return Table(
        "Term | >Coefficient [deg/h per unit of the term] | >Standard error",
        ((name, number(value, 5), number(error, 2)) for name, value, error in told),
        caption=_OF_THE_OUTPUT if any(name == "D" for name, *_ in told) else "",
    )


def candidates_table(model: Mapping[str, Any]) -> Table | None:
    """What a choosing model weighed, the best first, by its rms on what folds held out."""
    candidates = sorted(model.get("candidates") or (), key=lambda told: float(told["held_out_rms"]))
    if not candidates:
        return None
    return Table(
        "Candidate | >Parameters | >Rms held out [deg/h]",
        (
            (str(told["name"]), str(told["parameters"]), number(float(told["held_out_rms"])))
            for told in candidates
        ),
        caption=(
            "Simple forms, on blocks of the training runs left out in turn; a larger one is taken only if "
            "better beyond noise. What a combination leaves is of other parts left out, and told above."
        ),
    )


def noticed(findings: Iterable[Finding | Mapping[str, Any]]) -> list[tuple[str, str, str]]:
    """Codes, messages and places in words of findings, from objects or from their JSON form."""
    shown = []
    for finding in findings:
        values = finding.as_dict() if isinstance(finding, Finding) else finding
        place = [f"column {values['column']}"] if values.get("column") else []
        place += [f"from row {values['row']}"] if values.get("row") else []
        message = str(values["message"])
        message = f"{values['run']}: {message}" if values.get("run") else message
        shown.append((str(values["code"]), message[:1].upper() + message[1:], ", ".join(place)))
    return shown
