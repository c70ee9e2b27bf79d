"""An effect's own form fitted to the runs beside all else: amplitude and shape by least squares."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.catalogue import driving_of
from fogml.gap.field import Field
from fogml.gap.linear_gaussian import LinearGaussian
from fogml.gap.rows import at_amplitude
from fogml.gap.shapes import AT_AMPLITUDE, is_whole
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
        return self._law[1] > 0.0

    @property
    def _law(self) -> tuple[float, float, bool]:
        """Middle and standard deviation of the prior, a radian of an angle; whether of the logarithm."""
        if self.quantity.all_round:
            return 0.0, math.degrees(1.0), False
        if self.quantity.signed:
            return 0.0, self.quantity.range(self.grade)[1] / Z90, False
        return self.quantity.law(self.grade)

    @property
    def weight(self) -> float:
        """Of the prior: no angle is likelier than others."""
        return 0.0 if self.quantity.all_round else 1.0

    @property
    def limits(self) -> tuple[float, float]:
        """Where the unknown can be."""
        low, high = self.quantity.limits
        return (-math.inf, math.inf) if self.quantity.all_round else (self.unknown(low), self.unknown(high))

    def unknown(self, value: float) -> float:
        """What stands for a value."""
        middle, spread, log = self._law
        if log:
            value = math.log(value) if value > 0.0 else -math.inf
        return (value - middle) / spread

    def value(self, unknown: float) -> float:
        """What an unknown stands for."""
        middle, spread, log = self._law
        value = middle + spread * unknown
        if self.quantity.all_round:
            return value % 360.0
        return math.exp(value) if log else value

    def scale(self, unknown: float) -> float:
        """How far the value moves with the unknown, in the value's unit."""
        _, spread, log = self._law
        return spread * (self.value(unknown) if log else 1.0)


@dataclass(frozen=True)
class Fitted:
    """An effect's amplitude and shape with standard errors."""

    amplitude: float
    amplitude_se: float
    shape: Mapping[str, float]
    shape_se: Mapping[str, float]


class Form:
    """What an effect makes of the fit runs, whitened, about an amplitude and a shape to begin with.

    Unknowns are its amplitude over the usual most, whose prior is as wide as the greatest possible, angles,
    and other parameters by the priors that units are drawn from: a usual range is the central 90 % of a
    log-normal law, or of a normal one where it reaches zero.

    Parameters
    ----------
    declared, field
        The effect; runs, and what is whitened.
    amplitude, shape
        Where it begins.
    place
        Name of the place that drives it; None for the temperatures that a replay has.
    """

    def __init__(
        self,
        declared: Effect,
        field: Field,
        amplitude: float,
        shape: Mapping[str, float],
        place: str | None = None,
    ) -> None:
        scene = field.setting.scene
        self.declared, self.field = declared, field
        self.shape = {name: value for name, value in shape.items() if name != AT_AMPLITUDE}
        self._driving = [
            None if place is None else driving_of(declared, rows, scene, place) for rows in scene.runs
        ]
        unknowns = [_Unknown(q, scene.grade) for q in declared.shape if not is_whole(q, scene.grids)]
        self.free = [one for one in unknowns if one.free]
        self.usual = declared.amplitude.range(scene.grade)[1]
        greatest = max(map(abs, declared.amplitude.limits))
        self.weights = np.array([self.usual / greatest, *(u.weight for u in self.free)])
        self.limits = np.array([declared.amplitude.limits, *(u.limits for u in self.free)])
        self.limits[0] /= self.usual
        first = [amplitude / self.usual, *(u.unknown(shape[u.quantity.name]) for u in self.free)]
        self.first = np.clip(first, self.limits[:, 0] + 1e-9, self.limits[:, 1] - 1e-9)

    def made(self, unknowns: FloatArray) -> FloatArray:
        """Whitened, shape (n,)."""
        return self.field.whitening.stacked([self.on(run, unknowns) for run in self._fitted])

    def slopes(self, unknowns: FloatArray) -> FloatArray:
        """Of what is made, whitened, shape (n, unknowns)."""
        return self.field.whitening.stacked([self.slopes_on(run, unknowns) for run in self._fitted])

    def on(self, run: int, unknowns: FloatArray) -> FloatArray:
        """What is made of a run of the scene [deg/h], shape (m,)."""
        return np.asarray(unknowns[0] * self._usual(run, unknowns))

    def slopes_on(self, run: int, unknowns: FloatArray) -> FloatArray:
        """Of what is made of a run, shape (m, unknowns), by differences within the limits elsewhere."""
        columns = [self._usual(run, unknowns)] if self.declared.in_proportion else []
        for place in range(len(columns), len(unknowns)):
            ends = np.clip(unknowns[place] + np.array([-_MOVE, _MOVE]), *self.limits[place])
            below, above = (
                self.on(run, np.where(np.arange(len(unknowns)) == place, end, unknowns)) for end in ends
            )
            columns.append((above - below) / (ends[1] - ends[0]))
        return np.column_stack(columns)

    def told(self, unknowns: FloatArray, errors: FloatArray) -> Fitted:
        """What unknowns stand for."""
        at = self._shape(unknowns)
        shape = {q.name: at[q.name] for q in self.declared.shape}
        shape_se = dict.fromkeys(shape, 0.0)
        amplitude_se, *others = (errors * self.scales(unknowns)).tolist()
        for u, error in zip(self.free, others):
            shape_se[u.quantity.name] = min(error, 180.0) if u.quantity.all_round else error
        return Fitted(self.usual * float(unknowns[0]), amplitude_se, shape, shape_se)

    def scales(self, unknowns: FloatArray) -> FloatArray:
        """How far amplitude and free shape parameters move with each unknown, in units of the card."""
        return np.array([self.usual, *(u.scale(x) for u, x in zip(self.free, unknowns[1:].tolist()))])

    @property
    def names(self) -> list[str]:
        """Of the free shape parameters."""
        return [u.quantity.name for u in self.free]

    def _shape(self, unknowns: FloatArray) -> dict[str, float]:
        own = {u.quantity.name: u.value(x) for u, x in zip(self.free, unknowns[1:].tolist())}
        return {**self.shape, **own}

    @property
    def _fitted(self) -> range:
        return range(self.field.setting.scene.fitted)

    def _usual(self, run: int, unknowns: FloatArray) -> FloatArray:
        """Over the amplitude, times its usual most."""
        setting, amplitude = self.field.setting, self.usual * float(unknowns[0])
        shape = at_amplitude(self.declared, amplitude, self._shape(unknowns))
        rows, driving = setting.scene.runs[run], self._driving[run]
        return self.usual * rows.response(self.declared, shape, driving, setting.values)


