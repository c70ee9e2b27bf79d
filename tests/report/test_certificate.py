"""Certificates: one sheet per unit, limits looked at for each unit apart, signed by hand."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from datetime import UTC, date, datetime

import numpy as np
import pytest

from fogml.report.certificate import by_unit, certificate
from fogml.report.compare_page import compare_page
from fogml.report.sweep_page import verdict_sentences as sweep_sentences
from fogml.runs.facts import Facts
from fogml.runs.findings import Finding
from fogml.validation.certified import at_constant_temperature, sample_deviation, set_up, with_uncertainty
from tests.report.judgements import judged_run, judgement
from tests.report.pages import Page
from tests.report.procedure_pages import written


def two_units() -> object:
    judged = judgement(limit=0.05)
    good, poor = judged_run("g.csv", unit="FOG-1"), judged_run("p.csv", unit="FOG-2", left=0.5)
    index = replace(judged.design_index, value=poor.after.rms, met=False)
    limits = (replace(judged.limits[0], value=poor.after.bias_stability, met=False),)
    return replace(judged, test=(good, poor), design_index=index, limits=limits)


def test_each_unit_has_its_own_sheet_and_outcome() -> None:
    parts = by_unit(two_units())
    assert [part.test[0].unit for part in parts] == ["FOG-1", "FOG-2"]
    assert [part.met for part in parts] == [True, False]
    read = Page(certificate(two_units()))
    assert len([a for a in read.of("section") if a.get("class") == "sheet"]) == 2
    assert "FOG-1, axis x ✓ all limits met" in read.text
    assert "FOG-2, axis x ✗ not all limits met" in read.text


def test_a_limit_is_met_at_the_limit_and_looks_at_the_size() -> None:
    judged = two_units()
    good = judged.test[0]
    biased = replace(good, unit="FOG-3", after=replace(good.after, bias_stability=-0.03))
    exact = replace(good, after=replace(good.after, bias_stability=0.02))
    parts = by_unit(replace(judged, test=(exact, biased)))
    assert [part.limits[0].met for part in parts] == [True, False]


def test_a_unit_that_does_not_tell_a_quantity_does_not_meet_its_limit() -> None:
    judged = two_units()
    limit = replace(judged.limits[0], quantity="hysteresis", limit=0.01)
    silent = replace(judged.test[1], after=replace(judged.test[1].after, hysteresis=None))
    parts = by_unit(replace(judged, test=(judged.test[0], silent), limits=(limit,)))
    assert [part.met for part in parts] == [True, False]
    (told,) = parts[1].limits
    assert (told.quantity, told.limit, told.met) == ("hysteresis", 0.01, False) and np.isnan(told.value)
    text = Page(certificate(replace(judged, test=(judged.test[0], silent), limits=(limit,)))).text
    assert "Thermal hysteresis 0.01 – deg/h ✗ not met" in text


def test_the_sheet_states_what_is_certified() -> None:
    text = Page(certificate(judgement(2), date(2026, 3, 2))).text
    for part in ("FOG-0417", "axis x", "a.csv", "b.csv", "c.csv", "41 parameters", "100 s", "2026-03-02"):
        assert part in text
    for part in ("Date", "Tested by", "Released by", "T −20.0 to 60.0", "the training runs' mean"):
        assert part in text


def test_without_a_date_the_line_is_left_to_write_on() -> None:
    html = certificate(judgement())
    assert "<dt>Date</dt><dd>\u00a0</dd>" in html
    assert certificate(judgement()) == html


def test_runs_seen_in_training_are_not_called_unseen() -> None:
    seen = Finding("seen_in_training", "holds the same samples as training run a.csv")
    assert "on runs that the model has not seen" in Page(certificate(judgement())).text
    text = Page(certificate(judgement(findings=(seen,)))).text
    assert "has not seen" not in text and "on runs that hold training samples" in text


def test_a_comparison_and_a_sweep_say_that_a_test_run_was_trained_on() -> None:
    seen = Finding("seen_in_training", "holds samples of (about 50 %) training run a.csv")
    for findings in ((), (seen,)):
        judged = judgement(findings=findings)
        for text in (
            Page(compare_page({"rbf": judged})).text,
            " ".join(sweep_sentences(written("sweep"), judged)),
        ):
            assert ("the figures say how well the model fits" in text) == bool(findings)


def test_limits_that_are_met_by_a_model_not_to_be_used_do_not_stand_alone() -> None:
    """A certificate of met limits alone reads as a pass, whatever its verdict says."""
    seen = Finding("seen_in_training", "holds the same samples as training run a.csv")
    title = re.compile("<h1>(.*?)</h1>", re.DOTALL)
    (good,) = title.findall(certificate(judgement()))
    (doubtful,) = title.findall(certificate(judgement(findings=(seen,))))
    assert "all limits met" in good and "all limits met" in doubtful
    assert "Do not use" in doubtful and "use" not in good


def test_the_figure_is_light_well_formed_svg() -> None:
    html = certificate(judgement(gap=True))
    svg = html[html.index("<svg") : html.index("</svg>") + 6]
    assert ElementTree.fromstring(svg).tag.endswith("svg")
    assert len(html) < 60_000


def test_many_runs_stay_on_the_sheet() -> None:
    judged = judgement()
    runs = tuple(judged_run(f"r{i}.csv", n=60) for i in range(20))
    text = Page(certificate(replace(judged, test=runs))).text
    assert "12 more runs with smaller rms" in text


def test_the_sheet_tells_synthetic_data_set_up_and_figures_over_n_less_one() -> None:
    """Figures by their definitions over n - 1: over temperature, and in the longest soak."""
    started = datetime(2026, 3, 2, 8, 0, tzinfo=UTC)
    facts = Facts(latitude=39.9, input_axis="down", started=started, notes="synthetic: programme x, seed 1")
    after = replace(judged_run().after, scale_factor_error=12.5)
    terms = {"N": {"value": 0.02, "ci": [0.018, 0.022], "unit": "deg/sqrt(h)"}}
    run = replace(judged_run(), facts=facts, after=after, noise={"terms": terms}, table_rates=(-10.0, 100.0))
    text = Page(certificate(replace(judgement(), test=(run,)))).text
    for part in (
        "synthetic data",
        "input axis down, latitude 39.9 deg",
        "started 2026-03-02 08:00",
        "table \N{MINUS SIGN}10 to 100 deg/s",
        "Bias stability, 10 s averages",
        "12.5 ppm",
        "Angle random walk",
        "0.0200 deg/√h",
    ):
        assert part in text, part
    whole, held = run.series.after, at_constant_temperature(run)
    assert len(held) == len(whole) // 5
    for values in (whole, held):
        told = sample_deviation(values)
        assert told.value == pytest.approx(np.sqrt(((values - values.mean()) ** 2).sum() / (len(values) - 1)))
        assert told.ci90[0] < told.value < told.ci90[1]
    assert "over temperature" in text and "at constant temperature" in text
    assert "synthetic data" not in Page(certificate(judgement())).text


@pytest.mark.parametrize("slow", [True, False])
def test_a_soak_that_is_at_no_one_temperature_is_told_by_its_longest_steady_part(slow: bool) -> None:
    """A day's slow wave, or a gap that hides a ramp: no part of the stay told spans over 1.5 degC."""
    m = 300
    temperature = (
        20.0 + 10.0 * np.sin(np.linspace(0.0, 7.0, m)) if slow else np.repeat([20.0, 60.0], [120, 180])
    )
    series = replace(
        judged_run(n=m).series, temperature=temperature, after=temperature.copy(), regime=np.repeat("soak", m)
    )
    held = at_constant_temperature(replace(judged_run(n=m), series=series))
    spans = [(b - a, a) for a in range(m) for b in range(a + 1, m + 1) if np.ptp(temperature[a:b]) <= 1.5]
    longest, first = max(spans, key=lambda span: (span[0], -span[1]))
    assert np.array_equal(held, temperature[first : first + longest])


