"""Numbers as text."""

import math
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fogml.numerals import (
    against,
    ascii_number,
    digits_between,
    in_two,
    number,
    number_text,
    percent,
    short,
    stated,
    with_error,
)

_LOWERED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-")


def read(text):
    """The number that a person reads."""
    mantissa, _, power = text.translate(_LOWERED).partition(" × 10")
    return float(f"{mantissa}e{power or 0}")


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_text_reads_back_as_the_number(value):
    assert float(number_text(value)) == value


@given(st.floats(1e-4, 1e7, exclude_max=True), st.sampled_from([-1.0, 1.0]), st.integers(1, 6))
def test_a_short_number_is_right_to_its_digits_and_has_no_power_of_ten(value, sign, digits):
    for text, plain in ((short(sign * value, digits), False), (ascii_number(sign * value, digits), True)):
        assert "e" not in text and text.isascii() >= plain
        told = float(text) if plain else read(text)
        assert abs(told - sign * value) <= 0.501 * 10.0 ** (math.floor(math.log10(value)) + 1 - digits)


def test_powers_of_ten_are_raised_in_sentences_and_are_ascii_in_files():
    assert [short(1.01e-11), stated(-1e-5), number(-1e-5, 2)] == ["1.01 × 10⁻¹¹", "−1 × 10⁻⁵", "−1.0 × 10⁻⁵"]
    assert ascii_number(-1.01e-11) == "-1.01e-11"


@given(st.floats(1e-6, 1e6), st.sampled_from([1e-12, 1e-6, 1e-3, 0.1]), st.sampled_from([-1, 0, 1]))
def test_a_number_against_a_limit_reads_as_on_its_side(limit, apart, side):
    value = limit * (1.0 + side * apart)
    told = read(against(value, limit))
    assert (told > limit, told < limit) == (value > limit, value < limit)
    assert abs(told - value) <= 0.006 * value


@given(st.floats(-1e12, 1e12), st.floats(1e-3, 1e12))
def test_two_ends_are_told_to_three_digits_of_what_is_between(least, apart):
    greatest = least + apart
    digits = digits_between(least, greatest)
    told = [float(f"{end:.{digits - 1}e}") for end in (least, greatest)]
    assert told[1] - told[0] == pytest.approx(apart, rel=0.02, abs=1e-15 * abs(least))
    assert digits <= 4 + max(math.log10(max(abs(least), abs(greatest)) / apart), 0.0)


def test_a_value_without_a_finite_error_stands_alone():
    assert [with_error(3.2, se) for se in (math.inf, math.nan, 0.0)] == ["3.20"] * 3
    assert with_error(0.001, 1.5) == "0.0 ± 1.5"


@given(st.floats(-12.0, 9.0), st.floats(-3.0, 8.0), st.floats(1.0, 9.9))
def test_a_value_has_the_digits_that_its_error_allows(power, apart, first):
    se, value = 10.0**power, first * 10.0 ** (power + apart)
    told, error = map(read, in_two(value, se))
    assert abs(told - value) <= 0.051 * se + 1e-14 * value and abs(error - se) <= 0.051 * se


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
