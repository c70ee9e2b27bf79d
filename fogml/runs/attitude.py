"""How the gyro lies on its table: unit vectors to north, west and up, and what turns with the table.

The table turns counter-clockwise about its axis t by an angle theta. A vector b that the gyro carries
then is, with b at angle 0,

::

    R(theta) b = t (t.b) + cos(theta) (b - t (t.b)) + sin(theta) (t x b)

(Rodrigues). The gyro's z axis is its input axis; x is north at angle 0 where that is vertical, and up where
it is horizontal; y completes a right-handed frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fogml.arrays import FloatArray
from fogml.runs.facts import EARTH_RATE_DEG_H, Direction, Facts, Heading
from fogml.signals import large

_NAMED: dict[str, tuple[float, float]] = {
    "north": (0.0, 0.0),
    "east": (90.0, 0.0),
    "south": (180.0, 0.0),
    "west": (270.0, 0.0),
    "up": (0.0, 90.0),
    "down": (0.0, -90.0),
}
_ROUND_OFF = 1e-12
UNKNOWN_LATITUDE = 45.0
"""Latitude [deg] that Earth is taken to be seen from where none is stated: both its parts then count."""


def direction(heading: float, elevation: float = 0.0) -> FloatArray:
    """Unit vector to north, west and up, shape (3,), of a heading and an elevation [deg]."""
    psi, rise = math.radians(heading), math.radians(elevation)
    vector = (math.cos(rise) * math.cos(psi), -math.cos(rise) * math.sin(psi), math.sin(rise))
    # Right angles are exact, so that what a symmetry demands vanishes wholly.
    return np.array([0.0 if abs(part) < _ROUND_OFF else part for part in vector])


UP = direction(0.0, 90.0)


@dataclass(frozen=True, eq=False)
class Attitude:
    """The gyro's axes and the table's at table angle 0, vectors of shape (3,).

    Attributes
    ----------
    x, y, z
        The gyro's axes; z is its input axis.
    table
        The table's axis.
    """

    x: FloatArray
    y: FloatArray
    z: FloatArray
    table: FloatArray

    @property
    def along(self) -> float:
        """Share of the table's rate that is about the input axis, -1 to 1."""
        return _dot(self.table, self.z)

    @property
    def sense(self) -> float:
        """Sense of a recorded angle, that of the rate: -1 where the table turns against the input axis."""
        return -1.0 if self.along < 0.0 else 1.0

    @property
    def fixed(self) -> bool:
        """Whether the input axis stays where it is as the table turns."""
        return abs(self.along) > 1.0 - _ROUND_OFF

    def tilted_to(self, direction_deg: float) -> FloatArray:
        """Unit vector that the input axis moves to when it tilts, shape (3,).

        A vertical axis tilts to north at direction 0, and to west at 90 deg; a horizontal one upwards at 0,
        and clockwise in azimuth at 90 deg.
        """
        d = math.radians(direction_deg)
        if _dot(self.x, UP) == 0.0:
            return math.cos(d) * direction(0.0) + math.sin(d) * direction(270.0)
        return math.cos(d) * self.x + math.sin(d) * np.cross(self.z, UP)


def attitude(facts: Facts) -> Attitude:
    """The attitude that facts state: upright where they do not, on a table whose axis is up."""
    return _attitude(_vector_of(facts.input_axis or "up"), _vector_of(facts.table_axis or "up"))


def latitude_of(facts: Facts) -> float:
    """The latitude [deg], `UNKNOWN_LATITUDE` where none is stated."""
    return UNKNOWN_LATITUDE if facts.latitude is None else facts.latitude


def earth_rate(facts: Facts) -> FloatArray:
    """Earth's rate to north, west and up [deg/h], shape (3,)."""
    latitude = math.radians(latitude_of(facts))
    return EARTH_RATE_DEG_H * np.array([math.cos(latitude), 0.0, math.sin(latitude)])


