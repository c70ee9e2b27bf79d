"""The worst case of fixed point, proven: how far whole numbers can be from the model over the trained box.

Every value is followed with the largest size that it takes there and a bound of its error: temperatures as
whole steps, windows and memories, coefficients as they are stored, and the rounding after every operation.
What windows make of bins of samples is no matter of fixed point, and not in it.
"""

from __future__ import annotations

from math import exp

import numpy as np

from fogml.arrays import FloatArray
from fogml.export.c_fixed import EXP_ERROR, weight_units
from fogml.export.c_own import KERNEL_BITS, kernel_steps
from fogml.export.false_readings import atom_gain
from fogml.export.fixed_scales import (
    HELD_BITS,
    SIGNAL_SHIFT,
    VALUE_BITS,
    Scales,
    common_bits,
    divide_bits,
    fitting_bits,
    product_range,
)
from fogml.export.layout import RANGE_BITS, Layout, Operator
from fogml.export.plan import Plan
from fogml.export.points import GYRO_DEG_H
from fogml.features.atoms import Atom
from fogml.features.operators import BEYOND, LAG, PLAY
from fogml.features.traced import BITS
from fogml.numerals import ascii_number
from fogml.signals.clock import EDGE_TOLERANCE, LEAST_SHARE, told_share
from fogml.signals.kernel_windows import Kernel

_HELD, _OWN = 2.0**-HELD_BITS, 2.0**-BITS
_SHARES = np.linspace(0.01, 1.0, 1000)
_FILLING = float(np.max(told_share(_SHARES, LEAST_SHARE) / _SHARES)) * (1.0 + 2.0**-8)
"""How much more the rounding of its samples can move a window that fills than a full one."""
_STEEPEST, _LARGEST, _TWICE = (2.0 / exp(1.0)) ** 0.5, (0.5 / exp(1.0)) ** 0.5, 2.0 / exp(1.0)
# Of exp(-z^2): its steepest slope, and the largest of z and of 2 z^2 times it.


def fixed_point_error(plan: Plan, windows: Layout, dtype: str) -> float | None:
    """Largest difference of C in ``q31`` or ``q15`` from the plan in the trained box [deg/h], or None.

    For outputs up to 20 deg/h of a model with a scale factor. A direction within a rounding of its dead band
    is not in it. Slopes over bins and windows of one's own are bounded at even intervals, for signals whose
    rate stays in its trained range and whose readings jump by no more than the rule of readings lets pass;
    the latter where they are full. None where an operator of one's own computes, or a window of one's own
    tells no rate of the few samples that it holds.
    """
    scales = Scales(plan, dtype)
    atoms = np.array([_atom_error(i, plan, windows, scales) for i in range(len(plan.atoms))])
    if not np.all(np.isfinite(atoms)):
        return None
    columns = _column_errors(plan, scales, atoms)
    unit, arrays = 0.5 * 2.0**-scales.drift, plan.arrays
    total = unit + 0.5 * 2.0**-scales.output_bits
    taken = 0.0 if plan.gives_rate and plan.gyro_unit == "count" else 0.5 * 2.0**-scales.gyro_bits
    if "linear" in arrays:
        linear = np.abs(arrays["linear"])
        stored = np.abs(scales.linear * 2.0**-scales.linear_bits - arrays["linear"])
        total += float(np.sum(linear * columns + stored * (scales.most + columns) + unit))
    if plan.centres:
        total += _gaussians_error(plan, scales, columns, 1 << (VALUE_BITS - scales.stored_bits))
    if plan.gives_rate:
        most, gyro = float(scales.most[0]), GYRO_DEG_H / abs(float(arrays["scale"][0]))
        step, (_, s1, s2) = 2.0**-scales.scale_bits, np.abs(arrays["scale"])
        off = step * (2.0 + most + most**2) + float(columns[0]) * (s1 + 2.0 * most * s2)
        total += gyro * off + unit
        taken *= float(np.abs(arrays["scale"]) @ most ** np.arange(3))
    total += taken
    return float(total) if np.isfinite(total) else None


