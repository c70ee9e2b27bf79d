"""C of declared operators and windows of one's own: what their functions do to symbols, tables, kernels."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from math import isfinite
from typing import Any

import numpy as np

from fogml.arrays import FloatArray, IntArray
from fogml.errors import InputError
from fogml.escaping import CCode
from fogml.export.layout import Layout, Operator
from fogml.export.plan import Plan
from fogml.features import traced
from fogml.features.atoms import Atom
from fogml.features.own import Function, Recursion
from fogml.features.traced import Symbol, Writer
from fogml.runs.columns import is_temperature
from fogml.signals.kernel_windows import Kernel

Number = Callable[[float], str]
CURVE_ERROR = 1e-7
"""How far a table may be from its curve, as a share of the curve's span."""
_FEWEST, _MOST = 32, 1024
_BEYOND = 0.5
# Spans of the trained range that a table goes on for beyond it: values there are flagged.
_HELD_TO = 1e-3
# As a share: what fixed point may lose of a constant.
KERNEL_BITS = 17
"""In fixed point a window's weights lie within 2**17 either way: their sums with temperatures fit 63 bits."""


def fixed_number(value: float) -> str:
    """A number in steps of 2**-32.

    Raises
    ------
    InputError
        If those hold it to less than a thousandth, or it is too large.
    """
    whole = round(value * 2.0**traced.BITS) if isfinite(value) else 0
    if not abs(value) < traced.MOST or abs(whole * 2.0**-traced.BITS - value) > _HELD_TO * abs(value):
        raise InputError(
            f"export: a number of a declared operator is {value:g}, which steps of 2^-{traced.BITS} do not "
            "hold; use --dtype float32 or float64"
        )
    return f"INT64_C({whole})"


def own_context(plan: Plan, windows: Layout, number: Number, real: str) -> dict[str, Any]:
    """The templates' values; `number` writes a constant, `real` is the type: int64_t in fixed point."""

    def writer() -> Writer:
        return Writer(real, number, real == "int64_t")

    functions = [_function(plan, atom, writer) for atom in function_atoms(plan)]
    recursions = [_recursion(o, writer) for _, o in windows.of_method("own")]
    calls = set().union(*(own["calls"] for own in (*functions, *recursions)))
    return {
        "kernels": [
            {"name": f"KERNEL_{place}", "count": len(operator.window.own.weights)}
            for place, (_, operator) in enumerate(windows.lines)
            if operator.window.own is not None
        ],
        "functions": functions,
        "recursions": recursions,
        "calls": calls,
        "divides": "divided" in calls or any(own["kept"] for own in recursions),
    }


def own_constants(plan: Plan, windows: Layout, number: Number, real: str) -> list[str]:
    """Lines of the tables of kernels and curves."""
    lines = []
    for place, (_, operator) in enumerate(windows.lines):
        if operator.window.own is not None:
            kernel, kind = operator.window.own, real
            if real == "int64_t":
                kind, weights = "int32_t", [f"INT32_C({weight})" for weight in kernel_steps(kernel).tolist()]
            else:
                weights = [number(weight) for weight in kernel.weights]
            held = f"[{len(weights)}] = {{ {', '.join(weights)} }}"
            lines.append(f"static const {kind} KERNEL_{place}{held}; /* by age */")
    for k, atom in enumerate(function_atoms(plan)):
        if _traced(atom, Writer(real, number, False)) is None:
            first, step, knots = _curve(plan, atom)
            rows = ", ".join(f"{{ {number(value)}, {number(rise)} }}" for value, rise in knots.tolist())
            lines += [
                f"/* {atom.text}: values and rises by knot, from {first:.9g} in steps of {step:.9g}. */",
                f"static const {real} CURVE_{k}[{len(knots)}][2] = {{ {rows} }};",
            ]
    return lines


def kernel_steps(kernel: Kernel) -> IntArray:
    """Weights for fixed point, about the middle of their range: a rate knows neither it nor scale."""
    weights = np.array(kernel.weights)
    low, high = weights.min(), weights.max()
    return np.round((2.0 * weights - high - low) / (high - low) * 2.0**KERNEL_BITS).astype(np.int64)


