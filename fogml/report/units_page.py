"""The page of several units that were diagnosed together: what each has, and what they share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fogml.numerals import MISSING, number, percent
from fogml.report.page import render
from fogml.report.tables import Table, columns_of


def units_page(values: Mapping[str, Any], words: Mapping[str, str]) -> str:
    """The self-contained HTML page of a ``units.json``.

    Parameters
    ----------
    values
        Schema ``fogml.gap_units/1``.
    words
        Verdict and named causes of each unit.
    """
    units = list(values["units"])
    return render(
        "units.html",
        title=f"Units {', '.join(units)}",
        links=[(unit, f"{values['folders'][unit]}/gap.html", words[unit]) for unit in units],
        shared=_shared(values["shared"], units) if values["shared"] else None,
    )


def _shared(causes: Sequence[Mapping[str, Any]], units: Sequence[str]) -> Table:
    rows = []
    for cause in causes:
        sizes = (_size(cause["sizes"].get(unit)) for unit in units)
        ends = cause["next_unit"]
        following = f"{number(ends[0])} … {number(ends[1])}" if ends else MISSING
        rows.append(
            (
                cause["effect"],
                percent(cause["probability"]),
                cause["unit"],
                *sizes,
                _size(cause["mean"]),
                following,
            )
        )
    return Table(
        columns=(
            *columns_of("Cause | >Probability | Unit of size"),
            *((unit, "", "figure pair") for unit in units),
            *columns_of(">>Mean | >>Next unit [90 % interval]"),
        ),
        rows=rows,
        caption="Probability that it acts in units of this kind; sizes ± standard error.",
    )


def _size(told: Mapping[str, Any] | None) -> str:
    return MISSING if told is None else f"{number(told['value'])} ± {number(told['se'], 2)}"
