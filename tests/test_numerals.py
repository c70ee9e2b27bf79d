"""Numbers as text."""

import math

from hypothesis import given
from hypothesis import strategies as st

from fogml.numerals import number_text, short


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_text_reads_back_as_the_number(value):
    assert float(number_text(value)) == value


@given(st.floats(1e-4, 1e7, exclude_max=True), st.sampled_from([-1.0, 1.0]), st.integers(1, 6))
def test_a_short_number_is_right_to_its_digits_and_has_no_power_of_ten(value, sign, digits):
    text = short(sign * value, digits)
    assert "e" not in text
    assert abs(float(text) - sign * value) <= 0.501 * 10.0 ** (math.floor(math.log10(value)) + 1 - digits)


def test_no_number_is_a_dash():
    assert short(None) == "–"
