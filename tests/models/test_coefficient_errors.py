"""Standard errors of coefficients under coloured noise: against the scatter of repeated fits."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.lab_uncertainty.signals import lagged
from fogml.models.joint import JointModel
from fogml.models.linear import LinearRegressor
from fogml.models.names import make_model
from fogml.models.row_noise import noise_covariance, stretches_of
from fogml.models.table import RunRows, TrainingTable
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.signals.random_noise import Flicker

N, STEP_S, REPEATS = 3000, 5.0, 30
TIME = STEP_S * np.arange(N)
TEMPERATURE = 20.0 + 30.0 * np.sin(2 * np.pi * TIME / 7000.0)
COLUMNS = np.column_stack((TEMPERATURE, TEMPERATURE**2, np.gradient(TEMPERATURE, TIME) * 60.0))
TRUE = np.array([0.5, 0.01, 1e-4, -0.2])


def fits(flicker: float, white: float, walk: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Errors of coefficients, and their standard errors for the noise's own spectrum and for white noise."""
    errors, stated, plain = [], [], []
    for seed in range(REPEATS):
        rng = np.random.default_rng(seed)
        noise = white * rng.normal(size=N) + walk * np.cumsum(
            np.random.default_rng(900 + seed).normal(size=N)
        )
        noise += Flicker(flicker, STEP_S, np.random.default_rng(500 + seed)).block(N)
        y = TRUE[0] + COLUMNS @ TRUE[1:] + noise
        model = LinearRegressor().fit(COLUMNS, y)
        rows = [RunRows(COLUMNS, y, TIME)]
        errors.append(np.append(model.intercept_, model.coef_) - TRUE)
        stated.append(np.sqrt(np.diag(noise_covariance(rows, lambda atoms: atoms, model))))
        plain.append(model.standard_errors())
    return np.array(errors), np.array(stated), np.array(plain)


@pytest.mark.parametrize(("flicker", "white", "walk"), [(0.0, 0.3, 0.0), (0.2, 0.3, 0.0), (0.05, 0.3, 0.005)])
def test_errors_scatter_as_stated(flicker: float, white: float, walk: float) -> None:
    errors, stated, plain = fits(flicker, white, walk)
    # The intercept also holds noise slower than the run.
    size = np.sqrt(np.mean((errors / stated)[:, 1:] ** 2, axis=0))
    assert np.all((size > 0.65) & (size < 1.4))
    if flicker + walk > 0.0:
        assert np.sqrt(np.mean((errors / plain)[:, 1] ** 2)) > 2.0
    else:
        ratio = np.median(stated / plain, axis=0)
        np.testing.assert_allclose(ratio[1:], 1.0, atol=0.12)
        # That no noise is slower than the run, a run cannot tell.
        assert 1.0 < ratio[0] < 2.0


