"""Atoms: one operator on one signal, the factors that feature terms are products of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError, known_are
from fogml.features.operators import DEFAULT_WINDOW, MEMORY_OPERATORS, Window, windowed_values
from fogml.features.own import Function, Recursion, own_operator, taken_in
from fogml.features.signal import TIME_ON, Signal
from fogml.numerals import number_text
from fogml.runs.columns import is_temperature
from fogml.runs.run import Run
from fogml.signals.clock import Clock
from fogml.signals.memory import MemoryOperator

Operator = Literal["value", "lag", "play", "since_on", "beyond", "diff", "d", "sign"]

OPERATORS: tuple[Operator, ...] = get_args(Operator)
MEMORIES: tuple[Operator, ...] = ("lag", "play", "since_on")
"""Operators that remember more than a window holds."""
WINDOWED: tuple[Operator, ...] = ("diff", "d", "sign")
"""Operators over a window."""
HYSTERESIS_DEGC = (4.0, 10.0, 20.0)
"""Half widths of the plays that ``hysteresis(x)`` stands for [degC]: loops of 8 to 40 degC."""
RATE_UNIT_S = 60.0
"""Rates of temperature are per minute."""
DEAD_BAND = 0.05
"""Rates up to this size [degC/min], either way, count as standing still: direction 0."""


@dataclass(frozen=True)
class Atom:
    """One operator on one signal.

    Attributes
    ----------
    operator
        ``value``; ``lag`` first-order lag; ``play`` play operator; ``since_on`` exponential decay
        since power-on; ``beyond`` how far beyond bounds, levelled off; ``diff`` difference; ``d`` rate
        per minute; ``sign`` direction of a temperature's rate, with a dead band of 0.05 degC/min.
    signal
        What it works on.
    window
        How differences and rates are taken; None for the others.
    memory
        Time constant of ``lag`` and ``since_on`` [s], half width of ``play`` [unit of the signal];
        0 for the others.
    bounds
        Lower and upper one of ``beyond`` [unit of the signal]; None for the others.
    parameters
        Of an operator of one's own (`fogml.features.own`); empty for the others.
    """

    operator: str
    signal: Signal
    window: Window | None = None
    memory: float = 0.0
    bounds: tuple[float, float] | None = None
    parameters: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        own = self.own
        if self.operator not in OPERATORS and own is None:
            raise InputError(f"atom: no operator '{self.operator}'; {known_are(self.operator, OPERATORS)}")
        if self.operator not in WINDOWED:
            object.__setattr__(self, "window", None)
        elif self.window is None:
            object.__setattr__(self, "window", DEFAULT_WINDOW)
        if self.operator == "sign" and self.signal.unit != "degC":
            raise InputError(
                f"atom: sign(d({self.signal.text})) is not of a temperature; its dead band is not known"
            )
        if len(self.parameters) != (0 if own is None else len(own.parameters)):
            raise InputError(f"atom: {self.operator} with parameters {self.parameters}")
        object.__setattr__(self, "memory", float(self.memory))
        if self.operator == "since_on" and self.signal.sensors != (TIME_ON,):
            raise InputError(f"atom: since_on of {self.signal.text}; it is of {TIME_ON}")
        if (self.operator in MEMORIES) != (0.0 < self.memory < np.inf):
            expected = "a positive number" if self.operator in MEMORIES else "none"
            told = f"with a memory of {self.memory:g}; {expected} was expected"
            raise InputError(f"atom: {self.operator} {told}")
        if (self.operator == "beyond") != (self.bounds is not None):
            raise InputError(f"atom: {self.operator} with bounds {self.bounds}; beyond has two, others none")

    def __str__(self) -> str:
        return self.text

    @property
    def own(self) -> Function | Recursion | None:
        """The declaration of an operator of one's own; None for the others."""
        return None if self.operator in OPERATORS else own_operator(self.operator)

    @property
    def declared(self) -> Function | Recursion | None:
        """The declaration of an operator that ships or of one's own; None for values and windows."""
        return MEMORY_OPERATORS.get(self.operator) or self.own

    @property
    def given(self) -> tuple[float, ...]:
        """What the declaration's parameters are."""
        return self.parameters or self.bounds or ((self.memory,) if self.memory else ())

    @property
    def follows(self) -> bool:
        """Whether its value is its signal's where nothing moves."""
        declared = self.declared
        return declared.follows if isinstance(declared, Recursion) else self.operator == "value"

    @property
    def instant(self) -> bool:
        """Whether its value is of its signal's present value alone."""
        return self.window is None and not self.settles

    @property
    def settles(self) -> bool:
        """Whether its value goes by what was before a run until it has settled."""
        return self.window is None and isinstance(self.declared, Recursion)

    @property
    def of_input_at_rest(self) -> bool:
        """Whether its value where nothing moves is told by its signal's."""
        declared = self.declared
        return self.follows or (
            self.instant and not (isinstance(declared, Function) and declared.rest is not None)
        )

    @property
    def text(self) -> str:
        """Text form, e.g. ``dT[slope, 60 s]``."""
        signal = self.signal.text
        if self.operator == "since_on":
            return f"since_on({number_text(self.memory)} s)"
        if self.operator in MEMORIES:
            unit = "s" if self.operator == "lag" else self.signal.written_unit
            return f"{self.operator}({signal}, {f'{number_text(self.memory)} {unit}'.rstrip()})"
        if (own := self.own) is not None:
            units = {"s": "s", "x": self.signal.written_unit, "1": ""}
            given = zip(self.parameters, own.parameters, strict=True)
            told = (f"{number_text(value)} {units[kind]}".rstrip() for value, kind in given)
            return f"{self.operator}({', '.join((signal, *told))})"
        if self.bounds is not None:
            ends = (f"{number_text(end)} {self.signal.written_unit}".rstrip() for end in self.bounds)
            return f"beyond({signal}, {', '.join(ends)})"
        if self.window is None:
            return signal
        if self.operator == "diff":
            return f"diff({signal}){self.window.text}"
        plain = self.signal.is_sensor and is_temperature(signal)
        rate = (f"d{signal}" if plain else f"d({signal})") + self.window.text
        return f"sign({rate})" if self.operator == "sign" else rate

    @property
    def factor_text(self) -> str:
        """Text form as a factor of a product or under a power: sums stand in parentheses."""
        plain = self.operator != "value" or self.signal.is_sensor
        return self.text if plain else f"({self.text})"

    @property
    def unit(self) -> str:
        """Unit of its values; empty for a direction."""
        if self.operator in ("since_on", "sign"):
            return ""
        if (own := self.own) is not None and own.unit is not None:
            return own.unit
        return f"{self.signal.unit}/min" if self.operator == "d" else self.signal.unit

    @property
    def order(self) -> tuple[Any, ...]:
        """Sort key among the factors of a term: values, memories, differences, rates, directions."""
        place = OPERATORS.index(self.operator) if self.operator in OPERATORS else len(OPERATORS)
        return place, self.signal.order, self.text

    def memory_operator(self, sample_s: float) -> MemoryOperator | None:
        """A fresh operator for samples `sample_s` seconds apart; None for values and windows.

        Raises
        ------
        InputError
            If a time constant is shorter than the sample interval.
        """
        return None if (declared := self.declared) is None else declared.operator(self.given, sample_s)


