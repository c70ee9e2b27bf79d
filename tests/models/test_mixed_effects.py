"""Mixed effects: the posterior against its closed form, what is a run's own, and drift that remembers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from fogml.features.features import Features
from fogml.features.parse import parse_features
from fogml.models.box import moves_both_ways
from fogml.models.combination import LeftOut
from fogml.models.folds import dealt_blocks
from fogml.models.mixed_effects import basis_of, fit_mixed_effects
from fogml.models.names import make_model
from fogml.models.saved import load_model, save_model
from fogml.models.size_priors import SizePriors
from fogml.models.table import TrainingTable
from fogml.models.weights import skill_of, weights_of
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from tests.models.test_memory_features import made_run


def table_of(X: np.ndarray, y: np.ndarray, runs: np.ndarray) -> TrainingTable:
    time = np.concatenate([100.0 * np.arange(np.sum(runs == run)) for run in np.unique(runs)])
    return TrainingTable(X, y, runs, time, dealt_blocks(len(y)))


def cycle(seed: int, drift, own: float = 0.0, noise: float = 0.02) -> Run:  # type: ignore[no-untyped-def]
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 14400.0, 20.0)
    T = 20.0 + 40.0 * np.sin(2.0 * np.pi * time / time[-1] + 0.3 * seed)
    slow = own * (rng.normal() + rng.normal() * np.sin(time / 4000.0 + rng.uniform(0.0, 6.0)))
    return Run(f"r{seed}", {"time": time, "gyro": drift(T) + slow + rng.normal(0.0, noise, len(T)), "T": T})


def test_the_shared_part_is_generalised_least_squares_with_the_sizes_found() -> None:
    # With one linear column, no curvature and vast prior sizes, the posterior mean is the GLS estimate under
    # the covariance of the own parts that the fit itself states.
    rng = np.random.default_rng(0)
    runs = np.repeat([0, 1, 2], 60)
    T = rng.uniform(-40.0, 60.0, 180)
    y = 0.05 * T + np.repeat(rng.normal(0.0, 1.0, 3), 60) + rng.normal(0.0, 0.1, 180)
    table = table_of(T[:, None], y, runs)
    found = fit_mixed_effects(table, Features("T").terms, SizePriors(linear=10.0, spread=1e-3, offset=50.0))
    spread = y.std()
    shift, slow, fast = (
        found.sizes[f"own {name}"] / spread for name in ("shift", "slow drift", "faster drift")
    )
    apart = np.abs(table.time_s[:, None] - table.time_s[None, :]) / 5900.0
    same = runs[:, None] == runs[None, :]
    covariance = same * (shift**2 + slow**2 * np.exp(-4.5 * apart**2) + fast**2 * np.exp(-20.0 * apart))
    covariance += (found.sizes["noise"] / spread) ** 2 * np.eye(180)
    design = np.column_stack([np.ones(180), T])
    inverse = np.linalg.inv(covariance)
    expected = np.linalg.solve(design.T @ inverse @ design, design.T @ inverse @ y)
    assert found.coef[0] == pytest.approx(expected[1], rel=2e-4)
    assert found.intercept == pytest.approx(expected[0], abs=2e-2)
    errors = spread * np.sqrt(np.diag(np.linalg.inv(design.T @ inverse @ design)))
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), errors, rtol=2e-2)


def test_the_slope_of_the_evidence_is_its_finite_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    import fogml.models.mixed_effects as module

    held = {}

    def stop(loss, first, **_):  # type: ignore[no-untyped-def]
        held["loss"], held["first"] = loss, first
        return type("Found", (), {"x": first})

    monkeypatch.setattr(module, "minimize", stop)
    rng = np.random.default_rng(1)
    T = rng.uniform(-40.0, 60.0, 60)
    X = np.column_stack([T, T**2])
    fit_mixed_effects(
        table_of(X, 0.1 * T + rng.normal(size=60), np.repeat([0, 1], 30)), Features("T, T^2").terms
    )
    at = held["first"] + rng.normal(0.0, 0.3, len(held["first"]))
    numeric = approx_fprime(at, lambda x: held["loss"](x)[0], 1e-6)
    np.testing.assert_allclose(held["loss"](at)[1], numeric, rtol=1e-3, atol=1e-3)


def test_what_is_a_runs_own_is_never_subtracted() -> None:
    covered, subtracted = [], []
    for draw in range(5):
        *train, test = (cycle(100 * draw + run, lambda T: 0.0 * T, own=1.0) for run in range(4))
        model = make_model("mixed-effects").fit(train)
        subtracted.append(np.std(model.predict(test)))
        low, high = model.predict_interval(test)
        covered.append(np.mean((test.gyro > low) & (test.gyro < high)))
    assert max(subtracted) < 0.15
    assert 0.6 < np.mean(covered) <= 1.0


def test_a_shared_cubic_is_found_beside_own_shifts() -> None:
    def drift(T: np.ndarray) -> np.ndarray:
        return 0.05 * T + 3e-4 * T**2 - 4e-6 * T**3

    model = make_model("mixed-effects").fit([cycle(seed, drift, own=0.1) for seed in range(3)])
    test = cycle(9, drift)
    assert np.std(model.predict(test) - drift(test.columns["T"])) < 0.05 * test.gyro.std()
    assert model.skill_ > 0.95


def test_memory_in_the_truth_is_closed_on_another_run(tmp_path) -> None:  # type: ignore[no-untyped-def]
    def bare(run: Run) -> Run:
        # Light power is not among what the model looks for by itself.
        columns = dict(run.columns)
        columns["gyro"] = columns["gyro"] - 0.01 * columns.pop("light")
        return Run(run.name, columns, run.facts)

    train, test = [bare(made_run(1, 1.0)), bare(made_run(2, 0.7))], bare(made_run(3, 1.5))
    model = make_model("mixed-effects").fit(train)
    cubic = make_model("polynomial").fit(train)
    left, before = ((test.gyro - m.predict(test)) for m in (model, cubic))
    assert left.std() < 0.2 * before.std()
    low, high = model.predict_interval(test)
    means = [values.reshape(-1, 10).mean(axis=1) for values in (test.gyro[:1160], low[:1160], high[:1160])]
    assert np.mean((means[0] > means[1]) & (means[0] < means[2])) > 0.85
    save_model(model, tmp_path / "model")
    np.testing.assert_array_equal(load_model(tmp_path / "model").predict(test), model.predict(test))
    again = make_model("mixed-effects").fit(train)
    np.testing.assert_array_equal(again.predict(test), model.predict(test))


def test_features_follow_what_the_runs_can_tell() -> None:
    whole = made_run(1, 1.0)
    top = int(np.argmax(whole.columns["T"]))
    *powers, beyond = make_model("mixed-effects").fit(whole[:top]).feature_names
    assert powers == ["T", "T^2", "T^3", "T^4", "T^5"] and beyond.startswith("beyond(T, -30 degC, ")
    names = make_model("mixed-effects").fit(whole).feature_names
    assert "since_on(400 s)" in names and "play(T, 10 degC)" in names
    unknown = Run("u", whole.columns, Facts(unit="U", axis="x"))
    assert not any("since_on" in name for name in make_model("mixed-effects").fit(unknown).feature_names)
    asked = make_model("mixed-effects", features="T, light").fit(whole)
    assert asked.feature_names == ["T", "light"]


@pytest.mark.parametrize(
    ("temperatures", "expected"),
    [
        ([np.linspace(0.0, 50.0, 300)], False),
        ([np.linspace(0.0, 50.0, 300), np.linspace(50.0, 0.0, 300)], True),
        ([np.linspace(0.0, 50.0, 300), np.linspace(50.0, 45.0, 300)], False),
        ([np.linspace(0.0, 50.0, 3000) + np.random.default_rng(0).normal(0.0, 0.3, 3000)], False),
    ],
)
def test_both_ways_means_a_fifth_of_the_span_each_way(temperatures: list, expected: bool) -> None:
    assert moves_both_ways(temperatures) is expected


def part(predicted: np.ndarray, told: np.ndarray, kind: str = "runs") -> LeftOut:
    rows, columns = np.arange(len(told)), np.atleast_2d(predicted.T).T
    return LeftOut(kind, columns, told, np.ones(columns.shape), (rows[:0], rows))


def test_skill_is_the_least_squares_share_between_nothing_and_all() -> None:
    p, one = np.array([1.0, -1.0, 2.0]), np.ones(1)
    assert skill_of([], one) == 1.0
    assert skill_of([part(p, 0.25 * p)], one) == pytest.approx(0.25)
    assert skill_of([part(p, -p)], one) == 0.0
    assert skill_of([part(p, 3.0 * p)], one) == 1.0


def test_weights_are_those_of_stacked_regression_on_a_simplex() -> None:
    rng = np.random.default_rng(0)
    good, bad = rng.normal(size=200), rng.normal(size=200)
    told = good + 0.1 * rng.normal(size=200)
    found = weights_of([part(np.column_stack([good, bad]), told, "blocks")], 2, True)
    np.testing.assert_allclose(found, [1.0, 0.0], atol=0.03)
    # Members that can't be told apart share alike.
    tied = weights_of([part(np.column_stack([good, good]), told, "blocks")], 2, True)
    assert tied[0] == pytest.approx(tied[1], rel=1e-6) and tied.sum() == pytest.approx(1.0, abs=0.02)
    # A brute search over the simplex finds no less.
    both = np.column_stack([good + 0.3 * rng.normal(size=200), good + 0.3 * rng.normal(size=200)])
    found = weights_of([part(both, told, "blocks")], 2, True)
    grid = np.linspace(0.0, 1.0, 501)
    least = np.mean((told[:, None] - both) ** 2, axis=0).min()
    losses = [np.mean((told - both @ [w, 1.0 - w]) ** 2) / least + 0.02 * 2.0 * (w - 0.5) ** 2 for w in grid]
    assert found[0] / found.sum() == pytest.approx(grid[int(np.argmin(losses))], abs=3e-3)


def test_what_runs_left_out_deny_is_not_compensated() -> None:
    p = np.array([1.0, -1.0, 2.0])
    parts = [part(p, -p), part(p, p, "blocks")]
    assert weights_of(parts, 1, True).tolist() == [0.0]
    # Halves are asked where temperature moves one way only, and blocks are not.
    one_way = [part(p, 0.5 * p, "halves"), part(p, p, "blocks")]
    assert weights_of(one_way, 1, False) == pytest.approx([0.5])
    assert weights_of(one_way, 1, True) == pytest.approx([1.0])


def test_beyond_the_box_the_trend_goes_on_and_levels_off_and_the_interval_grows() -> None:
    # A straight drift, known from -20 to 60 degC, asked for to 300: the trend levels off within 40 degC.
    train = cycle(1, lambda T: 0.05 * T, noise=0.01)
    model = make_model("mixed-effects").fit(train)
    T = np.repeat(np.linspace(-20.0, 300.0, 33), 400)
    test = Run("far", {"time": 1.0 * np.arange(len(T)), "gyro": np.zeros(len(T)), "T": T})
    drift = model.predict(test)[399::400]
    at_edge, near, far = (
        np.interp(value, np.linspace(-20.0, 300.0, 33), drift) for value in (60.0, 70.0, 300.0)
    )
    assert 0.25 < near - at_edge < 0.5
    assert far - at_edge < 0.05 * 40.0 + 0.1
    assert np.all(np.diff(drift) > -1e-3)
    low, high = model.predict_interval(test)
    width = (high - low)[399::400]
    assert width[-1] > 2.0 * width[5] > 0.0


def test_one_way_only_is_not_verifiable_and_as_wide_as_the_drift() -> None:
    whole = cycle(0, lambda T: 0.05 * T)
    up = whole[: len(whole) // 4]
    for name in ("mixed-effects", "auto"):
        model = make_model(name).fit(up)
        assert model.intervals_.half_width(0.9) >= 1.6 * up.gyro.std()
    assert any("not verifiable" in note for note in model.card_.notes)


def test_a_column_that_stands_still_but_for_rounding_holds_nothing() -> None:
    T = np.full(1000, 70.1)
    columns = np.column_stack([T, T**3])
    basis = basis_of(columns, parse_features("T, T^3").terms, SizePriors())
    assert np.abs(columns - basis.shift).max() > 0.0  # what is rounded
    assert not basis.mix.any()