def test_runs_stretches_and_a_ridge() -> None:
    rng = np.random.default_rng(1)
    y = TRUE[0] + COLUMNS @ TRUE[1:] + 0.3 * rng.normal(size=N)
    whole = LinearRegressor(ridge=1e-3).fit(COLUMNS, y)
    halves = [RunRows(COLUMNS[s], y[s], TIME[s]) for s in (slice(0, N // 2), slice(N // 2, N))]
    found = np.sqrt(np.diag(noise_covariance(halves, lambda atoms: atoms, whole)))
    np.testing.assert_allclose(found[1:], whole.standard_errors()[1:], rtol=0.3)
    assert whole.standard_errors()[0] < found[0] < 3.0 * whole.standard_errors()[0]
    through_zero = LinearRegressor(fit_intercept=False).fit(COLUMNS, y)
    covariance = noise_covariance(halves, lambda atoms: atoms, through_zero)
    assert covariance[0, 0] == 0.0 and np.all(np.diag(covariance)[1:] > 0.0)
    short = [RunRows(COLUMNS[:10], y[:10], TIME[:10])]
    assert noise_covariance(short, lambda atoms: atoms, whole) is None


@pytest.mark.parametrize("lost", [0.03, 0.15, 0.4])
def test_dropped_rows_hide_no_slow_noise(lost: float) -> None:
    """What rows lost at random leave is told as well as by all, or less so as there are fewer of them."""
    ratios = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        y = COLUMNS @ TRUE[1:] + 0.05 * np.cumsum(rng.normal(size=N)) + rng.normal(size=N)
        model = LinearRegressor().fit(COLUMNS, y)
        kept = rng.random(N) > lost
        whole, dropped = (
            np.sqrt(
                np.diag(noise_covariance([RunRows(COLUMNS[k], y[k], TIME[k])], lambda atoms: atoms, model))
            )
            for k in (slice(None), kept)
        )
        ratios.append(dropped / whole)
    assert np.all(np.abs(np.log(np.median(ratios, axis=0) * (1.0 - lost) ** 0.25)) < 0.2)


def test_many_gaps_hide_no_slow_noise() -> None:
    """Of every 20 rows 5 lack, as where windows fill anew: a walk within 15 rows is hardly seen."""
    ratios = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        y = COLUMNS @ TRUE[1:] + 0.02 * np.cumsum(rng.normal(size=N)) + rng.normal(size=N)
        model = LinearRegressor().fit(COLUMNS, y)
        whole, parted = (
            np.diag(noise_covariance([RunRows(COLUMNS[k], y[k], TIME[k])], lambda atoms: atoms, model))
            for k in (slice(None), np.arange(N) % 20 < 15)
        )
        ratios.append(np.sqrt(parted / whole))
    assert np.all(np.abs(np.log(np.median(ratios, axis=0))) < 0.2)


@pytest.mark.parametrize(("window", "most"), [("exp", 0.02), ("slope", 0.003)])
def test_windows_that_fill_anew_after_gaps_do_not_pull_at_coefficients(window: str, most: float) -> None:
    """Of rows every 4 s 40 % are lost: longer gaps than a quarter of a window come every few minutes."""
    time = 4.0 * np.arange(6000)
    chamber = 20.0 + np.interp(time % 7200.0, [0.0, 1200.0, 3600.0, 4800.0, 7200.0], [0, 20, 20, 0, 0])
    T = lagged(chamber, 4.0, 300.0)
    drift = 0.01 * T + 0.3 * 60.0 * np.gradient(T, time)
    kept = np.random.default_rng(0).random(len(time)) >= 0.4
    run = Run("lossy", {"time": time[kept], "gyro": drift[kept], "T": T[kept]})
    model = make_model("polynomial", f"T, dT[{window}, 64 s]").fit(run)
    assert abs(model.regressor_.coef_[1] / 0.3 - 1.0) < most
    assert "in which windows fill anew after gaps left out" in model.card_.notes[0]


def test_where_windows_never_fill_it_is_said_with_what_would_help() -> None:
    kept = (np.arange(N) % 40 < 16) & (TIME > 200.0)
    run = Run("parts", {"time": TIME[kept], "gyro": COLUMNS[kept, 2], "T": TEMPERATURE[kept]})
    notes = make_model("polynomial", "T, dT").fit(run).card_.notes
    assert "are in the fit" in notes[0] and "wider windows than 64 s" in notes[0]


def test_a_run_with_fewer_rows_has_lost_none() -> None:
    """Rows every 5 s and every 20 s: the latter have gaps, as nothing is known of what lies between."""
    slow = slice(None, None, 4)
    times = (TIME, TIME[slow])
    run = np.repeat([0, 1], [N, N // 4])
    table = TrainingTable(
        np.vstack((COLUMNS, COLUMNS[slow])), np.zeros(len(run)), run, np.concatenate(times), run
    )
    parts, step_s = stretches_of(table)
    assert step_s == STEP_S and parts[0] == slice(0, N) and len(parts) == 1 + N // 4


def turning_run(seed: int) -> tuple[Run, np.ndarray]:
    """A cycle with turns both ways at a scale factor that is exact, with slow noise; and the noise."""
    time = 10.0 * np.arange(1440)
    temperature = 20.0 + 30.0 * np.sin(2 * np.pi * time / 7000.0)
    rate = 5.0 * ((time % 1200.0 >= 300.0) & (time % 1200.0 < 480.0)).astype(float)
    rate -= 5.0 * ((time % 1200.0 >= 480.0) & (time % 1200.0 < 660.0))
    noise = 0.1 * np.random.default_rng(seed).normal(size=len(time))
    noise += Flicker(0.2, 10.0, np.random.default_rng(700 + seed)).block(len(time))
    gyro = 3600.0 * rate + 0.01 * temperature + noise
    facts = Facts(unit="u", axis="x")
    return Run("turns", {"time": time, "gyro": gyro, "rate": rate, "T": temperature}, facts), noise


def test_joint_scale_factor_and_bias_scatter_as_stated() -> None:
    z, plain = [], []
    for seed in range(8):
        run, noise = turning_run(seed)
        model, clean = JointModel().fit(run), JointModel().fit(run.with_columns(gyro=run.gyro - noise))
        table = model._columns(model._rows(run).atoms)
        white = LinearRegressor().fit(table, model._rows(run).y)
        errors = model.regressor_.coef_ - clean.regressor_.coef_
        z.append(errors / model.regressor_.standard_errors()[1:])
        plain.append(errors / white.standard_errors()[1:])
    size = np.sqrt(np.mean(np.square(z), axis=0))
    assert np.all((size > 0.5) & (size < 1.6))
    # The bias' slope over temperature feels slow noise, the scale factor that turns both ways does not.
    slope = model.column_names.index("T")
    assert np.sqrt(np.mean(np.square(plain), axis=0))[slope] > 1.8


def test_what_a_ridge_draws_to_zero_is_no_better_known() -> None:
    """Under a random walk folds choose a ridge; what it draws to 0 hardly scatters, and is off for it."""
    off = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        y = COLUMNS[:, :2] @ TRUE[1:3] + 0.01 * np.cumsum(rng.normal(size=N))
        run = Run("walk", {"time": TIME, "gyro": y, "T": TEMPERATURE})
        model = make_model("polynomial", "T, T^2", parameters={"ridge": 1.0}).fit(run)
        off.append((model.regressor_.coef_ - TRUE[1:3]) / model.regressor_.standard_errors()[1:])
    assert np.sqrt(np.mean(np.square(off))) < 1.5