def _atom_error(i: int, plan: Plan, windows: Layout, scales: Scales) -> float:
    """Bound of an atom's error, its rounding to its own steps included."""
    atom, place = plan.atoms[i], windows.of_atom[i]
    own = 0.5 * 2.0 ** -int(scales.atoms[i])
    if atom.operator == "sign":
        return 0.0
    shift = HELD_BITS - scales.temperature_bits + SIGNAL_SHIFT
    given = np.array([coefficient for _, coefficient in atom.signal.parts])
    coefficients = np.abs(given)
    stored = np.abs(np.round(given * 2.0**shift) * 2.0**-shift - given)
    read = 0.5 * 2.0**-scales.temperature_bits * float(coefficients.sum())
    signal = read + float(stored.sum()) * 2.0**RANGE_BITS + 0.5 * _HELD
    # The box's ends and what levels off beyond are rounded, too.
    own *= 3.0
    if atom.declared is not None:
        return own + _declared_error(atom, signal, plan)
    if place < 0:
        return signal + own
    operator = windows.operators[place]
    return own + _operator_error(atom, operator, signal / float(coefficients.sum()), plan, windows)


def _declared_error(atom: Atom, signal: float, plan: Plan) -> float:
    """Bound of a declared operator's error, its signal being off by `signal`; infinite where none is proven.

    A lag's share forgotten is off by a factor, at even intervals the same at each step: its distance from
    the signal is then off by that factor of how far it is from its own mean, at most twice the span.
    """
    if atom.declared is not LAG:
        return signal + 4.0 * _OWN if atom.declared in (PLAY, BEYOND) else float("inf")
    share = plan.sample_s / atom.memory
    off = 5.0 * _OWN + (EXP_ERROR if share > 2.0**-10.5 else share**4 / 24.0)
    gone, span = 1.0 - exp(-share), _span(atom, plan)
    return 2.0 * signal + 2.0 * span * (off / gone + _OWN) + 2.0 * _OWN / gone


def _operator_error(atom: Atom, operator: Operator, read: float, plan: Plan, windows: Layout) -> float:
    """Bound of a window's error, its signal being off by `read` for each unit of its weights."""
    length, step = operator.window.length_s, plan.sample_s
    span = _span(atom, plan)
    gain = atom_gain(atom, step, spell=True)
    if operator.window.held:
        gain *= _FILLING
    unit_s = length if operator.unit_s is None else operator.unit_s
    held = 2.0 * _HELD if windows.binned else 0.0
    if operator.method == "block":
        means = gain * (read + held + 2.0 ** -(HELD_BITS + 8))
        if operator.unit_s is None:
            return means
        unit = round(operator.unit_s / windows.tick_s)
        age = span * gain * 2.0**-3 / operator.window_ticks
        return means + age + unit * 2.0 ** -(HELD_BITS + divide_bits(unit))
    if operator.method == "slope":
        unit = round(2.0**18 * unit_s / (windows.tick_s * operator.window_ticks))
        rounding = unit * 2.0 ** -(HELD_BITS + divide_bits(unit))
        binned = _FILLING * _binned_slope_error(atom, operator, plan, windows) if windows.binned else 0.0
        ages = 24.0 * 2.0**-17 * span + binned
        return gain * (read + held + 3.0 * _HELD) + ages * unit_s / length + rounding
    if (kernel := operator.window.own) is not None:
        unit = round(2.0**18 * unit_s / (windows.tick_s * operator.window_ticks))
        rounding = unit * 2.0 ** -(HELD_BITS + divide_bits(unit))
        read = read * sum(abs(weight) for _, weight in atom.signal.parts) + held
        return _kernel_error(kernel, read, atom, operator, plan, windows) * unit_s / length + rounding
    if operator.method == "first":
        if operator.unit_s is None:
            return gain * read
        unit = round(operator.unit_s * 1e6)
        return gain * read + unit * 2.0 ** -(HELD_BITS + divide_bits(unit))
    unit, steps = round(unit_s * 1e6), max(1.0, length / step)
    rounding = unit * 2.0 ** -(HELD_BITS + divide_bits(unit)) + 2.0**-24 + steps * 2.0**-25
    return gain * read + rounding + 3.0 * span * steps * (EXP_ERROR + 2.0**-30) * unit_s / length


