"""What `monitor.json` says, in sentences and figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import plotly.graph_objects as go

from fogml.fleet.summary import label_of
from fogml.intervals import Z90
from fogml.numerals import number, plural, stated
from fogml.report import style
from fogml.report.figures_fleet import serial_axis
from fogml.report.page import Drawing
from fogml.report.style import log_axis

FIGURE_WORDS = {
    "level": "bias",
    "temperature_slope": "slope against temperature",
    "rate_slope": "slope against the rate of temperature",
    "scatter": "scatter",
    "scale_factor": "scale factor error",
}
STATE_WORDS = {"baseline": "first runs", "steady": "steady", "alarm": "changed"}


def unit_label(unit: Mapping[str, Any]) -> str:
    """Serial number and axis, or that there is none."""
    return label_of(unit) or "(no name)"


def state_words(unit: Mapping[str, Any]) -> str:
    """A unit's state in a word or two, with its last change."""
    words = STATE_WORDS[unit["state"]]
    if unit["alarms"]:
        words += f": {FIGURE_WORDS[unit['alarms'][-1]['figure']]} since {onset_words(unit['alarms'][-1])}"
    return words


def onset_words(alarm: Mapping[str, Any]) -> str:
    """When a change began: the day where it is known, else the run."""
    started = alarm["onset_started"]
    return str(started)[:10] if started else str(alarm["onset"])


def alarm_words(alarm: Mapping[str, Any]) -> str:
    """An alarm in a few sentences."""
    figure = FIGURE_WORDS[alarm["figure"]]
    if alarm["figure"] == "scatter" and alarm["shape"] == "step":
        how = f"is {_size(alarm)}"
    else:
        how = f"{'drifts' if alarm['shape'] == 'ramp' else 'moves'} by {_size(alarm)}"
    if alarm["off_course"]:
        how += " off its course of the runs before"
    first, last = alarm["onset_ci90"]
    between = "" if first == last else f", with 90 % between {first} and {last}"
    told = f" With the runs since the evidence is down to {number(alarm['latest_statistic'])}."
    further = (" It goes on." if alarm["goes_on"] else "") if alarm["stands"] else told
    return (
        f"The {figure} {how} since {onset_words(alarm)} ({alarm['onset']}{between}); noticed with "
        f"{alarm['raised_at']}.{further} Effects that do so: {', '.join(alarm['nearest'])}."
    )


def outlier_words(outlier: Mapping[str, Any]) -> str:
    """A run that a figure is off in alone, in a sentence."""
    figure, by = FIGURE_WORDS[outlier["figure"]], "" if outlier["figure"] == "scatter" else "off by "
    return (
        f"The {figure} of {outlier['run']} alone is {by}{_size(outlier)}: no change, as the runs up to "
        f"{outlier['told_at']} tell, and does not count for what is usual. Look for what was wrong with it."
    )


def _size(told: Mapping[str, Any]) -> str:
    """A size with its interval; the scatter's, a logarithm, as a factor where it is no ramp's."""
    values = [told["size"], *told["size_ci90"]]
    if told["figure"] == "scatter" and told.get("shape") != "ramp":
        values = [math.exp(min(value, 50.0)) for value in values]
        return f"{number(values[0])} times the usual (90 %: {_interval(*values[1:])})"
    return f"{number(values[0])} {told['unit']} (90 %: {_interval(*values[1:])})"


def calibration_words(unit: Mapping[str, Any]) -> str:
    """When to calibrate again, in a sentence; empty where nothing is known."""
    told = unit["calibration"]
    if told is None:
        return ""
    due, (earliest, latest) = told["due_days"], told["due_ci90"]
    beyond = f"the bias has moved by {number(told['limit_deg_h'])} deg/h"
    if latest is None:
        span = unit["age"][-1] - unit["age"][0]
        if earliest is not None and earliest < span:
            return f"Too few runs to foretell when {beyond}: no trend is seen in {_days(span)}."
        soonest = "100 years" if earliest is None else _days(earliest)
        return f"No trend is seen: not before {soonest} (95 %) will it be that {beyond}."
    if latest == 0.0:
        return f"Calibrate now: by the line through its runs {beyond}."
    return f"Calibrate again in {_days(due)} (90 %: {_days(earliest)} to {_days(latest)}), when {beyond}."


