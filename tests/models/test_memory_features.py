"""Drift models of features that remember: what they close, compensation in blocks, flags, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.models.compensation import compensate_blocks
from fogml.models.names import make_model
from fogml.models.saved import load_model, save_model
from fogml.runs.facts import Facts
from fogml.runs.run import Run


def made_run(seed: int, rate_deg_min: float, *, powered_on: float = 0.0) -> Run:
    """Hysteresis, a slow node, warm-up and light power in the truth; white noise of 0.02 deg/h."""
    rng = np.random.default_rng(seed)
    leg = np.arange(0.0, 100.0 / rate_deg_min * 60.0, 10.0) / 60.0 * rate_deg_min
    T = np.concatenate([np.full(180, -30.0), -30.0 + leg, np.full(180, 70.0), 70.0 - leg])
    time = 10.0 * np.arange(len(T))
    play, node = np.empty(len(T)), np.empty(len(T))
    s = h = T[0]
    for i, t in enumerate(T):
        s = min(max(s, t - 6.0), t + 6.0)
        h += (t - h) * (1.0 - np.exp(-10.0 / 1200.0))
        play[i], node[i] = s, h
    light = 300.0 + 20.0 * np.sin(time / 2000.0 + seed)
    truth = 0.03 * T + 0.05 * play + 0.02 * node + 0.8 * np.exp(-(time - powered_on) / 900.0) + 0.01 * light
    columns = {"time": time, "gyro": truth + rng.normal(0.0, 0.02, len(T)), "T": T, "light": light}
    return Run(f"run-{seed}", columns, Facts(unit="U", axis="x", powered_on=powered_on))


FEATURES = "T, play(T, 6 degC), lag(T, 1200 s), since_on(900 s), light"


def test_what_the_truth_remembers_is_closed_on_another_run() -> None:
    model = make_model("polynomial", features=FEATURES).fit(made_run(1, 1.0))
    test = made_run(2, 0.7)
    left = test.gyro - model.predict(test)
    without = make_model("polynomial", features="T^1..3, dT, T*dT").fit(made_run(1, 1.0))
    assert left.std() < 1.05 * 0.02
    assert (test.gyro - without.predict(test)).std() > 5.0 * left.std()
    found = dict(zip(model.feature_names, model.regressor_.coef_))
    assert found["play(T, 6 degC)"] == pytest.approx(0.05, abs=2e-3)
    assert found["light"] == pytest.approx(0.01, rel=0.02)


def test_blocks_saved_models_and_the_whole_agree(tmp_path) -> None:  # type: ignore[no-untyped-def]
    model = make_model("polynomial", features=FEATURES).fit(made_run(1, 1.0))
    save_model(model, tmp_path / "model")
    again, test = load_model(tmp_path / "model"), made_run(3, 2.0)
    whole = model.compensate(test)
    blocks = list(compensate_blocks(again, [test[:37], test[37:38], test[38:500], test[500:]]))
    np.testing.assert_allclose(
        np.concatenate([part.compensated for _, part in blocks]), whole.compensated, rtol=0, atol=1e-9
    )
    np.testing.assert_array_equal(np.concatenate([part.flag for _, part in blocks]), whole.flag)


def test_samples_are_flagged_until_the_memories_have_settled() -> None:
    model = make_model("polynomial", features="T, lag(T, 1200 s), play(T, 6 degC)").fit(made_run(1, 1.0))
    test = made_run(1, 1.0)
    flag = model.compensate(test).flag
    moved = np.abs(test.columns["T"] - test.columns["T"][0]) >= 12.0
    settled = (test.time >= 3600.0 - 10.1) & (np.maximum.accumulate(moved))
    np.testing.assert_array_equal(flag == 2, ~settled)


def test_a_test_run_that_lacks_a_column_is_refused_with_the_place() -> None:
    model = make_model("polynomial", features="T, light").fit(made_run(1, 1.0))
    test = made_run(2, 1.0)
    bare = Run("b.csv", {name: test.columns[name] for name in ("time", "gyro", "T")}, test.facts)
    with pytest.raises(InputError, match=r"b.csv: no column 'light'[\s\S]*\^"):
        model.compensate(bare)


@pytest.mark.parametrize(
    ("features", "told"),
    [
        ("T, lag(T, 100 h)", r"360000 s, but the longest training run is[\s\S]*\n     \^"),
        ("T, lag(T, 2 s)", r"samples are 10 s apart[\s\S]*\n     \^\nstate at least 10 s"),
        ("T, play(T, 60 degC)", r"spans 100 in the training runs[\s\S]*\n     \^\nstate at most 50"),
        ("T, heat", r"no column 'heat'[\s\S]*\n     \^"),
    ],
)
def test_memories_that_the_runs_cannot_tell_are_refused_with_the_place(features: str, told: str) -> None:
    for name in ("polynomial", "mixed-effects", "auto"):
        with pytest.raises(InputError, match=told):
            make_model(name, features=features).fit(made_run(1, 1.0))


@pytest.mark.parametrize(
    ("T", "told"),
    [
        (np.full(240, 25.0), "one temperature only, 25 degC"),
        (25.0 + np.round(np.sin(np.arange(240) / 38.0)) * 0.5, "2 steps of its sensor"),
        (25.0 + np.sin(np.arange(240) / 38.0), "under 5 degC"),
    ],
)
def test_a_temperature_that_hardly_moves_is_said_first(T: np.ndarray, told: str) -> None:
    noise = np.random.default_rng(0).normal(0.0, 0.1, len(T))
    run = Run("still", {"time": 60.0 * np.arange(len(T)), "gyro": 1.0 + noise, "T": T})
    model = make_model("auto").fit(run)
    assert told in model.card_.notes[0] and "record" in model.card_.notes[0]
    assert model.intervals_.half_width(0.9) > 0.0
