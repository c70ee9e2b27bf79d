"""C of operators and windows of one's own: tables of curves, recursions by their own C, kernels."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.escaping import CCode
from fogml.export.layout import Layout
from fogml.export.plan import Plan
from fogml.features.atoms import Atom
from fogml.features.own import Function, Recursion
from fogml.runs.columns import is_temperature

FloatArray = NDArray[np.float64]
Number = Callable[[float], str]
CURVE_ERROR = 1e-7
"""How far a table may be from its curve, as a share of the curve's span."""
_FEWEST, _MOST = 32, 1024
_BEYOND = 0.5
# Spans of the trained range that a table goes on for beyond it: values there are flagged.


def own_context(plan: Plan, windows: Layout, number: Number, real: str) -> dict[str, Any]:
    """The templates' values for float64 or float32."""
    return {
        "kernels": [
            {"name": f"KERNEL_{place}", "count": len(operator.window.own.weights)}
            for place, (_, operator) in enumerate(windows.lines)
            if operator.window.own is not None
        ],
        "curves": [_curve(plan, atom) for atom in curve_atoms(plan)],
        "recursions": [
            _recursion(operator.own, operator.needed_ticks, number, real)
            for _, operator in windows.of_method("own")
        ],
    }


def own_constants(plan: Plan, windows: Layout, number: Number, real: str) -> list[str]:
    """Lines of the tables of kernels and curves."""
    lines = []
    for place, (_, operator) in enumerate(windows.lines):
        if operator.window.own is not None:
            weights = ", ".join(number(weight) for weight in operator.window.own.weights)
            size = len(operator.window.own.weights)
            lines.append(f"static const {real} KERNEL_{place}[{size}] = {{ {weights} }}; /* by age */")
    for k, atom in enumerate(curve_atoms(plan)):
        first, step, knots = _curve(plan, atom)
        rows = ", ".join(f"{{ {number(value)}, {number(slope)} }}" for value, slope in knots.tolist())
        lines += [
            f"/* {atom.text}: values and rises by knot, from {first:.9g} in steps of {step:.9g}. */",
            f"static const {real} CURVE_{k}[{len(knots)}][2] = {{ {rows} }};",
        ]
    return lines


def curve_atoms(plan: Plan) -> list[Atom]:
    """The atoms that are functions of one's own, each once."""
    return list(dict.fromkeys(atom for atom in plan.atoms if isinstance(atom.own, Function)))


def curve_expression(plan: Plan, atom: Atom, signal: str, number: Number) -> str:
    """A curve's value at a signal."""
    first, step, knots = _curve(plan, atom)
    k = curve_atoms(plan).index(atom)
    return f"curve_at(CURVE_{k}, {len(knots)}, ({signal} - {number(first)}) * {number(1.0 / step)})"


def _curve(plan: Plan, atom: Atom) -> tuple[float, float, FloatArray]:
    """First knot, step, and value and rise (to the next knot's place) by knot, shape (n, 2)."""
    declared, (low, high) = atom.own, _range(plan, atom)
    assert isinstance(declared, Function)

    def value(x: FloatArray) -> FloatArray:
        return np.broadcast_to(np.asarray(declared.function(x, *atom.parameters), dtype=np.float64), x.shape)

    fine = np.linspace(low, high, 16 * _MOST + 1)
    exact = value(fine)
    size = float(np.ptp(exact)) or 1.0
    count = _FEWEST
    while count <= _MOST:
        x = np.linspace(low, high, count + 1)
        step = (high - low) / count
        near = 1e-3 * step
        rise = (value(x + near) - value(x - near)) * (0.5 * step / near)
        knots = np.column_stack([value(x), rise])
        if (
            np.all(np.isfinite(knots))
            and np.abs(_cubic(knots, (fine - low) / step) - exact).max() <= CURVE_ERROR * size
        ):
            return low, step, knots
        count *= 2
    raise InputError(
        f"export: the model takes {atom.text}, which a table of {_MOST} knots does not hold to "
        f"{CURVE_ERROR:g} of its span: it has corners or steps; declare it as a Recursion with its C, or "
        "export --to onnx"
    )


def _cubic(knots: FloatArray, place: FloatArray) -> FloatArray:
    """What ``curve_at`` computes."""
    i = np.clip(place.astype(int), 0, len(knots) - 2)
    t = np.clip(place - i, 0.0, 1.0)
    (y0, r0), (y1, r1) = knots[i].T, knots[i + 1].T
    d = y1 - y0
    return np.asarray(y0 + t * (r0 + t * (3.0 * d - 2.0 * r0 - r1 + t * (r0 + r1 - 2.0 * d))))


def _range(plan: Plan, atom: Atom) -> tuple[float, float]:
    """The inputs that a curve is held for: the trained range and half of it beyond."""
    for i, other in enumerate(plan.atoms):
        if other.operator == "value" and other.signal == atom.signal:
            low, high = float(plan.limits.box_low[i]), float(plan.limits.box_high[i])
            return low - _BEYOND * (high - low), high + _BEYOND * (high - low)
    if atom.signal.is_sensor and is_temperature(atom.signal.sensors[0]):
        return plan.thermometer.low_degC, plan.thermometer.high_degC
    raise InputError(
        f"export: the model takes {atom.text}, a table of which needs the range of {atom.signal.text}; take "
        f"{atom.signal.text} as a feature, too, and train again"
    )


def _recursion(atom: Atom | None, needed_ticks: int, number: Number, real: str) -> dict[str, Any]:
    assert atom is not None and isinstance(atom.own, Recursion) and atom.own.c is not None
    code = atom.own.c

    def written(text: str) -> CCode:
        text = re.sub(r"\bREAL\b", real, text)
        return CCode(re.sub(r"\bR\(([^()]*)\)", lambda match: number(float(match[1])), text))

    timed = atom.own.time_constant is not None
    return {
        "text": atom.text,
        "states": max(1, len(atom.own.start(0.0, *atom.parameters))),
        "parameters": CCode(", ".join(number(value) for value in atom.parameters or (0.0,))),
        "start": written(code.start),
        "step": written(code.step),
        "value": written(code.value),
        "settled": written(code.settled or "true"),
        "timed": timed,
        "needed": f"INT64_C({needed_ticks if timed else 0})",
    }
