from __future__ import annotations

import numpy as np
import pytest

from fogml.runs.noise_series import hold_of


@pytest.mark.parametrize("samples", [2, 4, 10])
def test_values_repeated_a_whole_number_of_times(samples: int):
    rng = np.random.default_rng(1)
    new = rng.normal(size=2000)
    found = hold_of(np.repeat(new, samples)[1:])
    assert found.samples == samples
    np.testing.assert_array_equal(np.repeat(new, samples)[1:][found.rows], new[1:])


def test_equal_neighbours_are_values_too():
    rng = np.random.default_rng(2)
    new = np.round(rng.normal(size=4000))
    found = hold_of(np.repeat(new, 4))
    assert found.samples == 4
    assert len(found.rows) == pytest.approx(len(new), abs=3)


def test_a_hold_of_two_and_a_half_samples():
    new = np.random.default_rng(3).normal(size=2000)
    found = hold_of(new[(np.arange(5000) / 2.5).astype(int)])
    assert found.samples == pytest.approx(2.5, rel=1e-3)


@pytest.mark.parametrize("step", [0.0, 0.5, 2.0, 5.0])
def test_a_coarse_converter_is_no_hold(step: float):
    noise = np.random.default_rng(4).normal(size=20_000)
    values = noise if step == 0.0 else step * np.round(noise / step)
    found = hold_of(values)
    assert found.samples == 1.0 and len(found.rows) == len(values)


def test_constant_and_short_series():
    assert hold_of(np.ones(100)).samples == 1.0
    assert hold_of(np.arange(5.0)).samples == 1.0
