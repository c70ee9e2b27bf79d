"""The thermal plant: a network of heat capacities between chamber air, case, coil, hub, electronics."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.twin.plant.heat import ALWAYS_ON, Airflow, PowerWindows, SelfHeating, levels


@dataclass(frozen=True, eq=False)
class ModalSystem:
    """Modes of ``C dT/dt = -K T + B T_boundary + e P``.

    Attributes
    ----------
    rates
        Decay rates [1/s], shape (m,), all positive.
    gains
        From boundary temperatures [degC] to the modes, shape (m, k).
    source_gains
        From power [W] to the modes, shape (m,).
    to_modes, to_states
        From node temperatures to modes and back, shape (m, m).
    """

    rates: FloatArray
    gains: FloatArray
    source_gains: FloatArray
    to_modes: FloatArray
    to_states: FloatArray

    @classmethod
    def of(
        cls, capacity: FloatArray, conduction: FloatArray, boundary: FloatArray, heated: FloatArray
    ) -> ModalSystem:
        """The modes of a network.

        Parameters
        ----------
        capacity
            C [J/K], shape (m,).
        conduction
            K [W/K], symmetric, shape (m, m).
        boundary
            B [W/K], shape (m, k).
        heated
            e, shape (m,).

        Notes
        -----
        ``C^-1/2 K C^-1/2`` is symmetric, so all rates are real.
        """
        root = np.sqrt(capacity)
        rates, vectors = np.linalg.eigh(conduction / np.outer(root, root))
        if len(rates) and not rates[0] > 1e-12 * rates[-1]:
            raise InputError(
                "thermal plant: a node exchanges heat with no given temperature; link it, or leave it out"
            )
        to_modes = np.ascontiguousarray((vectors * root[:, None]).T)
        to_states = np.ascontiguousarray(vectors / root[:, None])
        return cls(rates, to_states.T @ boundary, to_states.T @ heated, to_modes, to_states)


AIR = "T_chamber"


@dataclass
class PlantState:
    """What a plant remembers from block to block. A fresh one for a whole run."""

    time: float = math.nan
    step: float = math.nan
    factor: float = 1.0
    nodes: FloatArray = field(default_factory=lambda: np.empty(0))
    boundary: FloatArray = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True, eq=False)
class ThermalNetwork:
    """Nodes with heat capacities, linked by conductances, driven by temperatures and self-heating.

    ::

        C_i dT_i/dt = sum_j G_ij (T_j - T_i) + P_i(t)

    A name in `links` without a capacity is a boundary: its temperature is given. Solved exactly
    for boundaries linear between samples, at any steps.

    Attributes
    ----------
    capacities
        Node to heat capacity [J/K].
    links
        Pair of names to conductance [W/K], one entry a pair.
    readings
        Further temperatures as weights of nodes and boundaries, which add to 1.
    heating
        Power that the unit turns into heat, and where.
    airflow
        How the conductance to the chamber air follows fan and table rate.
    """

    capacities: Mapping[str, float]
    links: Mapping[tuple[str, str], float]
    readings: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    heating: SelfHeating = field(default_factory=SelfHeating)
    airflow: Airflow = field(default_factory=Airflow)

    def __post_init__(self) -> None:
        for name, capacity in self.capacities.items():
            if not (math.isfinite(capacity) and capacity > 0.0):
                raise InputError(f"thermal plant: heat capacity of '{name}' is {capacity:g} J/K; must be > 0")
        for (a, b), conductance in self.links.items():
            if not (math.isfinite(conductance) and conductance >= 0.0) or a == b:
                raise InputError(f"thermal plant: conductance {a} - {b} is {conductance:g} W/K; must be >= 0")

    @cached_property
    def nodes(self) -> tuple[str, ...]:
        """Names of the nodes whose temperature is solved for."""
        return tuple(self.capacities)

    @cached_property
    def boundary(self) -> tuple[str, ...]:
        """Names whose temperature must be given."""
        ends = dict.fromkeys(name for link in self.links for name in link)
        return tuple(name for name in ends if name not in self.capacities)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Every temperature that the plant gives, boundaries first."""
        return tuple(dict.fromkeys((*self.boundary, *self.nodes, *self.readings)))

    def temperatures(
        self,
        time: FloatArray,
        boundary: FloatArray | Mapping[str, FloatArray],
        *,
        powered: PowerWindows = ALWAYS_ON,
        fan: FloatArray | None = None,
        table_rate: FloatArray | None = None,
        state: PlantState | None = None,
    ) -> dict[str, FloatArray]:
        """Temperature of every node [degC], by name, each of shape (n,).

        Parameters
        ----------
        time
            Time [s], shape (n,), increasing; steps may differ.
        boundary
            Chamber air [degC], shape (n,), or the temperature of each boundary by name.
        powered
            When the unit is on, (from, to) [s] in time order; the part before `time` counts too.
        fan, table_rate
            Duty 0 to 1 and rate [deg/s], shape (n,), which hold until the next sample; they
            matter where `airflow` says so. Fan on and table at rest where not given.
        state
            Left by the block before, and taken along; at rest but for the heating where fresh.

        Raises
        ------
        InputError
            If a boundary's temperature is missing.
        """
        given = boundary if isinstance(boundary, Mapping) else {AIR: boundary}
        missing = [name for name in self.boundary if name not in given]
        if missing:
            raise InputError(f"thermal plant: the temperature '{missing[0]}' is not given")
        state = PlantState() if state is None else state
        time = np.ascontiguousarray(time, dtype=np.float64)
        inputs = np.empty((len(self.boundary), len(time)))
        for row, name in zip(inputs, self.boundary):
            row[:] = given[name]
        out = np.empty((len(self.nodes) + len(self.readings), len(time)))
        if len(time):
            self._solve(time, inputs, powered, self.airflow.factors(fan, table_rate), state, out)
        solved = dict(zip((*self.nodes, *self.readings), out))
        return {name: inputs[self.boundary.index(name)] for name in self.boundary} | solved

    def _solve(
        self,
        time: FloatArray,
        inputs: FloatArray,
        powered: PowerWindows,
        factors: FloatArray,
        state: PlantState,
        out: FloatArray,
    ) -> None:
        from fogml.signals.modes import modes_kernel

        windows = np.array(powered, dtype=np.float64).reshape(-1, 2)
        if math.isnan(state.time):
            state.nodes = self._at_start(float(time[0]), inputs[:, 0], windows)
            state.factor, state.boundary = float(factors[0]), inputs[:, 0].copy()
        # A change of air is met at the sample where it begins.
        values, level = levels(factors, state.factor)
        systems = [self._system(factor) for factor in values]
        state.step = modes_kernel(
            time,
            inputs,
            level,
            np.stack([s.rates for s in systems]),
            np.stack([s.gains for s in systems]),
            np.stack([s.source_gains for s in systems]),
            self.heating.parts,
            windows,
            np.stack([s.to_modes for s in systems]),
            np.stack([s.to_states for s in systems]),
            np.stack([s.to_states.T @ self._weights[0] for s in systems]),
            self._weights[1],
            state.nodes,
            state.time,
            state.boundary,
            values.index(state.factor),
            state.step,
            out,
        )
        state.time, state.boundary = float(time[-1]), inputs[:, -1].copy()
        state.factor = float(factors[-1])

    def _at_start(self, start: float, boundary: FloatArray, windows: FloatArray) -> FloatArray:
        """Node temperatures [degC] at rest with the boundaries at `start`, and heated until then."""
        from fogml.signals.modes import windowed

        system = self._system(1.0)
        modes = system.gains @ boundary / system.rates
        for on, off in windows:
            heat = [windowed(rate, -math.inf, start, on, off, self.heating.parts) for rate in system.rates]
            modes = modes + system.source_gains * np.array(heat)
        return np.asarray(system.to_states @ modes)

    @cached_property
    def _systems(self) -> dict[float, ModalSystem]:
        return {}

    def _system(self, factor: float) -> ModalSystem:
        """The modes where links to the chamber air are `factor` times as strong."""
        if factor not in self._systems:
            conduction, boundary = self.matrices(factor)
            capacity = np.array(list(self.capacities.values()))
            self._systems[factor] = ModalSystem.of(capacity, conduction, boundary, self._heated)
        return self._systems[factor]

    def matrices(self, air_factor: float = 1.0) -> tuple[FloatArray, FloatArray]:
        """K and B [W/K] of ``C dT/dt = -K T + B T_boundary``, shapes (m, m) and (m, k)."""
        m = len(self.nodes)
        everywhere = {name: i for i, name in enumerate((*self.nodes, *self.boundary))}
        full = np.zeros((len(everywhere), len(everywhere)))
        for (a, b), conductance in self.links.items():
            value = conductance * (air_factor if AIR in (a, b) else 1.0)
            i, j = everywhere[a], everywhere[b]
            full[[i, j], [i, j]] += value
            full[[i, j], [j, i]] -= value
        return full[:m, :m], -full[:m, m:]

    @cached_property
    def _weights(self) -> tuple[FloatArray, FloatArray]:
        """Readings from nodes, shape (m, p), and from boundaries, shape (k, p)."""
        shown = (*self.nodes, *self.readings)
        weights = [{name: 1.0} for name in self.nodes] + [dict(r) for r in self.readings.values()]
        known = {*self.nodes, *self.boundary}
        for name, reading in zip(shown, weights):
            for source in reading:
                if source not in known:
                    raise InputError(f"thermal plant: '{name}' reads '{source}', which is not in the network")
        table = [[reading.get(name, 0.0) for reading in weights] for name in (*self.nodes, *self.boundary)]
        whole = np.array(table).reshape(len(self.nodes) + len(self.boundary), len(shown))
        return whole[: len(self.nodes)].copy(), whole[len(self.nodes) :].copy()

    def ramp_lags_s(self) -> dict[str, float]:
        """How far each temperature is behind the boundaries in a steady ramp of all of them [s].

        ``K L = C``: each node takes up its share of the heat that flows in.
        """
        return self._steady(np.array(list(self.capacities.values())))

    def steady_rises(self) -> dict[str, float]:
        """How far each temperature is above the boundaries per watt of self-heating [degC/W]."""
        return self._steady(self._heated)

    @cached_property
    def _heated(self) -> FloatArray:
        """Share of the heat that each node takes; one that is read from others heats those."""
        where = self.readings.get(self.heating.node, {self.heating.node: 1.0})
        return np.array([where.get(name, 0.0) for name in self.nodes])

    def _steady(self, flow: FloatArray) -> dict[str, float]:
        """Temperatures above the boundaries that carry a flow into each node away."""
        values = np.linalg.solve(self.matrices()[0], flow) @ self._weights[0]
        solved = zip((*self.nodes, *self.readings), values.tolist())
        return dict.fromkeys(self.boundary, 0.0) | dict(solved)

    def held_at(self, *names: str) -> ThermalNetwork:
        """The plant with nodes made boundaries, whose temperature must then be given."""
        capacities = {name: value for name, value in self.capacities.items() if name not in names}
        return replace(self, capacities=capacities)

    def with_heating(
        self, steady_w: float, initial_w: float | None = None, time_constant_s: float = 1200.0
    ) -> ThermalNetwork:
        """The plant with other self-heating; the same power throughout without `initial_w`."""
        first = steady_w if initial_w is None else initial_w
        return replace(self, heating=SelfHeating(steady_w, first, time_constant_s, self.heating.node))

    def with_airflow(self, fan_gain: float = 0.0, rotation_gain: float = 0.0) -> ThermalNetwork:
        """The plant with another dependence on fan and table rate."""
        return replace(self, airflow=Airflow(fan_gain, rotation_gain))
