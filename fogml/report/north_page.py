"""The page of ``fogml lab north``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from fogml.numerals import MISSING, duration, listed, number, percent, stated, to_error, with_error
from fogml.report import style
from fogml.report.page import Drawing, Tile, render
from fogml.report.tables import Row, Table, noticed


def north_page(values: Mapping[str, Any]) -> str:
    """The self-contained HTML page of a ``north.json`` (schema ``fogml.north/1``)."""
    recorded = values["kind"] == "recorded"
    name = values["source"] if recorded else "Simulated seek"
    return render(
        "north.html",
        title=f"{name} – north",
        name=name,
        kicker=("North from recorded positions" if recorded else "North seeking under a drift")
        + (" · synthetic data" if values["synthetic"] else ""),
        values=values,
        verdict=verdict_sentences(values),
        tiles=headline_tiles(values),
        circle=error_by_azimuth(values),
        map=error_map(values),
        ways=ways_table(values),
        quiet=None if recorded else _quiet(values),
        stays=_stays(values) if recorded else None,
        about=_about(values),
        findings=noticed(values.get("findings", ())),
    )


def verdict_sentences(values: Mapping[str, Any]) -> list[str]:
    """What was found, and what it holds for."""
    if values["kind"] != "recorded":
        return _simulated_verdict(values)
    within = f" ± {number(values['se'], 2)}" if values["se"] is not None else ""
    sentences = [f"The azimuth is {to_error(values['azimuth_deg'], values['se'])}{within} deg."]
    drift = values["drift_deg_h_per_h"]
    if values["method"] != "plain":
        share = values.get("bend_probability")
        bent = ", and its bend," if values["method"] == "bend-observing" else ""
        if share is not None:
            bent = f", and by {percent(share, 0)} its bend, as probable as that is,"
        sentences.append(
            f"A linear drift of {with_error(drift, values['drift_se'])} deg/h "
            f"per h{bent} is taken out; a plain seek is {number(values['error_deg'])} deg from this one."
        )
    elif drift is not None:
        sentences.append("The standard error of a plain seek holds only where the bias does not drift.")
    if values["se"] is not None:
        held = values["method"] in ("bend-observing", "averaged")
        bends = "" if held else "a bias that bends, as at start-up, and "
        sentences.append(
            "The standard error is of the gyro's noise, flicker and random walk as the stays tell them; it "
            f"does not hold {bends}errors of the table's angles and level."
        )
    return sentences


def _simulated_verdict(values: Mapping[str, Any]) -> list[str]:
    sentences = [
        f"At {values['true_azimuth_deg']:g} deg this drift puts the azimuth off by "
        f"{number(values['error_deg'])} deg."
    ]
    if values["quiet_azimuth_deg"]:
        quiet = " and ".join(f"{a:.1f}" for a in values["quiet_azimuth_deg"])
        worst = " and ".join(f"{a:.1f}" for a in values["worst_azimuth_deg"])
        sentences.append(f"It does nothing at {quiet} deg, and most at {worst} deg.")
    return sentences


def headline_tiles(values: Mapping[str, Any]) -> list[Tile]:
    """The azimuth, its errors, and the drift that is seen."""
    tiles = [
        Tile(
            "Azimuth found",
            to_error(values["azimuth_deg"], values["se"]),
            "deg",
            values.get("method", values.get("way", "")),
        ),
        Tile("Error for the drift", number(values["error_deg"]), "deg", "here"),
    ]
    if values["se"] is not None:
        tiles.append(Tile("Standard error", number(values["se"]), "deg", "of noise"))
    if values.get("greatest_error_deg") is not None:
        tiles.append(Tile("Greatest error", number(values["greatest_error_deg"]), "deg", "over the circle"))
    if values["drift_deg_h_per_h"] is not None:
        tiles.append(
            Tile("Linear drift seen", number(values["drift_deg_h_per_h"]), "deg/h per h", "by the positions")
        )
    return tiles


def ways_table(values: Mapping[str, Any]) -> Table | None:
    """What each way to spend the time comes to, the simulated one marked; None of a recorded seek."""
    if values["kind"] == "recorded":
        return None
    rows = [
        Row(
            (
                name,
                str(told["stays"]),
                number(told["dwell_s"]),
                number(told["error_deg"]),
                number(told["greatest_error_deg"]),
                number(told["rms_error_deg"]),
                number(told["rms_se"]),
            ),
            "chosen" if name == values["way"] else "",
        )
        for name, told in values["ways"].items()
    ]
    return Table(
        "Way | >Stays | >Dwell [s] | >Error here [deg] | >Greatest error [deg] | "
        ">Rms over the circle [deg] | >Standard error of noise, rms [deg]",
        rows,
        caption=f"Every way takes {duration(values['duration_s'])} with transfers. Dwell: of the fine one.",
    )


def _quiet(values: Mapping[str, Any]) -> Table:
    rows = [
        Row(
            (
                "clockwise" if told["sense"] == "cw" else "counter-clockwise",
                _angles(told["order_deg"], ".0f"),
                _angles(told["linear_deg"], ".1f"),
                _angles(told["this_drift_deg"], ".1f"),
            ),
            "chosen" if told["here"] else "",
        )
        for told in values["quiet_by_set_up"]
    ]
    return Table(
        "Positions taken | Order [deg] | >Quiet for a linear drift [deg] | >Quiet for this drift [deg]", rows
    )


def _stays(values: Mapping[str, Any]) -> Table:
    rows = [
        (str(stay["position"]), number(stay["time_s"], 5), number(stay["mean_deg_h"], 6))
        for stay in values["stays"]
    ]
    return Table("Position | >Middle [s] | >Mean [deg/h]", rows)


def _about(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    rows = [
        ("positions taken", "clockwise" if values["sense"] == "cw" else "counter-clockwise"),
        ("order", f"{_angles(values['order_deg'], 'g')} deg"),
        ("horizontal Earth rate", f"{number(values['horizontal_deg_h'], 5)} deg/h"),
    ]
    if values["kind"] == "simulated":
        drift = values["drift"]
        transients = [f"{stated(a)} deg/h with {stated(tau)} s" for a, tau in drift["transients"]]
        difference = values["error_deg"] - values["simulated_error_deg"]
        rows += [
            ("latitude", f"{stated(values['latitude_deg'])} deg"),
            ("dwell, transfer", f"{stated(values['dwell_s'])} s, {stated(values['transfer_s'])} s"),
            ("linear drift", f"{stated(drift['linear_deg_h_per_h'])} deg/h per h"),
            ("transients", listed(transients) or MISSING),
            ("angle random walk", f"{stated(values['random_walk_deg_sqrt_h'])} deg/√h"),
            ("closed form less simulation", _but_rounding(difference)),
        ]
    else:
        rows += [
            ("offset", f"{number(values['offset_deg_h'], 4)} deg/h"),
            ("noise of a sample", f"{number(values['sample_noise_deg_h'])} deg/h"),
            ("plain seek", f"{to_error(values['plain_azimuth_deg'], values['se'])} deg"),
        ]
    return rows


def _but_rounding(difference_deg: float) -> str:
    """A difference of two angles; that of their last bits is none that anybody can see."""
    return "under 10⁻⁹ deg" if abs(difference_deg) < 1e-9 else f"{number(difference_deg, 2)} deg"


def _angles(angles: Sequence[float], form: str) -> str:
    return ", ".join(f"{angle:{form}}" for angle in angles) or "everywhere"


def error_by_azimuth(values: Mapping[str, Any]) -> Drawing | None:
    """A plain seek's error around the circle with quiet and worst azimuths; None where nothing is told."""
    circle = values.get("errors_by_azimuth")
    if not circle:
        return None
    azimuth, error = np.asarray(circle["azimuth_deg"]), np.asarray(circle["error_deg"])
    figure = go.Figure(style.line(azimuth, error, "plain seek", style.BLUE, 2))
    quiet = values["quiet_azimuth_deg"] if values.get("way", "plain") == "plain" else []
    if quiet:
        figure.add_trace(style.points(quiet, [0.0] * len(quiet), "quiet azimuth", style.GREEN, size=11))
    here = values.get("true_azimuth_deg", values["azimuth_deg"])
    at = float(np.interp(here, azimuth, error, period=360.0))
    figure.add_trace(style.points([here], [at], "this seek", style.VERMILION, "diamond-open", 12, 2))
    figure.update_xaxes(title_text="azimuth [deg clockwise from north]", range=[0, 360], dtick=45)
    figure.update_yaxes(title_text="error of the azimuth [deg]")
    style.styled(figure, 400)
    places = " and ".join(f"{a:.1f}" for a in quiet)
    zero = f"; it is nothing at {places} deg" if quiet else ""
    return Drawing(
        figure,
        alt=(
            f"Error of a plain seek against azimuth: between {number(float(error.min()))} and "
            f"{number(float(error.max()))} deg{zero}."
        ),
        caption="Closed form. Dots: azimuths at which this drift does nothing.",
    )


