"""The page of ``fogml lab rate``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from markupsafe import Markup

from fogml.lab.rate_words import result_rows, verdict_sentences
from fogml.numerals import number, stated, unit_words
from fogml.pictures import Curve, line_figure
from fogml.report import style
from fogml.report.page import Tile, render
from fogml.report.tables import Table, noticed


def rate_page(values: Mapping[str, Any]) -> str:
    """The self-contained HTML page of a ``rate.json`` (schema ``fogml.rate/1``)."""
    return render(
        "rate.html",
        title=f"{values['source']} – rate table",
        name=values["source"],
        kicker="Tests on a rate table" + (" · synthetic data" if values["synthetic"] else ""),
        values=values,
        verdict=verdict_sentences(values),
        tiles=_tiles(values),
        result=result_table(values),
        figures=[
            figure for figure in (_ladder(values), _small(values), _gains(values), _warm(values)) if figure
        ],
        about=_about(values),
        unit=_unit(values["unit"]),
        findings=noticed(values.get("findings", ())),
    )


def _tiles(values: Mapping[str, Any]) -> list[Tile]:
    tiles = []
    line, band, held = values["scale_factor"], values["bandwidth"], values["range"]
    if line is not None:
        error = number(1e6 * (line["scale_factor"] - 1.0))
        tiles.append(Tile("Scale factor", error, "ppm", "off the nominal one"))
    for key, name in (("threshold", "Threshold"), ("dead_zone", "Dead zone"), ("resolution", "Resolution")):
        if values[key] is not None:
            tiles.append(_bracket_tile(name, values[key]))
    if band is not None and band["half_power_hz"] is not None:
        tiles.append(Tile("Bandwidth", number(band["half_power_hz"]), "Hz", "gain 0.707"))
    if held is not None:
        beyond = held["exceeded_deg_s"] is not None
        note = "followed" if beyond else "followed, all that was tested"
        tiles.append(Tile("Range", number(held["followed_deg_s"]), "deg/s", note))
    return tiles


def _bracket_tile(name: str, found: Mapping[str, float | None]) -> Tile:
    """The size that is seen, and the one that is not."""
    above, below = found["above_deg_h"], found["below_deg_h"]
    if below is None:
        return Tile(name, f"> {number(above)}", "deg/h", "none that was tested is seen")
    return Tile(name, number(below), "deg/h", f"more than {number(above)}" if above else "or less")


def result_table(values: Mapping[str, Any]) -> Table:
    """What the tests tell, quantity by quantity."""
    rows = tuple(tuple(row) for row in result_rows(values))
    return Table("Quantity | >Value | >Standard error | Unit | Remark", rows)


def _ladder(values: Mapping[str, Any]) -> tuple[str, Markup, str] | None:
    line, held = values["scale_factor"], values["range"]
    if line is None:
        return None
    (told,) = (one for one in values["ladder"] if one["run"] in values["told_by"]["scale_factor"])
    rate, output = np.asarray(told["rate_deg_h"]), np.asarray(told["output_deg_h"])
    order = np.argsort(rate)
    rate, output = rate[order], output[order]
    left = output - line["scale_factor"] * rate
    within = np.abs(rate) <= 3600.0 * held["followed_deg_s"] * (1.0 + 1e-9)
    greatest = float(np.abs(rate[within]).max())
    shown = 1e6 * np.where(within, left - left[within].mean(), np.nan) / greatest
    figure = line_figure(
        [Curve(rate / 3600.0, shown, style.BLUE, dots=True)],
        "rate [deg/s]",
        "off the line [ppm]",
        "Output less the line through it, over the rate",
    )
    words = (
        "In ppm of the greatest rate, within the range; a kink about zero is asymmetry, a bend nonlinearity."
    )
    return "Output over the rate", figure, words


def _small(values: Mapping[str, Any]) -> tuple[str, Markup, str] | None:
    curves = []
    for key, name, colour in (
        ("zero_answers", "rates about zero", style.BLUE),
        ("step_answers", "steps on a larger rate", style.VERMILION),
    ):
        answers = values[key]
        if len(answers) > 1:
            size, share = (np.array([one[part] for one in answers]) for part in ("size", "share"))
            curves.append(Curve(size, share, colour, dots=True, label=name))
    if not curves:
        return None
    ends = np.array([min(c.x.min() for c in curves), max(c.x.max() for c in curves)])
    wanted = values["criteria"]["answers"]
    curves.append(Curve(ends, np.full(2, wanted), style.BLACK, dash="4 3", label="seen from here on"))
    figure = line_figure(
        curves, "size [deg/h]", "share that shows", "Share of a rate that shows, over its size", log="x"
    )
    return "Threshold and resolution", figure, "The share of a rate, or of a step, that the output shows."


def _gains(values: Mapping[str, Any]) -> tuple[str, Markup, str] | None:
    gains = values["gains"]
    if len(gains) < 2:
        return None
    f = np.array([one["frequency_hz"] for one in gains])
    order = np.argsort(f)
    gain = np.array([one["gain"] for one in gains])[order]
    f = f[order]
    curves = [Curve(f, gain, style.BLUE, dots=True, label="measured")]
    first = values["bandwidth"]["first_order_hz"] if values["bandwidth"] else None
    if first is not None:
        fine = np.geomspace(f[0], f[-1], 200)
        scale = abs(values["scale_factor"]["scale_factor"]) if values["scale_factor"] else 1.0
        curve = scale / np.sqrt(1.0 + (fine / first) ** 2)
        curves.append(Curve(fine, curve, style.VERMILION, dash="6 3", label="first-order loop"))
    curves.append(Curve(f[[0, -1]], np.full(2, np.sqrt(0.5)), style.BLACK, dash="4 3", label="0.707"))
    figure = line_figure(curves, "frequency [Hz]", "gain", "Gain of the output over frequency", log="x")
    return "Gain over frequency", figure, "Amplitude of the output over that of the table's rate."


def _warm(values: Mapping[str, Any]) -> tuple[str, Markup, str] | None:
    sensed = values["temperature_sensitivity"]
    if sensed is None:
        return None
    temperature, scale = np.asarray(sensed["temperature"]), np.asarray(sensed["scale_factor"])
    figure = line_figure(
        [Curve(temperature, 1e6 * (scale / scale.mean() - 1.0), style.BLUE, dots=True)],
        "temperature [°C]",
        "scale factor [ppm]",
        "Scale factor over temperature, less its mean",
    )
    return "Scale factor over temperature", figure, "Less its mean; one point a soak."


def _about(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    told = values["criteria"]
    return [
        ("runs", ", ".join(values["runs"])),
        ("a rate is seen from", f"{stated(told['answers'])} of the expected output on (IEEE Std 952)"),
        ("a zone is dead below", f"{stated(told['dead'])} of the expected change (IEEE Std 952)"),
        ("the range ends at", f"{stated(told['range_error'])} off the line of the rates below"),
        ("rates about zero", f"below {stated(told['small'])} of the greatest"),
        ("beyond a limit is", f"what lies {stated(told['errors'])} standard errors beyond it"),
        ("left out as noise", f"answers with a standard error above {stated(told['doubt'])}"),
    ]


_UNIT = (
    ("sagnac_s", "Sagnac constant K_S", "rad per rad/s"),
    ("phase_urad_per_deg_h", "phase of 1 deg/h", "µrad"),
    ("transit_us", "transit time", "µs"),
    ("proper_frequency_khz", "proper frequency", "kHz"),
    ("fringe_deg_s", "a fringe", "deg/s"),
    ("half_fringe_deg_s", "half a fringe", "deg/s"),
    ("winding_deg_h_per_degC_min", "winding, by d(T_out - T_in)/dt", "deg/h per degC/min"),
    ("winding_settling_s", "a profile across it settles in", "s"),
    ("midpoint_deg_h_per_degC_min_m", "mid-point error", "deg/h per degC/min and m"),
    ("lead_deg_h_per_degC_min_m", "lead", "deg/h per degC/min and m"),
    ("photon_walk_deg_sqrt_h", "photon noise at 20 µW, π/2", "deg/√h"),
)


def _unit(facts: Mapping[str, Any] | None) -> Table | None:
    """What follows from the unit's coil and receiver."""
    if facts is None:
        return None
    rows = [(name, number(facts[key], 4), unit_words(unit)) for key, name, unit in _UNIT]
    caption = (
        f"{stated(facts['length_m'])} m of fibre on {stated(facts['diameter_m'])} m, "
        f"{stated(facts['wavelength_nm'])} nm, {facts['winding']} winding of {facts['layers']} layers, "
        f"leads of {' and '.join(stated(length) for length in facts['leads_m'])} m."
    )
    columns = "Quantity | >Value | Unit"
    return Table(columns, rows, caption)
