"""Whitened rows against dense algebra, and what the basis makes of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from fogml.gap.basis import build_basis
from fogml.gap.dictionary import unknown_groups
from fogml.gap.frame import main_axes
from tests.gap.small_model import KINDS, Kind, SmallModel, dense, framed, noise_of, ramps, recorded

MODEL = SmallModel(("bend", "cube", "tilted"))


@pytest.fixture(scope="module")
def runs():
    rng = np.random.default_rng(1)
    made = []
    for name, count, turns in (("a", 110, 2), ("b", 90, 3)):
        run = ramps(name, count=count, turns=turns)
        made.append(recorded(run, MODEL, {"offset": 0.5}, noise=noise_of(run, rng)))
    return made


@pytest.fixture(scope="module")
def frame(runs):
    return framed(runs, MODEL)


def test_inner_products_of_whitened_columns_are_those_of_the_dense_covariance(frame):
    rng = np.random.default_rng(2)
    columns = [rng.standard_normal((len(o), 4)).cumsum(axis=0) for o in frame.observations]
    white = frame.white(columns)
    expected = sum(
        c.T @ np.linalg.solve(dense(o.time, o.row_s), c) for o, c in zip(frame.observations, columns)
    )
    size = np.sqrt(np.diag(expected))
    found = white.T @ white
    np.testing.assert_allclose(found / np.outer(size, size), expected / np.outer(size, size), atol=1e-6)


def test_beside_the_constants_is_what_their_posterior_leaves(frame):
    rng = np.random.default_rng(3)
    columns = rng.standard_normal((frame.runs[-1].stop, 3))
    covariance = np.eye(len(columns)) + frame.fixed @ frame.fixed.T
    np.testing.assert_allclose(frame.beside(columns), columns.T @ np.linalg.solve(covariance, columns))
    # With flat priors it is what least squares leaves.
    left = columns - frame.fixed @ np.linalg.lstsq(frame.fixed, columns, rcond=None)[0]
    np.testing.assert_allclose(frame.beside(columns, flat=True), left.T @ left, atol=1e-4)


def test_little_that_large_constants_leave_is_not_lost_in_round_off(frame):
    # A scale factor's constants on a fast table are long and alike, and what they leave of a column short.
    rng = np.random.default_rng(5)
    rows = frame.runs[-1].stop
    rate, warm = rng.standard_normal(rows), rng.standard_normal(rows)
    fixed = np.column_stack([3e4 * rate, 3e4 * (rate + 1e-3 * warm), 40.0 * warm, 1e-2 * rng.random(rows)])
    columns = 3e3 * np.outer(rate, [1.0, -0.5]) + 0.3 * rng.standard_normal((rows, 2))
    large = replace(frame)
    vars(large)["fixed"] = fixed
    # What least squares with the constants' priors as rows more leaves, projected out twice.
    basis, _ = np.linalg.qr(np.vstack([fixed, np.eye(4)]))
    left = np.vstack([columns, np.zeros((4, 2))])
    for _ in range(2):
        left = left - basis @ (basis.T @ left)
    np.testing.assert_allclose(large.beside(columns), left.T @ left, rtol=1e-5, atol=1e-5)


def test_residuals_are_white_and_runs_follow_each_other(frame, runs):
    assert [part.stop - part.start for part in frame.runs] == [len(o) for o in frame.observations]
    assert frame.spans["s"] == max(run.span_s for run in runs)
    assert frame.spans["degC"] == pytest.approx(40.0)
    left = frame.residual[:, 0]
    left = left - frame.fixed @ np.linalg.lstsq(frame.fixed, left, rcond=None)[0]
    # The variance of 200 rows is known to 10 %, and their neighbours are not alike.
    assert 0.7 < np.mean(left**2) < 1.3
    assert abs(np.mean(left[1:] * left[:-1])) < 0.25


def test_main_axes_bring_columns_to_a_length_of_one(frame):
    rng = np.random.default_rng(4)
    columns = rng.standard_normal((60, 5)) @ np.diag([10.0, 3.0, 1.0, 1.0, 0.0])
    columns[:, 3] = columns[:, 2]
    axes = main_axes(columns.T @ columns, 1e-4)
    made = columns @ axes
    gram = made.T @ made
    assert axes.shape[1] == 3
    assert np.trace(gram) == pytest.approx(1.0)
    np.testing.assert_allclose(gram, np.diag(np.diag(gram)), atol=1e-12)
    assert main_axes(np.zeros((3, 3)), 1e-4).shape == (3, 0)


def test_the_basis_holds_everything_and_knows_what_lies_within_the_constants(frame):
    groups = unknown_groups(frame.observations)
    told: list[str] = []
    basis = build_basis(frame, MODEL.candidates(), groups, MODEL.grade, told.append)
    assert told == list(MODEL.ids)
    assert basis.within_constants == ("tilted",)
    assert {n.candidate for n in basis.nodes} == {"bend", "cube"}
    # Every column belongs to the residual, the constants, one group or one node.
    places = [0, *basis.constants, *(c for g in basis.groups.values() for c in g)]
    places += [c for n in basis.nodes for c in n.columns]
    assert sorted(places) == list(range(basis.rows.shape[1]))
    for columns in basis.groups.values():
        assert np.trace(frame.beside(basis.rows[:, columns])) == pytest.approx(1.0)
    for node in basis.nodes:
        assert np.trace(frame.beside(basis.rows[:, list(node.columns)])) == pytest.approx(1.0)


@dataclass(frozen=True)
class Told(Kind):
    """A candidate that only changes of the supply, and of fan or heater, tell from others."""

    told_by: tuple[tuple[str, ...], ...] = (("supply",), ("fan", "heater"))


@pytest.mark.parametrize(
    "drives, offered",
    [
        ((), False),
        (("supply",), False),
        (("heater",), False),
        (("supply", "heater"), True),
        (("supply", "fan"), True),
        (("supply", "heater", "fan"), True),
        (("supply", "steady"), False),
    ],
)
def test_what_drives_tell_is_offered_where_one_of_each_kind_is_recorded_to_change(runs, drives, offered):
    def driven(run, steps):
        late = run.time > run.time.mean()
        held = {
            "supply": 5.0 + 0.01 * np.sin(run.time / 900.0) + 0.5 * late * steps,
            "heater": 0.5 + 0.5 * late * steps,
            "fan": 0.5 + 0.5 * late * steps,
            "steady": np.full(len(run), 0.5),
        }
        named = {"steady": "fan"}
        return run.with_columns(**{named.get(name, name): held[name] for name in drives})

    # One run on which they change is enough.
    made = [driven(run, steps=(i == 0)) for i, run in enumerate(runs)]
    candidates = {"cube": Told("cube", KINDS["cube"].amplitude)}
    basis = build_basis(framed(made, MODEL), candidates, [], MODEL.grade)
    assert ("cube" not in basis.within_constants) == offered
    assert bool(basis.nodes) == offered


def test_a_drive_that_hardly_changes_tells_nothing(runs):
    @dataclass(frozen=True)
    class Supplied(Kind):
        told_by: tuple[tuple[str, ...], ...] = (("supply",),)

    made = [run.with_columns(supply=5.0 + 0.01 * np.sin(run.time / 900.0)) for run in runs]
    basis = build_basis(
        framed(made, MODEL), {"cube": Supplied("cube", KINDS["cube"].amplitude)}, [], MODEL.grade
    )
    assert basis.within_constants == ("cube",)


def test_a_nodes_size_is_the_amplitude_of_unit_length(frame):
    basis = build_basis(frame, MODEL.candidates(), [], MODEL.grade)
    (cube,) = (n for n in basis.nodes if n.candidate == "cube")
    response = frame.responses("cube", [{}])
    assert cube.size * np.sqrt(frame.beside(response)[0, 0]) == pytest.approx(1.0)
    assert cube.usual * cube.size == pytest.approx(1.0)  # 0.1 to 10: usually 1
    assert cube.sign == 1
    np.testing.assert_allclose(basis.rows[:, cube.columns[0]], cube.size * response[:, 0])