def error_map(values: Mapping[str, Any]) -> Drawing | None:
    """Greatest error of a plain seek over latitude and dwell; None for a recorded seek."""
    told = values.get("maps")
    if not told:
        return None
    greatest = np.asarray(told["greatest_error_deg"])
    dwells = [f"{d:g}" for d in told["dwell_s"]]
    latitudes = [f"{latitude:g}" for latitude in told["latitude_deg"]]
    # Every cell bears its number: nothing has to be read from a colour.
    text = [[number(v, 2) for v in row] for row in greatest]
    figure = go.Figure(
        go.Heatmap(
            x=dwells,
            y=latitudes,
            z=np.log10(np.maximum(greatest, 1e-12)),
            text=text,
            texttemplate="%{text}",
            colorscale="Cividis",
            showscale=False,
            hovertemplate="dwell %{x} s, latitude %{y} deg: %{text} deg<extra></extra>",
        )
    )
    figure.update_xaxes(title_text="dwell in each position [s]", type="category")
    figure.update_yaxes(title_text="latitude [deg]", type="category")
    style.styled(figure, 560)
    return Drawing(
        figure,
        alt=(
            f"Greatest error over the circle for latitudes from {latitudes[0]} to {latitudes[-1]} deg and "
            f"dwells from {dwells[0]} to {dwells[-1]} s: {number(float(greatest.min()))} to "
            f"{number(float(greatest.max()))} deg, larger at high latitude."
        ),
        caption="Numbers: greatest error of a plain seek over all azimuths [deg], for this page's drift.",
    )
