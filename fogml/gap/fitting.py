"""The model fitted to runs: constants, amplitudes and shapes together, with their covariance.

Gauss-Newton with damping on the whitened residuals and the priors. The replay itself is linearised
anew in each step, so effects that act on inputs are fitted as they act, not as their first order.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fogml.gap.frame import constant_rows
from fogml.gap.model import Candidate, Constant, EffectValue, Foreseeable
from fogml.gap.observation import Observation
from fogml.gap.run_whitener import RunWhitener
from fogml.gap.shapes import WHOLE, is_line
from fogml.intervals import Z90
from fogml.runs.run import FloatArray
from fogml.twin.quantities import Quantity

MOST_STEPS = 12
_SHAPE_STEP = 0.01
_LINE_STEP_CYCLES = 0.02
"""Step along a line's period or frequency, in cycles over the runs: of more the response is no line."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted model.

    Attributes
    ----------
    constants
        By name.
    effects
        With fitted amplitudes and shapes.
    covariance
        Of constants, then of each effect's amplitude and shape parameters in the card's order, those that
        are whole numbers left out.
    square
        Sum of squared whitened residuals.
    rows
        Number of them.
    """

    constants: Mapping[str, float]
    effects: tuple[EffectValue, ...]
    names: tuple[str, ...]
    covariance: FloatArray
    square: float
    rows: int

    @property
    def standard_errors(self) -> Mapping[str, float]:
        """By the names in `names`: constants, then ``effect.amplitude`` and ``effect.parameter``."""
        return dict(zip(self.names, np.sqrt(np.maximum(np.diag(self.covariance), 0.0))))

    def draws(
        self, rng: np.random.Generator, count: int
    ) -> list[tuple[dict[str, float], tuple[EffectValue, ...]]]:
        """Parameters from their normal posterior."""
        values, vectors = np.linalg.eigh(self.covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        steps = rng.standard_normal((count, len(self.names))) @ root.T
        return [self._moved(step) for step in steps]

    def _moved(self, step: FloatArray) -> tuple[dict[str, float], tuple[EffectValue, ...]]:
        moved = dict(zip(self.names, map(float, step)))
        constants = {name: value + moved[name] for name, value in self.constants.items()}
        effects = tuple(
            EffectValue(
                e.id,
                e.amplitude + moved[f"{e.id}.amplitude"],
                {name: value + moved.get(f"{e.id}.{name}", 0.0) for name, value in e.shape.items()},
            )
            for e in self.effects
        )
        return constants, effects


def fit_model(
    observations: Sequence[Observation],
    whiteners: Sequence[RunWhitener],
    constants: Sequence[Constant],
    effects: Sequence[EffectValue] = (),
    candidates: Mapping[str, Candidate] | None = None,
    grade: str = "tactical",
    start: Mapping[str, float] | None = None,
) -> Fit:
    """Fit constants with their priors, and effects from the values given.

    Parameters
    ----------
    observations, whiteners
        The runs and the whitener of each.
    constants
        With their priors.
    effects
        Where amplitudes and shapes start.
    candidates
        Declarations of the effects.
    grade
        Whose ranges are the weak priors of shape parameters.
    start
        Where the constants start; their means if None.
    """
    problem = _Problem(observations, whiteners, constants, effects, candidates or {}, grade)
    x = problem.start(start)
    residual = problem.residual(x)
    cost = float(residual @ residual)
    damping = 1e-4 if effects else 0.0
    jacobian = problem.jacobian(x)
    for _ in range(MOST_STEPS):
        normal = jacobian.T @ jacobian
        step = np.linalg.lstsq(
            normal + damping * np.diag(np.diag(normal)), -(jacobian.T @ residual), rcond=1e-14
        )[0]
        tried = problem.clipped(x + step)
        new = problem.residual(tried)
        new_cost = float(new @ new)
        if new_cost <= cost:
            gain, x, residual, cost = cost - new_cost, tried, new, new_cost
            damping *= 0.1
            if gain < 1e-4 + 1e-9 * cost:
                break
            jacobian = problem.jacobian(x)
        else:
            damping = max(10.0 * damping, 1e-6)
            if damping > 1e8:
                break
    jacobian = problem.jacobian(x)
    covariance = np.linalg.pinv(jacobian.T @ jacobian, rcond=1e-14, hermitian=True)
    # What nothing hangs on has no error, rather than one of rounding.
    free = np.any(jacobian, axis=0)
    covariance = np.where(np.outer(free, free), covariance, 0.0)
    scale = problem.scale
    found_constants, found_effects = problem.unpacked(x)
    data = residual[: problem.rows]
    return Fit(
        found_constants,
        found_effects,
        problem.names,
        np.asarray(covariance * np.outer(scale, scale), dtype=np.float64),
        float(data @ data),
        problem.rows,
    )


class _Problem:
    """Residuals over constants in prior standard deviations and effects' parameters in their scales."""

    def __init__(
        self,
        observations: Sequence[Observation],
        whiteners: Sequence[RunWhitener],
        constants: Sequence[Constant],
        effects: Sequence[EffectValue],
        candidates: Mapping[str, Candidate],
        grade: str,
    ) -> None:
        self.observations, self.whiteners, self.constants = observations, whiteners, constants
        self.rows = sum(len(o) for o in observations)
        self.first = tuple(effects)
        self.shapes: list[tuple[int, Quantity]] = []
        names = [c.name for c in constants]
        scale = [c.sd for c in constants]
        self.limits: list[tuple[float, float]] = [(-math.inf, math.inf)] * len(constants)
        for i, effect in enumerate(effects):
            declared = candidates[effect.id]
            names.append(f"{effect.id}.amplitude")
            scale.append(max(abs(effect.amplitude), 1e-12))
            self.limits.append(declared.amplitude.limits)
            for quantity in declared.shape:
                if quantity.name in WHOLE:
                    # The grid has every whole number.
                    continue
                self.shapes.append((i, quantity))
                names.append(f"{effect.id}.{quantity.name}")
                low, high = quantity.range(grade)  # type: ignore[arg-type]
                scale.append(max(0.5 * (high - low) / Z90, 1e-12))
                self.limits.append(usable_range(quantity, low, high))
        self.names, self.scale = tuple(names), np.array(scale)
        self._steps = self._steps_of(self.first)
        self._mean = np.array([c.mean / c.sd for c in constants])
        self._fixed = self._white([constant_rows(o, constants) for o in observations])
        self._middle = self._packed(self.first)[len(constants) :]
        # What sensors miss goes with the constants; coarse ones make constants small that are large.
        self._entangled = any(
            isinstance(o.model, Foreseeable) and o.model.depends_on_constants(effect.id, effect.shape)
            for o in observations
            for effect in effects
        )

    def _steps_of(self, effects: Sequence[EffectValue]) -> FloatArray:
        """Steps of finite differences, in the parameters' scales."""
        steps = np.full(len(self.names), _SHAPE_STEP)
        spans = _spans(self.observations)
        for i, quantity in self.shapes:
            if is_line(quantity) and quantity.unit in spans:
                k = self.names.index(f"{effects[i].id}.{quantity.name}")
                cycle = 1.0 / max(spans[quantity.unit], 1e-9)
                if "period" in quantity.name:
                    cycle *= effects[i].shape[quantity.name] ** 2
                steps[k] = min(steps[k], _LINE_STEP_CYCLES * cycle / self.scale[k])
        return steps

    def start(self, constants: Mapping[str, float] | None) -> FloatArray:
        x = self._packed(self.first)
        for i, c in enumerate(self.constants):
            x[i] = (constants or {}).get(c.name, c.mean) / c.sd
        return x

    def clipped(self, x: FloatArray) -> FloatArray:
        low, high = np.array(self.limits).T
        return np.clip(x, low / self.scale, high / self.scale)

    def unpacked(self, x: FloatArray) -> tuple[dict[str, float], tuple[EffectValue, ...]]:
        values = x * self.scale
        constants = {c.name: float(v) for c, v in zip(self.constants, values)}
        place = len(self.constants)
        effects = []
        for i, effect in enumerate(self.first):
            names = [q.name for j, q in self.shapes if j == i]
            amplitude, shape = values[place], values[place + 1 : place + 1 + len(names)]
            fitted = {**effect.shape, **dict(zip(names, map(float, shape)))}
            effects.append(EffectValue(effect.id, float(amplitude), fitted))
            place += 1 + len(names)
        return constants, tuple(effects)

    def residual(self, x: FloatArray) -> FloatArray:
        constants, effects = self.unpacked(x)
        data = self._white(
            [
                (o.recorded - o.averaged(o.model.output(constants, effects)))[:, None]
                for o in self.observations
            ]
        )[:, 0]
        fixed = len(self.constants)
        shapes = self._is_shape()
        prior = np.where(shapes, x[fixed:] - self._middle, 0.0)
        return np.concatenate([data, x[:fixed] - self._mean, prior])

    def jacobian(self, x: FloatArray) -> FloatArray:
        fixed, size = len(self.constants), len(x)
        out = np.zeros((self.rows + size, size))
        out[: self.rows, :fixed] = -self._fixed
        # Constants and shapes have priors, amplitudes have none.
        out[self.rows + np.arange(size), np.arange(size)] = [*np.ones(fixed), *self._is_shape()]
        for k in range(0 if self._entangled else fixed, size):
            step = np.zeros(size)
            step[k] = self._steps[k]
            up, down = self.clipped(x + step), self.clipped(x - step)
            width = float(up[k] - down[k])
            if width > 0.0:
                change = self.residual(up)[: self.rows] - self.residual(down)[: self.rows]
                out[: self.rows, k] = change / width
        return out

    def _is_shape(self) -> FloatArray:
        return np.array(
            [not name.endswith(".amplitude") for name in self.names[len(self.constants) :]], dtype=bool
        )

    def _packed(self, effects: Sequence[EffectValue]) -> FloatArray:
        values = [0.0] * len(self.constants)
        for i, effect in enumerate(effects):
            values.append(effect.amplitude)
            values.extend(effect.shape[q.name] for j, q in self.shapes if j == i)
        return np.array(values) / self.scale

    def _white(self, columns: Sequence[FloatArray]) -> FloatArray:
        return np.concatenate([w.whiten(c) for w, c in zip(self.whiteners, columns)])


def _spans(observations: Sequence[Observation]) -> dict[str, float]:
    """What lines run over, by the unit of their period or frequency: time, temperature, the table's rate."""
    seconds = max(o.run.span_s for o in observations)
    low = min(float(o.temperature.min()) for o in observations)
    high = max(float(o.temperature.max()) for o in observations)
    fastest = max(float(np.abs(o.run.rate).max()) for o in observations)
    return {"s": seconds, "Hz": seconds, "degC": high - low, "deg/s": fastest}


def usable_range(quantity: Quantity, low: float, high: float) -> tuple[float, float]:
    """Where a shape parameter may go: half as far again as its range, within what is physical."""
    if quantity.unit == "deg" and high - low >= 180.0:
        return quantity.limits
    if low > 0.0:
        return max(quantity.limits[0], low / 1.5), min(quantity.limits[1], high * 1.5)
    reach = 0.25 * (high - low)
    return max(quantity.limits[0], low - reach), min(quantity.limits[1], high + reach)
