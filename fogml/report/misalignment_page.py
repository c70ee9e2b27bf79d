"""The page of ``fogml lab misalignment``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go

from fogml.arrays import FloatArray
from fogml.numerals import MISSING, in_two, listed, number, percent, plural, stated
from fogml.report import style
from fogml.report.page import Drawing, Tile, render
from fogml.report.tables import Row, Table


def misalignment_page(values: Mapping[str, Any]) -> str:
    """The self-contained HTML page of a ``misalignment.json`` (schema ``fogml.misalignment/1``)."""
    return render(
        "misalignment.html",
        title=f"{values['source']} – scale factor and misalignment",
        name=values["source"],
        values=values,
        verdict=_verdict(values),
        tiles=_tiles(values),
        slopes=slopes_over_tilts(values),
        region=region_figure(values),
        result=result_table(values),
        methods=methods_table(values),
        about=_about(values),
    )


def _verdict(values: Mapping[str, Any]) -> list[str]:
    sentences = [
        f"The input axis lies {number(values['delta_deg'], 4)} deg out of the reference axis; "
        f"the scale factor is {number(values['K'], 7)} {values['unit']}."
    ]
    classical = values["methods"][0]
    if classical["K_difference_ppm"] is not None:
        sentences.append(
            f"The classical test puts the scale factor {number(classical['K_difference_ppm'])} ppm off."
        )
    return sentences


def _tiles(values: Mapping[str, Any]) -> list[Tile]:
    se = values["se"]
    return [
        Tile("Scale factor K", number(values["K"], 7), values["unit"], _within(se.get("K"), values["unit"])),
        Tile(
            "Misalignment x", number(values["delta_x_deg"], 5), "deg", _within(se.get("delta_x_deg"), "deg")
        ),
        Tile(
            "Misalignment y", number(values["delta_y_deg"], 5), "deg", _within(se.get("delta_y_deg"), "deg")
        ),
        Tile(
            "Zero error of the fixture",
            ", ".join(
                number(error).replace(" ", "\N{NO-BREAK SPACE}") for error in values["fixture_error_deg"]
            ),
            "deg",
            "states 1 and 2; 3 and 4",
            "words",
        ),
    ]


def _within(se: float | None, unit: str) -> str:
    return "no standard error" if se is None else f"± {number(se)} {unit} (standard error)"


def _span(low: float, high: float) -> str:
    """An interval with so many digits that its ends differ."""
    digits = 7
    while digits < 10 and low != high and number(low, digits) == number(high, digits):
        digits += 1
    return f"{number(low, digits)} … {number(high, digits)}"


def result_table(values: Mapping[str, Any]) -> Table:
    """Scale factor, misalignment and the fixture's zero errors, with standard errors and intervals."""
    se, intervals = values["se"], values["intervals"]
    rows = []
    for label, key, unit in (
        ("Scale factor K", "K", values["unit"]),
        ("Misalignment x", "delta_x_deg", "deg"),
        ("Misalignment y", "delta_y_deg", "deg"),
        ("Misalignment, whole", "delta_deg", "deg"),
    ):
        ends = intervals.get(key)
        span = MISSING if ends is None else _span(*ends)
        told = in_two(values[key], se[key]) if se.get(key) else (number(values[key], 8), MISSING)
        rows.append((label, *told, span, unit))
    errors = se.get("fixture_error_deg") or [None, None]
    for axis, value, error in zip("xy", values["fixture_error_deg"], errors):
        told = in_two(value, error) if error else (number(value, 5), MISSING)
        rows.append((f"Zero error of the fixture, {axis}", *told, MISSING, "deg"))
    return Table(
        f"Quantity | >Value | >Standard error | >{percent(values['level'], 0)} interval | Unit",
        rows,
        caption="The interval of the whole angle is what the joint region of both components spans.",
    )


def methods_table(values: Mapping[str, Any]) -> Table:
    """What other methods say of the same turns."""
    rows = [
        Row(
            (
                method["name"],
                number(method["K"], 7),
                number(method["K_difference_ppm"]),
                number(method["delta_x_deg"], 4),
                number(method["delta_y_deg"], 4),
                method["why"],
            ),
            "chosen" if method["name"] == "four states" else "",
        )
        for method in values["methods"]
    ]
    return Table(
        f"Method | >K [{values['unit']}] | >less four states [ppm] | >x [deg] | >y [deg] | How", rows
    )


