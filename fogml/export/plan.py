"""What a fitted model computes, as plain numbers: the one thing that every export is made from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.features.atoms import Atom, AtomValues
from fogml.features.box import OVERSHOOT, TOLERANCE, Box
from fogml.features.features import Features
from fogml.features.reach import reaching_box
from fogml.features.terms import Step, composition_plan
from fogml.models.base import DriftModel
from fogml.runs.dropouts import RULE, DropoutRule

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
_ROWS = 1 << 16
"""Rows of a network at a time, so that long histories take bounded memory."""
Form = Literal["constant", "linear", "network", "joint"]


@dataclass(frozen=True, eq=False)
class Limits:
    """The trained box, and how atoms level off beyond it.

    A value e beyond `low` or `high` becomes ``margin e/(margin + e)`` beyond it; see
    `fogml.features.box`. All of shape (a,), in the atoms' units.

    Attributes
    ----------
    low, high
        Where limiting begins: the box, or further out for rates that a linear model follows.
    margin
        How far beyond those a limited value can get.
    inner, outer
        Values outside of these are flagged: the box and 1 % of its span.
    box_low, box_high
        The trained box itself.
    """

    low: FloatArray
    high: FloatArray
    margin: FloatArray
    inner: FloatArray
    outer: FloatArray
    box_low: FloatArray
    box_high: FloatArray

    @classmethod
    def of(cls, features: Features, linear: bool) -> Limits:
        """The limits of features whose box is learned."""
        bounds = np.array([features.box[atom.text] for atom in features.atoms]).reshape(-1, 2)
        box = Box(bounds[:, 0], bounds[:, 1])
        reach = reaching_box(box, features.terms, features.atoms) if linear else box
        slack = TOLERANCE * box.span
        outside = box.low - slack, box.high + slack
        return cls(reach.low, reach.high, OVERSHOOT * reach.span, *outside, box.low, box.high)

    @classmethod
    def none(cls) -> Limits:
        """The limits of a model without features."""
        return cls(*[np.empty(0)] * 7)

    def apply(self, atoms: FloatArray, heeded: BoolArray) -> tuple[FloatArray, BoolArray]:
        """Limited atoms (n, a), and rows outside (n,); `heeded` (n, a): where values mean something."""
        above, below = atoms - self.high, self.low - atoms
        beyond = np.where(heeded, np.maximum(np.maximum(above, below), 0.0), 0.0)
        soft = self.margin * beyond / (self.margin + beyond)
        limited = np.where(above > 0.0, self.high + soft, self.low - soft)
        limited = np.where(beyond > 0.0, limited, atoms)
        outside = heeded & ((atoms < self.inner) | (atoms > self.outer))
        return np.asarray(limited), np.asarray(outside.any(axis=1))


@dataclass(frozen=True, eq=False)
class Plan:
    """A fitted model as numbers, without the classes that fitted it.

    Attributes
    ----------
    kind
        Name of the model, e.g. ``rbf``.
    form
        ``constant``; ``linear``: constant + linear . f; ``network``: that and Gaussians;
        ``joint``: rate = (scale0 + scale1 T + scale2 T^2) D + constant + linear . f.
    sensors
        Temperatures and other columns needed, by their names in formulas.
    atoms, steps, names
        The features' atoms, how columns are made of them, and the columns' names.
    limits
        The trained box and what becomes of atoms beyond it.
    arrays
        ``constant`` (1,), ``linear`` (k,); of a network ``centres``, ``widths`` (j, d),
        ``weights`` (j,); of a joint model ``scale`` (3,).
    columns
        Which of the k features the network sees, shape (d,).
    edge_columns, edge
        Features that hold a rate and their trained range, shapes (r,) and (2, r): beyond it a
        network goes on along its slope.
    sample_s
        Median sample interval of training [s].
    gyro_unit
        Unit of the output that the model takes.
    thermometer
        What a thermometer can show; other readings are taken for none.
    """

    kind: str
    form: Form
    sensors: tuple[str, ...]
    atoms: tuple[Atom, ...]
    steps: tuple[Step, ...]
    names: tuple[str, ...]
    limits: Limits
    arrays: Mapping[str, FloatArray]
    sample_s: float
    gyro_unit: str = "deg/h"
    columns: tuple[int, ...] = ()
    edge_columns: tuple[int, ...] = ()
    edge: FloatArray = field(default_factory=lambda: np.empty((2, 0)))
    thermometer: DropoutRule = RULE

    @classmethod
    def of(cls, model: DriftModel, sample_s: float | None = None) -> Plan:
        """The plan of a fitted model.

        Parameters
        ----------
        model
            The model.
        sample_s
            Sample interval [s] to run at; that of training if None.

        Raises
        ------
        InputError
            If the model is made of something that has no compact form.
        """
        model = chosen_model(model)
        model._check_fitted()
        interval = model.card_.sample_s if sample_s is None else sample_s
        if not (np.isfinite(interval) and interval > 0.0):
            raise InputError(f"export: a sample interval of {interval} s; state one with --sample-s")
        features = model.features_
        if features is None:
            arrays = {"constant": np.array([float(getattr(model, "bias_", 0.0))])}
            return cls(model.kind, "constant", (), (), (), (), Limits.none(), arrays, interval)
        shared: dict[str, Any] = {
            "kind": model.kind,
            "sensors": features.sensors,
            "atoms": features.atoms,
            "steps": composition_plan(features.terms, features.atoms),
            "names": tuple(features.names()),
            "sample_s": float(interval),
        }
        return cls(**shared, **_regression(model, features))

    @property
    def gives_rate(self) -> bool:
        """Whether its value is a rate made of the output, scale factor and all, and not a drift."""
        return self.form == "joint"

    @property
    def dimensions(self) -> int:
        """Number of inputs of the network."""
        return len(self.columns)

    @property
    def centres(self) -> int:
        """Number of Gaussians."""
        return len(self.arrays["weights"]) if self.form == "network" else 0

    @property
    def windowed(self) -> BoolArray:
        """Which atoms need a window, shape (a,)."""
        return np.array([atom.window is not None for atom in self.atoms], dtype=np.bool_)

    def with_arrays(self, arrays: Mapping[str, FloatArray]) -> Plan:
        """The same with other numbers."""
        return replace(self, arrays=dict(arrays))

    def compose(self, limited: FloatArray) -> FloatArray:
        """Feature columns (n, k) of limited atoms (n, a)."""
        columns: list[FloatArray] = []
        for step in self.steps:
            value = np.ones(len(limited)) if step.column is None else columns[step.column]
            for atom in step.atoms:
                value = value * limited[:, atom]
            columns.append(value)
        return np.column_stack(columns) if columns else np.empty((len(limited), 0))

    def limited(self, atoms: FloatArray, full: BoolArray) -> tuple[FloatArray, BoolArray]:
        """Limited atoms (n, a), and which rows lie outside the trained box (n,)."""
        return self.limits.apply(atoms, full[:, None] | ~self.windowed[None, :] | (atoms != 0.0))

    def full_columns(self, atoms: FloatArray) -> FloatArray:
        """Feature columns (n, k) of atoms (n, a) where all windows are full."""
        return self.compose(self.limited(atoms, np.ones(len(atoms), dtype=np.bool_))[0])

    def compensated(self, atoms: AtomValues, gyro: FloatArray) -> tuple[FloatArray, NDArray[np.int8]]:
        """Compensated output [deg/h] and flags, each (n,), from atoms (n, a) and the output (n,)."""
        values, full, settled = atoms
        limited, outside = self.limited(values, full)
        value = self.value(self.compose(limited), gyro)
        flag = np.where(full & settled, outside.astype(np.int8), np.int8(2))
        return (value if self.gives_rate else gyro - value), flag

    def value(self, columns: FloatArray, gyro: FloatArray | None = None) -> FloatArray:
        """Drift [deg/h] of feature columns (n, k), shape (n,); of a joint model the rate."""
        if self.form == "network":
            parts = [self._network(columns[i : i + _ROWS]) for i in range(0, len(columns), _ROWS)]
            return np.concatenate(parts) if parts else np.empty(0)
        value = np.full(len(columns), float(self.arrays["constant"][0]))
        if "linear" in self.arrays:
            value = value + columns @ self.arrays["linear"]
        if self.gives_rate:
            assert gyro is not None
            s0, s1, s2 = self.arrays["scale"]
            value = value + (s0 + columns[:, 0] * (s1 + columns[:, 0] * s2)) * gyro
        return value

    def _network(self, columns: FloatArray) -> FloatArray:
        drawn = self.drawn_in(columns)
        centres, inverse = self.arrays["centres"], 1.0 / self.arrays["widths"]
        seen, steps = list(self.columns), columns - drawn
        z = (drawn[:, None, seen] - centres) * inverse
        basis = np.exp(-np.sum(z * z, axis=2)) * self.arrays["weights"]
        along = np.sum(z * steps[:, None, seen] * inverse, axis=2)
        linear = columns @ self.arrays["linear"]
        return linear + self.arrays["constant"][0] + np.sum(basis * (1.0 - 2.0 * along), axis=1)

    def drawn_in(self, columns: FloatArray) -> FloatArray:
        """Columns with all rates scaled down together into their trained range."""
        if not self.edge_columns:
            return columns
        where = list(self.edge_columns)
        rates = columns[:, where]
        low, high = self.edge
        beyond = (rates > high) | (rates < low)
        bound = np.where(rates > 0.0, high, low)
        share = np.where(beyond, bound / np.where(beyond, rates, 1.0), 1.0).min(axis=1, initial=1.0)
        drawn = columns.copy()
        drawn[:, where] = rates * share[:, None]
        return drawn


def chosen_model(model: DriftModel) -> DriftModel:
    """The model itself, or the one that an automatic choice stands for."""
    chosen = getattr(model, "chosen_", None)
    return chosen if isinstance(chosen, DriftModel) else model


def _regression(model: DriftModel, features: Features) -> dict[str, Any]:
    """What a model with features maps their columns to drift by."""
    from fogml.models.joint import JointModel
    from fogml.models.linear import LinearRegressor
    from fogml.models.rbf.fitted import NetworkRegressor
    from fogml.models.regressors import goes_on_linearly

    regressor: Any = getattr(model, "regressor_", None)
    if isinstance(model, JointModel):
        scale, linear = np.split(np.asarray(regressor.coef_, dtype=np.float64), [3])
        arrays = {"scale": scale, "linear": linear, "constant": np.array([regressor.intercept_])}
        unit = model.card_.gyro_unit
        return {"form": "joint", "limits": Limits.of(features, True), "arrays": arrays, "gyro_unit": unit}
    limits = Limits.of(features, goes_on_linearly(regressor))
    if isinstance(regressor, LinearRegressor):
        arrays = {"linear": np.asarray(regressor.coef_), "constant": np.array([regressor.intercept_])}
        return {"form": "linear", "limits": limits, "arrays": arrays}
    if isinstance(regressor, NetworkRegressor):
        network = regressor.network_
        arrays = {
            "centres": network.centres,
            "widths": network.widths,
            "weights": network.weights,
            "linear": network.linear,
            "constant": np.array([network.constant]),
        }
        return {
            "form": "network",
            "limits": limits,
            "arrays": arrays,
            "columns": tuple(int(i) for i in network.columns),
            "edge_columns": tuple(int(i) for i in network.edge.columns),
            "edge": np.stack([network.edge.low, network.edge.high]),
        }
    raise InputError(
        f"export: a model of kind '{model.kind}' has no compact form (it is {type(regressor).__name__}); "
        "models that can be exported are none, mean, the polynomials, rbf, rbf-patent, joint and joint-patent"
    )
