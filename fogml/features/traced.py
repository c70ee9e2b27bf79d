"""Arithmetic that one declaration is written in once: of numbers, of arrays, and of symbols that become C.

A function of `+ - * /`, comparisons and what stands here (`where`, `larger`, `smaller`, `decayed`,
`forgotten`) works on numbers and arrays as they are. Called with a `Symbol` it writes what it does, line by
line, into a `Writer`: in floating point, or in fixed point of 2**-32.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fogml.errors import InputError

BITS = 32
"""Fixed point counts in steps of 2**-32."""
MOST = 2.0**26
"""And saturates here."""


class Symbol:
    """A value that is not known yet: a name in C.

    Lines that make further values of it go to `writer`; `stepwise` ones depend on the time step alone.
    """

    __array_ufunc__ = None

    def __init__(self, writer: Writer, name: str, stepwise: bool = False) -> None:
        self.writer, self.name, self.stepwise = writer, name, stepwise

    def __add__(self, other: Any) -> Symbol:
        return self.writer.line("{} + {}", self, other)

    def __radd__(self, other: Any) -> Symbol:
        return self.writer.line("{} + {}", other, self)

    def __sub__(self, other: Any) -> Symbol:
        return self.writer.line("{} - {}", self, other)

    def __rsub__(self, other: Any) -> Symbol:
        return self.writer.line("{} - {}", other, self)

    def __neg__(self) -> Symbol:
        return self.writer.line("-{}", self)

    def __mul__(self, other: Any) -> Symbol:
        return self.writer.call("times", "{} * {}", self, other)

    def __rmul__(self, other: Any) -> Symbol:
        return self.writer.call("times", "{} * {}", other, self)

    def __truediv__(self, other: Any) -> Symbol:
        return self.writer.call("divided", "{} / {}", self, other)

    def __rtruediv__(self, other: Any) -> Symbol:
        return self.writer.call("divided", "{} / {}", other, self)

    def __abs__(self) -> Symbol:
        return where(self < 0.0, -self, self)

    def __lt__(self, other: Any) -> Symbol:
        return self.writer.line("{} < {}", self, other, kind="bool")

    def __gt__(self, other: Any) -> Symbol:
        return self.writer.line("{} > {}", self, other, kind="bool")

    def __le__(self, other: Any) -> Symbol:
        return self.writer.line("{} <= {}", self, other, kind="bool")

    def __ge__(self, other: Any) -> Symbol:
        return self.writer.line("{} >= {}", self, other, kind="bool")

    def __eq__(self, other: Any) -> Symbol:  # type: ignore[override]
        return self.writer.line("{} == {}", self, other, kind="bool")

    def __ne__(self, other: Any) -> Symbol:  # type: ignore[override]
        return self.writer.line("{} != {}", self, other, kind="bool")

    def __and__(self, other: Any) -> Symbol:
        return self.writer.line("{} && {}", self, other, kind="bool")

    def __or__(self, other: Any) -> Symbol:
        return self.writer.line("{} || {}", self, other, kind="bool")

    def __bool__(self) -> bool:
        raise TypeError("a branch on a value; write where(condition, a, b), larger(a, b) or smaller(a, b)")


class Writer:
    """Lines of C, each value once. What depends on the time step alone stands apart, to be kept.

    Parameters
    ----------
    real
        The type of numbers.
    number
        A number as C has it.
    fixed
        Whether numbers are whole steps of 2**-32.

    Attributes
    ----------
    lines, step_lines
        What is worked out at each sample, and when the time step changes.
    kept
        Names of the latter that the former need: they are kept as ``memory->k[0]`` ...
    inputs, calls
        Names of the inputs that are used, and of the functions that are called.
    """

    def __init__(self, real: str, number: Callable[[float], str], fixed: bool) -> None:
        self._real, self._number, self._fixed = real, number, fixed
        self._known: dict[str, Symbol] = {}
        self.lines: list[str] = []
        self.step_lines: list[str] = []
        self.kept: list[str] = []
        self.inputs: set[str] = set()
        self.calls: set[str] = set()

    def text(self, value: Any, stepwise: bool = False) -> str:
        """A value as C has it, in a line of the steps or of the samples."""
        if not isinstance(value, Symbol):
            return self._number(float(value))
        if not value.stepwise or stepwise:
            self.inputs.add(value.name)
            return value.name
        if value.name not in self.kept:
            self.kept.append(value.name)
        return f"memory->k[{self.kept.index(value.name)}]"

    def line(self, form: str, *values: Any, kind: str | None = None) -> Symbol:
        """A new value by a form with a place for each value."""
        stepwise = all(value.stepwise for value in values if isinstance(value, Symbol))
        expression = form.format(*(self.text(value, stepwise) for value in values))
        if expression not in self._known:
            name = f"v{len(self._known)}"
            lines = self.step_lines if stepwise else self.lines
            lines.append(f"const {kind or self._real} {name} = {expression};")
            self._known[expression] = Symbol(self, name, stepwise)
        return self._known[expression]

    def call(self, function: str, form: str | None, *values: Any) -> Symbol:
        """A new value by a function of C; by a form in floating point, where there is one."""
        self.calls.add(function)
        if form is None or self._fixed:
            form = f"{function}({', '.join('{}' for _ in values)})"
        return self.line(form, *values)


def where(condition: Any, a: Any, b: Any) -> Any:
    """`a` where a condition holds, else `b`."""
    if isinstance(condition, Symbol):
        return condition.writer.line("{} ? {} : {}", condition, a, b)
    if isinstance(condition, np.ndarray):
        return np.where(condition, a, b)
    return a if condition else b


def larger(a: Any, b: Any) -> Any:
    """The larger one of two."""
    return where(a > b, a, b)


def smaller(a: Any, b: Any) -> Any:
    """The smaller one of two."""
    return where(a < b, a, b)


def decayed(u: Any) -> Any:
    """exp(-u), for u of 0 or more."""
    return u.writer.call("decayed", "exp_of_minus({})", u) if isinstance(u, Symbol) else np.exp(-u)


def forgotten(u: Any) -> Any:
    """1 - exp(-u), exact to the format's own digits however small u is; for u of 0 or more."""
    return u.writer.call("forgotten_share", None, u) if isinstance(u, Symbol) else -np.expm1(-u)


def traced(function: Callable[..., Any], *values: Any) -> Any:
    """What a function makes of symbols.

    Raises
    ------
    InputError
        If it does with them what C is not written for.
    """
    try:
        return function(*values)
    except (TypeError, AttributeError) as error:
        raise InputError(
            f"it is not written in what becomes C ({error}): + - * /, comparisons, and where, larger, "
            "smaller, decayed and forgotten of fogml.features.traced"
        ) from None
