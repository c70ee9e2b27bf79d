"""What stands beside the columns of a file: units and other texts, single numbers, the sample interval."""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Iterable, Mapping
from typing import Any

MOST_TEXT = 1 << 20
_CHANGING = re.compile(
    r"(?i)(scal(e|ing)|gain|factor|multiplier|slope|lsb|resolution|offset)(_?factor)?\Z(?<!scale_factor)"
)
_RATE = re.compile(r"(?i)f_?s|f_?samp\w*|samp(l(e|ing))?[ _]?(rate|freq(uency)?)([ _]?\W?hz\W?)?")
_INTERVAL = re.compile(
    r"(?i)d_?t|t_?s|delta_?[tx]|samp(l(e|ing))?[ _]?(time|interval|period)([ _]?\W?s\W?)?|wf_increment"
)


def text_of(value: Any) -> str:
    """A text of an attribute or a variable."""
    text = value.decode("utf-8", errors="replace") if isinstance(value, bytes) else str(value)
    return text[:MOST_TEXT]


def plain(value: Any) -> Any:
    """A value of one element as Python's own type, None for an array."""
    if isinstance(value, str | bytes):
        return text_of(value)
    if getattr(value, "size", 1) != 1:
        return None
    value = value.item() if hasattr(value, "item") else value
    return value if isinstance(value, bool | int | float) else text_of(value)


def tells_interval(name: str) -> bool:
    """Whether a number of this name is a sample rate or interval."""
    return bool(_RATE.fullmatch(name) or _INTERVAL.fullmatch(name))


def interval_of(named: Mapping[str, Any]) -> tuple[str, float] | None:
    """What numbers beside columns say of the sample interval: in words, and in seconds."""
    for name, value in ((name, plain(value)) for name, value in named.items()):
        if isinstance(value, int | float) and 0.0 < value < math.inf:
            if _RATE.fullmatch(name):
                return f"{name[:60]} = {value:g}, in Hz?", 1.0 / value
            if _INTERVAL.fullmatch(name):
                return f"{name[:60]} = {value:g}, in seconds?", float(value)
    return None


_LINE = re.compile(
    r"\W*([A-Za-z_]+(?: [A-Za-z_]+)*)(?: ?[\[(](\w+)[\])])?\s*[:=;,\t]+\s*([\d.,]*\d)\s*([A-Za-z]*)"
)
_IN_SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "hz": 1.0, "khz": 1e3, "mhz": 1e6}


def interval_in(lines: Iterable[str]) -> tuple[str, float] | None:
    """As `interval_of`, of lines of text such as ``Sample rate: 100 Hz``."""
    for line in lines:
        found = _LINE.match(line)
        unit = (found[4] or found[2] or "").lower() if found else ""
        if found and tells_interval(found[1]) and unit in _IN_SECONDS:
            with contextlib.suppress(ValueError):
                value = float(found[3].replace(",", ".")) * _IN_SECONDS[unit]
                if told := interval_of({found[1]: value}):
                    return line.strip()[:60].replace("\t", " "), told[1]
    return None


def unused(name: str, attributes: Any) -> list[str]:
    """Attributes beside a dataset that say how its numbers are to be read, of no convention that is known."""
    found = {key: plain(attributes[key]) for key in attributes if _CHANGING.match(key)}
    return [f"{key} = {value:g} of '{name[:60]}'" for key, value in found.items() if _changes(value)]


def _changes(value: Any) -> bool:
    return isinstance(value, int | float) and value not in (0, 1)