def function_atoms(plan: Plan) -> list[Atom]:
    """The atoms that are functions of a signal's present value, each once."""
    return list(dict.fromkeys(atom for atom in plan.atoms if isinstance(atom.declared, Function)))


def _traced(atom: Atom, writer: Writer) -> Any:
    """What a function makes of a symbol; None where it takes none."""
    assert isinstance(atom.declared, Function)
    try:
        found = traced.traced(atom.declared.function, Symbol(writer, "x"), *atom.given)
    except InputError:
        return None
    return found if isinstance(found, Symbol) or np.ndim(found) == 0 else None


def _function(plan: Plan, atom: Atom, make: Callable[[], Writer]) -> dict[str, Any]:
    value = _traced(atom, writer := make())
    if value is None:
        writer = make()
        first, step, knots = _curve(plan, atom)
        place = (Symbol(writer, "x") - first) * (1.0 / step)
        k = function_atoms(plan).index(atom)
        value = writer.line(f"curve_at(CURVE_{k}, {len(knots)}, {{}})", place)
        writer.calls.add("curve_at")
    result = writer.text(value)
    return {
        "text": atom.text,
        "lines": _lines(writer.lines, [result]),
        "result": CCode(result),
        "takes": bool(writer.inputs),
        "calls": writer.calls,
    }


def _curve(plan: Plan, atom: Atom) -> tuple[float, float, FloatArray]:
    """First knot, step, and value and rise (to the next knot's place) by knot, shape (n, 2)."""
    declared, (low, high) = atom.declared, _range(plan, atom)
    assert isinstance(declared, Function)

    def value(x: FloatArray) -> FloatArray:
        return np.broadcast_to(np.asarray(declared.function(x, *atom.given), dtype=np.float64), x.shape)

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
        f"{CURVE_ERROR:g} of its span: it has corners or steps; write it with where, larger and smaller of "
        "fogml.features.traced, or export --to onnx"
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


def _recursion(operator: Operator, writer: Callable[[], Writer]) -> dict[str, Any]:
    """Lines of a declared operator's start, step, and value."""
    atom = operator.own
    assert atom is not None and isinstance(atom.declared, Recursion)
    declared, given = atom.declared, atom.given
    start, step, told = writer(), writer(), writer()
    states = len(declared.start(0.0, *given))

    def held(at: Writer) -> tuple[Symbol, ...]:
        return tuple(Symbol(at, f"s{i}") for i in range(states))

    def made(at: Writer, values: Any) -> list[CCode]:
        return [CCode(at.text(value)) for value in values]

    try:
        begun = made(start, traced.traced(declared.start, Symbol(start, "x"), *given))
        inputs = (Symbol(step, name) for name in ("x", "last"))
        dt = Symbol(step, "dt", stepwise=True)
        gone_on = made(step, traced.traced(declared.step, held(step), *inputs, dt, *given))
        settled: Any = ()
        if declared.settled is not None:
            settled = made(told, [traced.traced(declared.settled, held(told), Symbol(told, "x"), *given)])
        value = made(told, [traced.traced(declared.value, held(told), Symbol(told, "x"), *given)])
    except InputError as error:
        raise InputError(f"export: the model takes {atom.text}: {error}; or export --to json") from None
    return {
        "text": atom.text,
        "states": states,
        "start": (_lines(start.lines, begun), begun),
        "steps": _lines(step.step_lines, step.kept),
        "step": (_lines(step.lines, gone_on), gone_on),
        "kept": [CCode(name) for name in step.kept],
        "told": (_lines(told.lines, [*value, *settled]), value[0]),
        "settled": settled,
        "needed": f"INT64_C({operator.needed_ticks})",
        "step_inputs": step.inputs,
        "told_inputs": told.inputs,
        "timed": declared.time_constant is not None,
        "calls": start.calls | step.calls | told.calls,
    }


def _lines(lines: Sequence[str], results: Sequence[str]) -> list[CCode]:
    """The lines that results need."""
    needed, kept = set(results), []
    for line in reversed(lines):
        declared, _, expression = line.partition(" = ")
        if declared.rsplit(" ", 1)[1] in needed:
            needed |= set(re.findall(r"\w+", expression))
            kept.append(CCode(line))
    return kept[::-1]