def turned(fixed: FloatArray, carried: FloatArray, table: FloatArray) -> tuple[float, float, float]:
    """Coefficients of ``fixed . R(theta) carried = a + b cos(theta) + c sin(theta)``."""
    along = _dot(table, carried)
    constant, whole = _dot(fixed, table) * along, _dot(fixed, carried)
    parts = (constant, whole - constant, _dot(fixed, np.cross(table, carried)))
    least = _ROUND_OFF * float(np.linalg.norm(fixed))
    return tuple(0.0 if abs(part) < least else part for part in parts)  # type: ignore[return-value]


def with_table_axis(facts: Facts, rate: FloatArray) -> Facts:
    """Facts; a table that turns about a horizontal input axis has that axis, if nothing is stated.

    `rate` is that of the table about the input axis, shape (n,).
    """
    if facts.table_axis is not None or facts.input_axis in (None, "up", "down") or not rate.any():
        return facts
    axis = facts.input_axis
    table = Direction(heading=axis.heading) if isinstance(axis, Heading) else axis
    return facts.model_copy(update={"table_axis": table})


def reference_deg_h(facts: Facts, rate: FloatArray, angle: FloatArray | None) -> FloatArray:
    """Rate about the input axis [deg/h], shape (n,): the table's and, where facts tell it, the Earth's.

    Parameters
    ----------
    facts
        Attitude and latitude; the attitude is that at table angle 0.
    rate
        Of the table about the input axis [deg/s], shape (n,).
    angle
        Of the table [deg], shape (n,), which carries the input axis round; None where not recorded.
    """
    earth = facts.earth_rate_deg_h
    if angle is not None and earth is not None:
        held = attitude(with_table_axis(facts, rate))
        a, b, c = turned(earth_rate(facts), held.z, held.table)
        if not held.fixed and (b or c):
            from fogml.signals.bases import sine

            def reference(rate: FloatArray, angle: FloatArray) -> FloatArray:
                turns = held.sense / 360.0 * angle
                return np.asarray(3600.0 * rate + a + b * sine(turns + 0.25) + c * sine(turns))

            return large.each(reference, rate, angle)
    return large.each(lambda rate: 3600.0 * rate + (earth or 0.0), rate)


def earth_field(
    facts: Facts, angle_deg: FloatArray, horizontal: float, vertical: float
) -> dict[str, FloatArray]:
    """Earth's magnetic field in the gyro's frame, by column, in the unit of the sizes; shape (n,).

    Parameters
    ----------
    facts
        Attitude and latitude.
    angle_deg
        Recorded table angle [deg], shape (n,).
    horizontal
        Part to the north.
    vertical
        Part that points down in the northern hemisphere and up in the southern.
    """
    from fogml.signals.bases import sine

    held = attitude(facts)
    field = np.array([horizontal, 0.0, -math.copysign(1.0, latitude_of(facts)) * vertical])
    turns = held.sense / 360.0 * angle_deg
    along, across = sine(turns + 0.25), sine(turns)
    columns = {}
    for name, axis in (("B_x", held.x), ("B_y", held.y), ("B_z", held.z)):
        a, b, c = turned(field, axis, held.table)
        columns[name] = a + b * along + c * across
    return columns


def _vector_of(axis: str | Heading) -> tuple[float, float]:
    """Heading and elevation [deg]."""
    if isinstance(axis, Direction):
        return axis.heading, axis.elevation
    return (axis.heading, 0.0) if isinstance(axis, Heading) else _NAMED[axis]


@lru_cache(maxsize=64)
def _attitude(axis: tuple[float, float], table: tuple[float, float]) -> Attitude:
    z = direction(*axis)
    x = direction(0.0) if abs(axis[1]) == 90.0 else UP
    return Attitude(x, np.cross(z, x), z, direction(*table))


def _dot(a: FloatArray, b: FloatArray) -> float:
    found = float(a @ b)
    return 0.0 if abs(found) < _ROUND_OFF else found
