"""Runs of a case as stacked columns: nominal constants, candidates' signatures, the recorded gap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from pathlib import Path

import numpy as np

from fogml.gap.model import Candidate
from fogml.gap.noise import MOST_ROWS
from fogml.gap.observation import Observation, observe
from fogml.gap.twin_model import TwinModel
from fogml.runs.reading import read_run
from fogml.runs.run import FloatArray
from fogml.signals.noise_fit import fit_noise
from fogml.signals.noise_model import NoiseModel
from fogml.signals.whitening import Whitener
from fogml.twin.quantities import Quantity
from fogml.twin.twin_file import load_twin

LARGEST_ROWS = 4096
"""Runs are averaged down to about this many rows."""
_NODES = {1: 7, 2: 4, 3: 3}
_FINEST_LINE = 60
_TIME_ORDERS, _TEMPERATURE_ORDERS = 6, (3, 4, 5)


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
        self.parts: list[Observation] = [
            observe(read_run(path), self.model, largest_rows=LARGEST_ROWS) for path in runs
        ]
        self.names = [path.name for path in runs]

    def __len__(self) -> int:
        return sum(len(part) for part in self.parts)

    @cached_property
    def time(self) -> list[FloatArray]:
        """Time of each run's rows [s]."""
        return [part.time for part in self.parts]

    @cached_property
    def gap(self) -> FloatArray:
        """Recorded less replayed at the priors' means [deg/h], shape (n,)."""
        means = {name: constant.mean for name, constant in self.constants.items()}
        return np.concatenate(
            [part.recorded - part.averaged(part.model.output(means)) for part in self.parts]
        )

    @cached_property
    def nominal(self) -> FloatArray:
        """Response to each nominal constant [deg/h per unit], shape (n, k)."""
        columns = []
        for part in self.parts:
            given = part.model.columns()
            zeros = np.zeros(len(part))
            columns.append(
                np.column_stack(
                    [part.averaged(given[name]) if name in given else zeros for name in self.constants]
                )
            )
        return np.concatenate(columns)

    @cached_property
    def prior_sd(self) -> FloatArray:
        """Standard deviations of the constants' priors, shape (k,)."""
        return np.array([constant.sd for constant in self.constants.values()])

    def column(self, atom: Atom) -> FloatArray:
        """Response to a unit of a candidate's amplitude [deg/h], shape (n,)."""
        return np.concatenate([part.response(atom.id, atom.shape, self.about) for part in self.parts])

    def averaged(self, series: Sequence[FloatArray]) -> FloatArray:
        """Block means of one series per run over its samples [deg/h], shape (n,)."""
        return np.concatenate([part.averaged(values) for part, values in zip(self.parts, series)])

    def split(self, values: FloatArray) -> list[FloatArray]:
        """Rows of a stacked array by run."""
        return np.split(values, np.cumsum([len(part) for part in self.parts])[:-1])

    def whitened(self, noise: NoiseModel, values: FloatArray) -> FloatArray:
        """Whitened columns, shape (n,) or (n, m), each run by itself."""
        return np.concatenate(
            [
                Whitener(noise, part.time, averaging_s=part.row_s).whiten(rows)
                for part, rows in zip(self.parts, self.split(values))
            ]
        )


def noise_of(static: Path | None, fit: Stack) -> NoiseModel:
    """Noise coefficients from a static run, or from the fit runs beside what smooth curves take up."""
    if static is not None:
        run = read_run(static)
        return fit_noise([run.time], [run.gyro_deg_h], averaging_s=run.sample_s, most=MOST_ROWS).model
    columns = np.column_stack([fit.nominal, smooth_curves(fit)])
    sizes = np.linalg.norm(columns, axis=0)
    parts = fit.split(columns[:, sizes > 0.0] / sizes[sizes > 0.0])
    row_s = fit.parts[0].row_s
    return fit_noise(fit.time, fit.split(fit.gap), parts, averaging_s=row_s, most=MOST_ROWS).model


def smooth_curves(stack: Stack) -> FloatArray:
    """Legendre polynomials in each run's time, and higher powers of temperature, shape (n, k)."""
    columns = []
    for index, part in enumerate(stack.parts):
        x = 2.0 * (part.time - part.time[0]) / max(part.time[-1] - part.time[0], 1e-300) - 1.0
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
        usual = {quantity.name: quantity.typical() for quantity in candidate.shape}
        if not grid:
            found.append(Atom(id, usual))
            continue
        count = _NODES[min(max(len(candidate.shape), 1), 3)]
        axes = [_axis(quantity, count) for quantity in candidate.shape]
        found += [Atom(id, dict(zip(usual, values))) for values in product(*axes)]
    return found


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
