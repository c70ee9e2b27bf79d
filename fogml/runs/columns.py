"""The columns of a run: their names, accepted units as laboratories write them, and conversion."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import numpy as np

from fogml.errors import InputError, known_are, quoted

_SIGNS = str.maketrans(
    {"˚": "°", "º": "°", "∘": "°", "μ": "µ", "⁻": "-", "¹": "1", "−": "-", "″": '"', "·": "*", "．": "."}
)
# By lower case, without blanks, the degree sign written "deg".
_SPELLINGS = {
    "s": ("sec", "secs", "second", "seconds", "秒", "с", "сек"),
    "ms": ("msec", "msecs", "millisecond", "milliseconds", "毫秒"),
    "us": ("µs", "usec", "µsec", "microsecond", "microseconds", "微秒"),
    "ns": ("nsec", "nanosecond", "nanoseconds"),
    "min": ("mins", "minute", "minutes"),
    "h": ("hr", "hrs", "hour", "hours"),
    "deg": ("degree", "degrees"),
    "rad": ("radian", "radians"),
    "deg/h": ("dph", "degph", "degh", "degperhour", "deg*h-1", "degh-1", "deg*h^-1", "degh^-1"),
    "deg/s": ("dps", "degps", "degpersecond", "deg*s-1", "degs-1", "deg*s^-1", "degs^-1"),
    "rad/s": ("radps", "radpersecond", "rad*s-1", "rads-1", "rad*s^-1", "rads^-1"),
    "deg/min": (),
    "mdeg/s": ("mdps",),
    "mrad/s": (),
    "arcsec/s": ('"/s', "arcsec/sec", "as/s"),
    "arcsec/h": ('"/h', "arcsec/hr", "arcsec/hour", "as/h"),
    "degC": ("c", "degс", "celsius", "degcelsius", "centigrade", "摄氏度"),
    "degF": ("f", "fahrenheit", "degfahrenheit"),
    "K": ("kelvin", "degk", "degkelvin"),
    "count": ("counts", "lsb", "lsbs", "digit", "digits", "ticks", "adc"),
    "0/1": ("bool", "on/off"),
    "%": ("percent", "pct", "%rh"),
    "V": ("volt", "volts"),
    "W": ("watt", "watts"),
    "uT": ("µt", "microtesla"),
    "G": ("gauss",),
    "Gy": ("gray",),
}
_CANONICAL = {word.lower(): unit for unit, words in _SPELLINGS.items() for word in (unit, *words)}
_HALVES = {"hour": "h", "hr": "h", "hrs": "h", "second": "s", "sec": "s", "degrees": "deg", "degree": "deg",
           "小时": "h", "时": "h", "分": "min", "秒": "s", "度": "deg", "弧度": "rad",
           "град": "deg", "ч": "h", "с": "s", "сек": "s"}  # fmt: skip
_PLAIN_UNIT = re.compile(r"[A-Za-z_]{1,20}(/[A-Za-z_]{1,20})?\Z")
# What pint calls the units that the run format writes otherwise.
_OF_PINT = {"g": "standard_gravity", "G": "gauss", "%": "percent", "degC": "degree_Celsius", "h": "hour"}
# Nobody counts in hundreds of hours: deg/hh, which pint takes for that, is a slip.
_MULTIPLE_OF_TIME = re.compile(r"(?!arc)[a-z]+(hour|minute|day|week|month|year)\Z")
# Degrees in German, gon elsewhere, and billions of radians to pint.
_AMBIGUOUS = re.compile(r"grads?\b", re.IGNORECASE)
_NAMES_OF_ANGLES = re.compile(r"[a-z]*(degree|radian|arcminute|arcsecond|turn|grade)\Z")


_MISREAD_DEGREE = re.compile(r"Â°|[øo¡](?<![A-Za-z].)(?=C\b|/(?:h|s|hr|sec|min)\b)")
"""A sign of degrees in UTF-8, code page 437 or MacRoman that was read as another; a letter in its place."""


def signs(text: str) -> str:
    """Text with one sign for each of degree, micro, minus; full-width letters as plain ones, ℃ as °C."""
    text = _MISREAD_DEGREE.sub("°", text)
    return unicodedata.normalize("NFKC", text.translate(_SIGNS)).translate(_SIGNS).strip()


@lru_cache(maxsize=1024)
def canonical_unit(unit: str) -> str:
    """The run format's spelling of a unit, or the unit as it stands where it is no spelling of one.

    >>> [canonical_unit(unit) for unit in ("℃", "˚/h", "DEG/HR", "dps", "G", "g")]
    ['degC', 'deg/h', 'deg/h', 'deg/s', 'G', 'g']
    """
    plain = re.sub(r"\bdeg\. ?", "deg", signs(unit).replace("°", "deg"))
    if plain in _SPELLINGS:
        return plain
    word = re.sub(r"\s+", "", re.sub(r"\bper\b", "/", plain.lower()))
    word = word.rstrip(".")
    upper, slash, lower = word.partition("/")
    halves = f"{_HALVES.get(upper, upper)}{slash}{_HALVES.get(lower, lower)}"
    return _CANONICAL.get(word, _CANONICAL.get(halves, unit.strip())) if word != "g" else unit.strip()


def is_unit(text: str) -> bool:
    """Whether a text is a spelling of a unit that the run format knows."""
    return canonical_unit(text) in _SPELLINGS or text.strip() == "g"


def converted(unit: str, internal: str) -> tuple[float, float] | None:
    """Factor and offset from any unit that `pint` knows to an internal one; None where that can't be.

    Angles are no plain numbers here: hertz are not taken for radians a second.
    """
    plain = signs(unit).replace("°", "deg").replace("µ", "u")
    plain = canonical_unit(plain)
    if not _PLAIN_UNIT.match(plain) or _AMBIGUOUS.match(plain) or "count" in plain:
        return None
    registry = _registry()
    try:
        source, target = (registry.Unit(_OF_PINT.get(u, u)) for u in (plain, internal))
        if _has_angle(source) != _has_angle(target) or _matches(source, _MULTIPLE_OF_TIME):
            return None
        zero, one = (float(registry.Quantity(value, source).to(target).magnitude) for value in (0.0, 1.0))
    except Exception:  # pint raises errors of many kinds for what is no unit
        return None
    return one - zero, zero


def _has_angle(unit: Any) -> bool:
    return _matches(unit, _NAMES_OF_ANGLES)


def _matches(unit: Any, names: re.Pattern[str]) -> bool:
    return any(names.match(name) for name, _ in (1.0 * unit).unit_items())


@cache
def _registry() -> Any:
    """The units of `pint`, loaded where a unit is none that the run format names."""
    import pint

    return pint.UnitRegistry(cache_folder=None)


@dataclass(frozen=True)
class ColumnSpec:
    """What run-format says of a column.

    `units` maps each accepted unit to (factor, offset): internal = value * factor + offset.
    """

    name: str
    internal: str
    units: Mapping[str, tuple[float, float]]
    meaning: str


_TIME = {
    "s": (1.0, 0.0),
    "ms": (1e-3, 0.0),
    "us": (1e-6, 0.0),
    "ns": (1e-9, 0.0),
    "min": (60.0, 0.0),
    "h": (3600.0, 0.0),
    "d": (86_400.0, 0.0),
}
_DEGREE_PER_RADIAN = 180.0 / np.pi
_GYRO = {
    "deg/h": (1.0, 0.0),
    "deg/s": (3600.0, 0.0),
    "rad/s": (3600.0 * _DEGREE_PER_RADIAN, 0.0),
    "count": (1.0, 0.0),
}
_SIMULATED = {unit: scale for unit, scale in _GYRO.items() if unit != "count"}
REPLAYED = "replayed"
"""The column that a simulator's output stands in."""
TIME_ON = "time_on"
"""Time since power-on [s]: a column that a simulated run may hold, else from the fact ``powered_on``."""
_TEMPERATURE = {"degC": (1.0, 0.0), "K": (1.0, -273.15)}
_RATE = {"deg/s": (1.0, 0.0), "deg/h": (1.0 / 3600.0, 0.0), "rad/s": (_DEGREE_PER_RADIAN, 0.0)}
_ANGLE = {"deg": (1.0, 0.0), "rad": (_DEGREE_PER_RADIAN, 0.0)}
DUTY = "1"
"""Unit of a share of the time for which something is on, from 0 to 1."""
_DUTY = {"%": (0.01, 0.0), DUTY: (1.0, 0.0), "0/1": (1.0, 0.0)}
_FIELD = {"uT": (1.0, 0.0), "G": (100.0, 0.0)}


