"""The thermal plant: a winding in radius and height between can, spool, base and lid, by its modes.

::

    C_i dT_i/dt = sum_j G_ij (T_j - T_i) + A_i (T_air - T_i) + s_i P

with C in J/K, G and A in W/K. The matrix is symmetric in sqrt(C) T, so that it has real modes; each mode
answers an input that is straight between steps exactly (first-order hold)::

    z' = -l z + v,   z_(k+1) = e z_k + h ((q - e) v_k + (1 - q) v_(k+1)) / x,   x = l h, e = exp(-x),
    q = (1 - e) / x
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from fogml.arrays import FloatArray

NAMES = ("can", "lid", "spool", "base", "board", "optics", "source")
"""Nodes beside the winding; the cells of the winding follow them, by radius and within it by height."""
RADIAL, AXIAL = 5, 4
_VOLUME_HEAT = 1.8e6  # J/m3/K, fibre in soft potting
_HEIGHT_M = 0.025


@dataclass(frozen=True)
class PlantConstants:
    """What one unit's plant is made of.

    Times in s: ``can_s`` and ``lid_s`` of can and lid behind the air, ``film_s`` of the winding behind the
    can, ``flange_s`` of it behind the base, ``spool_s`` of the spool behind the winding, ``base_s`` of the
    base behind the air, ``board_s`` of the board behind the base, ``vent_s`` of it behind the air,
    ``optics_s`` of the optics behind the base, ``source_s`` of the source behind the board. ``thickness_m``
    and ``radius_m`` of the winding, ``diffusivity`` across it and ``along`` times as much along it [m2/s];
    ``warm`` is by how much the power warms the board in the end [degC], ``source_share`` of it goes into the
    source; ``surge`` times as much more after power-on, dying away in ``surge_s``.
    """

    can_s: float
    lid_s: float
    film_s: float
    flange_s: float
    spool_s: float
    base_s: float
    board_s: float
    vent_s: float
    optics_s: float
    source_s: float
    thickness_m: float
    radius_m: float
    diffusivity: float
    along: float
    warm: float
    source_share: float
    surge: float
    surge_s: float


def draw_plant(rng: np.random.Generator, quick: bool = False) -> PlantConstants:
    """A unit's plant; a light one, that a shock gets into, where `quick`."""

    def log(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    light = 0.1 if quick else 1.0
    return PlantConstants(
        can_s=light * log(200.0, 1200.0),
        lid_s=light * log(150.0, 900.0),
        film_s=light * log(120.0, 700.0),
        flange_s=log(600.0, 4000.0),
        spool_s=log(150.0, 900.0),
        base_s=log(1500.0, 5000.0),
        board_s=log(200.0, 700.0),
        vent_s=log(400.0, 2000.0),
        optics_s=log(120.0, 900.0),
        source_s=log(40.0, 250.0),
        thickness_m=log(0.004, 0.014),
        radius_m=log(0.02, 0.07),
        diffusivity=log(0.8e-7, 3e-7),
        along=float(rng.uniform(1.0, 4.0)),
        warm=log(4.0, 20.0),
        source_share=float(rng.uniform(0.1, 0.5)),
        surge=float(rng.uniform(0.0, 1.0)),
        surge_s=log(60.0, 1200.0),
    )


class Plant:
    """The network of one unit.

    Attributes
    ----------
    capacities
        J/K, shape (nodes,).
    conductances
        Between nodes [W/K], symmetric, shape (nodes, nodes).
    to_air
        From each node to the air [W/K], shape (nodes,).
    heated
        Share of the power that goes into each node, shape (nodes,).
    power_w
        In the long run [W].
    """

    def __init__(self, constants: PlantConstants, radial: int = RADIAL, axial: int = AXIAL) -> None:
        self.constants = c = constants
        first = len(NAMES)
        count = first + radial * axial
        self.cells = np.arange(first, count).reshape(radial, axial)
        edges = np.linspace(c.radius_m, c.radius_m + c.thickness_m, radial + 1)
        middle = 0.5 * (edges[1:] + edges[:-1])
        slice_m = _HEIGHT_M / axial
        area = np.pi * np.diff(edges**2)
        capacity = np.zeros(count)
        capacity[self.cells] = (_VOLUME_HEAT * area * slice_m)[:, None]
        coil = float(capacity[self.cells].sum())
        capacity[:first] = coil * np.array([4.0, 2.0, 1.5, 8.0, 0.8, 0.2, 0.1])
        conductivity = c.diffusivity * _VOLUME_HEAT
        g = np.zeros((count, count))

        def join(i: int, j: int, value: float) -> None:
            g[i, j] += value
            g[j, i] += value

        can, lid, spool, base, board, optics, source = range(first)
        for i in range(radial - 1):
            across = 2.0 * np.pi * conductivity * slice_m / np.log(middle[i + 1] / middle[i])
            for j in range(axial):
                join(self.cells[i, j], self.cells[i + 1, j], across)
        for i in range(radial):
            for j in range(axial - 1):
                join(self.cells[i, j], self.cells[i, j + 1], c.along * conductivity * area[i] / slice_m)
            share = area[i] / area.sum()
            join(self.cells[i, 0], base, share * coil / c.flange_s)
            join(self.cells[i, -1], lid, share * 0.5 * coil / c.flange_s)
        for j in range(axial):
            join(self.cells[-1, j], can, coil / c.film_s / axial)
            join(self.cells[0, j], spool, capacity[spool] / c.spool_s / axial)
        join(can, lid, 0.5 * capacity[lid] / c.lid_s)
        join(can, base, 0.3 * capacity[can] / c.can_s)
        join(spool, base, 0.3 * capacity[spool] / c.spool_s)
        join(board, base, capacity[board] / c.board_s)
        join(optics, base, capacity[optics] / c.optics_s)
        join(optics, board, 0.2 * capacity[optics] / c.optics_s)
        join(source, board, capacity[source] / c.source_s)
        self.capacities, self.conductances = capacity, g
        self.to_air = np.zeros(count)
        self.to_air[can] = capacity[can] / c.can_s
        self.to_air[lid] = capacity[lid] / c.lid_s
        self.to_air[base] = capacity[base] / c.base_s
        self.to_air[board] = capacity[board] / c.vent_s
        self.heated = np.zeros(count)
        self.heated[board], self.heated[source] = 1.0 - c.source_share, c.source_share
        root = np.sqrt(capacity)
        matrix = (np.diag(g.sum(axis=1) + self.to_air) - g) / np.outer(root, root)
        self._rates, modes = np.linalg.eigh(matrix)
        self._back = modes / root[:, None]
        self._gains = np.stack([self.to_air, self.heated], axis=1) / root[:, None]
        self._gains = modes.T @ self._gains
        self.power_w = c.warm / float(self.rest(0.0, 1.0)[board])

    def temperatures(self, step_s: float, air: FloatArray, power: FloatArray) -> FloatArray:
        """Temperatures of all nodes [degC], shape (m, nodes), from rest at the first step.

        Parameters
        ----------
        step_s
            Step [s].
        air, power
            Air [degC] and heat [W] at the steps, straight between; shape (m,).
        """
        inputs = np.stack([air, power], axis=1) @ self._gains.T
        states = np.empty_like(inputs)
        for place, rate in enumerate(self._rates.tolist()):
            x = rate * step_s
            kept, mean = np.exp(-x), -np.expm1(-x) / x
            v = inputs[:, place]
            start = v[0] / rate
            filtered, _ = lfilter(
                step_s * np.array([1.0 - mean, mean - kept]) / x,
                [1.0, -kept],
                v[1:],
                zi=[kept * start + step_s * (mean - kept) / x * v[0]],
            )
            states[0, place], states[1:, place] = start, filtered
        return np.asarray(states @ self._back.T)

    def rest(self, air: float, power: float) -> FloatArray:
        """Temperatures in steady state [degC], shape (nodes,)."""
        matrix = np.diag(self.conductances.sum(axis=1) + self.to_air) - self.conductances
        return np.asarray(np.linalg.solve(matrix, self.to_air * air + self.heated * power))
