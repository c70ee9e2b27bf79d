"""What false readings of a thermometer can do that pass as heat: the largest error at flag 0."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.export.plan import Plan
from fogml.export.points import box_points
from fogml.features.atoms import RATE_UNIT_S, Atom
from fogml.features.own import Recursion
from fogml.numerals import ascii_number
from fogml.runs.columns import is_temperature

SECONDS = (0.0, 60.0, 300.0)
"""Times without a good reading [s] that the error is stated after."""
TURNING_DEG_S = 10.0
"""Rate [deg/s] that it is stated at, too, of a model with a scale factor, beside that of a gyro at rest."""
_POINTS, _MOST_SIGNS = 256, 32
_ALL = {"block": 2.0, "slope": 3.0, "exp": 2.0}
# Sum of the sizes of a window's weights, times its length: no false readings can move it further.
_ONE = {"block": 1.0, "slope": 6.0}
# Largest of those weights, times the square of its length and over the sample interval.


def false_reading_error(
    plan: Plan, seconds: float = 0.0, *, spell: bool, seed: int = 0, turning_deg_s: float = 0.0
) -> float:
    """Largest error of the drift at flag 0 that false readings make which pass as heat [deg/h].

    Each may be off by what the rule of readings allows (`DropoutRule.off_degC`), in any sense. How far an
    atom then is off follows from its weights; what the model makes of that is the largest over points and
    corners of the trained box, both the true and the false value being within, as flag 0 holds.

    Parameters
    ----------
    plan
        What is exported.
    seconds
        Time without a good reading before the false one [s], beside one sample interval.
    spell
        Whether all that windows hold and memories took in may be false, or one reading alone.
    seed
        Seed of the points.
    turning_deg_s
        Rate that the gyro turns at, either way [deg/s]; it matters to a model with a scale factor alone.
    """
    off = plan.thermometer.off_degC(plan.sample_s + seconds)
    shift = np.array([off * atom_gain(atom, plan.sample_s, spell) for atom in plan.atoms])
    moved = np.flatnonzero(shift > 0.0)
    if not len(moved):
        return 0.0
    low, high = plan.limits.box_low, plan.limits.box_high
    rng = np.random.default_rng([seed, 3])
    points = np.concatenate([box_points(plan, seed, count=_POINTS), _corners(low, high, rng)])
    columns, worst = plan.full_columns(points), 0.0
    turning = 3600.0 * turning_deg_s / plan.arrays["scale"][0] if plan.gives_rate else 0.0
    outputs = [np.full(len(points), output) for output in {turning, -turning}]
    before = [plan.value(columns, output) for output in outputs]
    for signs in _signs(len(moved), rng):
        false = points.copy()
        false[:, moved] += signs * shift[moved]
        taken = plan.full_columns(np.clip(false, low, high))
        for output, sound in zip(outputs, before, strict=True):
            worst = max(worst, float(np.abs(plan.value(taken, output) - sound).max()))
    return worst


def false_readings(plan: Plan, seed: int = 0) -> dict[str, Any] | None:
    """What ``export.json`` says of it; None where no thermometer is read."""
    if not any(is_temperature(name) for name in plan.sensors):
        return None
    rule = plan.thermometer

    def errors(name: str, seconds: float, turning_deg_s: float) -> dict[str, float]:
        return {
            f"{which}_{name}": false_reading_error(
                plan, seconds, spell=which == "spell", seed=seed, turning_deg_s=turning_deg_s
            )
            for which in ("one", "spell")
        }

    return {
        "step_degC": rule.jump_degC,
        "rate_degC_s": rule.rate_degC_s,
        "spell_s": rule.spell_s,
        **({"turning_deg_s": TURNING_DEG_S} if plan.gives_rate else {}),
        "largest_error": [
            {
                "missing_s": seconds,
                "off_degC": rule.off_degC(plan.sample_s + seconds),
                **errors("deg_h", seconds, 0.0),
                **(errors("turning_deg_h", seconds, TURNING_DEG_S) if plan.gives_rate else {}),
            }
            for seconds in SECONDS
        ],
    }


def false_reading_lines(told: dict[str, Any] | None) -> list[str]:
    """The same as lines of text."""
    if told is None:
        return []
    first, *_, last = told["largest_error"]
    lines = [
        f"readings      believed within {ascii_number(told['step_degC'])} degC and "
        f"{ascii_number(told['rate_degC_s'])} degC/s of the last good one;",
        f"              a false one that passes is off by up to {ascii_number(first['off_degC'])} degC and "
        "makes, at",
        f"              flag 0, an error of up to {ascii_number(first['one_deg_h'])} deg/h, a spell of such "
        f"{ascii_number(first['spell_deg_h'])} deg/h;",
        f"              after {last['missing_s']:g} s without a good one "
        f"{ascii_number(last['off_degC'])} degC, {ascii_number(last['one_deg_h'])} and "
        f"{ascii_number(last['spell_deg_h'])} deg/h",
    ]
    if "turning_deg_s" in told:
        soon, late = (
            f"{ascii_number(part['one_turning_deg_h'])} and {ascii_number(part['spell_turning_deg_h'])} deg/h"
            for part in (first, last)
        )
        lines.append(f"              at rest; turning at {told['turning_deg_s']:g} deg/s {soon}, then {late}")
    return lines


def atom_gain(atom: Atom, sample_s: float, spell: bool) -> float:
    """How far an atom moves at most where readings are off by 1 degC: all that it holds, or one of them."""
    moved = sum(abs(weight) for name, weight in atom.signal.parts if is_temperature(name))
    if atom.operator == "sign":
        return 2.0 * float(np.sign(moved))
    if (own := atom.declared) is not None:
        # Where a curve tells none, what flag 0 lets through is its bound.
        gain = own.gain
        if not spell and isinstance(own, Recursion) and own.single_gain is not None:
            gain = own.single_gain(*atom.given, sample_s)
        return gain * moved if moved else 0.0
    if atom.window is None:
        return moved
    method, length = atom.window.method, atom.window.length_s or sample_s
    unit = length if atom.operator == "diff" else RATE_UNIT_S
    if spell or atom.window.own is not None:
        weights = _ALL.get(method, 2.0) if atom.window.own is None else atom.window.own.gain
        return moved * weights * unit / length
    share = _ONE[method] * min(1.0, sample_s / length) if method in _ONE else 1.0
    return moved * share * unit / length


def _corners(low: FloatArray, high: FloatArray, rng: np.random.Generator) -> FloatArray:
    return np.asarray(np.where(_signs(len(low), rng) > 0.0, high, low))


def _signs(count: int, rng: np.random.Generator) -> FloatArray:
    """All combinations of -1 and 1, or some of them where there are many; shape (s, count)."""
    if 2**count <= _MOST_SIGNS:
        return np.array(list(product((-1.0, 1.0), repeat=count)))
    drawn = rng.choice([-1.0, 1.0], (_MOST_SIGNS - 2, count))
    return np.concatenate([np.ones((1, count)), -np.ones((1, count)), drawn])
