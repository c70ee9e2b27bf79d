"""Shapes that spectra are fitted by: output filters, and terms as samples show them."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.signals.output_filters import LOW_PASSES, OutputFilter
from fogml.signals.spectrum_fit import SpectrumTerms, term_shapes


@pytest.mark.parametrize("low_pass", LOW_PASSES, ids=str)
def test_half_the_power_passes_at_the_corner(low_pass: OutputFilter) -> None:
    corner = low_pass.corner_cycles(np.log(0.3))
    assert corner is not None
    gain, slope = low_pass.response(np.array([corner]), np.log(0.3))
    assert gain[0] == pytest.approx(0.5)
    more, less = (low_pass.response(np.array([corner]), np.log(0.3) + d)[0][0] for d in (1e-5, -1e-5))
    assert slope[0] == pytest.approx((more - less) / 2e-5, rel=1e-6)


def test_what_is_correlated_has_half_its_density_at_its_corner() -> None:
    corner = 1.0 / (2.0 * np.pi * 50.0)
    (low,), (half,) = term_shapes(np.array([1e-9, corner]), 1.0, SpectrumTerms(("G",), correlation_s=50.0))
    assert low == pytest.approx(4.0 * 50.0) and half == pytest.approx(0.5 * low)


def test_what_the_ends_of_a_smooth_series_add_is_flat_once_differenced_twice() -> None:
    frequency = np.geomspace(1e-3, 0.25, 20)
    shape = term_shapes(frequency, 2.0, SpectrumTerms(("E",)))[:, 0]
    assert shape * np.abs(1.0 - np.exp(-2j * np.pi * frequency * 2.0)) ** 4 == pytest.approx(
        np.full(20, 16.0)
    )
