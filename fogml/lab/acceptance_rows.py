"""The quantities of an acceptance report (names here and in the standards, units, needs), and limits.

IEEE Std 952-1997 and GJB 2426A-2004 are not public. A clause stands only where the open literature cites it,
which is annex C of IEEE Std 952-1997, the Allan variance.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fogml.errors import InputError, known_are, quoted
from fogml.runs.noise_of_run import MOVING_DEGC
from fogml.yaml_text import read_yaml

ANNEX_C = "annex C"


@dataclass(frozen=True)
class Quantity:
    """One row of the report.

    Attributes
    ----------
    key
        Its name in limits and in JSON.
    name
        In words.
    gjb_2426a
        Its name in GJB 2426A.
    unit
        Unit of its values.
    needs
        What a run has to hold to tell it.
    clause
        Clause of IEEE Std 952-1997, where a public source cites it.
    called
        Its name in IEEE Std 952, where that is not its own without what of it is told.
    signed
        Whether a figure of it may be negative.
    """

    key: str
    name: str
    gjb_2426a: str
    unit: str
    needs: str
    clause: str = ""
    called: str = ""
    signed: bool = False

    @property
    def ieee_952(self) -> str:
        """Its name in IEEE Std 952."""
        return self.called or re.split(r", | \(", self.name)[0].lower()


_RESTS = "two averages at rest (--averaging)"
_RATES = "turns of a rate table (column rate)"
_LADDER = "four rates of a rate table or more, of both senses"
_BOTH_SENSES = "rates of both senses, and rest"
_SOAKS = "soaks at temperatures 5 degC apart or more"
_BOTH_WAYS = "soaks at one temperature, on the way up and on the way down"
_TURNS_IN_SOAKS = "turns of a rate table in soaks 5 degC apart or more"
_CYCLES = "six runs or more of the unit"
_STATIC = f"a run long enough, whose temperatures stay within {MOVING_DEGC:g} degC"
_SMALL = "small rates of both senses about zero, Earth rate turned away"
_STEPS = "small steps of the rate on top of a larger one"
_POWER_ON = "a stated power-on (powered_on) and a band (--turn-on-band)"
_OFTEN = "a sample in 5 s or more often"

QUANTITIES = (
    Quantity("bias", "Bias", "零偏", "deg/h", _RESTS, signed=True),
    Quantity("bias_stability", "Bias stability, of the averages", "零偏稳定性", "deg/h", _RESTS),
    Quantity("bias_stability_10s", "Bias stability, 10 s averages", "零偏稳定性", "deg/h", _OFTEN),
    Quantity("bias_repeatability", "Bias repeatability", "零偏重复性", "deg/h", _CYCLES),
    Quantity(
        "temperature_sensitivity", "Bias temperature sensitivity", "零偏温度灵敏度", "deg/h/degC", _SOAKS
    ),
    Quantity(
        "hysteresis", "Thermal hysteresis of the bias", "", "deg/h", _BOTH_WAYS, called="thermal hysteresis"
    ),
    Quantity(
        "scale_factor_error",
        "Scale factor error",
        "标度因数",
        "ppm",
        _RATES,
        called="scale factor",
        signed=True,
    ),
    Quantity("scale_factor_nonlinearity", "Scale factor nonlinearity", "标度因数非线性度", "ppm", _LADDER),
    Quantity("scale_factor_asymmetry", "Scale factor asymmetry", "标度因数不对称性", "ppm", _BOTH_SENSES),
    Quantity(
        "scale_factor_temperature_sensitivity",
        "Scale factor temperature sensitivity",
        "标度因数温度灵敏度",
        "ppm/degC",
        _TURNS_IN_SOAKS,
        signed=True,
    ),
    Quantity(
        "scale_factor_repeatability",
        "Scale factor repeatability",
        "标度因数重复性",
        "ppm",
        f"{_CYCLES}, each with turns",
    ),
    Quantity("threshold", "Threshold", "阈值", "deg/h", _SMALL),
    Quantity("resolution", "Resolution", "分辨率", "deg/h", _STEPS),
    Quantity("turn_on_time", "Turn-on time", "启动时间", "s", _POWER_ON),
    Quantity("angle_random_walk", "Angle random walk (N)", "随机游走系数", "deg/sqrt(h)", _STATIC, ANNEX_C),
    Quantity("bias_instability", "Bias instability (B)", "", "deg/h", _STATIC, ANNEX_C),
    Quantity("rate_random_walk", "Rate random walk (K)", "", "deg/h/sqrt(h)", _STATIC, ANNEX_C),
    Quantity("quantization_noise", "Quantization noise (Q)", "", "urad", _STATIC, ANNEX_C),
    Quantity("rate_ramp", "Rate ramp (R)", "", "deg/h/h", _STATIC, ANNEX_C),
)
"""In the order of the report. GJB 2426A has no name for what stands empty, as far as public sources tell."""
BY_KEY = {one.key: one for one in QUANTITIES}
TERMS = {
    "angle_random_walk": "N",
    "bias_instability": "B",
    "rate_random_walk": "K",
    "quantization_noise": "Q",
    "rate_ramp": "R",
}
"""Noise terms by their letter in ``noise.json``."""


_KEYS = ("customer", "document", "limits")
_EXAMPLE = "limits: {bias_stability: 0.02, scale_factor_error: {from: -100, to: 100}}"


@dataclass(frozen=True)
class Limit:
    """Values allowed, from `low` to `high`, both included; infinite where there is no bound."""

    low: float
    high: float

    def __post_init__(self) -> None:
        if not self.low <= self.high:
            raise InputError(f"a limit from {self.low:g} to {self.high:g}: the first is the lower one")

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

    def __post_init__(self) -> None:
        _check_known(self.by_quantity)


def read_limits(path: str | Path) -> Limits:
    """The limits of a YAML file.

    A number bounds the size of a figure; ``{from: ..., to: ...}`` its value, either end of which may be
    left out. Beside ``limits`` there may be ``customer`` and ``document``.
    """
    path = Path(path)
    values = read_yaml(path, ("customer", "document"))
    if not isinstance(values, dict) or not isinstance(values.get("limits"), dict):
        raise InputError(f"{path.name}: a mapping 'limits' was expected, e.g. {_EXAMPLE}")
    if unknown := [key for key in values if key not in _KEYS]:
        known = known_are(str(unknown[0]), _KEYS, "known keys")
        raise InputError(f"{path.name}: unknown key {quoted(unknown[0])}; {known}")
    _check_known(values["limits"], f"{path.name}: ")
    found = {
        key: _limit(stated, f"{path.name}: limit of '{key}'") for key, stated in values["limits"].items()
    }
    names = {key: None if values.get(key) is None else str(values[key]) for key in ("customer", "document")}
    return Limits(
        found, names["customer"], names["document"], path.name, hashlib.sha256(path.read_bytes()).hexdigest()
    )


def _check_known(keys: Iterable[Any], where: str = "") -> None:
    for key in keys:
        if key not in BY_KEY:
            raise InputError(f"{where}no quantity {quoted(key)}; {known_are(str(key), BY_KEY)}")


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
