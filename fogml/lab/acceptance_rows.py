"""The quantities of an acceptance report: each one's name here and in the standards, its unit, what it needs.

IEEE Std 952-1997 and GJB 2426A-2004 are not public. A clause stands only where the open literature cites it,
which is annex C of IEEE Std 952-1997, the Allan variance.
"""

from __future__ import annotations

from dataclasses import dataclass

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
    ieee_952
        Its name in IEEE Std 952.
    gjb_2426a
        Its name in GJB 2426A.
    unit
        Unit of its values.
    needs
        What a run has to hold to tell it.
    clause
        Clause of IEEE Std 952-1997, where a public source cites it.
    """

    key: str
    name: str
    ieee_952: str
    gjb_2426a: str
    unit: str
    needs: str
    clause: str = ""


_RATES = "turns of a rate table (column rate)"
_LADDER = "four rates of a rate table or more, of both senses"
_SOAKS = "soaks at temperatures 5 degC apart or more"
_CYCLES = "six runs or more of the unit"
_STATIC = "a run long enough, at constant temperature"

QUANTITIES = (
    Quantity("bias", "Bias", "bias", "零偏", "deg/h", "a run"),
    Quantity(
        "bias_stability", "Bias stability, of the averages", "bias stability", "零偏稳定性", "deg/h", "a run"
    ),
    Quantity(
        "bias_stability_10s",
        "Bias stability, 10 s averages",
        "bias stability",
        "零偏稳定性",
        "deg/h",
        "a sample in 5 s or more often",
    ),
    Quantity(
        "bias_repeatability", "Bias repeatability", "bias repeatability", "零偏重复性", "deg/h", _CYCLES
    ),
    Quantity(
        "temperature_sensitivity",
        "Bias temperature sensitivity",
        "bias temperature sensitivity",
        "零偏温度灵敏度",
        "deg/h/degC",
        _SOAKS,
    ),
    Quantity(
        "hysteresis",
        "Thermal hysteresis of the bias",
        "thermal hysteresis",
        "",
        "deg/h",
        "soaks at one temperature, on the way up and on the way down",
    ),
    Quantity("scale_factor_error", "Scale factor error", "scale factor", "标度因数", "ppm", _RATES),
    Quantity(
        "scale_factor_nonlinearity",
        "Scale factor nonlinearity",
        "scale factor nonlinearity",
        "标度因数非线性度",
        "ppm",
        _LADDER,
    ),
    Quantity(
        "scale_factor_asymmetry",
        "Scale factor asymmetry",
        "scale factor asymmetry",
        "标度因数不对称性",
        "ppm",
        "rates of both senses, and rest",
    ),
    Quantity(
        "scale_factor_temperature_sensitivity",
        "Scale factor temperature sensitivity",
        "scale factor temperature sensitivity",
        "标度因数温度灵敏度",
        "ppm/degC",
        "turns of a rate table in soaks 5 degC apart or more",
    ),
    Quantity(
        "scale_factor_repeatability",
        "Scale factor repeatability",
        "scale factor repeatability",
        "标度因数重复性",
        "ppm",
        f"{_CYCLES}, each with turns",
    ),
    Quantity(
        "threshold",
        "Threshold",
        "threshold",
        "阈值",
        "deg/h",
        "small rates of both senses about zero, Earth rate turned away",
    ),
    Quantity(
        "resolution",
        "Resolution",
        "resolution",
        "分辨率",
        "deg/h",
        "small steps of the rate on top of a larger one",
    ),
    Quantity(
        "turn_on_time",
        "Turn-on time",
        "turn-on time",
        "启动时间",
        "s",
        "a stated power-on (powered_on) and a band (--turn-on-band)",
    ),
    Quantity(
        "angle_random_walk",
        "Angle random walk (N)",
        "angle random walk",
        "随机游走系数",
        "deg/sqrt(h)",
        _STATIC,
        ANNEX_C,
    ),
    Quantity(
        "bias_instability",
        "Bias instability (B)",
        "bias instability",
        "",
        "deg/h",
        _STATIC,
        ANNEX_C,
    ),
    Quantity(
        "rate_random_walk",
        "Rate random walk (K)",
        "rate random walk",
        "",
        "deg/h/sqrt(h)",
        _STATIC,
        ANNEX_C,
    ),
    Quantity(
        "quantization_noise",
        "Quantization noise (Q)",
        "quantization noise",
        "",
        "urad",
        _STATIC,
        ANNEX_C,
    ),
    Quantity("rate_ramp", "Rate ramp (R)", "rate ramp", "", "deg/h/h", _STATIC, ANNEX_C),
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
