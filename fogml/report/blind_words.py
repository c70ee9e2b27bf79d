"""Figures of a blind score as people read them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from fogml.blind.folders import DIAGNOSIS
from fogml.blind.methods import ABSTAIN, BASELINES
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


def headline(methods: Iterable[str]) -> str:
    """The method that a score is about: the diagnosis, else no baseline, else one that names something."""
    there = list(methods)
    asked = [DIAGNOSIS, *(m for m in there if m not in BASELINES), *(m for m in there if m != ABSTAIN)]
    return next((method for method in asked if method in there), there[0])


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
