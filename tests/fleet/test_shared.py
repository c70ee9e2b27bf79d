"""Shared constants: what a fleet tells of the next unit, and when it tells nothing."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from fogml.errors import InputError
from fogml.fleet.constants import UnitConstants, fleet_constants
from fogml.fleet.shared import ODD, shared_model
from fogml.models.feature_model import FeatureModel
from fogml.models.linear import LinearRegressor
from fogml.models.mixed_effects_model import MixedEffectsModel
from fogml.models.prior import Prior, agreement, posterior
from fogml.models.saved import load_model, save_model
from fogml.runs.facts import Facts
from fogml.runs.run import Run

FORM = "T^1..2, dT"
MEAN, STD = np.array([1.0, 0.05, 4e-4, 0.5]), np.array([0.3, 0.01, 5e-5, 0.05])
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def unit_run(seed: int, constants: np.ndarray, *, hours: float = 6.0, phase: float = 0.0) -> Run:
    rng = np.random.default_rng(seed)
    time = 10.0 * np.arange(round(hours * 360))
    temperature = 20.0 + 35.0 * np.sin(2 * np.pi * time / (6.0 * 3600) + phase)
    rate = np.gradient(temperature, time) * 60.0
    u = temperature - 20.0
    drift = constants[0] + constants[1] * u + constants[2] * u**2 + constants[3] * rate
    columns = {"time": time, "gyro": drift + 0.05 * rng.normal(size=len(time)), "T": temperature}
    return Run("r.csv", columns, Facts(unit="u", axis="x"))


def draw(seed: int, far: float = 1.0) -> np.ndarray:
    return MEAN + far * STD * np.random.default_rng([seed, 3]).normal(size=4)


@pytest.fixture(scope="module")
def fleet():
    return fleet_constants([UnitConstants.of([unit_run(s, draw(s))], FORM) for s in range(24)])


def test_the_fleets_spread_is_found(fleet):
    truth = np.array([draw(s) for s in range(24)])
    # The coefficient of the rate is the same in any centring of T.
    own = fleet.values[:, -1] / fleet.prior.scale[-1]
    np.testing.assert_allclose(own, truth[:, -1], atol=0.02)
    assert fleet.prior.mean[-1] / fleet.prior.scale[-1] == pytest.approx(truth[:, -1].mean(), abs=0.02)
    std = np.sqrt(fleet.prior.covariance[-1, -1]) / fleet.prior.scale[-1]
    assert 0.6 * truth[:, -1].std() < std < 1.5 * truth[:, -1].std()


def test_condensed_rows_tell_what_the_rows_tell():
    run = unit_run(1, MEAN)
    constants = UnitConstants.of([run], FORM)
    again = UnitConstants.from_dict(constants.as_dict())
    information, image = again.in_columns(again.shift, again.scale)
    solution = np.linalg.solve(information, image)
    model = FeatureModel(FORM, LinearRegressor()).fit(run)
    apart = solution[1:] - model.regressor_.coef_ * again.scale
    assert (np.abs(apart) < np.sqrt(np.diag(np.linalg.inv(information)))[1:]).all()
    np.testing.assert_array_equal(again.triangles, constants.triangles)


def test_the_posterior_is_the_textbooks_for_one_spread():
    rng = np.random.default_rng(0)
    Z, y = rng.normal(size=(20, 3)), rng.normal(size=20)
    covariance = np.diag([1.0, 0.5, 2.0])
    prior = Prior(np.array([0.1, -0.2, 0.3]), covariance, np.zeros(2), np.ones(2))
    mean, spread, _ = posterior(Z.T @ Z, Z.T @ y, prior, [1.0])
    # Adding rows that stand for the prior to a plain least-squares problem.
    rows = np.vstack([Z, np.diag(1 / np.sqrt(np.diag(covariance)))])
    target = np.append(y, prior.mean / np.sqrt(np.diag(covariance)))
    np.testing.assert_allclose(mean, np.linalg.lstsq(rows, target)[0], rtol=1e-10)
    np.testing.assert_allclose(spread, np.linalg.inv(rows.T @ rows), rtol=1e-10)


def _information(rng: np.random.Generator) -> np.ndarray:
    """Rows that tell much of one direction, a little of a second, and nothing of the third."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return turn @ np.diag([50.0, 2.0, 0.0]) @ turn.T