def _specs() -> dict[str, ColumnSpec]:
    temperature = "degC"
    rows = [
        ColumnSpec("time", "s", _TIME, "since the start of the recording"),
        ColumnSpec("gyro", "deg/h", _GYRO, "gyro output, positive about the input axis"),
        ColumnSpec("T_in", temperature, _TEMPERATURE, "inner face of the fibre coil"),
        ColumnSpec("T_out", temperature, _TEMPERATURE, "outer face of the fibre coil"),
        ColumnSpec("T", temperature, _TEMPERATURE, "the only temperature sensor"),
        ColumnSpec("T_chamber", temperature, _TEMPERATURE, "chamber air"),
        ColumnSpec("T_case", temperature, _TEMPERATURE, "case"),
        ColumnSpec("T_electronics", temperature, _TEMPERATURE, "electronics"),
        ColumnSpec("T_top", temperature, _TEMPERATURE, "top of the fibre coil, along its axis"),
        ColumnSpec("T_bottom", temperature, _TEMPERATURE, "bottom of the fibre coil, along its axis"),
        ColumnSpec("rate", "deg/s", _RATE, "table rate about the input axis, Earth rate not included"),
        ColumnSpec("angle", "deg", _ANGLE, "table angle"),
        ColumnSpec("power", "W", {"W": (1.0, 0.0)}, "electrical power"),
        ColumnSpec("supply", "V", {"V": (1.0, 0.0)}, "supply voltage"),
        ColumnSpec("humidity", "%", {"%": (1.0, 0.0)}, "relative humidity"),
        ColumnSpec("vibration", "g", {"g": (1.0, 0.0)}, "rms vibration"),
        ColumnSpec("dose", "Gy", {"Gy": (1.0, 0.0), "krad": (10.0, 0.0)}, "absorbed radiation dose"),
        ColumnSpec("compressor", DUTY, _DUTY, "duty of the compressor"),
        ColumnSpec("heater", DUTY, _DUTY, "duty of the heater"),
        ColumnSpec("fan", DUTY, _DUTY, "duty of the fan"),
        ColumnSpec(REPLAYED, "deg/h", _SIMULATED, "what a simulator gives for this run's inputs"),
        ColumnSpec("B_x", "uT", _FIELD, "magnetic field in the gyro frame"),
        ColumnSpec("B_y", "uT", _FIELD, "magnetic field in the gyro frame"),
        ColumnSpec("B_z", "uT", _FIELD, "magnetic field in the gyro frame"),
    ]
    return {row.name: row for row in rows}


