"""Figures of a blind score as people read them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fogml.report.words import MISSING, number, percent, stated

_KINDS = {
    "nothing": "nothing missing",
    "one": "one effect",
    "two": "two effects",
    "three": "three effects",
    "unknown_left_out": "unknown: an effect left out",
    "unknown_invented": "unknown: in no library",
    "unknown_and_known": "unknown + known",
    "wrong_thermal": "wrong thermal structure",
}


REALITY = (
    "Another integrator and another thermal order than the twin's, other forms of the catalogue's effects, "
    "sensors with noise, steps and lag, and effects that no library holds. While the forms were written "
    "they were compared with the catalogue's signatures, and the ranges of some were drawn in until the "
    "best-fitted signature had a cosine above 0.95 as a rule (Bouc–Wen's exponent, place and shift of the "
    "glass transition, slope of the strain's sensitivity, weights of the winding's layers, leads' and "
    "chamber pick-up's lag): below that an effect is another one, by the measure that tells relatives. "
    "No effect has a size that no gyro has, so mount_tilt has no form here: it stays under the noise. "
    "The first 128 s of a run are in no figure, and d′ counts the noise of temperature readings. Nobody "
    "knows what a held-out run draws for itself (a turn-on bias, the phase of a line): the truth's closing "
    "leaves that open as well, and where it closes less than 5 % it is compared with nothing."
)
"""What must be known of the reality behind the figures."""


def kind_words(kind: str) -> str:
    """The name of a kind of case."""
    return _KINDS.get(kind, kind.replace("_", " "))


def value_text(value: float | None, form: str) -> str:
    """A value by the figure's ``format``."""
    if value is None:
        return MISSING
    if form == "percent":
        return percent(value)
    return f"{number(value)} s" if form == "seconds" else number(value)


def figure_text(row: Mapping[str, Any]) -> str:
    """A figure with its interval, such as ``2.1 % (1.2 % … 3.6 %)``."""
    text = value_text(row["value"], row["format"])
    if row["low"] is None or row["high"] is None:
        return text
    low, high = (value_text(row[end], row["format"]) for end in ("low", "high"))
    return f"{text} ({low} … {high})"


def wanted_text(row: Mapping[str, Any]) -> str:
    """What is wanted of a figure, such as ``≤ 2 %``; empty where nothing is."""
    low, high = (row["wanted"][end] for end in ("low", "high"))
    unit = " s" if row["format"] == "seconds" else ""

    def told(value: float) -> str:
        return f"{100 * value:.3g} %" if row["format"] == "percent" else f"{stated(value)}{unit}"

    if low is not None and high is not None:
        return f"{told(low)} … {told(high)}"
    if low is not None:
        return f"≥ {told(low)}"
    return f"≤ {told(high)}" if high is not None else ""