def test_agreement_is_the_distance_of_the_two_estimates_under_both_covariances():
    rng = np.random.default_rng(1)
    half = rng.normal(size=(3, 3))
    prior = Prior(rng.normal(size=3), half @ half.T + np.eye(3), np.zeros(2), np.ones(2))
    information = _information(rng) + 5.0 * np.eye(3)
    own = prior.mean + 1.5 * rng.normal(size=3)
    apart = own - prior.mean
    both = np.linalg.inv(information) + prior.covariance
    joint = chi2.sf(apart @ np.linalg.solve(both, apart), 3)
    found = agreement(information, information @ own, prior)
    # The lesser of two probabilities is at most twice as likely to be so small; 10000 draws tell it.
    room = 4.0 * np.sqrt(joint / 10_000)
    assert found <= 2.0 * joint + room
    # The largest direction alone cannot lie farther out than all together.
    assert found >= min(joint, chi2.sf(apart @ np.linalg.solve(both, apart), 1)) - room


def test_units_of_the_fleet_are_called_odd_as_seldom_as_stated():
    rng = np.random.default_rng(2)
    prior = Prior(np.zeros(3), np.diag([1.0, 4.0, 0.25]), np.zeros(2), np.ones(2))
    information = _information(rng)
    values, vectors = np.linalg.eigh(information)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    found = []
    for far in (1.0, 6.0):
        units = far * rng.normal(size=(300, 3)) * np.sqrt(np.diag(prior.covariance))
        images = units @ information + rng.normal(size=(300, 3)) @ root.T
        found.append(np.mean([agreement(information, image, prior) < ODD for image in images]))
    # Three standard deviations of 300 units.
    assert found[0] == pytest.approx(0.05, abs=0.038)
    assert found[1] > 0.8


def test_a_fleet_of_few_units_is_less_sure_of_an_odd_one():
    """Of units whose fleet's variance is itself estimated from six, no more than stated are called odd."""
    rng = np.random.default_rng(5)
    odd = {True: 0, False: 0}
    for _ in range(400):
        fleet = rng.normal(size=(6, 1))
        covariance = np.array([[fleet.var(ddof=1)]])
        for few in odd:
            units = 6.0 if few else float("inf")
            prior = Prior(fleet.mean(axis=0), covariance, np.empty(0), np.empty(0), units)
            odd[few] += agreement(np.array([[1e6]]), np.array([1e6 * rng.normal()]), prior) < ODD
    assert odd[True] / 400 == pytest.approx(0.05, abs=0.033)
    assert odd[False] / 400 > 0.09


def test_the_level_holds_where_a_fleet_tells_its_whole_covariance():
    """Fleets of 12 units, three correlated constants known without error: 5 % of further units are odd."""
    rng = np.random.default_rng(7)
    root = np.array([[1.0, 0.0, 0.0], [0.6, 0.5, 0.0], [-0.3, 0.2, 0.4]])
    odd, sizes = [], []
    for _ in range(30):
        units = []
        for constants in rng.normal(size=(12, 3)) @ root.T:
            triangle = 1e4 * np.column_stack([np.eye(3), constants])
            box = {"T": [0.0, 1.0]}
            told = (triangle[None], {"N": 1.0, "B": 0.0, "K": 0.0}, 0.0, 100, np.zeros(2), np.ones(2))
            units.append(UnitConstants("T^1..2", *told, box))
        prior = fleet_constants(units).prior
        sizes.append(np.diag(prior.covariance) / np.diag(root @ root.T))
        for constants in rng.normal(size=(10, 3)) @ root.T:
            odd.append(agreement(1e8 * np.eye(3), 1e8 * constants, prior) < ODD)
    # Three standard deviations of 300 units; the t distribution of n - 1 degrees of freedom gives 12 %.
    assert np.mean(odd) == pytest.approx(0.05, abs=0.045)
    assert np.mean(sizes) == pytest.approx(1.0, abs=0.15), np.mean(odd)


def test_what_rows_do_not_tell_can_agree_with_nothing():
    prior = Prior(np.zeros(3), np.eye(3), np.zeros(2), np.ones(2))
    assert agreement(1e-3 * np.eye(3), np.zeros(3), prior) == 0.0
    assert agreement(np.diag([10.0, 0.0, 0.0]), np.zeros(3), prior) == 1.0


