"""The trained ranges at each temperature as nodes of an ONNX graph."""

from __future__ import annotations

from typing import Any

import numpy as np

from fogml.features.slices import Slices


def beyond_slice(graph: Any, slices: Slices, atoms: str) -> str:
    """Whether an input of atoms (n, a) lies beyond its trained range at this temperature, int64 (n)."""
    level = graph.add("Sub", [graph.gather(atoms, [slices.level]), graph.constant(slices.first)])
    share = graph.add("Div", [level, graph.constant(slices.width)])
    most = graph.constant(slices.low.shape[1] - 1.0)
    place = graph.add("Min", [graph.add("Max", [share, graph.constant(0.0)]), most])
    place = graph.add("Squeeze", [graph.add("Cast", [place], to=7), graph.whole([1])])
    inputs = []
    for i, j in zip(slices.of, slices.less):
        value = graph.gather(atoms, [i])
        inputs.append(value if j < 0 else graph.add("Sub", [value, graph.gather(atoms, [j])]))
    value = graph.add("Concat", inputs, axis=1)
    low, high = (
        graph.add("Gather", [graph.constant(np.ascontiguousarray(ends.T)), place], axis=0)
        for ends in slices.bounds
    )
    past = graph.add("Or", [graph.add("Less", [value, low]), graph.add("Greater", [value, high])])
    return graph.add("ReduceMax", [graph.add("Cast", [past], to=7)], axes=[1], keepdims=0)
