"""The page of the whole catalogue: every effect with its equation, ranges and signature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from fogml.report.effect_card import about, allan_figure, panel, quantities_table, rate_figure
from fogml.report.page import render
from fogml.report.tables import Table
from fogml.twin.pictures import RATE_DEGC, AllanCurve, Picture, RateCurve

STAGE_WORDS = {
    "thermal": "Thermal plant",
    "rig": "Rig: the rate that is there",
    "bias": "Bias",
    "scale_factor": "Scale factor",
    "loop": "Closed loop",
    "readout": "Read-out",
    "sensor": "Temperature sensors",
    "logger": "Logger",
    "noise": "Random errors",
}

OVER_RATE = ("loop", "readout")
"""Stages whose effects are shown over the rate too, as those are whose scale factor goes with it."""
Drawn = tuple[Mapping[str, Any], Picture, Sequence[RateCurve], AllanCurve | None]
"""Card of schema ``fogml.effect/1`` of an effect, its picture, its curves over the rate, and a noise's Allan
deviation."""


@dataclass(frozen=True)
class Entry:
    """An effect as the catalogue shows it."""

    card: Mapping[str, Any]
    quantities: Table
    figure: Markup
    programme: str
    words: str
    curves: list[Markup]
    allan: Markup
    about: list[tuple[str, str]]


def catalogue_page(cards: Sequence[Drawn]) -> str:
    """The self-contained HTML page of all effects.

    Parameters
    ----------
    cards
        What is shown of each effect, in the order of the catalogue.
    """
    stages: dict[str, list[Entry]] = {stage: [] for stage in STAGE_WORDS}
    for card, picture, curves, allan in cards:
        drawn = panel(card, picture)
        over_rate = card["stage"] in OVER_RATE or (
            card["stage"] == "scale_factor" and "rate" in card["needs"]
        )
        entry = Entry(
            card=card,
            quantities=quantities_table(card),
            figure=drawn.signature if drawn.shows else Markup(""),
            programme=picture.programme,
            words=drawn.words,
            curves=[rate_figure(curve) for curve in curves if over_rate],
            allan=allan_figure(allan),
            about=about(card),
        )
        stages[card["stage"]].append(entry)
    shown = [(stage, STAGE_WORDS[stage], entries) for stage, entries in stages.items() if entries]
    warm = f"{RATE_DEGC:g} degC"
    return render("catalogue.html", title="Catalogue of effects", count=len(cards), stages=shown, warm=warm)
