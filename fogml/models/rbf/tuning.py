"""Tuning of a network's centres and widths by gradient.

Every centre moves and has widths of its own, held near shared ones by a log-normal prior; the
shared widths are tuned along. A descent with shared widths alone first ends in worse optima.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import log
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fogml.models.rbf.objective import Shape, Value

FloatArray = NDArray[np.float64]

Bounds = tuple[float | None, float | None]

LOG_RIDGE_RANGE: Bounds = (log(1e-7), log(1e6))
LOG_WIDTH_RANGE: Bounds = (log(0.05), log(300.0))
_MEMORY = 20  # steps that L-BFGS remembers
_FLAT = 1e-7  # share of the objective below which a step gains nothing


class Function(Protocol):
    """What tuning minimises."""

    def __call__(self, shape: Shape) -> Value: ...


Watcher = Callable[[Shape], None]
"""Called with the shape after each iteration; raises StopIteration to end the descent."""


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


def tune_shared(
    objective: Function,
    centres: FloatArray,
    log_widths: FloatArray,
    log_ridge: float,
    settings: TuningSettings,
    learn: bool,
    watch: Watcher | None = None,
) -> tuple[float, FloatArray, float]:
    """Minimise over one log width per input, and the ridge where it is to be learned; centres stay.

    Returns
    -------
    (value, log widths of shape (d,), log ridge)
    """
    dimensions = centres.shape[1]

    def shape(values: FloatArray) -> Shape:
        return Shape(centres, np.tile(values[:dimensions], (len(centres), 1)), float(values[-1]))

    def pull(value: Value) -> tuple[float, FloatArray]:
        slope = np.append(value.log_widths.sum(axis=0), value.log_ridge if learn else 0.0)
        return value.value, slope

    bounds = [
        *_width_bounds(settings, dimensions),
        LOG_RIDGE_RANGE if learn else (log_ridge, log_ridge),
    ]
    begin = np.append(log_widths, log_ridge)
    best, values = _descend(
        lambda v: pull(objective(shape(v))), begin, bounds, settings.shared_steps, shape, watch
    )
    return best, values[:dimensions], float(values[-1])


def tune_own(
    objective: Function,
    centres: FloatArray,
    log_widths: FloatArray,
    log_ridge: float,
    settings: TuningSettings,
    learn: bool,
    watch: Watcher | None = None,
) -> tuple[float, Shape]:
    """Minimise over all centres and widths, shared widths and, where it is to be learned, the ridge.

    Moves of centres and own widths have normal priors, see `TuningSettings`.

    Parameters
    ----------
    centres, log_widths, log_ridge
        Where to begin: shape (j, d), shared widths of shape (d,), and the ridge.

    Returns
    -------
    (value with the priors, shape)
    """
    count, dimensions = centres.shape
    size = count * dimensions
    unit = np.exp(log_widths) * settings.centre_prior
    # A wide input needs no moves of its width: moves stay within the rows' spread.
    unit = np.minimum(unit, settings.centre_prior)

    def shape(values: FloatArray) -> Shape:
        moves, own = (part.reshape(count, dimensions) for part in (values[:size], values[size : 2 * size]))
        shared = values[2 * size : 2 * size + dimensions]
        return Shape(centres + unit * moves, shared + settings.width_prior * own, float(values[-1]))

    def pull(values: FloatArray) -> tuple[float, FloatArray]:
        value = objective(shape(values))
        slope = np.concatenate(
            [
                (value.centres * unit).ravel() + values[:size],
                (value.log_widths * settings.width_prior).ravel() + values[size : 2 * size],
                value.log_widths.sum(axis=0),
                [value.log_ridge if learn else 0.0],
            ]
        )
        penalty = 0.5 * float(values[: 2 * size] @ values[: 2 * size])
        return value.value + penalty, slope

    begin = np.concatenate([np.zeros(2 * size), log_widths, [log_ridge]])
    bounds: list[Bounds] = [(None, None)] * (2 * size)
    bounds += [*_width_bounds(settings, dimensions), LOG_RIDGE_RANGE if learn else (log_ridge, log_ridge)]
    best, values = _descend(pull, begin, bounds, settings.own_steps, shape, watch)
    return best, shape(values)


def _width_bounds(settings: TuningSettings, dimensions: int) -> list[Bounds]:
    """Range of the shared log width along each input."""
    if settings.least_log_widths is None:
        return [LOG_WIDTH_RANGE] * dimensions
    return [(float(least), LOG_WIDTH_RANGE[1]) for least in settings.least_log_widths]


def _descend(
    function: Callable[[FloatArray], tuple[float, FloatArray]],
    begin: FloatArray,
    bounds: list[Bounds],
    steps: int,
    shape: Callable[[FloatArray], Shape],
    watch: Watcher | None,
) -> tuple[float, FloatArray]:
    """Minimum of a function with its gradient, by L-BFGS within bounds."""
    from scipy.optimize import minimize

    options = {"maxiter": steps, "maxcor": _MEMORY, "ftol": _FLAT}
    extra: dict[str, Any] = {} if watch is None else {"callback": lambda values: watch(shape(values))}
    found = minimize(function, begin, jac=True, method="L-BFGS-B", bounds=bounds, options=options, **extra)
    return float(found.fun), np.asarray(found.x)
