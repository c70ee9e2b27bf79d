"""What C source in float64 or float32 is filled with: constants, expressions, the exponential."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import factorial, log
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogml.arrays import FloatArray
from fogml.errors import InputError, quoted
from fogml.escaping import CCode, c_text
from fogml.export.c_flags import slice_comment, slice_inputs, slice_numbers, thermometer_rule
from fogml.export.c_own import function_atoms, own_constants, own_context
from fogml.export.layout import RANGE_BITS, Layout
from fogml.export.plan import Plan
from fogml.features.atoms import DEAD_BAND
from fogml.features.own import Function
from fogml.features.signal import Signal, unit_of
from fogml.runs.columns import is_temperature

OTHER_LIMIT = 1e15
"""Values of other columns than temperatures up to this size, in their units, are taken."""
TYPES = ("temperature", "gyro", "atom", "signal", "value", "exp", "phase")
"""What has a type of its own in C."""
EXP_TERMS = {"float64": 13, "float32": 7}
EXP_MOST = {"float64": 700.0, "float32": 80.0}
EXP_ERROR = {"float64": 4e-16, "float32": 2e-7}
"""Greatest relative error of the generated exponential, held by the tests."""


def literal(value: float, dtype: str) -> str:
    """A number as a C literal that reads back as the same float64 or float32.

    Raises
    ------
    InputError
        If it is not finite, or too large for the type.
    """
    single = dtype == "float32"
    if not abs(value) <= float(np.finfo(dtype).max):
        raise InputError(
            f"export: a number of the model is {value:g}, which {dtype} does not hold; "
            + ("use float64" if single and np.isfinite(value) else "train it again")
        )
    text = str(np.float32(value)) if single else repr(float(value))
    return (text if any(mark in text for mark in ".e") else f"{text}.0") + ("f" if single else "")


def array(name: str, values: ArrayLike, dtype: str, size: str, kind: str, note: str = "") -> list[str]:
    """Lines of a constant array of one or two dimensions."""
    rows = np.asarray(values)
    comment = f" /* {note} */" if note else ""

    def one(row: Any) -> str:
        return ", ".join(literal(v, dtype) if dtype.startswith("float") else str(int(v)) for v in row)

    head = f"static const {kind} {name}{size} = {{{comment}"
    if rows.ndim == 1:
        return [head, f"    {one(rows)}", "};"]
    return [head, *(f"    {{ {one(row)} }}," for row in rows), "};"]


def float_context(plan: Plan, windows: Layout, dtype: str) -> dict[str, Any]:
    """The templates' values for float64 or float32."""
    from fogml.export.c_source import units_of

    real = "double" if dtype == "float64" else "float"
    suffix = "" if dtype == "float64" else "f"

    def number(value: float) -> str:
        return literal(value, dtype)

    plain = all(is_temperature(name) for name in plan.sensors)
    temperature = "[degC], in the order of the places below" if plain else "in the order and units below"
    gyro = f"[{plan.gyro_unit}]" if plan.gives_rate else "output as rate [deg/h]"
    return {
        **dict.fromkeys(("real", *(f"{name}_type" for name in TYPES)), real),
        "fixed": None,
        "slice_inputs": slice_inputs(plan),
        "suffix": suffix,
        "zero": "0.0" + suffix,
        "second_us": number(1e-6),
        "held_type": "int64_t" if real == "double" else "int32_t",
        "units": [
            *units_of(plan, gyro, temperature),
            "An output that is no number (NaN) is given as one; the flag is of the temperatures alone.",
        ],
        "constants": _constants(plan, windows, dtype, real),
        "exp_error": EXP_ERROR[dtype],
        "exp_most": number(EXP_MOST[dtype]).removesuffix("f"),
        "exp_constants": _exponential(dtype),
        "signal_expressions": [_signal(signal, plan, number) for signal in windows.signals],
        "evaluate": _evaluations(windows, number),
        "exponential_arguments": {
            i: f"{number(operator.window.length_s)}, INT64_C({operator.needed_ticks})"
            for i, operator in enumerate(windows.operators)
        },
        "atom_expressions": [_atom(i, plan, windows) for i in range(len(plan.atoms))],
        "rule": thermometer_rule(plan.thermometer, number, 2.0**RANGE_BITS) | {"note": ""},
        "columns": [
            " * ".join(
                ([f"f[{step.column}]"] if step.column is not None else []) + [f"a[{i}]" for i in step.atoms]
            )
            for step in plan.steps
        ],
        **own_context(plan, windows, number, real),
    }