def test_a_unit_like_its_fleet_needs_a_shorter_run(fleet):
    gains = []
    for seed in range(100, 105):
        constants = draw(seed)
        short, other = unit_run(seed, constants, hours=2.0), unit_run(seed + 1, constants, phase=2.0)
        errors = [
            np.sqrt(np.mean((model.fit(short).predict(other) - other.gyro) ** 2))
            for model in (shared_model(fleet), MixedEffectsModel(FORM))
        ]
        gains.append(errors[0] / errors[1])
    assert np.median(gains) < 0.6
    assert max(gains) < 1.05


def test_a_units_shift_from_run_to_run_is_learnt_from_units_of_several_runs():
    def runs(seed: int, count: int) -> list[Run]:
        shifts = 0.5 * np.random.default_rng([seed, 5]).normal(size=count)
        return [unit_run(10 * seed + k, draw(seed) + s * LEVEL) for k, s in enumerate(shifts)]

    units = [UnitConstants.of(runs(seed, 3), FORM) for seed in range(8)]
    fleet = fleet_constants(units)
    assert 0.3 < fleet.own["own shift"] < 0.8
    assert "own shift" not in UnitConstants.of(runs(9, 1), FORM).own
    # 0.5 of the run's own and 0.3 of the unit's: most of a level is not the unit's.
    run = unit_run(90, MEAN + LEVEL)
    level = np.mean(shared_model(fleet).fit(run).predict(run) - unit_run(90, MEAN).gyro)
    alone = np.mean(MixedEffectsModel(FORM).fit(run).predict(run) - unit_run(90, MEAN).gyro)
    assert level < 0.7 < alone


def test_outputs_that_stand_still_make_a_fleet():
    still = [run.with_columns(gyro=np.ones(len(run.time))) for run in (unit_run(1, MEAN), unit_run(2, MEAN))]
    fleet = fleet_constants([UnitConstants.of(still, FORM) for _ in range(3)])
    assert fleet.own["own shift"] > 0.0
    np.testing.assert_allclose(shared_model(fleet).fit(still).predict(still[0])[1000:], 1.0, atol=0.01)


def test_an_odd_unit_is_left_to_its_own_run(fleet):
    odd = unit_run(200, draw(200, far=20.0))
    model = shared_model(fleet).fit(odd)
    assert any("odd" in note for note in model.card_.notes)
    np.testing.assert_array_equal(model.regressor_.coef_, model.fitted_.coef * model.skill_)


def test_one_cycle_is_not_taken_for_slow_drift():
    """With noise far below what the form lacks, a rate of one cycle stays a rate."""

    def lagged(seed: int, constants: np.ndarray) -> Run:
        run = unit_run(seed, constants)
        return run.with_columns(gyro=run.gyro + 0.02 * np.cos(3.0 * run.time / 3600.0))

    fleet = fleet_constants([UnitConstants.of([lagged(s, draw(s))], FORM) for s in range(5)])
    assert "own slow drift" not in fleet.own
    model = shared_model(fleet).fit(lagged(50, MEAN))
    assert model.regressor_.coef_[-1] == pytest.approx(MEAN[-1], abs=0.03)


def test_the_fleet_does_no_harm_to_odd_units(fleet):
    ratios = []
    for seed in range(500, 504):
        constants = draw(seed, far=6.0)
        short, other = unit_run(seed, constants, hours=1.0), unit_run(seed + 1, constants, phase=2.0)
        errors = [
            np.sqrt(np.mean((model.fit(short).predict(other) - other.gyro) ** 2))
            for model in (shared_model(fleet), MixedEffectsModel(FORM))
        ]
        ratios.append(errors[0] / errors[1])
    assert max(ratios) <= 1.05


def test_what_rests_on_the_fleet_alone_is_told(fleet):
    short = unit_run(600, draw(600), hours=2.0)
    model = shared_model(fleet).fit(short)
    (stretch,) = model.from_fleet_["T"]
    # Two hours of the sine go from 20 degC over 55 and back to 50, the first window apart; the fleet to -15.
    assert stretch == pytest.approx((-15.0, 20.0), abs=2.0)
    (note,) = [note for note in model.card_.notes if "rests on the fleet alone" in note]
    assert f"T from {stretch[0]:.1f} to {stretch[1]:.1f} degC" in note
    whole = shared_model(fleet).fit(unit_run(601, draw(600)))
    assert whole.from_fleet_ == {}
    assert not any("rests on the fleet" in note for note in whole.card_.notes)
    odd = shared_model(fleet).fit(unit_run(602, draw(602, far=20.0), hours=2.0))
    assert odd.from_fleet_ == {}


