"""The page of one effect: equation, ranges, look-alikes, and its signature on standard programmes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from fogml.report import style
from fogml.report.page import render
from fogml.report.reduce import min_max_indices
from fogml.report.static_svg import Curve, line_figure
from fogml.report.tables import Row, Table
from fogml.report.words import number
from fogml.twin.card import RATE_DEGC, Picture, RateCurve

_POINTS = 600


@dataclass(frozen=True)
class Panel:
    """A signature on one programme: figures of the chamber and of the effect, what they show, and if any."""

    programme: str
    chamber: Markup
    signature: Markup
    words: str
    shows: bool = True


def effect_page(
    card: Mapping[str, Any], pictures: Sequence[Picture], curves: Sequence[RateCurve] = ()
) -> str:
    """The self-contained HTML page of an effect.

    Parameters
    ----------
    card
        Schema ``fogml.effect/1``, as `fogml.twin.card.card_values` gives it.
    pictures
        Its signature on programmes.
    curves
        What it changes over the rate, if that is its place.
    """
    return render(
        "effect.html",
        title=f"{card['id']} – effect",
        card=card,
        quantities=quantities_table(card),
        panels=[panel(card, picture) for picture in pictures],
        about=about(card),
        curves=[rate_figure(curve) for curve in curves],
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


def quantities_table(card: Mapping[str, Any]) -> Table:
    """Amplitude and shape parameters with their units and ranges."""
    rows = [
        Row(
            (
                quantity["name"].replace("_", " "),
                quantity["meaning"],
                quantity["unit"],
                _range(quantity, "tactical"),
                _range(quantity, "navigation"),
            )
        )
        for quantity in (card["amplitude"], *card["shape"])
    ]
    heads = (("Parameter", "", "text"), ("Meaning", "", "text"), ("Unit", "", "text"))
    return Table((*heads, ("Tactical", "", "figure"), ("Navigation", "", "figure")), tuple(rows))


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
        bool(picture.values.any()),
    )


def words(card: Mapping[str, Any], picture: Picture) -> str:
    """What a picture shows, in a sentence."""
    low, high = float(picture.values.min()), float(picture.values.max())
    if low == high == 0.0:
        return "Nothing of it shows in the output here."
    unit = card["amplitude"]["unit"]
    amplitude = number(card["amplitude"]["usual"]) + ("" if unit == "1" else f" {unit}")
    return f"From {number(low)} to {number(high)} deg/h at an amplitude of {amplitude}."


def _figure(picture: Picture, chamber: bool, height: int) -> Markup:
    values = picture.chamber if chamber else picture.values
    kept = min_max_indices(values, _POINTS)
    colour = style.TRAINING if chamber else style.MODEL
    title = "chamber [degC]" if chamber else "effect [deg/h]"
    alt = f"{'Chamber air' if chamber else 'Signature'} over time on {picture.programme}"
    return line_figure(
        [Curve(picture.hours[kept], values[kept], colour)], "time [h]", title, alt, height=height
    )


def _range(quantity: Mapping[str, Any], grade: str) -> str:
    low, high = quantity[grade]
    sign = "± " if quantity["signed"] else ""
    return sign + (number(low) if low == high else f"{number(low)} … {number(high)}")
