"""The largest difference that an export states holds of what units meet: other readings, runs and clocks."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fogml.export.c_program import CProgram
from fogml.export.c_source import c_source
from fogml.export.check import c_difference, pipeline_difference
from fogml.export.plan import Plan
from fogml.models.names import make_model
from fogml.runs.run import Run
from tests.export.test_c_code import QUICK, outputs

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")


def start(step_s: float, shown: float = 0.0) -> Run:
    """A cold start, of one rate at each temperature, by a thermometer that shows steps of so many degC."""
    time = np.arange(0.0, 1800.0, step_s)
    T = 30.0 - 15.0 * np.exp(-time / 400.0)
    noise = np.random.default_rng(3).normal(0.0, 0.1, len(time))
    drift = 80.0 + 3.0 * T - 0.04 * T**2 - 0.01 * T**3
    return Run(
        "start.csv",
        {"time": time, "gyro": drift + noise, "T_in": np.round(T / shown) * shown if shown else T},
    )


def found(plan: Plan, dtype: str, folder: Path, run: Run, model) -> float:
    source = c_source(plan, dtype, [])
    expected = model.compensate(run)
    out, flag = outputs(CProgram(source, folder, flags=QUICK), source, run)
    return float(np.abs(out - expected.compensated)[(flag == 0) & (expected.flag == 0)].max())


def test_whole_steps_of_readings_are_in_it(tmp_path):
    """Half a step of 2^-8 degC on a slope of 20 deg/h/degC is 0.04 deg/h."""
    model = make_model("polynomial", features="T_in^1..3").fit(start(2.0))
    plan = Plan.of(model)
    source = c_source(plan, "q15", [])
    stated = c_difference(plan, source, CProgram(source, tmp_path, flags=QUICK), 0).inside
    T = np.linspace(15.1, 29.9, 20_000)
    run = Run("slow", {"time": np.arange(float(len(T))), "gyro": 0.0 * T, "T_in": T})
    assert 0.9 * stated < found(plan, "q15", tmp_path, run, model) < 1.01 * stated


def test_rounding_of_outputs_adds_to_that_of_readings(tmp_path):
    """Half a step of 2^-8 degC on that slope, and half a step of 1/32 deg/h both taken and given."""
    model = make_model("polynomial", features="T_in^1..3").fit(start(2.0))
    plan = replace(Plan.of(model), output_bits=5)
    source = c_source(plan, "q15", [])
    stated = c_difference(plan, source, CProgram(source, tmp_path, flags=QUICK), 0).inside
    T = np.linspace(15.1, 29.9, 200_000)
    gyro = np.random.default_rng(5).uniform(-20.0, 20.0, len(T))
    run = Run("slow", {"time": np.arange(float(len(T))), "gyro": gyro, "T_in": T})
    assert 0.95 * stated < found(plan, "q15", tmp_path, run, model) < 1.01 * stated


def test_windows_of_a_start_are_compared_where_its_slices_leave_no_history(tmp_path):
    model = make_model("polynomial", features="T_in, dT_in").fit(start(0.1))
    plan = Plan.of(model)
    source = c_source(plan, "float64", [])
    assert source.layout.binned and plan.limits.slices is not None
    free = replace(plan, limits=replace(plan.limits, slices=None))
    program = CProgram(source, tmp_path, flags=QUICK)
    told = [c_difference(one, source, program, 0) for one in (plan, free)]
    assert told[0].good < 0.5 * told[1].good
    assert told[0].inside == told[1].inside and told[0].outside == told[1].outside


def test_a_recorded_runs_own_thermometer_is_in_it(tmp_path):
    run = start(0.1, 0.5)
    model = make_model("polynomial", features="T_in, dT_in").fit(run)
    plan = Plan.of(model)
    source = c_source(plan, "float64", [])
    program = CProgram(source, tmp_path, flags=QUICK)
    alone, beside = (c_difference(plan, source, program, 0, runs).inside for runs in ((), (run,)))
    assert alone < 0.9 * found(plan, "float64", tmp_path, run, model) < beside


def test_a_graph_from_windows_is_compared_where_slices_leave_no_history(tmp_path):
    plan = Plan.of(make_model("polynomial", features="T_in, dT_in").fit(start(2.0)))
    free = replace(plan, limits=replace(plan.limits, slices=None))

    def nothing(windows, gyro):
        return 0.0 * gyro

    told = [pipeline_difference(one, nothing, 65, 0) for one in (plan, free)]
    assert told[0] == told[1] and told[0].good > 100
