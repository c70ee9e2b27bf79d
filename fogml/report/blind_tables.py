"""A blind score in words, figures, and tables by reality and by distance of form."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import plotly.graph_objects as go

from fogml.blind.folders import DIAGNOSIS
from fogml.blind.methods import ABSTAIN, BASELINES
from fogml.numerals import MISSING, number, percent, short, stated
from fogml.report import style
from fogml.report.page import Drawing
from fogml.report.tables import Table, columns_of

_KINDS = {
    "nothing": "nothing missing",
    "one": "one effect",
    "two": "two effects",
    "three": "three effects",
    "unknown_left_out": "unknown: an effect left out",
    "unknown_invented": "unknown: in no library",
    "unknown_and_known": "unknown + known",
    "wrong_thermal": "wrong thermal structure",
}


def headline(methods: Iterable[str]) -> str:
    """The method that a score is about: the diagnosis, else no baseline, else one that names something."""
    there = list(methods)
    asked = [DIAGNOSIS, *(m for m in there if m not in BASELINES), *(m for m in there if m != ABSTAIN)]
    return next((method for method in asked if method in there), there[0])


def kind_words(kind: str) -> str:
    """The name of a kind of case."""
    return _KINDS.get(kind, kind.replace("_", " "))


def value_text(value: float | None, form: str) -> str:
    """A value by the figure's ``format``."""
    if value is None:
        return MISSING
    if form == "percent":
        return percent(value)
    return f"{number(value)} s" if form == "seconds" else number(value)


def figure_text(row: Mapping[str, Any]) -> str:
    """A figure with its interval, such as ``2.1 % (1.2 % … 3.6 %)``."""
    text = _reached(row)
    if row["low"] is None or row["high"] is None:
        return text
    low, high = (value_text(row[end], row["format"]) for end in ("low", "high"))
    return f"{text} ({low} … {high})"


def _reached(row: Mapping[str, Any]) -> str:
    """The value, with more places than usual where it would seem to lie on what is wanted."""
    value, form = row["value"], row["format"]
    if value is None or form != "percent":
        return value_text(value, form)
    ends = [end for end in (row.get("wanted") or {}).values() if end is not None]
    for places in range(1, 6):
        told = round(100.0 * value, places) / 100.0
        if all((told > end, told < end) == (value > end, value < end) for end in ends):
            break
    return percent(value, places)


def wanted_text(row: Mapping[str, Any]) -> str:
    """What is wanted of a figure, such as ``≤ 2 %``; empty where nothing is."""
    low, high = (row["wanted"][end] for end in ("low", "high"))
    unit = " s" if row["format"] == "seconds" else ""

    def told(value: float) -> str:
        return f"{short(100 * value)} %" if row["format"] == "percent" else f"{stated(value)}{unit}"

    if low is not None and high is not None:
        return f"{told(low)} … {told(high)}"
    if low is not None:
        return f"≥ {told(low)}"
    return f"≤ {told(high)}" if high is not None else ""


_ANYWHERE = (
    "No effect has a size that no gyro has. The first 128 s of a run are in no figure, and d′ counts the "
    "noise of temperature readings. Nobody knows what a held-out run draws for itself (a turn-on bias, the "
    "phase of a line): the truth's closing leaves that open as well, and where it closes less than 5 % it "
    "is compared with nothing."
)
_REALITIES = {
    "first": (
        "A radial line of shells between case and hub by Crank–Nicolson, ramps and soaks, 1/f noise. While "
        "its forms were written they were compared with the catalogue's signatures, and the ranges of some "
        "were drawn in until the best-fitted signature had a cosine above 0.95 as a rule (Bouc–Wen's "
        "exponent, place and shift of the glass transition, slope of the strain's sensitivity, weights of "
        "the winding's layers, leads' and chamber pick-up's lag): its figures say how forms near the "
        "catalogue's are met."
    ),
    "second": (
        "A winding in radius and height between can, spool, base and lid by its own modes; optics and "
        "source that no sensor sits on; a thermostat that cycles; staircases, triangles, cold starts, days,"
        " shocks; noise of any slope; days between runs. Forms come from wide classes (Preisach in grains, "
        "Maxwell slip, Bouc–Wen of any exponent; stretched exponentials and power laws; one or two periods "
        "on the optics; Richards' sigmoid with its own hysteresis; random smooth functions), and none was "
        "taken or left for its likeness to the catalogue."
    ),
    "third": (
        "Ten masses between stirred air and a radiating wall, not linear, by Runge and Kutta's fourth "
        "order; a valve that pulses to cool; paths drawn as a whole; noise of two or three time constants. "
        "Other forms again (Duhem's loops, plays with a dead zone, Eyring's creep, fractional strain, "
        "products of periods, splines), drawn without a catalogue at hand."
    ),
    "same-twin": (
        "No reality: a shipped twin's own runs with its thermometers as shipped, diagnosed against that twin."
    ),
}
_SHOWN = ("right", "exact", "unknown")


