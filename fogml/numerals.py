"""Numbers as text, and numbers and names as people read them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any


def number_text(value: float) -> str:
    """Shortest text that reads back as the same number, without a trailing ``.0``."""
    return repr(float(value)).removesuffix(".0")


def ascii_number(value: float, digits: int = 3) -> str:
    """A number to so many significant digits, as feature text, programmes and C comments take it.

    Powers of ten only under 1e-4 and from 1e7 on.

    Examples
    --------
    >>> ascii_number(1234.5), ascii_number(-0.25), ascii_number(2e-5)
    ('1230', '-0.25', '2e-05')
    """
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e" in text and 1.0 <= abs(value) < 1e7 else text


def short(value: float | None, digits: int = 3) -> str:
    """A number to so many significant digits as sentences write it, a dash where there is none.

    Examples
    --------
    >>> short(1234.5), short(-0.25), short(2e-5)
    ('1230', '−0.25', '2 × 10⁻⁵')
    """
    return MISSING if value is None else _typeset(ascii_number(value, digits))


def _typeset(text: str) -> str:
    """The text of a number with a minus sign and a raised power."""
    mantissa, mark, power = text.partition("e")
    return (f"{mantissa} × {power_of_ten(int(power))}" if mark else text).replace("-", "−")


_LABELS = {
    "bias_stability_10s": "Bias stability, 10 s averages",
    "scale_factor_error": "Scale-factor error",
    "scale_factor_error_largest": "Scale-factor error, largest of single turns",
    "scale_factor_nonlinearity": "Scale-factor nonlinearity",
    "scale_factor_asymmetry": "Scale-factor asymmetry",
    "scale_factor_repeatability": "Scale-factor repeatability",
    "turn_on_time": "Turn-on time",
    "temperature_sensitivity": "Bias temperature sensitivity",
    "hysteresis": "Thermal hysteresis",
    "design_index": "Design index (largest rms)",
}
_UNITS = {
    "scale_factor_error": "ppm",
    "scale_factor_error_largest": "ppm",
    "scale_factor_nonlinearity": "ppm",
    "scale_factor_asymmetry": "ppm",
    "scale_factor_repeatability": "ppm",
    "turn_on_time": "s",
    "temperature_sensitivity": "deg/h/°C",
    "design_index": "deg/h",
}
MISSING = "–"
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def label(quantity: str) -> str:
    """The name of a quantity of `Metrics` in words: its own, else that of its key."""
    return _LABELS.get(quantity, quantity.replace("_", " ").capitalize())


def unit_of(quantity: str) -> str:
    """The unit of a quantity of `Metrics`."""
    return _UNITS.get(quantity, "deg/h")


def unit_words(unit: str) -> str:
    """A unit as pages write it; nothing for a pure number.

    Examples
    --------
    >>> unit_words("deg/h/sqrt(h)"), unit_words("ppm/degC2"), unit_words("1")
    ('deg/h/√h', 'ppm/°C²', '')
    """
    for spelt, written in (("sqrt(h)", "√h"), ("degC", "°C"), ("C2", "C²"), ("/s2", "/s²"), ("urad", "µrad")):
        unit = unit.replace(spelt, written)
    return "" if unit == "1" else unit


def number(value: float | None, digits: int = 3) -> str:
    """A number to so many significant digits; a dash where there is none.

    Powers of ten only below 1e-4 and from 1e7 on.
    """
    if value is None or not math.isfinite(value):
        return MISSING if value is None or math.isnan(value) else ("∞" if value > 0 else "−∞")
    return _typeset(_in_full(value, digits))


def _in_full(value: float, digits: int) -> str:
    """As `number`, in ASCII: with zeros behind, and all digits of what is above one."""
    if value == 0:
        return "0"
    exponent = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    if exponent < -4 or exponent >= 7:
        return f"{value:.{digits - 1}e}"
    return f"{value:.{max(digits - 1 - exponent, 0)}f}"


def power_of_ten(power: int) -> str:
    """A power of ten with its raised exponent: ``10⁻⁵``."""
    return f"10{str(power).translate(_RAISED)}"


def to_error(value: float, error: float | None, most: int = 4) -> str:
    """A number to the second digit of its standard error, but with at most so many decimals."""
    decimals = max(1 - math.floor(math.log10(error)), 0) if error else most
    return f"{value:.{min(decimals, most)}f}".replace("-", "−")


def with_error(value: float, se: float | None) -> str:
    """A value with its standard error, both to the error's second figure; bare where there is none."""
    if se is None or not (math.isfinite(se) and se > 0.0):
        return number(value)
    value = 0.0 if abs(value) < 0.005 * se else value
    places = 1 - math.floor(math.log10(se))
    if places < -2 or places > 6:
        digits = math.floor(math.log10(abs(value))) + places + 1 if value else 1
        return f"{number(value, min(max(digits, 1), 15))} ± {number(se, 2)}"
    if places <= 0:
        return f"{value:.0f} ± {se:.0f}".replace("-", "−")
    told = f"{value:.{places}f}"
    told = told.removeprefix("-") if float(told) == 0.0 else told
    return f"{told} ± {se:.{places}f}".replace("-", "−")


