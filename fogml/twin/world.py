"""The world of a simulation: chamber, plant, surroundings, gyro and sensors on one clock, block by block."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fogml.errors import InputError
from fogml.runs.facts import Facts
from fogml.runs.run import FloatArray
from fogml.twin.attitude import attitude, earth_field
from fogml.twin.chain import ChainOutput, hidden, logged, sensed, sensor_shares, through_chain
from fogml.twin.inputs import REST, Inputs
from fogml.twin.memory import Memory
from fogml.twin.noise import Streams
from fogml.twin.plant.network import AIR, PlantState
from fogml.twin.programme import Programme
from fogml.twin.random_errors import RandomErrors
from fogml.twin.timeline import TimelineBlock, timeline
from fogml.twin.twin import Twin

_ALL_DRIVES = (
    "angle",
    "power",
    "supply",
    "humidity",
    "dose",
    "vibration",
    "compressor",
    "heater",
    "fan",
    "B_x",
    "B_y",
    "B_z",
)


@dataclass(frozen=True, eq=False)
class Samples:
    """Recorded samples of a block: what acts on the gyro, and the noise that comes on top [deg/h].

    `random` holds each random effect's part of the noise, where contributions are asked for, and
    `without`, for each thermal effect, the inputs as they would be without it.
    """

    inputs: Inputs
    noise: FloatArray
    random: dict[str, FloatArray]
    without: dict[str, Inputs]


class _Branch:
    """Plant and chain of one twin, with what they remember."""

    def __init__(self, twin: Twin) -> None:
        self.twin = twin
        self.network = twin.network
        self.state = PlantState()
        self.chamber_memory, self.memory = Memory(), Memory()

    def nodes(self, block: TimelineBlock, drives: dict[str, FloatArray]) -> dict[str, FloatArray]:
        """Temperature of every node at all samples of the block, on or off."""
        chamber = block.set_point
        for declared, setting in self.twin.thermal:
            inputs = Inputs(
                block.time, {AIR: chamber}, block.table_rate, drives=drives, memory=self.chamber_memory
            )
            chamber = declared.change_chamber(chamber, inputs, setting.amplitude, **setting.shape)
        return self.network.temperatures(
            block.time,
            chamber,
            powered=block.timeline.power_windows,
            fan=block.fan,
            table_rate=block.table_rate,
            state=self.state,
        )


class World:
    """Everything that a simulation remembers from block to block.

    Parameters
    ----------
    programme, twin, sample_s, seed
        What is simulated.
    columns
        What is recorded beside time and gyro.
    facts
        Set-up facts; power-on is added.
    truth
        Whether contributions are asked for.
    """

    def __init__(
        self,
        programme: Programme,
        twin: Twin,
        sample_s: float,
        seed: int,
        columns: tuple[str, ...],
        facts: Facts,
        truth: bool,
    ) -> None:
        self.timeline = timeline(programme, sample_s)
        self.twin, self.columns, self.truth = twin, columns, truth
        self._seed = seed
        ons = [on for on, _ in self.timeline.power_windows]
        self._power_ons = ons or [math.inf]
        first = self._power_ons[0]
        self.facts = facts.model_copy(update={"powered_on": first if math.isfinite(first) else None})
        self._main = _Branch(twin)
        self._without = {}
        if truth:
            thermal = [declared.id for declared, _ in twin.thermal if not hidden(declared)]
            self._without = {id: _Branch(twin.without_effect(id)) for id in thermal}
        self._drives = self._needed_drives()
        self._noise = RandomErrors(twin, seed, len(self.timeline), sample_s, apart=truth)
        self._sensor_rng = Streams(seed, "sensor")
        self._sensor_memory, self._share_memory = Memory(), Memory()
        self._log_memory, self._free_memory = Memory(), Memory()
        self._check_sensors()

    @property
    def power_cycles(self) -> bool:
        """Whether the unit is switched on more than once."""
        return len(self._power_ons) > 1

    def samples(self, block_rows: int) -> Iterator[Samples]:
        """What acts on the gyro at all samples in which it is on, block by block."""
        for block in self.timeline.blocks(block_rows):
            yield self._samples(block)

    def output(self, samples: Samples) -> ChainOutput:
        """The chain's output for the next block."""
        return through_chain(self.twin, samples.inputs, samples.inputs, contributions=self.truth)

    def logged(self, samples: Samples, output: FloatArray) -> FloatArray:
        """The output as recorded."""
        return logged(self.twin, output, replace(samples.inputs, memory=self._log_memory)).output

    def noise_free(self, samples: Samples, output: FloatArray) -> ChainOutput:
        """The output as it would be recorded without noise, and what each logger effect changes in it."""
        return logged(self.twin, output, replace(samples.inputs, memory=self._free_memory))

    def sensed(self, name: str, samples: Samples) -> FloatArray:
        """What the sensor behind a temperature column records."""
        inputs = replace(samples.inputs, memory=self._sensor_memory)
        place = self.twin.sensors.place(name)
        if len(place) == 1:
            temperature = inputs.temperature(next(iter(place)))
        else:
            temperature = sum(
                (weight * inputs.temperature(node) for node, weight in place.items()), np.zeros(len(inputs))
            )
        return sensed(self.twin, name, temperature, inputs, self._sensor_rng)

    def other_contributions(self, samples: Samples, output: FloatArray) -> dict[str, FloatArray]:
        """Contributions of the effects that are neither in the chain nor of the logger [deg/h]."""
        parts = dict(samples.random)
        for id, inputs in samples.without.items():
            parts[id] = output - through_chain(self._without[id].twin, inputs, inputs).output
        return parts | sensor_shares(
            self.twin, replace(samples.inputs, memory=self._share_memory).with_output(output)
        )

    def _samples(self, block: TimelineBlock) -> Samples:
        facts = self.facts
        held = attitude(facts)
        # Both about the input axis, as a run records them.
        rate = block.table_rate if held.along == 1.0 else held.along * block.table_rate
        drives = self._block_drives(block, held.sense * (block.angle + block.yaw))
        on = block.powered > 0.0
        rows = slice(None) if on.all() else on
        drives_on = {name: values[rows] for name, values in drives.items()}

        def inputs(branch: _Branch) -> Inputs:
            nodes = branch.nodes(block, drives)
            return Inputs(
                time=block.time[rows],
                temperatures={name: values[rows] for name, values in nodes.items()},
                table_rate=rate[rows],
                earth_deg_h=facts.earth_rate_deg_h or 0.0,
                facts=facts,
                powered_on_s=self._power_ons[0],
                power_ons_s=tuple(self._power_ons[1:]),
                drives=drives_on,
                coil=branch.twin.coil,
                seed=self._seed,
                rate_window_s=0.0,
                memory=branch.memory,
            )

        without = {id: inputs(branch) for id, branch in self._without.items()}
        given = inputs(self._main)
        noise, random = self._noise.block(len(block), rows, given)
        return Samples(given, noise, random, without)

    def _needed_drives(self) -> set[str]:
        """Drives that are recorded, or that an effect reads; all of them for the truth."""
        if self.truth:
            return set(_ALL_DRIVES)
        needed = {need for declared, _ in self.twin.on for need in declared.needs}
        return needed | set(self.columns)

    def _block_drives(self, block: TimelineBlock, angle: FloatArray) -> dict[str, FloatArray]:
        outside, needed = self.twin.surroundings, self._drives
        drives = {"angle": angle, "fan": block.fan}
        if needed & {"compressor", "vibration"}:
            drives["compressor"] = block.compressor
        if "vibration" in needed:
            # Independent sources add in squares; one on for a share of the time has that share of its square.
            shaken = drives["compressor"] * outside.compressor_vibration**2
            drives["vibration"] = np.sqrt(outside.vibration**2 + shaken)
        if "heater" in needed:
            drives["heater"] = block.heater
        if "humidity" in needed:
            drives["humidity"] = block.humidity
        if "dose" in needed:
            drives["dose"] = block.dose
        if "supply" in needed:
            drives["supply"] = np.full(len(block), outside.supply)
        if "power" in needed:
            drives["power"] = self._main.network.heating.power(block.time, self.timeline.power_windows)
        if needed & {"B_x", "B_y", "B_z"}:
            drives |= earth_field(self.facts, angle, outside.horizontal_field, outside.vertical_field)
        return drives

    def _check_sensors(self) -> None:
        known = {*self._main.network.names, "T"}
        for name in self.columns:
            if name in REST or name in ("rate", "angle"):
                continue
            for node in self.twin.sensors.place(name):
                if node not in known:
                    raise InputError(
                        f"columns: '{name}' reads '{node}', which the plant does not have; "
                        f"it has {', '.join(sorted(known))}"
                    )
