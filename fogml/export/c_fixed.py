"""What C source in fixed point is filled with: whole numbers, and the powers of two that they count.

Limited atoms cannot leave a known range (see `fogml.features.box`), so the range of every feature
and of every sum is known when the code is made; steps are chosen so that nothing overflows, and
a model for which none can be found is refused. Arithmetic is in 64 bits; ``q31`` stores numbers
in 32 bits, ``q15`` in 16 bits and takes temperatures in 16.
"""

from __future__ import annotations

from math import factorial, floor, log, log2
from typing import Any

import numpy as np

from fogml.errors import InputError
from fogml.escaping import CCode
from fogml.export.c_flags import slice_inputs, slice_numbers, thermometer_rule
from fogml.export.c_float import TYPES, array, box_lines, edge_lines, sensor_identifier, slice_lines
from fogml.export.c_own import fixed_number, function_atoms, own_constants, own_context
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
from fogml.export.layout import Layout
from fogml.export.plan import Plan
from fogml.features.atoms import DEAD_BAND
from fogml.features.own import Function
from fogml.features.traced import BITS

EXP_ERROR = 3e-8
"""Greatest absolute error of the generated exponential, its argument's rounding included."""


def fixed_context(plan: Plan, windows: Layout, dtype: str) -> dict[str, Any]:
    """The templates' values for ``q31`` or ``q15``.

    Raises
    ------
    InputError
        If a range is too wide for the format.
    """
    from fogml.export.c_source import units_of

    scales = Scales(plan, dtype)
    bits, output_bits = scales.temperature_bits, scales.output_bits
    most = 2 ** (31 - output_bits)
    fixed = {
        "temperature_unit": f"{2.0**-bits!r}",
        "temperature_value": 2.0**-bits,
        "temperature_most": 2.0 ** (15 if dtype == "q15" else 31) - 1.0,
        "gyro_value": 2.0**-scales.gyro_bits,
        "gyro_unit": repr(2.0**-scales.gyro_bits),
        "compensated_value": 2.0**-output_bits,
        "compensated_unit": repr(2.0**-output_bits),
        "compensated_most": f"{most}.0",
        "atom_bits": scales.atoms.tolist(),
        "column_bits": scales.columns.tolist(),
        "drift_bits": scales.drift,
        "signal_note": f", steps of 2^-{HELD_BITS}",
        "output_note": f", steps of 2^-{output_bits}",
    }
    gyro = (
        f"[{plan.gyro_unit}]"
        if plan.gives_rate and plan.gyro_unit == "count"
        else f"output as rate, whole steps of 2^-{output_bits} deg/h"
    )
    compensated = [
        f"Outputs are whole steps of 2^-{output_bits} deg/h; the units are defined below. They hold {most}",
        f"deg/h ({most / 3600.0:.0f} deg/s) either way; what lies beyond stays at that end, without a flag.",
    ]
    units = units_of(plan, gyro, f"whole steps of 2^-{bits} degC, in the order of the places below")
    width = 16 if dtype == "q15" else 32
    ends = [
        f"Temperatures hold {2 ** (width - 1 - bits)} degC either way. INT{width}_MIN and INT{width}_MAX are",
        "no readings: give one of them where there is none, and for what lies beyond.",
    ]
    exp_terms = [round((-log(2.0)) ** n / factorial(n) * 2.0**30) for n in range(10, -1, -1)]
    rates = any(o.method not in ("first", "own") or o.unit_s for o in windows.operators)
    own = own_context(plan, windows, fixed_number, "int64_t")
    readable = (fixed["temperature_most"] - 1.0) * 2.0**-bits  # the ends of their type are none
    return {
        "fixed": fixed,
        **own,
        "rates": rates,
        "ratios": rates or bool(plan.centres and plan.edge_columns) or own["divides"],
        "slice_inputs": slice_inputs(plan, scales.atoms),
        "suffix": "",
        "zero": "0",
        **dict.fromkeys((f"{name}_type" for name in (*TYPES, "held")), "int32_t"),
        **dict.fromkeys(("real", "value_type", "exp_type"), "int64_t"),
        "temperature_type": "int16_t" if dtype == "q15" else "int32_t",
        "units": [*units, *(ends if plan.sensors else ()), *compensated],
        "constants": _constants(plan, windows, scales, dtype),
        "exp_error": EXP_ERROR,
        "exp_terms": exp_terms,
        "signal_expressions": [_signal(signal.parts, bits) for signal in windows.signals],
        "evaluate": _evaluations(plan, windows, scales),
        "exponential_arguments": _exponential_arguments(windows),
        "atom_expressions": [_atom(i, plan, windows, scales) for i in range(len(plan.atoms))],
        "rule": {
            **thermometer_rule(plan.thermometer, "INT64_C({})".format, readable, 2.0**-bits),
            "note": f", steps of 2^-{bits}",
        },
        "columns": _columns(plan, scales),
    }


