"""Figures of where a structural gap lies: by regime, stage, temperature and time scale."""

from __future__ import annotations

from collections.abc import Sequence

import plotly.graph_objects as go

from fogml.gap.result_parts import Share, TemperatureExcess, TimescaleExcess
from fogml.numerals import duration, listed, number, percent
from fogml.report import style
from fogml.report.page import Drawing
from fogml.report.style import log_axis, regime_word

_STAGE_WORDS = {
    "rig": "rig: table, chamber, mount",
    "sensor": "temperature sensor",
    "thermal": "thermal plant",
    "loop": "loop electronics",
}
Spread = tuple[float, float]


def _points(
    x: Sequence[float],
    y: Sequence[str] | Sequence[float],
    bounds: Sequence[Spread],
    clear: Sequence[bool],
    *,
    horizontal: bool,
) -> list[go.Scatter]:
    """Markers with intervals, filled where the excess is significant."""
    traces = []
    for words, symbol, wanted in (
        ("over the noise", "circle", True),
        ("within the noise", "circle-open", False),
    ):
        rows = [i for i, flag in enumerate(clear) if flag is wanted]
        if not rows:
            continue
        value = [float((x if horizontal else y)[i]) for i in rows]
        spread = style.error_bars(value, [bounds[i] for i in rows], thickness=1.6, width=5)
        colour = style.MODEL if wanted else style.GREY
        bars = {"error_x" if horizontal else "error_y": spread}
        there = [x[i] for i in rows], [y[i] for i in rows]
        traces.append(style.points(*there, words, colour, symbol, 10, 2, **bars))
    return traces


def by_regime(shares: Sequence[Share]) -> Drawing:
    """Excess of the structural gap over the floor in each regime, with its share of the energy."""
    labels = [f"{regime_word(s.name)} ({percent(s.share)})" for s in shares]
    values = [s.excess_rms or 0.0 for s in shares]
    bounds = [s.excess_rms_ci90 or (v, v) for s, v in zip(shares, values, strict=True)]
    figure = go.Figure(_points(values, labels, bounds, [s.significant for s in shares], horizontal=True))
    figure.update_xaxes(title_text="excess rms over the floor [deg/h]", rangemode="tozero")
    figure.update_yaxes(categoryorder="array", categoryarray=labels[::-1], type="category")
    style.styled(figure, 118 + 36 * len(shares), legend={"y": 1.03})
    told = "; ".join(
        f"{regime_word(s.name)} {number(s.excess_rms)} deg/h, {percent(s.share)}" for s in shares
    )
    return Drawing(
        figure,
        alt=f"Excess of the gap over the floor and share of its energy, by regime: {told}.",
        caption="By regime, with the share of the structural gap's energy. Bars: 90 % intervals."
        + ("" if any(s.significant for s in shares) else " No regime stands out: the shares mean little."),
        half=True,
    )


def by_timescale(items: Sequence[TimescaleExcess]) -> Drawing:
    """Ratio of the structural gap to the floor by averaging time."""
    taus, values = [t.tau_s for t in items], [t.excess for t in items]
    figure = go.Figure(
        _points(taus, values, [t.ci90 for t in items], [t.significant for t in items], horizontal=False)
    )
    figure.add_hline(y=1.0, line=style.FLOOR_LINE)
    figure.add_trace(style.floor_in_legend())
    seen = [v for t in items for v in (t.excess, *t.ci90) if v > 0.05] + [1.0]
    figure.update_xaxes(title_text="averaging time [s]", **log_axis(min(taus), max(taus)))
    figure.update_yaxes(title_text="gap / floor [1]", **log_axis(min(seen), max(seen)))
    style.styled(figure, 334)
    worst = max(items, key=lambda t: t.excess)
    clear = [t for t in items if t.significant]
    return Drawing(
        figure,
        alt="Ratio of the gap to the noise floor by averaging time: "
        + "; ".join(f"{duration(t.tau_s)}: {number(t.excess)}" for t in items)
        + ".",
        caption=(
            f"By time scale: 1 is the noise alone. Largest at {duration(worst.tau_s)}: "
            f"{number(worst.excess)} times the floor."
            if clear
            else "By time scale: 1 is the noise alone; no time scale stands out of it."
        ),
        half=True,
    )


def by_stage(shares: Sequence[Share], is_named: bool) -> Drawing:
    """Shares of the structural gap by stage of the chain; `is_named` tells whether any cause is."""
    labels = [_STAGE_WORDS.get(s.name, s.name.replace("_", " ")) for s in shares]
    values = [100.0 * s.share for s in shares]
    figure = go.Figure(
        go.Bar(
            x=values,
            y=labels,
            orientation="h",
            marker_color=style.BLUE,
            text=[percent(s.share) for s in shares],
            textposition="auto",
            showlegend=False,
            name="share",
        )
    )
    figure.update_xaxes(title_text="share of the energy [%]", range=[0, 105])
    figure.update_yaxes(categoryorder="array", categoryarray=labels[::-1], type="category")
    style.styled(figure, 110 + 34 * len(shares), margin={"t": 14}, bargap=0.35)
    return Drawing(
        figure,
        alt="Share of the structural gap by stage: "
        + "; ".join(f"{w} {percent(s.share)}" for w, s in zip(labels, shares, strict=True))
        + ".",
        caption="By stage of the chain in which what was found acts."
        if is_named
        else "By stage of the chain in which what is left would act, by its looks: no cause is named.",
        half=True,
    )


def by_temperature(bins: Sequence[TemperatureExcess]) -> Drawing:
    """Excess of the structural gap over the floor in each span of temperature."""
    figure = go.Figure()
    for words, colour, pattern, wanted in (
        ("over the noise", style.MODEL, "", True),
        ("within the noise", style.GREY, "/", False),
    ):
        rows = [b for b in bins if b.significant is wanted]
        if rows:
            figure.add_bar(
                x=[0.5 * (b.from_degc + b.to_degc) for b in rows],
                y=[b.excess_rms for b in rows],
                width=[0.9 * (b.to_degc - b.from_degc) for b in rows],
                name=words,
                marker={
                    "color": colour,
                    "pattern": {"shape": pattern, "fillmode": "overlay", "fgcolor": "white"},
                },
            )
    figure.update_xaxes(title_text="T [°C]")
    figure.update_yaxes(title_text="excess rms [deg/h]", rangemode="tozero")
    style.styled(figure, 334, barmode="overlay")
    clear = [b for b in bins if b.significant]
    told = listed([f"{number(b.from_degc)} to {number(b.to_degc)} °C" for b in clear], 4)
    return Drawing(
        figure,
        alt="Excess of the gap over the floor by temperature: "
        + "; ".join(
            f"{number(b.from_degc)} to {number(b.to_degc)} °C {number(b.excess_rms)} deg/h" for b in bins
        )
        + ".",
        caption=f"By temperature, over the floor. Over the noise at: {told}."
        if clear
        else "By temperature, over the floor: nowhere over the noise.",
        half=True,
    )