def _about(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    tilts = sorted({tilt for state in values["states"] for tilt in state["tilts_deg"]})
    noise, order_p = values["slope_noise"], values["order_p"]
    across = "fitted" if values["cross_tilt"] else "none fitted"
    if values["cross_tilt_deg"] is not None:
        across += f", {number(values['cross_tilt_deg'])} deg"
    return [
        ("turns", plural(values["turns"], "turn")),
        ("rates", f"{listed([stated(r) for r in values['rates_deg_s']], 12)} deg/s"),
        ("tilts", f"{listed([stated(t) for t in tilts], 12)} deg"),
        ("states", f"turned by {listed([stated(a) for a in values['state_angles_deg']], 4)} deg, clockwise"),
        ("states disagree by chance", "not known" if order_p is None else f"probability {number(order_p)}"),
        ("tilt across", across),
        ("noise of a slope, by the rates", f"{number(noise['by_rates'])} {values['unit']}"),
        ("noise of a slope, by the tilts", f"{number(noise['by_tilts'])} {values['unit']}"),
        ("degrees of freedom", str(values["dof"])),
    ]


def slopes_over_tilts(values: Mapping[str, Any]) -> Drawing:
    """Slopes with the fitted curves above, what is left of them below."""
    panels = {f"slope [{values['unit']}]": 0.62, "left over [ppm of K]": 0.38}
    figure = style.stacked(panels, "tilt of the fixture [deg]", 0.08)
    largest = max(abs(s) for state in values["states"] for s in state["slopes"])
    left = 0.0
    for index, state in enumerate(values["states"]):
        tilts = np.asarray(state["tilts_deg"])
        fine = np.linspace(tilts.min(), tilts.max(), 91)
        terms = [np.cos(np.radians(fine)), np.sin(np.radians(fine)), np.ones_like(fine)]
        curve = sum(c * term for c, term in zip(state["coefficients"], terms))
        residuals = 1e6 * np.asarray(state["residuals"]) / values["K"]
        left = max(left, float(np.abs(residuals).max()))
        looks = style.SERIES[index], style.MARKERS[index]
        fitted = style.SERIES[index], 1.6, style.DASHES[index]
        figure.add_trace(style.line(fine, curve, None, *fitted, showlegend=False, hoverinfo="skip"), 1, 1)
        figure.add_trace(style.points(tilts, state["slopes"], f"state {state['state']}", *looks), 1, 1)
        figure.add_trace(style.points(tilts, residuals, None, *looks, showlegend=False), 2, 1)
    style.styled(figure, 560)
    return Drawing(
        figure,
        alt=(
            f"Output slope against tilt for the four states, up to {number(largest)} {values['unit']}, each "
            f"on a curve of cosine and sine; what is left over is at most {number(left)} ppm of K."
        ),
        caption="Markers: measured; lines: fitted. Below, what the fit leaves: a pattern there is no noise.",
    )


def region_figure(values: Mapping[str, Any]) -> Drawing | None:
    """The joint region of both components, with what the other methods say; None without standard errors."""
    region = values.get("region")
    if not region:
        return None
    outline = np.asarray(region["outline_deg"])
    figure = go.Figure()
    filled = {"fill": "toself", "fillcolor": "rgba(0, 114, 178, 0.18)"}
    words = f"{percent(region['level'], 0)} region"
    figure.add_trace(style.line(outline[:, 0], outline[:, 1], words, style.BLUE, 1.4, **filled))
    there = [values["delta_x_deg"]], [values["delta_y_deg"]]
    figure.add_trace(style.points(*there, "four states", style.BLUE, "cross", 11))
    across, up = (_with_room(outline[:, axis]) for axis in (0, 1))
    figure.update_xaxes(title_text="misalignment x [deg]", nticks=5, range=across)
    figure.update_yaxes(title_text="misalignment y [deg]", range=up)
    style.styled(figure, 420)
    long, short = region["half_axes_deg"]
    return Drawing(
        figure,
        alt=(
            f"Joint {percent(region['level'], 0)} confidence region of the two components about "
            f"{number(values['delta_x_deg'], 5)} and {number(values['delta_y_deg'], 5)} deg: an ellipse with "
            f"half-axes of {number(long)} and {number(short)} deg."
        ),
        caption="Both components at once lie in the ellipse at the stated confidence.",
        half=True,
    )


def _with_room(values: FloatArray, room: float = 0.08) -> list[float]:
    """Ends of an axis that leave a share of what it shows free on either side."""
    free = room * float(np.ptp(values))
    return [float(values.min()) - free, float(values.max()) + free]
