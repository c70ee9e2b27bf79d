"""Temperature sensitivity and hysteresis from soaks, by hand and on a run with a known law."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from fogml.runs.regimes import regimes
from fogml.runs.run import Run
from fogml.validation.soaks import Soak, find_soaks, hysteresis, temperature_sensitivity

NO_ROWS = np.empty(0, dtype=np.intp)


def soaks(*pairs):
    return [Soak(NO_ROWS, temperature, approach) for temperature, approach in pairs]


def stepped_run(levels, ramp_deg_min: float = 1.0, soak_s: int = 7200) -> Run:
    """Soaks at temperature levels with ramps between, 1 sample in 5 s, no noise."""
    pieces = [np.full(soak_s, float(levels[0]))]
    for low, high in pairwise(levels):
        seconds = int(abs(high - low) / ramp_deg_min * 60)
        pieces += [np.linspace(low, high, seconds, endpoint=False), np.full(soak_s, float(high))]
    temperature = np.concatenate(pieces)[::5]
    return Run.from_columns(time=5.0 * np.arange(len(temperature)), gyro=0 * temperature, T=temperature)


def test_sensitivity_by_hand():
    # m is 24 degC; 27 degC is closer than 5 degC to it and left out.
    found = soaks((-40, "down"), (24, "up"), (27, "up"), (60, "up"))
    assert temperature_sensitivity(found, [1.0, 4.0, 100.0, 5.0]) == pytest.approx(3.0 / 64.0)


def test_sensitivity_needs_two_soaks_far_enough_apart():
    assert temperature_sensitivity([], []) is None
    assert temperature_sensitivity(soaks((25, "up")), [1.0]) is None
    assert temperature_sensitivity(soaks((25, "up"), (28, "up")), [1.0, 2.0]) is None


def test_hysteresis_by_hand():
    found = soaks((20, "up"), (60, "up"), (20.4, "down"), (40, "down"))
    assert hysteresis(found, [1.0, 9.0, 1.3, 5.0]) == pytest.approx(0.3)
    assert hysteresis(found[:2], [1.0, 9.0]) is None
    assert hysteresis(soaks((20, "up"), (22, "down")), [0.0, 1.0]) is None


def test_soaks_of_a_run_with_their_approach():
    run = stepped_run([25, 55, 25, -20])
    found = find_soaks(run, np.ones(len(run), dtype=bool), least_s=100.0)
    assert [soak.approach for soak in found][1:] == ["up", "down", "down"]
    assert [soak.temperature for soak in found] == pytest.approx([25, 55, 25, -20], abs=0.5)


def test_a_linear_law_gives_its_slope():
    run = stepped_run([25, 55, 25, -20])
    error = 0.02 * run.temperature("T") + 1.0
    found = find_soaks(run, np.ones(len(run), dtype=bool), least_s=100.0)
    biases = [error[soak.rows].mean() for soak in found]
    assert temperature_sensitivity(found, biases) == pytest.approx(0.02, rel=0.01)


def test_rows_that_do_not_count_make_no_soak():
    run = stepped_run([25, 55])
    assert find_soaks(run, np.zeros(len(run), dtype=bool), least_s=100.0) == ()


def test_a_run_without_temperature_has_no_soaks():
    run = Run.from_columns(time=np.arange(100.0), gyro=np.zeros(100))
    assert find_soaks(run, np.ones(100, dtype=bool), least_s=10.0) == ()


@pytest.mark.parametrize("hidden", ["gap", "turning"])
def test_stays_at_two_temperatures_are_two_soaks_though_the_way_between_was_not_seen(hidden):
    """Soaks at 20 and 60 degC; the ramp between falls into a gap, or the table turns all along it."""
    run = stepped_run([20, 60], soak_s=3600)
    ramp = (run.time >= 3500.0) & (run.time < 6100.0)
    if hidden == "gap":
        run = Run("gap", {name: values[~ramp] for name, values in run.columns.items()})
    else:
        run = run.with_columns(rate=np.where(ramp, 10.0, 0.0))
    error = 0.02 * run.temperature("T")
    found = find_soaks(run, run.rate == 0.0, least_s=100.0)
    assert [round(soak.temperature) for soak in found] == [20, 60]
    assert [soak.approach for soak in found] == ["none", "none"]
    biases = [error[soak.rows].mean() for soak in found]
    assert temperature_sensitivity(found, biases) == pytest.approx(0.02, rel=1e-6)
    stays = [(a, b) for name, a, b in regimes(run).segments() if name == "soak"]
    assert all(np.ptp(run.temperature("T")[a:b]) < 1.5 for a, b in stays)


def test_a_stay_goes_on_over_a_pause_of_the_logger():
    """A gap in which temperature stays as it was, and turns of the table, leave one soak."""
    run = stepped_run([20, 60])
    kept = (run.time < 11000.0) | (run.time > 12500.0)
    run = Run("pause", {name: values[kept] for name, values in run.columns.items()})
    run = run.with_columns(rate=np.where((run.time > 14000.0) & (run.time < 14300.0), 10.0, 0.0))
    found = find_soaks(run, run.rate == 0.0, least_s=100.0)
    assert [(round(soak.temperature), soak.approach) for soak in found] == [(20, "none"), (60, "up")]
