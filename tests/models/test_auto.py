"""The automatic choice: parsimony, no harm, and what it says of the training runs."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from experiments.default_rates import __main__ as default_rates
from experiments.synthetic_world import World, cycle, programme
from fogml.features.parse import parse_features
from fogml.models import trial
from fogml.models.auto import AutoModel
from fogml.models.candidates import STANDARD, Candidate, Score, candidates_for, choose
from fogml.models.names import make_model
from fogml.models.saved import load_model, save_model
from fogml.models.weighing import weigh
from fogml.runs.run import Run
from fogml.runs.shipped import shipped_run

SAMPLE_S = 20.0
WORLD = World(noise=0.05)


def world_run(rate: float, seed: int, world: World = WORLD) -> tuple[Run, np.ndarray]:
    return world.run(cycle(rate, SAMPLE_S), SAMPLE_S, seed, f"{rate}-{seed}.csv")


def errors_at_other_rates(unit: World, run: Run, candidate: Candidate) -> np.ndarray:
    """Errors of a candidate fitted to a run against the noise-free truth at other rates [deg/h]."""
    sample_s = run.sample_s
    tests = [unit.run(cycle(rate, sample_s), sample_s, 0, "test") for rate in (0.4, 3.0)]
    return np.array(default_rates.model_errors(trial.fit_candidate(candidate, [run], 0), tests))


@cache
def fitted_to_one_rate() -> AutoModel:
    """The choice among linear forms on one run, for tests that change nothing of it."""
    return AutoModel().fit(world_run(1.0, 0)[0])


@pytest.fixture
def linear_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave networks out: their own tests are elsewhere, and they take most of the time."""

    def without_networks(*arguments: object) -> list[Candidate]:
        return [c for c in candidates_for(*arguments) if not c.network]  # type: ignore[arg-type]

    monkeypatch.setattr(trial, "candidates_for", without_networks)


def score(features: str, parameters: int, squares: list[float]) -> Score:
    return Score(Candidate(features), parameters, np.array(squares), np.ones(len(squares), dtype=np.intp))


def test_a_larger_candidate_needs_a_gain_beyond_its_standard_error() -> None:
    mean = score("", 1, [9.0, 9.0, 9.0, 9.0])
    standard = score(STANDARD.features, 6, [1.0, 1.0, 1.0, 1.0])
    unsure = score("T^1..5", 7, [0.2, 1.3, 0.4, 1.0])  # gains 0.28 on average, 1.2 of its standard error
    sure = score("T^1..4", 8, [0.9, 0.91, 0.92, 0.9])
    assert choose([standard, unsure, mean], rates_told=True) is standard
    assert choose([standard, unsure, sure, mean], rates_told=True) is sure


