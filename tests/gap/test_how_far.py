"""When a held-out run's white noise is its own."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import fogml.gap.how_far as how_far
import fogml.gap.reports as reports
from fogml.gap.how_far import Foretold
from fogml.gap.linear_gaussian import Posterior
from fogml.gap.noise import white_noise
from fogml.gap.settings import Priors
from fogml.signals.noise_model import NoiseModel

ROWS, STATED = 60, 1.4


def _rows(seed):
    gap = np.random.default_rng(seed).standard_normal(ROWS)
    return SimpleNamespace(gap=gap, constants=np.ones((ROWS, 1)), row_s=3600.0)


def test_draws_of_small_coefficients_beside_large_ones_have_their_own_scatter():
    """Whatever their units: here deviations from 1e-11 to 1e6, each correlated by 0.5 with each other."""
    deviations = np.array([1e6, 1.0, 1e-4, 1e-11])
    covariance = np.outer(deviations, deviations) * (0.5 + 0.5 * np.eye(4))
    priors = replace(Priors(), reported=replace(Priors().reported, draws=20_000))
    found = SimpleNamespace(setting=SimpleNamespace(priors=priors))
    told = Foretold(found, (), Posterior(np.zeros(4), covariance)).drawn(np.random.default_rng(0))
    np.testing.assert_array_equal(told[:, 0], 0.0)
    off = told[:, 1:] / deviations[:, None]
    np.testing.assert_allclose(off @ off.T / off.shape[1], 0.5 + 0.5 * np.eye(4), atol=0.03)


def test_white_noise_of_a_run_is_known_as_well_as_stated():
    logs = np.log([white_noise(_rows(seed), 0.0)[0] for seed in range(1500)])
    # Its deviation is known to 2 % of 1500 runs.
    assert np.std(logs) == pytest.approx(STATED / math.sqrt(ROWS), rel=0.12)


@pytest.mark.parametrize("others", [1.0, 0.7])
@pytest.mark.parametrize(("errors", "own"), [(2.9, False), (3.1, True), (-2.9, False), (-3.1, True)])
def test_beyond_three_of_its_errors_the_noise_is_the_runs_own(monkeypatch, errors, own, others):
    """And is said to be where the fit runs themselves show another one."""
    usual = NoiseModel(0.01, 0.001, 0.0)
    bound = 3.0 * STATED / math.sqrt(ROWS)
    white = usual.N * math.exp(errors / 3.0 * bound)
    shown = {"fit": others * usual.N, "held out": white}
    found = SimpleNamespace(
        field=SimpleNamespace(whitening=SimpleNamespace(noise=usual)),
        setting=SimpleNamespace(priors=Priors(), scene=SimpleNamespace(runs=list(shown), fitted=1)),
        points=SimpleNamespace(prior=SimpleNamespace(centre=usual)),
        columns=None,
    )
    monkeypatch.setattr(how_far, "white_noise", lambda run, *_: (shown[run], ROWS))
    model, said = how_far._own_noise(found, 1, ())
    assert (white if own else usual.N) == model.N and model.B == usual.B
    assert bool(said) == (own and abs(math.log(white / shown["fit"])) > bound)


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_lags_of_held_out_runs_of_other_rows_are_in_the_mean_length_of_all(monkeypatch, order):
    """Whichever run comes first: 300 rows of 10 s and 100 of 30 s are of 15 s in the mean."""
    rng = np.random.default_rng(0)
    runs = [
        SimpleNamespace(gap=rng.standard_normal(count), row_s=row_s)
        for count, row_s in ((300, 10.0), (100, 30.0))
    ]
    usual = NoiseModel(0.01, 0.001, 0.0)
    found = SimpleNamespace(
        field=SimpleNamespace(whitening=SimpleNamespace(noise=usual)),
        points=SimpleNamespace(fit=SimpleNamespace(standard_errors=np.zeros(3)), source="runs"),
        scene=SimpleNamespace(runs=[None, *(runs[i] for i in order)], fitted=1),
        setting=SimpleNamespace(priors=Priors()),
    )
    monkeypatch.setattr(reports, "whitener_of", lambda *_: SimpleNamespace(whiten=lambda values: values))
    told = reports.noise_of(found, SimpleNamespace(on=lambda run: 0.0))
    assert told.lags_s[:3] == pytest.approx((15.0, 30.0, 60.0)) and told.samples == 400
