"""The block for the firmware file: whoever computes from it alone gets what the model says."""

from __future__ import annotations

import re

import numpy as np
import pytest

from fogml.export.documentation import documentation, documentation_or_none
from fogml.export.number_files import EDGE
from fogml.export.plan import Plan
from fogml.models.names import make_model
from fogml.models.saved import load_model, model_hash, save_model
from fogml.runs.facts import Facts
from fogml.runs.run import Run


def coefficients(text):
    """Number and unit by name, and the feature that each is of."""
    block = text.split("coefficients\n")[1].split("\n\n")[0]
    return [re.split(r" {2,}", line.strip()) for line in block.splitlines()]


@pytest.fixture(scope="module")
def cubic():
    time = np.arange(0.0, 7200.0, 4.0)
    temperature = 20.0 - 30.0 * np.cos(2.0 * np.pi * time / 7200.0)
    gyro = 2.0 + 0.05 * temperature + 1e-3 * temperature**2 + np.random.default_rng(0).normal(size=len(time))
    run = Run.from_columns("a", Facts(unit="FOG-7", axis="y"), time=time, gyro=gyro, T=temperature)
    return make_model("polynomial", features="T, T^2, dT, T*dT").fit(run)


def test_numbers_read_back_are_the_models(cubic, tmp_path):
    text = documentation(cubic)
    rows = coefficients(text)
    held = {row[3] if len(row) > 3 else row[0]: float(row[1]) for row in rows}
    level = 35.5
    rest = Run.from_columns("b", Facts(), time=np.arange(400.0), gyro=np.zeros(400), T=np.full(400, level))
    by_hand = held["constant"] + held["T"] * level + held["T^2"] * level**2
    assert by_hand == pytest.approx(float(cubic.predict(rest)[-1]), rel=1e-12)
    units = {row[3] if len(row) > 3 else row[0]: row[2] for row in rows}
    assert units == {
        "constant": "deg/h", "T": "deg/h/degC", "T^2": "deg/h/degC^2", "dT": "deg/h/(degC/min)",
        "T*dT": "deg/h/(degC degC/min)",
    }  # fmt: skip
    save_model(cubic, tmp_path / "m")
    assert model_hash(load_model(tmp_path / "m")) == model_hash(cubic)
    assert f"SHA-256 {model_hash(cubic)}" in text and f"SHA-256 {cubic.card_.runs[0].sha256}" in text


def test_vectors_follow_from_the_formula(cubic):
    text = documentation(cubic)
    held = {row[3] if len(row) > 3 else row[0]: float(row[1]) for row in coefficients(text)}
    vectors = re.findall(r"  T = (\S+), dT = (\S+): drift = (\S+) deg/h", text)
    assert len(vectors) == 3
    for t, rate, drift in (map(float, vector) for vector in vectors):
        value = (
            held["constant"]
            + held["T"] * t
            + held["T^2"] * t**2
            + held["dT"] * rate
            + held["T*dT"] * t * rate
        )
        assert value == pytest.approx(drift, rel=1e-9)


@pytest.mark.parametrize("name", ["none", "mean", "rich", "memory", "rbf", "joint"])
def test_every_form_has_one(model_of, name):
    text = documentation(model_of(name))
    assert text.isascii() and max(map(len, text.splitlines())) < 1200
    for word in ("formula", "coefficients", "inputs, in this order", "flags", "test vectors", "SHA-256"):
        assert word in text


def test_what_has_no_compact_form_has_none(model_of):
    temperature = np.linspace(0.0, 30.0, 900)
    columns = {"time": np.arange(900.0), "gyro": np.sin(temperature), "T": temperature}
    run = Run.from_columns("a", Facts(), **columns)
    tree = make_model("sklearn.tree.DecisionTreeRegressor", features="T", parameters={"max_depth": 2}).fit(
        run
    )
    assert documentation_or_none(tree) is None


def test_a_networks_edge_stands_with_its_coefficients(model_of):
    plan, text = Plan.of(model_of("rbf")), documentation(model_of("rbf"))
    rows = {row[0]: row for row in coefficients(text)}
    assert EDGE in text and EDGE not in documentation(model_of("polynomial"))
    for r, column in enumerate(plan.edge_columns):
        for end in (0, 1):
            assert float(rows[f"edge[{end}][{r}]"][1]) == plan.edge[end, r]
            assert rows[f"edge[{end}][{r}]"][3] == plan.names[column]
