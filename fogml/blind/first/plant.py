"""The thermal plant: a radial conduction line for the coil between case and hub, by Crank-Nicolson.

::

    C_i dT_i/dt = sum_j G_ij (T_j - T_i) + G_air (T_air - T_i) + P_i

with C in J/K, G in W/K. The coil is cut into shells of equal thickness; between the mid radii of
neighbours G = 2 pi k H / ln(r_(j+1) / r_j), the exact conductance of a cylinder wall. One implicit
trapezoidal step of a few seconds is propagated over blocks of steps at a time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray

CASE, HUB, ELECTRONICS, PLATE, PLATE_DEEP = range(5)
FIRST_SHELL = 5
SHELLS = 12
_BLOCK = 40
_VOLUME_HEAT = 2.0e6  # J/m3/K, glass and polymer wound
_HEIGHT_M = 0.02


@dataclass(frozen=True)
class PlantConstants:
    """What one unit's plant is made of.

    Time constants in seconds: ``case_s`` of the case behind the air, ``coil_s`` of the coil behind the
    case, ``hub_s`` of the hub behind the coil, ``board_s`` of the electronics behind the case,
    ``plate_s`` of the table's plate behind the air. ``thickness_m`` of the winding and its
    ``diffusivity`` [m2/s]; ``power_w`` and ``inrush_w`` after power-on, which dies away in ``inrush_s``.
    """

    case_s: float = 900.0
    coil_s: float = 400.0
    hub_s: float = 300.0
    board_s: float = 360.0
    plate_s: float = 2400.0
    thickness_m: float = 0.007
    inner_radius_m: float = 0.045
    diffusivity: float = 2e-7
    power_w: float = 2.0
    inrush_w: float = 3.0
    inrush_s: float = 900.0
    still_air: float = 0.6


def draw_plant(rng: np.random.Generator, quick: bool = False) -> PlantConstants:
    """A unit's plant from the catalogue's ranges; a light one, that a shock gets into, where `quick`."""
    scale = 0.12 if quick else 1.0
    power = rng.uniform(1.5, 4.0)
    return PlantConstants(
        case_s=scale * rng.uniform(360.0, 1500.0),
        coil_s=scale * rng.uniform(150.0, 800.0),
        hub_s=rng.uniform(100.0, 500.0),
        board_s=rng.uniform(200.0, 600.0),
        plate_s=rng.uniform(1500.0, 3600.0),
        thickness_m=rng.uniform(0.004, 0.010),
        inner_radius_m=rng.uniform(0.03, 0.06),
        diffusivity=rng.uniform(1e-7, 3e-7),
        power_w=power,
        inrush_w=power * rng.uniform(0.9, 1.6),
        inrush_s=rng.uniform(300.0, 2400.0),
        still_air=rng.uniform(0.5, 0.8),
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
        From each node to the chamber's air, fan on [W/K], shape (nodes,).
    """

    def __init__(self, constants: PlantConstants, shells: int = SHELLS) -> None:
        self.constants = c = constants
        count = FIRST_SHELL + shells
        edges = np.linspace(c.inner_radius_m, c.inner_radius_m + c.thickness_m, shells + 1)
        middle = 0.5 * (edges[1:] + edges[:-1])
        shell = _VOLUME_HEAT * np.pi * np.diff(edges**2) * _HEIGHT_M
        wall = 2.0 * np.pi * c.diffusivity * _VOLUME_HEAT * _HEIGHT_M / np.diff(np.log(middle))
        coil = float(shell.sum())
        self.capacities = np.concatenate(
            [[6.0 * coil, 1.2 * coil, 1.2 * coil, 20.0 * coil, 20.0 * coil], shell]
        )
        g = np.zeros((count, count))

        def join(i: int, j: int, value: float) -> None:
            g[i, j] = g[j, i] = value

        for k in range(shells - 1):
            join(FIRST_SHELL + k, FIRST_SHELL + k + 1, wall[k])
        join(FIRST_SHELL + shells - 1, CASE, coil / c.coil_s)
        join(FIRST_SHELL, HUB, self.capacities[HUB] / c.hub_s)
        join(ELECTRONICS, CASE, self.capacities[ELECTRONICS] / c.board_s)
        join(ELECTRONICS, HUB, 0.1 * self.capacities[ELECTRONICS] / c.board_s)
        join(HUB, CASE, 0.1 * self.capacities[HUB] / c.hub_s)
        # The plate is heavy: it hears the air, the unit hears little of it.
        join(PLATE, PLATE_DEEP, 2.0 * self.capacities[PLATE] / c.plate_s)
        join(PLATE, CASE, 0.05 * self.capacities[CASE] / c.case_s)
        self.conductances = g
        self.to_air = np.zeros(count)
        self.to_air[CASE] = self.capacities[CASE] / c.case_s
        self.to_air[PLATE] = 2.0 * self.capacities[PLATE] / c.plate_s

    def temperatures(
        self, step_s: float, air: FloatArray, power: FloatArray, fan: FloatArray, start: FloatArray
    ) -> FloatArray:
        """Temperatures of all nodes [degC], shape (m, nodes), from `start` at the first step.

        Parameters
        ----------
        step_s
            Step [s].
        air, power
            Air [degC] and heat into the electronics [W] at the steps, linear between; shape (m,).
        fan
            1 with the fan on, 0 without; held over a step, shape (m,).
        start
            Shape (nodes,).
        """
        out = np.empty((len(air), len(start)))
        out[0] = start
        inputs = np.stack([air, power], axis=1)
        mean = 0.5 * (inputs[1:] + inputs[:-1])
        on = fan[:-1] > 0.5
        borders = np.concatenate([[0], np.flatnonzero(np.diff(on.astype(int))) + 1, [len(on)]])
        blocks = {bool(state): self._block(step_s, bool(state)) for state in np.unique(on)}
        for first, stop in zip(borders[:-1].tolist(), borders[1:].tolist()):
            carried, forced = blocks[bool(on[first])]
            for begin in range(first, stop, _BLOCK):
                end = min(begin + _BLOCK, stop)
                steps = end - begin
                x = carried[:steps] @ out[begin]
                x += np.einsum("jiab,ib->ja", forced[:steps, :steps], mean[begin:end], optimize=True)
                out[begin + 1 : end + 1] = x
        return out

    def rest(self, air: float, power: float) -> FloatArray:
        """Temperatures in steady state [degC], shape (nodes,)."""
        matrix = np.diag(self.conductances.sum(axis=1) + self.to_air) - self.conductances
        heat = self.to_air * air
        heat[ELECTRONICS] += power
        return np.asarray(np.linalg.solve(matrix, heat))

    def _block(self, step_s: float, fan: bool) -> tuple[FloatArray, FloatArray]:
        """What a block of steps makes of its start, (L, n, n), and of each step's inputs, (L, L, n, 2)."""
        count = len(self.capacities)
        to_air = self.to_air * (1.0 if fan else self.constants.still_air)
        rate = (self.conductances - np.diag(self.conductances.sum(axis=1) + to_air)) / self.capacities[
            :, None
        ]
        gain = np.zeros((count, 2))
        gain[:, 0] = to_air / self.capacities
        gain[ELECTRONICS, 1] = 1.0 / self.capacities[ELECTRONICS]
        implicit = np.linalg.inv(np.eye(count) - 0.5 * step_s * rate)
        step = implicit @ (np.eye(count) + 0.5 * step_s * rate)
        forced = implicit @ (step_s * gain)
        powers = np.empty((_BLOCK + 1, count, count))
        powers[0] = np.eye(count)
        for k in range(_BLOCK):
            powers[k + 1] = step @ powers[k]
        answers = powers[:_BLOCK] @ forced
        j, i = np.indices((_BLOCK, _BLOCK))
        kernel = np.where((j >= i)[:, :, None, None], answers[np.maximum(j - i, 0)], 0.0)
        return powers[1:], kernel
