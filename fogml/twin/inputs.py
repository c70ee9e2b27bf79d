"""What a recording or a simulation offers to the effects: temperatures, rates, drives, facts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.runs.facts import Facts
from fogml.runs.run import FloatArray
from fogml.twin.memory import Memory

REST = {
    "power": 0.0,
    "supply": 0.0,
    "humidity": 50.0,
    "vibration": 0.0,
    "compressor": 0.0,
    "heater": 0.0,
    "fan": 1.0,
    "B_x": 0.0,
    "B_y": 0.0,
    "B_z": 0.0,
    "shaking": 0.0,
    "dose": 0.0,
}
"""What a drive that is not recorded is taken to be; its effects then vanish or stay constant.

Units are the run format's; ``dose`` is the absorbed radiation dose [Gy].
"""
STAND_INS = {
    "T": ("T_in",),
    "T_in": ("T",),
    "T_out": ("T",),
    "T_case": ("T_out", "T"),
    "T_electronics": ("T_case", "T_out", "T"),
    "T_hub": ("T_in", "T"),
    "T_chamber": ("T_case", "T_out", "T"),
    "T_plate": ("T_chamber", "T_case", "T_out", "T"),
    "T_leads": (),
}
"""The nearest places, nearest first, for one that neither recording nor plant gives.

The names are all those that an effect may ask for; ``T_leads`` are the fibre's ends.
"""


@dataclass(frozen=True, eq=False)
class Inputs:
    """Everything an effect may ask for, over n samples.

    Attributes
    ----------
    time
        Time [s], shape (n,).
    temperatures
        Node or sensor name of the run format (``T_in``, ``T_out``, ``T_case``,
        ``T_electronics``, ``T_chamber`` and the twin's ``T_hub``, ``T_plate``) to degC, shape (n,).
    sensors
        Readings that a temperature is the mean of, where it is one of several, shape (n,) each [degC].
    table_rate
        Table rate about the input axis [deg/s], shape (n,).
    earth_deg_h
        Earth rate along the input axis [deg/h].
    facts
        Set-up facts.
    powered_on_s
        Power-on on the clock of `time` [s]; minus infinity where it was long before.
    power_ons_s
        Later power-ons on the same clock [s], in time order.
    drives
        Other recorded quantities by the run format's names, internal units, shape (n,).
    rate_window_s
        Window of rates [s]; 0 for neighbouring samples.
    hindsight
        Whether these are all samples of a recording, so that a rate may look ahead as far as back.
    output
        The output that the effect meets [deg/h], shape (n,); for loop, sensor and logger effects.
    slopes
        Change of the nominal output with each temperature [deg/h/degC], shape (n,).
    memory
        States that go on from block to block.
    cache
        What was worked out for these samples from `memory`, which may be asked once a block.
    """

    time: FloatArray
    temperatures: Mapping[str, FloatArray]
    table_rate: FloatArray
    earth_deg_h: float = 0.0
    facts: Facts = field(default_factory=Facts)
    powered_on_s: float = -np.inf
    power_ons_s: tuple[float, ...] = ()
    drives: Mapping[str, FloatArray] = field(default_factory=dict)
    sensors: Mapping[str, Sequence[FloatArray]] = field(default_factory=dict)
    rate_window_s: float = 64.0
    hindsight: bool = False
    output: FloatArray | None = None
    slopes: Mapping[str, FloatArray] = field(default_factory=dict)
    memory: Memory = field(default_factory=Memory)
    cache: dict[str, FloatArray] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.time)

    def temperature(self, name: str = "T") -> FloatArray:
        """A temperature [degC], shape (n,); by `STAND_INS` where neither recording nor plant gives it.

        What depends on the difference of two places that stand in for each other then vanishes.

        Raises
        ------
        InputError
            If there is no stand-in either.
        """
        place = self.place(name)
        if place is not None:
            return self.temperatures[place]
        held = ", ".join(self.temperatures) or "none"
        raise InputError(f"no temperature '{name}' is recorded or given by the plant; there is {held}")

    def readings(self, name: str = "T") -> Sequence[FloatArray]:
        """The readings that `temperature` is the mean of, shape (n,) each [degC]."""
        return self.sensors.get(self.place(name) or "", ()) or (self.temperature(name),)

    def place(self, name: str) -> str | None:
        """The temperature that `name` is read from: itself, or its nearest stand-in, or None."""
        return next((x for x in (name, *STAND_INS.get(name, ())) if x in self.temperatures), None)

    def u(self, name: str = "T") -> FloatArray:
        """Temperature less 25 degC, shape (n,)."""
        return self.temperature(name) - 25.0

    def dT(self, name: str = "T") -> FloatArray:
        """Rate of a temperature [degC/min], shape (n,)."""
        key = f"dT({self.place(name)})"
        if key not in self.cache:
            self.cache[key] = self.rate_per_minute(key, self.temperature(name))
        return self.cache[key]

    def rate_per_minute(self, key: str, values: FloatArray) -> FloatArray:
        """Rate of anything that was recorded, shape (n,); `key` names it in `memory`.

        From windows before each sample, or with `hindsight` about it: those before tell the rate of a
        window ago.
        """
        if not self.hindsight:
            return self.memory.rate(key, self.time, values, self.rate_window_s)
        from fogml.signals.centred_rate import centred_rate

        return 60.0 * centred_rate(self.time, values, self.rate_window_s)

    @cached_property
    def gradient(self) -> FloatArray:
        """T_out - T_in [degC], shape (n,)."""
        return self.temperature("T_out") - self.temperature("T_in")

    def drive(self, name: str) -> FloatArray:
        """A drive by its name, shape (n,); its rest value where it is not recorded."""
        return self.drives[name] if name in self.drives else np.full(len(self), REST[name])

    @property
    def angle_deg(self) -> FloatArray:
        """Table angle [deg], shape (n,); the integral of the table rate where not recorded."""
        if "angle" in self.drives:
            return self.drives["angle"]
        if "angle" not in self.cache:
            step = self.time - self.memory.previous("angle time", self.time)
            self.cache["angle"] = self.memory.total("angle", step * self.table_rate)
        return self.cache["angle"]

    @cached_property
    def time_on_s(self) -> FloatArray:
        """Time since the latest power-on [s], at least 0; infinite where it was long before; shape (n,)."""
        starts = np.array([self.powered_on_s, *self.power_ons_s])
        return np.maximum(self.time - starts[self.power_cycle], 0.0)

    @cached_property
    def power_cycle(self) -> NDArray[np.int64]:
        """How many power-ons came after the first one, shape (n,)."""
        return np.searchsorted(np.array(self.power_ons_s), self.time, side="right")

    @cached_property
    def input_rate_deg_h(self) -> FloatArray:
        """Rate about the input axis [deg/h]: table and Earth, shape (n,)."""
        return 3600.0 * self.table_rate + self.earth_deg_h

    def afresh(self) -> Inputs:
        """The same whole run with nothing remembered, for another signature on it.

        What depends on these samples alone, such as rates of temperature, is kept.
        """
        return replace(self, memory=Memory())

    def with_output(self, output: FloatArray) -> Inputs:
        """The same inputs with the output that an effect meets [deg/h], shape (n,)."""
        return replace(self, output=output)
