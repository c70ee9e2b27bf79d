"""Units that the run format does not name: converted by what they are, refused where they are a slip."""

from __future__ import annotations

import pytest

from fogml.runs.units import converted


@pytest.mark.parametrize(
    ("unit", "internal", "factor"),
    [
        ("deg/day", "deg/h", 1.0 / 24.0),
        ("arcmin/h", "deg/h", 1.0 / 60.0),
        ("arcminute/min", "deg/h", 1.0),
        ("mdeg/h", "deg/h", 1e-3),
        ("arcsec/ms", "deg/h", 1e3),
        ("turn/min", "deg/s", 6.0),
        ("day", "s", 86400.0),
        ("ks", "s", 1000.0),
    ],
)
def test_units_by_what_they_are(unit: str, internal: str, factor: float) -> None:
    assert converted(unit, internal) == pytest.approx((factor, 0.0))


@pytest.mark.parametrize(
    ("unit", "internal"),
    [("deg/hh", "deg/h"), ("deg/mh", "deg/h"), ("deg/kmin", "deg/h"), ("mdeg/hh", "deg/h"), ("hh", "s")],
)
def test_multiples_of_hours_and_minutes_are_slips(unit: str, internal: str) -> None:
    assert converted(unit, internal) is None
