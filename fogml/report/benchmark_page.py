"""The page of ``fogml benchmark score``: every entry of both tracks, the rules, what was measured."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import plotly.graph_objects as go

from fogml.benchmark.score import ALL, FIGURES
from fogml.numerals import MISSING, number, percent, plural, short
from fogml.report import style
from fogml.report.page import Drawing, render
from fogml.report.style import log_axis
from fogml.report.tables import Table, columns_of

_WORDS = (
    (
        "rms / nothing",
        "rms of averages of the held-out run with the drift taken off, over the rms with only the training "
        "runs' mean taken off; geometric mean over the cases",
    ),
    ("harmful", "cases where that rms exceeds doing nothing by more than the noise floor of the run"),
    ("coverage", "share of averages within the stated 90 % interval"),
    ("width", "full width of that interval over the rms of doing nothing, geometric mean"),
    ("known cause", "one that a candidate of the catalogue stands for; named: probability of 0.5 or more"),
    ("unknown", "a cause that no candidate stands for: told as unknown with 0.5 or more and no wrong name"),
    (
        "DX 2025",
        "the probability that an answer puts on the true cause, what is listed scaled to 1 where it is more; "
        "a class shares its probability evenly",
    ),
    (
        "in brackets",
        "95 % intervals: Wilson's for shares, of the central limit theorem for means and logarithms, order "
        "statistics for medians; cases are taken as independent, which axes of one unit are not",
    ),
)


def benchmark_page(values: Mapping[str, Any]) -> str:
    """The self-contained HTML page of a ``score.json`` (schema ``fogml.benchmark/1``)."""
    drift = drift_table(values)
    return render(
        "benchmark.html",
        title="Benchmark",
        verdict=_verdict(values),
        drift=drift,
        ratios=_ratios(values) if drift else None,
        drift_groups=drift_groups(values),
        diagnosis=diagnosis_table(values),
        rules=values["round"]["rules"],
        about=_about(values),
        words=(*_WORDS, ("averages", _averages(values))),
    )


def _averages(values: Mapping[str, Any]) -> str:
    """What figures of drift are averages over, by data."""
    told = {case["group"]: case["averaging_s"] for case in values["cases"]["drift"].values()}
    spans = ", ".join(f"{group} {short(span)} s" for group, span in told.items())
    start = values["round"]["design"]["settling_s"]
    return f"of drift: {spans}; the first {start:g} s of a held-out run enter no figure"


def _ranked(values: Mapping[str, Any]) -> list[str]:
    entries = values["drift"]
    return sorted(entries, key=lambda name: entries[name]["figures"][ALL]["ratio"]["value"])


def _verdict(values: Mapping[str, Any]) -> list[str]:
    sentences = []
    if values["drift"]:
        best = _ranked(values)[0]
        ratio = value_text(values["drift"][best]["figures"][ALL]["ratio"])
        least = " the least of the drift:" if len(values["drift"]) > 1 else ""
        sentences.append(f"{best} leaves{least} {ratio} of what doing nothing leaves.")
    if values["diagnosis"]:
        told = {name: one["figures"][ALL]["mass_on_true"] for name, one in values["diagnosis"].items()}
        mass = {name: one for name, one in told.items() if one["value"] is not None}
        if mass:
            best = max(mass, key=lambda name: mass[name]["value"])
            most = "the most " if len(told) > 1 else ""
            sentences.append(
                f"{best} puts {most}probability on the true cause: {value_text(mass[best])} on average."
            )
    return sentences


def drift_table(values: Mapping[str, Any]) -> Table | None:
    """Every entry of the drift track over all cases, the least ratio first; None without one."""
    if not values["drift"]:
        return None
    rows = []
    for name in _ranked(values):
        told = values["drift"][name]["figures"][ALL]
        rows.append(
            (
                name,
                value_text(told["ratio"]),
                number(told["worst"]),
                share_text(told["harmful"]),
                value_text(told["coverage"]),
                value_text(told["width"]),
                MISSING if told["bytes"] is None else f"{told['bytes']:.0f}",
                str(told["failed"]),
            )
        )
    columns = (
        "Entry | >>Rms / nothing | >Worst | >>Harmful | >>Coverage of 90 % | >>Width / nothing | "
        ">Model [byte] | >Failed"
    )
    count = plural(len(values["cases"]["drift"]), "case")
    return Table(columns, rows, f"Drift models, {count}, all groups together.")


def drift_groups(values: Mapping[str, Any]) -> Table | None:
    """What each entry of the drift track leaves by data; None without one."""
    if not values["drift"]:
        return None
    names = _ranked(values)
    groups = [group for group in values["drift"][names[0]]["figures"] if group != ALL]
    rows = []
    for name in names:
        figures = values["drift"][name]["figures"]
        rows.append((name, *(value_text(figures[group]["ratio"]) for group in groups)))
    counts = [values["drift"][names[0]]["figures"][group]["cases"] for group in groups]
    heads = tuple((f"{group} ({count})", "", "figure pair") for group, count in zip(groups, counts))
    return Table((*columns_of("Entry"), *heads), rows, "Rms / nothing by data; cases in brackets.")


def diagnosis_table(values: Mapping[str, Any]) -> Table | None:
    """Every entry of the diagnosis track; None without one."""
    entries = values["diagnosis"]
    if not entries:
        return None
    rows = []
    for key, (words, _) in FIGURES.items():
        parts = [one["figures"][ALL][key] for one in entries.values()]
        share = key in ("found", "false", "unknown", "quiet")
        rows.append((words, *((share_text if share else value_text)(part) for part in parts)))
    rows.append(("cases that failed", *(str(one["figures"][ALL]["failed"]) for one in entries.values())))
    count = plural(len(values["cases"]["diagnosis"]), "case")
    heads = tuple((name, "", "figure pair") for name in entries)
    return Table((*columns_of("Figure"), *heads), rows, f"Diagnoses, {count}, synthetic.")


def value_text(told: Mapping[str, Any]) -> str:
    """A figure with its interval."""
    if told["value"] is None:
        return MISSING
    if told["low"] is None:
        return number(told["value"], 2)
    return f"{number(told['value'], 2)} ({number(told['low'], 2)} … {number(told['high'], 2)})"


def share_text(told: Mapping[str, Any]) -> str:
    """Hits of cases, with the share's interval."""
    if told["value"] is None:
        return MISSING
    hits = round(told["value"] * told["n"])
    return f"{hits} of {told['n']} ({percent(told['low'])} … {percent(told['high'])})"