@pytest.mark.parametrize("several_runs", [False, True])
def test_at_few_rates_a_gain_must_outweigh_what_noise_costs_a_fit(several_runs: bool) -> None:
    """The rule in its own words: twenty times p * s**2 / n, with n the training rows."""
    rows, noise = 400, 1.0
    least = 20.0 * 6 * noise / rows

    def of(features: str, parameters: int, squares: float) -> Score:
        blocks = np.full(8, squares)
        if several_runs:  # Each row is held out twice, and is no more than one row for that.
            both, each = np.concatenate([blocks, blocks]), np.full(16, rows // 8)
            return Score(Candidate(features), parameters, both, each, of_runs=8)
        return Score(Candidate(features), parameters, blocks, np.full(8, rows // 8))

    mean = of("", 1, 9.0)
    larger = of("T^1..5, dT, T*dT", 8, noise)
    for gain, taken in ((0.9 * least, False), (1.1 * least, True)):
        standard = of(STANDARD.features, 6, noise + gain)
        assert choose([standard, larger, mean], rates_told=True) is larger
        assert (choose([standard, larger, mean], rates_told=False) is larger) == taken


def test_a_smaller_candidate_is_taken_if_it_is_no_worse() -> None:
    mean = score("", 1, [9.0, 9.0, 9.0, 9.0])
    standard = score(STANDARD.features, 6, [1.0, 1.0, 1.0, 1.0])
    as_good = score("T, dT", 3, [1.0, 0.9, 1.1, 1.0])
    worse = score("T", 2, [1.1, 1.1, 1.0, 1.0])
    assert choose([standard, worse, as_good, mean], rates_told=True) is as_good


def test_nothing_is_better_than_a_gain_within_its_noise() -> None:
    mean = score("", 1, [1.0, 1.0, 1.0, 1.0])
    standard = score(STANDARD.features, 6, [0.2, 1.9, 0.9, 0.9])
    assert choose([standard, mean], rates_told=True) is mean


def test_a_sure_gain_from_a_few_blocks_is_worth_its_parameters() -> None:
    """A drift at the ends of the temperatures alone: most blocks gain nothing, two gain much."""
    noise = 1.0 + 0.02 * np.array([1, -1, 2, 0, -2, 1, 0, -1])
    blocks = np.full(8, 200)
    standard = Score(STANDARD, 6, noise, blocks)
    mean = Score(Candidate(""), 1, noise + np.array([0.0, 0.0, 0.5, 0.0, 0.0, 0.6, 0.0, 0.0]), blocks)
    assert not standard.beats(mean)
    assert choose([standard, mean], rates_told=False) is standard
    assert choose([standard, mean], rates_told=False, both_directions=False) is mean
    # What is left is systematic, in some blocks more than in others: noise is no measure of the gain.
    uneven = np.array([0.5, 0.0, 1.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    rough = [replace(score, squared_errors=score.squared_errors + uneven) for score in (standard, mean)]
    assert choose(rough, rates_told=False) is rough[1]


def test_even_noise_is_told_from_what_is_systematic() -> None:
    """White noise passes but once in a thousand; a ripple in a third of the time does not."""
    draws = np.random.default_rng(5).standard_normal((400, 20, 125))
    even = [Score(STANDARD, 6, np.mean(d**2, axis=1), np.full(20, 125)).leaves_even_noise for d in draws]
    assert np.mean(even) > 0.99
    draws[:, :7] += 1.5 * np.sin(np.arange(125) / 9.0)
    assert not any(
        Score(STANDARD, 6, np.mean(d**2, axis=1), np.full(20, 125)).leaves_even_noise for d in draws
    )


def test_harm_is_looked_for_on_runs_left_out() -> None:
    """Parts of a run may be told by the rest of it where the next run is not."""

    def both(features: str, parameters: int, on_runs: list[float], on_parts: list[float]) -> Score:
        return replace(score(features, parameters, on_runs + on_parts), of_runs=len(on_runs))

    mean = both("", 1, [1.0, 1.1, 0.9, 1.0], [9.0, 9.1, 8.9, 9.0])
    standard = both(STANDARD.features, 6, [1.2, 0.9, 1.3, 1.1], [0.1, 0.1, 0.1, 0.1])
    assert standard.beats(mean) and not standard.on_runs.beats(mean.on_runs)
    assert choose([standard, mean], rates_told=True) is mean
    helps = both(STANDARD.features, 6, [0.2, 0.2, 0.3, 0.2], [0.1, 0.1, 0.1, 0.1])
    assert choose([helps, mean], rates_told=True) is helps


def test_several_runs_are_left_out_in_turn_and_in_parts() -> None:
    runs = [world_run(rate, seed)[0] for seed, rate in enumerate((0.5, 1.0))]
    found = trial.Trial(runs, 0).score(Candidate("T, dT"))
    assert found.of_runs is not None
    assert found.rows[: found.of_runs].sum() == found.rows[found.of_runs :].sum()
    single = trial.Trial(runs[:1], 0).score(Candidate("T, dT"))
    assert single.of_runs is None and single.on_runs is single


def test_pure_noise_gets_no_compensation(linear_only: None) -> None:
    quiet = World(polynomial=(1.0,), gradient=0.0, rate=0.0, product=0.0, noise=0.1)
    taken = []
    for seed in range(4):
        run, _ = quiet.run(cycle(1.0, 60.0), 60.0, seed, "quiet")
        model = AutoModel().fit(run)
        taken.append(any(model.weighed_.weights.values()))
        assert np.std(model.predict(run)) < 0.1 * run.gyro.std()
        if not taken[-1]:
            assert "no compensation" in model.card_.notes[0]
            # One constant, the mean of what the members are weighed on: within its error of the run's.
            predicted = model.predict(run)
            assert np.ptp(predicted) == 0.0
            assert abs(predicted[0] - run.gyro.mean()) < 0.1 / np.sqrt(len(predicted))
            # It has a box and an interval all the same.
            assert model.features_ is not None and model.intervals_.half_width(0.9) > 0.0
    # A member may gain a little by luck; it must not be the rule.
    assert taken.count(True) <= 1


def test_it_finds_the_drift_and_holds_at_another_rate(linear_only: None) -> None:
    model = fitted_to_one_rate()
    other, truth = world_run(0.6, 1)
    evaluation = model.evaluate(other)
    error = (evaluation.drift - truth)[evaluation.full]
    assert np.sqrt(np.mean(error**2)) < 0.25 * truth.std()


@pytest.mark.parametrize("seed", [71038, 71056])
def test_at_one_rate_what_passed_by_luck_is_not_taken(seed: int, linear_only: None) -> None:
    """Units on which a form that gains two standard errors is worse at another rate than the standard."""
    unit = default_rates.world(seed)
    run, _ = unit.run(cycle(1.0, default_rates.SAMPLE_S), default_rates.SAMPLE_S, 10 * seed, "run.csv")
    one_rate = trial.Trial([run], 0)
    scores = [one_rate.score(candidate) for candidate in one_rate.candidates]
    lucky = choose(scores, rates_told=True).candidate
    assert choose(scores, rates_told=False).candidate == STANDARD
    standard, larger = (errors_at_other_rates(unit, run, candidate) for candidate in (STANDARD, lucky))
    assert (larger > 1.02 * standard).any()


def test_at_one_rate_a_gradient_well_above_the_noise_is_taken(linear_only: None) -> None:
    unit = World(noise=0.02, gradient=0.1)
    run, _ = world_run(1.0, 0, unit)
    chosen = AutoModel().fit(run).choice_.candidate
    assert "T_in-T_out" in chosen.features
    standard, larger = (errors_at_other_rates(unit, run, candidate) for candidate in (STANDARD, chosen))
    assert (larger < 0.5 * standard).all()


def test_terms_that_one_rate_cannot_tell_are_not_offered() -> None:
    run, _ = world_run(1.0, 0)
    few = {c.features for c in candidates_for([run], rates_told=False, direction_told=True)}
    many = {c.features for c in candidates_for([run], rates_told=True, direction_told=True)}
    assert not any("sign" in text or "d(T_in-T_out)" in text for text in few)
    assert any("sign" in text for text in many) and any("d(T_in-T_out)" in text for text in many)
    assert few < many
    # How the drift depends on the rate stays as in the standard form.
    assert all({"dT", "T*dT"} <= set(parse_features(text).names()) for text in few if text)
    assert "" in few and STANDARD.features in few


def test_one_way_only_offers_no_rates() -> None:
    run, _ = world_run(1.0, 0)
    offered = candidates_for([run], rates_told=True, direction_told=False)
    assert {name for c in offered if c.features for name in parse_features(c.features).sensors} == {"T"}
    assert all(parse_features(c.features).window_s == 0.0 for c in offered if c.features)


def test_rates_of_the_training_runs_are_told() -> None:
    runs = [world_run(rate, seed)[0] for seed, rate in enumerate((0.4, 1.0, 2.0))]
    assert trial.Trial(runs[:1], 0).rates < 3
    assert trial.Trial(runs, 0).rates >= 3


def test_one_direction_only_is_said(linear_only: None) -> None:
    chamber = programme([("soak", 30.0, 0.0), ("ramp", 60.0, 1.0)], -20.0, SAMPLE_S)
    up, _ = WORLD.run(chamber, SAMPLE_S, 0, "up.csv")
    assert any("one way only" in note for note in AutoModel().fit(up).card_.notes)
    assert not any("one way only" in note for note in fitted_to_one_rate().card_.notes)


def test_left_out_runs_reveal_what_one_run_hides(linear_only: None) -> None:
    """Two ramps whose drift goes with time, not with temperature: no model may be made of that."""
    up = programme([("ramp", 60.0, 1.0)], -20.0, SAMPLE_S)
    runs = []
    for name, chamber in (("up", up), ("down", up[::-1])):
        run, _ = World(noise=0.01).run(chamber, SAMPLE_S, 3, name)
        drift = np.linspace(0.0, 1.0, len(run))
        noise = 0.01 * np.random.default_rng(len(name)).standard_normal(len(run))
        runs.append(run.with_columns(gyro=drift + noise))
    assert any(AutoModel().fit(runs[:1]).weighed_.weights.values())
    assert not any(AutoModel().fit(runs).weighed_.weights.values())


@pytest.mark.parametrize("kind", ["auto", "mixed-effects"])
def test_what_shifts_a_run_as_a_whole_hides_no_drift_with_temperature(kind: str, linear_only: None) -> None:
    """Full cycles, shifted by nothing or by far more than the drift: the same is left of it."""
    left = []
    for shifts in ((0.0, 0.0, 0.0), (4.0, -2.0, 1.0)):
        shifted = [world_run(1.0, seed)[0] for seed in range(3)]
        shifted = [run.with_columns(gyro=run.gyro + shift) for run, shift in zip(shifted, shifts)]
        *train, test = shifted
        drift = make_model(kind).fit(train).predict(test)
        left.append(np.std(test.error_deg_h - drift) / np.std(test.error_deg_h))
    assert left[0] < 0.5
    assert left[1] == pytest.approx(left[0], rel=0.05)


@pytest.mark.parametrize("axis", ["x", "z"])
def test_a_run_up_and_a_run_down_do_no_harm_on_a_third(axis: str) -> None:
    """A MEMS cycle whose legs lie apart in time: their shifts look like an effect of the rate's sign."""
    up, last_down, down = (shipped_run(f"thermal-cycle-{leg}-{axis}") for leg in "231")
    model = AutoModel().fit([up, last_down])
    assert any("shift from run to run looks like" in note for note in model.card_.notes)
    error = down.error_deg_h
    left = error - model.predict(down)
    assert np.sqrt(np.mean(left**2)) < 1.05 * np.sqrt(np.mean((error - model.weighed_.table.y.mean()) ** 2))


def test_saving_keeps_choice_and_numbers(linear_only: None, tmp_path) -> None:
    run, _ = world_run(1.0, 0)
    model = fitted_to_one_rate()
    save_model(model, tmp_path / "model")
    loaded = load_model(tmp_path / "model")
    np.testing.assert_array_equal(loaded.predict(run), model.predict(run))
    assert loaded.describe() == model.describe()
    for ours, theirs in zip(loaded.predict_interval(run), model.predict_interval(run), strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_stated_features_are_kept(linear_only: None) -> None:
    run, _ = world_run(1.0, 0)
    model = AutoModel(features="T, dT")
    names = {c.name for c in trial.Trial([run], 0, "T, dT").candidates}
    assert names == {"mean", "T, dT", "RBF network of T, dT"}
    assert model.get_params()["features"] == "T, dT"


def test_each_sensor_is_written_out(linear_only: None) -> None:
    time = np.arange(0.0, 4000.0, 10.0)
    inner = 20.0 * np.sin(time / 600.0)
    run = Run.from_columns("a", time=time, gyro=0.1 * inner, T_in=inner, T_out=0.9 * inner + np.cos(time))
    model = AutoModel(features="{sensor}").fit(run)
    assert model.feature_names == ["T_in", "T_out"]
    assert any(candidate["name"] == "T_in, T_out" for candidate in model.selection_)


@pytest.mark.parametrize("bumps", [1.0, 0.0])
def test_a_network_stands_alone_where_it_leaves_clearly_less(bumps: float) -> None:
    """Two bumps in temperature, at five rates each way, that no polynomial follows; or a straight line."""

    def drifting(seed: int) -> tuple[Run, np.ndarray]:
        moved = 1.0 + np.cumsum(np.repeat([0.6, 2.0, 5.0, 1.2, 3.2], 50))
        T = np.abs((moved + 7.0 * seed) % 100.0 - 50.0) - 5.0
        bump = 3.0 * np.exp(-0.5 * ((T - 30.0) / 4.0) ** 2) - 2.0 * np.exp(-0.5 * ((T - 5.0) / 3.0) ** 2)
        drift = bumps * bump + (1.0 - bumps) * 0.05 * T
        gyro = drift + 0.1 * np.random.default_rng(seed).standard_normal(250)
        return Run(f"{seed}.csv", {"time": 60.0 * np.arange(250), "gyro": gyro, "T": T}), drift

    found = weigh([drifting(0)[0], drifting(1)[0]], Candidate("T", network=True), None, 0, False)
    run, drift = drifting(2)
    assert (found.model.kind == "rbf") is (found.told().startswith("made of 100 % RBF")) is (bumps > 0.0)
    assert np.std(found.model.predict(run) - drift) < 0.05 * np.std(drift)
    assert found.left < 0.2 * found.mean_left
