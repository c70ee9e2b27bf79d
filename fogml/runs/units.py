"""Units as laboratories write them: usual spellings of one unit, conversion of any other by `pint`."""

from __future__ import annotations

import re
import unicodedata
from functools import cache, lru_cache
from typing import Any

_SIGNS = str.maketrans(
    {"˚": "°", "º": "°", "∘": "°", "μ": "µ", "⁻": "-", "¹": "1", "−": "-", "″": '"', "·": "*", "．": "."}
)
# By lower case, without blanks, the degree sign written "deg".
_SPELLINGS = {
    "s": ("sec", "secs", "second", "seconds", "秒"),
    "ms": ("msec", "msecs", "millisecond", "milliseconds", "毫秒"),
    "us": ("µs", "usec", "µsec", "microsecond", "microseconds", "微秒"),
    "ns": ("nsec", "nanosecond", "nanoseconds"),
    "min": ("mins", "minute", "minutes"),
    "h": ("hr", "hrs", "hour", "hours"),
    "deg": ("degree", "degrees"),
    "rad": ("radian", "radians"),
    "deg/h": ("dph", "deg*h-1", "degh-1", "deg*h^-1", "degh^-1"),
    "deg/s": ("dps", "deg*s-1", "degs-1", "deg*s^-1", "degs^-1"),
    "rad/s": ("rps", "rad*s-1", "rads-1", "rad*s^-1", "rads^-1"),
    "deg/min": (),
    "mdeg/s": ("mdps",),
    "mrad/s": ("mrps",),
    "arcsec/s": ('"/s', "arcsec/sec", "as/s"),
    "arcsec/h": ('"/h', "arcsec/hr", "arcsec/hour", "as/h"),
    "degC": ("c", "celsius", "degcelsius", "centigrade"),
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
_HALVES = {"hour": "h", "hr": "h", "hrs": "h", "second": "s", "sec": "s", "degrees": "deg", "degree": "deg"}
_PLAIN_UNIT = re.compile(r"[A-Za-z_]{1,20}(/[A-Za-z_]{1,20})?\Z")
# What pint calls the units that the run format writes otherwise.
_OF_PINT = {"g": "standard_gravity", "G": "gauss", "%": "percent", "degC": "degree_Celsius", "h": "hour"}
# Nobody counts in hundreds of hours: deg/hh, which pint takes for that, is a slip.
_MULTIPLE_OF_TIME = re.compile(r"(?!arc)[a-z]+(hour|minute|day|week|month|year)\Z")
_ANGLE = re.compile(r"[a-z]*(degree|radian|arcminute|arcsecond|turn|grade)\Z")


def signs(text: str) -> str:
    """Text with one sign for each of degree, micro, minus; full-width letters as plain ones, ℃ as °C."""
    return unicodedata.normalize("NFKC", text.translate(_SIGNS)).translate(_SIGNS).strip()


@lru_cache(maxsize=1024)
def canonical_unit(unit: str) -> str:
    """The run format's spelling of a unit, or the unit as it stands where it is no spelling of one.

    >>> [canonical_unit(unit) for unit in ("℃", "˚/h", "DEG/HR", "dps", "G", "g")]
    ['degC', 'deg/h', 'deg/h', 'deg/s', 'G', 'g']
    """
    plain = signs(unit).replace("°", "deg")
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
    if not _PLAIN_UNIT.match(plain) or "count" in plain:
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
    return _matches(unit, _ANGLE)


def _matches(unit: Any, names: re.Pattern[str]) -> bool:
    return any(names.match(name) for name, _ in (1.0 * unit).unit_items())


@cache
def _registry() -> Any:
    """The units of `pint`, loaded where a unit is none that the run format names."""
    import pint

    return pint.UnitRegistry(cache_folder=None)
