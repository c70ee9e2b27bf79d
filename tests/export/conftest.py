"""Fitted models of every form, once for all tests here."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from experiments.synthetic_world import World, cycle
from fogml.models.base import DriftModel
from fogml.models.feature_model import FeatureModel
from fogml.models.names import make_model
from fogml.models.rbf import RBFRegressor
from fogml.runs.facts import Facts
from fogml.runs.run import Run

RICH = (
    "T_in, dT_out[slope, 60 s], d(T_in-T_out)[exp, 120 s], diff(T_in)[slope, 40 s], "
    "sign(dT_in[block, 32 s]), T_in^2*dT_out[slope, 60 s], 0.5*T_in+0.5*T_out, diff(T_out)[exp, 50 s], "
    "diff(T_in-T_out), dT_in[first]"
)
MEMORY = (
    "T_in, play(T_in, 6 degC), lag(T_in-T_out, 300 s), lag(T_out, 900 s), T_in*play(T_out, 15 degC), "
    "dT_in[exp, 40 s], beyond(T_in, -10 degC, 40 degC)"
)
NAMES = ("none", "mean", "polynomial", "M2", "rich", "memory", "rbf", "rbf-patent", "joint", "joint-patent")


@cache
def training_run() -> Run:
    """Ramps at three rates, so that the network sees the rate."""
    rates = [cycle(rate, 2.0)[::2] for rate in (0.7, 1.4, 2.8)]
    run, _ = World(noise=0.05, ripple=(0.1, 40.0)).run(np.concatenate(rates), 2.0, 1, "train.csv")
    return run


@cache
def turning_run() -> Run:
    """A run with turns of 10 deg/s both ways."""
    time = np.arange(0.0, 3.0 * 3600.0, 2.0)
    inner = 25.0 + 45.0 * np.sin(2 * np.pi * time / 2900.0)
    outer = inner - 2.0 * np.sin(2 * np.pi * time / 1700.0)
    rate = np.zeros(len(time))
    for start in range(0, len(time) - 200, 500):
        rate[start + 50 : start + 80], rate[start + 80 : start + 110] = 10.0, -10.0
    scale = 1.0 + 1e-4 - 2e-6 * (inner - 25.0) + 1e-8 * inner**2
    noise = 0.1 * np.random.default_rng(3).standard_normal(len(time))
    gyro = 3600.0 * rate * scale + 0.5 + 0.01 * inner + noise
    facts = Facts(unit="FOG-1", axis="x")
    return Run.from_columns("turns", facts, time=time, gyro=gyro, T_in=inner, T_out=outer, rate=rate)


@cache
def fitted(name: str) -> DriftModel:
    """A fitted model by a short name."""
    if name in ("rich", "memory"):
        features = RICH if name == "rich" else MEMORY
        return make_model("polynomial", features=features).fit(training_run())
    if name == "rbf":
        regressor = RBFRegressor(centres=12, tune=False, average_rows=500)
        return FeatureModel("T, dT, T*dT", regressor, kind="rbf").fit(training_run())
    if name == "rbf-patent":
        return make_model(name, features="T, dT, T*dT").fit(training_run())
    if name.startswith("joint"):
        return make_model(name).fit(turning_run())
    return make_model(name).fit(training_run())


@pytest.fixture(scope="session")
def model_of():
    """A fitted model by a short name."""
    return fitted


@pytest.fixture(scope="session")
def axes():
    """Models of three axes, cubics with a rate."""
    time = np.arange(0.0, 7200.0, 4.0)
    temperature = 20.0 - 30.0 * np.cos(2.0 * np.pi * time / 7200.0)
    found = {}
    for i, axis in enumerate("xyz"):
        drift = 2.0 + 0.05 * temperature + (i - 1) * 1e-3 * temperature**2 - 1e-5 * temperature**3
        gyro = drift + 0.01 * np.random.default_rng(i).normal(size=len(time))
        run = Run.from_columns(axis, Facts(unit="FOG-7", axis=axis), time=time, gyro=gyro, T=temperature)
        found[axis] = make_model("polynomial", features="T^1..3, dT").fit(run), run
    return found