def _signal(parts: tuple[tuple[str, float], ...], bits: int) -> str:
    shift = HELD_BITS - bits + SIGNAL_SHIFT
    factors = [
        f"temperatures[{sensor_identifier(name)}] * INT64_C({round(coefficient * 2.0**shift)})"
        for name, coefficient in parts
    ]
    return f"(int32_t)clipped(scaled({' + '.join(factors)}, {SIGNAL_SHIFT}), INT64_C(1) << 29)"


def _operator_bits(windows: Layout, plan: Plan, scales: Scales) -> list[int]:
    """Bits behind the point of each operator's value: those of the atom that it makes."""
    bits = [HELD_BITS] * len(windows.operators)
    for i, place in enumerate(windows.of_atom):
        if place >= 0 and plan.atoms[i].operator != "sign":
            bits[place] = int(scales.atoms[i])
    return bits


def _evaluations(plan: Plan, windows: Layout, scales: Scales) -> dict[int, str]:
    found: dict[int, str] = {}
    bits = _operator_bits(windows, plan, scales)
    for i, operator in windows.of_method("block"):
        unit_s = operator.window.length_s if operator.unit_s is None else operator.unit_s
        unit = round(unit_s / windows.tick_s)
        divide = divide_bits(unit)
        value = f"block_value(&newest, &before, INT64_C({unit}), {divide}, {HELD_BITS + divide - bits[i]})"
        if operator.unit_s is None:
            whole = f"block_value(&newest, &before, 0, 0, {HELD_BITS - bits[i]})"
            value = f"known < INT64_C({operator.needed_ticks}) ? {value} : {whole}"
        found[i] = f"told_part({value}, {operator.filling})"
    for place, (i, operator) in enumerate(windows.lines):
        unit_s = operator.window.length_s if operator.unit_s is None else operator.unit_s
        unit = round(2.0**18 * unit_s / (windows.tick_s * operator.window_ticks))
        divide, own = divide_bits(unit), operator.window.own
        name, weights = ("slope", "") if own is None else ("kernel", f"KERNEL_{place}, {len(own.weights)}, ")
        arguments = f"state, &SLOPE[{place}], &sums, bins, {weights}INT64_C({unit}), {divide}"
        value = f"{name}_value({arguments}, {HELD_BITS + divide - bits[i]})"
        found[i] = f"told_part({value}, {operator.filling})"
    for place, (i, _) in enumerate(windows.of_method("exp")):
        found[i] = f"scaled(state->exponential[{place}].rate, {24 - bits[i]})"
    for i, _ in windows.of_method("own"):
        found[i] = f"scaled(value[{i}], {BITS - bits[i]})"
    for place, (i, operator) in enumerate(windows.of_method("first")):
        difference = f"(int64_t)signal[{operator.signal}] - state->first[{place}]"
        if operator.unit_s is None:
            found[i] = f"scaled({difference}, {HELD_BITS - bits[i]})"
        else:
            unit = round(operator.unit_s * 1e6)
            divide = divide_bits(unit)
            rate = f"rate_of({difference}, interval_us, {divide}, INT64_C({unit}))"
            found[i] = f"scaled({rate}, {HELD_BITS + divide - bits[i]})"
    return found