def direction(rate: FloatArray) -> FloatArray:
    """-1, 0 or +1 for rates [degC/min] below, within and above the dead band."""
    band = DEAD_BAND * (1.0 + 1e-9)  # a ramp at just the dead band's rate is 0 in spite of float noise
    return np.subtract(rate > band, rate < -band, dtype=np.float64)


Memories = dict[Atom, MemoryOperator]
"""Operators with what they remember, by the atoms that they are of."""


class AtomValues(NamedTuple):
    """Values of a atoms at n samples.

    Attributes
    ----------
    values
        Shape (n, a), column by column contiguous. While a window fills its atoms begin at 0, what the
        static part is of, and come near the rate as it tells more (`fogml.signals.windows`).
    full
        Where all windows hold enough to count, shape (n,): these are the rows that models are fitted to and
        judged on.
    settled
        Where all windows are full and all memories settled, shape (n,): what was before the run no longer
        matters.
    """

    values: FloatArray
    full: BoolArray
    settled: BoolArray


def evaluate(
    atoms: tuple[Atom, ...],
    run: Run,
    sample_s: float | None,
    columns: Sequence[FloatArray],
    memories: Memories | None = None,
    skip: int = 0,
) -> tuple[BoolArray, BoolArray]:
    """Put values of atoms over a run into `columns`; tell where they mean something.

    Parameters
    ----------
    atoms
        The a atoms wanted.
    run
        The run.
    sample_s
        Nominal sample interval [s]; the run's own if None.
    columns
        Where the values go, an array (n,) per atom.
    memories
        Operators to go on with, and to leave for the next block; fresh ones if None.
    skip
        The first rows that memories have taken already; their values there are 0.

    Returns
    -------
    full, settled : (n,) bool arrays
        As in `AtomValues`.

    Raises
    ------
    InputError
        If a column is missing, or a window is shorter than the sample interval.
    """
    try:
        return _evaluated(atoms, run, sample_s, columns, {} if memories is None else memories, skip)
    except InputError as error:
        message = str(error)
        raise InputError(message if message.startswith(run.name) else f"{run.name}: {message}") from error