def _ratios(values: Mapping[str, Any]) -> Drawing:
    names = _ranked(values)
    told = {name: values["drift"][name]["figures"][ALL]["ratio"] for name in names}
    groups = [group for group in values["drift"][names[0]]["figures"] if group != ALL]
    figure = go.Figure()
    shown: list[float] = [1.0]
    for place, group in enumerate(groups):
        x = [values["drift"][name]["figures"][group]["ratio"]["value"] for name in names]
        shown += x
        look = place % len(style.SERIES)
        figure.add_trace(style.points(x, names, group, style.SERIES[look], style.MARKERS[look]))
    middle = [t["value"] for t in told.values()]
    ends = [(t["low"] or t["value"], t["high"] or t["value"]) for t in told.values()]
    bars = style.error_bars(middle, ends, color=style.BLACK)
    looks = style.BLACK, "line-ns-open", 16, 3
    figure.add_trace(style.points(middle, names, "all, with 95 % interval", *looks, error_x=bars))
    figure.add_vline(x=1.0, line=style.FLOOR_LINE)
    shown += [v for t in told.values() for v in (t["low"], t["high"]) if v]
    axis = log_axis(0.9 * min(shown), 1.1 * max(shown))
    figure.update_xaxes(title_text="rms / doing nothing, logarithmic", **axis)
    figure.update_yaxes(autorange="reversed")
    style.styled(figure, 190 + 34 * len(names))
    words = "; ".join(f"{name} {number(told[name]['value'], 2)}" for name in names)
    return Drawing(
        figure,
        alt=f"What each entry leaves over what doing nothing leaves, the best first: {words}.",
        caption="Geometric means by data, and of all cases. Dashed: as good as doing nothing.",
    )


def _about(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    told = values["round"]
    seed = "closed: kept by who made it" if told["closed"] else f"open, seed {told['seed']}"
    groups = dict.fromkeys(case["group"] for case in values["cases"]["drift"].values())
    made = "synthetic units of realities that share no code with the twin"
    legs = "legs of recordings of MEMS units (no fibre-optic gyro) that ship, MIT licence"
    data = dict.fromkeys(
        made if group.startswith("synthetic, ") else legs if group.endswith(", MEMS") else group
        for group in groups
    )
    return [
        ("round", seed),
        ("SHA-256 of round.json", told["handout_sha256"]),
        ("made by, scored by", f"fogml {told['made_by']}, fogml {values['version']}"),
        ("data", "; ".join(data)),
    ]
