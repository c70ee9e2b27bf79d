"""A programme on a clock: what chamber, table and power do at every sample."""

from __future__ import annotations

import math
import sys
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import islice

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError
from fogml.twin.plant.heat import PowerWindows
from fogml.twin.programme import Programme
from fogml.twin.schedule import Schedule
from fogml.twin.steps import Switched
from fogml.twin.table import Wave

ROOM_DEGC = 25.0
"""The room about the chamber: at this temperature it needs neither heater nor compressor."""
FULL_DUTY_DEGC = 100.0
"""Distance from the room that takes all of the chamber's power to hold [degC]."""
ROOM_HUMIDITY = 50.0
"""Relative humidity of the air that the chamber is closed with [%], at room temperature."""
_CLOCK_SLACK = 1e-6


@dataclass(frozen=True, eq=False)
class Timeline:
    """A programme on a regular clock that begins at 0; the last sample lies before its end.

    Attributes
    ----------
    programme
        The programme.
    sample_s
        Sample interval [s].

    Raises
    ------
    InputError
        If the sample interval is not above 0, or longer than the programme.
    """

    programme: Programme
    sample_s: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.sample_s) and 0.0 < self.sample_s <= self.programme.total_s):
            raise InputError(
                f"{self.programme.name}: 'sample_s' is {self.sample_s:g}; it lies above 0 and "
                f"within the programme's {self.programme.total_s:g} s"
            )
        # Beyond that a float does not tell one sample's time from the next one's.
        if self.programme.total_s / self.sample_s > 1.0 / sys.float_info.epsilon:
            raise InputError(
                f"{self.programme.name}: 'sample_s' is {self.sample_s:g}; the programme's "
                f"{self.programme.total_s:g} s hold more such samples than times can be told apart"
            )

        for wave in self.schedule.waves:
            if 2.0 * wave.frequency * self.sample_s >= 1.0:
                raise InputError(
                    f"{self.programme.name}: 'sample_s' is {self.sample_s:g}; an oscillation of "
                    f"{wave.frequency:g} Hz needs samples closer than {0.5 / wave.frequency:g} s"
                )

    def __len__(self) -> int:
        return math.ceil(self.programme.total_s / self.sample_s - _CLOCK_SLACK)

    @property
    def schedule(self) -> Schedule:
        """What happens when."""
        return self.programme.schedule

    @property
    def total_hours(self) -> float:
        """How long the programme lasts [h]."""
        return self.programme.total_hours

    @property
    def step_names(self) -> tuple[str, ...]:
        """The sentence of each step, repeats written out."""
        return self.schedule.step_names

    @cached_property
    def power_windows(self) -> PowerWindows:
        """When the unit is on, (from, to) [s]; infinite where before the beginning or after the end."""
        track = self.schedule.settings["power"]
        ends = [*track.times[1:], math.inf]
        windows: list[tuple[float, float]] = []
        for start, end, value in zip(track.times, ends, track.values):
            if value and windows and windows[-1][1] == start:
                windows[-1] = (windows[-1][0], end)
            elif value:
                windows.append((start, end))
        return tuple(windows)

    @cached_property
    def set_point_knots(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Times [s], set points [degC] and the rates from there on [degC/min]."""
        times, values = self.schedule.set_point.arrays
        return times, values, np.append(60.0 * np.diff(values) / np.diff(times), 0.0)

    @cached_property
    def table_knots(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Times [s], rates [deg/s], accelerations [deg/s^2] and angles [deg], from rest at 0 s on."""
        schedule = self.schedule
        times, rates = schedule.table_rate.arrays
        slopes = np.append(np.diff(rates) / np.diff(times), 0.0)[: len(times)]
        knots = (times, rates, slopes, np.asarray(schedule.table_angle.values))
        if len(times) == 0 or times[0] > 0.0:
            first, second, third, fourth = (np.append(0.0, values) for values in knots)
            return first, second, third, fourth
        return knots

    @property
    def short_rates(self) -> int:
        """Rates that the table holds for less than a sample, so that no sample may show them."""
        times, rates, _, _ = self.table_knots
        held = (rates[1:] == rates[:-1]) & (rates[1:] != 0.0)
        return int(np.count_nonzero(held & (np.diff(times) < self.sample_s)))

    def block(self, start: int, stop: int) -> TimelineBlock:
        """The samples from `start` to before `stop`."""
        time = np.arange(start, min(stop, len(self)), dtype=np.float64) * self.sample_s
        return TimelineBlock(self, time)

    def blocks(self, block_rows: int) -> Iterator[TimelineBlock]:
        """All samples, `block_rows` at a time, in bounded memory."""
        for start in range(0, len(self), block_rows):
            yield self.block(start, start + block_rows)

    @cached_property
    def whole(self) -> TimelineBlock:
        """All samples at once."""
        return self.block(0, len(self))

    def at(self, time: FloatArray) -> TimelineBlock:
        """The programme at times of one's own [s], ascending."""
        return TimelineBlock(self, np.asarray(time, dtype=np.float64))


@dataclass(frozen=True, eq=False)
class TimelineBlock:
    """Samples of a timeline; each quantity is worked out when it is first asked for.

    Attributes
    ----------
    timeline
        Where they come from.
    time
        Time [s], shape (n,), as all quantities below.
    """

    timeline: Timeline
    time: FloatArray

    def __len__(self) -> int:
        return len(self.time)

    @cached_property
    def set_point(self) -> FloatArray:
        """Set point of the chamber [degC]."""
        times, values, rates = self.timeline.set_point_knots
        return self._linear(times, values, rates / 60.0)

    @cached_property
    def set_rate(self) -> FloatArray:
        """Rate of the set point from each sample on [degC/min]."""
        times, _, rates = self.timeline.set_point_knots
        return self._hold(times, rates)

    @cached_property
    def table_rate(self) -> FloatArray:
        """Table rate [deg/s], with the table's acceleration."""
        times, rates, slopes, _ = self.timeline.table_knots
        turning = self._linear(times, rates, slopes)
        for rows, phase, wave in self._waves:
            turning[rows] += wave.rate * np.sin(phase)
        return turning

    @cached_property
    def angle(self) -> FloatArray:
        """Table angle [deg], not wrapped; 0 at the beginning."""
        times, rates, slopes, angles = self.timeline.table_knots
        turned = self._linear(times, angles, rates, 0.5 * slopes)
        for rows, phase, wave in self._waves:
            turned[rows] += wave.rate / (2.0 * math.pi * wave.frequency) * (1.0 - np.cos(phase))
        return turned

    @property
    def _waves(self) -> Iterator[tuple[slice, FloatArray, Wave]]:
        """Samples of each oscillation that reaches into the block, with its phase [rad] there."""
        waves, (begin, end) = self.timeline.schedule.waves, (self.time[[0, -1]] if len(self) else (0.0, 0.0))
        for wave in islice(waves, bisect_left(waves, begin, key=lambda wave: wave.stop), None):
            if wave.start > end:
                return
            first, last = np.searchsorted(self.time, [wave.start, wave.stop])
            if last > first:
                since = self.time[first:last] - wave.start
                yield slice(first, last), 2.0 * math.pi * wave.frequency * since, wave

    @cached_property
    def powered(self) -> FloatArray:
        """Whether the unit is on, 0 or 1."""
        return self._held("power")

    @cached_property
    def powered_on_s(self) -> FloatArray:
        """Time of the last power-on [s]; minus infinity where long before, infinity before the first."""
        switched = [on for on, _ in self.timeline.power_windows]
        return self._hold(np.array([-math.inf, *switched]), np.array([math.inf, *switched]))

    @cached_property
    def fan(self) -> FloatArray:
        """Duty of the chamber's fan, 0 to 1; on unless switched."""
        return self._held("fan")

    @cached_property
    def compressor(self) -> FloatArray:
        """Duty of the compressor, 0 to 1.

        Left to the chamber it gives the cold that the set point asks for: rate / fastest rate
        plus (T - room) / 100 degC where that is negative.
        """
        return self._given_or("compressor", np.clip(0.0 - self._demand, 0.0, 1.0))

    @cached_property
    def heater(self) -> FloatArray:
        """Duty of the heater, 0 to 1; left to the chamber it gives the heat that is asked for."""
        return self._given_or("heater", np.clip(self._demand, 0.0, 1.0))

    @cached_property
    def _demand(self) -> FloatArray:
        share = self.set_rate / self.timeline.programme.fastest_rate
        return share + (self.set_point - ROOM_DEGC) / FULL_DUTY_DEGC

    @cached_property
    def humidity(self) -> FloatArray:
        """Relative humidity of the chamber's air [%].

        Left to itself the air of the room is shut in, and what freezes out below the dew point
        stays out: the coldest set point so far tells how much water is left.
        """
        times, values, _ = self.timeline.set_point_knots
        coldest = self._hold(times, np.minimum.accumulate(values))
        shut_in = 0.01 * ROOM_HUMIDITY * saturation_pressure(np.array([ROOM_DEGC]))
        water = np.minimum(shut_in, saturation_pressure(np.minimum(coldest, self.set_point)))
        return self._given_or("humidity", 100.0 * water / saturation_pressure(self.set_point))

    @cached_property
    def dose(self) -> FloatArray:
        """Radiation dose absorbed since the beginning [Gy]."""
        times, rates = self.timeline.schedule.settings["radiation"].arrays
        starts = np.maximum(times, 0.0)
        absorbed = np.concatenate([[0.0], np.cumsum(rates[:-1] * np.diff(starts))]) / 3600.0
        return self._linear(starts, absorbed, rates / 3600.0)

    @cached_property
    def yaw(self) -> FloatArray:
        """Yaw of the fixture on the table [deg]."""
        return self._held("yaw")

    @cached_property
    def step(self) -> IndexArray:
        """Number of the step, counted from 0, repeats written out."""
        starts = np.asarray(self.timeline.schedule.step_starts)
        pieces, samples = self._samples_of(starts)
        return np.repeat(np.arange(len(starts))[pieces], samples)

    def _given_or(self, what: Switched, automatic: FloatArray) -> FloatArray:
        given = self._held(what)
        return np.where(np.isnan(given), automatic, given)

    def _held(self, what: Switched) -> FloatArray:
        return self._hold(*self.timeline.schedule.settings[what].arrays)

    def _hold(self, times: FloatArray, values: FloatArray) -> FloatArray:
        """Values that hold from their times on."""
        pieces, samples = self._samples_of(times)
        return np.repeat(values[pieces], samples)

    def _linear(
        self, times: FloatArray, values: FloatArray, slopes: FloatArray, bends: FloatArray | None = None
    ) -> FloatArray:
        """Values that go on from their times with a slope, and with a second-order term if there is one."""
        pieces, samples = self._samples_of(times)
        since = self.time - np.repeat(times[pieces], samples)
        slope = np.repeat(slopes[pieces], samples)
        if bends is not None:
            slope = slope + np.repeat(bends[pieces], samples) * since
        return since * slope + np.repeat(values[pieces], samples)

    def _samples_of(self, times: FloatArray) -> tuple[slice, IndexArray]:
        """Those pieces that reach into the block, and the number of samples in each.

        A piece begins at its time, the clock's rounding apart; what comes before the first time belongs to
        the first piece.
        """
        slack = _CLOCK_SLACK * self.timeline.sample_s
        first, last = (
            np.searchsorted(times, self.time[[0, -1]] + slack, side="right") if len(self) else (1, 1)
        )
        pieces = slice(max(int(first) - 1, 0), max(int(last), 1))
        edges = np.searchsorted(self.time, times[pieces] - slack)
        edges[:1] = 0
        return pieces, np.diff(edges, append=len(self))


def saturation_pressure(temperature: FloatArray) -> FloatArray:
    """Vapour pressure of saturated air over water [hPa], by Magnus' formula (Alduchov & Eskridge 1996)."""
    return np.asarray(6.1094 * np.exp(17.625 * temperature / (temperature + 243.04)))