def _days(days: float | None) -> str:
    if days is None:
        return "over 100 years"
    if days < 60:
        return plural(max(round(days), 1), "day")
    return plural(round(days / 30.44), "month") if days < 730 else plural(round(days / 365.25), "year")


def _interval(low: float | None, high: float | None) -> str:
    return f"{number(low)} … {number(high)}"


_UNITS = {
    "level": "deg/h",
    "temperature_slope": "deg/h/°C",
    "rate_slope": "deg/h/(°C/min)",
    "scatter": "deg/h",
    "scale_factor": "ppm",
}


def run_figures(unit: Mapping[str, Any]) -> Drawing:
    """Every figure over the unit's age, with the changes and the runs that they were noticed with."""
    told = [name for name in FIGURE_WORDS if any(run[name] is not None for run in unit["runs"])]
    told = told or ["level"]
    titles = [f"{FIGURE_WORDS[n].replace('slope against the', 'slope,')}<br>[{_UNITS[n]}]" for n in told]
    axis, age = _age_axis(unit), unit["age"]
    heights = dict.fromkeys(titles, 1.0)
    figure = style.stacked(heights, axis["title_text"], 0.16 / len(told), title_font_size=11)
    figure.update_xaxes(**axis, row=len(told), col=1)
    for row, name in enumerate(told, start=1):
        values = [shown_figure(run, name) for run in unit["runs"]]
        bars = _bars(unit["runs"], name) | {"color": style.TRAINING, "thickness": 1, "width": 2}
        figure.add_scatter(
            x=age,
            y=values,
            mode="lines+markers",
            error_y=bars,
            line={"color": style.TRAINING, "width": 1},
            marker={"size": 7, "color": style.BLUE},
            customdata=[
                [run["run"], number(value, 4)] for run, value in zip(unit["runs"], values, strict=True)
            ],
            hovertemplate="%{customdata[0]}<br>%{customdata[1]}<extra></extra>",
            showlegend=False,
            row=row,
            col=1,
        )
        if name == "scatter":
            seen = [value for value in values if value is not None]
            figure.update_yaxes(**log_axis(min(seen), max(seen)), row=row, col=1)
        if name == "level":
            half = unit["runs"][-1]["half_width"]
            style.floor_lines(figure, half, row)
            figure.update_yaxes(range=_with_room(half, values, bars), row=row, col=1)
        off = [one["index"] for one in unit["outliers"] if one["figure"] == name]
        if off:
            crosses = [age[i] for i in off], [values[i] for i in off]
            figure.add_trace(style.points(*crosses, None, style.VERMILION, "x", 13, **style.SILENT), row, 1)
        for alarm in unit["alarms"]:
            if alarm["figure"] == name:
                figure.add_vline(
                    x=alarm["onset_age"], line={"color": style.VERMILION, "width": 2}, row=row, col=1
                )
                raised = alarm["raised_at_index"]
                figure.add_trace(
                    style.ring([age[raised]], [values[raised]], None, 16, **style.SILENT), row, 1
                )
    style.styled(figure, 90 + 150 * len(told))
    changes = "; ".join(f"{FIGURE_WORDS[a['figure']]} since {onset_words(a)}" for a in unit["alarms"])
    return Drawing(
        figure,
        alt=f"Figures of {plural(len(age), 'run')}. {'Changed: ' + changes if changes else 'No change'}.",
        caption=(
            "What the model leaves on each run; bars: how well the run tells it, 90 %. Red line: where a "
            "change began; red circle: the run that it was noticed with; red cross: a run that is off alone, "
            "which does not count for what is usual. Dashed: the model's 90 % interval for averages."
        ),
    )


