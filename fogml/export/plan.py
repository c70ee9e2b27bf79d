"""A compact model with the features that it takes: the one thing that every export is made from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.features.atoms import Atom, AtomValues
from fogml.features.box import OVERSHOOT, TOLERANCE, Box, reaching_box
from fogml.features.features import Features
from fogml.features.slices import Slices
from fogml.features.terms import Step, composition_plan
from fogml.models.base import DriftModel
from fogml.models.compact import Compact, affine, operations_of_compact, operations_of_features
from fogml.models.rbf.network import Network
from fogml.runs.dropouts import RULE, DropoutRule
from fogml.signals import large

SHORTEST_STEP_S, LONGEST_STEP_S = 1e-6, 86_400.0
"""Sample intervals on board [s]: the clock counts microseconds; no unit is read more seldom than daily."""
LEAST_OUTPUT_BITS, MOST_OUTPUT_BITS = 6, 12
"""Outputs of 32 bits hold 9320 deg/s then, more than any gyro's range, and 146 deg/s."""


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
    slices
        Trained ranges at each temperature; None where nothing depends on it.
    """

    low: FloatArray
    high: FloatArray
    margin: FloatArray
    inner: FloatArray
    outer: FloatArray
    box_low: FloatArray
    box_high: FloatArray
    slices: Slices | None = None

    @classmethod
    def of(cls, features: Features, linear: bool) -> Limits:
        """The limits of features whose box is learned."""
        bounds = np.array([features.box[atom.text] for atom in features.atoms]).reshape(-1, 2)
        box = Box(bounds[:, 0], bounds[:, 1])
        reach = reaching_box(box, features.terms, features.atoms) if linear else box
        slack = TOLERANCE * box.span
        outside = box.low - slack, box.high + slack
        margin = OVERSHOOT * reach.span
        return cls(reach.low, reach.high, margin, *outside, box.low, box.high, features.slices)

    @classmethod
    def none(cls) -> Limits:
        """The limits of a model without features."""
        none = np.empty(0)
        return cls(none, none, none, none, none, none, none)

    def of_atoms(self, places: Sequence[int]) -> Limits:
        """The limits of the atoms at some places alone."""
        slices = None if self.slices is None else self.slices.of_atoms(places)
        ends = {name: ends[places] for name, ends in vars(self).items() if name != "slices"}
        return Limits(**ends, slices=slices)

    def apply(self, atoms: FloatArray, heeded: BoolArray, full: BoolArray) -> tuple[FloatArray, BoolArray]:
        """Limited atoms (n, a), and rows outside (n,).

        `heeded` (n, a) tells where values mean something, `full` (n,) where all windows are full.
        """
        above, below = atoms - self.high, self.low - atoms
        beyond = np.where(heeded, np.maximum(np.maximum(above, below), 0.0), 0.0)
        soft = self.margin * beyond / (self.margin + beyond)
        limited = np.where(above > 0.0, self.high + soft, self.low - soft)
        limited = np.where(beyond > 0.0, limited, atoms)
        outside = (heeded & ((atoms < self.inner) | (atoms > self.outer))).any(axis=1)
        if self.slices is not None:
            outside |= self.slices.outside(atoms) & full
        return np.asarray(limited), np.asarray(outside)


@dataclass(frozen=True, eq=False)
class Plan:
    """A fitted model as numbers, without the classes that fitted it.

    Attributes
    ----------
    compact
        What it makes of the features: linear part, Gaussians, scale factor.
    sensors
        Temperatures and other columns needed, by their names in formulas.
    atoms, steps, names
        The features' atoms, how columns are made of them, and the columns' names.
    limits
        The trained box and what becomes of atoms beyond it.
    sample_s
        Sample interval [s] to run at.
    gyro_unit
        Unit of the output that the model takes.
    thermometer
        What a thermometer can show; other readings are taken for none.
    output_bits
        Bits behind the point of outputs in fixed point, whose steps are 2**-output_bits deg/h.
    """

    compact: Compact
    sensors: tuple[str, ...]
    atoms: tuple[Atom, ...]
    steps: tuple[Step, ...]
    names: tuple[str, ...]
    limits: Limits
    sample_s: float
    gyro_unit: str = "deg/h"
    thermometer: DropoutRule = RULE
    output_bits: int = MOST_OUTPUT_BITS

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
        model._check_fitted()
        interval = float(model.card_.sample_s if sample_s is None else sample_s)
        if not SHORTEST_STEP_S <= interval <= LONGEST_STEP_S:
            raise InputError(
                f"export: a sample interval of {interval:g} s; state one of {SHORTEST_STEP_S:g} to "
                f"{LONGEST_STEP_S:g} s with --sample-s"
            )
        compact = model.compact()
        if model.features_ is None:
            return cls(compact, (), (), (), (), Limits.none(), interval)
        plan = cls.with_features(compact, model.features_, interval)
        return replace(plan, gyro_unit=model.card_.gyro_unit) if plan.gives_rate else plan

    @classmethod
    def with_features(cls, compact: Compact, features: Features, sample_s: float) -> Plan:
        """The plan of a compact form of features whose box is learned."""
        return cls(
            compact,
            features.sensors,
            features.atoms,
            composition_plan(features.terms, features.atoms),
            tuple(features.names()),
            Limits.of(features, compact.linear_beyond),
            sample_s,
            thermometer=features.thermometer,
        )

    @property
    def kind(self) -> str:
        """Name of the model, e.g. ``rbf``."""
        return self.compact.kind

    @property
    def network(self) -> Network:
        """Linear part and Gaussians."""
        return self.compact.network

    @property
    def arrays(self) -> dict[str, FloatArray]:
        """All numbers that are fitted, by name: ``constant`` and what else there is.

        ``linear`` (k,); ``centres``, ``widths`` (j, d) and ``weights`` (j,); ``scale`` (3,).
        """
        network = self.network
        held = {
            "constant": np.array([network.constant]),
            "linear": network.linear,
            "centres": network.centres,
            "widths": network.widths,
            "weights": network.weights,
            "scale": self.compact.scale,
        }
        return {name: values for name, values in held.items() if values.size}

    @property
    def gives_rate(self) -> bool:
        """Whether its value is a rate made of the output, scale factor and all, and not a drift."""
        return len(self.compact.scale) > 0

    @property
    def centres(self) -> int:
        """Number of Gaussians."""
        return len(self.network.weights)

    @property
    def columns(self) -> tuple[int, ...]:
        """Which of the features the Gaussians see."""
        return tuple(self.network.columns.tolist())

    @property
    def edge_columns(self) -> tuple[int, ...]:
        """Features that hold a rate, beyond whose trained range Gaussians go on along their slope."""
        return tuple(self.network.edge.columns.tolist())

    @property
    def edge(self) -> FloatArray:
        """That range, shape (2, r)."""
        return np.stack([self.network.edge.low, self.network.edge.high])

    @property
    def windowed(self) -> BoolArray:
        """Which atoms need a window, shape (a,)."""
        return np.array([atom.window is not None for atom in self.atoms], dtype=np.bool_)

    @property
    def operations(self) -> int:
        """Additions, multiplications and divisions at a sample inside the trained box, windows full."""
        features = operations_of_features(self.atoms, self.steps, self.sample_s)
        return features + operations_of_compact(self.compact)

    def with_arrays(self, arrays: Mapping[str, FloatArray]) -> Plan:
        """The same with other numbers, by the names of `arrays`; without Gaussians where none are given."""
        linear, constant = arrays.get("linear", np.empty(0)), float(arrays["constant"][0])
        network = affine(linear, constant)
        if len(arrays.get("weights", ())):
            centres, widths, weights = (arrays[name] for name in ("centres", "widths", "weights"))
            edge, columns = self.network.edge, self.network.columns
            network = Network(columns, centres, widths, weights, linear, constant, edge)
        scale = np.asarray(arrays.get("scale", np.empty(0)))
        return replace(self, compact=replace(self.compact, network=network, scale=scale))

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
        return self.limits.apply(atoms, full[:, None] | ~self.windowed[None, :] | (atoms != 0.0), full)

    def full_columns(self, atoms: FloatArray) -> FloatArray:
        """Feature columns (n, k) of atoms (n, a) where all windows are full."""
        columns = np.empty((len(atoms), len(self.steps)))
        for part in large.pieces(atoms):
            limited, _ = self.limited(atoms[part], np.ones(len(atoms[part]), dtype=np.bool_))
            columns[part] = self.compose(limited)
        return columns

    def compensated(self, atoms: AtomValues, gyro: FloatArray) -> tuple[FloatArray, NDArray[np.int8]]:
        """Compensated output [deg/h] and flags, each (n,), from atoms (n, a) and the output (n,)."""
        values, full, settled = atoms
        compensated, flag = np.empty(len(values)), np.empty(len(values), np.int8)
        for part in large.pieces(values):
            limited, outside = self.limited(values[part], full[part])
            value = self.value(self.compose(limited), gyro[part])
            compensated[part] = value if self.gives_rate else gyro[part] - value
            flag[part] = np.where(full[part] & settled[part], outside.astype(np.int8), np.int8(2))
        return compensated, flag

    def value(self, columns: FloatArray, gyro: FloatArray | None = None) -> FloatArray:
        """Drift [deg/h] of feature columns (n, k), shape (n,); of a joint model the rate."""
        value = self.network(np.ascontiguousarray(columns))
        if self.gives_rate:
            assert gyro is not None
            s0, s1, s2 = self.compact.scale
            value = value + (s0 + columns[:, 0] * (s1 + columns[:, 0] * s2)) * gyro
        return value
