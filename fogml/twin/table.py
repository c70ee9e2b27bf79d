"""The rate table: from commands to a rate that changes at a finite acceleration."""

from __future__ import annotations

import math
from typing import NamedTuple

from fogml.errors import InputError
from fogml.numerals import short

_SLACK_S = 1e-6


class Wave(NamedTuple):
    """An oscillation about rest: from and to [s], greatest rate [deg/s], frequency [Hz]."""

    start: float
    stop: float
    rate: float
    frequency: float


class Table:
    """Takes commands in time order and keeps the rate that the table then has.

    The rate is linear between knots, so the angle is known exactly.

    Parameters
    ----------
    acceleration
        Greatest acceleration [deg/s^2].
    """

    def __init__(self, acceleration: float) -> None:
        self._acceleration = acceleration
        self._times: list[float] = []
        self._rates: list[float] = []
        self._angles: list[float] = []
        self._busy_until = -math.inf
        self.waves: list[Wave] = []

    def knots(self) -> tuple[list[float], list[float], list[float]]:
        """Times [s], rates [deg/s] and angles [deg] of the knots."""
        return self._times, self._rates, self._angles

    def turn(self, start: float, stop: float, rate: float, owner: str) -> None:
        """Turn at a rate [deg/s] from `start`, when the table begins to change, to `stop`.

        Raises
        ------
        InputError
            If another command still holds, or the time is too short to reach the rate.
        """
        self._check_free(start, owner)
        needed = abs(rate - self._rate(start)) / self._acceleration
        if needed > stop - start:
            raise InputError(
                f"{owner}: at {self._acceleration:g} deg/s2 the table needs {short(needed)} s to reach "
                f"{rate:g} deg/s; turn for longer, or state a higher 'table_acceleration'"
            )
        self._go_to(start, rate)
        self._busy_until = stop

    def stop(self, time: float) -> None:
        """Begin to come to rest."""
        self._go_to(time, 0.0)

    def move(self, start: float, angle: float, rate: float, relative: bool, owner: str) -> float:
        """Go from rest to an angle [deg] the shorter way round, or on by an angle; the time of arrival.

        Raises
        ------
        InputError
            If the table is not at rest at `start`.
        """
        self._check_at_rest(start, owner)
        way = angle if relative else math.remainder(angle - (self._angles or [0.0])[-1], 360.0)
        # Half a turn goes the positive way.
        way = way + 360.0 if not relative and way < -180.0 + 1e-6 else way
        if abs(way) < 1e-9:
            return start
        peak = min(rate, math.sqrt(self._acceleration * abs(way)))
        rise = peak / self._acceleration
        total = abs(way) / peak + rise
        peak = math.copysign(peak, way)
        self._add(start, 0.0)
        self._add(start + rise, peak)
        self._add(start + total - rise, peak)
        self._add(start + total, 0.0)
        self._busy_until = start + total
        return start + total

    def oscillate(self, wave: Wave, owner: str) -> None:
        """Turn to and fro from rest and back to it.

        Raises
        ------
        InputError
            If the table is not at rest at its start, or can't be accelerated so fast.
        """
        self._check_at_rest(wave.start, owner)
        needed = 2.0 * math.pi * wave.frequency * wave.rate
        if needed > self._acceleration:
            raise InputError(
                f"{owner}: the table would have to reach {short(needed)} deg/s2 and has "
                f"{self._acceleration:g} deg/s2; state a higher 'table_acceleration'"
            )
        self.waves.append(wave)
        self._busy_until = wave.stop

    def _check_at_rest(self, start: float, owner: str) -> None:
        self._check_free(start, owner)
        if self._times and self._times[-1] > start + _SLACK_S and self._rate(start) != 0.0:
            raise InputError(f"{owner}: the table still slows down from the turn before; begin later")

    def _check_free(self, start: float, owner: str) -> None:
        if start < self._busy_until - _SLACK_S:
            raise InputError(f"{owner}: the turn before is not over yet; begin later")

    def _go_to(self, start: float, rate: float) -> None:
        now = self._rate(start)
        while self._times and self._times[-1] > start:
            self._drop()
        self._add(start, now)
        self._add(start + abs(rate - now) / self._acceleration, rate)

    def _drop(self) -> None:
        for knots in (self._times, self._rates, self._angles):
            knots.pop()

    def _add(self, time: float, rate: float) -> None:
        if self._times and time <= self._times[-1]:
            self._drop()
        angle = 0.0
        if self._times:
            angle = self._angles[-1] + 0.5 * (self._rates[-1] + rate) * (time - self._times[-1])
        self._times.append(time)
        self._rates.append(rate)
        self._angles.append(angle)

    def _rate(self, time: float) -> float:
        """Rate [deg/s] at a time after the last knot but one."""
        if not self._times or time >= self._times[-1]:
            return self._rates[-1] if self._times else 0.0
        (t0, t1), (r0, r1) = self._times[-2:], self._rates[-2:]
        return r0 + (r1 - r0) * (time - t0) / (t1 - t0)
