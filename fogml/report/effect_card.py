"""The page of one effect, with its signature on standard programmes, and that of the whole catalogue."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from fogml.arrays import FloatArray
from fogml.numerals import number
from fogml.pictures import Curve, line_figure
from fogml.report import style
from fogml.report.page import render
from fogml.report.tables import Table
from fogml.signals.drawn import min_max_indices
from fogml.twin.pictures import RATE_DEGC, AllanCurve, Picture, RateCurve

_POINTS = 600
_SHORT_H = 0.15
"""What is shorter is shown over seconds."""
_NEARLY_CONSTANT = 0.05
"""Share of its size by which an effect changes at most to be shown as a constant, from zero."""
_DECADES = 1e-3
"""Of the greatest Allan deviation: what is below, as at the whole periods of a line, is off the picture."""


@dataclass(frozen=True)
class Panel:
    """A signature on one programme: figures of the chamber and of the effect, what they show, and if any."""

    programme: str
    chamber: Markup
    signature: Markup
    words: str
    shows: bool = True


def effect_page(
    card: Mapping[str, Any],
    pictures: Sequence[Picture],
    curves: Sequence[RateCurve] = (),
    allan: AllanCurve | None = None,
) -> str:
    """The self-contained HTML page of an effect.

    Parameters
    ----------
    card
        Schema ``fogml.effect/1``, as `fogml.twin.pictures.card_values` gives it.
    pictures
        Its signature on programmes.
    curves
        What it changes over the rate, if that is its place.
    allan
        Its Allan deviation, if it is a noise.
    """
    return render(
        "effect.html",
        title=f"{card['id']} – effect",
        card=card,
        quantities=quantities_table(card),
        panels=[panel(card, picture) for picture in pictures],
        about=about(card),
        curves=[rate_figure(curve) for curve in curves],
        allan=allan_figure(allan),
        warm=f"{RATE_DEGC:g} degC",
    )


def rate_figure(curve: RateCurve) -> Markup:
    """What an effect changes in the output over the rate."""
    return line_figure(
        [Curve(curve.rate, curve.change, style.MODEL)],
        f"rate [{curve.unit}]",
        "effect [deg/h]",
        f"Change of the output over rates of up to {curve.rate[-1]:g} {curve.unit}",
        height=170,
    )


def allan_figure(curve: AllanCurve | None) -> Markup:
    """Allan deviation of a noise alone; nothing of another effect."""
    if curve is None:
        return Markup("")
    # A line alone has zeros.
    least = _DECADES * float(curve.adev.max()) if curve.has_dips else 0.0
    return line_figure(
        [Curve(curve.taus_s, np.maximum(curve.adev, least), style.MODEL)],
        "averaging time [s]",
        "Allan deviation [deg/h]",
        f"Allan deviation at averaging times from {curve.taus_s[0]:g} to {curve.taus_s[-1]:g} s",
        height=190,
        log="xy",
    )


def quantities_table(card: Mapping[str, Any]) -> Table:
    """Amplitude and shape parameters with their units and ranges."""
    rows = [
        (
            quantity["name"].replace("_", " "),
            quantity["meaning"],
            quantity["unit"],
            _range(quantity, "tactical"),
            _range(quantity, "navigation"),
        )
        for quantity in (card["amplitude"], *card["shape"])
    ]
    return Table("Parameter | Meaning | Unit | >Tactical | >Navigation", rows)


def about(card: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What else the card states, as name and text."""
    rows = [
        ("stage", card["stage"].replace("_", " ")),
        ("needs", ", ".join(card["needs"]) or "time alone"),
        ("candidate of a diagnosis", "yes" if card["candidate"] else "on request"),
    ]
    if card["drawn_per_run"]:
        rows.append(("amplitude", "another one at each power-on"))
    if card["conflicts"]:
        rows.append(("not together with", ", ".join(card["conflicts"])))
    return [*rows, ("source", card["source"]), *(("reference", source) for source in card["sources"])]


def panel(card: Mapping[str, Any], picture: Picture) -> Panel:
    """The figures of one programme."""
    return Panel(
        picture.programme,
        _figure(picture, chamber=True, height=120),
        _figure(picture, chamber=False, height=170),
        words(card, picture),
        picture.span != (0.0, 0.0),
    )


def words(card: Mapping[str, Any], picture: Picture) -> str:
    """What a picture shows, in a sentence."""
    low, high = picture.span
    if low == high == 0.0:
        return "Nothing of it shows in the output here."
    unit = card["amplitude"]["unit"]
    amplitude = number(card["amplitude"]["usual"]) + ("" if unit == "1" else f" {unit}")
    what = " in the temperatures" if picture.places else ""
    return f"From {number(low)} to {number(high)} {picture.unit}{what} at an amplitude of {amplitude}."


def _figure(picture: Picture, chamber: bool, height: int) -> Markup:
    alt = f"{'Chamber air' if chamber else 'Signature'} over time on {picture.programme}"
    hours = picture.hours
    across, title = (hours, "time [h]") if hours[-1] - hours[0] > _SHORT_H else (3600.0 * hours, "time [s]")
    if chamber:
        curves = [_reduced(across, picture.chamber, style.TRAINING)]
        return line_figure(curves, title, "chamber [degC]", alt, height=height)
    curves = []
    low, high = picture.span
    if low * high <= 0.0 or high - low < _NEARLY_CONSTANT * max(abs(low), abs(high)):
        # What is there without the effect.
        curves.append(Curve(across[[0, -1]], np.zeros(2), style.TRAINING))
    if picture.places:
        for colour, (name, change) in zip(style.SERIES, picture.places.items()):
            curves.append(_reduced(across, change, colour, name))
        return line_figure(curves, title, "change [degC]", alt, height=height + 30)
    curves.append(_reduced(across, picture.values, style.MODEL))
    return line_figure(curves, title, "effect [deg/h]", alt, height=height)


def _reduced(across: FloatArray, values: FloatArray, colour: str, label: str = "") -> Curve:
    kept = min_max_indices(values, _POINTS)
    return Curve(across[kept], values[kept], colour, label=label)


def _range(quantity: Mapping[str, Any], grade: str) -> str:
    low, high = quantity[grade]
    sign = "± " if quantity["signed"] else ""
    return sign + (number(low) if low == high else f"{number(low)} … {number(high)}")


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
