"""The card of an effect, and its pictures at its usual amplitude: over time, rate, averaging times."""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.twin.chain import hidden
from fogml.twin.effect import Effect, LoopEffect, NoiseEffect, ScaleFactorEffect, ThermalEffect
from fogml.twin.inputs import Inputs
from fogml.twin.noise import NoiseConstants
from fogml.twin.plant.heat import SelfHeating
from fogml.twin.quantities import GRADES, Quantity
from fogml.twin.registry import clashing, effects
from fogml.twin.scenes import Scene, scene
from fogml.twin.simulate import simulate
from fogml.twin.truth import Truth
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin


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
    text = inspect.cleandoc(type(declared).__doc__ or declared.title)
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
        "conflicts": clashing(declared, effects()),
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


STANDARD_PROGRAMMES = (
    "multi-point-cycle",
    "joint-staircase",
    "ten-degrees-per-hour-up",
    "four-positions",
    "separating",
)
"""What an effect's signature is shown on beside the scene that shows it best."""
RATE_DEGC = 45.0
"""Temperature at which an effect is shown over the rate: away from 25 degC, where many have their zero."""
FAST_DEG_S, SLOW_DEG_H = 600.0, 1.0
PLACES = ("T_chamber", "T_case", "T_out", "T_in", "T_electronics")
"""Where a thermal effect is shown."""
_RATES = 401
_ALLAN_SAMPLES, _ALLAN_TIMES, _ALLAN_DRAWS = 1 << 14, 100, 16
_ROOM = 25.0
_DIP = 1e-6


@dataclass(frozen=True, eq=False)
class Picture:
    """What an effect changes on a scene, at its usual amplitude.

    Attributes
    ----------
    programme
        Name of the scene or programme.
    hours
        Time [h], shape (n,).
    chamber
        Chamber air [degC], shape (n,).
    values
        The effect's part of the output [deg/h], shape (n,). Of a thermal effect that acts by way of the
        plant, what it changes in the temperature of the first of `places`, where that is most [degC].
    unit
        Of the values.
    places
        Of a thermal effect, what it changes at each place [degC], shape (n,).
    """

    programme: str
    hours: FloatArray
    chamber: FloatArray
    values: FloatArray
    unit: str = "deg/h"
    places: Mapping[str, FloatArray] = field(default_factory=dict)

    @property
    def span(self) -> tuple[float, float]:
        """Least and greatest of all that it shows."""
        shown = [self.values, *self.places.values()]
        return min(float(x.min()) for x in shown), max(float(x.max()) for x in shown)


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


@dataclass(frozen=True, eq=False)
class AllanCurve:
    """Allan deviation of a noise alone, at its usual amplitude, at 25 degC.

    Attributes
    ----------
    taus_s
        Averaging times [s], shape (n,).
    adev
        Allan deviation [deg/h], shape (n,).
    """

    taus_s: FloatArray
    adev: FloatArray

    @property
    def has_dips(self) -> bool:
        """Whether it falls to nothing between averaging times, as that of a line does."""
        return bool(self.adev.min() < _DIP * self.adev.max())


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
    given = _steady(RATE_DEGC, rate_deg_h)
    amplitude, shape = declared.amplitude.typical(), declared.default_shape()
    if isinstance(declared, ScaleFactorEffect):
        return amplitude * float(declared.response(given, **shape)[-1])
    output = np.full(len(given), rate_deg_h)
    return float(declared.apply(output, given.with_output(output), amplitude, **shape)[-1]) - rate_deg_h


def _steady(temperature: float, rate_deg_h: float = 0.0) -> Inputs:
    rows = 8
    warm = dict.fromkeys(("T", "T_in", "T_out", "T_case", "T_electronics"), np.full(rows, temperature))
    return Inputs(1e4 * np.arange(float(rows)), warm, np.full(rows, rate_deg_h / 3600.0))


def allan_curve(declared: Effect) -> AllanCurve | None:
    """Of a noise that shows in the Allan deviation, from 16 draws of 4.6 h at 1 s."""
    if not isinstance(declared, NoiseEffect) or "Allan" not in declared.shows:
        return None
    from fogml.signals.allan import allan_deviation

    shape = declared.default_shape()
    rng = np.random.default_rng(0)
    amplitude = declared.amplitude.typical() * float(np.max(declared.strength(_steady(_ROOM), **shape)))
    taus = np.unique(np.rint(np.geomspace(1.0, _ALLAN_SAMPLES / 8, _ALLAN_TIMES)))
    draws = [declared.draw(rng, _ALLAN_SAMPLES, 1.0, amplitude, **shape) for _ in range(_ALLAN_DRAWS)]
    ends = [(_ALLAN_SAMPLES * k, _ALLAN_SAMPLES * (k + 1)) for k in range(_ALLAN_DRAWS)]
    found = allan_deviation(np.concatenate(draws), 1.0, taus, segments=ends)
    return AllanCurve(found.taus_s, found.adev)


def pictures(declared: Effect, names: Sequence[str] | None = None) -> tuple[Picture, ...]:
    """What an effect changes on scenes, on a tactical unit with nothing else on.

    Parameters
    ----------
    declared
        The effect.
    names
        Of `fogml.twin.scenes.scene_names`; the scene that shows it best alone if None.
    """
    return tuple(_picture(declared, scene(name)) for name in (names or (declared.shown_on,)))


def _picture(declared: Effect, on: Scene) -> Picture:
    unit = _unheated() if declared.id == "self_heating" else _unit()
    true = _truth(on, unit.with_effect(declared.id, **on.shape))
    shown = true.time >= on.from_share * on.programme.total_s
    hours, chamber = true.time[shown] / 3600.0, true.nodes["T_chamber"][shown]
    if isinstance(declared, ThermalEffect) and not hidden(declared):
        plain = _truth(on, unit)
        changes = {name: (true.nodes[name] - plain.nodes[name])[shown] for name in PLACES}
        changed = {name: change for name, change in changes.items() if change.any()} or changes
        most = max(changed, key=lambda name: float(np.abs(changed[name]).max()))
        ordered = {most: changed[most], **changed}
        return Picture(on.name, hours, chamber, changed[most], "degC", ordered)
    drawn = isinstance(declared, NoiseEffect) and not declared.steady
    values = true.noise if drawn else true.contributions[declared.id]
    return Picture(on.name, hours, chamber, values[shown])


def _truth(on: Scene, twin: Twin) -> Truth:
    made = simulate(on.programme, twin, sample_s=on.interval_s, facts=on.facts, columns=(), truth=True)
    assert made.truth is not None
    return made.truth


@lru_cache(maxsize=1)
def _unit() -> Twin:
    """The tactical unit that ships with neither effects nor noise."""
    return replace(load_twin("tactical"), settings={}, noise=NoiseConstants(), name="card")


def _unheated() -> Twin:
    """The same with no heat of its electronics, whose place an effect takes."""
    unit = _unit()
    return replace(unit, plant=replace(unit.plant, heating=SelfHeating()))
