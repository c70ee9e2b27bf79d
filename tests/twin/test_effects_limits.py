"""Range, slew, counts and temperature sensitivity of the output against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.runs.facts import Facts, ScaleFactor
from fogml.runs.reading import read_run
from fogml.twin.effect import LoggerEffect, LoopEffect
from fogml.twin.inputs import Inputs
from fogml.twin.memory import Memory
from fogml.twin.noise import NoiseConstants
from fogml.twin.registry import effect
from fogml.twin.replay import replay
from fogml.twin.simulate import simulate, world_of, write_world
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin


def met(time: FloatArray) -> Inputs:
    return Inputs(time, {"T": np.full(len(time), 25.0)}, np.zeros(len(time)))


def loop(id: str) -> LoopEffect:
    found = effect(id)
    assert isinstance(found, LoopEffect)
    return found


@pytest.mark.parametrize("share", [1.0, 0.9])
def test_output_stays_at_the_end_of_its_range(share: float) -> None:
    rate = 3600.0 * np.linspace(-300.0, 300.0, 601)
    found = loop("rate_range").apply(rate, met(np.arange(601.0)), share, range=200.0)
    within = np.abs(rate) <= 720_000.0
    assert np.array_equal(found[within], rate[within])
    beyond = 720_000.0 + (1.0 - share) * (np.abs(rate[~within]) - 720_000.0)
    assert found[~within] == pytest.approx(np.sign(rate[~within]) * beyond)


@pytest.mark.parametrize("step_deg_s", [10.0, -40.0])
def test_a_step_beyond_the_slew_is_a_straight_flank_as_long_as_the_step(step_deg_s: float) -> None:
    time = 1e-4 * np.arange(2000.0)
    rate = np.where(time > 0.05, 3600.0 * step_deg_s, 0.0)
    found = loop("slew_limit").apply(rate, met(time), 1.0, slew=1000.0)
    wanted = 3600.0 * np.sign(step_deg_s) * np.clip(1000.0 * (time - 0.05), 0.0, abs(step_deg_s))
    assert found == pytest.approx(wanted, abs=1e-6 * 3600.0)
    # Slow changes pass, exactly.
    slow = 3600.0 * 900.0 * time
    assert np.array_equal(loop("slew_limit").apply(slow, met(time), 1.0, slew=1000.0), slow)


def test_counts_are_whole_and_lose_nothing_but_the_last_one() -> None:
    rng = np.random.default_rng(4)
    time = 0.5 * np.arange(4000.0)
    output = 40.0 + 5.0 * rng.standard_normal(4000)
    count = effect("output_counts")
    assert isinstance(count, LoggerEffect)
    memory, q = Memory(), 0.7
    pieces = [
        count.record(
            output[part],
            replace(met(time[part]), memory=memory),
            q,
        )
        for part in (slice(0, 1700), slice(1700, 1701), slice(1701, 4000))
    ]
    counts = np.concatenate(pieces) * 0.5 / q
    assert counts == pytest.approx(np.rint(counts), abs=1e-6)
    # One deg/h is one arcsec per second.
    angle = np.cumsum(output * 0.5 / q)
    left = angle - np.cumsum(np.rint(counts))
    assert left.min() >= -1e-6 and left.max() < 1.0 + 1e-6
    # What is left over is uniform: its variance is that of Q = q / sqrt(12).
    assert left.var() == pytest.approx(1.0 / 12.0, rel=0.1)


def test_a_run_in_counts_is_one_everywhere(tmp_path) -> None:
    twin = replace(load_twin("tactical"), settings={}).with_noise(Q=0.0).with_effect("output_counts", 0.2)
    steps = [{"soak at 25 degC for 5 min": ["turn at 5 deg/s for 60 s from minute 2"]}]
    made = simulate(steps, twin, sample_s=0.5, seed=3, truth=True)
    run = made.run
    assert run.gyro_unit == "count" and np.array_equal(run.gyro, np.rint(run.gyro))
    assert run.facts.scale_factor == ScaleFactor(value=2.5)
    true = made.truth.noise_free + made.truth.noise
    assert run.gyro_deg_h.mean() == pytest.approx(
        true.mean() - made.truth.contributions["output_counts"].mean(), abs=0.2 / (0.5 * len(run)) + 1e-6
    )
    write_world(world_of(steps, twin, 0.5, 3, None, None, truth=False), tmp_path / "run.csv")
    again = read_run(tmp_path / "run.csv")
    assert again.gyro_unit == "count" and np.array_equal(again.gyro, run.gyro)
    quiet = replace(twin, noise=NoiseConstants(), sensors=Twin().sensors)
    free = simulate(steps, quiet, sample_s=0.5).run
    assert np.abs(replay(quiet, free) - free.gyro_deg_h).max() <= 0.4 + 1e-9  # one count
    with pytest.raises(InputError, match=r"scale_factor.*output_counts"):
        simulate(steps, twin, facts=Facts(scale_factor=ScaleFactor(value=1.0)))


def test_temperature_sensitivity_is_that_of_the_coils_mean_and_in_soaks_the_nominal_one() -> None:
    inner, outer = np.linspace(-40.0, 60.0, 101), np.linspace(-38.0, 62.0, 101)
    count = len(inner)
    given = Inputs(np.arange(101.0), {"T_in": inner, "T_out": outer}, np.full(count, 2.0))
    u = 0.5 * (inner + outer) - 25.0
    found = effect("sf_temperature").response(given, curvature=1e-3)
    assert found == pytest.approx(1e-6 * 7200.0 * (u + 1e-3 * u * u))
    bare = replace(load_twin("nominal"), settings={}, noise=NoiseConstants(), sensors=Twin().sensors)
    steps = [{"soak at 60 degC for 5 h": ["turn at 10 deg/s for 60 s from minute 290"]}]
    outputs = [
        simulate(steps, twin, sample_s=10.0).run.gyro[-10:]
        for twin in (
            bare.with_nominal(k1=30.0, k2=0.06),
            bare.with_nominal(k1=0.0, k2=0.0).with_effect("sf_temperature", 30.0, curvature=2e-3),
        )
    ]
    assert outputs[0] == pytest.approx(outputs[1], abs=1e-4)