def _evaluated(
    atoms: tuple[Atom, ...],
    run: Run,
    sample_s: float | None,
    columns: Sequence[FloatArray],
    memories: Memories,
    skip: int,
) -> tuple[BoolArray, BoolArray]:
    clock = run.clock if sample_s is None else Clock(run.time, sample_s)
    full, settled = np.ones(len(run), dtype=np.bool_), np.ones(len(run), dtype=np.bool_)
    signals: dict[Signal, FloatArray] = {}
    # Values first: a combination of sensors is then made once, in its own column.
    for atom, column in zip(atoms, columns):
        if atom.operator == "value":
            signals[atom.signal] = values = atom.signal.values(run, out=column)
            if values is not column:
                column[:] = values
    rates: dict[tuple[Signal, Window], FloatArray] = {}
    for atom, column in zip(atoms, columns):
        if atom.operator == "value":
            continue
        if atom.signal not in signals:
            signals[atom.signal] = atom.signal.values(run)
        signal = signals[atom.signal]
        if atom.window is None:
            memory = memories.get(atom) or atom.memory_operator(clock.sample_s)
            assert memory is not None
            memories[atom] = memory
            column[:skip] = 0.0
            held = np.ascontiguousarray(signal[skip:])
            column[skip:], atom_settled = taken_in(memory, clock.time[skip:], held, atom.text)
            settled[skip:] &= atom_settled
            continue
        key = (atom.signal, atom.window)
        if atom.operator == "diff":
            _, atom_full, counts = windowed_values(signal, clock, atom.window, None, column)
            full &= counts
            settled &= atom_full
            continue
        if key not in rates:
            place = column if atom.operator == "d" else None
            rates[key], atom_full, counts = windowed_values(signal, clock, atom.window, RATE_UNIT_S, place)
            full &= counts
            settled &= atom_full
        if atom.operator == "sign":
            column[:] = direction(rates[key])
        elif rates[key] is not column:
            column[:] = rates[key]
    return full, settled


def temperatures_among(atoms: Sequence[Atom]) -> list[int]:
    """Places of the atoms that are a temperature itself: no rate, memory or difference."""
    plain = [atom.operator == "value" and atom.signal.is_sensor for atom in atoms]
    return [i for i, atom in enumerate(atoms) if plain[i] and atom.signal.unit == "degC"]
