"""The world of a simulation: chamber, plant, surroundings, gyro and sensors on one clock, block by block."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import replace
from typing import Literal

import numpy as np

from fogml.arrays import BoolArray
from fogml.errors import InputError
from fogml.runs.attitude import attitude, earth_field
from fogml.runs.columns import is_temperature
from fogml.runs.facts import Facts
from fogml.runs.run import FloatArray
from fogml.twin.chain import (
    Branch,
    ChainOutput,
    RandomErrors,
    hidden,
    sensed,
    sensor_shares,
    through_chain,
)
from fogml.twin.inputs import REST, Inputs
from fogml.twin.memory import Memory
from fogml.twin.noise import Streams
from fogml.twin.plant.heat import PowerWindows
from fogml.twin.programme import Programme
from fogml.twin.recorder import Samples, Worked, recorded_output
from fogml.twin.replay_after import (
    START_SLACK,
    Storage,
    later_s,
    storage_drives,
    storage_times,
    stored_nodes,
    windows_with_history,
)
from fogml.twin.timeline import Timeline, TimelineBlock
from fogml.twin.twin import Twin
from fogml.twin.twin_file import twin_dict

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
    before, storage
        The unit's run before this one, which is over, and where the unit was between: states go on. All times
        are then those of the unit's clock, which began with its first run.
    """

    clock_s = 0.0
    """When the run starts on the unit's clock [s]."""
    _dose_before = 0.0

    def __init__(
        self,
        programme: Programme,
        twin: Twin,
        sample_s: float,
        seed: int,
        columns: tuple[str, ...],
        facts: Facts,
        truth: bool,
        before: World | None = None,
        storage: Storage | None = None,
    ) -> None:
        self.timeline = Timeline(programme, sample_s)
        self.twin, self.columns, self.truth = twin, columns, truth
        self._seed = seed
        self._first_facts: Facts = facts if before is None else before._first_facts
        self._windows: PowerWindows = self.timeline.power_windows
        # Times of power-on within this run; one long before counts as one.
        self._own_cycles = len(self._windows)
        storage = Storage() if storage is None else storage
        if before is not None:
            self.clock_s = later_s(facts, before._first_facts, programme.name)
            if self.clock_s < before.end_s - START_SLACK * sample_s:
                raise InputError(f"{programme.name}: it starts before the unit's run before it has ended")
            shifted = tuple((on + self.clock_s, off + self.clock_s) for on, off in self._windows)
            self._windows = windows_with_history(
                before._windows, shifted, self.clock_s, before.end_s, storage
            )
        own = self._windows[len(self._windows) - self._own_cycles :]
        first = own[0][0] - self.clock_s if own else math.inf
        since = self._first_facts.in_use_since or (self._first_facts.started if before else None)
        power_on = first if math.isfinite(first) else None
        self.facts = facts.model_copy(update={"powered_on": power_on, "in_use_since": since})
        self.counts_per_deg_h = twin.counts_per_deg_h(sample_s)
        self._main = Branch(twin)
        self._without = {}
        if truth:
            thermal = [declared.id for declared, _ in twin.thermal if not hidden(declared)]
            self._without = {id: Branch(twin.without_effect(id)) for id in thermal}
        self._drives = self._needed_drives()
        self._sensor_memory = Memory()
        if before is not None:
            self._go_on_from(before, storage)
        self._noise = RandomErrors(twin, seed, len(self.timeline), sample_s, apart=truth)
        self._sensor_rng = Streams(seed, "sensor")
        self._share_memory, self._log_memory, self._free_memory = Memory(), Memory(), Memory()
        self._acted: dict[str, bool] = {}
        self._check_sensors()

    @property
    def gyro_unit(self) -> Literal["deg/h", "count"]:
        """Unit in which the output is recorded."""
        return "deg/h" if self.counts_per_deg_h is None else "count"

    @property
    def power_cycles(self) -> bool:
        """Whether the unit is switched on more than once."""
        return self._own_cycles > 1

    @property
    def end_s(self) -> float:
        """When the run ends on the unit's clock [s]."""
        return self.clock_s + len(self.timeline) * self.timeline.sample_s

    @property
    def silent(self) -> tuple[str, ...]:
        """Effects that are on and changed nothing so far: exactly 0 at every sample.

        Of effects of the plant and the sensors and of random ones that is known where contributions are
        asked for.
        """
        return tuple(id for id in self.twin.settings if not self._acted.get(id, True))

    def _note(self, parts: Mapping[str, FloatArray], on: slice | BoolArray = slice(None)) -> None:
        """Keep in mind which contributions of a block are other than 0 where the unit is on."""
        for id, values in parts.items():
            self._acted[id] = self._acted.get(id, False) or bool(np.any(values[on]))

    def _go_on_from(self, before: World, storage: Storage) -> None:
        """Take over what the unit remembers of the run before, and what storage made of it."""
        if before.twin is not self.twin and twin_dict(before.twin) != twin_dict(self.twin):
            raise InputError(f"{self.timeline.programme.name}: runs of one unit have one twin")
        self._seed = before._seed
        self._main.go_on_from(before._main)
        if not self._without.keys() <= before._without.keys():
            # Begun afresh, the unit without an effect would differ by all that it remembers.
            raise InputError(
                f"{self.timeline.programme.name}: its truth follows from that of the unit's run before, "
                "which was not kept; ask for the truth of that run, too"
            )
        for id, branch in self._without.items():
            branch.go_on_from(before._without[id])
        self._sensor_memory = deepcopy(before._sensor_memory)
        ended = before.timeline.at(np.array([before.timeline.programme.total_s]))
        self._dose_before = before._dose_before + float(ended.dose[0])
        time = storage_times(before.end_s, self.clock_s)
        if not len(time):
            return
        acting = time[:-1]
        drives = storage_drives(acting, storage, before._last_drives)
        for branch in (self._main, *self._without.values()):
            nodes = stored_nodes(branch.network, time, storage, self._windows, branch.state)
            nodes = {name: values[:-1] for name, values in nodes.items()}
            inputs = self._inputs(branch, acting, nodes, np.zeros(len(acting)), drives)
            through_chain(branch.twin, inputs, inputs)
            if branch is self._main:
                for name in filter(is_temperature, self.columns):
                    self._sensed(name, inputs, Streams(self._seed, "storage"))

    def samples(self, block_rows: int) -> Iterator[Samples]:
        """What acts on the gyro at all samples, block by block."""
        for block in self.timeline.blocks(block_rows):
            yield self._samples(block)

    def output(self, samples: Samples) -> ChainOutput:
        """The chain's output for the next block, with contributions where they are asked for."""
        asked = [id for id in ("nominal", *self.twin.settings) if self.truth or not self._acted.get(id)]
        given = through_chain(self.twin, samples.inputs, samples.inputs, contributions=asked)
        self._note(given.contributions, samples.on)
        return given

    def logged(self, now: Worked, later: Worked | None) -> FloatArray:
        """The output as recorded, of the samples in which the unit is on."""
        given = recorded_output(self.twin, self._log_memory, now, later, noisy=True)
        self._note(given.contributions)
        return given.output

    def noise_free(self, now: Worked, later: Worked | None) -> ChainOutput:
        """The output as it would be recorded without noise, and what each logger effect changes in it."""
        return recorded_output(self.twin, self._free_memory, now, later, noisy=False)

    def sensed(self, name: str, samples: Samples) -> FloatArray:
        """What the sensor behind a temperature column records."""
        return self._sensed(name, samples.inputs, self._sensor_rng)

    def _sensed(self, name: str, inputs: Inputs, rng: Streams) -> FloatArray:
        inputs = replace(inputs, memory=self._sensor_memory)
        place = self.twin.sensors.place(name)
        if len(place) == 1:
            temperature = inputs.temperature(next(iter(place)))
        else:
            temperature = sum(
                (weight * inputs.temperature(node) for node, weight in place.items()), np.zeros(len(inputs))
            )
        return sensed(self.twin, name, temperature, inputs, rng)

    def other_contributions(self, samples: Samples, output: FloatArray) -> dict[str, FloatArray]:
        """Contributions of the effects that are neither in the chain nor of the logger [deg/h]."""
        parts = dict(samples.random)
        for id, inputs in samples.without.items():
            parts[id] = output - through_chain(self._without[id].twin, inputs, inputs).output
        parts |= sensor_shares(
            self.twin, replace(samples.inputs, memory=self._share_memory).with_output(output)
        )
        self._note(parts, samples.on)
        return parts

    def _samples(self, block: TimelineBlock) -> Samples:
        facts = self.facts
        held = attitude(facts)
        # Both about the input axis, as a run records them.
        rate = block.table_rate if held.along == 1.0 else held.along * block.table_rate
        drives = self._block_drives(block, held.sense * (block.angle + block.yaw))
        on = block.powered > 0.0
        if len(block):
            self._last_drives = {name: float(values[-1]) for name, values in drives.items()}

        def inputs(branch: Branch) -> Inputs:
            nodes = branch.nodes(block, drives, self.clock_s, self._windows)
            return self._inputs(branch, self.clock_s + block.time, nodes, rate, drives)

        without = {id: inputs(branch) for id, branch in self._without.items()}
        given = inputs(self._main)
        noise, random = self._noise.block(given)
        return Samples(given, slice(None) if on.all() else on, noise, random, without)

    def _inputs(
        self,
        branch: Branch,
        time: FloatArray,
        nodes: dict[str, FloatArray],
        rate: FloatArray,
        drives: dict[str, FloatArray],
    ) -> Inputs:
        """What acts on a branch's gyro at times of the unit's clock [s]."""
        ons = [on for on, _ in self._windows] or [math.inf]
        return Inputs(
            time=time,
            temperatures=nodes,
            table_rate=rate,
            earth_deg_h=self.facts.earth_rate_deg_h or 0.0,
            facts=self.facts,
            powered_on_s=ons[0],
            power_ons_s=tuple(ons[1:]),
            power_offs_s=tuple(off for _, off in self._windows[:-1]),
            drives=drives,
            coil=branch.twin.coil,
            light=branch.twin.light,
            epoch_s=self._first_facts.epoch_s,
            seed=self._seed,
            rate_window_s=0.0,
            memory=branch.memory,
        )

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
            drives["dose"] = self._dose_before + block.dose
        if "supply" in needed:
            drives["supply"] = np.full(len(block), outside.supply)
        if "power" in needed:
            drives["power"] = self._main.network.heating.power(self.clock_s + block.time, self._windows)
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
