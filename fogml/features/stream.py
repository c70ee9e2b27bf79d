"""Features sample by sample, as on board: the streaming twin of `Features`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.features.atoms import RATE_UNIT_S, Atom, Window, direction
from fogml.features.features import Features
from fogml.features.own import taken_in
from fogml.features.signal import TIME_ON, Signal
from fogml.runs.columns import is_temperature
from fogml.runs.dropouts import ThermometerStream, Told
from fogml.signals.kernel_windows import KernelStream
from fogml.signals.memory import (
    BlockDifferenceStream,
    ExponentialStream,
    FirstDifferenceStream,
    SlopeStream,
    WindowStream,
)


class StreamStep(NamedTuple):
    """What a stream gives after one sample.

    Attributes
    ----------
    values
        Features, shape (k,).
    atoms
        Atom values before any limit, shape (a,).
    full
        Whether all windows hold enough to count.
    settled
        Whether all windows are full and all memories settled.
    outside
        Whether an atom is outside the learned box; False where none was learned.
    """

    values: FloatArray
    atoms: FloatArray
    full: bool
    settled: bool
    outside: bool


class FeatureStream:
    """`Features` fed one sample at a time, in memory bounded by the longest window.

    Parameters
    ----------
    features
        The features, with their box if `outside` is to be told.
    sample_s
        Nominal sample interval [s].
    limited
        Whether atoms are limited to the learned box before features are composed.
    linear
        If so, as for a model that goes on linearly.
    powered_on_s
        Time of power-on on the clock of the samples [s]; None where no feature needs it, or ``time_on``
        comes with the samples.

    Raises
    ------
    InputError
        If a window is shorter than the sample interval, or `limited` without a box.
    """

    def __init__(
        self,
        features: Features,
        sample_s: float,
        *,
        limited: bool = False,
        linear: bool = False,
        powered_on_s: float | None = None,
    ) -> None:
        self._powered_on_s = powered_on_s
        self._features = features
        self._limited = limited
        self._linear = linear
        self._judged = limited or features.fitted
        if limited:
            _ = features.box
        self._last_s = -np.inf
        self._weights: dict[Signal, dict[str, float]] | None = None
        self._sample_s = sample_s
        self._thermometers: dict[str, ThermometerStream] = {}
        self._start()
        self._held = self._before_any()

    def _start(self) -> None:
        """Windows and memories of which nothing is known yet."""
        self._operators = {
            key: _operator(key[1], self._sample_s, key[2])
            for key in map(_operator_key, self._features.atoms)
            if key is not None
        }
        self._memories = {
            atom: memory
            for atom in self._features.atoms
            if (memory := atom.memory_operator(self._sample_s)) is not None
        }

    def _before_any(self) -> StreamStep:
        """The middle of the learned box, windows empty; zeros where none was learned."""
        atoms = np.zeros((1, len(self._features.atoms)))
        if self._judged:
            for place, atom in enumerate(self._features.atoms):
                atoms[0, place] = 0.0 if atom.window else np.mean(self._features.box[atom.text])
        return StreamStep(self._features.compose(atoms)[0], atoms[0], False, False, False)

    def step(self, time_s: float, temperatures: Mapping[str, float]) -> StreamStep:
        """Take one sample.

        One at which a temperature was not measured (`fogml.runs.dropouts`) is not taken in: what the last
        measured sample gave is held, its windows not counting; before any that of the middle of the learned
        box.

        Parameters
        ----------
        time_s
            Its time [s], later than the last one's.
        temperatures
            Recorded temperatures [degC], and other columns that features are made of, by column name;
            the same columns at every step.

        Raises
        ------
        InputError
            If time does not go up, or a column is missing.
        """
        if not time_s > self._last_s:
            raise InputError(f"feature stream: time {time_s} s after {self._last_s} s; it must go up")
        if self._powered_on_s is not None and TIME_ON not in temperatures:
            temperatures = {**temperatures, TIME_ON: time_s - self._powered_on_s}
        if self._weights is None:
            signals = {atom.signal for atom in self._features.atoms}
            self._weights = {signal: signal.weights(temperatures) for signal in signals}
        try:
            signal_values = {
                signal: sum(weight * temperatures[name] for name, weight in weights.items())
                for signal, weights in self._weights.items()
            }
        except KeyError as error:
            raise InputError(f"feature stream: no column {error} at {time_s} s") from error
        self._last_s = time_s
        if not self._measured(time_s, temperatures):
            return self._held._replace(full=False)
        steps = {
            key: operator.step(time_s, signal_values[key[0]]) for key, operator in self._operators.items()
        }
        settled = all(step[1] for step in steps.values())
        full = all(step[2] for step in steps.values())
        now = np.array([time_s])
        atoms = np.zeros((1, len(self._features.atoms)))
        for column, atom in enumerate(self._features.atoms):
            key = _operator_key(atom)
            if atom in self._memories:
                signal = np.array([float(signal_values[atom.signal])])
                remembered, is_settled = taken_in(self._memories[atom], now, signal, atom.text)
                atoms[0, column] = remembered[0]
                settled &= bool(is_settled[0])
            elif key is None:
                atoms[0, column] = signal_values[atom.signal]
            else:
                value = steps[key][0]
                atoms[0, column] = direction(np.array(value)) if atom.operator == "sign" else value
        heeded, outside = atoms, np.array([False])
        if self._judged:
            heeded, outside = self._features.limit(atoms, [full], linear=self._linear)
        values = self._features.compose(heeded if self._limited else atoms)
        self._held = StreamStep(values[0], atoms[0], full, settled, bool(outside[0]))
        return self._held

    def _measured(self, time_s: float, temperatures: Mapping[str, float]) -> bool:
        """Whether all temperatures in use are readings; where a first one was none, begin anew."""
        assert self._weights is not None
        used = dict.fromkeys(name for weights in self._weights.values() for name in weights)
        rule = self._features.thermometer
        told = [
            self._thermometers.setdefault(name, ThermometerStream(rule)).read(time_s, temperatures[name])
            for name in used
            if is_temperature(name)
        ]
        if Told.FIRST in told:
            self._start()
        return Told.MISSING not in told and all(math.isfinite(temperatures[name]) for name in used)


def _operator_key(atom: Atom) -> tuple[Signal, Window, float | None] | None:
    """What tells running operators apart: a rate and its direction share one."""
    if atom.window is None:
        return None
    return atom.signal, atom.window, None if atom.operator == "diff" else RATE_UNIT_S


def _operator(window: Window, sample_s: float, unit_s: float | None) -> WindowStream:
    if window.method == "first":
        return FirstDifferenceStream(sample_s, unit_s)
    if (own := window.own) is not None:
        return KernelStream(window.length_s, sample_s, window.length_s if unit_s is None else unit_s, own)
    kinds: dict[str, Callable[[float, float, float | None], WindowStream]] = {
        "block": BlockDifferenceStream,
        "slope": SlopeStream,
        "exp": ExponentialStream,
    }
    return kinds[window.method](window.length_s, sample_s, unit_s)
