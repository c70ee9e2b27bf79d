"""Signals: linear combinations of a run's temperatures, such as ``T`` or ``T_in-T_out``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.runs.columns import KNOWN, coil_sensor_number, is_temperature
from fogml.runs.run import Run

FloatArray = NDArray[np.float64]

_ORDER = ["T", *(name for name in KNOWN if name != "T")]


@dataclass(frozen=True)
class Signal:
    """A linear combination of temperatures [degC].

    Equal combinations are equal objects, in whatever order they were written.

    Attributes
    ----------
    parts
        Pairs of a temperature's name in formulas and its coefficient, positive ones first.
    """

    parts: tuple[tuple[str, float], ...]

    def __post_init__(self) -> None:
        coefficients: dict[str, float] = {}
        for name, coefficient in self.parts:
            if not is_temperature(name):
                raise InputError(f"signal: '{name}' is not a temperature; known are {known_temperatures()}")
            if not np.isfinite(coefficient):
                raise InputError(f"signal: {name} has the coefficient {coefficient}; a number was expected")
            coefficients[name] = coefficients.get(name, 0.0) + float(coefficient)
        kept = [(name, coefficient) for name, coefficient in coefficients.items() if coefficient != 0.0]
        if not kept:
            raise InputError("signal: nothing is left of the temperatures; they cancel")
        object.__setattr__(self, "parts", tuple(sorted(kept, key=_sort_key)))

    @classmethod
    def of(cls, combination: str | Mapping[str, float]) -> Signal:
        """A signal from one name, or from a mapping of names to coefficients."""
        pairs: Iterable[tuple[str, float]] = (
            [(combination, 1.0)] if isinstance(combination, str) else combination.items()
        )
        return cls(tuple(pairs))

    @property
    def is_sensor(self) -> bool:
        """Whether it is one temperature as it stands."""
        return len(self.parts) == 1 and self.parts[0][1] == 1.0

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names in formulas of the temperatures it takes."""
        return tuple(name for name, _ in self.parts)

    @property
    def order(self) -> tuple[tuple[bool, int, int, float], ...]:
        """Sort key among signals: by sensor, coil sensors by number."""
        return tuple((*_sort_key(part), part[1]) for part in self.parts)

    @property
    def text(self) -> str:
        """Text form, e.g. ``T_in-T_out``."""
        pieces = []
        for index, (name, coefficient) in enumerate(self.parts):
            sign = "-" if coefficient < 0 else "+" if index else ""
            size = abs(coefficient)
            pieces.append(sign + (name if size == 1.0 else f"{number_text(size)}*{name}"))
        return "".join(pieces)

    def values(self, run: Run, out: FloatArray | None = None) -> FloatArray:
        """The signal [degC] of a run, shape (n,); a view where it is one recorded column.

        Parameters
        ----------
        run
            The run.
        out
            Where it is put otherwise, shape (n,); a new array if None.

        Raises
        ------
        InputError
            If the run lacks a temperature.
        """
        (name, coefficient), *others = self.parts
        total = run.temperature(name)
        if coefficient != 1.0:
            total = np.multiply(coefficient, total, out=out)
        for name, coefficient in others:
            if abs(coefficient) == 1.0:
                part = run.temperature(name)
            else:
                part = abs(coefficient) * run.temperature(name)
            total = np.add(total, part, out=out) if coefficient > 0 else np.subtract(total, part, out=out)
        return total

    def weights(self, recorded: Iterable[str]) -> dict[str, float]:
        """Weights of the recorded temperature columns that make the signal.

        What a name stands for where it is not recorded itself (T for T_in, T_in for the mean of
        the odd sensors) is asked of `Run`, so that the rule is written once.

        Raises
        ------
        InputError
            If a temperature is neither recorded nor stood in for.
        """
        names = [name for name in recorded if is_temperature(name)]
        unit = np.eye(len(names))
        index = np.arange(float(len(names)))
        columns = {"time": index, "gyro": index, **{name: unit[i] for i, name in enumerate(names)}}
        probed = self.values(Run(name="temperatures", columns=columns))
        return {name: float(weight) for name, weight in zip(names, probed) if weight != 0.0}


def known_temperatures() -> str:
    """The temperatures that feature text knows, for messages."""
    return (
        ", ".join(sorted((name for name in KNOWN if is_temperature(name)), key=_ORDER.index)) + ", T1, T2 ..."
    )


def number_text(value: float) -> str:
    """Shortest text that reads back as the same number, without a trailing ``.0``."""
    return repr(float(value)).removesuffix(".0")


def _sort_key(part: tuple[str, float]) -> tuple[bool, int, int]:
    name, coefficient = part
    number = coil_sensor_number(name)
    if number is None:
        return coefficient < 0, 0, _ORDER.index(name)
    return coefficient < 0, 1, number
