"""Operators and windows of one's own, each declared once: how it is written, what it does, and its C.

Three forms, by what they need to know:

- `Function`: of the input's present value alone.
- `Recursion`: a state that goes on from sample to sample.
- `fogml.signals.kernel_windows.Kernel`: weights over a window.

Their C, in floating and fixed point, follows from what they do: functions are called with symbols
(`fogml.features.traced`). A function that can't be written so becomes a table; a window's weights are one.

`declare` makes one known; so does a package's entry point in the group ``fogml.operators`` that names it,
or the module that declares it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import entry_points
from inspect import signature
from types import ModuleType
from typing import Literal, get_args

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.entry_points import OPERATORS as GROUP
from fogml.entry_points import loaded, origin
from fogml.errors import FogmlError, InputError, counted, first_line
from fogml.signals.clock import EXPONENTIAL_SPAN, check_window, longest_gap_s, needed_s
from fogml.signals.kernel_windows import Kernel
from fogml.signals.memory import MemoryOperator

Method = Literal["block", "slope", "exp", "first"]
METHODS: tuple[Method, ...] = get_args(Method)
"""How differences and rates are taken, of those that ship."""
FUNCTIONS = ("d", "diff", "sign", "lag", "play", "hysteresis", "since_on", "beyond")
"""Functions of feature text that ship; no operator of one's own has their names."""
KINDS = ("s", "x", "1")
"""Kinds of parameters: a time, a number in the unit of the input, a plain number."""
State = tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class _Named:
    """What every operator of one's own states.

    Attributes
    ----------
    name
        As feature text has it, ``name(x, parameters)``.
    parameters
        A kind of `KINDS` for each parameter.
    unit
        Unit of its values; None for that of its input.
    operations
        Additions, multiplications and divisions at a sample; 0 where it isn't counted.
    gain
        How far its value moves at most where its inputs are each off by 1.
    """

    name: str
    parameters: tuple[str, ...] = ()
    unit: str | None = None
    operations: int = 0
    gain: float = float("inf")

    def __post_init__(self) -> None:
        if not (self.name.isidentifier() and self.name.isascii()):
            raise InputError(f"operator '{self.name}': a name of letters, digits and _ was expected")
        if unknown := [kind for kind in self.parameters if kind not in KINDS]:
            raise InputError(
                f"operator {self.name}: kinds of parameters are {', '.join(KINDS)}, not {unknown}"
            )

    def _check_takes(self, what: str, function: object, values: int) -> None:
        """Hold that a function takes as many values: its own, and one for each parameter."""
        count = values + len(self.parameters)
        if not callable(function):
            raise InputError(f"operator {self.name}: {what} is {function!r}, not a function")
        try:
            taken = signature(function)
        except ValueError:  # of compiled functions it need not be told
            return
        try:
            taken.bind(*[None] * count)
        except TypeError:
            raise InputError(
                f"operator {self.name}: {what} takes {taken}; it gets {counted(values, 'value')} and "
                f"{counted(len(self.parameters), 'parameter')}"
            ) from None


@dataclass(frozen=True, kw_only=True)
class Function(_Named):
    """An operator of the input's present value alone: a curve, bounded where inputs are.

    Attributes
    ----------
    function
        ``function(x, *parameters)`` of an array.
    rest
        Its value where nothing moves and power-on is long ago; None: what it makes of its input.
    inverse
        ``inverse(value, *parameters)``: what it is of, where that is told by its values alone.
    """

    function: Callable[..., FloatArray]
    rest: float | None = None
    inverse: Callable[..., float] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_takes("function", self.function, 1)

    def operator(self, parameters: State, sample_s: float) -> FunctionOperator:
        """What takes samples in order."""
        return FunctionOperator(self, parameters)


@dataclass(frozen=True, kw_only=True)
class Recursion(_Named):
    """An operator with a state: begun at the first sample, and again after a gap that its time does not span.

    Its functions are written with what `fogml.features.traced` takes, so that they are C as well.

    Attributes
    ----------
    start
        ``start(x, *parameters)``: the state, a tuple of numbers.
    step
        ``step(state, x, last, dt, *parameters)``: the state after a sample x, `last` before it by dt [s].
    value
        ``value(state, x, *parameters)``.
    settled
        ``settled(state, x, *parameters)``; None where the time constant tells, or it always is.
    time_constant
        Place among the parameters of its time constant: it is settled three of them after it began, and
        begins anew after a gap that a window as long may not span; None for one that knows no time.
    single_gain
        ``single_gain(*parameters, sample_s)``: the same where one input is off; None: `gain`.
    follows
        Whether its value is its input's where nothing moves.
    quicker
        ``quicker(*parameters, sample_s)``: an operator with the same numbers for whole recordings.
    """

    start: Callable[..., State]
    step: Callable[..., State]
    value: Callable[..., float]
    settled: Callable[..., bool] | None = None
    time_constant: int | None = None
    single_gain: Callable[..., float] | None = None
    follows: bool = False
    quicker: Callable[..., MemoryOperator] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for what, values in (("start", 1), ("step", 4), ("value", 2), ("settled", 2)):
            if (function := getattr(self, what)) is not None or what != "settled":
                self._check_takes(what, function, values)

    def operator(self, parameters: State, sample_s: float) -> MemoryOperator:
        """What takes samples in order."""
        if self.quicker is not None:
            return self.quicker(*parameters, sample_s)
        return RecursionOperator(self, parameters, sample_s)

    def time_s(self, parameters: State) -> float | None:
        """The time constant [s]."""
        return None if self.time_constant is None else parameters[self.time_constant]