def _with_room(half: float, values: Sequence[float | None], bars: Mapping[str, Any]) -> list[float]:
    """Ends of an axis that holds the values, their bars and lines at `half` on either side of zero."""
    told = zip(values, bars["array"], bars["arrayminus"], strict=True)
    ends = [end for value, up, down in told if value is not None for end in (value + up, value - down)]
    low, high = min([-half, *ends]), max([half, *ends])
    return [low - 0.06 * (high - low), high + 0.06 * (high - low)]


def _bars(runs: Sequence[Mapping[str, Any]], name: str) -> dict[str, Any]:
    """Ends of the intervals of 90 % of a figure's values, as people read them, beyond and below each."""
    beyond, below = [], []
    for run in runs:
        value, error = shown_figure(run, name), run.get(f"{name}_se")
        half = 0.0 if error is None else Z90 * error
        if name == "scatter" and value is not None:
            beyond.append(value * math.expm1(half))
            below.append(-value * math.expm1(-half))
        else:
            beyond.append(half)
            below.append(half)
    return {"type": "data", "symmetric": False, "array": beyond, "arrayminus": below}


def shown_figure(run: Mapping[str, Any], name: str) -> float | None:
    """A figure of a run as people read it: the scatter itself, not its logarithm."""
    value: float | None = run[name]
    return math.exp(value) if name == "scatter" and value is not None else value


_LEAST_DRAWN = 1e-2  # of an evidence, on an axis that has no zero


def evidence(unit: Mapping[str, Any], limit: float) -> Drawing:
    """The evidence of change after each run, against the limit."""
    values = [max(value, _LEAST_DRAWN) for value in unit["statistic"]]
    curve = style.line(
        unit["age"], values, "evidence of change", style.BLUE, 2, mode="lines+markers", marker={"size": 6}
    )
    limited = style.line([None], [None], "limit", style.VERMILION, 1.5, "dash")
    figure = go.Figure([curve, limited])
    figure.add_hline(y=limit, line=limited.line.to_plotly_json())
    figure.update_yaxes(title_text="evidence, logarithmic", **log_axis(min(values), max(*values, 2 * limit)))
    figure.update_xaxes(**_age_axis(unit))
    style.styled(figure, 300)
    return Drawing(
        figure,
        alt=f"Evidence of change after each run, at most {number(max(unit['statistic']))}, "
        f"against a limit of {stated(limit)}.",
        caption=(
            f"Where nothing changes, the evidence passes the limit once in {stated(limit)} runs or less "
            f"often. What is below {stated(_LEAST_DRAWN)} is drawn there; the first runs tell no evidence. "
            "After an alarm it begins anew with the runs since the change."
        ),
    )


def levels(units: Sequence[Mapping[str, Any]]) -> Drawing:
    """The last run's bias of every unit with the model's interval, changed units apart."""
    labels = [unit_label(unit) for unit in units]
    figure = go.Figure()
    for state, symbol, colour in (("steady", "circle", style.GREEN), ("alarm", "x", style.VERMILION)):
        some = [i for i, unit in enumerate(units) if (unit["state"] == "alarm") == (state == "alarm")]
        if not some:
            continue
        last = [units[i]["runs"][-1] for i in some]
        x, y = [labels[i] for i in some], [run["level"] for run in last]
        name = "changed" if state == "alarm" else "not changed"
        bars = {"type": "data", "array": [run["half_width"] for run in last]}
        looks = {"thickness": 1, "width": 2, "color": style.TRAINING}
        figure.add_trace(style.points(x, y, name, colour, symbol, 10, error_y={**bars, **looks}))
    serial_axis(figure, labels)
    figure.update_yaxes(title_text="bias left by the model [deg/h]")
    style.styled(figure, 380)
    changed = sum(unit["state"] == "alarm" for unit in units)
    return Drawing(
        figure,
        alt=f"Bias of the last run of {plural(len(units), 'unit')}; {changed} changed.",
        caption="The last run of each unit; bars: the model's 90 % interval for averages.",
    )


def _age_axis(unit: Mapping[str, Any]) -> dict[str, Any]:
    if unit["age_unit"] == "d":
        return {"title_text": "days since the first run"}
    # A tick at every run where there are few: there is nothing between two runs.
    return {"title_text": "runs since the first", "dtick": max(1, len(unit["age"]) // 10)}
