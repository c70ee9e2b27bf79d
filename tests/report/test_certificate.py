"""Certificates: one sheet per unit, limits looked at for each unit apart, signed by hand."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from datetime import date

from fogml.report import certificate
from fogml.report.certificate import by_unit
from fogml.runs.findings import Finding
from tests.report.judgements import judged_run, judgement
from tests.report.pages import Page


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


def test_a_unit_that_does_not_tell_a_quantity_has_no_such_limit() -> None:
    judged = two_units()
    limit = replace(judged.limits[0], quantity="hysteresis", limit=0.01)
    silent = replace(judged.test[1], after=replace(judged.test[1].after, hysteresis=None))
    parts = by_unit(replace(judged, test=(judged.test[0], silent), limits=(limit,)))
    assert [len(part.limits) for part in parts] == [1, 0]


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
