"""How C code keeps feature windows and memories: clock ticks, rings of held samples or of bins of them.

Times are kept in ticks and temperatures as whole multiples of a small step. Sums over the ring are taken
afresh at each sample, so that they are exact however long the firmware runs, take at most one ring, and come
out alike on every machine. The rules of gaps and fullness are those of `fogml.signals.windows`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from fogml.errors import InputError
from fogml.export.plan import Plan
from fogml.features.atoms import RATE_UNIT_S, Atom
from fogml.features.operators import Window, ring_of
from fogml.features.own import Recursion
from fogml.features.signal import Signal
from fogml.runs.columns import is_temperature
from fogml.signals.clock import (
    LEAST_SHARE,
    check_window,
    longest_gap_s,
    needed_s,
)

Number = Literal["float64", "float32", "fixed"]

TEMPERATURE_BITS = {"float64": 27, "float32": 22, "fixed": 20}
"""Held temperatures are multiples of 2**-bits degC."""
RANGE_BITS = 9
"""Temperatures up to 2**9 degC either way are taken."""
_SPAN_BITS = 30
NOISE_TICKS = 2
"""Ticks by which an age falls short of a window's edge and leaves it all the same."""


@dataclass(frozen=True)
class Operator:
    """One running difference or rate, or a declared operator with a state.

    Attributes
    ----------
    window
        Its method and length.
    signal
        Place of its signal among the layout's signals.
    held
        Place of its signal among the rings; -1 where none is needed.
    unit_s
        Time unit of the rate [s]; None for a difference.
    gap_s
        Longest interval that does not restart it.
    window_ticks, both_ticks, needed_ticks
        Age at which a sample leaves the newest window, both windows; time until full.
    counting_ticks, span_ticks
        Time until what the window holds counts; what it reaches over.
    own
        The atom of a declared operator, with the window's length as its time constant.
    """

    window: Window
    signal: int
    held: int
    unit_s: float | None
    gap_s: float
    window_ticks: int
    both_ticks: int
    needed_ticks: int
    counting_ticks: int
    span_ticks: int
    own: Atom | None = None

    @property
    def filling(self) -> str:
        """Arguments in C of how far its window is filled."""
        return f"known, INT64_C({self.needed_ticks}), INT64_C({self.span_ticks})"

    @property
    def method(self) -> str:
        """``block``, ``slope``, ``exp``, ``first``, a window of one's own; ``own`` of an operator."""
        return "own" if self.own is not None else self.window.method


@dataclass(frozen=True)
class Layout:
    """The windows and memories of a plan.

    Attributes
    ----------
    tick_us
        Length of a tick [us].
    temperature_bits
        Held temperatures are multiples of 2**-bits degC.
    signals
        Distinct combinations of temperatures.
    operators
        Distinct running operators.
    of_atom
        For each atom the place of its operator, or -1 where it is a signal's value.
    signal_of_atom
        For each atom the place of its signal.
    held
        Places of the signals that have a ring.
    ring
        Samples, or bins of them, that each ring holds.
    bin_samples
        Samples that a bin holds at the nominal interval; 1 where each is kept by itself.
    longest_gap_s
        An interval longer than this restarts everything but operators that know no time.
    """

    tick_us: int
    temperature_bits: int
    signals: tuple[Signal, ...]
    operators: tuple[Operator, ...]
    of_atom: tuple[int, ...]
    signal_of_atom: tuple[int, ...]
    held: tuple[int, ...]
    ring: int
    bin_samples: int
    longest_gap_s: float

    @property
    def binned(self) -> bool:
        """Whether samples are kept in bins."""
        return self.bin_samples > 1

    @property
    def tick_s(self) -> float:
        """Length of a tick [s]."""
        return self.tick_us * 1e-6

    @property
    def clock_bits(self) -> list[int]:
        """Bits of the clocks of microseconds that tell its longest gap."""
        return [64, 32] if self.longest_gap_s * 1e6 < 2.0**31 else [64]

    def of_method(self, method: str) -> list[tuple[int, Operator]]:
        """Operators of a method with their places."""
        return [(i, operator) for i, operator in enumerate(self.operators) if operator.method == method]

    @property
    def lines(self) -> list[tuple[int, Operator]]:
        """The slopes and the windows of one's own, which hold their samples alike, with their places."""
        return [(i, o) for i, o in enumerate(self.operators) if o.window.held and o.method != "block"]


