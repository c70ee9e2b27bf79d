"""The noise that a diagnosis starts from: of a static run or of the model, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.gap.model import TwinModel
from fogml.gap.noise import NoisePoints, StaticRun, prior_of, white_noise
from fogml.gap.settings import STANDARD
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel
from fogml.signals.whitening import Whitener
from fogml.twin.noise import NoiseConstants
from fogml.twin.twin_file import load_twin

NOISE = NoiseModel(0.02, 0.03, 0.05)
TWIN = load_twin("nominal")
MODEL = TwinModel(replace(TWIN, noise=NoiseConstants(N=NOISE.N, B=NOISE.B, K=NOISE.K)))


def static(count=4000, seed=1, noise=NOISE, **more) -> Run:
    time = 5.0 * np.arange(count)
    whitener = Whitener(noise, time, 5.0, noise.ladder(5.0, 30.0 * (time[-1] + 5.0)))
    coloured = whitener.colour(np.random.default_rng(seed).standard_normal((count, 1)))[:, 0]
    columns = {"T": np.full(count, 25.0)} | more
    return Run.from_columns("static", time=time, gyro=3.0 + coloured, **columns)


def test_a_static_run_tells_the_noise_whatever_was_expected():
    for factor in (0.3, 3.0):
        noise = NoiseModel(factor * NOISE.N, factor * NOISE.B, factor * NOISE.K)
        prior, source = prior_of(MODEL, static(noise=noise, seed=int(10 * factor)))
        assert "static" in source
        assert pytest.approx(noise.N, rel=0.05) == prior.centre.N
        assert 0.5 < prior.centre.B / noise.B < 2.0
        # A unit's noise differs from run to run by more than a static run's own error.
        assert min(prior.factor) >= STANDARD.noise.unit_factor


@pytest.mark.parametrize("step", [0.05, 1.0])
def test_a_static_run_in_steps_as_coarse_as_its_noise_tells_it_as_what_a_finer_output_does(step):
    """White noise of 0.5 deg/h a sample: most neighbours are alike in steps of 1 deg/h."""
    run = static()
    prior, _ = prior_of(MODEL, run.with_columns(gyro=step * np.round(run.gyro / step)))
    # Rounding adds white noise of a step over the root of 12, or hides some.
    added = np.hypot(NOISE.N, step / np.sqrt(12.0) * np.sqrt(5.0 / 3600.0))
    assert 0.8 * NOISE.N < prior.centre.N < 1.2 * added
    assert prior.centre.B < 3.0 * NOISE.B and prior.centre.K < 3.0 * NOISE.K


def test_spikes_and_the_noise_of_a_recorded_rate_are_no_noise_of_a_static_run():
    run = static()
    gyro = run.gyro.copy()
    gyro[[700, 2500]] += [400.0, -300.0]
    rate = 1e-4 * np.random.default_rng(4).standard_normal(len(run))
    spoilt = run.with_columns(gyro=gyro, rate=rate)
    (one, _), (other, _) = prior_of(MODEL, spoilt), prior_of(MODEL, run)
    assert pytest.approx(other.centre.N, rel=0.01) == one.centre.N
    told = [StaticRun.of(r, STANDARD.noise).log_likelihood(NOISE) for r in (spoilt, run)]
    assert told[0] == pytest.approx(told[1], abs=3.0)


@pytest.mark.parametrize(("rows", "steps"), [(75, 40), (1200, 0)])
def test_white_noise_of_a_run_is_as_large_as_it_is_however_much_may_be_made_of_it(rows, steps):
    """Steps at every other row take away half of the noise, and leave other rows more of theirs."""
    rng, place = np.random.default_rng(6), np.arange(rows)
    made = [(place[:, None] >= rows * (np.arange(steps) + 1.0) / (steps + 1.0)).astype(float)]
    constants = np.cos(np.pi * place[:, None] * np.arange(8) / rows)
    told = []
    for _ in range(100):
        run = SimpleNamespace(gap=0.5 * rng.standard_normal(rows), constants=constants, row_s=36.0)
        told.append(white_noise(run, 1e-9, made))
    assert np.mean([found for found, _ in told]) == pytest.approx(0.05, rel=0.05)
    scatter = np.std([found for found, _ in told]) / 0.05
    assert {count for _, count in told} == {rows - 2 - 7 - steps}
    assert scatter == pytest.approx(1.4 / np.sqrt(rows - 9 - steps), rel=0.25)
    # A constant that is another's multiple takes nothing more, though differences are rounded as values are.
    rate = 3e8 + 10.0 * constants[:, 1:2]
    run.constants = np.concatenate([constants, rate], axis=1)
    one = white_noise(run, 1e-9, made)
    run.constants = np.concatenate([constants, rate, 61.3 * rate], axis=1)
    assert white_noise(run, 1e-9, made) == (pytest.approx(one[0], rel=1e-6), one[1])
    # Where all may be made, none is told.
    assert white_noise(run, 1e-9, [np.eye(rows)]) == (1e-9, 0)


def test_without_a_static_run_the_prior_is_the_models():
    prior, _ = prior_of(MODEL, None)
    assert (prior.centre.N, prior.centre.B, prior.centre.K) == (NOISE.N, NOISE.B, NOISE.K)
    assert prior.factor == tuple(TWIN.noise_factor[name] for name in "NBK")


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


def test_a_static_run_is_taken_as_means_over_even_rows_from_its_first_sample_on() -> None:
    time = 500.0 + 2.0 * np.arange(500)
    gyro = np.random.default_rng(3).standard_normal(500)
    run = Run.from_columns(time=time, gyro=gyro, T=np.full(500, 25.0))
    found = StaticRun.of(run, replace(STANDARD.noise, static_rows=50))
    assert found.row_s == 20.0
    assert found.values == pytest.approx(gyro.reshape(50, 10).mean(axis=1))
    assert found.end_s == pytest.approx(500.0 + 20.0 * np.arange(1, 51))


def points(steps, likeliest, static=None) -> NoisePoints:
    """A grid whose likeliest point is one of its steps."""
    prior, source = prior_of(MODEL, None)
    noises = tuple(NoiseModel(NOISE.N, NOISE.B * 3.0**b, NOISE.K * 3.0**k) for b, k in steps)
    told = np.array([0.0 if step == likeliest else -5.0 for step in steps])
    return NoisePoints(noises, steps, (0.0,) * len(steps), prior, source, told, static)


GRID = tuple((b, k) for b in (-1.0, 0.0, 1.2) for k in (-1.0, 0.0, 2.0))


@pytest.mark.parametrize(
    ("likeliest", "wanted"),
    [
        ((1.2, 0.0), {(2.0, k) for k in (-1.0, 0.0, 2.0)}),
        ((0.0, 2.0), {(b, 2.8) for b in (-1.0, 0.0, 1.2)}),
        ((1.2, 2.0), {(2.0, k) for k in (-1.0, 0.0, 2.0, 2.8)} | {(b, 2.8) for b in (-1.0, 0.0, 1.2)}),
    ],
)
def test_a_grid_of_noises_goes_on_where_the_likeliest_is_at_its_upper_end(likeliest, wanted):
    held = points(GRID, likeliest)
    more = held.beyond((1.2, 2.0))
    assert set(more.steps) == wanted
    for (b, k), noise, log_prior in zip(more.steps, more.noises, more.log_priors):
        factors = MODEL.noise.factor_B**b, MODEL.noise.factor_K**k
        assert pytest.approx(factors) == (noise.B / NOISE.B, noise.K / NOISE.K)
        # A log-normal prior, of which a factor is a standard deviation.
        assert log_prior == pytest.approx(-0.5 * (b * b + k * k))
    both = held.and_more(more)
    assert len(both.noises) == len(both.steps) == len(both.log_posteriors) == len(GRID) + len(wanted)


def test_a_grid_of_noises_ends_within_and_where_a_static_run_says_how_far_it_goes():
    assert points(GRID, (0.0, 0.0)).beyond((1.2, 2.0)) is None
    assert points(GRID, (1.2, 2.0), StaticRun.of(static(), STANDARD.noise)).beyond((1.2, 2.0)) is None
    # Noise of which nothing is expected has no steps.
    assert points(((-1.0, -1.0),), (-1.0, -1.0)).beyond((1.2, 2.0)) is None
