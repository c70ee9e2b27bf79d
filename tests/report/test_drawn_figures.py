"""What figures draw is what was measured, in the units of their axes, and legends name each thing once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.gap.result import CandidateEvidence
from fogml.monitor.monitor_json import monitor_json
from fogml.monitor.watch import watch
from fogml.report.figures_gap import run_in_time
from fogml.report.figures_gap_evidence import SHOWN, shown_evidence
from fogml.report.figures_noise import allan_plot
from fogml.report.gap_page import gap_page
from fogml.report.inspect_page import inspect_page, recording
from fogml.report.monitor_words import run_figures
from fogml.runs.run import Run
from fogml.validation.inspection import inspection_json
from tests.monitor.test_watch import service
from tests.report.diagnoses import diagnosis, series
from tests.report.pages import Page, noise_values


def named(drawing, name):
    (trace,) = [trace for trace in drawing.figure.data if trace.name == name]
    return trace


@pytest.mark.parametrize(("hours", "unit", "seconds"), [(8.0, "h", 3600.0), (0.5, "min", 60.0)])
def test_averages_of_a_recording_stand_where_their_samples_are(hours, unit, seconds) -> None:
    time = np.arange(int(hours * 3600.0))
    run = Run.from_columns("a.csv", time=time * 1.0, gyro=10.0 + 1e-3 * time)
    drawing = recording(run)
    assert drawing.figure.layout.xaxis.title.text == f"time [{unit}]"
    (averages,) = [trace for trace in drawing.figure.data if "averages" in (trace.name or "")]
    x, y = np.asarray(averages.x, dtype=float), np.asarray(averages.y, dtype=float)
    # The output is a straight line in time, and so is every average of it.
    np.testing.assert_allclose(y, 10.0 + 1e-3 * seconds * x, rtol=1e-9)
    assert x[0] < 0.02 * x[-1] and x[-1] == pytest.approx(hours * 3600.0 / seconds, rel=0.01)
    every = named(drawing, "output, all samples")
    assert np.nanmax(np.asarray(every.x)) == pytest.approx((len(time) - 1) / seconds)


def test_averages_are_joined_over_short_gaps_alone() -> None:
    time = np.arange(20_000.0)
    kept = ~(((time > 5000) & (time < 5060)) | ((time > 12_000) & (time < 14_000)))
    run = Run.from_columns("a.csv", time=time[kept], gyro=np.full(kept.sum(), 3.0))
    (averages,) = [trace for trace in recording(run).figure.data if "averages" in (trace.name or "")]
    broken = np.flatnonzero(np.isnan(np.asarray(averages.y, dtype=float)))
    assert len(broken) == 1
    x = np.asarray(averages.x, dtype=float) * 3600.0
    assert x[broken[0] - 1] < 12_001 < 13_999 < x[broken[0] + 1]


@pytest.mark.parametrize("ramps", [2, 30])
def test_of_many_regimes_the_page_says_how_many_are_not_listed(ramps) -> None:
    corners = np.concatenate([[20.0, 20.0, 40.0, 40.0] for _ in range(ramps)])
    temperature = np.interp(np.arange(600.0 * len(corners)) / 600.0, np.arange(len(corners)), corners)
    run = Run.from_columns(
        "a.csv", time=np.arange(len(temperature)) * 1.0, gyro=np.zeros(len(temperature)), T_in=temperature
    )
    told = inspection_json([run])
    count = told["runs"][0]["regimes"]["count"]
    assert (count > 40) == (ramps == 30)
    listed = Page(inspect_page(run, told)).text.partition("; inspect.json lists them.")
    assert (listed[0].split()[-2:] == [str(count - 40), "more"]) if count > 40 else not listed[1]


def test_terms_of_the_noise_have_the_deviations_of_the_standard() -> None:
    """IEEE Std 952-1997, annex C: N/sqrt(tau), 0.664 B and K sqrt(tau/3), tau in hours."""
    told = noise_values()
    drawing = allan_plot(told)
    drawn = {trace.name[0]: trace for trace in drawing.figure.data if (trace.name or "")[1:2] == " "}
    assert set(drawn) == {"N", "B", "K"}
    expected = {
        "N": lambda hours: 0.01 / np.sqrt(hours),
        "B": lambda hours: np.full(len(hours), 0.664 * 0.02),
        "K": lambda hours: 0.03 * np.sqrt(hours / 3.0),
    }
    for name, trace in drawn.items():
        np.testing.assert_allclose(trace.y, expected[name](np.asarray(trace.x) / 3600.0), rtol=2e-3)


def test_a_legend_names_what_panels_share_once() -> None:
    drawing = run_in_time(series("a.csv"), (), True)
    told = [trace.name for trace in drawing.figure.data if trace.showlegend]
    assert sorted(told) == ["nominal twin", "recalibrated twin", "recorded", "with what was found"]


def test_runs_that_are_not_drawn_are_named_and_no_other() -> None:
    names = tuple(f"run-{i:02d}.csv" for i in range(12))
    quiet = (names[3], names[7])
    every = tuple(
        replace(series(name), gap_recalibrated=np.zeros(240)) if name in quiet else series(name)
        for name in names
    )
    text = Page(gap_page(diagnosis(fit=names, series=every))).text
    left_out = text.partition("Not drawn, with less of the gap: ")[2].partition(".csv.")[0] + ".csv"
    drawn = {name for name in names if f"{name}, fitted on" in text}
    assert set(left_out.split(", ")) == set(names) - drawn and set(quiet) <= set(names) - drawn


def test_what_is_named_is_shown_however_far_behind() -> None:
    def one(i: int, status: str) -> CandidateEvidence:
        return CandidateEvidence(f"effect_{i}", f"Effect {i}", "bias", -float(i), 0.0, 1.0, status)

    last = SHOWN + 5
    told = shown_evidence([one(i, "named" if i == last else "no_sign") for i in range(last + 1)])
    assert [e.effect for e in told] == [f"effect_{i}" for i in (*range(SHOWN), last)]
    hidden = [one(0, "in_constants"), *(one(i, "no_sign") for i in range(1, 4))]
    assert [e.effect for e in shown_evidence(hidden)] == ["effect_1", "effect_2", "effect_3"]


def test_marks_of_a_monitored_unit_stand_on_its_runs() -> None:
    records = service(step_at=12)
    records[5] = replace(records[5], scatter=-2.0)
    values = monitor_json(watch(records), runs_between_false_alarms=1000.0, added=0, repeated=0)
    (unit,) = values["units"]
    traces = run_figures(unit).figure.data
    courses = {trace.yaxis: trace for trace in traces if trace.mode == "lines+markers"}
    marks = [trace for trace in traces if trace.mode == "markers" and trace.yaxis in courses and trace.x]
    assert {one["figure"] for one in unit["alarms"]} == {"level"}
    assert [one["index"] for one in unit["outliers"]] == [5]
    assert len(courses) > 2 and len(marks) == 2
    for mark in marks:
        course = courses[mark.yaxis]
        assert list(course.x) == list(unit["age"])
        assert all(y == course.y[list(course.x).index(x)] for x, y in zip(mark.x, mark.y, strict=True))
    assert {mark.x[0] for mark in marks} == {
        unit["age"][5],
        unit["age"][unit["alarms"][0]["raised_at_index"]],
    }
