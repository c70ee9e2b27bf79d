"""Fast evaluation of Gaussian basis functions, compiled; the exponential keeps to vector registers."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from math import factorial, log
from typing import Any

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.signals.compiled import kernel

_LANES = 256  # rows worked on at once: their buffers stay in the innermost cache
_PART = 1 << 15  # rows given to a thread at once
_SMALL = 1 << 12  # rows below which a second thread costs more than it brings
_FAST = {"contract", "nsz"}

# 1 / ln 2, one half, the largest exponent (no denormals), then 2^f for |f| <= 1/2 as its Taylor
# polynomial, highest power first: truncated at 2e-16 in double, 6e-9 in single precision.
_DOUBLE = np.array([1 / log(2), 0.5, 700.0, *(log(2) ** k / factorial(k) for k in range(12, -1, -1))])
_SINGLE = np.array([1 / log(2), 0.5, 80.0, *(0.0,) * 5, *_DOUBLE[-8:]], dtype=np.float32)


@kernel(error_model="numpy", fastmath=_FAST)
def _gaussian(lanes, centre, inverse, table, bias, shift, bits, power, out):  # type: ignore[no-untyped-def]
    """Write exp(-|(x - centre) * inverse|^2) of the columns x of `lanes` (d, l) into `out` (l,).

    `bits` and `power` are one buffer, seen as integers and as floats: 2^k is built by writing
    its exponent's bits.
    """
    width = out.shape[0]
    for i in range(lanes.shape[0]):
        c = centre[i]
        s = inverse[i]
        if i == 0:
            for lane in range(width):
                step = (lanes[i, lane] - c) * s
                out[lane] = step * step
        else:
            for lane in range(width):
                step = (lanes[i, lane] - c) * s
                out[lane] += step * step
    per_octave, half, flat = table[0], table[1], table[2]
    c12, c11, c10, c9, c8 = table[3], table[4], table[5], table[6], table[7]
    c7, c6, c5, c4 = table[8], table[9], table[10], table[11]
    c3, c2, c1, c0 = table[12], table[13], table[14], table[15]
    for lane in range(width):
        octaves = -min(out[lane], flat) * per_octave
        whole = np.floor(octaves + half)
        bits[lane] = (bits.dtype.type(whole) + bias) << shift
        out[lane] = octaves - whole
    for lane in range(width):
        f = out[lane]
        p = ((((c12 * f + c11) * f + c10) * f + c9) * f + c8) * f + c7
        p = ((((((p * f + c6) * f + c5) * f + c4) * f + c3) * f + c2) * f + c1) * f + c0
        out[lane] = p * power[lane]


@kernel(error_model="numpy", fastmath=_FAST)
def _fill(lanes, inputs, columns, start, stop):  # type: ignore[no-untyped-def]
    """Copy rows start:stop of the chosen columns into `lanes` (d, l), one input to a line."""
    for i in range(columns.shape[0]):
        column = columns[i]
        for row in range(start, stop):
            lanes[i, row - start] = inputs[row, column]


@kernel(error_model="numpy", fastmath=_FAST)
def _network(inputs, columns, centres, inverse, weights, linear, constant, table, bias, shift, bits, out):  # type: ignore[no-untyped-def]
    """Constant + linear part + weighted basis functions of rows (n, k) into `out` (n,)."""
    size = bits.shape[0]
    power = bits.view(table.dtype)
    lanes = np.zeros((columns.shape[0], size), table.dtype)
    basis = np.empty(size, table.dtype)
    total = np.empty(size, table.dtype)
    for start in range(0, inputs.shape[0], size):
        stop = min(start + size, inputs.shape[0])
        _fill(lanes, inputs, columns, start, stop)
        for lane in range(size):
            total[lane] = 0
        for j in range(centres.shape[0]):
            _gaussian(lanes, centres[j], inverse[j], table, bias, shift, bits, power, basis)
            weight = weights[j]
            for lane in range(size):
                total[lane] += weight * basis[lane]
        for row in range(start, stop):
            value = constant
            for i in range(linear.shape[0]):
                value += linear[i] * inputs[row, i]
            out[row] = value + total[row - start]


@kernel(error_model="numpy", fastmath=_FAST)
def _basis(inputs, columns, centres, inverse, table, bias, shift, bits, out):  # type: ignore[no-untyped-def]
    """Basis functions of rows (n, k) into `out` (j, n)."""
    size = bits.shape[0]
    power = bits.view(table.dtype)
    lanes = np.zeros((columns.shape[0], size), table.dtype)
    basis = np.empty(size, table.dtype)
    for start in range(0, inputs.shape[0], size):
        stop = min(start + size, inputs.shape[0])
        _fill(lanes, inputs, columns, start, stop)
        for j in range(centres.shape[0]):
            _gaussian(lanes, centres[j], inverse[j], table, bias, shift, bits, power, basis)
            for row in range(start, stop):
                out[j, row] = basis[row - start]


def evaluate_network(
    inputs: FloatArray,
    columns: IndexArray,
    centres: FloatArray,
    widths: FloatArray,
    weights: FloatArray,
    linear: FloatArray,
    constant: float,
    *,
    threads: int | None = None,
    single: bool = False,
) -> FloatArray:
    """``constant + linear . x + sum_j weights_j exp(-|(x - centres_j) / widths_j|^2)``, shape (n,).

    Parameters
    ----------
    inputs
        Rows, shape (n, k).
    columns
        Which of the k columns the network sees, shape (d,).
    centres, widths
        Shape (j, d), in the inputs' own units.
    weights, linear
        Shapes (j,) and (k,).
    threads
        Rows are shared among so many threads; by default all cores.
    single
        Compute the basis functions in float32: about twice as fast, and off by up to 1e-6 of the
        sum of the weights' magnitudes. The linear part stays in float64.
    """
    table, *layout = _layout(single)
    kind = table.dtype
    arrays = (centres.astype(kind), (1.0 / widths).astype(kind), weights.astype(kind))
    out = np.empty(len(inputs))

    def part(rows: slice) -> None:
        bits = np.empty(_LANES, layout[2])
        _network(
            inputs[rows],
            columns,
            *arrays,
            linear,
            float(constant),
            table,
            layout[0],
            layout[1],
            bits,
            out[rows],
        )

    _share(part, len(inputs), threads)
    return out


def basis_functions(
    inputs: FloatArray,
    columns: IndexArray,
    centres: FloatArray,
    widths: FloatArray,
    threads: int | None = None,
) -> FloatArray:
    """Basis functions of rows, shape (j, n): ``exp(-|(x - centres_j) / widths_j|^2)``; as above."""
    table, *layout = _layout(False)
    inverse = 1.0 / widths
    out = np.empty((len(centres), len(inputs)))

    def part(rows: slice) -> None:
        bits = np.empty(_LANES, layout[2])
        _basis(inputs[rows], columns, centres, inverse, table, layout[0], layout[1], bits, out[:, rows])

    _share(part, len(inputs), threads)
    return out


def _layout(single: bool) -> tuple[Any, ...]:
    """Constants, exponent bias, exponent shift and integer type of the precision."""
    if single:
        return _SINGLE, np.int32(127), np.int32(23), np.int32
    return _DOUBLE, np.int64(1023), np.int64(52), np.int64


def _share(work: Callable[[slice], None], rows: int, threads: int | None) -> None:
    """Do `work` on slices of the rows, in threads where it pays."""
    workers = threads or os.cpu_count() or 1
    parts = [slice(start, min(start + _PART, rows)) for start in range(0, rows, _PART)]
    if workers == 1 or rows < _SMALL or len(parts) == 1:
        for part in parts:
            work(part)
        return
    with ThreadPoolExecutor(min(workers, len(parts))) as pool:
        list(pool.map(work, parts))
