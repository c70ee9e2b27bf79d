"""The experiments on the lab's procedures: configurations load, and what the pages claim is computed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from experiments.misalignment import __main__ as misalignment
from experiments.navigation_error import __main__ as navigation_error
from experiments.north_seeking import __main__ as north_seeking
from experiments.north_seeking.power_ons import cumulated, span_means
from fogml.lab.north_schemes import CoarseFine


def settings_of(module) -> dict:
    return yaml.safe_load((Path(module.__file__).parent / "config.yaml").read_text(encoding="utf-8"))


def test_means_over_spans_that_are_no_whole_samples() -> None:
    values = np.arange(12.0).reshape(2, 6)
    means = span_means(cumulated(values), np.array([0.0, 1.25]), np.array([2.0, 3.0]))
    np.testing.assert_allclose(means[0], [0.5, (0.75 * 1.0 + 2.0) / 1.75])
    np.testing.assert_allclose(means[1], means[0] + 6.0)


def test_ways_take_equal_time_but_for_the_patent_s_own() -> None:
    ways = north_seeking.ways(settings_of(north_seeking))
    ends = {
        name: (way.fine if isinstance(way, CoarseFine) else way).spans_s[1][-1] for name, way in ways.items()
    }
    own = "coarse-fine at 45°, clockwise, 6 s and 50 s as stated"
    assert ends.pop(own) == pytest.approx(270.0 + 24.0)
    np.testing.assert_allclose(list(ends.values()), 270.0)


def test_the_claim_on_quiet_azimuths() -> None:
    told = north_seeking.closed_form(settings_of(north_seeking))["set_ups"]
    clockwise, reordered, counter, _ = told
    assert clockwise["quiet_deg"] == pytest.approx((135.0, 315.0))
    assert clockwise["error_at_45_deg"] == pytest.approx(0.01866, abs=5e-6)
    for other in (reordered, counter):
        assert other["quiet_deg"] == pytest.approx((45.0, 225.0))


def test_four_states_are_exact_at_every_misalignment() -> None:
    for row in misalignment.noise_free(settings_of(misalignment)):
        assert abs(row["K_ppm"][2]) < 1e-6 and abs(row["x_deg"][2]) < 1e-9
        assert abs(row["x_deg"][1]) > 0.3


def test_integration_agrees_with_the_closed_form() -> None:
    rows = navigation_error.constant({**settings_of(navigation_error), "latitudes": [39.9]})
    assert max(row["position_apart_m"] for row in rows) < 1e-6
    assert max(row["heading_apart_deg"] for row in rows) < 1e-11
