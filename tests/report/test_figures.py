"""Figures against closed forms: what is drawn is what was judged."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
from scipy.stats import chi2

from fogml.gap.result import HowFar
from fogml.pictures import Curve, line_figure
from fogml.report.compare_page import residuals_in_time, rms_bars
from fogml.report.figures_gap import _parted, how_far_strip
from fogml.report.figures_gap_evidence import variance_ratios
from fogml.report.figures_judgement import (
    DRAWN_POINTS,
    direction_of,
    drift_against_temperature,
    drift_in_time,
    rms_by_regime,
)
from fogml.report.figures_noise import _span, term_deviation
from fogml.report.index_page import loop_between, loops
from fogml.report.inspect_page import temperature_rates
from fogml.report.page import Drawing, _Drawings
from fogml.report.plan_page import programme_drawing
from fogml.report.style import segments_of, shade
from fogml.report.sweep_page import pareto_front
from fogml.runs.run import Run
from tests.report.judgements import FLOOR, judged_run, judgement
from tests.report.procedure_pages import written


def traces(drawing: Drawing) -> dict[str, Any]:
    return {trace.name: trace for trace in drawing.figure.data}


def test_the_model_is_drawn_as_what_takes_before_to_after() -> None:
    run = judged_run(offset=0.05)
    shown = traces(drift_in_time(run))
    assert np.allclose(shown["drift before"].y - shown["model"].y, shown["left after"].y)
    assert np.allclose(shown["left after"].x * 3600.0, run.series.time)


def test_the_band_stays_within_the_stretches() -> None:
    run = judged_run(gap=True)
    band = traces(drift_in_time(run))["90 % band"]
    time = run.series.time / 3600.0
    edge = int(np.argmax(np.diff(time)))
    x = np.asarray(band.x, dtype=float)
    assert not np.any((x > time[edge]) & (x < time[edge + 1]))
    assert np.isnan(x).sum() == 2
    assert np.nanmax(band.y) == pytest.approx(run.series.upper.max())


def test_flagged_averages_are_marked_and_unflagged_are_not() -> None:
    marked = traces(drift_in_time(judged_run(outside=0.2)))["outside training"]
    run = judged_run(outside=0.2)
    assert len(marked.x) == int((run.series.flag == 1).sum()) > 0
    assert "outside training" not in traces(drift_in_time(judged_run()))
    many = traces(drift_in_time(judged_run(n=20 * DRAWN_POINTS, outside=0.9)))["outside training"]
    assert 0 < len(many.x) <= DRAWN_POINTS


def test_warming_and_cooling_are_drawn_apart() -> None:
    run = judged_run()
    shown = [t for t in drift_against_temperature(run).figure.data if t.xaxis in (None, "x")]
    by_name = {t.name: t for t in shown}
    assert np.mean(by_name["warming"].y) - np.mean(by_name["cooling"].y) > 0.4
    counts = {name: len(by_name[name].x) for name in ("warming", "cooling", "steady")}
    assert sum(counts.values()) == len(run.series.time)
    # The model stands with what it was fitted to, and not with what it left.
    assert np.ptp(by_name["model"].y) == pytest.approx(np.ptp(run.series.before - run.series.after), rel=0.05)


def test_directions_by_the_dead_band() -> None:
    rate = np.array([0.2, 0.051, 0.05, 0.0, -0.05, -0.051, np.nan])
    series = replace(judged_run().series, rate=rate)
    assert direction_of(series).tolist() == [1, 1, 0, 0, 0, -1, 0]


def test_rms_by_regime_is_the_rms_and_adds_up() -> None:
    run = judged_run(left=0.2)
    after = traces(rms_by_regime(run))["after"]
    assert after.x[0] == pytest.approx(run.after.rms)
    counts = [np.sum(run.series.regime == name) for name in ("start_up", "ramp_up", "ramp_down", "soak")]
    assert np.average(np.square(after.x[1:]), weights=counts) == pytest.approx(run.after.rms**2)
    assert [label.split(" (")[0] for label in after.y[1:]] == ["start-up", "ramp up", "ramp down", "soak"]


def test_bars_are_the_worst_test_run() -> None:
    models = {"rbf": judgement(3), "mean": judgement(3, left=1.0)}
    bars = rms_bars(models, ["rbf", "mean"]).figure.data[0]
    assert bars.x[0] == max(run.after.rms for run in models["rbf"].test)
    assert list(bars.y) == ["rbf", "mean"]


def test_residuals_share_one_scale() -> None:
    models = {"rbf": judgement(), "mean": judgement(left=1.0)}
    layout = residuals_in_time(models, ["rbf", "mean"], "b.csv").figure.layout
    assert layout.yaxis2.matches == "y" or layout.yaxis.matches == "y2"


def test_the_loop_between_two_runs_is_their_distance() -> None:
    base = judged_run(n=4000).series
    temperature = np.linspace(-20.0, 60.0, 4000)
    first = replace(base, temperature=temperature, before=0.01 * temperature)
    second = replace(base, temperature=temperature, before=0.01 * temperature + 0.3)
    loop = loop_between(first, second)
    assert loop is not None
    assert loop.rms == pytest.approx(0.3) and loop.widest == pytest.approx(0.3)
    assert loop_between(first, replace(second, temperature=temperature + 200.0)) is None


@pytest.mark.parametrize(
    ("name", "at_one_hour"),
    [("N", 1.0), ("K", 1 / np.sqrt(3)), ("R", 1 / np.sqrt(2)), ("B", np.sqrt(2 * np.log(2) / np.pi))],
)
def test_terms_by_their_definition_at_one_hour(name: str, at_one_hour: float) -> None:
    assert term_deviation(name, 2.0, np.array([3600.0]))[0] == pytest.approx(2.0 * at_one_hour)


def test_quantisation_in_microradians() -> None:
    # sigma = sqrt(3) Q / tau, with 1 urad = 0.20626 arcsec, over 1 s in deg/h.
    assert term_deviation("Q", 2.0, np.array([1.0]))[0] == pytest.approx(np.sqrt(12) * 0.2062648, rel=1e-6)


@pytest.mark.parametrize(("name", "slope"), [("Q", -1.0), ("N", -0.5), ("B", 0.0), ("K", 0.5), ("R", 1.0)])
def test_terms_have_the_slopes_of_the_standard(name: str, slope: float) -> None:
    low, high = term_deviation(name, 0.3, np.array([10.0, 1000.0]))
    assert np.log10(high / low) / 2.0 == pytest.approx(slope, abs=1e-12)


def test_temperature_rates_of_a_ramp() -> None:
    time = np.arange(7200.0)
    run = Run.from_columns(time=time, gyro=time * 0, T=0.5 * time / 60.0)
    rate_time, rate, gaps = temperature_rates(run)["T"]
    assert np.allclose(rate, 0.5) and gaps.size == 0
    assert rate_time[0] > 0.0 and rate_time[-1] < 7200.0


def test_temperature_rates_do_not_cross_a_gap() -> None:
    time = np.concatenate([np.arange(3600.0), 20000.0 + np.arange(3600.0)])
    temperature = np.where(time < 10000.0, 10.0, 50.0)
    rate_time, rate, gaps = temperature_rates(Run.from_columns(time=time, gyro=time * 0, T=temperature))["T"]
    assert np.all(rate == 0.0) and len(gaps) == 1
    assert rate_time[gaps[0]] > 20000.0 > rate_time[gaps[0] - 1]


def test_regimes_become_bands_that_stop_at_gaps() -> None:
    time = np.array([0.0, 1.0, 2.0, 3.0, 50.0, 51.0])
    names = np.array(["soak", "soak", "ramp_up", "ramp_up", "ramp_up", "ramp_up"])
    assert segments_of(time, names) == [("soak", 0.0, 1.5), ("ramp_up", 1.5, 3.0), ("ramp_up", 50.0, 51.0)]


def test_a_thousand_regimes_stay_quick() -> None:
    figure = drift_in_time(judged_run()).figure
    before = len(figure.layout.shapes)
    shade(figure, [("soak" if i % 2 else "ramp_up", float(i), float(i + 1)) for i in range(1000)])
    assert len(figure.layout.shapes) - before <= 200


def test_a_regime_too_brief_to_be_seen_has_no_band_wherever_it_is() -> None:
    figure = go.Figure()
    named = shade(figure, [("soak", 0.0, 50.0), ("ramp_up", 50.0, 50.001), ("ramp_down", 50.001, 100.0)])
    assert len(figure.layout.shapes) == 2 and "ramp_up" not in " ".join(named)


def test_a_run_of_slow_samples_is_averaged_over_two_at_least() -> None:
    time = 50.0 * np.arange(300)
    run = Run.from_columns(time=time, gyro=0.0 * time, T=0.5 * time / 60.0)
    rate_time, rate, _ = temperature_rates(run)["T"]
    assert rate == pytest.approx(0.5) and np.diff(rate_time) == pytest.approx(100.0)


def test_what_closes_has_a_line_through_its_three_figures_on_each_run() -> None:
    items = [HowFar(run, 100.0, 0.5, 0.3, 0.01, FLOOR, 0.9, None) for run in ("b.csv", "c.csv")]
    for trace in how_far_strip(items, named=True).figure.data:
        assert len(trace.x) == len(trace.y)


def test_figures_of_a_page_are_numbered_one_by_one() -> None:
    figure = re.compile(r'id="figure-(\d+)"')
    drawings = _Drawings()
    told = [drawings(drift_in_time(judged_run())) for _ in range(3)]
    assert [figure.findall(str(one)) for one in told] == [["1"], ["2"], ["3"]]


def test_alternative_texts_hold_the_figures() -> None:
    run = judged_run()
    for drawing in (drift_in_time(run), drift_against_temperature(run), rms_by_regime(run)):
        assert "b.csv" in drawing.alt or "Rms" in drawing.alt
        assert "deg/h" in drawing.alt and drawing.caption
    assert str(FLOOR) in rms_by_regime(run).alt


def test_the_small_figure_draws_gaps_as_gaps() -> None:
    x, y = np.arange(5.0), np.array([0.0, 1.0, np.nan, 1.0, 2.0])
    svg = line_figure([Curve(x, y, "#000000")], "time [h]", "drift [deg/h]", "a <curve>")
    outline = next(path for path in svg.split("<path ") if 'fill="none"' in path)
    assert outline.count("M") == 2 and outline.count("L") == 2
    assert "a &lt;curve&gt;" in svg


def test_the_small_figure_of_a_constant_is_drawn() -> None:
    svg = line_figure([Curve(np.arange(3.0), np.full(3, 2.0), "#000000")], "x", "y", "constant")
    assert "nan" not in svg


def test_labels_beyond_six_digits_are_powers_of_ten_as_pages_write_them() -> None:
    svg = line_figure([Curve(np.arange(2.0), np.array([0.0, 2e6]), "#000000")], "x", "y", "large")
    assert {"0", "10⁶", "2 × 10⁶"} == set(re.findall('text-anchor="end">([^<]+)<', svg))
    svg = line_figure([Curve(np.arange(2.0), np.array([-2e-5, 2e-5]), "#000000")], "x", "y", "small")
    assert {"−2 × 10⁻⁵", "0", "2 × 10⁻⁵"} == set(re.findall('text-anchor="end">([^<]+)<', svg))


def test_labels_of_a_small_span_far_from_zero_are_told_apart() -> None:
    """A rate of 123456.6 to 123457.2 deg/h: labels differ, and each is the value at its height."""
    y = np.array([123456.6, 123457.2])
    svg = line_figure([Curve(np.arange(2.0), y, "#000000")], "x", "y", "far")
    told = re.findall(r'y="([0-9.]+)" text-anchor="end">([0-9.]+)<', svg)
    heights, values = np.array(told, dtype=np.float64).T
    assert len(told) > 2 and len(set(values)) == len(values)
    assert (
        np.ptp(np.diff(values) / np.diff(heights))
        < 1e-3 * abs(np.diff(values) / np.diff(heights)).max() + 1e-3
    )


def test_the_small_figure_has_a_legend_dots_and_logarithmic_axes() -> None:
    x, y = np.array([1.0, 10.0, 100.0]), np.array([0.01, 0.1, 1.0])
    curve = Curve(x, y, "#000000", label="left & right", dots=True)
    svg = line_figure([curve], "window [s]", "error [deg/h]", "grows", log="xy")
    assert "left &amp; right" in svg
    places = [
        [float(part.split('"')[1]) for part in (circle.split("cx=")[1], circle.split("cy=")[1])]
        for circle in svg.split("<circle ")[1:]
    ]
    assert len(places) == 3
    # Equal ratios are equal steps, and the middle lies midway.
    np.testing.assert_allclose(places[1], np.mean([places[0], places[2]], axis=0), atol=0.11)
    for tick in ("1", "10", "100", "0.01", "0.1"):
        assert f">{tick}</text>" in svg
    plain = line_figure([Curve(x, y, "#000000")], "window [s]", "error [deg/h]", "grows")
    assert "<circle" not in plain and "left" not in plain


def test_a_wide_band_does_not_flatten_what_is_left() -> None:
    run = judged_run()
    series = replace(run.series, lower=-100.0 * run.series.upper, upper=100.0 * run.series.upper)
    drawing = drift_in_time(replace(run, series=series))
    low, high = drawing.figure.layout.yaxis3.range
    assert low < run.series.after.min() and run.series.after.max() < high
    assert high - low < 6.0 * np.abs(run.series.after).max()
    assert "reaches beyond the panel" in drawing.caption
    assert "beyond" not in drift_in_time(run).caption


def test_long_serial_numbers_are_written_by_where_they_differ() -> None:
    from fogml.report.figures_fleet import serial_axis

    for labels, texts, title in (
        ([f"FOG-{n} x" for n in range(4)], ["FOG-0 x", "FOG-1 x", "FOG-2 x", "FOG-3 x"], None),
        (
            [f"FOG-70-A-BATCH-17-{n:04d} z" for n in range(98, 102)],
            ["0098 z", "0099 z", "0100 z", "0101 z"],
            "unit, behind FOG-70-A-BATCH-17-",
        ),
        (["A" * 40, "B" * 40], ["…" + "A" * 15, "…" + "B" * 15], None),
        (["A" * 40], ["…" + "A" * 15], None),
    ):
        figure = go.Figure()
        serial_axis(figure, labels)
        axis = figure.layout.xaxis
        assert list(axis.ticktext) == texts and list(axis.tickvals) == labels
        assert axis.title.text == title


def test_what_stands_above_each_other_shares_its_axis() -> None:
    layout = loops({"x": judgement(), "y": judgement()}).figure.layout
    assert (layout.xaxis.matches, layout.xaxis2.matches) == ("x3", "x4")


def test_table_rates_are_drawn_odd_about_rest_and_over_the_time_of_the_temperatures() -> None:
    times = {"time_s": [0.0, 1800.0, 1800.0, 3600.0]}
    rates = times | {"value": [0.0, 0.0, 9.999, -9.999]}
    profile = {"set_point": times | {"value": [20.0] * 4}, "coil": times | {"value": [20.0] * 4}}
    run = {"profile": profile | {"table_rate": rates}, "hours": 1.0, "summary": "a soak"}
    figure = programme_drawing(run).figure
    assert figure.layout.xaxis.matches == "x2"
    shown = traces(programme_drawing(run))["table rate"]
    assert shown.yaxis == "y2" and shown.y == pytest.approx([0.0, 0.0, 4.0, -4.0])
    ticks = dict(zip(figure.layout.yaxis2.ticktext, figure.layout.yaxis2.tickvals, strict=True))
    assert ticks["0"] == 0.0 and ticks["1"] == pytest.approx(-ticks["−1"])


def test_intervals_of_a_deviation_reach_a_decade_beyond_the_curve_at_most() -> None:
    adev = np.array([1.0, 2.0])
    assert _span(adev, np.array([[0.5, 5.0], [1.5, 7.0]])) == (0.5, 7.0)
    assert _span(adev, np.array([[1e-4, 5.0], [1.5, 900.0]])) == pytest.approx((0.1, 20.0))


def test_the_band_of_variance_ratios_is_what_chance_makes_about_one() -> None:
    noise: Any = SimpleNamespace(scales_s=[10.0, 20.0, 40.0], variance_ratio=[1.0, 1.1, 0.9], samples=4000)
    band, shown = variance_ratios(noise).figure.data
    assert list(shown.y) == noise.variance_ratio
    low, high = np.asarray(band.y)[:3], np.asarray(band.y)[:2:-1]
    blocks = 4000.0 / np.array([1.0, 2.0, 4.0])
    of_chance = np.sort([chi2.ppf(p, blocks) / blocks for p in (0.025, 0.975)], axis=0)
    np.testing.assert_allclose(np.sort([low, high], axis=0), of_chance, atol=0.005)


def test_where_warming_and_cooling_part_is_where_both_were_seen() -> None:
    bins: Any = [
        SimpleNamespace(from_degc=low, to_degc=low + 10.0, mean_up=up, mean_down=down)
        for low, up, down in ((0.0, 0.1, 0.2), (10.0, 0.5, 0.1), (20.0, 9.0, None), (30.0, None, -9.0))
    ]
    assert "from 10.0 to 20.0 °C: 0.400 deg/h" in _parted(bins)
    assert "in both directions" in _parted(bins[2:])


def test_a_winner_without_operations_is_drawn_on_the_logarithmic_axis() -> None:
    study = written("sweep")
    (place,) = study["pareto"]
    study["winner"] = study["trials"][place] = study["trials"][place] | {"operations": 0}
    drawn = [t for t in pareto_front(study).figure.data if t.name in ("in the Pareto set", "winner")]
    assert len(drawn) == 4
    assert all(min(trace.x) > 0 for trace in drawn)