def _atom(i: int, plan: Plan, windows: Layout) -> str:
    atom, operator = plan.atoms[i], windows.of_atom[i]
    signal = f"signal[{windows.signal_of_atom[i]}]"
    if isinstance(atom.declared, Function):
        return f"function_{function_atoms(plan).index(atom)}({signal})"
    if operator < 0:
        return signal
    return f"direction(value[{operator}])" if atom.operator == "sign" else f"value[{operator}]"


def _signal(signal: Signal, plan: Plan, number: Any) -> str:
    """A combination of columns, worked out in the library's order."""
    pieces = []
    for index, (name, coefficient) in enumerate(signal.parts):
        place = f"temperatures[{sensor_identifier(name)}]"
        size = abs(coefficient)
        scaled = place if size == 1.0 else f"{number(size)} * {place}"
        sign = ("-" if coefficient < 0 else "") if index == 0 else (" - " if coefficient < 0 else " + ")
        pieces.append(sign + scaled)
    return "".join(pieces)


def sensor_identifier(name: str) -> str:
    """The identifier of a column's place in the array of temperatures; that of no temperature says INPUT.

    Raises
    ------
    InputError
        If the name is not a word of ASCII.
    """
    identifier = f"FOGML_{name.upper()}" if is_temperature(name) else f"FOGML_INPUT_{name.upper()}"
    if not (identifier.isascii() and identifier.isidentifier()):
        raise InputError(
            f"export: the model takes column {quoted(name)}, which makes no identifier of C; name it in "
            "plain letters and train again"
        )
    return identifier


def input_units(plan: Plan) -> dict[str, str]:
    """Unit of each column that the code takes, for comments."""
    return {name: unit_of(name) or "own unit" for name in plan.sensors}


def _evaluations(windows: Layout, number: Any) -> dict[int, str]:
    """For each operator the expression of its value, from two samples on."""
    found: dict[int, str] = {}
    for i, operator in windows.of_method("block"):
        length = number(operator.window.length_s / windows.tick_s)
        unit = f"known < INT64_C({operator.needed_ticks}) ? {length} : {number(0.0)}"
        if operator.unit_s is not None:
            unit = number(operator.unit_s / windows.tick_s)
        found[i] = f"told_part(block_value(&newest, &before, {unit}), {operator.filling})"
    for place, (i, operator) in enumerate(windows.lines):
        unit_s = operator.window.length_s if operator.unit_s is None else operator.unit_s
        unit = number(unit_s / (windows.tick_s * operator.window_ticks))
        own = operator.window.own
        name, weights = ("slope", "") if own is None else ("kernel", f"KERNEL_{place}, {len(own.weights)}, ")
        value = f"{name}_value(state, &SLOPE[{place}], &sums, bins, {weights}{unit})"
        found[i] = f"told_part({value}, {operator.filling})"
    for place, (i, operator) in enumerate(windows.of_method("exp")):
        unit_s = operator.window.length_s if operator.unit_s is None else operator.unit_s
        found[i] = f"{number(unit_s)} * state->exponential[{place}].rate"
    for place, (i, operator) in enumerate(windows.of_method("first")):
        difference = f"(signal[{operator.signal}] - state->first[{place}])"
        rate = "" if operator.unit_s is None else f" * {number(operator.unit_s)} / interval"
        found[i] = difference + rate
    return found


def _constants(plan: Plan, windows: Layout, dtype: str, real: str) -> list[str]:
    def number(value: float) -> str:
        return literal(value, dtype)

    lines = []
    if plan.atoms:
        lines += [
            f"#define ATOMS {len(plan.atoms)} /* what features are made of */",
            f"#define COLUMNS {len(plan.steps)} /* features */",
        ]
        if not all(is_temperature(name) for name in plan.sensors):
            lines.append(f"#define INPUT_LIMIT {number(OTHER_LIMIT)} /* of other columns, either way */")
    if windows.ring:
        bits = windows.temperature_bits
        lines.append(
            f"#define TEMPERATURE_STEPS {number(2.0**bits)} /* held temperatures: steps of a degC */"
        )
        lines.append(f"#define TEMPERATURE_STEP {number(2.0**-bits)} /* [degC] */")
    if any(atom.operator == "sign" for atom in plan.atoms):
        band = number(DEAD_BAND * (1.0 + 1e-9))
        lines.append(f"#define DEAD_BAND {band} /* rates up to this count as standing still [degC/min] */")
    if plan.atoms:
        lines += box_lines(plan, lambda values: values, dtype, real)
        if plan.limits.slices is not None:
            lines += slice_lines(plan, slice_numbers(plan), number, dtype, real)
    lines += own_constants(plan, windows, number, real)
    return [CCode(line) for line in (*lines, "", *_model_constants(plan, dtype, real))]


