"""Tuning of a network's centres and widths by gradient.

Every centre moves and has widths of its own, held near shared ones by a log-normal prior; the
shared widths are tuned along. A descent with shared widths alone first ends in worse optima.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log
from typing import Protocol

import numpy as np

from fogml.arrays import FloatArray
from fogml.models.rbf.objective import Shape, Value

Bounds = tuple[float | None, float | None]

LOG_RIDGE_RANGE: Bounds = (log(1e-7), log(1e6))
LOG_WIDTH_RANGE: Bounds = (log(0.05), log(300.0))
_MEMORY = 20  # steps that L-BFGS remembers
_FLAT_NATS = 3e-3  # below which a step gains nothing
_FLAT = 1e-7  # the same as a share, where the first value says nothing


class Function(Protocol):
    """What tuning minimises."""

    def __call__(self, shape: Shape) -> Value: ...


class Watcher(Protocol):
    """Sees the shape after each iteration; raises StopIteration to end the descent."""

    def __call__(self, shape: Shape) -> None: ...


@dataclass(frozen=True)
class TuningSettings:
    """How far tuning goes.

    Attributes
    ----------
    shared_steps, own_steps
        Iterations with shared widths alone, and with widths of each centre's own.
    width_prior
        Standard deviation of a log width about the shared one.
    centre_prior
        Standard deviation of a centre about its start, in shared widths.
    log_ridge
        Log ridge that is kept, or None to learn it.
    least_log_widths
        Least shared log width along each input, shape (d,); None: the same for all.
    """

    shared_steps: int = 80
    own_steps: int = 100
    width_prior: float = 0.5
    centre_prior: float = 1.0
    log_ridge: float | None = None
    least_log_widths: FloatArray | None = None


class Variables(Protocol):
    """What a descent moves, as one vector; its last entry is the log ridge."""

    begin: FloatArray
    steps: int

    def shape(self, values: FloatArray) -> Shape:
        """The network that values stand for."""

    def pull(self, value: Value, values: FloatArray) -> tuple[float, FloatArray]:
        """Objective with the priors of the values, and its gradient by them."""

    def bounds(self) -> list[Bounds]:
        """Of all values but the ridge."""


class SharedVariables:
    """One log width per input, shape (d,); centres, shape (j, d), stay where they are."""

    def __init__(
        self, centres: FloatArray, log_widths: FloatArray, log_ridge: float, settings: TuningSettings
    ) -> None:
        self._centres, self._settings = centres, settings
        self.begin, self.steps = np.append(log_widths, log_ridge), settings.shared_steps

    def shape(self, values: FloatArray) -> Shape:
        return Shape(self._centres, np.tile(values[:-1], (len(self._centres), 1)), float(values[-1]))

    def pull(self, value: Value, values: FloatArray) -> tuple[float, FloatArray]:
        return value.value, np.append(value.log_widths.sum(axis=0), value.log_ridge)

    def bounds(self) -> list[Bounds]:
        return _width_bounds(self._settings, self._centres.shape[1])


class OwnVariables:
    """All centres and widths, and shared widths; moves of centres and own widths have normal priors.

    Parameters
    ----------
    centres, log_widths, log_ridge
        Where to begin: shape (j, d), shared widths of shape (d,), and the ridge.
    settings
        The priors.
    """

    def __init__(
        self, centres: FloatArray, log_widths: FloatArray, log_ridge: float, settings: TuningSettings
    ) -> None:
        self._centres, self._settings = centres, settings
        self._size = centres.size
        # A wide input needs no moves of its width: moves stay within the rows' spread.
        self._unit = np.minimum(np.exp(log_widths) * settings.centre_prior, settings.centre_prior)
        self.begin = np.concatenate([np.zeros(2 * self._size), log_widths, [log_ridge]])
        self.steps = settings.own_steps

    def shape(self, values: FloatArray) -> Shape:
        size, form = self._size, self._centres.shape
        moves, own = values[:size].reshape(form), values[size : 2 * size].reshape(form)
        log_widths = values[2 * size : -1] + self._settings.width_prior * own
        return Shape(self._centres + self._unit * moves, log_widths, float(values[-1]))

    def pull(self, value: Value, values: FloatArray) -> tuple[float, FloatArray]:
        size = self._size
        slope = np.concatenate(
            [
                (value.centres * self._unit).ravel() + values[:size],
                (value.log_widths * self._settings.width_prior).ravel() + values[size : 2 * size],
                value.log_widths.sum(axis=0),
                [value.log_ridge],
            ]
        )
        penalty = 0.5 * float(values[: 2 * size] @ values[: 2 * size])
        return value.value + penalty, slope

    def bounds(self) -> list[Bounds]:
        free: list[Bounds] = [(None, None)] * (2 * self._size)
        return free + _width_bounds(self._settings, self._centres.shape[1])


class Descent:
    """A descent that can be left and gone on with, also on other rows; L-BFGS within bounds.

    Where it goes on, it does so as if it had never been left: what L-BFGS knows of the curvature is
    won back from the values that it has asked for, which are kept until its end.

    The ridge is kept unless `learn`; `watch` sees every step.

    Attributes
    ----------
    value
        Objective with the priors where it stands; infinite before the first step.
    """

    def __init__(
        self, function: Function, variables: Variables, learn: bool, watch: Watcher | None = None
    ) -> None:
        self._function, self._variables, self._learn, self._watch = function, variables, learn, watch
        self._begin = self._values = variables.begin
        self._steps = 0
        self._ended = False
        self._asked: dict[bytes, tuple[float, FloatArray]] = {}
        self.value = float("inf")

    @property
    def shape(self) -> Shape:
        """The network where it stands."""
        return self._variables.shape(self._values)

    def run(self, steps: int | None = None) -> Descent:
        """Go on by so many steps, or to the end."""
        most = self._variables.steps if steps is None else min(self._steps + steps, self._variables.steps)
        if self._ended or most <= self._steps:
            return self
        from scipy.optimize import minimize

        ridge = float(self._begin[-1])
        first = abs(self._pull(self._begin)[0])
        flat = _FLAT_NATS / max(first, 1.0) if np.isfinite(first) else _FLAT
        options = {"maxiter": most, "maxcor": _MEMORY, "ftol": flat}
        passed = iter(range(1, most + 1))
        found = minimize(
            self._pull,
            self._begin,
            jac=True,
            method="L-BFGS-B",
            bounds=[*self._variables.bounds(), LOG_RIDGE_RANGE if self._learn else (ridge, ridge)],
            options=options,
            callback=lambda intermediate_result: self._see(next(passed), intermediate_result.x),
        )
        self.value, self._values = float(found.fun), np.asarray(found.x)
        self._steps = most
        self._ended = int(found.nit) < most or most == self._variables.steps
        if self._ended:
            self._asked.clear()
        return self

    def on(self, function: Function, log_ridge: float = 0.0, watch: Watcher | None = None) -> Descent:
        """A descent from where this one stands on another objective, its log ridge changed by so much."""
        other = Descent(function, self._variables, self._learn, watch)
        other._begin = self._values.copy()
        other._begin[-1] += log_ridge
        other._values = other._begin
        return other

    def _see(self, step: int, values: FloatArray) -> None:
        # Steps that are taken once more were seen.
        if self._watch is not None and step > self._steps:
            self._watch(self._variables.shape(values))

    def _pull(self, values: FloatArray) -> tuple[float, FloatArray]:
        key = values.tobytes()
        if key not in self._asked:
            value, slope = self._variables.pull(self._function(self._variables.shape(values)), values)
            if not self._learn:
                slope[-1] = 0.0
            self._asked[key] = value, slope
        value, slope = self._asked[key]
        return value, slope.copy()


def _width_bounds(settings: TuningSettings, dimensions: int) -> list[Bounds]:
    """Range of the shared log width along each input."""
    if settings.least_log_widths is None:
        return [LOG_WIDTH_RANGE] * dimensions
    return [(float(least), LOG_WIDTH_RANGE[1]) for least in settings.least_log_widths]
