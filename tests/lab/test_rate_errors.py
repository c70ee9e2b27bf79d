"""What is stated of a scale factor's error, against rates, tables and loggers written by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import t as student

from fogml.arrays import FloatArray
from fogml.lab.rate_errors import nonlinearity_within, spread_of
from fogml.lab.rate_json import rate_json
from fogml.lab.rate_pieces import find_plateaus
from fogml.lab.rate_temperature import _soaks
from fogml.runs.facts import Facts
from fogml.runs.run import Run

SCALE = 1.0002
LADDER = np.array([0.0, 5.0, -5.0, 10.0, -10.0, 20.0, -20.0, 50.0, -50.0, 100.0, -100.0, 0.0])


def lagging(step_s: float = 0.01, dwell_s: float = 8.0, lag_s: float = 0.3, dropped: float = 0.0) -> Run:
    """A table that takes `lag_s` to its commanded rates, and a logger that drops rows."""
    rng = np.random.default_rng(3)
    rate = np.repeat(LADDER, round(dwell_s / step_s))
    time = step_s * np.arange(len(rate))
    keep = np.exp(-step_s / lag_s)
    gyro = 3600.0 * SCALE * lfilter([1.0 - keep], [1.0, -keep], rate) + 2.0 * rng.standard_normal(len(rate))
    rows = rng.random(len(rate)) >= dropped
    return Run("table", {"time": time[rows], "gyro": gyro[rows], "rate": rate[rows]}, Facts())


@pytest.mark.parametrize("dropped", [0.0, 0.03])
def test_settling_is_left_out_and_dropped_rows_part_no_plateau(dropped: float) -> None:
    run = lagging(dropped=dropped)
    assert len(find_plateaus(run)) == len(LADDER)
    line = rate_json([run], source="table")["scale_factor"]
    assert line["scale_factor"] == pytest.approx(SCALE, abs=2e-6)
    assert line["ci90"][0] < SCALE < line["ci90"][1]
    # Told to leave out two rows, a lag of 0.3 s in 8 s takes some per cent.
    early = rate_json([run], source="table", settle_s=0.02)["scale_factor"]
    assert abs(early["scale_factor"] - SCALE) > 0.01


def test_a_long_gap_parts_a_plateau() -> None:
    run = lagging(lag_s=0.05)
    rows = (run.time < 19.0) | (run.time > 22.0)
    cut = Run("table", {name: values[rows] for name, values in run.columns.items()}, run.facts)
    assert len(find_plateaus(cut)) == len(LADDER) + 1


def test_a_run_without_rates_has_no_nonlinearity() -> None:
    time = np.arange(2.0)
    run = Run("short", {"time": time, "gyro": time, "rate": 5.0 * time}, Facts())
    plateaus = find_plateaus(run)
    assert len(plateaus) == 0
    assert nonlinearity_within(run, plateaus, 1.0) is None


def test_errors_of_the_table_are_in_the_interval() -> None:
    held = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        true = LADDER * (1.0 + 5e-6 * rng.standard_normal(len(LADDER)))
        gyro = np.repeat(3600.0 * SCALE * true, 40) + 0.1 * rng.standard_normal(40 * len(LADDER))
        columns = {"time": np.arange(len(gyro)) * 1.0, "gyro": gyro, "rate": np.repeat(LADDER, 40)}
        line = rate_json([Run("table", columns, Facts())], source="table", settle_s=2.0)["scale_factor"]
        held.append(line["ci90"][0] <= SCALE <= line["ci90"][1])
    assert 0.75 <= np.mean(held) <= 1.0


def test_an_asymmetry_is_told_from_none_and_widens_no_scale_factor() -> None:
    told = []
    for uneven in (0.0, 40e-6):
        rng = np.random.default_rng(7)
        rate = np.repeat(LADDER, 60)
        gyro = 3600.0 * rate * (SCALE + 0.5 * uneven * np.sign(rate)) + 0.5 * rng.standard_normal(len(rate))
        columns = {"time": np.arange(len(rate)) * 1.0, "gyro": gyro, "rate": rate}
        told.append(rate_json([Run("table", columns, Facts())], source="table")["scale_factor"])
    (low, high), (least, most) = (line["asymmetry_ci90_ppm"] for line in told)
    assert low < 0.0 < high and 0.0 < least < 40.0 < most < 50.0
    widths = [line["ci90"][1] - line["ci90"][0] for line in told]
    assert widths[1] == pytest.approx(widths[0], rel=1e-3)
    assert told[1]["ci90"][0] < SCALE < told[1]["ci90"][1]


def test_rates_of_one_sense_more_often_leave_the_mean_of_both_in_the_interval() -> None:
    """The line lies nearer to the sense that has more rates: 4 ppm off the mean of an asymmetry of 40 ppm."""
    rate = np.repeat(np.concatenate([LADDER, np.tile([100.0, 0.0], 4)]), 60)
    noise = 0.5 * np.random.default_rng(3).standard_normal(len(rate))
    gyro = 3600.0 * rate * (SCALE + 20e-6 * np.sign(rate)) + noise
    run = Run("table", {"time": np.arange(len(rate)) * 1.0, "gyro": gyro, "rate": rate}, Facts())
    line = rate_json([run], source="table")["scale_factor"]
    assert line["scale_factor"] - SCALE > 4e-6
    assert line["ci90"][0] < SCALE < line["ci90"][1] < SCALE + 25e-6


def test_counts_leave_a_mean_as_well_known_as_it_is() -> None:
    rng = np.random.default_rng(5)
    rate = np.repeat(LADDER, 2000)
    angle = np.cumsum(3600.0 * rate * 0.01 + 0.02 * rng.standard_normal(len(rate)))
    gyro = np.diff(np.floor(np.concatenate(([0.0], angle)))) / 0.01
    run = Run("table", {"time": 0.01 * np.arange(len(rate)), "gyro": gyro, "rate": rate}, Facts())
    plateaus = find_plateaus(run)
    # Rounding both ends of 20 s to an arcsecond makes 0.02 deg/h, noise of the samples 0.045; rows show 0.9.
    assert 0.02 < np.median(plateaus.error) < 0.1


def test_soaks_of_three_temperatures_have_an_interval_of_few_degrees_of_freedom() -> None:
    held: list[bool] = []
    for seed in range(48):
        rng = np.random.default_rng(seed)
        rate = np.tile(np.repeat([0.0, 10.0, -10.0, 0.0], 60), 3)
        warmth = np.repeat([-40.0, 10.0, 60.0], 240)
        # Soaks miss the line by up to 10 ppm, which three of them hardly tell.
        off = (0.0, 1.0, 3.0, 10.0)[seed % 4] * np.repeat(rng.standard_normal(3), 240)
        gyro = 3600.0 * rate * (1.0 + 1e-6 * (2.0 * (warmth - 10.0) + off))
        gyro += 0.5 * rng.standard_normal(len(rate))
        columns: dict[str, Any] = {
            "time": np.arange(len(rate)) * 1.0,
            "gyro": gyro,
            "rate": rate,
            "T": warmth,
        }
        sensed = rate_json([Run("soaks", columns, Facts())], source="table")["temperature_sensitivity"]
        held.append(sensed["ci90"][0] <= 2.0 <= sensed["ci90"][1])
    assert np.mean(held) >= 0.8


def test_runs_of_one_name_each_tell_of_the_scale_factor_over_temperature() -> None:
    rate = np.tile(np.repeat([0.0, 10.0, -10.0, 0.0], 60), 2)
    runs = []
    for warmth in (-40.0, 60.0):
        columns = {"time": np.arange(len(rate)) * 1.0, "rate": rate, "T": np.full(len(rate), warmth)}
        columns["gyro"] = 3600.0 * rate * (1.0 + 2e-6 * (warmth - 10.0))
        runs.append(Run("ladder.csv", columns, Facts()))
    sensed = rate_json(runs, source="table")["temperature_sensitivity"]
    assert sensed["ppm_per_degC"] == pytest.approx(2.0, rel=1e-6)
    assert sensed["temperature"] == pytest.approx([-40.0, 60.0])


@pytest.mark.parametrize("one_way", [[0, 1, 2], [1]])
def test_soaks_that_turned_one_way_are_no_half_of_a_scale_factor(one_way: list[int]) -> None:
    rng = np.random.default_rng(4)
    ladder = [[0.0, 10.0, 0.0] if soak in one_way else [0.0, 10.0, -10.0, 0.0] for soak in range(3)]
    rate = np.repeat(np.concatenate(ladder), 60)
    warmth = np.repeat([-40.0, 10.0, 60.0], [60 * len(rates) for rates in ladder])
    gyro = 3600.0 * rate * SCALE * (1.0 + 2e-6 * (warmth - 10.0)) + 0.01 * rng.standard_normal(len(rate))
    rate = rate + 1e-4 * rng.standard_normal(len(rate))
    columns: dict[str, Any] = {"time": np.arange(len(rate)) * 1.0, "gyro": gyro, "rate": rate, "T": warmth}
    sensed = rate_json([Run("soaks", columns, Facts())], source="table")["temperature_sensitivity"]
    assert sensed["ppm_per_degC"] == pytest.approx(2.0, abs=0.1)
    np.testing.assert_allclose(sensed["scale_factor"], SCALE, rtol=2e-4)


@pytest.mark.parametrize("rates", [[0.0, 10.0, 0.0], [0.0, 10.0, 0.0, 20.0, 0.0], [0.0, 10.0, -10.0, 0.0]])
def test_steps_that_share_plateaus_tell_how_far_a_scale_factor_is_off(rates: list[float]) -> None:
    """Plateaus of 60 rows with noise of 1 deg/h: scatter of scale factors and noise told, over many soaks."""
    rng = np.random.default_rng(5)
    levels, found, squares, freedom = np.array(rates), [], 0.0, 0.0
    rows = 60 * np.arange(len(levels) + 1.0)
    sizes = np.diff(np.abs(levels))
    for _ in range(1000):
        off = np.diff(levels + rng.standard_normal(len(levels)) / np.sqrt(60.0))
        pieces = (rows[:-2], rows[1:-1], rows[1:-1], rows[2:])
        soak = _soaks(np.column_stack([np.zeros(len(off)), np.diff(levels), sizes, off, *pieces]))
        found.append(soak.scale[0])
        squares, freedom = squares + soak.squares, freedom + soak.freedom
    assert squares / freedom == pytest.approx(1.0, rel=0.1)
    assert np.std(found) == pytest.approx(np.sqrt(soak.variance[0]), rel=0.1)


def test_one_known_part_gives_student_s_interval() -> None:
    rng = np.random.default_rng(0)
    line = np.column_stack([np.ones(200), np.arange(200.0)])
    gain = np.linalg.pinv(line)[1]
    values: FloatArray = rng.standard_normal(200)
    found = spread_of(gain, line, values, (np.ones(200), np.zeros(200)))
    assert found is not None
    left = values - line @ np.linalg.pinv(line) @ values
    wanted = np.sqrt(left @ left / 198.0) * np.linalg.norm(gain)
    assert found.se == pytest.approx(wanted)
    assert found.half_width == pytest.approx(student.ppf(0.95, 198) * wanted)
    assert spread_of(gain[:2], line[:2], values[:2], (np.ones(2), np.ones(2))) is None


def test_a_standard_error_is_never_wider_than_the_interval_of_90_percent() -> None:
    """Three values on a line: most of what is left is hardly told, so that large ratios stay likely."""
    line = np.column_stack([np.ones(4), np.arange(4.0)])
    gain = np.linalg.pinv(line)[1]
    for noise in (0.0, 1e-9, 1e-3, 1.0):
        values = line @ np.array([1.0, 2.0]) + noise * np.random.default_rng(2).standard_normal(4)
        found = spread_of(gain, line, values, (np.ones(4), np.full(4, 1e6)))
        assert found is not None and 0.0 <= found.se <= found.half_width
