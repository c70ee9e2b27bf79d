"""Covariates of production: what they tell of a unit's constants, and what they must not."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.fleet.constants import UnitConstants, fleet_constants
from fogml.fleet.covariates import CovariateColumns
from fogml.fleet.manifest import read_manifest
from fogml.fleet.shared import shared_model
from fogml.fleet.tasks import Task
from fogml.models.names import make_model
from tests.fleet.test_shared import FORM, MEAN, STD, draw, unit_run

LOTS = {"A": 1.0, "B": -1.0}


def made(seed: int) -> tuple[np.ndarray, dict[str, str]]:
    """Constants of which half the variance goes with a voltage and with the lot, in turn; and these two."""
    rng = np.random.default_rng([seed, 7])
    voltage, lot, own = rng.normal(), rng.choice(list(LOTS)), rng.normal(size=4)
    known = np.array([voltage, LOTS[lot], voltage, LOTS[lot]])
    return MEAN + STD * np.sqrt(0.5) * (known + own), {"voltage": f"{3.5 + 0.2 * voltage:.4f}", "lot": lot}


@pytest.fixture(scope="module")
def units():
    return [UnitConstants.of([unit_run(s, made(s)[0])], FORM, made(s)[1]) for s in range(24)]


@pytest.fixture(scope="module")
def fleet(units):
    return fleet_constants(units)


def error(model, seed: int, constants: np.ndarray) -> float:
    """Rms error of a model of a noisy run of an hour and a half, against the truth of a whole cycle."""
    short, other = unit_run(seed, constants, hours=1.5), unit_run(seed + 1, constants, phase=2.0)
    short = short.with_columns(gyro=short.gyro + 2.0 * np.random.default_rng(seed).normal(size=len(short)))
    u, rate = other.columns["T"] - 20.0, 60.0 * np.gradient(other.columns["T"], other.time)
    truth = np.column_stack([np.ones(len(u)), u, u**2, rate]) @ constants
    return float(np.sqrt(np.mean((model.fit(short).predict(other) - truth) ** 2)))


def test_a_prior_helps_and_a_covariate_that_explains_half_of_the_spread_helps_further(fleet):
    left = []
    for seed in range(100, 105):
        constants, known = made(seed)
        models = make_model("polynomial", FORM), shared_model(fleet), shared_model(fleet, known)
        left.append([error(model, seed, constants) for model in models])
    alone, prior, informed = np.exp(np.mean(np.log(left), axis=0))
    assert prior < 0.6 * alone
    # Half of the variance is left to be drawn: 0.71 of the error where the run tells nothing.
    assert informed < 0.9 * prior


def test_spread_and_slopes_are_those_of_the_units(fleet):
    whole, within = np.diag(fleet.prior.covariance), np.diag(fleet.effects.within.covariance)
    assert np.median(within / whole) == pytest.approx(0.5, abs=0.15)
    rate = fleet.effects.slopes[:, -1] / fleet.prior.scale[-1]
    lots = [fleet.effects.columns.names.index(f"lot={lot}") for lot in LOTS]
    assert rate[lots[0]] - rate[lots[1]] == pytest.approx(2.0 * STD[3] * np.sqrt(0.5), rel=0.3)
    none = fleet_constants([UnitConstants.of([unit_run(s, draw(s))], FORM) for s in range(4)])
    assert none.effects.columns.names == () and none.effects.prior({"lot": "A"}) is not None
    np.testing.assert_allclose(none.prior.covariance, none.effects.within.covariance)


def test_a_covariate_that_tells_nothing_does_no_harm(units, fleet):
    rng = np.random.default_rng(3)
    bare = [UnitConstants.from_dict({**u.as_dict(), "covariates": {}}) for u in units[:12]]
    noise = [
        UnitConstants.from_dict({**u.as_dict(), "covariates": {"noise": str(rng.normal())}}) for u in bare
    ]
    plain, noisy = fleet_constants(bare), fleet_constants(noise)
    ratios = []
    for seed in range(200, 203):
        constants = made(seed)[0]
        told = {"noise": str(rng.normal())}
        ratios.append(
            error(shared_model(noisy, told), seed, constants) / error(shared_model(plain), seed, constants)
        )
    assert np.exp(np.mean(np.log(ratios))) < 1.08


def test_an_odd_unit_is_left_to_its_own_run_whatever_its_covariates(fleet):
    constants = MEAN + 20.0 * STD
    model = shared_model(fleet, {"voltage": "3.5", "lot": "A"}).fit(unit_run(300, constants))
    assert any("odd" in note for note in model.card_.notes)


def test_what_is_not_known_widens_the_prior(fleet):
    known = fleet.effects.prior({"voltage": "3.5", "lot": "A"})
    for less in ({"voltage": "3.5"}, {"lot": "A"}, {}, {"lot": "never seen", "voltage": "3.5"}):
        more = fleet.effects.prior(less)
        assert np.trace(np.linalg.solve(known.covariance, more.covariance)) > 4.5
    far = fleet.effects.prior({"voltage": "9", "lot": "A"})
    assert np.all(np.diag(far.covariance) > np.diag(known.covariance))


def test_effects_go_through_a_file(fleet):
    told = {"features": FORM, "prior": fleet.prior.as_dict(), "box": fleet.box, "own": fleet.own}
    told["covariates"] = fleet.effects.as_dict()
    read = json.loads(json.dumps(told))
    known = {"voltage": "3.6", "lot": "B"}
    assert shared_model(read, known).prior == shared_model(fleet, known).prior
    read["covariates"]["slopes"] = [[1.0]]
    with pytest.raises(InputError, match="covariates"):
        shared_model(read, known)


def test_labels_and_numbers_are_told_apart():
    columns = CovariateColumns.of(
        [{"lot": "7", "power": "1.5"}, {"lot": "8A"}, {"power": "2.5"}, {"one": "3"}]
    )
    assert columns.names == ("lot=7", "lot=8A", "power")
    values, known = columns.row({"lot": "8A", "power": "high"})
    assert known.tolist() == [True, True, False] and values.tolist() == [-0.5, 0.5, 0.0]


def test_columns_of_a_manifest(tmp_path):
    path = tmp_path / "fleet.csv"
    head = "unit,train,test,covariate:coil lot,covariate:voltage"
    path.write_text(f"{head}\n1,a.csv,b.csv,7A,3.4\n2,a.csv,b.csv,,3.5\n")
    first, second = read_manifest(path)
    assert dict(first.covariates) == {"coil lot": "7A", "voltage": "3.4"}
    assert dict(second.covariates) == {"voltage": "3.5"}
    path.write_text(f"{head.replace('voltage', 'volt=age')}\n1,a.csv,b.csv,7A,3.4\n")
    with pytest.raises(InputError, match=r"unknown column 'covariate:volt=age'.*such as covariate:coil_lot"):
        read_manifest(path)


def test_constants_of_memory_are_drawn_like_others():
    """A play in the truth and in the form: its size is the fleet's, where a short run tells little of it."""

    def run(seed: int, hours: float = 6.0):
        own = unit_run(seed, draw(seed), hours=hours)
        state, play = own.columns["T"][0], []
        for T in own.columns["T"]:
            state = min(max(state, T - 5.0), T + 5.0)
            play.append(state)
        size = 0.03 + 0.003 * np.random.default_rng([seed, 9]).normal()
        return own.with_columns(gyro=own.gyro + size * (np.array(play) - own.columns["T"]))

    form = "T^1..2, dT, play(T, 5 degC)"
    found = fleet_constants([UnitConstants.of([run(s)], form) for s in range(10)])
    at = found.names.index("play(T, 5 degC)")
    mean = found.prior.mean[at] / found.prior.scale[at - 1]
    assert mean == pytest.approx(0.03, abs=0.004)
    model = shared_model(found).fit(run(50, hours=1.5))
    assert model.regressor_.coef_[at - 1] == pytest.approx(0.03, abs=0.01)


def test_a_unit_done_with_other_covariates_is_done_again(tmp_path):
    path = tmp_path / "fleet.csv"
    prints = []
    for lot in "AB":
        path.write_text(f"unit,train,test,covariate:lot\n1,shipped:cold-start-x,shipped:cold-start-x,{lot}\n")
        prints.append(Task(read_manifest(path)[0], dict, str(tmp_path), {}).fingerprint())
    assert prints[0] != prints[1]
