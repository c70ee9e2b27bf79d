"""The card of an effect: what its declaration says."""

from __future__ import annotations

import inspect
import textwrap
from dataclasses import dataclass
from typing import Any

from fogml.twin.effect import Effect
from fogml.twin.quantities import GRADES, Quantity


@dataclass(frozen=True)
class Prose:
    """An effect's docstring in parts.

    Attributes
    ----------
    summary
        Its first sentence.
    equation
        The indented blocks, one above the other.
    remarks
        Paragraphs on symbols and conditions.
    source
        Where equation and ranges come from, with how far that was checked.
    """

    summary: str
    equation: str
    remarks: tuple[str, ...]
    source: str


def prose(declared: Effect) -> Prose:
    """What the docstring of an effect's class says."""
    text = inspect.getdoc(type(declared)) or declared.title
    equations, remarks, source = [], [], ""
    blocks = text.split("\n\n")
    for block in blocks[1:]:
        lines = block.strip("\n")
        if lines.strip() == "::":
            continue
        if lines.startswith(" "):
            equations.append(textwrap.dedent(lines).replace("`", ""))
        elif lines.startswith("Source:"):
            source = _plain(lines.removeprefix("Source:"))
        else:
            remarks.append(_plain(lines))
    return Prose(_plain(blocks[0]), "\n".join(equations), tuple(remarks), source)


def _plain(text: str) -> str:
    """Text in one line without the marks of names."""
    return " ".join(text.replace("`", "").split())


def card_values(declared: Effect) -> dict[str, Any]:
    """An effect's card as JSON-ready values."""
    told = prose(declared)
    return {
        "schema": "fogml.effect/1",
        "id": declared.id,
        "code": declared.code,
        "title": declared.title,
        "stage": declared.stage,
        "summary": told.summary,
        "equation": told.equation,
        "remarks": list(told.remarks),
        "source": told.source,
        "sources": list(declared.sources),
        "amplitude": _quantity(declared.amplitude),
        "shape": [_quantity(quantity) for quantity in declared.shape],
        "needs": list(declared.needs),
        "conflicts": list(declared.conflicts),
        "shows": declared.shows,
        "shown_on": declared.shown_on,
        "confused_with": dict(declared.confused_with),
        "candidate": declared.candidate,
        "drawn_per_run": declared.drawn_per_run,
    }


def _quantity(quantity: Quantity) -> dict[str, Any]:
    return {
        "name": quantity.name,
        "unit": quantity.unit,
        "meaning": quantity.meaning,
        "signed": quantity.signed,
        "usual": quantity.typical(),
        **{grade: list(quantity.range(grade)) for grade in GRADES},
    }