def _binned_slope_error(atom: Atom, operator: Operator, plan: Plan, windows: Layout) -> float:
    """Bound of what weights, times and rises of bins lose by rounding, over a slope's whole window [degC].

    With n bins of weight w, ages a about their mean and deviations e from the line, a change dw of weights
    moves the slope by ``sum(dw a e)/sum(w a^2)``, at most ``3 |dw| |e|/w`` per window.
    """
    length = operator.window.length_s
    jump, varies, change = _moves(atom, operator, plan)
    count = length / (windows.bin_samples * plan.sample_s)
    off_line = 0.25 * varies + jump
    rise = 2.0 * jump + change / count
    step = 0.5 / (2.0**22 * plan.sample_s / length)
    return (
        1.5 * off_line / weight_units(windows)
        + step * (rise / count + 2.0 * change / count**2)
        + 3.0 * _HELD / count
    )


def _kernel_error(
    kernel: Kernel, read: float, atom: Atom, operator: Operator, plan: Plan, windows: Layout
) -> float:
    """Bound of what a full window of one's own is off [degC per window], values held being off by `read`.

    Of weights w, ages a about their mean and deviations e from the line of the rate r, errors dw, da and dx
    move the rate by ``sum(dw e + w (r da + dx))/sum(w a)``, w about its mean. A bin of length A, in
    which weights fall by F and readings rise by R, adds up to a quarter of ``F R`` and ``F A``.
    """
    length, step = operator.window.length_s, plan.sample_s
    knots = kernel_steps(kernel) * 2.0**-KERNEL_BITS
    age = np.arange(np.ceil(length / step - EDGE_TOLERANCE)) * step / length
    weight = np.interp(age, np.linspace(0.0, 1.0, len(knots)), knots)
    moment = -float(np.mean(weight * (age - age.mean())))
    if moment <= 0.0:
        return float("inf")
    size = float(np.mean(np.abs(weight - weight.mean())))
    steepest = float(np.abs(np.diff(knots)).max()) * (len(knots) - 1)
    jump, varies, change = _moves(atom, operator, plan)
    off_line = 0.5 * varies + jump
    tick = 1.0 / operator.window_ticks
    placed, unit = 0.25 * tick + 2.0**-19, 2.0**-KERNEL_BITS
    # The edge is drawn in by two ticks, by which weights are off, too.
    weighed = 1.5 * unit + steepest * (placed + 2.0 * tick)
    off = size * read + weighed * off_line + (size + unit) * (placed * change + 0.5 * _HELD)
    if windows.binned:
        bins = length / (windows.bin_samples * step)
        falls = float(np.abs(np.diff(knots)).sum()) / bins
        shares = (0.5 + 0.5 / bins) / weight_units(windows)
        falling = unit + steepest * (placed + 2.0**-18)
        off += (shares * (size + 0.5 * falls) + falling) * off_line + 2.0**-35 * (change + 1.0)
        off += 0.25 * falls * (2.0**-22 * change + 3.5 * _HELD) + 1.5 * _HELD / bins
    return off / moment


def _moves(atom: Atom, operator: Operator, plan: Plan) -> tuple[float, float, float]:
    """Largest jump of readings [degC], spread and largest of the trained rates [degC per window]."""
    i, length = plan.atoms.index(atom), operator.window.length_s
    per_window = length / (length if operator.unit_s is None else operator.unit_s)
    low, high = float(plan.limits.box_low[i]), float(plan.limits.box_high[i])
    jump = plan.thermometer.jump_degC * sum(abs(weight) for _, weight in atom.signal.parts)
    return jump, (high - low) * per_window, max(abs(low), abs(high)) * per_window


def _span(atom: Atom, plan: Plan) -> float:
    """How far an atom's signal is from itself at most [degC]: as trained, where its value is an input."""
    for i, other in enumerate(plan.atoms):
        if other.operator == "value" and other.signal == atom.signal:
            return float(plan.limits.box_high[i] - plan.limits.box_low[i])
    return 2.0**RANGE_BITS


