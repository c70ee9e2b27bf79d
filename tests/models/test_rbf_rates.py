"""Rates in the training runs, and what a network may make of them."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.rbf_rates import __main__ as rbf_rates
from experiments.rbf_rates.__main__ import CUBIC, chamber, gaussian_process, mean_of, rms_error, world
from experiments.synthetic_world import cycle
from fogml.features.parse import parse_features
from fogml.models.names import make_model
from fogml.models.rbf.rates import distinct_rates, followed_columns, restrained_inputs, training_rates
from fogml.runs.run import Run
from fogml.signals.averages import block_averages

FEATURES = "T, dT, T*dT"


def run_at(rates: tuple[float, ...], seed: int = 1, noise_seed: int = 2) -> tuple[Run, np.ndarray]:
    return world(seed).run(chamber(rates), 1.0, noise_seed, "run")


def rates_of(run: Run) -> tuple[np.ndarray, np.ndarray]:
    atoms, full, _ = parse_features("T, dT").atom_values(run)
    return atoms[full, 1], atoms[full, 0]


@pytest.mark.parametrize(
    ("rates", "expected"),
    [((0.2,), 1), ((1.0,), 1), ((2.0,), 1), ((0.5, 1.0), 2), ((0.5, 1.0, 2.0), 3), ((2.0, 0.5, 1.0), 3)],
)
def test_each_ramp_rate_counts_once_whatever_the_lags(rates: tuple[float, ...], expected: int) -> None:
    rate, temperature = rates_of(run_at(rates)[0])
    assert distinct_rates(rate, temperature) == expected


def test_standing_still_and_direction_do_not_count() -> None:
    assert distinct_rates([]) == 0
    assert distinct_rates(np.zeros(100)) == 0
    assert distinct_rates(np.repeat([1.0, 0.0, -1.0], 100)) == 1
    assert distinct_rates(np.repeat([1.0, 0.5, -1.0, 2.0], [100, 200, 100, 50])) == 3


def test_rates_that_never_meet_at_a_temperature_count_as_one() -> None:
    temperature = np.concatenate([np.linspace(-40.0, t, 500) for t in (60.0,)])
    rate = np.where(temperature < -7.0, 0.5, np.where(temperature < 27.0, 1.0, 2.0))
    assert distinct_rates(rate) == 3
    assert distinct_rates(rate, temperature) == 1


def test_columns_a_network_may_see() -> None:
    features = parse_features("T, T^2, dT, T*dT, T_out, T-T_out, sign(dT)")
    temperature = np.tile(np.linspace(-10.0, 40.0, 500), 6)
    rate = np.repeat([0.5, -0.5, 1.0, -1.0, 2.0, -2.0], 500)
    values = {"T": temperature, "T_out": temperature, "d(T)": rate}

    def atoms(one_rate: bool) -> np.ndarray:
        rows = np.abs(rate) == 1.0 if one_rate else np.ones(len(rate), dtype=bool)
        held = {**values, "T-T_out": rate, "sign(d(T))": np.sign(rate)}
        columns = []
        for atom in features.atoms:
            moving = rate if atom.operator == "d" else np.sign(rate)
            columns.append(held.get(atom.text, moving if atom.operator != "value" else rate)[rows])
        return np.column_stack(columns)

    assert training_rates(features, atoms(one_rate=True)) == 1
    assert training_rates(features, atoms(one_rate=False)) == 3
    assert restrained_inputs(features, atoms(one_rate=True)).tolist() == [0, 1]
    assert restrained_inputs(features, atoms(one_rate=False)).tolist() == list(range(7))
    assert followed_columns(features).tolist() == [2, 3, 5]


@pytest.mark.parametrize("rates", [(1.0,), (1.0, 3.0), (0.4, 1.0, 2.5)])
@pytest.mark.parametrize(
    "rate_of", ["dT[block, 120 s]", "diff(T)[slope, 180 s]", "diff(T)[exp, 120 s]", "diff(T)[first]"]
)
def test_a_difference_tells_as_many_rates_as_a_rate(rates: tuple[float, ...], rate_of: str) -> None:
    legs = [np.arange(-20.0, 60.0, rate / 6.0)[::way] for rate in rates for way in (1, -1)]
    T = np.concatenate(legs)
    run = Run("ramps", {"time": 10.0 * np.arange(len(T)), "gyro": np.zeros(len(T)), "T": T})
    features = parse_features(f"T, {rate_of}")
    values, full, _ = features.atom_values(run)
    assert training_rates(features, values[full]) == len(rates)


def test_without_a_rate_nothing_is_restrained() -> None:
    features = parse_features("T, T^2")
    assert restrained_inputs(features, np.linspace(0.0, 1.0, 50)[:, None]).tolist() == [0, 1]


def errors(rates: tuple[float, ...], others: tuple[float, ...], seed: int) -> dict[str, list[float]]:
    """Rms error against the truth at other rates, of network and cubic."""
    train, _ = run_at(rates, seed, seed + 50)
    models = {"rbf": make_model("rbf", FEATURES), CUBIC: make_model("polynomial", "T^1..3, dT, T*dT")}
    found: dict[str, list[float]] = {name: [] for name in models}
    for name, model in models.items():
        model.fit(train)
        for rate in others:
            run, truth = run_at((rate,), seed, seed + 90)
            found[name].append(float(np.sqrt(np.mean((model.predict(run) - truth)[150:] ** 2))))
    return found


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_trained_at_one_rate_never_worse_than_the_cubic_at_another(seed: int) -> None:
    found = errors((1.0,), (0.4, 0.7, 1.5, 2.5), seed)
    assert np.all(np.array(found["rbf"]) <= found[CUBIC]), found


def test_trained_at_three_rates_a_network_of_the_rate_follows_the_truth_beyond_them_too() -> None:
    found = errors((0.5, 1.0, 2.0), (0.7, 1.5, 2.5), 4)
    assert max(found["rbf"][:2]) < 0.1 * 0.05, found  # a tenth of the noise of one sample
    assert np.all(np.array(found["rbf"]) < found[CUBIC]), found


def test_trained_at_three_rates_a_network_is_level_with_a_gaussian_process(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(rbf_rates, "PROCESS_ROWS", 300)
    ratios = []
    for seed in (11,):
        train, _ = run_at((0.5, 1.0, 2.0), seed, seed + 50)
        network, process = make_model("rbf", FEATURES).fit(train).predict, gaussian_process(train)
        for rate in (0.7, 1.5):
            run, truth = run_at((rate,), seed, seed + 90)
            ratios.append(rms_error(network, run, truth) / rms_error(process, run, truth))
    assert mean_of(ratios) < 1.1, ratios


@pytest.mark.parametrize("seed", [0, 1])
def test_what_is_left_on_another_run_is_hardly_more_than_its_noise(seed: int) -> None:
    unit = world(seed, noise=0.3)
    train, _ = unit.run(cycle(1.0, 1.0, 10.0), 1.0, 2 * seed, "a")
    test, truth = unit.run(cycle(0.8, 1.0, 10.0), 1.0, 2 * seed + 1, "b")
    drift = make_model("rbf", "T, dT, T*dT, T_in-T_out").fit(train).predict(test)
    left, floor = (
        block_averages(test.time[200:], values[200:], window_s=100.0).values[0].std()
        for values in (test.gyro - drift, test.gyro - truth)
    )
    assert left < 1.10 * floor


def test_model_says_that_it_was_restrained_and_only_then() -> None:
    one = make_model("rbf", FEATURES).fit(run_at((1.0,))[0])
    assert one.regressor_.network_.columns.tolist() == [0]
    assert any(
        "1, where 3 are needed" in note and "dT, T*dT linear" in note for note in one.describe()["notes"]
    )
    three = make_model("rbf", FEATURES).fit(run_at((0.5, 1.0, 2.0))[0])
    assert three.regressor_.network_.columns.tolist() == [0, 1, 2]
    assert not any("distinct rates" in note for note in three.describe()["notes"])


def test_asked_for_inputs_are_kept() -> None:
    model = make_model("rbf", FEATURES).set_params(regressor__network_inputs=[0, 1], regressor__centres=8)
    model.fit(run_at((1.0,))[0])
    assert model.regressor_.network_.columns.tolist() == [0, 1]
