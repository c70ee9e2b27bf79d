"""What is unlike every candidate: the share of a group's probability against dense draws of its signal."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fogml.gap.basis import build_basis
from fogml.gap.evidence import Field, Term
from fogml.gap.group import Group
from fogml.gap.search import Search
from fogml.gap.unlike import DRAWS, RELATIVE, USUAL_COLUMNS, Unlike
from tests.gap.small_model import SmallModel, framed, noise_of, ramps, recorded


def wave(run) -> np.ndarray:
    return np.cos(2.0 * np.pi * (run.time - run.time[0]) / 2500.0)


def field_of(of_cube: float, of_wave: float) -> Field:
    """A group that holds a candidate's response and a wave in time, and data with some of both."""
    rng = np.random.default_rng(8)
    model = SmallModel(ids=("cube",))
    run = ramps("a", count=500, turns=3)
    made = recorded(run, model, {"offset": 1.0}, (), noise_of(run, rng))
    cube = model.on(run).response("cube", {}, {})
    frame = framed([made.with_columns(gyro=made.gyro + of_cube * cube + of_wave * wave(run))], model)
    (o,) = frame.observations
    columns = np.column_stack([o.averaged(cube), o.averaged(wave(run))])
    group = Group("both", "is one or the other", (columns,))
    return Field(build_basis(frame, model.candidates(), [group], "tactical"))


def share(field: Field, length: float = 20.0) -> float:
    term = Term(tuple(int(c) for c in field.basis.groups["both"]), length)
    return Unlike(field).log_share(field.condition([term]), "both", length)


def test_a_signal_that_is_a_candidates_is_no_unknown():
    assert share(field_of(2.0, 0.0)) < -math.log(DRAWS) + 1.5
    assert Search(field_of(2.0, 0.0)).run()[0].ids == {"cube"}


def test_a_candidate_that_does_not_count_takes_nothing_from_the_unknown():
    field = field_of(2.0, 0.0)
    held = field.condition([Term(tuple(int(c) for c in field.basis.groups["both"]), 20.0)])
    assert Unlike(field, frozenset({"other"})).log_share(held, "both", 20.0) < -1.0
    assert Unlike(field, frozenset({"cube"})).log_share(held, "both", 20.0) == 0.0


def test_a_signal_that_is_no_candidates_loses_nothing():
    field = field_of(0.0, 0.6)
    assert share(field) >= 0.0
    assert Search(field).run()[0].rest == "unknown"


@pytest.mark.parametrize(("of_cube", "of_wave"), [(0.3, 0.05), (0.25, 0.08)])
def test_the_share_is_that_of_dense_draws(of_cube, of_wave):
    """Posterior by the normal equations of whitened rows beside the constants, many draws."""
    field = field_of(of_cube, of_wave)
    frame, length = field.basis.frame, 20.0
    fixed = frame.fixed
    root = np.linalg.cholesky(np.linalg.inv(np.eye(len(fixed)) + fixed @ fixed.T))
    places = field.basis.groups["both"]
    group, candidate = (
        root.T @ field.columns(columns) for columns in (places, field.basis.nodes[0].columns[:1])
    )
    data = root.T @ frame.residual[:, 0]
    rng = np.random.default_rng(3)
    precision = group.T @ group + np.eye(len(places)) / length**2
    mean = np.linalg.solve(precision, group.T @ data)
    after = mean + rng.standard_normal((20_000, len(places))) @ np.linalg.cholesky(np.linalg.inv(precision)).T
    before = length * rng.standard_normal((20_000, len(places)))

    def like(draws: np.ndarray) -> float:
        signals = draws @ group.T
        cosine = signals @ candidate[:, 0] / np.linalg.norm(signals, axis=1) / np.linalg.norm(candidate)
        return float(np.mean(np.abs(cosine) > RELATIVE))

    wanted = math.log((1.0 - like(after)) / (1.0 - like(before)))
    assert share(field, length) == pytest.approx(wanted, abs=0.35)


def test_a_group_may_be_wider_than_usual():
    rng = np.random.default_rng(2)
    model = SmallModel(ids=("cube",))
    run = ramps("a", count=700, turns=3)
    frame = framed([recorded(run, model, {}, (), noise_of(run, rng))], model)
    group = Group("both", "is anything", (rng.standard_normal((len(frame.observations[0]), 450)),))
    field = Field(build_basis(frame, model.candidates(), [group], "tactical"))
    assert len(field.basis.groups["both"]) > USUAL_COLUMNS
    assert share(field) == pytest.approx(0.0, abs=0.1)
