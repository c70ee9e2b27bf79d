"""Numbers of a plan in a smaller format, and what they are when read back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray
from fogml.export.plan import Plan

FLOATS = {"float64": np.float64, "float32": np.float32, "float16": np.float16}
FILE_DTYPES = (*FLOATS, "int8")
"""Number formats of the files that hold numbers: JSON with safetensors, MATLAB, ONNX."""
_KEPT_SINGLE = ("constant", "scale")
# Few numbers that everything rests on: never below float32.
_C_BYTES = {"float64": 8, "float32": 4, "q31": 4, "q15": 2}


@dataclass(frozen=True)
class Stored:
    """An array as it is stored: ``decoded = values * 2**exponent``.

    Attributes
    ----------
    values
        In the small format.
    exponent
        int8, broadcasts against the last axis; None where there is none.
    """

    values: NDArray[np.generic]
    exponent: NDArray[np.int8] | None = None

    @property
    def decoded(self) -> FloatArray:
        """The numbers in float64."""
        values = self.values.astype(np.float64)
        return values if self.exponent is None else np.ldexp(values, self.exponent.astype(np.int32))

    @property
    def nbytes(self) -> int:
        """Bytes of values and exponents."""
        return int(self.values.nbytes) + (0 if self.exponent is None else int(self.exponent.nbytes))


def stored_array(name: str, values: FloatArray, dtype: str) -> Stored:
    """One array of a plan in a format of `FILE_DTYPES`."""
    values = np.asarray(values, dtype=np.float64)
    if name in _KEPT_SINGLE and dtype != "float64":
        return Stored(values.astype(np.float32))
    if dtype in ("float64", "float32"):
        return Stored(values.astype(FLOATS[dtype]))
    # Numbers of a column share a power of two, so that neither format's narrow range matters.
    sizes = np.abs(values).max(axis=0, initial=0.0) if values.ndim == 2 else np.abs(values)
    if name == "weights":
        sizes = np.array([sizes.max(initial=0.0)])
    bits = 7 if dtype == "int8" else 0
    exponent = np.where(sizes > 0.0, np.frexp(sizes)[1] - bits, 0)
    scaled = np.ldexp(values, -exponent)
    if dtype == "float16":
        return Stored(scaled.astype(np.float16), exponent.astype(np.int8))
    return Stored(np.clip(np.round(scaled), -127, 127).astype(np.int8), exponent.astype(np.int8))


def stored_plan(plan: Plan, dtype: str, points: FloatArray) -> tuple[dict[str, Stored], Plan]:
    """All arrays of a plan in a small format, and the plan with the numbers read back.

    In ``int8`` numbers are rounded one after the other, the largest first, and those not rounded
    yet take up the error by least squares at `points`, feature columns of shape (n, k).
    """
    arrays = dict(plan.arrays)
    if dtype == "int8" and plan.names and not plan.gives_rate:
        arrays = _rounded_in_turn(plan, points)
    stored = {name: stored_array(name, values, dtype) for name, values in arrays.items()}
    return stored, plan.with_arrays({name: array.decoded for name, array in stored.items()})


def _rounded_in_turn(plan: Plan, points: FloatArray) -> dict[str, FloatArray]:
    arrays = dict(plan.arrays)
    target = plan.value(points)
    for name in ("centres", "widths"):
        if name in arrays:
            arrays[name] = stored_array(name, arrays[name], "int8").decoded
    shape = plan.with_arrays(arrays)
    columns = design(shape, points)
    size = np.linalg.norm(columns, axis=0)
    size[size == 0.0] = 1.0
    count = columns.shape[1] - 1
    outer = np.append(arrays.get("weights", np.empty(0)), arrays["linear"])
    weights = count - len(arrays["linear"])
    left = target.copy()
    free = list(range(count))
    shared = None
    while free:
        solved, *_ = np.linalg.lstsq(columns[:, [*free, count]] / size[[*free, count]], left, rcond=1e-9)
        now = solved[:-1] / size[free]
        if shared is None:
            # Output weights share one exponent, which the first solution sets.
            shared = np.abs(now[:weights]).max(initial=0.0)
        place = int(np.argmax(np.abs(solved[:-1])))
        column = free.pop(place)
        if column < weights:
            steps = 2.0 ** (np.frexp(shared)[1] - 7)
            value = float(np.clip(np.round(now[place] / steps), -127, 127) * steps)
        else:
            value = float(stored_array("linear", now[place : place + 1], "int8").decoded[0])
        outer[column] = value
        left = left - value * columns[:, column]
    arrays["constant"] = np.array([left.mean()])
    arrays["linear"] = outer[weights:]
    if "weights" in arrays:
        arrays["weights"] = outer[:weights]
    return arrays


def design(plan: Plan, points: FloatArray) -> FloatArray:
    """Columns that the drift is linear in: Gaussians, features, and ones; shape (n, j + k + 1)."""
    network = plan.network
    each = [
        replace(
            network,
            centres=network.centres[[j]],
            widths=network.widths[[j]],
            weights=np.ones(1),
            linear=np.zeros(points.shape[1]),
            constant=0.0,
        )(points)
        for j in range(plan.centres)
    ]
    return np.column_stack([*each, points, np.ones(len(points))])


def weight_bytes(plan: Plan, dtype: str, c_code: bool) -> int:
    """Bytes of a plan's numbers: in C code its tables, elsewhere the stored arrays; edges included."""
    if c_code:
        count = sum(array.size for array in plan.arrays.values())
        count += plan.edge.size if plan.centres else 0
        return count * _C_BYTES[dtype]
    sizes = [stored_array(name, values, dtype).nbytes for name, values in plan.arrays.items()]
    edge = plan.edge.size * (8 if dtype == "float64" else 4) if plan.centres else 0
    return sum(sizes) + edge


def arrays_to_write(stored: Mapping[str, Stored], plan: Plan, dtype: str) -> dict[str, NDArray[np.generic]]:
    """Arrays by the names that files use: each, ``NAME_exponent`` where there is one, and the edge."""
    arrays: dict[str, NDArray[np.generic]] = {}
    for name, array in stored.items():
        arrays[name] = array.values
        if array.exponent is not None:
            arrays[f"{name}_exponent"] = array.exponent
    if plan.centres and plan.edge_columns:
        arrays["edge"] = plan.edge.astype(np.float64 if dtype == "float64" else np.float32)
    return arrays
