"""The measurement of stated uncertainties: its own signals and shares, and two of its cases."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.lab_uncertainty import __main__ as lab_uncertainty
from experiments.lab_uncertainty import certificates, north, planning, rate
from experiments.lab_uncertainty.measure import Told, coverage, of_interval, wilson
from experiments.lab_uncertainty.signals import Noise, flicker, lagged


def deviation(series: np.ndarray, rows: int) -> float:
    """Allan deviation over `rows`."""
    means = series[: len(series) // rows * rows].reshape(-1, rows).mean(axis=1)
    return float(np.sqrt(0.5 * np.mean(np.diff(means) ** 2)))


def test_noise_has_the_allan_deviations_that_are_told() -> None:
    rng = np.random.default_rng(0)
    white = deviation(Noise(0.02).draw(rng, 1 << 16, 1.0), 100)
    assert white == pytest.approx(0.02 / np.sqrt(100.0 / 3600.0), rel=0.1)
    pink = np.mean([deviation(flicker(rng, 1 << 14), 32) for _ in range(20)])
    assert pink == pytest.approx(np.sqrt(2.0 * np.log(2.0) / np.pi), rel=0.05)
    walk = np.mean([deviation(Noise(0.0, K=0.1).draw(rng, 1 << 14, 1.0), 400) for _ in range(20)])
    assert walk == pytest.approx(0.1 * np.sqrt(400.0 / 3600.0 / 3.0), rel=0.15)
    counts = Noise(0.0, count_arcsec=0.5).counted(np.full(1000, 3.3), 0.1) * 0.1 / 0.5
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    assert counts.sum() * 0.5 == pytest.approx(330.0, abs=0.5)


def test_a_lag_is_that_of_its_closed_form() -> None:
    rise = lagged(np.concatenate(([0.0], np.ones(50))), 2.0, 10.0)
    np.testing.assert_allclose(rise, 1.0 - np.exp(-0.2 * np.arange(51)), atol=1e-12)


def test_shares_and_their_intervals() -> None:
    row = coverage("a case", "a figure", [Told(1.0, 2.0), Told(-3.0, 2.0), Told(0.5, None), None])
    assert (row["runs"], row["stated"], row["held"]) == (4, 2, 0.5)
    # An interval that is not even about the estimate holds what lies between its ends.
    uneven = [of_interval(1.0, 1.4, (0.9, 1.5)), of_interval(1.0, 0.85, (0.9, 1.5))]
    assert coverage("a case", "a figure", uneven)["held"] == 0.5
    # E. B. Wilson's interval of 90 of 100.
    assert wilson(90, 100) == pytest.approx((0.8256, 0.9448), abs=1e-4)


@pytest.mark.parametrize(
    ("part", "case"),
    [
        (north, "navigation grade, strong drift"),
        (rate, "table's rates off by 5 ppm"),
        (certificates, "6 runs"),
    ],
)
def test_intervals_hold(part, case: str) -> None:
    row, *_ = part.measured(case, 40, 3)
    assert row["held"] >= 0.75 and row["wilson95"][1] > 0.9


def test_fits_of_a_planned_run_scatter_as_promised() -> None:
    k1, *_ = planning.measured("constants", 12, 3)
    # Of twelve normal errors the rms lies within these but once in a thousand.
    assert k1["quantity"] == "k1" and 0.4 < k1["rms_z"] < 1.7


def test_the_page_tells_every_row() -> None:
    (row,) = rate.measured("three soaks", 2, 1)
    rows = {title: [] for title, *_ in lab_uncertainty.PARTS}
    rows["Rate table (`lab rate`)"] = [row]
    text = lab_uncertainty.page(rows, {"three soaks: sensitivity [ppm/degC]": 0.62})
    assert "| three soaks | sensitivity [ppm/degC] | 2 |" in text and "| 62 % |" in text