def _column_errors(plan: Plan, scales: Scales, atoms: FloatArray) -> FloatArray:
    """Bounds of the columns' errors, products being taken as `c_fixed` takes them."""
    limits = plan.limits
    low, high = limits.low - limits.margin, limits.high + limits.margin
    size = np.maximum(np.abs(low), np.abs(high))
    found: list[float] = []
    for place, step in enumerate(plan.steps):
        factors = list(step.atoms)
        if step.column is None:
            first = factors.pop(0)
            most, off, span = float(size[first]), float(atoms[first]), (float(low[first]), float(high[first]))
        else:
            most, off, span = float(scales.most[step.column]), found[step.column], (0.0, 0.0)
        for atom in factors:
            into = int(scales.columns[place])
            if step.column is None:
                span = product_range(span, (float(low[atom]), float(high[atom])))
                into = fitting_bits(max(abs(span[0]), abs(span[1])))
            off = off * (size[atom] + atoms[atom]) + most * atoms[atom] + 0.5 * 2.0**-into
            most *= float(size[atom])
        found.append(float(off + 0.5 * 2.0 ** -int(scales.columns[place])))
    return np.array(found)


def _gaussians_error(plan: Plan, scales: Scales, columns: FloatArray, step: int) -> float:
    arrays, seen = plan.arrays, list(plan.columns)
    inverse, unit = 1.0 / arrays["widths"], 2.0 ** -scales.columns[seen]
    off, moved = columns[seen], np.zeros(len(seen))
    if plan.edge_columns:
        off, moved = _drawn(plan, scales, columns)
    centres = np.round(arrays["centres"] / unit / step) * unit * step
    stored = np.array([common_bits(inverse[:, d], scales.stored_bits) for d in range(len(seen))])
    relative = np.abs(np.round(inverse * 2.0**stored) * 2.0**-stored / inverse - 1.0)
    placed = (off + np.abs(centres - arrays["centres"])) * inverse * (1.0 + relative) + 0.5 * 2.0**-27
    basis = np.sum(_STEEPEST * placed + placed**2 + _TWICE * relative + 0.5 * 2.0**-26, axis=1) + EXP_ERROR
    if plan.edge_columns:
        # basis * (1 - 2 along), along = z step / width
        along = moved * inverse
        slipped = _LARGEST * (off + columns[seen]) * inverse + along * (placed + relative) + 2.0**-19
        basis += 2.0 * np.sum(slipped + 8.0 * along * basis[:, None], axis=1)
    weights = np.abs(arrays["weights"])
    kept = np.abs(np.round(arrays["weights"] * 2.0**scales.weight_bits) * 2.0**-scales.weight_bits)
    reach = 1.0 + 2.0 * _LARGEST * float(np.max(np.sum(moved * inverse, axis=1)))
    own = (
        0.5
        * 2.0 ** -(scales.weight_bits + VALUE_BITS - scales.stored_bits)
        * (1.0 + 2048.0 * bool(moved.any()))
    )
    return float(np.sum(weights * basis + np.abs(kept - weights) * reach + own + 2.0**-scales.drift))


def _drawn(plan: Plan, scales: Scales, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Errors of the Gaussians' columns drawn in to the trained rates, and how far each is drawn at most."""
    edges, seen = list(plan.edge_columns), list(plan.columns)
    bound = np.abs(plan.edge)
    with np.errstate(divide="ignore"):
        share = float(np.max(columns[edges] / bound)) + 2.0**-30
    least = float(np.min(np.minimum(1.0, bound / scales.most[edges])))
    off, moved = columns[seen].copy(), np.zeros(len(seen))
    for d, k in enumerate(seen):
        if k in edges and least < 1.0:
            off[d] += scales.most[k] * share + 0.5 * 2.0 ** -int(scales.columns[k])
            moved[d] = scales.most[k] * (1.0 - least)
    return off, moved


def fixed_point_lines(proven: float | None, plan: Plan, windows: Layout) -> list[str]:
    """The proven worst case as lines of text."""
    filling = any(atom.window is not None and atom.window.own is not None for atom in plan.atoms)
    if proven is None:
        return [
            "worst case    of fixed point not proven, as the model takes an operator of one's own, or a",
            "              window of one's own that tells no rate of the few samples that it holds;",
            "              export.json has what was measured",
        ]
    told = (
        f"worst case    fixed point is at most {ascii_number(proven)} deg/h off in the trained box, by proof"
    )
    if plan.gives_rate:
        told += f" of outputs up to {GYRO_DEG_H:g} deg/h"
    lines = [told]
    if filling:
        lines.append("              where its windows of one's own are full")
    if windows.binned:
        lines.append("              beside what bins of samples make of windows, measured in export.json")
    return lines
