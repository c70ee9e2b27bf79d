"""What generated C carries to test itself with on the target: a sequence, points, a sum of its numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fogml.escaping import CCode
from fogml.export.layout import Layout
from fogml.export.plan import Plan
from fogml.features.own import Function
from fogml.runs.columns import is_temperature

_CHECKS = 8
_TABLE = re.compile(r"static const (\w+) (\w+)\[(\w+)\](?:\[(\w+)\])? = ")
_NUMBER = re.compile(r"#define ([A-Z]\w*) ([^/]*[^/ ])")
_REAL = re.compile(r"[0-9]\.|[0-9]e")
_PERIOD = 12
_USUAL_RATE = 2.0
# Of chambers [degC/min], where the box tells none.
_FLOAT_TOLERANCE = {"float64": 1e-9, "float32": 2e-5}


@dataclass(frozen=True)
class SelfTest:
    """A sawtooth of temperatures and outputs at some of its samples, points of atoms, and a sum of numbers.

    Attributes
    ----------
    first, rise, jump
        Temperatures at its begin, their rise from step to step, and their jump at the end; in the
        numbers that the code takes, shape (sensors,).
    interval_us
        Time between steps [us].
    gyro
        The output, constant.
    period
        Steps from the lowest to the highest temperature.
    checks
        Steps whose output is compared.
    atoms
        Values below the trained box and above it, in the numbers that the code takes, shape (2, a).
    outputs, flags
        What is expected at the checks, then at the atoms.
    sum
        What is expected of the numbers.
    """

    first: tuple[float, ...]
    rise: tuple[float, ...]
    jump: tuple[float, ...]
    interval_us: int
    gyro: float
    period: int
    checks: tuple[int, ...]
    atoms: tuple[tuple[float, ...], ...] = ()
    outputs: tuple[float, ...] = ()
    flags: tuple[int, ...] = ()
    sum: int = 0

    @property
    def steps(self) -> int:
        """Number of steps."""
        return self.checks[-1] + 1

    @property
    def before_wrap_us(self) -> int:
        """How long before a clock's wrap the sequence begins [us]: it wraps between two checks."""
        return self.interval_us * (self.checks[-1] - _PERIOD // 2)

    def literals(self, dtype: str) -> dict[str, Any]:
        """The template's values."""
        from fogml.export.c_float import literal

        whole = dtype in ("q15", "q31")

        def number(value: float) -> str:
            return str(int(value)) if whole else literal(value, dtype)

        count = len(self.checks) + len(self.atoms)
        outputs = self.outputs or (0.0,) * count
        size = max(1.0, max(abs(value) for value in outputs))
        return {
            "steps": self.steps,
            "checks": self.checks,
            "flags": self.flags or (0,) * count,
            "atoms": [[number(value) for value in atoms] for atoms in self.atoms],
            "sum": self.sum,
            "outputs": [number(value) for value in outputs],
            "first": [number(value) for value in self.first],
            "rise": [number(value) for value in self.rise],
            "jump": [number(value) for value in self.jump],
            "jump_at": self.checks[-1],
            "period": self.period,
            "gyro": number(self.gyro),
            "interval_us": self.interval_us,
            "before_wrap_us": self.before_wrap_us,
            "tolerance": "0" if whole else number(_FLOAT_TOLERANCE[dtype] * size),
        }


def make_self_test(plan: Plan, windows: Layout, dtype: str, numbers: dict[str, Any]) -> SelfTest:
    """A self-test without its expected outputs, whose temperatures and rates stay in the trained box.

    Steps are as long as the windows can span, so that it is short.
    """
    interval_s, full_at = _interval(plan, windows)
    interval_us = round(interval_s * 1e6)
    period = max(_PERIOD, full_at)
    first, rise, jump = np.zeros((3, len(plan.sensors)))
    for i, sensor in enumerate(plan.sensors):
        low, high, fastest = sensor_range(plan, sensor)
        first[i] = low + 0.3 * (high - low)
        rise[i] = min(0.65 * (high - low) / period, 0.5 * fastest * interval_s / 60.0)
        jump[i] = 0.9 * (high - low) + 3.0
    # At the begin, while windows fill, and once they are full.
    places = np.append(max(1, full_at // 3), np.linspace(full_at, full_at + _PERIOD, _CHECKS - 2).astype(int))
    checks = (0, *np.unique(places).tolist())
    limits = plan.limits
    beyond = (
        np.stack([limits.high + limits.margin, limits.low - limits.margin]) if plan.atoms else np.empty(0)
    )
    gyro = 1000.0 / abs(plan.arrays["scale"][0]) if plan.gives_rate else 7.5
    fixed = numbers["fixed"]
    if fixed is None:
        return SelfTest(
            tuple(first),
            tuple(rise),
            tuple(jump),
            interval_us,
            gyro,
            period,
            (*checks, checks[-1] + 1),
            tuple(map(tuple, beyond.tolist())),
        )
    unit = fixed["temperature_value"]
    return SelfTest(
        tuple(np.round(first / unit)),
        tuple(np.maximum(np.round(rise / unit), 1.0)),
        tuple(np.clip(np.round(jump / unit), 0, fixed["temperature_most"] / 2 - np.round(first / unit))),
        interval_us,
        round(gyro / fixed["gyro_value"]),
        period,
        (*checks, checks[-1] + 1),
        tuple(map(tuple, np.round(beyond * 2.0 ** np.array(fixed["atom_bits"])).tolist())),
    )


def numbers_of(lines: Iterable[str]) -> dict[str, list[Any]]:
    """Numbers that lines of C define: names of ``whole`` and ``real`` ones, and ``tables``.

    Of a table the name, which of the two it holds, and its sizes.
    """
    found: dict[str, list[Any]] = {"whole": [], "real": [], "tables": []}
    for line in lines:
        if table := _TABLE.match(line):
            kind, name, *sizes = map(CCode, table.groups(""))
            found["tables"].append((name, "real" if kind in ("float", "double") else "whole", *sizes))
        elif number := _NUMBER.match(line):
            found["real" if _REAL.search(number[2]) else "whole"].append(CCode(number[1]))
    return found


def sum_of_reals(values: ArrayLike, dtype: str) -> int:
    """What the C makes of numbers in float64 or float32, one after another."""
    total, bits = 2166136261, np.asarray(values, dtype).view(f"u{np.dtype(dtype).itemsize}")
    for number in bits.ravel().tolist():
        for half in (number & 0xFFFFFFFF, number >> 32):
            total = (total ^ half) * 16777619 & 0xFFFFFFFF
    return total


def _interval(plan: Plan, windows: Layout) -> tuple[float, int]:
    """Time between steps [s], and the step at which all windows are full."""
    if not windows.operators:
        return plan.sample_s, 1
    shortest = min(operator.gap_s for operator in windows.operators)
    count = max(1, int(np.floor(0.95 * shortest / plan.sample_s)))
    needed_s = max(operator.needed_ticks for operator in windows.operators) * windows.tick_s
    return count * plan.sample_s, int(np.ceil(needed_s / (count * plan.sample_s))) + 2


def sensor_range(plan: Plan, sensor: str) -> tuple[float, float, float]:
    """Lowest and highest value of a column in the trained box, and its fastest rate [per min].

    That of its value itself, else of what is remembered of it; a rate that crosses all of it in a quarter of
    an hour where the box tells none.
    """
    low, high, fastest = 10.0, 40.0, np.inf
    remembered = sorted(range(len(plan.atoms)), key=lambda i: plan.atoms[i].operator == "value")
    for i in remembered:
        atom = plan.atoms[i]
        ends = float(plan.limits.box_low[i]), float(plan.limits.box_high[i])
        weights = dict(atom.signal.parts)
        total = abs(sum(weights.values()))
        if (
            isinstance(own := atom.declared, Function)
            and own.inverse is not None
            and weights.get(sensor) == 1.0
        ):
            low, high = sorted(own.inverse(end, *atom.given) for end in ends)
        elif atom.follows and atom.signal.is_sensor and sensor in weights:
            low, high = ends
        elif atom.window and atom.operator in ("d", "diff") and sensor in weights and total > 1e-9:
            seconds = atom.window.length_s or plan.sample_s
            per_minute = 60.0 / seconds if atom.operator == "diff" else 1.0
            fastest = min(fastest, max(abs(end) for end in ends) * per_minute / total)
    usual = _USUAL_RATE if is_temperature(sensor) else (high - low) / 15.0
    return low, high, fastest if 0.0 < fastest < np.inf else usual
