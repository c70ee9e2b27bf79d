"""The page of ``fogml plan``: what each run does over time, and the expected standard errors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import plotly.graph_objects as go

from fogml.gap.planning.rehearsal import FORMS
from fogml.gap.result_parts import Rehearsed
from fogml.numerals import MISSING, duration, listed, number, plural, stated, unit_words
from fogml.report import style
from fogml.report.gap_tables import CONSTANTS
from fogml.report.gap_tables_ahead import rehearsal_table
from fogml.report.page import Drawing, Tile, render
from fogml.report.style import log_axis, time_unit
from fogml.report.tables import Row, Table, columns_of
from fogml.twin.registry import effects

_SWITCHES = ("power", "fan", "compressor")


def programme_drawing(run: Mapping[str, Any]) -> Drawing:
    """Temperatures, table rate and switches of a planned run over time."""
    profile = run["profile"]
    turned = any(profile["table_rate"]["value"])
    switched = [what for what in (*_SWITCHES, "yaw") if what in profile]
    panels = {"temperature [°C]": 2.0}
    panels |= ({"table [deg/s]": 1.0} if turned else {}) | ({"": 1.0} if switched else {})
    total_s = 3600.0 * run["hours"]
    per_unit, unit = time_unit(total_s)
    figure, last = style.stacked(panels, f"time [{unit}]", 0.05), len(panels)
    figure.update_xaxes(range=[0.0, total_s / per_unit])

    def course(name: str) -> tuple[list[float], list[float]]:
        return [time / per_unit for time in profile[name]["time_s"]], profile[name]["value"]

    set_point = profile["set_point"]
    for name, words, colour, dash in (
        ("set_point", "set point", style.BLUE, "solid"),
        ("coil", "coil, expected", style.VERMILION, "dot"),
    ):
        figure.add_trace(style.line(*course(name), words, colour, 1.8, dash, showlegend=True), 1, 1)
    if turned:
        # Rates span five decades of either sign: a symmetrical logarithm shows them all.
        x, rates = course("table_rate")
        signed = [_symmetrical(rate) for rate in rates]
        figure.add_trace(style.line(x, signed, "table rate", style.BLACK, 1.8, showlegend=False), 2, 1)
        ticks = (-100.0, -1.0, -0.01, 0.0, 0.01, 1.0, 100.0)
        told = {rate: f"{rate:g}".replace("-", "−") for rate in ticks}
        _write_ticks(figure, 2, {_symmetrical(rate): text for rate, text in told.items()})
    if switched:
        for level, what in enumerate(switched):
            figure.add_trace(_bar(profile[what], what, level, total_s, per_unit), last, 1)
        _write_ticks(figure, last, {level: _named(what) for level, what in enumerate(switched)})
        figure.update_yaxes(range=[-0.6, len(switched) - 0.4], row=last, col=1)
    style.styled(figure, 200 + 150 * last, legend={"y": 1.03})
    low, high = min(set_point["value"]), max(set_point["value"])
    done = [_named(what) for what in switched]
    return Drawing(
        figure,
        alt=(
            f"{duration(total_s)} between {number(low)} and {number(high)} °C: {run['summary']}."
            + (f" Bars show {listed(done)}." if done else "")
        ),
        caption="Coil: expected from the twin's thermal plant. "
        + (
            "Bars: while it is so." if switched else "The unit is on, the fan runs, the fixture is not yawed."
        ),
    )


def errors_drawing(values: Mapping[str, Any]) -> Drawing | None:
    """Expected standard errors as shares of usual size or prior; None where nothing is wanted."""
    shares = [(e["name"], e["se"] / _size(e)) for e in values["wanted"] if e["se"] and _size(e)]
    if not shares:
        return None
    names, sizes = [name for name, _ in shares], [share for _, share in shares]
    trace = style.points(sizes, names, None, style.BLUE, "diamond", 11)
    trace.update(customdata=list(map(number, sizes)), hovertemplate="%{y}: %{customdata}<extra></extra>")
    figure = go.Figure(trace)
    figure.add_vline(x=1.0, line=style.FLOOR_LINE)
    figure.update_xaxes(
        title_text="expected standard error / prior or usual size",
        **log_axis(min([*sizes, 0.5]), max([*sizes, 2.0])),
    )
    figure.update_yaxes(autorange="reversed", type="category")
    style.styled(figure, 130 + 34 * len(names), showlegend=False)
    return Drawing(
        figure,
        alt="Expected standard error over prior or usual size: "
        + "; ".join(f"{name} {number(share)}" for name, share in shares)
        + ".",
        caption="Left of the dashed line a parameter is known better than before, or than its usual size.",
    )


def _size(error: Mapping[str, Any]) -> float:
    return float(error["prior_se"] if error["prior_se"] is not None else abs(error["usual"]))


def _symmetrical(rate: float) -> float:
    return math.copysign(math.log10(1.0 + abs(rate) / 1e-3), rate)


def _named(what: str) -> str:
    return {"power": "power on", "fan": "fan on", "compressor": "compressor off", "yaw": "yawed"}[what]


def _write_ticks(figure: go.Figure, row: int, texts: Mapping[float, str]) -> None:
    ticks = {"tickmode": "array", "tickvals": list(texts), "ticktext": list(texts.values())}
    figure.update_yaxes(**ticks, row=row, col=1)


def _bar(series: Mapping[str, Any], what: str, level: int, total_s: float, per_unit: float) -> go.Scatter:
    """Stretches in which a switch is on, the compressor off, or the fixture turned."""
    times = [*series["time_s"], total_s]
    xs: list[float | None] = []
    for start, stop, value in zip(times, times[1:], series["value"]):
        shown = value == 0.0 if what == "compressor" else bool(value)
        if shown and stop > start:
            xs += [start / per_unit, stop / per_unit, None]
    ys = [None if x is None else level for x in xs]
    return style.line(xs, ys, _named(what), style.SERIES[level], 9, showlegend=False)


def plan_page(values: Mapping[str, Any]) -> str:
    """The self-contained HTML page of a ``plan.json`` (schema ``fogml.plan/1``)."""
    return render(
        "plan.html",
        title="Plan",
        values=values,
        verdict=verdict_sentences(values),
        tiles=_tiles(values),
        runs=[
            {
                "name": run["programme"],
                "summary": run["summary"],
                "drawing": programme_drawing(run),
                "alternatives": _alternatives(run),
            }
            for run in values["runs"]
        ],
        errors=errors_drawing(values),
        wanted=wanted_table(values),
        correlations=_correlations(values),
        separations=_separations(values),
        rehearsal=planned_rehearsal(values),
        about=_about(values),
    )


def planned_rehearsal(values: Mapping[str, Any]) -> Table | None:
    """What a diagnosis of the planned runs would name; None where it was not asked for."""
    rehearsal = [Rehearsed(**{**r, "named_as": tuple(r["named_as"])}) for r in values.get("rehearsal", ())]
    return rehearsal_table(rehearsal, {id: declared.title for id, declared in effects().items()})


def verdict_sentences(values: Mapping[str, Any]) -> list[str]:
    """What the runs make known, what they don't, and what they tell apart."""
    hidden = [e["name"] for e in values["wanted"] if not e["shown"]]
    close = [s for s in values["separations"] if not s["enough"]]
    shown = [e["name"] for e in values["wanted"] if e["shown"]]
    count = plural(len(values["runs"]), "run")
    sentences = [f"{count} of {number(values['total_hours'])} h in all."]
    if shown:
        sentences.append(f"Known better afterwards: {listed(shown)}.")
    if hidden:
        sentences.append(f"Of what was tried, the best programme does not show {listed(hidden)}.")
    for item in values["separations"]:
        what = " from ".join(item["separates"]) if len(item["separates"]) < 3 else listed(item["separates"])
        verb = "shows" if len(item["separates"]) == 1 else "tells"
        end = "" if len(item["separates"]) < 3 else " apart"
        doing = verb if item not in close else f"does not {verb[:-1]}"
        sentences.append(f"It {doing} {what}{end} (distance {number(item['distance'])}).")
    unnamed = _unnamed(values)
    if unnamed:
        sentences.append(
            f"A diagnosis of these runs, which does not know beforehand what to look for, would not name "
            f"{listed(unnamed)} of usual size."
        )
    return sentences