def reality_words(name: str) -> str:
    """What must be known of a reality behind the figures."""
    return f"{_REALITIES[name]} {_ANYWHERE}" if name in _REALITIES else _ANYWHERE


def by_reality_table(parts: Mapping[str, Sequence[Mapping[str, Any]]]) -> Table:
    """The wanted figures: a column for all cases, and one for each reality where there are several."""
    names = [name for name in parts if len(parts) > 2 or name != "all"]
    rows = []
    for place, row in enumerate(parts[names[0]]):
        cells = (_cell(parts[name][place]) for name in names)
        rows.append((row["words"], wanted_text(row), *cells))
    return Table(
        columns=(*columns_of("Figure | >Wanted"), *((n, "95 % interval; n", "figure pair") for n in names)),
        rows=rows,
        caption="n is what a figure rests on. Probability from one half on is a name; a far form that is "
        "called by its name is right, called unknown it is a miss. The sentence on top counts the table "
        "'All figures', which has limits of its own.",
    )


def by_form_table(cells: Sequence[Mapping[str, Any]]) -> Table:
    """Single effects: first name's class right, exact, called unknown, by distance of form and d'."""
    rows = []
    for cell in cells:
        low, high = cell["d_prime"]
        told = (value_text(cell[key]["value"], "percent") for key in _SHOWN)
        window, form = f"{short(low)}–{short(high)}", spanned(cell["form"] or MISSING)
        rows.append((cell["reality"], form, window, str(cell["right"]["n"]), *told))
    return Table(
        "Reality | >Cosine [of the catalogue's best member] | >d′ | >Cases | >Class right | "
        ">Exact | >Called unknown",
        rows,
        caption="Cosine of a true effect with the nearest member of the catalogue's form, beside the nominal "
        "constants and after whitening.",
    )


def spanned(name: str) -> str:
    """The name of a bin, such as ``0.8-0.9``, as a page writes it."""
    return re.sub(r"(?<=\d)-(?=\d)", "–", name)


def _cell(row: Mapping[str, Any]) -> str:
    return MISSING if row["value"] is None else f"{figure_text(row)}; {row['n']}"


_HEIGHT = 420
_CHANCE = {"color": style.GREY, "width": 1.2, "dash": "dash"}


def reliability_plot(bins: Sequence[Mapping[str, Any]], error: float | None) -> Drawing:
    """Stated probability against frequency, with Wilson intervals and the diagonal."""
    figure = go.Figure()
    figure.add_scatter(x=[0, 1], y=[0, 1], mode="lines", name="as stated", line=_CHANCE)
    found = [part["found"] for part in bins]
    figure.add_scatter(
        x=[part["stated"] for part in bins],
        y=found,
        error_y=style.error_bars(found, [(part["low"], part["high"]) for part in bins]),
        mode="markers+text",
        text=[str(part["n"]) for part in bins],
        textposition="bottom right",
        textfont={"size": 11},
        marker={"size": 9, "color": style.BLUE},
        name="found, 95 % interval; the number is how many",
    )
    figure.update_xaxes(title_text="stated probability", range=[-0.02, 1.08])
    figure.update_yaxes(title_text="share that is true", range=[-0.1, 1.04])
    style.styled(figure, _HEIGHT)
    return Drawing(
        figure,
        alt=f"Reliability diagram of {len(bins)} bins; expected calibration error {number(error)}.",
        caption="Every listed effect. Below the diagonal: more certain than right.",
        half=True,
    )