def test_the_interval_of_a_deviation_covers_the_truth() -> None:
    rng = np.random.default_rng(0)
    hits = 0
    for _ in range(1000):
        low, high = sample_deviation(2.0 * rng.standard_normal(12)).ci90
        hits += low <= 2.0 <= high
    assert hits / 1000 == pytest.approx(0.9, abs=0.03)
    assert sample_deviation(np.zeros(2)) is None


def test_the_json_states_what_the_sheet_does() -> None:
    facts = Facts(latitude=39.9, input_axis="down", notes="synthetic: programme x, seed 1")
    run = replace(
        judged_run(), facts=facts, table_rates=(-10.0, 100.0), scale_factor_se=2.0, short_averages=41
    )
    run = replace(run, after=replace(run.after, bias_stability_10s=0.1))
    told, figures = set_up(run), with_uncertainty(run)
    assert told["synthetic"] and told["input_axis"] == "down" and told["latitude"] == 39.9
    assert told["table_rate_deg_s"] == [-10.0, 100.0] and told["span_h"] > 0.0
    short = figures["bias_stability_10s"]
    # From over 41 to over 40.
    assert short["value"] == pytest.approx(0.1 * np.sqrt(41.0 / 40.0)) and short["n"] == 41
    assert figures["scale_factor_error_se"] == 2.0
    assert figures["bias_stability_over_temperature"]["n"] == len(run.series.after)
    text = Page(certificate(replace(judgement(), test=(run,)))).text
    assert "n = 41" in text and "over n \N{MINUS SIGN} 1" in text