def _exponential_arguments(windows: Layout) -> dict[int, str]:
    found = {}
    for i, operator in windows.of_method("exp"):
        tau = round(operator.window.length_s * 1e6)
        unit = round((operator.window.length_s if operator.unit_s is None else operator.unit_s) * 1e6)
        found[i] = f"INT64_C({tau}), INT64_C({unit}), {divide_bits(unit)}, INT64_C({operator.needed_ticks})"
    return found


def _atom(i: int, plan: Plan, windows: Layout, scales: Scales) -> str:
    place, bits = windows.of_atom[i], int(scales.atoms[i])
    if isinstance(plan.atoms[i].declared, Function):
        signal = f"(int64_t)signal[{windows.signal_of_atom[i]}] * {1 << (BITS - HELD_BITS)}"
        value = f"function_{function_atoms(plan).index(plan.atoms[i])}({signal})"
        return f"(int32_t)clipped(scaled({value}, {BITS - bits}), INT32_MAX)"
    if place < 0:
        value = f"scaled(signal[{windows.signal_of_atom[i]}], {HELD_BITS - bits})"
        return f"(int32_t)clipped({value}, INT32_MAX)"
    value = f"value[{place}]"
    if plan.atoms[i].operator == "sign":
        band = round(DEAD_BAND * (1.0 + 1e-9) * 2.0 ** _operator_bits(windows, plan, scales)[place])
        value = f"direction({value}, INT64_C({band}), INT64_C({2**bits}))"
    return f"(int32_t)clipped({value}, INT32_MAX)"


def _columns(plan: Plan, scales: Scales) -> list[str]:
    """Feature columns with products taken two at a time, so that none leaves 64 bits."""
    found = []
    limits = plan.limits
    low, high = limits.low - limits.margin, limits.high + limits.margin
    for place, step in enumerate(plan.steps):
        factors = list(step.atoms)
        if step.column is None:
            first = factors.pop(0)
            text, bits = f"a[{first}]", int(scales.atoms[first])
            span = (float(low[first]), float(high[first]))
        else:
            text, bits, span = f"f[{step.column}]", int(scales.columns[step.column]), (0.0, 0.0)
        for atom in factors:
            if step.column is None:
                span = product_range(span, (float(low[atom]), float(high[atom])))
                into = fitting_bits(max(abs(span[0]), abs(span[1])))
            else:
                into = int(scales.columns[place])
            text = f"scaled({text} * a[{atom}], {bits + int(scales.atoms[atom]) - into})"
            bits = into
        found.append(f"scaled({text}, {bits - int(scales.columns[place])})")
    return found


def _constants(plan: Plan, windows: Layout, scales: Scales, dtype: str) -> list[str]:
    lines = []
    if plan.atoms:
        steps = 2.0**scales.atoms
        lines += [
            f"#define ATOMS {len(plan.atoms)} /* what features are made of */",
            f"#define COLUMNS {len(plan.steps)} /* features */",
        ]
        most = 2.0**31 - 1.0
        lines += box_lines(plan, lambda x: np.clip(np.round(x * steps), -most, most), "int", "int64_t")
        if plan.limits.slices is not None:
            numbers = slice_numbers(plan, scales.atoms)
            lines += slice_lines(plan, numbers, "INT64_C({})".format, "int", "int64_t")
    lines += own_constants(plan, windows, fixed_number, "int64_t")
    if windows.binned and windows.lines:
        lines.append(f"#define WEIGHT_UNITS INT64_C({weight_units(windows)}) /* of a full bin in a slope */")
    arrays = plan.arrays
    constant = round(float(arrays["constant"][0]) * 2.0**scales.drift)
    lines += [
        "",
        f"#define DRIFT_SHIFT {scales.drift - scales.output_bits}",
        f"#define CONSTANT INT64_C({constant}) /* steps of 2^-{scales.drift} deg/h */",
    ]
    stored = "int16_t" if dtype == "q15" else "int32_t"
    if "linear" in arrays:
        shift = scales.linear_bits + scales.columns - scales.drift
        shift = np.where(scales.linear == 0, 0, np.minimum(shift, 63))
        lines += [
            *array(
                "LINEAR", scales.linear, "int", "[COLUMNS]", stored, "coefficients, each in steps of its own"
            ),
            *array("LINEAR_SHIFT", shift, "int", "[COLUMNS]", "int"),
        ]
    if plan.gives_rate:
        lines += _scale_constants(plan, scales)
    if plan.centres:
        lines += _network_constants(plan, scales, stored)
    return [CCode(line) for line in lines]


