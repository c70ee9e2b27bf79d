"""An output that settles at the begin of a static run is told of, and no steady one."""

from __future__ import annotations

import numpy as np

from fogml.runs.noise_of_run import noise_report
from fogml.runs.run import Run
from fogml.validation.floors import settling_warning


def static(seed: int, warm_deg_h: float = 0.0, tau_s: float = 1.0, step_s: float = 4.0) -> Run:
    """Four hours of white noise (N = 0.01) and a random walk (K = 0.05), and what decays from the begin."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 14400.0, step_s)
    white = 0.6 / np.sqrt(step_s) * rng.standard_normal(len(time))
    walk = 0.05 / 60.0 * np.sqrt(step_s) * np.cumsum(rng.standard_normal(len(time)))
    return Run("static", {"time": time, "gyro": white + walk + warm_deg_h * np.exp(-time / tau_s)})


def test_a_start_up_is_told_with_its_size_and_a_steady_run_is_not() -> None:
    assert sum(settling_warning(static(seed)) is not None for seed in range(60)) <= 1
    told = [settling_warning(static(seed, 0.8, 400.0)) for seed in range(20)]
    found = [warning for warning in told if warning is not None]
    assert len(found) >= 18 and all(warning["code"] == "settling" for warning in found)


def test_a_run_of_nothing_or_of_counts_tells_none() -> None:
    time = np.arange(2000.0)
    assert settling_warning(Run("still", {"time": time, "gyro": np.full(2000, 1.5)})) is None
    assert settling_warning(Run("short", {"time": time[:20], "gyro": time[:20] % 3})) is None


def codes(run: Run) -> set[str]:
    return {warning["code"] for warning in noise_report(run)["warnings"]}


def test_a_log_that_rounds_the_rate_is_told_by_how_much_n_is_less() -> None:
    run = static(1)
    step = 0.36
    rounded = run.with_columns(gyro=np.round(run.gyro / step) * step)
    counted = np.diff(np.floor(np.concatenate(([0.0], np.cumsum(run.gyro * 4.0))) / 1.0)) / 4.0
    assert "rounded_log" not in codes(run)
    (warning,) = [w for w in noise_report(rounded)["warnings"] if w["code"] == "rounded_log"]
    # White noise of 0.3 deg/h a sample, and 0.36/sqrt(12) of rounding.
    less = 1.0 - 0.3 / np.hypot(0.3, step / np.sqrt(12.0))
    assert abs(float(warning["message"].split("is ")[-1].split("%")[0]) / 100.0 - less) < 0.006
    assert "rounded_log" not in codes(run.with_columns(gyro=counted))
