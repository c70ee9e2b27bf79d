"""The page of one effect, with its signature on standard programmes, and that of the whole catalogue."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from fogml.arrays import FloatArray
from fogml.numerals import MISSING, number, unit_words
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
        panels=[
            (picture.programme, _chamber(picture), _signature(picture), words(card, picture))
            for picture in pictures
            if _shows(picture)
        ],
        silent=[picture.programme for picture in pictures if not _shows(picture)],
        about=about(card),
        curves=[rate_figure(curve) for curve in curves],
        allan=allan_figure(allan),
        warm=f"{RATE_DEGC:g} °C",
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
            unit_words(quantity["unit"]) or MISSING,
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


def _shows(picture: Picture) -> bool:
    return picture.span != (0.0, 0.0)


def words(card: Mapping[str, Any], picture: Picture) -> str:
    """What a picture shows, in a sentence."""
    if not _shows(picture):
        return "Nothing of it shows in the output here."
    low, high = picture.span
    amplitude = f"{number(card['amplitude']['usual'])} {unit_words(card['amplitude']['unit'])}".rstrip()
    what = " in the temperatures" if picture.places else ""
    span = f"From {number(low)} to {number(high)} {unit_words(picture.unit)}"
    return f"{span}{what} at an amplitude of {amplitude}."


def _across(picture: Picture) -> tuple[FloatArray, str]:
    """The times of a picture, and the title of their axis."""
    hours = picture.hours
    return (hours, "time [h]") if hours[-1] - hours[0] > _SHORT_H else (3600.0 * hours, "time [s]")


def _chamber(picture: Picture) -> Markup:
    across, title = _across(picture)
    curves = [_reduced(across, picture.chamber, style.TRAINING)]
    alt = f"Chamber air over time on {picture.programme}"
    return line_figure(curves, title, "chamber [°C]", alt, height=120)


def _signature(picture: Picture) -> Markup:
    across, title = _across(picture)
    alt = f"Signature over time on {picture.programme}"
    curves = []
    low, high = picture.span
    if low * high <= 0.0 or high - low < _NEARLY_CONSTANT * max(abs(low), abs(high)):
        # What is there without the effect.
        curves.append(Curve(across[[0, -1]], np.zeros(2), style.TRAINING))
    if picture.places:
        for colour, (name, change) in zip(style.SERIES, picture.places.items()):
            curves.append(_reduced(across, change, colour, name))
        return line_figure(curves, title, "change [°C]", alt, height=200)
    curves.append(_reduced(across, picture.values, style.MODEL))
    return line_figure(curves, title, "effect [deg/h]", alt, height=170)


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


def catalogue_page(cards: Sequence[Drawn]) -> str:
    """The self-contained HTML page of all effects.

    Parameters
    ----------
    cards
        What is shown of each effect, in the order of the catalogue.
    """
    stages: dict[str, list[dict[str, Any]]] = {stage: [] for stage in STAGE_WORDS}
    for card, picture, curves, allan in cards:
        over_rate = card["stage"] in OVER_RATE or (
            card["stage"] == "scale_factor" and "rate" in card["needs"]
        )
        entry = {
            "card": card,
            "quantities": quantities_table(card),
            "figure": _signature(picture) if _shows(picture) else "",
            "programme": picture.programme,
            "words": words(card, picture),
            "curves": [rate_figure(curve) for curve in curves if over_rate],
            "allan": allan_figure(allan),
            "about": about(card),
        }
        stages[card["stage"]].append(entry)
    shown = [(STAGE_WORDS[stage], entries) for stage, entries in stages.items() if entries]
    warm = f"{RATE_DEGC:g} °C"
    return render("catalogue.html", title="Catalogue of effects", count=len(cards), stages=shown, warm=warm)
