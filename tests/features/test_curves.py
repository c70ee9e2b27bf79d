"""Waves and transitions over a temperature: what they say, in whole recordings, in streams and in C."""

from __future__ import annotations

import re

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.export.c_program import CProgram
from fogml.export.c_source import c_source
from fogml.export.plan import Plan
from fogml.features.operators import CURVES, sine_of_turns
from fogml.features.own import Recursion, RecursionOperator
from fogml.features.parse import parse_features
from fogml.models.names import make_model
from fogml.runs.run import Run
from fogml.testing import check_feature
from tests.export.conftest import training_run
from tests.export.test_c_code import QUICK, disturbed, needs_cc, outputs

TEXT = (
    "T_in, T_in-T_out, sine(T_in, 7 degC), cosine(T_in, 7 degC), late_sine(T_in, 9 degC, 300 s), "
    "late_cosine(T_in, 9 degC, 300 s), transition(T_in, 30 degC, 4 degC)"
)


def test_a_sine_of_turns_is_numpys() -> None:
    u = np.linspace(-383.0, 383.0, 40001)
    np.testing.assert_allclose(sine_of_turns(u), np.sin(2.0 * np.pi * u), atol=2e-11, rtol=0.0)


def test_curves_are_those_of_their_words() -> None:
    time = np.arange(0.0, 4000.0, 10.0)
    T = 25.0 + 30.0 * np.sin(time / 900.0)
    run = Run("r", {"time": time, "gyro": 0.0 * time, "T": T})
    text = "sine(T, 8 degC), cosine(T, 8 degC), transition(T, 40 degC, 5 degC), late_cosine(T, 8 degC, 600 s)"
    found = parse_features(f"{text}, lag(T, 600 s)").transform(run)
    angle = 2.0 * np.pi * T / 8.0
    late = 2.0 * np.pi * found[:, 4] / 8.0
    expected = np.column_stack([np.sin(angle), np.cos(angle), np.tanh((T - 40.0) / 5.0), np.cos(late)])
    np.testing.assert_allclose(found[:, :4], expected, atol=1e-9)


def test_they_keep_the_contract_of_features() -> None:
    check_feature("T, sine(T, 8 degC)*d(T), late_sine(T, 8 degC, 300 s), transition(T, 20 degC, 5 degC)^2")


@pytest.mark.parametrize("declared", [c for c in CURVES if isinstance(c, Recursion)], ids=lambda c: c.name)
def test_the_quicker_way_is_the_declaration(declared: Recursion) -> None:
    run = disturbed(5, jitter=0.3)
    x, given = run.columns["T_in"], (6.0, 300.0)
    quick, settled = declared.operator(given, 2.0).push(run.time, x)
    found, told = RecursionOperator(declared, given, 2.0).push(run.time, x)
    np.testing.assert_allclose(found, quick, atol=1e-9)
    np.testing.assert_array_equal(told, settled)


@needs_cc
@pytest.mark.parametrize(("dtype", "bound"), [("float64", 2e-6), ("q31", 2e-3)])
def test_their_c_gives_what_compensate_gives(tmp_path, dtype: str, bound: float) -> None:
    model = make_model("polynomial", features=TEXT).fit(training_run())
    source = c_source(Plan.of(model), dtype, [])
    run = disturbed(5, jitter=0.3)
    out, _ = outputs(CProgram(source, tmp_path, flags=QUICK), source, run)
    np.testing.assert_allclose(out, model.compensate(run).compensated, atol=bound)


@pytest.mark.parametrize(
    "text",
    [
        "sine(T, 0 degC)",
        "transition(T, 40 degC, 0 degC)",
        "late_sine(T, 0 degC, 30 s)",
        "sine(T, 1e-320 degC)",
    ],
)
def test_numbers_that_make_none_are_told(text: str) -> None:
    time = np.arange(100.0)
    run = Run("r", {"time": time, "gyro": time, "T": 20.0 + time})
    with pytest.raises(InputError, match=f"r: {re.escape(text)} .*state other numbers"):
        make_model("polynomial", f"T, {text}").fit(run)