def _unnamed(values: Mapping[str, Any]) -> list[str]:
    """Effects that are asked for and that the rehearsal says a diagnosis would miss or mistake."""
    asked = {e["name"].partition(".")[0] for e in values["wanted"]}
    asked |= {id for item in values["separations"] for id in item["separates"]}
    usual = {r["effect"]: r["outcome"] for r in values.get("rehearsal", ()) if r["form"] == FORMS[0]}
    return [id for id, outcome in usual.items() if id in asked and outcome != "named"]


def _tiles(values: Mapping[str, Any]) -> list[Tile]:
    tiles = [Tile("Chamber time", number(values["total_hours"]), "h", plural(len(values["runs"]), "run"))]
    for item in values["separations"]:
        name = "Distance" if len(item["separates"]) > 1 else "Length"
        kind = "met" if item["enough"] else "missed"
        note = f"{', '.join(item['separates'])}; from {stated(values['least_distance'])} on"
        tiles.append(Tile(name, number(item["distance"]), "", note, kind))
    for error in values["wanted"][:4]:
        tiles.append(
            Tile(error["name"], number(error["se"]), unit_words(error["unit"]), "expected standard error")
        )
    return tiles


def wanted_table(values: Mapping[str, Any]) -> Table | None:
    """Expected standard errors of what is wanted; None where nothing is."""
    if not values["wanted"]:
        return None
    rows = [
        (
            f"{e['name']}: {CONSTANTS[e['name']]}" if e["name"] in CONSTANTS else e["name"],
            unit_words(e["unit"]),
            number(e["usual"]),
            number(e["prior_se"]),
            number(e["se"]),
            "yes" if e["shown"] else "no",
        )
        for e in values["wanted"]
    ]
    return Table(
        "Wanted | Unit | >Taken as | >Standard error before | >Expected standard error | Shown",
        rows,
        caption="Fitted with the nominal constants under their priors. Shown: a tenth better than before; "
        "of an amplitude, that its usual size is three standard errors.",
    )