def layout(plan: Plan, number: Number) -> Layout:
    """The windows and memories of a plan for C code.

    Raises
    ------
    InputError
        If a window is shorter than the sample interval, or too long for C, or C code in this number format
        does not hold what a window or a memory is of.
    """
    for atom in plan.atoms:
        _check_held(atom, number)
    signals = tuple(dict.fromkeys(atom.signal for atom in plan.atoms))
    keys = tuple(dict.fromkeys(key for atom in plan.atoms if (key := _key(atom)) is not None))
    for _, window, _, memory in keys:
        _check(window, plan.sample_s, memory)
        _check_rounding(window, plan.sample_s, memory, number)
    held = tuple(dict.fromkeys(signals.index(s) for s, w, _, _ in keys if w.held))
    ring, bin_samples = ring_of([window for _, window, _, _ in keys], plan.sample_s)
    gaps = [_gap_s(window, plan.sample_s) for _, window, _, _ in keys]
    longest_gap = max(gaps, default=0.0)
    # What knows no time has no say in how often samples must come.
    timeless = [atom is not None and window.method == "first" for _, window, _, atom in keys]
    gaps = [longest_gap if without else gap for without, gap in zip(timeless, gaps)]
    held_s = [w.span_s for _, w, _, _ in keys if w.held]
    tick_us = _tick_us(plan.sample_s, max(held_s, default=0.0))
    tick_s = tick_us * 1e-6
    operators = []
    for (signal, window, unit_s, memory), gap_s in zip(keys, gaps):
        place = signals.index(signal)
        operator = _operator(plan.sample_s, tick_s, place, held, window, unit_s, gap_s)
        operators.append(replace(operator, own=memory))
    of_atom = tuple(keys.index(key) if (key := _key(atom)) is not None else -1 for atom in plan.atoms)
    return Layout(
        tick_us,
        TEMPERATURE_BITS[number],
        signals,
        tuple(operators),
        of_atom,
        tuple(signals.index(atom.signal) for atom in plan.atoms),
        held,
        ring,
        bin_samples,
        longest_gap,
    )


def _check_held(atom: Atom, number: Number) -> None:
    """Refuse what C code can't hold: columns whose range it can't know."""
    if all(is_temperature(name) for name in atom.signal.sensors):
        return
    if number == "fixed":
        raise InputError(
            f"export: the model takes {atom.text}; C code in fixed point takes temperatures alone, whose "
            "range it knows; use --dtype float32 or float64"
        )
    if atom.window is not None and atom.window.held:
        raise InputError(
            f"export: the model takes {atom.text}; C code holds windows of temperatures alone, whose range "
            f"it knows; train with {atom.text.partition('[')[0]}[exp, {atom.window.length_s:g} s]"
        )


def _key(atom: Atom) -> tuple[Signal, Window, float | None, Atom | None] | None:
    """What tells running operators apart: a rate and its direction share one."""
    if isinstance(declared := atom.declared, Recursion):
        time_s = declared.time_s(atom.given)
        return atom.signal, Window("exp", time_s) if time_s else Window("first"), None, atom
    if atom.window is None:
        return None
    return atom.signal, atom.window, None if atom.operator == "diff" else RATE_UNIT_S, None


def _check(window: Window, sample_s: float, memory: Atom | None) -> None:
    if memory is not None and window.length_s:
        check_window(window.length_s, sample_s, 1, f"the time constant of {memory.text}")
    elif window.method == "block":
        check_window(window.length_s, sample_s, 1, "a block window")
    elif window.method not in ("exp", "first"):
        check_window(window.length_s, sample_s, 2, f"a window of {window.method}")
    elif window.method == "exp":
        check_window(window.length_s, sample_s, 1, "a time constant")


def _check_rounding(
    window: Window, sample_s: float, memory: Atom | None, number: Number, most: float = 2.0**21
) -> None:
    """Refuse what remembers over more than `most` samples where rounding eats what one of them moves it by.

    At 2**21 that is an eighth of it in float32, whose steps are 2**-24 of a number; in fixed point, rates
    stand 0.06 degC/min off. Histories that exports are compared on are too short to show it.
    """
    coarse = number == "float32" or (number == "fixed" and memory is None)
    if coarse and window.method == "exp" and window.length_s > most * sample_s:
        least_s = 1.06 * window.length_s / most
        raise InputError(
            f"export: with a time constant of {window.length_s:g} s a sample {sample_s:g} s on moves it "
            "by less than float32 or fixed point tells; use --dtype float64, or call the code less often and "
            f"state that, --sample-s {least_s:.2g} or more"
        )


def _gap_s(window: Window, sample_s: float) -> float:
    return longest_gap_s(0.0 if window.method == "first" else window.length_s, sample_s)


def _tick_us(sample_s: float, longest_s: float) -> int:
    """Length of a tick [us]: a power of ten, so that ages in windows stay below 2**30 ticks."""
    tick_us = 1
    while longest_s * 1e6 / tick_us >= 2.0**_SPAN_BITS:
        tick_us *= 10
    if sample_s * 1e6 < 8.0 * NOISE_TICKS * tick_us:
        raise InputError(
            f"export: samples every {sample_s:g} s with windows of {longest_s:g} s need a finer clock than C "
            "code has; use shorter windows, or [exp, ...]"
        )
    return tick_us


def _operator(
    sample_s: float,
    tick_s: float,
    signal: int,
    held: tuple[int, ...],
    window: Window,
    unit_s: float | None,
    gap_s: float,
) -> Operator:
    needed = needed_s(window.span_s, sample_s)

    def ticks(seconds: float) -> int:
        return max(1, round(seconds / tick_s) - NOISE_TICKS)

    return Operator(
        window,
        signal,
        held.index(signal) if signal in held and window.held else -1,
        unit_s,
        gap_s,
        ticks(window.length_s),
        ticks(2.0 * window.length_s),
        max(0, ticks(needed)) if needed > 0 else 0,
        ticks(LEAST_SHARE * window.span_s),
        round(window.span_s / tick_s),
    )