class FunctionOperator:
    """`Function` over samples; always settled."""

    def __init__(self, declared: Function, parameters: State) -> None:
        self._declared, self._parameters = declared, parameters

    def push(self, time: FloatArray, x: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Values at the next samples, and where they are settled; both of shape (n,)."""
        found = np.asarray(self._declared.function(x, *self._parameters))
        if np.iscomplexobj(found) or found.shape not in ((), x.shape):
            given = "complex numbers" if np.iscomplexobj(found) else f"shape {found.shape}"
            raise TypeError(f"numbers of shape {x.shape} were expected of its function, not {given}")
        values = found.astype(np.float64, copy=False)
        return np.broadcast_to(values, x.shape), np.ones(len(x), dtype=np.bool_)


class RecursionOperator:
    """`Recursion` over samples."""

    def __init__(self, declared: Recursion, parameters: State, sample_s: float) -> None:
        self._declared, self._parameters = declared, parameters
        time_s = declared.time_s(parameters)
        self._gap_s, self._needed_s = float("inf"), 0.0
        if time_s is not None:
            check_window(time_s, sample_s, 1, f"the time constant of {declared.name}")
            self._gap_s = longest_gap_s(time_s, sample_s)
            self._needed_s = needed_s(EXPONENTIAL_SPAN * time_s, sample_s)
        self._state: State | None = None
        self._start = self._time = self._x = 0.0

    def push(self, time: FloatArray, x: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Values at the next samples, and where they are settled; both of shape (n,)."""
        declared, given = self._declared, self._parameters
        values, settled = np.empty(len(x)), np.ones(len(x), dtype=np.bool_)
        for i, (now, value) in enumerate(zip(time.tolist(), x.tolist())):
            if self._state is None or now - self._time > self._gap_s:
                self._state, self._start = declared.start(value, *given), now
            else:
                self._state = declared.step(self._state, value, self._x, now - self._time, *given)
            self._time, self._x = now, value
            values[i] = declared.value(self._state, value, *given)
            settled[i] = now - self._start >= self._needed_s
            if declared.settled is not None:
                settled[i] &= bool(declared.settled(self._state, value, *given))
        return values, settled


def taken_in(
    operator: MemoryOperator, time: FloatArray, x: FloatArray, text: str
) -> tuple[FloatArray, BoolArray]:
    """Values of an operator, `text` in features, at the next samples, and where they are settled; (n,) each.

    Raises
    ------
    InputError
        If it makes no number of a sample, as a wave of period 0 does, or raises.
    """
    try:
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            values, settled = operator.push(time, x)
    except FogmlError:
        raise
    except (ArithmeticError, ValueError) as error:
        raise InputError(f"{text} can't be worked out ({error}); state other numbers in it") from None
    except Exception as error:  # others' code raises whatever it likes
        raise InputError(
            f"{text} can't be worked out: {type(error).__name__} ({first_line(error)})"
        ) from None
    if not (finite := np.isfinite(values)).all():
        at = int(np.argmin(finite))
        raise InputError(
            f"{text} is {values[at]} at time {time[at]:.10g} s, of {x[at]:.6g}; state other numbers in it"
        )
    return values, settled


Declared = Function | Recursion | Kernel
_declared: dict[str, Declared] = {}
_looked_up = False


def declare(operator: Declared, *, again: bool = False) -> Declared:
    """Make an operator or a window known by its name.

    Parameters
    ----------
    operator
        The declaration.
    again
        Whether it takes the place of another one of its name, as where a cell of a notebook runs again;
        features that name it compute it from then on, so fit models that have them again.

    Returns
    -------
    Function, Recursion or Kernel
        The declaration.

    Raises
    ------
    InputError
        If it is none, another one has the name, or feature text has it for something else.
    """
    if not isinstance(operator, Declared):
        kind = type(operator).__name__
        raise InputError(f"a Function, a Recursion or a Kernel is declared, found {kind}")
    if operator.name in (*FUNCTIONS, *METHODS):
        raise InputError(f"operator {operator.name}: the name is feature text's own")
    if again:
        _declared[operator.name] = operator
    if _declared.setdefault(operator.name, operator) != operator:
        raise InputError(
            f"operator {operator.name}: the name is taken; declare(..., again=True) puts this in its place"
        )
    return operator


def own_operator(name: str) -> Function | Recursion | None:
    """The operator of a name; None for none."""
    found = _known().get(name)
    return None if isinstance(found, Kernel) else found


def operator_names() -> tuple[str, ...]:
    """Names that feature text calls with parentheses: those that ship, and one's own."""
    return (*FUNCTIONS, *(name for name, found in _known().items() if not isinstance(found, Kernel)))


def window_names() -> tuple[str, ...]:
    """Names of windows: those that ship, and one's own."""
    return (*METHODS, *(name for name, found in _known().items() if isinstance(found, Kernel)))


def own_window(name: str) -> Kernel | None:
    """The window of a name; None for none."""
    found = _known().get(name)
    return found if isinstance(found, Kernel) else None


def _known() -> dict[str, Declared]:
    global _looked_up
    if not _looked_up:
        for point in entry_points(group=GROUP):
            found = loaded(point)
            if isinstance(found, Declared):
                declare(found)
            elif not isinstance(found, ModuleType):  # a module has declared what it holds
                raise InputError(
                    f"{origin(point)} in group '{GROUP}': {point.value} is no operator; it has to name a "
                    "Function, a Recursion or a Kernel, or a module that declares some"
                )
        _looked_up = True
    return _declared