def weight_units(windows: Layout) -> int:
    """Weight of a full bin in a slope, so fine that sums over a ring of bins still fit 63 bits."""
    return 1 << min(12, 18 - (windows.ring - 1).bit_length())


def _scale_constants(plan: Plan, scales: Scales) -> list[str]:
    bits = scales.scale_bits
    _, *slopes = np.abs(plan.arrays["scale"])
    steepest = max(slopes[0] + slopes[1] * float(scales.most[0]), 1e-12)
    # The terms in T get more bits than the whole, as long as their products fit.
    spare = max(0, min(14, floor(61.0 - VALUE_BITS - bits - log2(steepest))))
    whole = np.round(plan.arrays["scale"] * 2.0 ** (bits + spare))
    note = f"steps of 2^-{bits + spare} deg/h per unit of output, by powers of T"
    return [
        *array("SCALE", whole, "int", "[3]", "int64_t", note),
        f"#define SCALE_SPARE {spare}",
        f"#define SCALE_SHIFT {int(scales.columns[0])}",
        f"#define GYRO_SHIFT {bits + scales.gyro_bits - scales.drift}",
    ]


def _network_constants(plan: Plan, scales: Scales, stored: str) -> list[str]:
    arrays, seen = plan.arrays, list(plan.columns)
    spare = VALUE_BITS - scales.stored_bits
    step = 2.0**spare
    centres = np.round(arrays["centres"] * 2.0 ** scales.columns[seen] / step)
    if np.abs(centres).max(initial=0.0) >= 2.0 ** (scales.stored_bits + 1):
        raise InputError("export: a centre lies too far outside the trained box for fixed point; use float32")
    inverse = 1.0 / arrays["widths"]
    bits = np.array([common_bits(inverse[:, d], scales.stored_bits) for d in range(len(seen))])
    shift = bits + scales.columns[seen] - 27
    lines = [
        "",
        f"#define CENTRES {plan.centres}",
        f"#define INPUTS {len(seen)} /* of the Gaussians */",
        f"#define CENTRE_STEP INT64_C({int(step)})",
        *array("INPUT_COLUMN", seen, "int", "[INPUTS]", "int"),
        *array("CENTRE", centres, "int", "[CENTRES][INPUTS]", stored),
        *array("INVERSE_WIDTH", np.round(inverse * 2.0**bits), "int", "[CENTRES][INPUTS]", stored),
        *array("WIDTH_SHIFT", shift, "int", "[INPUTS]", "int"),
        *array("WEIGHT", np.round(arrays["weights"] * 2.0**scales.weight_bits), "int", "[CENTRES]", stored),
        f"#define BASIS_SHIFT {30 - spare}",
        f"#define WEIGHT_SHIFT {scales.weight_bits + spare - scales.drift}",
    ]
    if plan.edge_columns:
        lines.append(f"#define SLOPE_SHIFT {scales.weight_bits + spare - scales.drift + 19}")
        steps = 2.0 ** scales.columns[list(plan.edge_columns)]
        lines += edge_lines(plan, np.round(plan.edge * steps), "int", "int64_t")
    return lines
