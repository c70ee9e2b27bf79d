from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.signals.noise_model import NoiseModel, flicker_ladder
from fogml.signals.noise_terms import FLICKER_FLOOR


def means_density(model: NoiseModel, frequency: np.ndarray, ladder) -> np.ndarray:
    """One-sided density of means over 1 s, aliases summed."""
    aliased = np.abs(frequency[:, None] + np.arange(-400, 401))
    white = 2.0 * model.fast_density(ladder)
    slow = (model.density(aliased.ravel(), ladder).reshape(aliased.shape) - white) * np.sinc(aliased) ** 2
    return slow.sum(axis=1) + white


@pytest.mark.parametrize("white", [1e-6, 1e-3, 1e-2])
@pytest.mark.parametrize("length", [3600, 36_000, 1_000_000])
def test_density_of_samples_is_that_of_the_power_laws_from_run_length_to_sample(white, length):
    model = NoiseModel(N=white, B=1.0)
    ladder = model.ladder(1.0, length)
    frequency = np.geomspace(1 / length, 0.5, 150)
    aliased = np.abs(frequency[:, None] + np.arange(-4000, 4001))
    flicker = np.sum(np.sinc(aliased) ** 2 / (np.pi * aliased), axis=1)
    ratio = means_density(model, frequency, ladder) / (flicker + 2 * model.white_density)
    assert np.all(np.abs(ratio - 1) < 0.05)


def test_white_noise_hides_the_fast_states():
    bare = NoiseModel(N=1e-6, B=0.01).ladder(1.0, 36_000.0)
    hidden = NoiseModel(N=3e-3, B=0.003).ladder(1.0, 36_000.0)
    assert len(hidden.time_constants_s) <= len(bare.time_constants_s) - 2


def test_allan_variance_of_the_states_is_that_of_the_power_laws():
    model = NoiseModel(N=0.002, B=0.05, K=0.03, Q=1e-6)
    ladder = flicker_ladder(1.0, 1e5)
    for tau in (1.0, 30.0, 1000.0):
        # Two neighbouring means: half the mean square of their difference.
        c = model.covariance(np.array([tau, 2 * tau]), tau, ladder)
        got = 0.5 * (c[0, 0] + c[1, 1]) - c[0, 1]
        assert got == pytest.approx(float(model.allan_variance(tau)), rel=0.03)
    flicker = NoiseModel(N=1e-9, B=1.0).allan_variance(100.0)
    assert float(flicker) == pytest.approx(FLICKER_FLOOR**2, rel=1e-6)


def test_covariance_is_the_integral_over_the_windows():
    model, ladder = NoiseModel(N=0.01, B=0.2, K=0.6), flicker_ladder(2.0, 300.0)
    time = np.array([2.0, 4.0, 9.0, 30.0])
    c = model.covariance(time, 2.0, ladder)
    grid = (np.arange(400) + 0.5) / 400 * 2.0
    for i in range(4):
        for k in range(i):
            s, t = time[k] - 2.0 + grid[:, None], time[i] - 2.0 + grid[None, :]
            flicker = sum(np.exp(-np.abs(s - t) / tau) for tau in ladder.time_constants_s)
            kernel = model.state_variance(ladder) * flicker + model.walk_rate * np.minimum(s, t)
            assert c[i, k] == pytest.approx(kernel.mean(), rel=1e-4)
    assert np.all(np.diag(c) == pytest.approx(model.variances(time, 2.0, ladder)))


@pytest.mark.parametrize("bad", [{"N": 0.0}, {"N": -1.0}, {"N": 1.0, "B": np.nan}, {"N": 1.0, "K": np.inf}])
def test_coefficients_that_mean_nothing_are_refused(bad):
    with pytest.raises(InputError, match="noise model"):
        NoiseModel(**bad)
