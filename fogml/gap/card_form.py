"""An effect's own form fitted to the runs beside all else: amplitude and shape by least squares."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.catalogue import driving_of
from fogml.gap.field import Field
from fogml.gap.linear_gaussian import LinearGaussian
from fogml.gap.shapes import is_angle, is_whole
from fogml.intervals import Z90
from fogml.twin.effect import Effect
from fogml.twin.quantities import Grade, Quantity

_MOVE = 1e-4  # of an unknown, for slopes: a line of 600 cycles turns by a tenth of a radian


@dataclass(frozen=True)
class _Unknown:
    """A shape parameter as least squares has it: an angle [rad], or standard deviations of its prior."""

    quantity: Quantity
    grade: Grade

    @property
    def free(self) -> bool:
        """Whether its prior leaves room."""
        return is_angle(self.quantity) or self._law[1] > 0.0

    @property
    def _law(self) -> tuple[float, float, bool]:
        """Middle and standard deviation of the prior, and whether they are of the logarithm."""
        low, high = self.quantity.range(self.grade)
        if self.quantity.signed:
            return 0.0, high / Z90, False
        if low > 0.0:
            return 0.5 * math.log(low * high), 0.5 * math.log(high / low) / Z90, True
        return 0.5 * (low + high), 0.5 * (high - low) / Z90, False

    @property
    def weight(self) -> float:
        """Of the prior: no angle is likelier than others."""
        return 0.0 if is_angle(self.quantity) else 1.0

    @property
    def limits(self) -> tuple[float, float]:
        """Where the unknown can be."""
        low, high = self.quantity.limits
        return (-math.inf, math.inf) if is_angle(self.quantity) else (self.unknown(low), self.unknown(high))

    def unknown(self, value: float) -> float:
        """What stands for a value."""
        if is_angle(self.quantity):
            return math.radians(value)
        middle, spread, log = self._law
        if log:
            value = math.log(value) if value > 0.0 else -math.inf
        return (value - middle) / spread

    def value(self, unknown: float) -> float:
        """What an unknown stands for."""
        if is_angle(self.quantity):
            return math.degrees(unknown) % 360.0
        middle, spread, log = self._law
        value = middle + spread * unknown
        return math.exp(value) if log else value

    def error(self, unknown: float, error: float) -> float:
        """Standard error of the value."""
        if is_angle(self.quantity):
            return min(math.degrees(error), 180.0)
        _, spread, log = self._law
        return spread * error * (self.value(unknown) if log else 1.0)


@dataclass(frozen=True, eq=False)
class Optimum:
    """An amplitude and a shape with standard errors, how well they fit [nats], and what they make."""

    amplitude: float
    amplitude_se: float
    shape: Mapping[str, float]
    shape_se: Mapping[str, float]
    fit: float
    made: FloatArray


class Form:
    """What an effect driven by the temperature of a place makes, whitened beside all else, against the data.

    Unknowns are its amplitude over the usual most, whose prior is as wide as the greatest possible, angles,
    and other parameters by the priors that units are drawn from: a usual range is the central 90 % of a
    log-normal law, or of a normal one where it reaches zero.
    """

    def __init__(self, declared: Effect, field: Field, beside: LinearGaussian, place: str) -> None:
        scene = field.setting.scene
        self.declared, self.field = declared, field
        self.driving = [driving_of(declared, rows, scene, place) for rows in scene.fit]
        unknowns = [_Unknown(q, scene.grade) for q in declared.shape if not is_whole(q, scene.grids)]
        self.free = [one for one in unknowns if one.free]
        self.usual = declared.amplitude.range(scene.grade)[1]
        self.greatest = max(map(abs, declared.amplitude.limits))
        # A root of I - Q Q', Q the basis of all else, by the eigenvectors of Q' Q.
        values, vectors = np.linalg.eigh(beside.basis.T @ beside.basis)
        shown = values > 1e-12
        self._basis = beside.basis @ (vectors[:, shown] / np.sqrt(values[shown]))
        self._taken = 1.0 - np.sqrt(np.maximum(1.0 - values[shown], 0.0))
        self.data = self._beside(beside.data)

    def optimum(self, amplitude: float, shape: Mapping[str, float]) -> Optimum:
        """The least squares that are reached from an amplitude and a shape."""
        from scipy.optimize import least_squares

        def shape_at(unknowns: FloatArray) -> dict[str, float]:
            own = {u.quantity.name: u.value(x) for u, x in zip(self.free, unknowns[1:].tolist())}
            return {**shape, **own}

        def made(unknowns: FloatArray) -> FloatArray:
            return self.usual * self._response(shape_at(unknowns))

        def missed(unknowns: FloatArray) -> FloatArray:
            return np.concatenate([self.data - unknowns[0] * made(unknowns), weights * unknowns])

        def slopes(unknowns: FloatArray) -> FloatArray:
            columns = [made(unknowns)]
            for move in _MOVE * np.eye(len(unknowns))[1:]:
                both = made(unknowns + move) - made(unknowns - move)
                columns.append(unknowns[0] * both / (2.0 * _MOVE))
            return np.concatenate([-np.column_stack(columns), np.diag(weights)])

        weights = np.array([self.usual / self.greatest, *(u.weight for u in self.free)])
        limits = np.array([self.declared.amplitude.limits, *(u.limits for u in self.free)]).T
        limits[:, 0] /= self.usual
        first = np.array([amplitude / self.usual, *(u.unknown(shape[u.quantity.name]) for u in self.free)])
        first = np.clip(first, limits[0] + 1e-9, limits[1] - 1e-9)
        found = least_squares(missed, first, slopes, limits, x_scale="jac", ftol=1e-6)
        length = np.linalg.norm(found.jac, axis=0)
        scale = np.where(length > 0.0, length, 1.0)
        covariance = np.linalg.pinv(found.jac.T @ found.jac / np.outer(scale, scale), hermitian=True)
        errors = np.sqrt(np.maximum(np.diagonal(covariance), 0.0)) / scale
        errors[length == 0.0] = math.inf  # a direction that makes no difference
        told = {q.name: shape_at(found.x)[q.name] for q in self.declared.shape}
        shape_se = dict.fromkeys(told, 0.0)
        for u, x, error in zip(self.free, found.x[1:].tolist(), errors[1:].tolist()):
            shape_se[u.quantity.name] = u.error(x, error)
        size, size_se = self.usual * found.x[0], self.usual * errors[0]
        fitted = self.data - found.fun[: len(self.data)]
        return Optimum(float(size), float(size_se), told, shape_se, -float(found.cost), fitted)

    def _response(self, shape: Mapping[str, float]) -> FloatArray:
        """Of an amplitude of 1, beside all else."""
        runs, values = self.field.setting.scene.fit, self.field.setting.values
        by_run = [r.response(self.declared, shape, t, values) for r, t in zip(runs, self.driving)]
        return self._beside(self.field.whitening.stacked(by_run))

    def _beside(self, series: FloatArray) -> FloatArray:
        return np.asarray(series - self._basis @ (self._taken * (self._basis.T @ series)))