def box_lines(plan: Plan, stored: Callable[[FloatArray], FloatArray], dtype: str, kind: str) -> list[str]:
    """Lines of the trained box, by atom, as numbers are `stored`."""
    limits, names = plan.limits, c_text(", ".join(atom.text for atom in plan.atoms))
    lines = ["", f"/* The trained box, by atom: {names}. */"]
    for name, values, note in (
        ("LOW", limits.low, "values below are levelled off"),
        ("HIGH", limits.high, "values above are levelled off"),
        ("MARGIN", limits.margin, "how far beyond a levelled value gets"),
        ("INNER", limits.inner, "values below are flagged"),
        ("OUTER", limits.outer, "values above are flagged"),
    ):
        lines += array(name, stored(values), dtype, "[ATOMS]", kind, note)
    return lines


def slice_lines(
    plan: Plan, numbers: Mapping[str, Any], number: Callable[[Any], str], dtype: str, kind: str
) -> list[str]:
    """Lines of the trained ranges in slices of a temperature, of `slice_numbers`."""
    lines = slice_comment(plan)
    lines += [f"#define SLICE_{name.upper()} {number(numbers[name])}" for name in ("first", "width")]
    for name in ("low", "high"):
        lines += array(f"SLICE_{name.upper()}", numbers[name], dtype, "[SLICED][SLICES]", kind)
    return lines


def edge_lines(plan: Plan, edge: NDArray[Any], dtype: str, kind: str) -> list[str]:
    """Lines of the columns that hold a rate, with their trained range, shape (2, r)."""
    return [
        "",
        f"#define EDGES {len(plan.edge_columns)} /* columns that hold a rate, and their trained range */",
        *array("EDGE_COLUMN", plan.edge_columns, "int", "[EDGES]", "int"),
        *array("EDGE_LOW", edge[0], dtype, "[EDGES]", kind),
        *array("EDGE_HIGH", edge[1], dtype, "[EDGES]", kind),
    ]


def _model_constants(plan: Plan, dtype: str, real: str) -> list[str]:
    arrays = plan.arrays
    lines = [f"#define CONSTANT {literal(arrays['constant'][0], dtype)} /* [deg/h] */"]
    if "linear" in arrays:
        lines += array("LINEAR", arrays["linear"], dtype, "[COLUMNS]", real, "[deg/h per unit of the column]")
    if "scale" in arrays:
        note = "rate [deg/h] per unit of output, by powers of T"
        lines += array("SCALE", arrays["scale"], dtype, "[3]", real, note)
    if not plan.centres:
        return lines
    lines += [
        "",
        f"#define CENTRES {plan.centres}",
        f"#define INPUTS {len(plan.columns)} /* of the Gaussians */",
        *array("INPUT_COLUMN", plan.columns, "int", "[INPUTS]", "int"),
        *array("CENTRE", arrays["centres"], dtype, "[CENTRES][INPUTS]", real),
        *array("INVERSE_WIDTH", 1.0 / arrays["widths"], dtype, "[CENTRES][INPUTS]", real),
        *array("WEIGHT", arrays["weights"], dtype, "[CENTRES]", real, "[deg/h]"),
    ]
    return [*lines, *(edge_lines(plan, plan.edge, dtype, real) if plan.edge_columns else ())]


def _exponential(dtype: str) -> dict[str, Any]:
    """ln 2 in two parts, its inverse, and the terms of exp(r), highest power first."""
    # The high part has 32 (12) bits, so its product with k <= 2^10 (2^7) is exact.
    bits = 32 if dtype == "float64" else 12
    high = np.floor(log(2.0) * 2.0**bits) / 2.0**bits
    low = 1.90821492927058770002e-10 if dtype == "float64" else log(2.0) - high
    if dtype == "float64":
        high = 6.93147180369123816490e-01
    terms = [1.0 / factorial(n) for n in range(EXP_TERMS[dtype], -1, -1)]
    return {
        "per_octave": literal(1.0 / log(2.0), dtype),
        "high": literal(high, dtype),
        "low": literal(low, dtype),
        "terms": [literal(term, dtype) for term in terms],
    }
