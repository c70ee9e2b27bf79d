"""The card of an effect: what its declaration says, and its signature on standard programmes."""

from __future__ import annotations

import inspect
import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from fogml.runs.facts import Facts
from fogml.runs.run import FloatArray
from fogml.twin.effect import Effect, LoopEffect, NoiseEffect, ScaleFactorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.noise import NoiseConstants
from fogml.twin.programme import load_programme
from fogml.twin.quantities import GRADES, Quantity
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin

STANDARD_PROGRAMMES = (
    "multi-point-cycle",
    "joint-staircase",
    "ten-degrees-per-hour-up",
    "four-positions",
    "separating",
)
"""What an effect's signature is shown on."""
RATE_DEGC = 45.0
"""Temperature at which an effect is shown over the rate: away from 25 degC, where many have their zero."""
FAST_DEG_S, SLOW_DEG_H = 600.0, 1.0
_RATES = 401
_POINTS = 2000
_HORIZONTAL = Facts(axis="x", latitude=39.9, input_axis="north")
_UPRIGHT = Facts(axis="x", latitude=39.9, input_axis="up")


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


@dataclass(frozen=True, eq=False)
class Picture:
    """An effect's part of the output on a programme, at its usual amplitude.

    Attributes
    ----------
    programme
        Name of the programme.
    hours
        Time [h], shape (n,).
    chamber
        Chamber air [degC], shape (n,).
    values
        The effect's part of the output [deg/h], shape (n,).
    """

    programme: str
    hours: FloatArray
    chamber: FloatArray
    values: FloatArray


@dataclass(frozen=True, eq=False)
class RateCurve:
    """What an effect changes in the output at steady rates, at its usual amplitude, warm, at `RATE_DEGC`.

    Attributes
    ----------
    unit
        Of the rates, ``deg/s`` or ``deg/h``.
    rate, change
        Rate in that unit, and change of the output [deg/h], shape (n,).
    """

    unit: str
    rate: FloatArray
    change: FloatArray


def rate_curves(declared: Effect) -> tuple[RateCurve, ...]:
    """Of an effect of scale factor, loop or read-out: up to fast rates, and about zero; where any shows."""
    if not isinstance(declared, ScaleFactorEffect | LoopEffect):
        return ()
    curves = []
    for unit, size, most in (("deg/s", 3600.0, FAST_DEG_S), ("deg/h", 1.0, SLOW_DEG_H)):
        rate = np.linspace(-most, most, _RATES)
        change = np.array([_steady_change(declared, size * one) for one in rate.tolist()])
        if change.any():
            curves.append(RateCurve(unit, rate, change))
    return tuple(curves)


def _steady_change(declared: ScaleFactorEffect | LoopEffect, rate_deg_h: float) -> float:
    rows = 8
    warm = dict.fromkeys(("T", "T_in", "T_out", "T_case", "T_electronics"), np.full(rows, RATE_DEGC))
    given = Inputs(1e4 * np.arange(float(rows)), warm, np.full(rows, rate_deg_h / 3600.0))
    amplitude, shape = declared.amplitude.typical(), declared.default_shape()
    if isinstance(declared, ScaleFactorEffect):
        return amplitude * float(declared.response(given, **shape)[-1])
    output = np.full(rows, rate_deg_h)
    return float(declared.apply(output, given.with_output(output), amplitude, **shape)[-1]) - rate_deg_h


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
        "confused_with": dict(declared.confused_with),
        "candidate": declared.candidate,
        "drawn_per_run": declared.drawn_per_run,
    }


def pictures(declared: Effect, programmes: Sequence[str] = STANDARD_PROGRAMMES) -> tuple[Picture, ...]:
    """An effect's part of the output on standard programmes, on a tactical unit with nothing else on."""
    return tuple(_picture(declared, name) for name in programmes)


def _picture(declared: Effect, name: str) -> Picture:
    programme = load_programme(name)
    sample_s = max(0.5, float(math.ceil(programme.total_s / _POINTS)))
    facts = _HORIZONTAL if name == "four-positions" else _UPRIGHT
    twin = _unit().with_effect(declared.id)
    true = simulate(programme, twin, sample_s=sample_s, facts=facts, columns=(), truth=True).truth
    assert true is not None
    values = (
        true.noise
        if isinstance(declared, NoiseEffect) and not declared.steady
        else true.contributions[declared.id]
    )
    return Picture(name, true.time / 3600.0, true.nodes["T_chamber"], values)


@lru_cache(maxsize=1)
def _unit() -> Twin:
    """The tactical unit that ships with neither effects nor noise."""
    return replace(load_twin("tactical"), settings={}, noise=NoiseConstants(), name="card")


def _quantity(quantity: Quantity) -> dict[str, Any]:
    return {
        "name": quantity.name,
        "unit": quantity.unit,
        "meaning": quantity.meaning,
        "signed": quantity.signed,
        "usual": quantity.typical(),
        **{grade: list(quantity.range(grade)) for grade in GRADES},
    }
