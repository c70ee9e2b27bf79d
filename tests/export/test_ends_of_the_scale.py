"""Exports of the best gyros and of the roughest: what is allowed, and steps of outputs, go with the model."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.export.c_program import CProgram
from fogml.export.c_source import c_source
from fogml.export.export import export_model
from fogml.export.fixed_scales import output_bits
from fogml.export.plan import Plan
from fogml.export.settings import DTYPES, ExportSettings, tolerance_of
from fogml.models.names import make_model
from fogml.runs.run import Run
from tests.export.conftest import turning_run
from tests.export.test_c_code import QUICK, outputs

needs_cc = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")


def cycle(size: float) -> Run:
    """A cycle whose drift and noise are so many times those of a gyro of 1 deg/h."""
    time = np.arange(0.0, 7200.0, 2.0)
    T = 20.0 - 40.0 * np.cos(2.0 * np.pi * time / 7200.0)
    drift = 0.02 * T + 2e-4 * T**2 + 0.2 * np.random.default_rng(1).normal(size=len(time))
    return Run(f"{size:g}", {"time": time, "gyro": size * drift, "T_in": T})


def fitted(size: float):
    return make_model("polynomial", features="T^1..2").fit(cycle(size))


@pytest.mark.parametrize("size", [1e-4, 1e4])
def test_what_is_allowed_goes_with_the_gyro(size):
    """A recording in another unit is the same recording."""
    one, other = fitted(1.0), fitted(size)
    for dtype in DTYPES:
        allowed = [tolerance_of(model, ExportSettings("c"), dtype) for model in (one, other)]
        assert allowed[1] == pytest.approx(size * allowed[0], rel=1e-6)


@needs_cc
def test_steps_too_coarse_for_a_gyro_are_refused(tmp_path):
    """Of a drift of 1e-3 deg/h outputs in steps of 2^-12 deg/h leave most."""
    with pytest.raises(InputError, match=r"up to 0\.0002"):
        export_model(fitted(1e-3), tmp_path, ExportSettings("c", "q31"))


def test_steps_are_a_quarter_of_what_is_allowed_between_their_ends():
    for tolerance in (0.001, 0.0017, 0.02, 0.06):
        assert tolerance / 8.0 < 2.0 ** -output_bits(tolerance) <= tolerance / 4.0
    assert [output_bits(tolerance) for tolerance in (0.0, 1e-9, 1e9)] == [12, 12, 6]


@needs_cc
def test_a_rough_gyro_turns_fast_in_whole_numbers(tmp_path):
    """What needs no fine steps holds 2000 deg/s, where 146 deg/s was the end."""
    model = fitted(1e3)
    told = export_model(model, tmp_path, ExportSettings("c", "q15"))["fixed_point"]
    most = 2.0**31 * told["compensated_unit_deg_h"] / 3600.0
    assert most > 2000.0 and told["gyro_unit"] == told["compensated_unit_deg_h"]
    bits = round(-np.log2(told["compensated_unit_deg_h"]))
    source = c_source(replace(Plan.of(model), output_bits=bits), "q15", [])
    turning = cycle(1e3)[:50]
    turning = turning.with_columns(gyro=turning.gyro + 3600.0 * np.linspace(-2000.0, 2000.0, 50))
    found, _ = outputs(CProgram(source, tmp_path, flags=QUICK), source, turning)
    allowed = tolerance_of(model, ExportSettings("c"), "q15")
    np.testing.assert_allclose(found, model.compensate(turning).compensated, atol=allowed)


@needs_cc
def test_a_rough_bias_is_no_scale_factor(tmp_path):
    """What rounding makes of 5000 deg/h, at rest as in a turn, was told in ppm of the turn, and refused."""
    run = turning_run()
    rough = run.with_columns(gyro=run.gyro + 1e4 * (run.gyro - 3600.0 * run.columns["rate"]))
    report = export_model(make_model("joint").fit(rough), tmp_path, ExportSettings("c", "q15"))
    assert 0.0 < 1e-6 * report["scale_difference_ppm"] * 36_000.0 < report["tolerance"]
