"""C99 source of a plan: header and file that firmware engineers read, and what CMake, Arduino, Rust take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from hashlib import sha256
from math import ceil
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from fogml import __version__
from fogml.errors import InputError
from fogml.escaping import CCode, c_text
from fogml.export.c_fixed import fixed_context
from fogml.export.c_float import float_context, input_units, literal, sensor_identifier
from fogml.export.layout import NOISE_TICKS, Layout, Number, layout
from fogml.export.plan import Plan
from fogml.export.self_test import SelfTest, make_self_test, numbers_of
from fogml.features.operators import GAP_BINS, LOST, MOST_IN_BIN
from fogml.runs.columns import is_temperature
from fogml.signals.clock import LEAST_SHARE

C_DTYPES = ("float64", "float32", "q31", "q15")
"""Number formats that C code computes in."""
HEADER, SOURCE, DRIVER = "fogml_model.h", "fogml_model.c", "driver.c"
_MOST_INPUTS = 64


COUNTED = 4
"""Samples whose instructions are counted; the figure is their mean."""


@dataclass(frozen=True)
class CSource:
    """The generated files, by name, and what they were made with.

    Attributes
    ----------
    files
        Text of header and source.
    driver
        Text of a program that feeds the source from its standard input, for checks.
    probe
        Text of a program for the target whose instructions are counted.
    dtype
        Number format.
    plan, layout
        What was written.
    numbers
        What the number format adds: units, scales.
    self_test
        The stored sequence.
    """

    files: dict[str, str]
    driver: str
    probe: str
    dtype: str
    plan: Plan
    layout: Layout
    numbers: dict[str, Any]
    self_test: SelfTest

    def with_expected(self, outputs: Sequence[float], flags: Sequence[int], sum: int) -> CSource:
        """The same with what the self-test expects filled in."""
        return c_source(
            self.plan,
            self.dtype,
            self.numbers["card"],
            replace(self.self_test, outputs=tuple(outputs), flags=tuple(flags), sum=sum),
        )


def c_source(plan: Plan, dtype: str, card: Sequence[str], test: SelfTest | None = None) -> CSource:
    """C source of a plan.

    Parameters
    ----------
    plan
        What to compute.
    dtype
        One of `C_DTYPES`.
    card
        Lines on where the model comes from.
    test
        A self-test with its expected outputs; one without them is made if None.

    Raises
    ------
    InputError
        If C can't stream a feature of the plan, or a number does not fit the format.
    """
    if dtype not in C_DTYPES:
        raise InputError(
            f"export: C code computes in {', '.join(C_DTYPES)}, not in {dtype}; "
            f"{dtype} weights are for --to onnx, json and mat"
        )
    if len(plan.sensors) > _MOST_INPUTS:
        raise InputError(f"export: {len(plan.sensors)} inputs, C code takes at most {_MOST_INPUTS}")
    places = [sensor_identifier(name) for name in plan.sensors]
    if len(set(places)) < len(places):
        raise InputError(
            "export: two columns of the model differ in upper and lower case alone, which places in C do not"
        )
    number = number_of(dtype)
    windows = layout(plan, number)
    numbers = (
        fixed_context(plan, windows, dtype) if number == "fixed" else float_context(plan, windows, dtype)
    )
    numbers["card"] = list(card)
    test = test or make_self_test(plan, windows, dtype, numbers)
    numbers["constants"] = [*_clock_constants(windows, plan.sample_s, dtype), *numbers["constants"]]
    told = "\n".join(map(str, (dtype, plan.names, windows, numbers["constants"])))
    numbers["model_id"] = int(sha256(told.encode()).hexdigest()[:8], 16)
    summed = numbers_of(numbers["constants"])
    context = {**_shared(plan, windows), **numbers, "test": test.literals(dtype), "summed": summed}
    render = templates().get_template
    files = {name: render(f"{name[6:]}.j2").render(context) for name in (HEADER, SOURCE)}
    driver = render("driver.c.j2").render(context)
    probe = render("probe.c.j2").render(context)
    return CSource(files, driver, probe, dtype, plan, windows, numbers, test)


def number_of(dtype: str) -> Number:
    """What C code of a number format computes with."""
    return "fixed" if dtype in ("q15", "q31") else dtype  # type: ignore[return-value]


@cache
def templates() -> Environment:
    """The templates of generated C; all that goes into them is escaped for it."""
    return Environment(
        loader=PackageLoader("fogml.export"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        finalize=c_text,
    )


def _shared(plan: Plan, windows: Layout) -> dict[str, Any]:
    """What every number format's templates need."""
    return {
        "title": f"Temperature compensation of a fibre-optic gyro: model '{plan.kind}', fogml {__version__}",
        "plan": plan,
        "layout": windows,
        "sensors": plan.sensors,
        "identifier": sensor_identifier,
        "input_units": input_units(plan),
        "others": not all(is_temperature(name) for name in plan.sensors),
        "thermometers": [name for name in plan.sensors if is_temperature(name)],
        "other_inputs": [name for name in plan.sensors if not is_temperature(name)],
        "atoms": plan.atoms,
        "sample_s": repr(plan.sample_s),
        "faster": _faster(plan, windows),
        "noise_ticks": NOISE_TICKS,
        "bin_ticks": round(windows.bin_samples * plan.sample_s / windows.tick_s),
        "sample_us": round(plan.sample_s * 1e6),
        "counted": COUNTED,
        "bin_s": f"{windows.bin_samples * plan.sample_s:.6g}",
        "tick_us": windows.tick_us,
        "gap": {i: f"INT64_C({round(o.gap_s * 1e6)})" for i, o in enumerate(windows.operators)},
        "gyro_unit": plan.gyro_unit if plan.gives_rate else "deg/h",
        "blocks": windows.of_method("block"),
        "slopes": windows.lines,
        "owns": windows.of_method("own"),
        "exponentials": windows.of_method("exp"),
        "firsts": windows.of_method("first"),
        "takes_interval": any(
            operator.method in ("exp", "own") or (operator.method == "first" and operator.unit_s is not None)
            for operator in windows.operators
        ),
        "directions": any(atom.operator == "sign" for atom in plan.atoms),
        "label": {
            i: f"{operator.method} of {windows.signals[operator.signal].text}"
            + (f", {operator.window.length_s:g} s" if operator.window.length_s else "")
            for i, operator in enumerate(windows.operators)
        },
    }


