"""The customer's limits of an acceptance test, from a YAML file."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fogml.errors import InputError, known_are, quoted
from fogml.lab.acceptance_rows import BY_KEY
from fogml.yaml_text import read_yaml

_KEYS = ("customer", "document", "limits")
_EXAMPLE = "limits: {bias_stability: 0.02, scale_factor_error: {from: -100, to: 100}}"


@dataclass(frozen=True)
class Limit:
    """Values allowed, from `low` to `high`, both included; infinite where there is no bound."""

    low: float
    high: float

    def holds(self, value: float) -> bool:
        """Whether a value is allowed."""
        return self.low <= value <= self.high

    def excess(self, value: float) -> float:
        """How far a value is beyond the bounds; 0 within."""
        return max(self.low - value, value - self.high, 0.0)

    def as_json(self) -> dict[str, float | None]:
        """The bounds, null where there is none."""
        return {
            "from": self.low if math.isfinite(self.low) else None,
            "to": self.high if math.isfinite(self.high) else None,
        }


@dataclass(frozen=True)
class Limits:
    """Limits by quantity, who states them, where, and the hash of the file."""

    by_quantity: dict[str, Limit] = field(default_factory=dict)
    customer: str | None = None
    document: str | None = None
    file: str | None = None
    sha256: str | None = None


def read_limits(path: str | Path) -> Limits:
    """The limits of a YAML file.

    A number bounds the size of a figure; ``{from: ..., to: ...}`` its value, either end of which may be
    left out. Beside ``limits`` there may be ``customer`` and ``document``.

    Raises
    ------
    InputError
        Naming the key that is not known, or the value that is no limit.
    """
    path = Path(path)
    values = read_yaml(path, ("customer", "document"))
    if not isinstance(values, dict) or not isinstance(values.get("limits"), dict):
        raise InputError(f"{path.name}: a mapping 'limits' was expected, e.g. {_EXAMPLE}")
    if unknown := [key for key in values if key not in _KEYS]:
        known = known_are(str(unknown[0]), _KEYS, "known keys")
        raise InputError(f"{path.name}: unknown key {quoted(unknown[0])}; {known}")
    found = {}
    for key, stated in values["limits"].items():
        if key not in BY_KEY:
            raise InputError(f"{path.name}: no quantity {quoted(key)}; {known_are(str(key), BY_KEY)}")
        found[key] = _limit(stated, f"{path.name}: limit of '{key}'")
    names = {key: None if values.get(key) is None else str(values[key]) for key in ("customer", "document")}
    return Limits(
        found, names["customer"], names["document"], path.name, hashlib.sha256(path.read_bytes()).hexdigest()
    )


def _limit(stated: Any, what: str) -> Limit:
    if _is_number(stated):
        if not stated > 0.0:
            raise InputError(f"{what} is {quoted(stated)}; a positive number bounds the size of a figure")
        return Limit(-float(stated), float(stated))
    bounds = stated if isinstance(stated, dict) else {}
    if bounds and set(bounds) <= {"from", "to"} and all(map(_is_number, bounds.values())):
        low, high = float(bounds.get("from", -math.inf)), float(bounds.get("to", math.inf))
        if low <= high:
            return Limit(low, high)
    raise InputError(f"{what} is {quoted(stated)}; write a positive number, or from and to: {_EXAMPLE}")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
