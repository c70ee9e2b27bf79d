"""Unknowns that are looked up in the data: lines and steps, where they were put in."""

from __future__ import annotations

import re

import numpy as np
import pytest

from fogml.gap.basis import build_basis
from fogml.gap.events import event_groups
from fogml.gap.evidence import Field
from fogml.gap.group_gains import group_gains
from fogml.gap.near_library import near_library
from fogml.gap.priors import LENGTHS
from fogml.gap.search import Search
from tests.gap.small_model import SmallModel, framed, noise_of, ramps, recorded


def frame_with(added):
    rng = np.random.default_rng(4)
    model, runs = SmallModel(), []
    for name, count, turns in (("a", 900, 2), ("b", 700, 3)):
        run = ramps(name, count=count, step=20.0, turns=turns)
        made = recorded(run, model, {"offset": 1.0, "slope": -0.5}, (), noise_of(run, rng))
        runs.append(made.with_columns(gyro=made.gyro + added(made.time, name)))
    return framed(runs, model)


def search_of(frame):
    return Search(Field(build_basis(frame, {}, event_groups(frame), "tactical")))


def best_gain(search, name):
    return float(group_gains(search.field_.condition([]), [name])[0].max())


@pytest.mark.parametrize("period_s", [300.0, 777.0, 1300.0])
def test_a_line_is_found_at_its_period(period_s):
    frame = frame_with(lambda t, name: 0.15 * np.sin(2.0 * np.pi * t / period_s + (name == "b")))
    group = next(g for g in event_groups(frame) if g.name == "line")
    told = float(re.search(r"([\d.e+]+) s$", group.looks_like).group(1))
    assert told == pytest.approx(period_s, rel=0.02)
    search = search_of(frame)
    assert best_gain(search, "line") > group.price + 50.0
    assert search.explanation((), "unknown").group[0] == "line"


@pytest.mark.parametrize(("first_s", "last_s"), [(2400.0, 600.0), (500.0, 1500.0)])
def test_a_swept_oscillation_is_found_with_its_periods(first_s, last_s):
    span = 20.0 * 899

    def swept(t, name):
        x = t - t[0]
        cycles = x / first_s + 0.5 * (1.0 / last_s - 1.0 / first_s) * x**2 / span
        return 0.15 * np.sin(2.0 * np.pi * cycles + (name == "b"))

    frame = frame_with(swept)
    group = next(g for g in event_groups(frame) if g.name == "swept")
    told = [float(x) for x in re.search(r"from ([\d.e+]+) to ([\d.e+]+) s$", group.looks_like).groups()]
    assert told == pytest.approx([first_s, last_s], rel=0.1)
    search = search_of(frame)
    assert best_gain(search, "swept") > group.price + 50.0
    assert search.explanation((), "unknown").group[0] == "swept"


@pytest.mark.parametrize(("run", "hours"), [("a", 1.2), ("b", 2.5)])
def test_a_step_is_found_on_its_run_at_its_time(run, hours):
    frame = frame_with(lambda t, name: np.where((name == run) & (t - t[0] >= 3600.0 * hours), 0.6, 0.0))
    group = next(g for g in event_groups(frame) if g.name == "step")
    told = float(re.search(r"at ([\d.]+) h", group.looks_like).group(1))
    first = next(o for o in frame.observations if o.run.name == run).run.time[0] / 3600.0
    assert group.looks_like.endswith(f"in {run}")
    assert told - first == pytest.approx(hours, abs=0.02)
    assert search_of(frame).explanation((), "unknown").group[0] == "step"


def test_noise_alone_does_not_pay_for_having_been_looked_through():
    frame = frame_with(lambda t, name: 0.0)
    search = search_of(frame)
    for group in event_groups(frame):
        assert best_gain(search, group.name) < group.price, group.name
    assert search.explanation((), "unknown").log_posterior < search.explanation(()).log_posterior


def test_gains_of_a_group_are_those_of_the_dense_formula():
    frame = frame_with(lambda t, name: 0.1 * np.sin(t / 150.0))
    model = SmallModel()
    groups = [*event_groups(frame), *near_library(frame.observations, model.candidates(), {}, "tactical")]
    search = Search(Field(build_basis(frame, model.candidates(), groups, "tactical")))
    found = search.run()
    held = search.field_.condition(search.parts.of(max(found, key=lambda e: len(e.ids)).effects, None))
    for name, places in search.field_.basis.groups.items():
        gram = held.field.gram[np.ix_(places, places)] - held.half[:, places].T @ held.half[:, places]
        fit = held.field.gram[places, 0] - held.half[:, places].T @ held.half[:, 0]
        dense = []
        for length in LENGTHS:
            inner = np.eye(len(places)) + length**2 * gram
            squared = length**2 * fit @ np.linalg.solve(inner, fit)
            dense.append(0.5 * (squared - np.linalg.slogdet(inner)[1]))
        assert group_gains(held, [name])[0] == pytest.approx(dense, rel=1e-6, abs=1e-6)