def test_where_a_unit_has_been_the_fleet_does_no_harm_to_odd_ones(fleet):
    ratios = []
    for seed in range(700, 705):
        constants = draw(seed, far=3.0)
        short, other = unit_run(seed, constants, hours=1.5), unit_run(seed + 1, constants, phase=2.0)
        drawn, alone = shared_model(fleet).fit(short), MixedEffectsModel(FORM).fit(short)
        there = ~alone.evaluate(other).outside
        errors = [
            np.sqrt(np.mean((model.predict(other) - other.gyro)[there] ** 2)) for model in (drawn, alone)
        ]
        ratios.append(errors[0] / errors[1])
    assert len(set(ratios)) > 1
    assert max(ratios) <= 1.05


def test_too_short_a_run_is_not_carried_beyond_itself(fleet):
    model = shared_model(fleet).fit(unit_run(300, draw(300), hours=0.3))
    assert any("cover" in note for note in model.card_.notes)
    low, high = model.features_.box["T"]
    assert high - low < 0.25 * (fleet.box["T"][1] - fleet.box["T"][0])


def test_temperatures_beyond_the_fleets_cover_none_of_them(fleet):
    run = unit_run(301, draw(301))
    model = shared_model(fleet).fit(run.with_columns(T=run.columns["T"] + 100.0))
    assert any("the runs cover 0 % of the fleet's temperatures" in note for note in model.card_.notes)


def test_a_shared_model_is_saved_and_loaded(fleet, tmp_path):
    model = shared_model(fleet).fit(unit_run(400, draw(400), hours=2.0))
    save_model(model, tmp_path / "model")
    loaded = load_model(tmp_path / "model")
    run = unit_run(401, draw(400), phase=1.0)
    np.testing.assert_array_equal(loaded.predict(run), model.predict(run))
    assert loaded.kind == model.kind
    assert loaded.card_.box["T"] == pytest.approx(model.card_.box["T"])


def test_faults(fleet):
    with pytest.raises(InputError, match="at least 3"):
        fleet_constants([])
    with pytest.raises(InputError, match="are not understood"):
        shared_model({"features": FORM})
    with pytest.raises(InputError, match="prior is not understood"):
        shared_model({"features": FORM, "prior": {"mean": [1.0]}, "box": {}})
    whole = {"features": "T, dT", "prior": fleet.prior.as_dict(), "box": fleet.box, "own": fleet.own}
    with pytest.raises(InputError, match=r"prior of 3 columns.*do not belong to T, dT"):
        shared_model(whole)
    with pytest.raises(InputError, match="sizes"):
        shared_model({**whole, "features": FORM, "own": {"own slow drift": -1.0}})
    with pytest.raises(InputError, match="are not understood"):
        shared_model({**whole, "features": FORM, "noise": {"N": -1.0}})
    with pytest.raises(InputError, match="4 positive factors 'wider'"):
        Prior.from_dict(fleet.prior.as_dict() | {"wider": [1.0]})


def test_slow_noise_counts_in_the_standard_errors():
    """Errors of the next units' coefficients over their standard errors, under a random walk."""

    def walking(seed: int, constants: np.ndarray) -> Run:
        run = unit_run(seed, constants)
        walk = np.cumsum(0.01 * np.random.default_rng([seed, 4]).normal(size=len(run.time)))
        return run.with_columns(gyro=run.gyro + walk)

    fleet = fleet_constants([UnitConstants.of([walking(s, draw(s))], FORM) for s in range(16)])
    apart = []
    for seed in range(800, 830):
        constants = draw(seed)
        # The constants are of T - 20 degC.
        level = constants[0] - 20.0 * constants[1] + 400.0 * constants[2]
        truth = np.array([level, constants[1] - 40.0 * constants[2], constants[2], constants[3]])
        model = shared_model(fleet).fit(walking(seed, constants))
        if model.from_fleet_ or model.agreement_ < ODD:
            continue
        told = model.describe()["coefficients"].values()
        apart.append([(one["value"] - true) / one["se"] for one, true in zip(told, truth, strict=True)])
    # By white noise alone the constant's came to 6. Of 28 units, 0.7 to 1.35 are 2.5 standard errors.
    size = np.sqrt(np.mean(np.square(apart), axis=0))
    assert len(apart) > 24
    assert np.all((size > 0.5) & (size < 1.35)), size