def open_set_plot(
    curves: Mapping[str, Mapping[str, Sequence[float]]], areas: Mapping[str, Any]
) -> Drawing | None:
    """True against false positives on the unknown's probability, a line per method; None without a line."""
    shown = [(name, curve) for name, curve in curves.items() if len(curve["false_positive"]) > 2]
    if not shown:
        return None
    figure = go.Figure()
    figure.add_scatter(x=[0, 1], y=[0, 1], mode="lines", name="chance", line=_CHANCE)
    for place, (name, curve) in enumerate(shown):
        x, y = list(curve["false_positive"]), list(curve["true_positive"])
        colour, dash = style.SERIES[place % 7], style.DASHES[place % 7]
        words, width = f"{name} ({number(areas.get(name))})", 2.4 if place == 0 else 1.4
        figure.add_trace(style.line(x, y, words, colour, width, dash))
    figure.update_xaxes(title_text="share of cases without an unknown above the threshold", range=[-0.01, 1])
    figure.update_yaxes(title_text="share of cases with one", range=[0, 1.01])
    style.styled(figure, _HEIGHT)
    told = ", ".join(f"{name} {number(areas.get(name))}" for name, _ in shown)
    return Drawing(
        figure,
        alt=f"Open-set curves; area under each: {told}.",
        caption="In brackets the area under the curve. Methods that say the same everywhere are not drawn.",
        half=True,
    )


def confusion_plot(values: Mapping[str, Any]) -> Drawing:
    """Which effect was answered where one is missing, in shares of each row."""
    counts = values["counts"]
    totals = [max(sum(row), 1) for row in counts]
    shares = [[count / total for count in row] for row, total in zip(counts, totals)]
    figure = go.Figure(
        go.Heatmap(
            z=shares,
            x=list(values["answered"]),
            y=list(values["true"]),
            text=[[str(count) if count else "" for count in row] for row in counts],
            texttemplate="%{text}",
            textfont={"size": 10},
            colorscale=[[0.0, "#FFFFFF"], [0.5, style.SKY_BLUE], [1.0, style.BLUE]],
            zmin=0.0,
            zmax=1.0,
            xgap=1,
            ygap=1,
            colorbar={"title": {"text": "share"}, "thickness": 12},
            hovertemplate="%{y}: answered %{x}, %{text} of the cases<extra></extra>",
        )
    )
    figure.update_yaxes(autorange="reversed", title_text="truly missing", tickfont={"size": 11})
    figure.update_xaxes(title_text="answered", tickangle=-60, tickfont={"size": 11})
    style.styled(figure, 260 + 20 * len(values["true"]))
    right = sum(row[i] for i, row in enumerate(counts))
    total = sum(map(sum, counts))
    return Drawing(
        figure,
        alt=f"Confusion over {total} cases with one missing effect: {right} in a named class.",
        caption=(
            "Cases with one missing effect. A hit is an effect that is in a named class; otherwise the most "
            "certain name counts, or unknown, or nothing. Numbers are cases, colours shares of a row."
        ),
    )


def strata_plot(rows: Sequence[Mapping[str, Any]]) -> Drawing:
    """How some figures grow better with the strength of what is missing."""
    figure = go.Figure()
    told = []
    for place, row in enumerate(rows):
        parts = row["by_stratum"]
        if not parts:
            continue
        names, values = [spanned(name) for name in parts], [part["value"] for part in parts.values()]
        figure.add_scatter(
            x=names,
            y=values,
            error_y=style.error_bars(values, [(p["low"], p["high"]) for p in parts.values()], thickness=1),
            mode="lines+markers",
            name=row["words"].replace(", d′ > 10", ""),
            line={"color": style.SERIES[place % 7], "dash": style.DASHES[place % 7]},
            marker={"symbol": style.MARKERS[place % 7], "size": 8},
        )
        told.append(f"{row['words']}: {', '.join(percent(value) for value in values)}")
    figure.update_xaxes(title_text="d′ of the weakest missing effect", type="category")
    figure.update_yaxes(title_text="share of cases", range=[-0.02, 1.02])
    # Room between the legend and the tools that appear above it.
    style.styled(figure, _HEIGHT + 40, margin={"t": 84})
    return Drawing(
        figure,
        alt="Figures by stratum of d′. " + "; ".join(told),
        caption="d′: length of what is missing, whitened, less what the nominal constants make up for.",
    )
