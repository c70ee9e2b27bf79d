"""Atoms: one operator on one signal, the factors that feature terms are products of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.features.signal import Signal, number_text
from fogml.runs.run import Run
from fogml.signals import windows
from fogml.signals.clock import EXPONENTIAL_SPAN, Clock

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Operator = Literal["value", "diff", "d", "sign"]
Method = Literal["block", "slope", "exp", "first"]

OPERATORS: tuple[Operator, ...] = get_args(Operator)
METHODS: tuple[Method, ...] = get_args(Method)
RATE_UNIT_S = 60.0
"""Rates of temperature are per minute."""
DEAD_BAND = 0.05
"""Rates up to this size [degC/min], either way, count as standing still: direction 0."""
EXPONENTIAL_MEMORY = 40.0
"""Time constants after which an exponential window has forgotten to below float64 (e**-40)."""


@dataclass(frozen=True)
class Window:
    """How a difference or a rate is taken.

    Attributes
    ----------
    method
        ``block``: newest window's mean less the mean of the window before. ``slope``: least-squares
        line over one window. ``exp``: exponential memory. ``first``: neighbouring samples.
    length_s
        Length of each window, or time constant of ``exp`` [s]; 0 for ``first``.
    """

    method: Method = "block"
    length_s: float = 64.0

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise InputError(f"window: no method '{self.method}'; known are {', '.join(METHODS)}")
        if self.method == "first":
            object.__setattr__(self, "length_s", 0.0)
        elif not (np.isfinite(self.length_s) and self.length_s > 0.0):
            raise InputError(f"window: a length of {self.length_s} s; a positive number was expected")
        else:
            object.__setattr__(self, "length_s", float(self.length_s))

    @property
    def text(self) -> str:
        """The option in brackets, empty for the default."""
        if self == DEFAULT_WINDOW:
            return ""
        return "[first]" if self.method == "first" else f"[{self.method}, {number_text(self.length_s)} s]"

    @property
    def span_s(self) -> float:
        """Time from the start until it is full [s], to within a sample interval."""
        spans = {"block": 2.0, "slope": 1.0, "exp": EXPONENTIAL_SPAN, "first": 0.0}
        return spans[self.method] * self.length_s

    @property
    def memory_s(self) -> float:
        """How far back samples still change its value, at float64 [s]."""
        return EXPONENTIAL_MEMORY * self.length_s if self.method == "exp" else self.span_s


DEFAULT_WINDOW = Window()


@dataclass(frozen=True)
class Atom:
    """One operator on one signal.

    Attributes
    ----------
    operator
        ``value`` [degC]; ``diff`` difference [degC]; ``d`` rate [degC/min]; ``sign`` direction of
        the rate: -1, 0 or +1, with a dead band of 0.05 degC/min.
    signal
        What it works on.
    window
        How differences and rates are taken; None for ``value``.
    """

    operator: Operator
    signal: Signal
    window: Window | None = None

    def __post_init__(self) -> None:
        if self.operator not in OPERATORS:
            raise InputError(f"atom: no operator '{self.operator}'; known are {', '.join(OPERATORS)}")
        if self.operator == "value":
            object.__setattr__(self, "window", None)
        elif self.window is None:
            object.__setattr__(self, "window", DEFAULT_WINDOW)

    def __str__(self) -> str:
        return self.text

    @property
    def text(self) -> str:
        """Text form, e.g. ``dT[slope, 60 s]``."""
        signal = self.signal.text
        if self.window is None:
            return signal
        if self.operator == "diff":
            return f"diff({signal}){self.window.text}"
        rate = (f"d{signal}" if self.signal.is_sensor else f"d({signal})") + self.window.text
        return f"sign({rate})" if self.operator == "sign" else rate

    @property
    def factor_text(self) -> str:
        """Text form as a factor of a product or under a power: sums stand in parentheses."""
        plain = self.window is not None or self.signal.is_sensor
        return self.text if plain else f"({self.text})"

    @property
    def unit(self) -> str:
        """Unit of its values; empty for a direction."""
        return {"value": "degC", "diff": "degC", "d": "degC/min", "sign": ""}[self.operator]

    @property
    def order(self) -> tuple[Any, ...]:
        """Sort key among the factors of a term: values, differences, rates, directions."""
        return OPERATORS.index(self.operator), self.signal.order, self.text


def windowed_values(
    signal: FloatArray, clock: Clock, window: Window, unit_s: float | None, out: FloatArray | None = None
) -> tuple[FloatArray, BoolArray]:
    """A signal's difference (``unit_s=None``) or rate per `unit_s` seconds, and where it is full."""
    if window.method == "first":
        return windows.first_difference(clock, signal, unit_s=unit_s, out=out)
    operator = {"block": windows.block_difference, "slope": windows.slope, "exp": windows.exponential}
    return operator[window.method](clock, signal, window.length_s, unit_s=unit_s, out=out)


def direction(rate: FloatArray) -> FloatArray:
    """-1, 0 or +1 for rates [degC/min] below, within and above the dead band."""
    band = DEAD_BAND * (1.0 + 1e-9)  # a ramp at just the dead band's rate is 0 in spite of float noise
    return np.subtract(rate > band, rate < -band, dtype=np.float64)


def evaluate(
    atoms: tuple[Atom, ...], run: Run, sample_s: float | None, columns: Sequence[FloatArray]
) -> BoolArray:
    """Put values of atoms over a run into `columns`; tell where all their windows are full.

    Parameters
    ----------
    atoms
        The a atoms wanted.
    run
        The run.
    sample_s
        Nominal sample interval [s]; the run's own if None.
    columns
        Where the values go, an array (n,) per atom. Where a window is not full all windowed atoms
        are 0.

    Returns
    -------
    (n,) bool array

    Raises
    ------
    InputError
        If a temperature is missing, or a window is shorter than the sample interval.
    """
    try:
        return _evaluated(atoms, run, sample_s, columns)
    except InputError as error:
        message = str(error)
        raise InputError(message if message.startswith(run.name) else f"{run.name}: {message}") from error


def _evaluated(
    atoms: tuple[Atom, ...], run: Run, sample_s: float | None, columns: Sequence[FloatArray]
) -> BoolArray:
    clock = run.clock if sample_s is None else Clock(run.time, sample_s)
    full = np.ones(len(run), dtype=np.bool_)
    signals: dict[Signal, FloatArray] = {}
    # Values first: a combination of sensors is then made once, in its own column.
    for atom, column in zip(atoms, columns):
        if atom.window is None:
            signals[atom.signal] = values = atom.signal.values(run, out=column)
            if values is not column:
                column[:] = values
    rates: dict[tuple[Signal, Window], FloatArray] = {}
    for atom, column in zip(atoms, columns):
        if atom.window is None:
            continue
        if atom.signal not in signals:
            signals[atom.signal] = atom.signal.values(run)
        signal, key = signals[atom.signal], (atom.signal, atom.window)
        if atom.operator == "diff":
            _, atom_full = windowed_values(signal, clock, atom.window, None, column)
            full &= atom_full
            continue
        if key not in rates:
            place = column if atom.operator == "d" else None
            rates[key], atom_full = windowed_values(signal, clock, atom.window, RATE_UNIT_S, place)
            full &= atom_full
        if atom.operator == "sign":
            column[:] = direction(rates[key])
        elif rates[key] is not column:
            column[:] = rates[key]
    if not full.all():
        partial = np.flatnonzero(~full)
        for atom, column in zip(atoms, columns):
            if atom.window is not None:
                column[partial] = 0.0
    return full
