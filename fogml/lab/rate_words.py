"""The results of ``fogml lab rate`` as rows, for terminal and page alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from fogml.lab.rate_response import HALF_POWER
from fogml.numerals import in_two, number, unit_words, with_error


class ResultRow(NamedTuple):
    """A quantity as it is shown."""

    quantity: str
    value: str
    se: str
    unit: str
    remark: str


def verdict_sentences(values: Mapping[str, Any]) -> list[str]:
    """What a ``rate.json`` comes to: the scale factor, or what there is in its place; then what limits it."""
    line, held, band = values["scale_factor"], values["range"], values["bandwidth"]
    sentences = []
    if line is not None:
        straight = ""
        if line["nonlinearity_ppm"] is not None:
            straight = f", linear within {number(line['nonlinearity_ppm'])} ppm"
        reach = "" if held is None else f" up to {number(held['followed_deg_s'])} deg/s"
        off = _within_90(1e6 * (line["scale_factor"] - 1.0), _ppm_off(line), "ppm")
        sentences.append(f"The scale factor is {off} off the nominal one{straight}{reach}.")
        if held is not None and held["exceeded_deg_s"] is not None:
            sentences.append(f"At {number(held['exceeded_deg_s'])} deg/s the output no longer follows.")
    elif band is not None and band["half_power_hz"] is not None:
        sentences.append(f"The bandwidth is {number(band['half_power_hz'])} Hz.")
    sensed = values["temperature_sensitivity"]
    if sensed is not None:
        told = _within_90(sensed["ppm_per_degC"], sensed["ci90"], "ppm/°C")
        sentences.append(f"It moves by {told} with temperature.")
    return sentences or ["These runs tell no scale factor; the notes say what it needs."]


def _within_90(value: float, ends: Sequence[float] | None, unit: str) -> str:
    """``16.7 ± 0.3 ppm (90 %)``."""
    if ends is None or not ends[1] > ends[0]:
        return f"{number(value)} {unit}"
    return f"{with_error(value, 0.5 * (ends[1] - ends[0]))} {unit} (90 %)"


def result_rows(values: Mapping[str, Any]) -> list[ResultRow]:
    """What a ``rate.json`` tells, quantity by quantity; what was not tested is left out."""
    return [row._replace(unit=unit_words(row.unit) or row.unit) for row in _rows(values)]


def _rows(values: Mapping[str, Any]) -> list[ResultRow]:
    rows = []
    line = values["scale_factor"]
    if line is not None:
        off = 1e6 * (line["scale_factor"] - 1.0)
        ppm = f"{'+' if off > 0.0 else ''}{_within_90(off, _ppm_off(line), 'ppm')}"
        told = f"{line['scale_factor']:.7f}", number(line["se"])
        rows.append(
            ResultRow(
                "scale factor", *(in_two(line["scale_factor"], line["se"]) if line["se"] else told), "1", ppm
            )
        )
        for name, words in (("nonlinearity", _from_to), ("asymmetry", _plus_minus)):
            if line[f"{name}_ppm"] is not None:
                remark = words(line[f"{name}_ci90_ppm"])
                rows.append(ResultRow(name, number(line[f"{name}_ppm"]), "", "ppm", remark))
    held = values["range"]
    if held is not None:
        remark = "all that was tested"
        if held["exceeded_deg_s"] is not None:
            beyond, output = number(held["exceeded_deg_s"]), number(held["output_deg_s"])
            remark = f"not {beyond} deg/s; the output is {output} deg/s beyond"
        rows.append(ResultRow("range, followed up to", number(held["followed_deg_s"]), "", "deg/s", remark))
    for key, name in (
        ("threshold", "threshold"),
        ("dead_zone", "dead zone, its width"),
        ("resolution", "resolution"),
    ):
        if values[key] is not None:
            rows.append(ResultRow(name, bracketed(values[key]), "", "deg/h", ""))
    rows += _response(values)
    sensed = values["temperature_sensitivity"]
    if sensed is not None:
        remark = f"over {len(sensed['temperature'])} temperatures"
        remark += f", {_plus_minus(sensed['ci90'], 'ppm/°C')}" if sensed["ci90"] is not None else ""
        told = in_two(sensed["ppm_per_degC"], sensed["se"])
        rows.append(ResultRow("temperature sensitivity", *told, "ppm/degC", remark))
        if sensed["curvature_ppm_per_degC2"] is not None:
            curve = number(sensed["curvature_ppm_per_degC2"])
            rows.append(ResultRow("its curvature", curve, "", "ppm/degC2", ""))
    if values["count_arcsec"] is not None:
        rows.append(ResultRow("one count", number(values["count_arcsec"]), "", "arcsec", "of angle"))
    return rows


def _ppm_off(line: Mapping[str, Any]) -> list[float] | None:
    """The ends of the scale factor's interval, in ppm off the nominal one."""
    return None if line["ci90"] is None else [1e6 * (end - 1.0) for end in line["ci90"]]


def _plus_minus(ends: Sequence[float] | None, unit: str = "ppm") -> str:
    """``90 %: ± 0.30 ppm``."""
    return "" if ends is None else f"90 %: ± {number(0.5 * (ends[1] - ends[0]), 2)} {unit}"


def _from_to(ends: Sequence[float] | None) -> str:
    """``90 %: 12 to 15 ppm``."""
    if ends is None:
        return ""
    told = f"90 %: {number(ends[0])} to {number(ends[1])} ppm"
    return told if ends[0] > 0.0 else f"{told}; noise alone may make as much"


def _response(values: Mapping[str, Any]) -> list[ResultRow]:
    rows = []
    band = values["bandwidth"]
    if band is not None:
        if band["half_power_hz"] is not None:
            between = number(band["half_power_hz"])
            remark = "gain 0.707, between the frequencies tested"
        else:
            scale = (values["scale_factor"] or {"scale_factor": 1.0})["scale_factor"]
            gains = sorted((one["frequency_hz"], one["gain"]) for one in values["gains"])
            low = gains[0][1] < HALF_POWER * abs(scale)
            between = f"< {number(gains[0][0])}" if low else f"> {number(gains[-1][0])}"
            remark = "gain 0.707 lies beyond the frequencies tested"
        rows.append(ResultRow("bandwidth", between, "", "Hz", remark))
        if band["first_order_hz"] is not None:
            first = number(band["first_order_hz"])
            rows.append(ResultRow("of a first-order loop", first, number(band["se"]), "Hz", "all gains"))
    limit = values["slew"]
    if limit is not None:
        remark = f"the table has {number(limit['table_deg_s2'])} deg/s²"
        name = "slew" if limit["limited"] else "slew, at least"
        # What the output shows beyond the table's own is its noise.
        told = (
            limit["output_deg_s2"] if limit["limited"] else min(limit["output_deg_s2"], limit["table_deg_s2"])
        )
        rows.append(ResultRow(name, number(told), "", "deg/s2", remark))
    return rows


def bracketed(found: Mapping[str, float | None]) -> str:
    """``0.2 to 0.5``, ``at most 0.001``, ``above 50``; ``within noise`` where no rate tells a side."""
    above, below = found["above_deg_h"], found["below_deg_h"]
    if above is None and below is None:
        return "within noise"
    if below is None:
        return f"above {number(above)}"
    return f"at most {number(below)}" if not above else f"{number(above)} to {number(below)}"