def _clock_constants(windows: Layout, sample_s: float, dtype: str) -> list[str]:
    """Lines of the clock's constants: longest gap, tick, where ticks begin, filling, and length of bins."""
    if not windows.operators:
        return []
    longest = round(windows.longest_gap_s * 1e6)
    # Ticks begin a little before their low 32 bits wrap: every unit, and the self-test, goes past that.
    needed = max(operator.needed_ticks for operator in windows.operators)
    lines = [
        f"#define LONGEST_GAP_US UINT64_C({longest}) /* a longer one restarts all windows */",
        "#define TICKS_LIMIT (INT64_C(1) << 61)",
        f"#define FIRST_TICK INT64_C({(1 << 32) - needed // 2 - 1})",
        *([f"#define TICK_US INT64_C({windows.tick_us})"] if windows.tick_us > 1 else []),
    ]
    if windows.ring:
        cubed = LEAST_SHARE**3
        share = literal(cubed, dtype) if dtype.startswith("float") else f"INT64_C({round(cubed * 2.0**30)})"
        lines.append(
            f"#define LEAST_CUBED {share} /* variance of a full window's rate to that of the rates */"
        )
    if 32 not in windows.clock_bits:
        lines += ["#ifdef FOGML_CLOCK_32", "#error a window spans more than a 32-bit clock tells", "#endif"]
    if windows.binned:
        ticks = (windows.bin_samples - 0.5) * sample_s / windows.tick_s
        longest_s = max(operator.window.span_s for operator in windows.operators if operator.held >= 0)
        early = ceil(longest_s / windows.tick_s / GAP_BINS) + 1
        lines += [
            f"#define BIN_SAMPLES {windows.bin_samples}",
            f"#define BIN_TICKS {round(ticks)}U /* a sample so long after a bin's first begins the next */",
            f"#define MOST_IN_BIN {MOST_IN_BIN}U",
            f"#define LOST_US INT64_C({round(LOST * sample_s * 1e6)}) /* after longer, too, */",
            f"#define EARLY_TICKS {early}U /* not sooner after one that began so */",
        ]
    return [CCode(line) for line in lines]


def _faster(plan: Plan, windows: Layout) -> str:
    """How much faster than nominal samples may come before a ring, or the count of a bin, is too short."""
    if not windows.ring:
        return "100 %"
    if windows.binned:
        return f"{MOST_IN_BIN // windows.bin_samples} times"
    longest = max(o.window.span_s for o in windows.operators if o.held >= 0)
    return f"{int(np.floor(100.0 * ((windows.ring - 1) * plan.sample_s / longest - 1.0)))} %"


def units_of(plan: Plan, gyro: str, temperature: str) -> list[str]:
    """Lines that tell what goes in and comes out."""
    lines = [
        "  time          time_us [us], going up; any origin, and it may wrap",
        f"  temperatures  {temperature}: {', '.join(plan.sensors) or 'none'}",
        f"  gyro          {gyro}",
        "  compensated   deg/h",
    ]
    if "T" in plan.sensors:
        lines.append(
            "T is the coil's temperature: T_in, or the mean of the inner sensors, if there is no other."
        )
    return lines


RUST_FILE = "fogml_model.rs"
_RUST = {"double": "f64", "float": "f32", "int32_t": "i32", "int16_t": "i16"}


def project_files(name: str) -> dict[str, str]:
    """A folder with ``NAME.c`` and ``NAME.h`` as a target of CMake and a library of Arduino, by file name."""
    context = {"name": name, "version": __version__}
    return {
        file: templates().get_template(f"{file}.j2").render(context)
        for file in ("CMakeLists.txt", "library.properties")
    }


def rust_bindings(source: CSource, state_bytes: int) -> str:
    """A module of Rust that calls generated C, of a state of so many bytes, through ``extern "C"``."""
    numbers = source.numbers
    return (
        templates()
        .get_template("model.rs.j2")
        .render(
            kind=source.plan.kind,
            version=__version__,
            places=max(1, len(source.plan.sensors)),
            state_bytes=state_bytes,
            saves=bool(source.plan.atoms),
            temperature=CCode(_RUST[numbers["temperature_type"]]),
            gyro=CCode(_RUST[numbers["gyro_type"]]),
        )
    )
