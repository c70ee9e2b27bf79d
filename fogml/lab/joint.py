"""Scale factor and bias over temperature: figures of a run with turns, and the practice in two steps.

The practice that patent CN105333888A replaces takes the scale factor K(T) from turns in soaks first,
then the bias from rests, of the output divided by K(T)::

    K_i = sum(D_step rate_step) / sum(rate_step^2)   over the steps of the table's rate in turn i
    K(T) = polynomial in T through the (T_i, K_i)
    b = features of temperature, fitted to D / K(T) - reference at rest

The rests may be those of the same run or of another one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.models.base import DriftModel
from fogml.models.names import make_model
from fogml.models.table import usable_rows
from fogml.runs.run import Run
from fogml.signals.averages import AVERAGING_S
from fogml.validation.metrics import Metrics, RunMetrics
from fogml.validation.scale_factor import find_steps

BIAS_FEATURES = "T, T_in-T_out, dT"
"""What the bias of the two-step practice is made of: the columns of the joint model."""


@dataclass(frozen=True)
class ScaleFactors:
    """Scale factors of k turns: temperature [degC] and output over rate [1], each of shape (k,)."""

    temperature: FloatArray
    factor: FloatArray


def scale_factors(run: Run, one_sense: bool = False) -> ScaleFactors:
    """The scale factor of each turn of the table, from rest to rest.

    Parameters
    ----------
    run
        A run with turns; output in deg/h or counts with a stated scale factor.
    one_sense
        Take the plateau of the first sense over its rate, Earth rate removed, as where a turn goes
        one way only; the bias then stands in the scale factor.

    Raises
    ------
    InputError
        If the table never turns.
    """
    steps = find_steps(run, np.ones(len(run), dtype=np.bool_))
    if steps is None:
        raise InputError(f"{run.name}: no turns, so no scale factor; a column 'rate [deg/s]' tells them")
    temperature = run.temperature("T")[steps.usable]
    output = run.gyro_deg_h[steps.usable]
    heights = steps.of(run.gyro_deg_h)
    found_temperature, found_factor = [], []
    # A slow turn alone tells little but noise.
    for turn in np.unique(steps.turn[steps.large]):
        mine = np.flatnonzero(steps.turn == turn)
        first, last = steps.before[mine[0], 1], steps.after[mine[-1], 0]
        found_temperature.append(float(temperature[first : max(last, first + 1)].mean()))
        if one_sense:
            start, stop = steps.after[mine[0]]
            reference = run.reference_deg_h[steps.usable][start:stop].mean()
            found_factor.append(float(output[start:stop].mean() / reference))
        else:
            rate = steps.height[mine]
            found_factor.append(float(heights[mine] @ rate / (rate @ rate)))
    return ScaleFactors(np.array(found_temperature), np.array(found_factor))


@dataclass(frozen=True)
class TwoStep:
    """Scale factor first, then bias.

    Attributes
    ----------
    scale
        Coefficients of K(T), constant first, T in degC.
    span
        Temperatures between which turns were [degC]; K is held beyond.
    bias
        The fitted drift model of the output divided by K(T).
    """

    scale: FloatArray
    span: tuple[float, float]
    bias: DriftModel

    def rate(self, run: Run) -> tuple[FloatArray, BoolArray]:
        """The rate made of a run's output [deg/h], and where every window is full, each of shape (n,)."""
        divided = _divided(run, self.scale, self.span)
        evaluation = self.bias.evaluate(divided)
        return divided.gyro - evaluation.drift, evaluation.full


def two_step(turning: Run, rest: Run | None = None, *, order: int = 2, one_sense: bool = False) -> TwoStep:
    """The practice in two steps.

    Parameters
    ----------
    turning
        A run with turns at several temperatures.
    rest
        A run at rest for the bias; the rests of `turning` if None.
    order
        Order of K(T); lowered where turns are at too few temperatures.
    one_sense
        As in `scale_factors`.

    Raises
    ------
    InputError
        If the table never turns, the bias can't be fitted, or the order is no whole number from 0 on.
    """
    if not isinstance(order, int | np.integer) or order < 0:
        raise InputError(f"order {order} of the scale factor: a whole number from 0 on is needed")
    found = scale_factors(turning, one_sense)
    degree = min(order, len(np.unique(found.temperature)) - 1)
    span = float(found.temperature.min()), float(found.temperature.max())
    fitted = np.polynomial.Polynomial.fit(found.temperature, found.factor, degree)
    scale = np.asarray(fitted.convert().coef, dtype=np.float64)
    base = turning if rest is None else rest
    model = make_model("polynomial", BIAS_FEATURES, parameters={"ridge": 0.0})
    return TwoStep(scale, span, model.fit(_divided(base, scale, span)))


def run_figures(
    run: Run, rate_deg_h: FloatArray, full: BoolArray, averaging_s: float = AVERAGING_S
) -> Metrics:
    """Figures of a compensated run: bias at rest, scale factor error from the turns.

    Parameters
    ----------
    run
        The run.
    rate_deg_h
        Rate made of its output [deg/h], shape (n,).
    full
        Rows that count, shape (n,); of these, for the bias, those at rest outside transitions.
    averaging_s
        Averaging time [s].
    """
    used = usable_rows(run, full)[0]
    return RunMetrics(run, used, averaging_s, full=full).figures(rate_deg_h - run.reference_deg_h)


def _divided(run: Run, scale: FloatArray, span: tuple[float, float]) -> Run:
    temperature = np.clip(run.temperature("T"), *span)
    output = run.gyro_deg_h / np.polynomial.polynomial.polyval(temperature, scale)
    return Run(run.name, {**run.columns, "gyro": output}, run.facts)
