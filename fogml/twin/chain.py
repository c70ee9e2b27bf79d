"""The gyro's chain: rig, bias, scale factor, loop, read-out; and the random errors that are added to it.

::

    w_ia = 3600 rate + earth + sum of rig effects
    out  = (1 + 1e-6 s) w_ia + b,     s, b: nominal plus scale factor and bias effects
    out  = read-out effects of loop effects of out

in the order of the catalogue. Noise is added to that, then comes the logger.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np

from fogml.arrays import FloatArray
from fogml.runs.steps import to_steps
from fogml.twin.effect import (
    BiasEffect,
    Effect,
    LoopEffect,
    NoiseEffect,
    ReadoutEffect,
    RigEffect,
    ScaleFactorEffect,
    SensorEffect,
    ThermalEffect,
)
from fogml.twin.inputs import Inputs
from fogml.twin.memory import Memory
from fogml.twin.noise import TERM_EFFECTS, NoiseConstants, NoiseSource, stream
from fogml.twin.nominal import bias_deg_h, scale_factor_ppm, temperature_slopes
from fogml.twin.plant.heat import PowerWindows
from fogml.twin.plant.network import AIR, PlantState
from fogml.twin.timeline import TimelineBlock
from fogml.twin.twin import EffectSetting, Twin

Signature = Callable[[Effect, EffectSetting, Inputs], FloatArray]
"""Gives the signature of an effect on inputs; a replay keeps those that it has."""


@dataclass(frozen=True, eq=False)
class ChainOutput:
    """What the chain gives over n samples.

    Attributes
    ----------
    output
        The gyro's output before noise and logger [deg/h], shape (n,).
    contributions
        Part of the output that each effect asked for makes up [deg/h], each of shape (n,), and ``nominal``
        for what no effect makes up; all of them add to `output`.
    """

    output: FloatArray
    contributions: Mapping[str, FloatArray]


def plain_signature(declared: Effect, setting: EffectSetting, inputs: Inputs) -> FloatArray:
    """The signature, worked out on the spot."""
    return declared.signature(inputs, **setting.shape)


def through_chain(
    twin: Twin,
    inputs: Inputs,
    nominal_inputs: Inputs,
    *,
    signature: Signature = plain_signature,
    contributions: Collection[str] = (),
    trusting: bool = False,
) -> ChainOutput:
    """The gyro's output for inputs, whole or block by block with the same memory.

    Parameters
    ----------
    twin
        The twin.
    inputs
        What effects read.
    nominal_inputs
        What the nominal gyro reads: the same, or recorded temperatures alone.
    signature
        Where signatures come from.
    contributions
        Effects, and ``nominal``, whose part is kept.
    trusting
        Whether the temperatures are measured ones: what sensors falsify or don't show is then added
        to first order.
    """
    parts: dict[str, FloatArray] = {}
    rate = inputs.input_rate_deg_h
    scale = 1.0 + 1e-6 * scale_factor_ppm(nominal_inputs, twin.nominal)
    bias = bias_deg_h(nominal_inputs, twin.nominal)
    if "nominal" in contributions:
        parts["nominal"] = scale * rate + bias
    rig: dict[str, FloatArray] = {}
    table_rate = rate
    for declared, setting in twin.on:
        if isinstance(declared, RigEffect):
            small = signature(declared, setting, inputs)
            turned = declared.added_rate(small, inputs, setting.amplitude, **setting.shape)
            rate = rate + turned
            if declared.id in contributions:
                rig[declared.id] = turned
        elif isinstance(declared, ScaleFactorEffect):
            ppm = setting.amplitude * signature(declared, setting, inputs)
            scale += 1e-6 * ppm
            if declared.id in contributions:
                parts[declared.id] = 1e-6 * ppm * table_rate
        elif _adds(declared):
            added = setting.amplitude * signature(declared, setting, inputs)
            bias += added
            if declared.id in contributions:
                parts[declared.id] = added
    parts |= {id: scale * turned for id, turned in rig.items()}
    output = scale * rate
    output += bias
    if trusting:
        output += _unseen(twin, inputs, nominal_inputs, signature)
    for kind in (LoopEffect, ReadoutEffect):
        for declared, setting in twin.on:
            if isinstance(declared, LoopEffect) and isinstance(declared, ReadoutEffect) == (
                kind is ReadoutEffect
            ):
                before = output
                output = declared.apply(output, inputs, setting.amplitude, **setting.shape)
                if declared.id in contributions:
                    parts[declared.id] = output - before
    return ChainOutput(output, parts)


def _adds(declared: Effect) -> bool:
    """Whether an effect adds its signature to the bias."""
    if isinstance(declared, NoiseEffect):
        return declared.steady
    return isinstance(declared, BiasEffect) or (isinstance(declared, ThermalEffect) and hidden(declared))


def hidden(declared: ThermalEffect) -> bool:
    """Whether a thermal effect acts on the bias by itself, and not by way of the plant's nodes."""
    kind = type(declared)
    return (
        kind.change_chamber is ThermalEffect.change_chamber
        and kind.change_plant is ThermalEffect.change_plant
    )


def _unseen(twin: Twin, inputs: Inputs, nominal_inputs: Inputs, signature: Signature) -> FloatArray:
    """What sensors falsify, and what the plant does that they don't show [deg/h], to first order."""
    total = np.zeros(len(inputs))
    slopes: Mapping[str, FloatArray] | None = None
    for declared, setting in twin.on:
        if isinstance(declared, SensorEffect) or (
            isinstance(declared, ThermalEffect) and not hidden(declared)
        ):
            if slopes is None:
                slopes = temperature_slopes(nominal_inputs, twin.nominal)
            given = replace(inputs, slopes=slopes)
            amplitude = setting.amplitude
            if isinstance(declared, SensorEffect):
                amplitude = declared.replayed_amplitude(amplitude)
            total += amplitude * signature(declared, setting, given)
    return total


