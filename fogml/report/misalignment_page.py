"""The page of ``fogml lab misalignment``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fogml.report.figures_misalignment import region_figure, slopes_over_tilts
from fogml.report.page import Tile, render
from fogml.report.tables import Row, Table
from fogml.report.words import MISSING, listed, number, plural, stated


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
        result=_result(values),
        methods=_methods(values),
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
            f"{number(values['fixture_error_deg'][0])}, {number(values['fixture_error_deg'][1])}",
            "deg",
            "states 1 and 2; 3 and 4",
        ),
    ]


def _within(se: float | None, unit: str) -> str:
    return "no standard error" if se is None else f"± {number(se)} {unit} (standard error)"


def _result(values: Mapping[str, Any]) -> Table:
    se, intervals = values["se"], values["intervals"]
    rows = []
    for label, key, unit in (
        ("Scale factor K", "K", values["unit"]),
        ("Misalignment x", "delta_x_deg", "deg"),
        ("Misalignment y", "delta_y_deg", "deg"),
        ("Misalignment, whole", "delta_deg", "deg"),
    ):
        ends = intervals.get(key)
        span = f"{number(ends[0], 7)} … {number(ends[1], 7)}" if ends else MISSING
        rows.append(Row((label, number(values[key], 8), number(se.get(key)), span, unit)))
    errors = se.get("fixture_error_deg") or [None, None]
    for axis, value, error in zip("xy", values["fixture_error_deg"], errors):
        rows.append(
            Row((f"Zero error of the fixture, {axis}", number(value, 5), number(error), MISSING, "deg"))
        )
    return Table(
        columns=(
            ("Quantity", "", "text"),
            ("Value", "", "figure"),
            ("Standard error", "", "figure"),
            (f"{values['level']:.0%} interval", "", "figure"),
            ("Unit", "", "text"),
        ),
        rows=tuple(rows),
        caption="The interval of the whole angle is what the joint region of both components spans.",
    )


def _methods(values: Mapping[str, Any]) -> Table:
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
        columns=(
            ("Method", "", "text"),
            ("K", values["unit"], "figure"),
            ("less four states", "ppm", "figure"),
            ("x", "deg", "figure"),
            ("y", "deg", "figure"),
            ("How", "", "text"),
        ),
        rows=tuple(rows),
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
