"""Steps of fixed-point numbers, chosen so that nothing a plan works out can overflow."""

from __future__ import annotations

from math import ceil, floor, frexp, log2

import numpy as np

from fogml.arrays import FloatArray, IntArray
from fogml.errors import InputError
from fogml.export.plan import LEAST_OUTPUT_BITS, MOST_OUTPUT_BITS, Plan
from fogml.export.self_test import sensor_range

VALUE_BITS = 30
HELD_BITS = 20
SIGNAL_SHIFT = 24
_SUM_BITS = 60
_MOST_DRIFT_BITS = 36
_TEMPERATURE_MARGIN = 1.1


class Scales:
    """Bits behind the binary point of every value, so that each fits 2**30."""

    def __init__(self, plan: Plan, dtype: str) -> None:
        self.plan = plan
        self.stored_bits = 14 if dtype == "q15" else 30
        limits = plan.limits
        low, high = limits.low - limits.margin, limits.high + limits.margin
        self.atoms = np.array([fitting_bits(max(abs(a), abs(b))) for a, b in zip(low, high)], dtype=np.int64)
        ranges: list[tuple[float, float]] = []
        for step in plan.steps:
            span = (1.0, 1.0) if step.column is None else ranges[step.column]
            for atom in step.atoms:
                span = product_range(span, (float(low[atom]), float(high[atom])))
            ranges.append(span)
        self.most = np.array([max(abs(a), abs(b)) for a, b in ranges])
        self.columns = np.array([fitting_bits(value) for value in self.most], dtype=np.int64)
        self.temperature_bits = 22 if dtype == "q31" else sixteen_bits(plan)
        self.output_bits = plan.output_bits
        self.gyro_bits = 0 if plan.gives_rate and plan.gyro_unit == "count" else self.output_bits
        arrays = plan.arrays
        linear = arrays.get("linear", np.empty(0))
        self.linear, self.linear_bits = mantissas(linear, self.stored_bits)
        total = abs(float(arrays["constant"][0])) + float(np.abs(linear) @ self.most) if len(linear) else 1.0
        total = max(total, abs(float(arrays["constant"][0])))
        drift = [_MOST_DRIFT_BITS]
        if len(linear):
            drift.append(int((self.linear_bits + self.columns).min()))
        self.weight_bits = 0
        if plan.centres:
            slope = 1.0 + (2048.0 if plan.edge_columns else 0.0)
            total += float(np.abs(arrays["weights"]).sum()) * min(slope, 64.0)
            self.weight_bits = common_bits(arrays["weights"], self.stored_bits)
            drift.append(self.weight_bits + 30 - self.stored_bits)
        if plan.gives_rate:
            self.scale_bits = common_bits(arrays["scale"][:1] * 1.25, VALUE_BITS)
            drift.append(self.scale_bits + self.gyro_bits)
            total += float(abs(arrays["scale"][0])) * 2.0**31 / 2.0**self.gyro_bits
        self.drift = min([*drift, floor(_SUM_BITS - log2(max(total, 1e-6)))])
        if self.drift < self.output_bits:
            raise InputError(
                "export: the model's terms are so large, and cancel so finely, that fixed point cannot hold "
                f"them ({dtype}); use float32, or train with lower powers"
            )


def output_bits(tolerance_deg_h: float) -> int:
    """Bits behind the point of outputs that may be so far off [deg/h]; fewer hold faster turns.

    Rounding an output where it is taken and where it is given makes a step, which is a quarter of it then.
    """
    needed = ceil(log2(4.0 / tolerance_deg_h)) if tolerance_deg_h > 0.0 else MOST_OUTPUT_BITS
    return min(max(needed, LEAST_OUTPUT_BITS), MOST_OUTPUT_BITS)


def fitting_bits(most: float) -> int:
    """Most bits behind the point with which numbers up to `most` stay below 2**30."""
    return min(VALUE_BITS, VALUE_BITS - frexp(max(most, 1e-12))[1])


def common_bits(values: FloatArray, stored: int) -> int:
    """Bits behind the point with which all values fit `stored` bits."""
    most = float(np.max(np.abs(values), initial=0.0))
    return stored - frexp(most)[1] if most > 0.0 else stored


def mantissas(values: FloatArray, stored: int) -> tuple[IntArray, IntArray]:
    """Each value as a whole number of `stored` bits, and its own bits behind the point."""
    bits = np.array([common_bits(np.array([v]), stored) if v else stored for v in values], dtype=np.int64)
    return np.round(values * 2.0**bits).astype(np.int64), bits


def product_range(a: tuple[float, float], b: tuple[float, float]) -> tuple[float, float]:
    corners = [x * y for x in a for y in b]
    return min(corners), max(corners)


def sixteen_bits(plan: Plan) -> int:
    """Bits behind the point of 16-bit temperatures: the trained ones fit with a tenth to spare."""
    ends = (end for sensor in plan.sensors for end in sensor_range(plan, sensor)[:2])
    most = max((100.0, *map(abs, ends)))
    return floor(log2(32767.0 / (most * _TEMPERATURE_MARGIN)))


def divide_bits(unit_ticks: float) -> int:
    """Bits of a quotient with which rates up to 1024 degC per unit fit, and their product with the unit."""
    unit_bits = log2(unit_ticks)
    return max(0, floor(unit_bits + min(36.0, 62.0 - unit_bits)) - 10 - HELD_BITS)
