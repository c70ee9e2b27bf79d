"""The twin with the inputs of one run: its replay, and the responses of candidates."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.gap.model import EffectValue
from fogml.gap.readings import USUAL_STEP_DEGC, smoothed
from fogml.gap.seen_as import line_response
from fogml.gap.shapes import AT_AMPLITUDE
from fogml.gap.twin_on_means import TwinOnMeans, shapes_to_compare
from fogml.runs.run import FloatArray, Run
from fogml.runs.steps import FINEST_STEP_DEGC, reading_noise, recorded_step
from fogml.twin.effect import Effect, NoiseEffect, SensorEffect
from fogml.twin.inputs import STAND_INS, Inputs
from fogml.twin.nominal import (
    DELTA,
    DELTA_WINDOW_S,
    NAMES,
    NominalConstants,
    nominal_columns,
    temperature_slopes,
)
from fogml.twin.plant.estimate import estimate_nodes
from fogml.twin.plant.line import RadialLine
from fogml.twin.plant.network import ThermalNetwork
from fogml.twin.registry import effect
from fogml.twin.replay import Replayer
from fogml.twin.set_up import Sensors
from fogml.twin.twin import Twin

LOW_ORDER = 4
"""Nodes of a plant of a lower order: case, two faces of the coil, electronics."""
STEPS = "sensor_quantisation"
USUAL_LAG_S = 0.7
"""Lag of a good sensor on the coil [s], as a standard deviation: part of any recording."""


def with_effects(twin: Twin, constants: Mapping[str, float], effects: tuple[EffectValue, ...]) -> Twin:
    """The twin with constants set and effects on."""
    changed = twin.with_nominal(**{name: float(value) for name, value in constants.items()})
    for value in effects:
        declared = effect(value.id)
        held = {
            q.name: _inside(value.shape[q.name], q.limits) for q in declared.shape if q.name in value.shape
        }
        amplitude = _inside(value.amplitude, declared.amplitude.limits)
        changed = changed.with_effect(value.id, amplitude, **held)
    return changed


def _inside(value: float, limits: tuple[float, float]) -> float:
    return float(np.clip(value, *limits))


class TwinOnRun:
    """The twin with what one run recorded; nodes that candidates ask for follow from the plant.

    Raises
    ------
    InputError
        If the run holds no temperature.
    """

    def __init__(self, twin: Twin, run: Run) -> None:
        if not run.temperature_columns:
            raise InputError(
                f"{run.name}: holds no temperature; a replay needs a column 'T [degC]' or 'T_in [degC]'"
            )
        self._twin, self._run = twin, run
        self._replayer = Replayer(run)
        self._recorded = replace(self._replayer.recorded, coil=twin.coil, light=twin.light)
        self._windows = self._replayer.windows
        self._missing = set(STAND_INS) - set(self._recorded.temperatures) - {"T"}
        nodes = self._nodes(twin.network)
        # Responses to rates of temperature would be blurred by the readings' noise.
        self._full = self._smooth(nodes)
        # What sensors do to readings is in the readings as they are.
        self._raw = replace(self._recorded, temperatures={**nodes, **self._recorded.temperatures}, cache={})
        self._outputs: dict[tuple[float, ...], tuple[FloatArray, Mapping[str, FloatArray]]] = {}

    def _nodes(self, network: ThermalNetwork) -> Mapping[str, FloatArray]:
        """Temperatures that were not recorded, by a plant."""
        if not self._missing:
            return {}
        return estimate_nodes(
            network,
            self._recorded.time,
            self._recorded.temperatures,
            powered=self._windows,
            fan=self._recorded.drives.get("fan"),
            table_rate=self._recorded.table_rate,
        )

    def _smooth(self, nodes: Mapping[str, FloatArray]) -> Inputs:
        held = {**nodes, **self._recorded.temperatures}
        smooth = {name: smoothed(self._run, t) for name, t in held.items()}
        return replace(self._recorded, temperatures=smooth, sensors={}, cache={})

    @cached_property
    def _quiet_replayer(self) -> Replayer:
        """Replays of temperatures without the noise of their readings."""
        smooth = self._full.temperatures
        return self._replayer.with_temperatures({name: smooth[name] for name in self._recorded.temperatures})

    @cached_property
    def _step_degC(self) -> float:
        """The coarsest steps that a temperature was recorded in."""
        held = self._recorded
        return max(recorded_step(t) for name in held.temperatures for t in held.readings(name))

    @cached_property
    def _others(self) -> list[Inputs]:
        """Inputs whose nodes follow from plants of other orders."""
        return [self._smooth(self._nodes(network)) for network in _other_networks(self._twin)]

    def columns(self) -> Mapping[str, FloatArray]:
        """Response to a unit of each nominal constant [deg/h], each of shape (n,)."""
        return nominal_columns(self._recorded.afresh())

    def output(self, constants: Mapping[str, float], effects: tuple[EffectValue, ...] = ()) -> FloatArray:
        """The replay [deg/h], shape (n,)."""
        return self._replayer.output(with_effects(self._twin, constants, effects))

    def response(self, id: str, shape: Mapping[str, float], constants: Mapping[str, float]) -> FloatArray:
        """Change of the output per unit of an effect's amplitude [deg/h], shape (n,)."""
        declared = effect(id)
        if id == "sinusoidal":
            return line_response(shape, self._recorded.time)
        if isinstance(declared, NoiseEffect):
            return declared.signature(self._recorded.afresh(), **shape)
        if isinstance(declared, SensorEffect) and declared.digitises and self._step_degC <= USUAL_STEP_DEGC:
            return np.zeros(len(self._recorded))
        if AT_AMPLITUDE in shape:
            about = EffectValue(
                id, shape[AT_AMPLITUDE], {k: v for k, v in shape.items() if k != AT_AMPLITUDE}
            )
            # The gyro itself does not know the readings' noise, which a difference would have twice.
            without, delayed = (with_effects(self._twin, constants, effects) for effects in ((), (about,)))
            changed = self._quiet_replayer.output(delayed) - self._quiet_replayer.output(without)
            return np.asarray(changed / about.amplitude)
        return self._responded(
            declared, shape, constants, self._raw if declared.stage == "sensor" else self._full
        )

    def other_orders(
        self, id: str, shape: Mapping[str, float], constants: Mapping[str, float]
    ) -> list[FloatArray]:
        """A candidate's response where nodes that were not recorded follow from other plants."""
        declared = effect(id)
        if isinstance(declared, NoiseEffect) or declared.stage == "sensor" or AT_AMPLITUDE in shape:
            return []
        if not self._missing & set(declared.needs):
            return []
        return [self._responded(declared, shape, constants, inputs) for inputs in self._others]

    def felt_within(
        self, id: str, shape: Mapping[str, float], constants: Mapping[str, float]
    ) -> FloatArray | None:
        """What a response changes by where T is that of the winding's middle, linear between its faces.

        Shape (n,) [deg/h per unit]; None for what does not go with T, and for errors of sensors and logger.
        """
        declared = effect(id)
        if isinstance(declared, NoiseEffect) or AT_AMPLITUDE in shape or "T" not in declared.needs:
            return None
        if declared.stage in ("sensor", "logger"):
            return None
        here, within = (self._responded(declared, shape, constants, x) for x in (self._full, self._within))
        return within - here

    @cached_property
    def _within(self) -> Inputs:
        """Inputs whose T is that of the middle between the faces of the winding."""
        middle = self._full.temperature("T") + 0.5 * self._full.gradient
        return replace(self._full, temperatures={**self._full.temperatures, "T": middle}, cache={})

    def depends_on_constants(self, id: str, shape: Mapping[str, float]) -> bool:
        """Whether a response is another one at other constants: where it goes with output or slopes."""
        return AT_AMPLITUDE in shape or self._meets_output(effect(id))

    def shapes_to_compare(self, id: str) -> tuple[Mapping[str, float], ...]:
        """Shapes at which a response on means has to agree with the full one; none where it can't."""
        return shapes_to_compare(effect(id), self._full, self._twin.grade)

    def on_means(self, starts: NDArray[np.intp]) -> TwinOnMeans:
        """Responses on block means of the inputs; blocks begin at `starts`."""
        return TwinOnMeans(self._full, starts)

    def _responded(
        self, declared: Effect, shape: Mapping[str, float], constants: Mapping[str, float], inputs: Inputs
    ) -> FloatArray:
        """An effect's response to inputs, with the output at the constants where it needs that."""
        met = self._met(constants, inputs) if self._meets_output(declared) else inputs.afresh()
        return np.asarray(declared.response(met, **shape), dtype=np.float64)

    def reading_noise(self, constants: Mapping[str, float]) -> FloatArray:
        """What the noise of the temperature readings makes of the replay, as a standard deviation.

        Shape (n,) [deg/h]; the readings' noise is told from their second differences, and from
        their least step.
        """
        held = self._recorded.temperatures
        return self._noise_through(lambda place: reading_noise(held[place]), constants)

    def noise_of_sensors(self, sensors: Sensors, constants: Mapping[str, float]) -> FloatArray:
        """The same of sensors with stated errors: their noise and their last digit."""

        def stated(place: str) -> float:
            errors = sensors.of(place)
            return math.hypot(errors.noise, errors.resolution / math.sqrt(12.0))

        return self._noise_through(stated, constants)

    def _noise_through(self, degC: Callable[[str], float], constants: Mapping[str, float]) -> FloatArray:
        """What noise of the readings at each place [degC] makes of the replay [deg/h], shape (n,)."""
        slopes = temperature_slopes(self._recorded.afresh(), NominalConstants(**dict(constants)))
        variance = np.zeros(len(self._recorded))
        for name, slope in slopes.items():
            place = self._recorded.place(name)
            if place is not None:
                variance += (slope * degC(place)) ** 2
        return np.sqrt(variance)

    def nuisances(self, constants: Mapping[str, float]) -> Mapping[str, FloatArray]:
        """What sensors of ordinary quality make of the replay [deg/h], shape (n,).

        Each is late by a little, and all read in whole steps.
        """
        inputs = self._recorded.afresh()
        slopes = temperature_slopes(inputs, NominalConstants(**dict(constants)))
        late = {}
        for name, slope in slopes.items():
            if name == DELTA or not np.any(slope):
                continue
            missed = USUAL_LAG_S / 60.0 * inputs.dT(name)
            late[f"lag of {name}"] = slope * missed
            if name == "T" and DELTA in slopes:
                change = inputs.memory.difference("nuisance", inputs.time, missed, DELTA_WINDOW_S)
                late[f"lag of {name}"] = late[f"lag of {name}"] + slopes[DELTA] * change
        if FINEST_STEP_DEGC <= self._step_degC <= USUAL_STEP_DEGC:
            hidden = effect(STEPS).response(replace(self._raw.afresh(), slopes=slopes))
            late["steps of the sensors"] = self._step_degC * hidden
        return late

    def _meets_output(self, declared: Effect) -> bool:
        return bool({"output", "slopes"} & set(declared.needs))

    def _met(self, constants: Mapping[str, float], inputs: Inputs) -> Inputs:
        """Inputs with the output and the slopes at given constants."""
        key = tuple(constants.get(name, 0.0) for name in NAMES)
        if key not in self._outputs:
            if len(self._outputs) > 4:
                self._outputs.clear()
            nominal = NominalConstants(**dict(constants))
            self._outputs[key] = (
                self.output(constants),
                temperature_slopes(self._recorded.afresh(), nominal),
            )
        output, slopes = self._outputs[key]
        return replace(inputs.afresh(), output=output, slopes=slopes)


def _other_networks(twin: Twin) -> list[ThermalNetwork]:
    """Plants of a lower order, and with a line of conduction in the coil, or without one."""
    plant = twin.plant
    others = (
        replace(plant, order=LOW_ORDER if plant.order != LOW_ORDER else plant.order + 1),
        replace(plant, line=RadialLine() if plant.line is None else None),
    )
    return [replace(twin, plant=other).network for other in others]