def _correlations(values: Mapping[str, Any]) -> Table | None:
    names = [e["name"] for e in values["wanted"]]
    if not 1 < len(names) <= 8:
        return None
    rows = [(name, *(number(c, 2) for c in row)) for name, row in zip(names, values["correlations"])]
    return Table(columns=(*columns_of("Correlation"), *((name, "", "figure") for name in names)), rows=rows)


def _separations(values: Mapping[str, Any]) -> Table | None:
    rows = [
        (pair["true"], pair["taken_for"], number(pair["distance"]), number(item["lengths"][pair["true"]]))
        for item in values["separations"]
        for pair in item["pairs"]
    ]
    rows += [
        (item["separates"][0], MISSING, MISSING, number(item["distance"]))
        for item in values["separations"]
        if not item["pairs"]
    ]
    if not rows:
        return None
    return Table(
        "If it is | and is taken for | >Distance | >Length beside the constants",
        rows,
        caption=(
            "In standard deviations of the noise: what the best fit of the other leaves, amplitude and shape "
            "free, and what the constants leave."
        ),
    )


def _alternatives(run: Mapping[str, Any]) -> Table | None:
    if not run["alternatives"]:
        return None
    wanted = [(e["name"], unit_words(e["unit"])) for e in run["wanted"]][:5]
    groups = [", ".join(s["separates"]) for s in run["separations"]]

    def row(told: Mapping[str, Any], mark: str) -> Row:
        errors = [number(e["se"]) for e in told["wanted"]][:5]
        apart = [number(s["distance"]) for s in told["separations"]]
        return Row((told["summary"], number(told["hours"]), *errors, *apart), mark)

    return Table(
        columns=(
            *columns_of("Programme | >Hours"),
            *((f"Standard error of {name}", unit, "figure") for name, unit in wanted),
            *((f"Distance of {group}", "", "figure") for group in groups),
        ),
        rows=(row(run, "chosen"), *(row(told, "") for told in run["alternatives"])),
        caption="The chosen programme and runners-up; their steps are in plan.json.",
    )


def _about(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    noise, low_high = values["noise"], values["limits_degC"]
    words = {"D": "D: volume of the confidence ellipsoid", "A": "A: mean square of the standard errors"}
    return [
        ("twin", f"{values['twin']} ({values['grade']})"),
        ("criterion", words[values["criterion"]]),
        ("longest run", f"{stated(values['hours'])} h"),
        ("temperatures", f"{stated(low_high[0])} to {stated(low_high[1])} °C"),
        *(
            (name, f"{stated(values[key])} {unit}")
            for name, key, unit in (
                ("fastest ramp", "fastest_ramp_degC_min", "°C/min"),
                ("fastest turn", "fastest_turn_deg_s", "deg/s"),
            )
            if key in values
        ),
        ("noise N", f"{number(noise['N'])} deg/√h"),
        ("noise B", f"{number(noise['B'])} deg/h"),
        ("noise K", f"{number(noise['K'])} deg/h/√h"),
        ("sampling of the figures", f"{stated(values['sample_s']['figures'])} s"),
    ]
