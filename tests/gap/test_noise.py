"""The noise that a diagnosis judges by: of a static run, of the runs themselves, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.gap.dictionary import unknown_groups
from fogml.gap.noise import UNIT_FACTOR, noise_of, prior_of
from fogml.gap.observation import observe
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel
from fogml.signals.whitening import Whitener
from tests.gap.small_model import NOISE, SmallModel, ramps, recorded

MODEL = SmallModel()


def coloured(time, step, seed, noise=NOISE):
    ladder = noise.ladder(step, 30.0 * (time[-1] - time[0] + step))
    whitener = Whitener(noise, time, step, ladder)
    return whitener.colour(np.random.default_rng(seed).standard_normal((len(time), 1)))[:, 0]


def static(count=4000, seed=1, noise=NOISE, **more) -> Run:
    time = 5.0 * np.arange(count)
    columns = {"T": np.full(count, 25.0)} | more
    return Run.from_columns("static", time=time, gyro=3.0 + coloured(time, 5.0, seed, noise), **columns)


def test_a_static_run_tells_the_noise_whatever_was_expected():
    for factor in (0.3, 3.0):
        noise = NoiseModel(factor * NOISE.N, factor * NOISE.B, factor * NOISE.K)
        prior, source = prior_of(MODEL, static(noise=noise, seed=int(10 * factor)))
        assert "static" in source
        assert pytest.approx(noise.N, rel=0.05) == prior.centre.N
        assert 0.5 < prior.centre.B / noise.B < 2.0
        # A unit's noise differs from run to run by more than a static run's own error.
        assert min(prior.factor) >= UNIT_FACTOR


def test_without_a_static_run_the_prior_is_the_models():
    prior, _ = prior_of(MODEL, None)
    assert (prior.centre.N, prior.centre.B, prior.centre.K) == (NOISE.N, NOISE.B, NOISE.K)
    assert prior.factor == (3.0, 3.0, 3.0)


def test_drift_with_temperature_is_no_noise_of_a_static_run():
    count = 4000
    T = 25.0 + 0.5 * np.sin(np.arange(count) / 500.0)
    run = static(count)
    run = run.with_columns(T=T, gyro=run.gyro + 2.0 * (T - 25.0))
    with_drift, _ = prior_of(MODEL, run)
    without, _ = prior_of(MODEL, static(count))
    assert with_drift.centre.K < 2.0 * without.centre.K + 0.05


@pytest.mark.parametrize(
    ("run", "message"),
    [
        (static(200, rate=np.full(200, 5.0)), "the table turns in it"),
        (static(40), "40 samples; a noise run needs at least 64"),
    ],
)
def test_what_is_no_noise_run_is_refused(run, message):
    with pytest.raises(InputError, match=message):
        prior_of(MODEL, run)


def test_what_moves_with_temperature_is_kept_out_of_the_runs_noise():
    found = []
    for wave in (0.0, 2.0):
        runs = []
        for name, turns, seed in (("a", 2, 3), ("b", 3, 4)):
            run = ramps(name, count=1500, step=5.0, turns=turns)
            bend = wave * np.tanh((run.temperature() - 18.0) / 6.0)
            noise = coloured(run.time, 5.0, seed) + bend
            runs.append(observe(recorded(run, MODEL, {"offset": 1.0}, noise=noise), MODEL))
        prior, source = prior_of(MODEL, None)
        noise = noise_of(runs, MODEL.constants, unknown_groups(runs), prior, source)
        assert pytest.approx(NOISE.N, rel=0.05) == noise.model.N
        assert (noise.fit.standard_errors > 0.0).all()
        found.append(noise.model)
    flat, bent = found
    assert bent.B < 1.5 * flat.B and bent.K < 2.0 * flat.K
