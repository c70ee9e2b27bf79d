"""Signals: linear combinations of a run's columns, such as ``T``, ``T_in-T_out`` or ``power``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError, did_you_mean
from fogml.numerals import number_text
from fogml.runs.columns import KNOWN, REPLAYED, TIME_ON, coil_sensor_number, column_spec, is_temperature
from fogml.runs.run import Run

NOT_INPUTS = ("time", "gyro", REPLAYED)
"""Columns that no feature may be made of."""
_ORDER = ["T", *(name for name in KNOWN if name != "T")]


@dataclass(frozen=True)
class Signal:
    """A linear combination of a run's columns, temperatures above all.

    Equal combinations are equal objects, in whatever order they were written.

    Attributes
    ----------
    parts
        Pairs of a name and its coefficient, positive ones first. A name is that of a temperature in
        formulas (`fogml.runs.run.Run.temperature`), of any other column, or ``time_on``.
    """

    parts: tuple[tuple[str, float], ...]

    def __post_init__(self) -> None:
        coefficients: dict[str, float] = {}
        for name, coefficient in self.parts:
            if name in NOT_INPUTS or not name.isidentifier():
                raise InputError(
                    f"signal: '{name}' can't be an input; inputs are columns other than time and gyro"
                )
            if not np.isfinite(coefficient):
                raise InputError(f"signal: {name} has the coefficient {coefficient}; a number was expected")
            coefficients[name] = coefficients.get(name, 0.0) + float(coefficient)
        if not np.isfinite(list(coefficients.values())).all():
            raise InputError("signal: the coefficients of a column add up to more than a number can be")
        kept = [(name, coefficient) for name, coefficient in coefficients.items() if coefficient != 0.0]
        if not kept:
            raise InputError("signal: nothing is left of the columns; they cancel")
        units = {unit_of(name) for name, _ in kept}
        if len(units) > 1:
            told = ", ".join(f"{name} [{unit_of(name) or 'own unit'}]" for name, _ in kept)
            raise InputError(f"signal: columns of different units can't be added: {told}")
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
        """Whether it is one column as it stands."""
        return len(self.parts) == 1 and self.parts[0][1] == 1.0

    @property
    def is_difference(self) -> bool:
        """Whether its coefficients cancel: what all its columns have in common leaves it unchanged."""
        weights = [coefficient for _, coefficient in self.parts]
        return abs(sum(weights)) <= 1e-9 * sum(abs(weight) for weight in weights)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of what it takes."""
        return tuple(name for name, _ in self.parts)

    @property
    def unit(self) -> str:
        """Unit of its values; empty for a column of one's own."""
        return unit_of(self.parts[0][0])

    @property
    def written_unit(self) -> str:
        """Unit as feature text writes it beside a number; empty where it is no word (%, 1)."""
        return self.unit if self.unit.isidentifier() else ""

    @property
    def order(self) -> tuple[tuple[bool, int, int, str, float], ...]:
        """Sort key among signals: by column, coil sensors by number, columns of one's own last."""
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
        """The signal of a run in the run format's internal units, shape (n,).

        A view where it is one recorded column.

        Parameters
        ----------
        run
            The run.
        out
            Where it is put otherwise, shape (n,); a new array if None.
        """
        (name, coefficient), *others = self.parts
        total = input_of(run, name)
        if coefficient != 1.0:
            total = np.multiply(coefficient, total, out=out)
        for name, coefficient in others:
            if abs(coefficient) == 1.0:
                part = input_of(run, name)
            else:
                part = abs(coefficient) * input_of(run, name)
            total = np.add(total, part, out=out) if coefficient > 0 else np.subtract(total, part, out=out)
        return total

    def weights(self, recorded: Iterable[str]) -> dict[str, float]:
        """Weights of the recorded columns that make the signal.

        What a name stands for where it is not recorded itself (T for T_in, T_in for the mean of
        the odd sensors) is asked of `Run`, so that the rule is written once.

        Raises
        ------
        InputError
            If a column is neither recorded nor stood in for.
        """
        names = [name for name in recorded if name not in NOT_INPUTS]
        unit = np.eye(len(names))
        index = np.arange(float(len(names)))
        columns = {"time": index, "gyro": index, **{name: unit[i] for i, name in enumerate(names)}}
        probed = self.values(Run(name="inputs", columns=columns))
        return {name: float(weight) for name, weight in zip(names, probed) if weight != 0.0}


def unit_of(name: str) -> str:
    """Unit of a name in formulas: the run format's, s for ``time_on``, empty for a column of one's own."""
    if name == TIME_ON:
        return "s"
    spec = column_spec(name)
    return spec.internal if spec else ""


def held_by(run: Run, name: str) -> bool:
    """Whether a run holds what a name in formulas stands for."""
    if is_temperature(name):
        return bool(run.sensors(name))
    return name in run.columns or (name == TIME_ON and run.facts.powered_on is not None)


def input_of(run: Run, name: str) -> FloatArray:
    """What a name in formulas stands for in a run, shape (n,)."""
    if is_temperature(name):
        return run.temperature(name)
    if name in run.columns and name not in NOT_INPUTS:
        return run.columns[name]
    if name == TIME_ON and run.facts.powered_on is not None:
        return run.time - run.facts.powered_on
    if name == TIME_ON:
        raise InputError(
            f"{run.name}: time since power-on is not known; state 'powered_on' [s] in the side file"
        )
    held = [column for column in run.columns if column not in NOT_INPUTS]
    hint = did_you_mean(name, held).rstrip() or f"the run holds {', '.join(held) or 'none'}"
    raise InputError(f"{run.name}: no column '{name}'; {hint}")


def check_holds(run: Run, names: Iterable[str], text: str) -> None:
    """Refuse a run that lacks one of the names in a feature text."""
    lacking = next((name for name in names if not held_by(run, name)), None)
    if lacking is None:
        return
    try:
        input_of(run, lacking)
    except InputError as error:
        written = lacking if lacking in text else "since_on"
        place = re.search(rf"(?<!\w)d?(?={re.escape(written)}\b)", text)
        at = place.end() if place else 0
        told, _, hint = str(error).partition("; ")
        raise InputError(f"{told}\n  {text}\n  {' ' * at}^\n{hint}") from error


def known_temperatures() -> str:
    """The temperatures that feature text knows, for messages."""
    return (
        ", ".join(sorted((name for name in KNOWN if is_temperature(name)), key=_ORDER.index)) + ", T1, T2 ..."
    )


def _sort_key(part: tuple[str, float]) -> tuple[bool, int, int, str]:
    name, coefficient = part
    number = coil_sensor_number(name)
    if number is not None:
        return coefficient < 0, 1, number, name
    if name in _ORDER:
        return coefficient < 0, 0, _ORDER.index(name), name
    return coefficient < 0, 2, 0, name