KNOWN = _specs()
_COIL_SENSOR = re.compile(r"T([1-9][0-9]{0,3})\Z")


def coil_sensor_number(name: str) -> int | None:
    """The n of a coil sensor ``Tn``, else None."""
    match = _COIL_SENSOR.match(name)
    return int(match[1]) if match else None


def of_a_sensor(name: str) -> bool:
    """Whether run-format knows a column as what a sensor beside the gyro reads."""
    return name not in ("time", "gyro", REPLAYED) and (name in KNOWN or coil_sensor_number(name) is not None)


def column_spec(name: str) -> ColumnSpec | None:
    """The specification of a column, or None for a name that run-format does not know."""
    if name in KNOWN:
        return KNOWN[name]
    if coil_sensor_number(name) is not None:
        return ColumnSpec(name, "degC", _TEMPERATURE, "coil sensor: odd on the inner face, even on the outer")
    return None


def is_temperature(name: str) -> bool:
    """Whether a column name is a temperature of the run format."""
    spec = column_spec(name)
    return spec is not None and spec.internal == "degC"


def parse_header(cell: str) -> tuple[str, str | None]:
    """Split a header cell ``name [unit]`` into its name and its unit (None if absent)."""
    cell = cell.strip()
    name, bracket, rest = cell.partition("[")
    if not bracket or not rest.endswith("]") or "[" in rest or "]" in rest[:-1] or "]" in name:
        return cell, None
    return name.strip(), canonical_unit(rest[:-1])


def header(name: str, unit: str | None = None) -> str:
    """The header cell of a column, in its internal unit unless `unit` says otherwise."""
    spec = column_spec(name)
    unit = unit or (spec.internal if spec else None)
    return f"{name} [{unit}]" if unit else name


def stated_cell(name: str, unit: str | None) -> str:
    """The header cell of a column whose unit, if any, is stated beside its name."""
    return name if unit is None else f"{parse_header(name)[0]} [{unit.strip()}]"


def conversion(name: str, unit: str | None, file: str) -> tuple[float, float]:
    """Factor and offset that bring a column to its internal unit.

    Raises
    ------
    InputError
        If the unit of a known column is missing or not accepted; the message lists what is.
    """
    spec = column_spec(name)
    if spec is None:
        return 1.0, 0.0
    accepted = ", ".join(spec.units)
    if unit is None:
        how = f"write '{name} [{spec.internal}]' in the header"
        if file.lower().endswith(".mat"):
            how = f"save a struct 'units' with a field of the variable's name that holds '{spec.internal}'"
        elif file.lower().endswith((".h5", ".hdf5")):
            how = f"give the dataset an attribute 'unit' that holds '{spec.internal}'"
        raise InputError(f"{file}: column '{name}' states no unit; {how} (accepted: {accepted})")
    found = spec.units.get(unit) or converted(unit, spec.internal)
    if found is None:
        if _AMBIGUOUS.match(unit):
            raise InputError(
                f"{file}: column '{name}' has unit {quoted(unit)}, degrees in German and gon elsewhere; "
                f"write {_AMBIGUOUS.sub('deg', unit)} where it is degrees (accepted: {accepted})"
            )
        angle = converted(unit, "deg") if spec.internal in ("deg/h", "deg/s") else None
        raise InputError(
            f"{file}: column '{name}' has unit {quoted(unit)}, not accepted here; "
            f"{known_are(unit, spec.units, 'accepted units')}{_of_a_sample(angle)}"
        )
    return found


def _of_a_sample(angle: tuple[float, float] | None) -> str:
    """What makes a rate of angles, given what brings them to degrees; nothing where they are none."""
    if angle is None:
        return ""
    return (
        "; where it is the angle turned in a sample, an import profile makes a rate of it: unit deg/s, "
        f"scale {angle[0]:.6g} over the sample interval in seconds"
    )


def is_accepted(name: str, unit: str | None) -> bool:
    """Whether a column of the run format may be given in a unit, or in one that is not stated."""
    spec = column_spec(name)
    if spec is None or unit is None or unit in spec.units:
        return spec is not None
    return converted(unit, spec.internal) is not None