class Root:
    """A root of I - Q Q', Q the basis of all that the data are beside, by the eigenvectors of Q' Q."""

    def __init__(self, beside: LinearGaussian) -> None:
        values, vectors = np.linalg.eigh(beside.basis.T @ beside.basis)
        shown = values > 1e-12
        self._basis = beside.basis @ (vectors[:, shown] / np.sqrt(values[shown]))
        self._taken = 1.0 - np.sqrt(np.maximum(1.0 - values[shown], 0.0))
        self.data = self.of(beside.data)

    def of(self, columns: FloatArray) -> FloatArray:
        """Columns beside all else, shape (n, ...)."""
        taken = self._taken[:, None] if columns.ndim > 1 else self._taken
        return np.asarray(columns - self._basis @ (taken * (self._basis.T @ columns)))


@dataclass(frozen=True, eq=False)
class Optimum:
    """Effects that fit best, how well they fit [nats], and what they make beside all else, shape (n,).

    ``unknowns`` are those of each, ``covariance`` is that of all together.
    """

    effects: tuple[Fitted, ...]
    fit: float
    made: FloatArray
    unknowns: tuple[FloatArray, ...]
    covariance: FloatArray


def optimum(forms: Sequence[Form], root: Root) -> Optimum:
    """The least squares that forms reach together, from where they begin."""
    from scipy.optimize import least_squares

    ends = np.cumsum([len(form.first) for form in forms])[:-1]
    weights = np.concatenate([form.weights for form in forms])

    def parts(unknowns: FloatArray) -> list[FloatArray]:
        return np.split(unknowns, ends)

    def missed(unknowns: FloatArray) -> FloatArray:
        made = np.sum([form.made(own) for form, own in zip(forms, parts(unknowns))], axis=0)
        return np.concatenate([root.data - root.of(made), weights * unknowns])

    def slopes(unknowns: FloatArray) -> FloatArray:
        columns = [form.slopes(own) for form, own in zip(forms, parts(unknowns))]
        return np.concatenate([-root.of(np.concatenate(columns, axis=1)), np.diag(weights)])

    first = np.concatenate([form.first for form in forms])
    limits = np.concatenate([form.limits for form in forms]).T
    found = least_squares(missed, first, slopes, limits, x_scale="jac", ftol=1e-6)
    length = np.linalg.norm(found.jac, axis=0)
    scale = np.where(length > 0.0, length, 1.0)
    scales = np.outer(scale, scale)
    covariance = np.linalg.pinv(found.jac.T @ found.jac / scales, hermitian=True) / scales
    errors = np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
    errors[length == 0.0] = math.inf  # a direction that makes no difference
    own = tuple(parts(found.x))
    effects = tuple(form.told(x, se) for form, x, se in zip(forms, own, parts(errors)))
    made = root.data - found.fun[: len(root.data)]
    return Optimum(effects, -float(found.cost), made, own, covariance)
