"""The model of known causes: sizes by evidence, against dense normal distributions and the truth."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fogml.errors import InputError
from fogml.models.causes import CauseModel, GroupedRows
from fogml.models.saved import load_model, save_model
from fogml.models.table import TrainingTable
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel

WHITE_1 = NoiseModel(1.0 / 60.0)
"""White noise of one (deg/h)^2 s: of 1 deg/h in a second."""


def table(groups: tuple[int, ...], seed: int = 0) -> TrainingTable:
    rng = np.random.default_rng(seed)
    n = 60
    X = rng.normal(size=(n, len(groups))).cumsum(axis=0)
    y = 3.0 + X @ rng.normal(size=len(groups)) + rng.normal(size=n)
    time = np.arange(n, dtype=np.float64)
    return TrainingTable(X, y, np.zeros(n, dtype=np.intp), time, np.zeros(n, dtype=np.intp))


def test_evidence_and_posterior_are_those_of_the_dense_normal_distribution() -> None:
    groups = np.array([0, 1, 1, 2])
    rows = table(tuple(groups))
    held, lengths = GroupedRows(rows, groups, WHITE_1), (4.0, 20.0)
    free = np.column_stack([np.ones(60), rows.X[:, :1]])
    beside = np.eye(60) - free @ np.linalg.pinv(free)
    scale = 1.0 / np.linalg.norm(beside @ rows.X[:, 1:], axis=0)
    sd = np.array([4.0, 4.0, 20.0]) / np.sqrt([2.0, 2.0, 1.0]) * scale
    # In an orthonormal basis of what the free columns leave, a flat prior on them drops out.
    basis = np.linalg.svd(beside)[0][:, : 60 - 2]

    def dense(sd: np.ndarray) -> float:
        Z = basis.T @ rows.X[:, 1:]
        return multivariate_normal.logpdf(basis.T @ rows.y, cov=np.eye(58) + Z @ np.diag(sd**2) @ Z.T)

    none = 1e-9 * sd
    assert held.log_evidence(lengths) - held.log_evidence((1e-9, 1e-9)) == pytest.approx(
        dense(sd) - dense(none), abs=1e-6
    )
    found = held.fit(lengths)
    design = np.column_stack([np.ones(60), rows.X])
    precision = design.T @ design + np.diag([0.0, 0.0, *(sd**-2)])
    np.testing.assert_allclose(found.covariance, np.linalg.inv(precision), atol=1e-9)
    np.testing.assert_allclose(
        [found.intercept, *found.coef], np.linalg.solve(precision, design.T @ rows.y), atol=1e-9
    )


def run(seed: int, loop: float, *, hours: float = 6.0) -> Run:
    """Temperature up and down and half way up again, with a loop of the play operator's form."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 3600.0 * hours, 20.0)
    T = 25.0 + 30.0 * np.sin(2.0 * np.pi * time / (1800.0 * hours)) + 5.0 * np.sin(time / 700.0 + seed)
    play = np.empty(len(T))
    s = T[0]
    for i, x in enumerate(T):
        s = play[i] = min(max(s, x - 8.0), x + 8.0)
    gyro = 1.0 + 0.02 * T + 1e-4 * T**2 + loop * (play - T) / 8.0 + 0.05 * rng.normal(size=len(T))
    return Run(f"r{seed}", {"time": time, "gyro": gyro, "T": T})


CAUSES = {"loops": "play(T, 6 degC)^1..3, play(T, 10 degC)^1..3", "warm-up": "lag(T, 600 s), lag(T, 1200 s)"}


def test_a_cause_that_acts_is_compensated_on_another_run_and_one_that_does_not_takes_no_part() -> None:
    model = CauseModel("T, T^2", CAUSES).fit([run(1, 0.4), run(2, 0.4)])
    other = run(3, 0.4)
    evaluation = model.evaluate(other)
    left = (other.error_deg_h - evaluation.drift)[evaluation.full & evaluation.settled]
    assert np.std(left) < 0.06  # noise is 0.05, the loop 0.4
    assert model.lengths_["loops"] > 10.0
    assert model.lengths_["warm-up"] < 5.0
    plain = CauseModel("T, T^2", CAUSES).fit([run(1, 0.0), run(2, 0.0)])
    assert plain.lengths_["loops"] < 3.0


def test_it_is_saved_and_written_as_any_linear_model(tmp_path) -> None:
    model = CauseModel("T, T^2", CAUSES).fit([run(1, 0.4), run(2, 0.4)])
    save_model(model, tmp_path / "model")
    other = run(3, 0.4)
    np.testing.assert_array_equal(load_model(tmp_path / "model").predict(other), model.predict(other))
    compact, trained = model.compact(), run(1, 0.4)
    linear = compact.network.constant + model.features_.transform(trained) @ compact.network.linear
    np.testing.assert_allclose(linear, model.predict(trained), atol=1e-9)


def test_members_that_the_runs_can_not_tell_are_left_out() -> None:
    causes = {"loops": "play(T, 8 degC)^1..2, play(T, 60 degC)", "late": "lag(T, 600 s), lag(T, 90000 s)"}
    model = CauseModel("T, T^2", causes).fit([run(1, 0.4)])
    assert model.feature_names == ["T", "T^2", "play(T, 8 degC)", "play(T, 8 degC)^2", "lag(T, 600 s)"]


def test_a_few_rows_are_refused() -> None:
    with pytest.raises(InputError, match="too few"):
        CauseModel("T, T^2", {"loops": "play(T, 1 degC)"}).fit([run(1, 0.0, hours=0.04)])
    with pytest.raises(InputError, match="supply"):
        CauseModel("T, T^2", {"ripple": "supply"}).fit([run(1, 0.0)])