def sensor_shares(twin: Twin, inputs: Inputs) -> dict[str, FloatArray]:
    """What a replay that trusts the sensors lacks for each sensor effect [deg/h], to first order."""
    found = twin.falsifying
    if not found:
        return {}
    given = replace(inputs, slopes=temperature_slopes(inputs, twin.nominal))
    return {d.id: s.amplitude * d.signature(given, **s.shape) for d, s in found}


def sensed(
    twin: Twin, name: str, temperature: FloatArray, inputs: Inputs, rng: Mapping[str, np.random.Generator]
) -> FloatArray:
    """What the sensor behind column `name` records [degC] at a place with `temperature`, shape (n,).

    `rng` holds the generator of its noise by that name.
    """
    temperature = _falsified(twin, name, temperature, inputs, digitising=False)
    errors = twin.sensors.of(name)
    if errors.lag > 0.0:
        temperature = inputs.memory.lag(f"sensor {name}", inputs.time, temperature, errors.lag)
    if errors.noise > 0.0:
        temperature = temperature + errors.noise * rng[name].standard_normal(len(temperature))
    if errors.resolution > 0.0:
        temperature = to_steps(temperature, errors.resolution)
    return _falsified(twin, name, temperature, inputs, digitising=True)


def _falsified(
    twin: Twin, name: str, temperature: FloatArray, inputs: Inputs, *, digitising: bool
) -> FloatArray:
    for declared, setting in twin.falsifying:
        if declared.digitises == digitising:
            temperature = declared.sense(name, temperature, inputs, setting.amplitude, **setting.shape)
    return temperature


def fresh(inputs: Inputs) -> Inputs:
    """The same samples with no memory of others and nothing worked out yet."""
    return replace(inputs, memory=Memory(), cache={})


class Branch:
    """Plant and chain of one twin, with what they remember."""

    def __init__(self, twin: Twin) -> None:
        self.twin = twin
        self.network = twin.network
        self.state = PlantState()
        self.chamber_memory, self.memory = Memory(), Memory()

    def go_on_from(self, before: Branch) -> None:
        """Take over the states that another run of the same unit left."""
        left = before.state, before.chamber_memory, before.memory
        self.state, self.chamber_memory, self.memory = deepcopy(left)

    def nodes(
        self, block: TimelineBlock, drives: dict[str, FloatArray], clock_s: float, windows: PowerWindows
    ) -> dict[str, FloatArray]:
        """Temperature of every node at all samples of the block, on or off."""
        chamber, time = block.set_point, clock_s + block.time
        for declared, setting in self.twin.thermal:
            inputs = Inputs(time, {AIR: chamber}, block.table_rate, drives=drives, memory=self.chamber_memory)
            chamber = declared.change_chamber(chamber, inputs, setting.amplitude, **setting.shape)
        return self.network.temperatures(
            time,
            chamber,
            powered=windows,
            fan=block.fan,
            table_rate=block.table_rate,
            state=self.state,
        )


class RandomErrors:
    """The noise of a simulation, block after block; each effect is a source of its own.

    Parameters
    ----------
    twin
        Whose noise terms and random effects they are.
    seed
        The same seed gives the same noise, whatever the blocks.
    count, sample_s
        Samples of the programme, and their interval [s].
    apart
        Whether to keep the part of each effect.
    """

    def __init__(self, twin: Twin, seed: int, count: int, sample_s: float, *, apart: bool) -> None:
        self._apart, self._passed = apart, 0
        self._own = NoiseSource(twin.noise, seed, sample_s)
        self._terms: dict[str, NoiseSource] = {}
        self._varying: list[tuple[NoiseEffect, EffectSetting, FloatArray]] = []
        self._steady: dict[str, FloatArray] = {}
        self._sum: FloatArray | None = None
        for declared, setting in twin.random:
            name = f"effect {declared.id}"
            if declared.id in TERM_EFFECTS:
                constants = NoiseConstants(**{TERM_EFFECTS[declared.id]: setting.amplitude})
                self._terms[declared.id] = NoiseSource(constants, seed, sample_s, name)
                continue
            drawn = declared.draw(stream(seed, name), count, sample_s, setting.amplitude, **setting.shape)
            if type(declared).strength is not NoiseEffect.strength:
                self._varying.append((declared, setting, drawn))
                continue
            if apart:
                self._steady[declared.id] = drawn
            # One record for all of them: long ones would fill the memory.
            self._sum = drawn.copy() if self._sum is None else np.add(self._sum, drawn, self._sum)

    def block(self, inputs: Inputs) -> tuple[FloatArray, dict[str, FloatArray]]:
        """The noise over the next block [deg/h], and each random effect's part of it."""
        count = len(inputs)
        noise = self._own.block(count)
        rows = slice(self._passed, self._passed + count)
        self._passed += count
        parts: dict[str, FloatArray] = {}
        for id, source in self._terms.items():
            parts[id] = source.block(count)
        for declared, setting, drawn in self._varying:
            parts[declared.id] = drawn[rows] * declared.strength(inputs, **setting.shape)
        for part in parts.values():
            noise += part
        if self._sum is not None:
            noise += self._sum[rows]
        if not self._apart:
            return noise, {}
        return noise, parts | {id: drawn[rows] for id, drawn in self._steady.items()}