def in_two(value: float, se: float | None) -> tuple[str, str]:
    """A value and its standard error for two cells, both to the error's second figure.

    Examples
    --------
    >>> in_two(10.718473, 1.36e-4), in_two(0.353, None)
    (('10.71847', '0.00014'), ('0.353', '–'))
    """
    told, _, error = with_error(value, se).partition(" ± ")
    return told, error or number(se)


def probability_words(probability: float) -> str:
    """A probability in whole percent, never as certainty."""
    if probability < 0.01:
        return "under 1 %"
    if probability > 0.99:
        return "over 99 %"
    return f"{100 * probability:.0f} %"


def stated(value: float) -> str:
    """A number that somebody stated, such as a limit, as they would write it."""
    return _typeset(f"{value:.10g}")


def digits_between(least: float | None, greatest: float | None, digits: int = 3) -> int:
    """Significant digits that show two numbers, and so many of what they differ by.

    Examples
    --------
    >>> digits_between(-2.0, 3.0), digits_between(1_790_000_000.0, 1_790_086_400.0)
    (3, 8)
    """
    if least is None or greatest is None or not 0.0 < greatest - least < math.inf:
        return digits
    most, apart = (math.floor(math.log10(x)) for x in (max(-least, greatest), greatest - least))
    return min(digits + max(most - apart, 0), 16)


def against(value: float | None, *limits: float | None) -> str:
    """A number that stands beside limits: with more digits than `number` where it would seem to lie on one.

    Examples
    --------
    >>> against(0.7, 0.5), against(0.50004, 0.5), against(0.5, 0.5)
    ('0.700', '0.50004', '0.500')
    """
    if value is None or not math.isfinite(value):
        return number(value)
    for digits in range(3, 17):
        told = float(_in_full(value, digits))
        if all(one is None or (told > one, told < one) == (value > one, value < one) for one in limits):
            return number(value, digits)
    return number(value, 17)


def percent(share: float | None, places: int = 1) -> str:
    """A share (0 to 1) in percent; "under 0.1 %" rather than a zero that is none, below zero too.

    Examples
    --------
    >>> percent(0.0004), percent(0.0004, 0), percent(0.25, 0)
    ('under 0.1 %', 'under 1 %', '25 %')
    """
    if share is None or not math.isfinite(share):
        return MISSING
    least = 10.0 ** -(places + 2)
    if 0 < share < least:
        return f"under {100 * least:.{places}f} %"
    if -least < share < 0:
        return f"above −{100 * least:.{places}f} %"
    if 1 - least < share < 1:
        return f"over {100 * (1 - least):.{places}f} %"
    return f"{100 * share:.{0 if share in (0, 1) else places}f} %".replace("-", "−")


def lowest_from(noise: Mapping[str, Any]) -> str:
    """From what time on the minimum of a ``noise.json`` is looked for; empty where none before is lower."""
    lowest = noise["minimum"]
    before = [value for tau, value in zip(noise["taus_s"], noise["adev"]) if tau < lowest["tau_s"]]
    if min(before, default=lowest["adev"]) >= lowest["adev"]:
        return ""
    return f" (of times from {number(noise.get('holds_from_s'))} s on, where the terms hold)"


def plural(count: int, word: str, words: str | None = None) -> str:
    """``3 runs``, ``1 run``; thousands apart."""
    return f"{count:,}".replace(",", " ") + " " + (word if count == 1 else words or word + "s")


def listed(names: Sequence[str], most: int = 4) -> str:
    """``a``, ``a and b``, ``a, b and c``; beyond ``most`` names the rest as a count."""
    if len(names) > most:
        return ", ".join(names[: most - 1]) + f" and {len(names) - most + 1} more"
    if len(names) < 2:
        return "".join(names)
    return ", ".join(names[:-1]) + " and " + names[-1]


def averages(seconds: float) -> str:
    """The averaging time in words: ``100 s averages``."""
    return f"{short(seconds, 4)} s averages"


def duration(seconds: float) -> str:
    """A span of time in the unit that reads best: ``36 s``, ``12.5 min``, ``7.58 h``, ``4.2 d``."""
    if seconds < 120:
        return f"{number(seconds)} s"
    if seconds < 2 * 3600:
        return f"{number(seconds / 60)} min"
    if seconds < 3 * 86400:
        return f"{number(seconds / 3600)} h"
    return f"{number(seconds / 86400)} d"


def in_order_of_serial(label: str) -> list[tuple[int, int | str]]:
    """Sort key of serial numbers: digits in a label count by the number that they are.

    Examples
    --------
    >>> sorted(["FOG-10", "FOG-9"], key=in_order_of_serial)
    ['FOG-9', 'FOG-10']
    """
    parts = re.findall(r"\d{1,99}|\D+", label)
    return [(0, int(part)) if part.isdecimal() else (1, part) for part in parts]
