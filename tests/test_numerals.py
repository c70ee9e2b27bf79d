"""Numbers as text."""

import math
import re
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from fogml.numerals import number_text, percent, short, with_error


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_text_reads_back_as_the_number(value):
    assert float(number_text(value)) == value


@given(st.floats(1e-4, 1e7, exclude_max=True), st.sampled_from([-1.0, 1.0]), st.integers(1, 6))
def test_a_short_number_is_right_to_its_digits_and_has_no_power_of_ten(value, sign, digits):
    text = short(sign * value, digits)
    assert "e" not in text
    assert abs(float(text) - sign * value) <= 0.501 * 10.0 ** (math.floor(math.log10(value)) + 1 - digits)


def test_a_value_without_a_finite_error_stands_alone():
    assert [with_error(3.2, se) for se in (math.inf, math.nan, 0.0)] == ["3.20"] * 3
    assert with_error(0.001, 1.5) == "0.0 ± 1.5"


def test_no_number_is_a_dash():
    assert short(None) == "–"


@given(st.floats(-2.0, 2.0), st.integers(0, 2))
def test_a_share_in_percent_reads_back_and_is_never_rounded_to_none_or_all(share, places):
    text = percent(share, places)
    number = float(text.removesuffix(" %").split()[-1].replace("−", "-"))
    assert abs(number - 100.0 * share) <= (1.0 if " " in text[:-2] else 0.501) * 10.0**-places
    assert (number in (0.0, 100.0)) <= (share in (0.0, 1.0) or share > 1.0)


def test_shares_are_written_by_one_function():
    """A space before the sign everywhere, and no share that is rounded to none or to all."""
    home = Path(__file__).parent.parent / "fogml"
    own = re.compile(r":\.\d%\}|\{100(\.0)? \* [^{}]*\} %")
    files = [path for path in home.rglob("*.py") if path.name != "numerals.py"]
    assert [str(path) for path in files if own.search(path.read_text("utf-8"))] == []
