"""Nodes and constants of an ONNX graph under way."""

from __future__ import annotations

from typing import Any

import numpy as np

from fogml.export.storage import Stored


class Graph:
    """Nodes and constants under way."""

    def __init__(self, kind: int) -> None:
        self.kind = kind
        self.real = np.dtype(np.float64 if kind == 11 else np.float32)
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def add(self, operator: str, inputs: list[str], name: str = "", **attributes: Any) -> str:
        """A node; its output's name."""
        from onnx import helper

        name = name or f"v{len(self.nodes)}"
        self.nodes.append(helper.make_node(operator, inputs, [name], **attributes))
        return name

    def constant(self, values: Any, dtype: Any = None) -> str:
        """A constant in the graph's own precision, or another type; its name."""
        from onnx import numpy_helper

        name = f"c{len(self.constants)}"
        array = np.ascontiguousarray(np.asarray(values, dtype=dtype or self.real))
        self.constants.append(numpy_helper.from_array(array, name))
        return name

    def whole(self, values: Any) -> str:
        """A constant of integers."""
        return self.constant(values, np.int64)

    def stored(self, array: Stored) -> str:
        """A constant in the small format, and what brings it to the graph's precision."""
        if array.values.dtype == self.real and array.exponent is None:
            return self.constant(array.values)
        name = self.add("Cast", [self.constant(array.values, array.values.dtype)], to=self.kind)
        if array.exponent is None:
            return name
        return self.add("Mul", [name, self.constant(np.ldexp(1.0, array.exponent.astype(np.int32)))])

    def sum(self, value: str, axis: int) -> str:
        return self.add("ReduceSum", [value, self.whole([axis])], keepdims=0)

    def gather(self, value: str, places: Any) -> str:
        return self.add("Gather", [value, self.whole(list(places))], axis=1)

    def outside(self, values: str, low: str, high: str) -> str:
        """Whether any of a row's values (n, a) lies beyond its bounds, int64 (n)."""
        past = self.add("Or", [self.add("Less", [values, low]), self.add("Greater", [values, high])])
        return self.any_of_row(past)

    def beside(self, values: str, low: float, high: float) -> str:
        """Whether any of a row's values (n, m) is not within bounds, as NaN is not, int64 (n)."""
        ends = zip(("GreaterOrEqual", "LessOrEqual"), (low, high), strict=True)
        within = self.add("And", [self.add(name, [values, self.constant(end)]) for name, end in ends])
        return self.any_of_row(self.add("Not", [within]))

    def any_of_row(self, conditions: str) -> str:
        """Whether any of a row's conditions (n, m) holds, int64 (n)."""
        # TensorProto.INT64, as not every type can be the greatest.
        whole = self.add("Cast", [conditions], to=7)
        return self.add("ReduceMax", [whole], axes=[1], keepdims=0)
