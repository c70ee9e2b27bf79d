"""What a recording or a simulation offers to the effects: temperatures, rates, drives, facts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from fogml.arrays import FloatArray, IntArray
from fogml.errors import InputError
from fogml.runs.attitude import Attitude, attitude, earth_rate, turned
from fogml.runs.facts import Facts
from fogml.signals.averages import covered_share, mean_cosine, with_whole_turns
from fogml.twin.memory import Memory
from fogml.twin.optics import REFERENCE_COIL, Coil, Light

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
"""What a drive that is not recorded is taken to be, in the run format's units; ``dose`` is the absorbed
radiation [Gy]. Its effects then vanish or stay constant."""
STAND_INS = {
    "T": ("T_in",),
    "T_in": ("T",),
    "T_out": ("T",),
    "T_case": ("T_out", "T"),
    "T_electronics": ("T_case", "T_out", "T"),
    "T_hub": ("T_in", "T"),
    "T_chamber": ("T_case", "T_out", "T"),
    "T_plate": ("T_chamber", "T_case", "T_out", "T"),
    "T_top": ("T_out", "T"),
    "T_bottom": ("T_out", "T"),
    "T_leads": (),
}
"""The nearest places, nearest first, for one that neither recording nor plant gives.

The names are all those that an effect may ask for.
"""
LEAST_ALONG = 0.1
"""Share of the table's rate about the input axis that tells the table's own: less is mostly error."""
LEADS = {"T_electronics": 0.5, "T_case": 0.5}
"""Where the fibre's ends lie, ``T_leads``: half way from the electronics to the case."""


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
    power_offs_s
        When the unit went off before each of those [s]; long before where not given.
    drives
        Other recorded quantities by the run format's names, internal units, shape (n,).
    rate_window_s
        Window of rates [s]; 0 for neighbouring samples.
    whole_windows
        Whether DeltaT is over windows of whole samples, as in a diagnosis, and not over 64 s.
    seed
        Of what effects draw anew in each simulation; None in a replay, which does not know it.
    angle_begins_anew
        Whether the recorded angle may begin anew after a turn.
    hindsight
        Whether these are all samples of a recording, so that a rate may look ahead as far as back.
    coil, light
        The unit's coil, for what follows from its optics, and its light at the receiver.
    epoch_s
        Where `time` begins, after the unit's first run began [s].
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
    power_offs_s: tuple[float, ...] = ()
    drives: Mapping[str, FloatArray] = field(default_factory=dict)
    sensors: Mapping[str, Sequence[FloatArray]] = field(default_factory=dict)
    rate_window_s: float = 64.0
    whole_windows: bool = False
    seed: int | None = None
    angle_begins_anew: bool = False
    hindsight: bool = False
    coil: Coil = REFERENCE_COIL
    light: Light = field(default_factory=Light)
    epoch_s: float = 0.0
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
        if name == "T_leads" and self.temperatures:
            return np.asarray(sum(weight * self.temperature(end) for end, weight in LEADS.items()))
        held = ", ".join(self.temperatures) or "none"
        raise InputError(
            f"no temperature '{name}' is recorded or given by the plant; there is {held}: call the column "
            "that measures it so, or 'T [degC]' where there is one alone"
        )

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
        if name == "T_leads" and self.place(name) is None:
            return np.asarray(sum(weight * self.dT(end) for end, weight in LEADS.items()))
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
        from fogml.signals.smoothing import centred_rate

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
            along = abs(self.attitude.along)
            rate = self.table_rate / along if along > LEAST_ALONG else self.table_rate
            mean = 0.5 * (rate + self.memory.previous("angle rate", rate))
            self.cache["angle"] = self.memory.total("angle", self._step_s * mean)
        return self.cache["angle"]

    @property
    def _step_s(self) -> FloatArray:
        """Time since the sample before [s], shape (n,); 0 at the first one."""
        if "step" not in self.cache:
            self.cache["step"] = self.time - self.memory.previous("step time", self.time)
        return self.cache["step"]

    @property
    def turned_deg(self) -> FloatArray:
        """How far the table turned since the sample before [deg], shape (n,), in the sense of its angle.

        Of a recorded angle that begins anew after a turn the whole turns follow from the table's rate; where
        the rate about the input axis does not tell the table's, from the shorter way.
        """
        if "turned" not in self.cache:
            angle = self.angle_deg
            turned = angle - self.memory.previous("turned angle", angle)
            along = abs(self.attitude.along)
            if along > LEAST_ALONG:
                turned = with_whole_turns(turned, self._step_s * self.table_rate / along)
            elif self.angle_begins_anew:
                turned = with_whole_turns(turned, np.zeros(len(turned)))
            self.cache["turned"] = turned
        return self.cache["turned"]

    @property
    def turning_deg_s(self) -> FloatArray:
        """Rate of the table about its own axis [deg/s], shape (n,).

        From the rate about the input axis where that has a share in it, else from the recorded angle.
        """
        held = self.attitude
        if abs(held.along) > LEAST_ALONG:
            return self.table_rate if held.along == 1.0 else self.table_rate / held.along
        if "angle" not in self.drives:
            return np.zeros(len(self))
        still = np.zeros(len(self))
        return np.divide(held.sense * self.turned_deg, self._step_s, out=still, where=self._step_s > 0.0)

    @property
    def attitude(self) -> Attitude:
        """How the gyro lies on its table."""
        return attitude(self.facts)

    def table_cosine(self, phase_deg: float, harmonic: float = 1.0) -> FloatArray:
        """cos(harmonic * table angle + phase), as the mean over each sample; shape (n,)."""
        turned = self.turned_deg * covered_share(self._step_s)
        moves = turned.any()
        after = np.radians(harmonic * (self.angle_deg if moves else self.angle_deg[:1]) + phase_deg)
        if not moves:
            return np.repeat(np.cos(after), len(self))
        return mean_cosine(after - np.radians(harmonic * turned), after)

    def carried(self, fixed: FloatArray, vector: FloatArray, *, mean: bool = True) -> FloatArray | float:
        """A fixed vector along one that turns with the table; shape (n,).

        Both of shape (3,), to north, west and up, the second at table angle 0; one number where the table
        does not change it. As the mean over each sample, or at the samples.
        """
        held = self.attitude
        constant, cosine, sine = turned(fixed, vector, held.table)
        if cosine == 0.0 and sine == 0.0:
            return constant
        phase = -held.sense * float(np.degrees(np.arctan2(sine, cosine)))
        turning = self.table_cosine(phase) if mean else np.cos(np.radians(self.angle_deg + phase))
        return np.asarray(constant + np.hypot(cosine, sine) * turning)

    @cached_property
    def time_on_s(self) -> FloatArray:
        """Time since the latest power-on [s], at least 0; infinite where it was long before; shape (n,)."""
        starts = np.array([self.powered_on_s, *self.power_ons_s])
        return np.maximum(self.time - starts[self.power_cycle], 0.0)

    def unwarmed(self, time_constant: float) -> FloatArray:
        """Share of a warm-up with this time constant [s] that is still to come, shape (n,).

        It fades from 1 while the unit is on, and comes back as fast while it is off: a unit that was off for
        a moment has hardly cooled.
        """
        starts, cold = (self.powered_on_s, *self.power_ons_s), [1.0]
        for on, off, following in zip(starts, self.power_offs_s, starts[1:]):
            left = cold[-1] * math.exp(-(off - on) / time_constant)
            cold.append(1.0 + (left - 1.0) * math.exp(-(following - off) / time_constant))
        cold += [1.0] * (len(starts) - len(cold))
        return np.asarray(np.array(cold)[self.power_cycle] * np.exp(-self.time_on_s / time_constant))

    @cached_property
    def power_cycle(self) -> IntArray:
        """How many power-ons came after the first one, shape (n,)."""
        return np.searchsorted(np.array(self.power_ons_s), self.time, side="right")

    @property
    def input_rate_deg_h(self) -> FloatArray:
        """Rate about the input axis [deg/h]: table, and Earth where the table has turned the axis; (n,)."""
        if "input rate" not in self.cache:
            self.cache["input rate"] = 3600.0 * self.table_rate + self._earth_along_deg_h
        return self.cache["input rate"]

    @property
    def _earth_along_deg_h(self) -> FloatArray | float:
        told = self.facts.earth_rate_deg_h is not None and "angle" in self.drives
        if not told or self.attitude.fixed:
            return self.earth_deg_h
        return self.carried(earth_rate(self.facts), self.attitude.z, mean=False)

    def afresh(self) -> Inputs:
        """The same whole run with nothing remembered, for another signature on it.

        What depends on these samples alone, such as rates of temperature, is kept.
        """
        return replace(self, memory=Memory())

    @property
    def met_output(self) -> FloatArray:
        """The output that an effect meets [deg/h], shape (n,); the input rate where none is given."""
        return self.input_rate_deg_h if self.output is None else self.output

    def with_output(self, output: FloatArray) -> Inputs:
        """The same inputs with the output that an effect meets [deg/h], shape (n,)."""
        return replace(self, output=output)
