"""Runs of a case as stacked columns: nominal constants, candidates' signatures, the recorded gap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from pathlib import Path

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.model import Candidate, TwinModel
from fogml.gap.reading import rows_of
from fogml.gap.rows import Rows
from fogml.gap.settings import STANDARD
from fogml.runs.reading import read_run
from fogml.signals.noise_fit import fit_noise
from fogml.signals.noise_model import NoiseModel
from fogml.signals.whitening import Whitener
from fogml.twin.nominal import nominal_columns
from fogml.twin.quantities import Quantity
from fogml.twin.registry import effect
from fogml.twin.replay import Replayer
from fogml.twin.twin_file import load_twin

LARGEST_ROWS = 4096
"""Runs are averaged down to about this many rows."""
_NODES = {1: 7, 2: 4, 3: 3}
_FINEST_LINE = 60
_TIME_ORDERS, _TEMPERATURE_ORDERS = 6, (3, 4, 5)
PHASE = Quantity("phase", "deg", (0.0, 360.0), (0.0, 360.0), "at the run's time 0", default=0.0)
"""Of a line: each run has its own."""


@dataclass(frozen=True)
class Atom:
    """A candidate at one shape."""

    id: str
    shape: Mapping[str, float] = field(default_factory=dict)


class Stack:
    """Several runs of one unit, one below the other, through the nominal twin.

    Parameters
    ----------
    runs
        Paths of the runs.
    constants
        Nominal constants about which effects that falsify an input are taken; 0 unless stated.
    """

    def __init__(self, runs: Sequence[Path], constants: Mapping[str, float] | None = None) -> None:
        self.model = TwinModel(load_twin("nominal"))
        self.constants = {constant.name: constant for constant in self.model.constants}
        self.about = dict.fromkeys(self.constants, 0.0) | dict(constants or {})
        twin = self.model.twin
        self.parts: list[Rows] = [rows_of(read_run(path), twin, LARGEST_ROWS) for path in runs]
        self.names = [path.name for path in runs]

    def __len__(self) -> int:
        return sum(len(part) for part in self.parts)

    @cached_property
    def time(self) -> list[FloatArray]:
        """Time of each run's rows [s]."""
        return [part.time_s for part in self.parts]

    @cached_property
    def gap(self) -> FloatArray:
        """Recorded less replayed at the priors' means [deg/h], shape (n,)."""
        twin = self.model.twin
        return np.concatenate(
            [part.samples(part.run.gyro_deg_h - Replayer(part.run).output(twin)) for part in self.parts]
        )

    @cached_property
    def nominal(self) -> FloatArray:
        """Response to each nominal constant [deg/h per unit], shape (n, k)."""
        columns = []
        for part in self.parts:
            # As a replay has them, of readings as they are.
            given = nominal_columns(Replayer(part.run).recorded)
            zeros = np.zeros(len(part.run))
            columns.append(np.column_stack([part.samples(given.get(name, zeros)) for name in self.constants]))
        return np.concatenate(columns)

    @cached_property
    def prior_sd(self) -> FloatArray:
        """Standard deviations of the constants' priors, shape (k,)."""
        return np.array([constant.sd for constant in self.constants.values()])

    def column(self, atom: Atom) -> FloatArray:
        """Response to a unit of a candidate's amplitude [deg/h], shape (n,)."""
        return np.concatenate([self._response(part, atom) for part in self.parts])

    def _response(self, part: Rows, atom: Atom) -> FloatArray:
        if atom.id == "sinusoidal":
            phase = np.radians(atom.shape[PHASE.name])
            return np.asarray(np.sin(2.0 * np.pi * atom.shape["frequency"] * part.time_s + phase))
        return part.response(effect(atom.id), atom.shape, None, self.about)

    def averaged(self, series: Sequence[FloatArray]) -> FloatArray:
        """Block means of one series per run over its samples [deg/h], shape (n,)."""
        return np.concatenate([part.samples(values) for part, values in zip(self.parts, series)])

    def split(self, values: FloatArray) -> list[FloatArray]:
        """Rows of a stacked array by run."""
        return np.split(values, np.cumsum([len(part) for part in self.parts])[:-1])

    def whitened(self, noise: NoiseModel, values: FloatArray) -> FloatArray:
        """Whitened columns, shape (n,) or (n, m), each run by itself."""
        return np.concatenate(
            [
                Whitener(noise, part.time_s, averaging_s=part.row_s).whiten(rows)
                for part, rows in zip(self.parts, self.split(values))
            ]
        )


def noise_of(static: Path | None, fit: Stack) -> NoiseModel:
    """Noise coefficients from a static run, or from the fit runs beside what smooth curves take up."""
    if static is not None:
        run = read_run(static)
        return fit_noise(
            [run.time], [run.gyro_deg_h], averaging_s=run.sample_s, most=STANDARD.noise.most_rows
        ).model
    columns = np.column_stack([fit.nominal, smooth_curves(fit)])
    sizes = np.linalg.norm(columns, axis=0)
    parts = fit.split(columns[:, sizes > 0.0] / sizes[sizes > 0.0])
    row_s = fit.parts[0].row_s
    return fit_noise(
        fit.time, fit.split(fit.gap), parts, averaging_s=row_s, most=STANDARD.noise.most_rows
    ).model


def smooth_curves(stack: Stack) -> FloatArray:
    """Legendre polynomials in each run's time, and higher powers of temperature, shape (n, k)."""
    columns = []
    for index, part in enumerate(stack.parts):
        x = 2.0 * (part.time_s - part.time_s[0]) / max(part.time_s[-1] - part.time_s[0], 1e-300) - 1.0
        powers = np.polynomial.legendre.legvander(x, _TIME_ORDERS)[:, 1:]
        rows = np.zeros((len(part), len(stack.parts) * _TIME_ORDERS))
        rows[:, index * _TIME_ORDERS : (index + 1) * _TIME_ORDERS] = powers
        u = (part.temperature - 25.0) / 50.0
        columns.append(np.column_stack([rows, *(u**order for order in _TEMPERATURE_ORDERS)]))
    return np.concatenate(columns)


def atoms(candidates: Mapping[str, Candidate], without: Sequence[str], grid: bool = True) -> list[Atom]:
    """Each candidate on a coarse grid over its shape parameters, or at the usual shape alone."""
    found = []
    for id, candidate in candidates.items():
        if id in without:
            continue
        free = free_shape(candidate)
        usual = {quantity.name: quantity.typical() for quantity in free}
        if not grid:
            found.append(Atom(id, usual))
            continue
        count = _NODES[min(max(len(free), 1), 3)]
        axes = [_axis(quantity, count) for quantity in free]
        found += [Atom(id, dict(zip(usual, values))) for values in product(*axes)]
    return found


def free_shape(candidate: Candidate) -> tuple[Quantity, ...]:
    """Shape parameters of a candidate, a line's phase among them."""
    return (*candidate.shape, PHASE) if candidate.id == "sinusoidal" else candidate.shape


def _axis(quantity: Quantity, count: int) -> list[float]:
    low, high = quantity.tactical
    if quantity.unit == "deg":
        # An amplitude of either sign makes half a turn enough.
        return [low + 45.0 * step for step in range(4)]
    if "period" in quantity.name:
        return [float(1.0 / f) for f in np.linspace(1.0 / high, 1.0 / low, min(_FINEST_LINE, 6 * count))]
    if low > 0.0 and high / low > 3.0:
        return [float(value) for value in np.geomspace(low, high, count)]
    return [float(value) for value in np.linspace(low, high, count)]
