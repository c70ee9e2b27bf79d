"""Numbers as people read them, and round numbers on axes."""

from __future__ import annotations

import math
import re
import unicodedata
from decimal import Decimal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fogml import numerals as words
from fogml.pictures import braille, ticks
from fogml.report.axes_page import _acceptance
from fogml.report.blind_tables import figure_text, open_set_plot, spanned
from fogml.report.effect_card import quantities_table
from fogml.report.monitor_words import _days
from fogml.report.page import _breakable
from fogml.report.style import log_axis, rounded_up, time_unit
from fogml.report.tables import Table, coefficients_table
from fogml.twin.pictures import card_values
from fogml.twin.registry import effect
from tests.report.pages import Page
from tests.report.procedure_pages import benchmark


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0121, "0.0121"),
        (0.31, "0.310"),
        (9.996, "10.0"),
        (0.0999949, "0.100"),
        (15.041067, "15.0"),
        (-0.5, "−0.500"),
        (1e-6, "1.00 × 10⁻⁶"),
        (2.5e8, "2.50 × 10⁸"),
        (0.0, "0"),
        (None, "–"),
        (math.nan, "–"),
        (math.inf, "∞"),
        (-math.inf, "−∞"),
    ],
)
def test_number(value: float | None, text: str) -> None:
    assert words.number(value) == text


@given(st.floats(1e-4, 9.9e6), st.sampled_from([-1.0, 1.0]))
def test_a_number_is_right_to_three_digits(size: float, sign: float) -> None:
    shown = Decimal(words.number(sign * size).replace("−", "-"))
    assert abs(float(shown) - sign * size) <= 0.5000001 * 10 ** (math.floor(math.log10(size)) - 2)


def test_limits_are_shown_as_they_were_stated() -> None:
    assert words.stated(0.05) == "0.05"
    assert words.stated(1.0) == "1"


def test_a_share_that_is_not_zero_is_not_shown_as_zero() -> None:
    assert words.percent(0.0) == "0 %"
    assert words.percent(1e-5) == "under 0.1 %"
    assert words.percent(0.99999) == "over 99.9 %"
    assert words.percent(-3e-4) == "above −0.1 %"
    assert words.percent(0.123) == "12.3 %"
    assert words.percent(-1.612) == "−161.2 %"


def test_a_value_ends_with_the_second_digit_of_its_error() -> None:
    told = [words.to_error(359.73304, error) for error in (1.07, 0.0312, 1e-7, None)]
    assert told == ["359.7", "359.733", "359.7330", "359.7330"]


def test_a_minimum_that_is_not_the_lowest_point_says_from_where_on_it_is() -> None:
    noise = {"taus_s": [1, 10, 100], "adev": [3.0, 1.0, 2.0], "holds_from_s": 100.0}
    assert "100 s on" in words.lowest_from({**noise, "minimum": {"adev": 2.0, "tau_s": 100}})
    assert not words.lowest_from({**noise, "minimum": {"adev": 1.0, "tau_s": 10}})


def test_lists_of_names() -> None:
    assert words.listed(["a"]) == "a"
    assert words.listed(["a", "b", "c"]) == "a, b and c"
    assert words.listed(list("abcdef")) == "a, b, c and 3 more"


def test_durations() -> None:
    assert [words.duration(s) for s in (36, 750, 27288, 400000)] == ["36.0 s", "12.5 min", "7.58 h", "4.63 d"]


@given(st.floats(1e-8, 1e8), st.floats(1.0001, 1e9))
def test_a_log_axis_holds_its_values_and_has_ticks_within(low: float, factor: float) -> None:
    axis = log_axis(low, low * factor)
    start, stop = axis["range"]
    assert start < math.log10(low) and stop > math.log10(low * factor)
    assert all(start <= math.log10(tick) <= stop + 1e-9 for tick in axis["tickvals"])
    assert len(axis["tickvals"]) == len(axis["ticktext"]) >= 1


def test_a_log_axis_ends_where_numbers_do() -> None:
    """The evidence of a change is cut off at 1e304, beyond which there would be room on the axis."""
    for values in ((1e-2, 1e304), (1e-305, 1.0), (0.5, 1e300, math.inf)):
        axis = log_axis(*values)
        assert np.isfinite(axis["range"]).all() and np.isfinite(axis["tickvals"]).all()
        assert axis["range"][0] <= math.log10(min(values)) < axis["range"][1]


def test_a_log_axis_is_that_of_its_positive_values() -> None:
    assert log_axis(0.0, 2.0, 0.5, -1.0) == log_axis(0.5, 2.0)
    assert log_axis(0.0) == log_axis(1.0)


def test_log_ticks_read_as_plain_numbers() -> None:
    assert log_axis(0.01, 0.5)["ticktext"] == ["0.01", "0.02", "0.05", "0.1", "0.2", "0.5"]
    assert log_axis(1.0, 1e6, room=0.0)["ticktext"][-2:] == ["10⁵", "10⁶"]


@given(st.floats(1e-6, 1e6))
def test_rounded_up_is_the_next_of_one_two_five(value: float) -> None:
    up = rounded_up(value)
    assert value * (1 - 1e-6) <= up <= value * 2.5 * (1 + 1e-6)
    assert f"{up:.3e}"[:5] in ("1.000", "2.000", "5.000")


@pytest.mark.parametrize(("span", "unit"), [(60, "s"), (3600, "min"), (36000, "h"), (1e6, "d")])
def test_time_units(span: float, unit: str) -> None:
    assert time_unit(span)[1] == unit


def test_ticks_are_round_and_within() -> None:
    assert ticks(-0.4, 0.6) == [-0.4, -0.2, 0.0, 0.2, 0.4, 0.6]
    # One alone would tell no size.
    assert ticks(-0.00403, 0.00403, 4) == [-0.004, -0.002, 0.0, 0.002, 0.004]
    assert all(f"{tick:g}" != "-0" for tick in ticks(-0.37, 0.21))


def test_a_table_of_terms_of_the_output_says_what_they_add_up_to() -> None:
    told = {"D": {"value": 1.0, "se": 1e-6}, "T": {"value": -0.01, "se": 1e-4}}
    of_output, of_drift = (
        coefficients_table({"coefficients": {name: told[name] for name in names}}) for names in ("DT", "T")
    )
    assert of_output is not None and "sign opposite" in of_output.caption
    assert of_drift is not None and not of_drift.caption


def test_no_column_of_a_table_goes_without_a_heading() -> None:
    with pytest.raises(ValueError, match="column 2 of the table 'Terms' has no heading"):
        Table((("Term", "", "text"), (" ", "", "figure")), (), "Terms")


def test_a_curve_of_dots_rises_from_left_to_right() -> None:
    (line,) = braille(np.arange(4.0), width=2, height=1)
    assert [unicodedata.name(sign) for sign in line] == [
        f"BRAILLE PATTERN DOTS-{dots}" for dots in ("67", "24")
    ]


def test_a_cell_breaks_between_words_after_marks_and_never_within_an_interval() -> None:
    def pieces(cell: str) -> list[str]:
        """What stays on a line whole."""
        return re.split(r"<wbr>| ", str(_breakable(cell)))

    assert pieces("mean probability on one cause") == ["mean", "probability", "on", "one", "cause"]
    assert pieces("0.38 (0.24 … 0.60); 12") == ["0.38", "(0.24\u00a0…\u00a00.60);\u00a012"]
    assert pieces("open unknown.probability:") == ["open", "unknown.", "probability:"]
    assert pieces("thermal_hysteresis") == ["thermal_", "hysteresis"]
    assert "".join(pieces("static-20240101T120000Z-rig.csv")) == "static-20240101T120000Z-rig.csv"
    assert max(map(len, pieces("abcdefghijklmnopqrstuvwxyz" * 2))) <= 12


def test_a_curve_of_no_method_is_not_drawn() -> None:
    flat = {"false_positive": [0.0, 1.0], "true_positive": [0.0, 1.0]}
    bent = {"false_positive": [0.0, 0.2, 1.0], "true_positive": [0.0, 0.9, 1.0]}
    assert open_set_plot({"diagnosis": flat}, {}) is None
    drawing = open_set_plot({"diagnosis": flat, "bic": bent}, {"bic": 0.85})
    assert drawing is not None and [trace.name for trace in drawing.figure.data] == ["chance", "bic (0.850)"]
    both = open_set_plot({"diagnosis": bent, "bic": bent}, {})
    assert both is not None and both.figure.data[1].line.width > both.figure.data[2].line.width
    assert spanned("0.8-0.9") == "0.8–0.9" and spanned("same-twin") == "same-twin"


@pytest.mark.parametrize("days", [0.2, 1.0, 45.0, 59.0, 61.0, 200.0, 729.0, 731.0, 3652.5, 20_000.0])
def test_a_long_time_is_told_to_half_a_unit(days):
    count, unit = _days(days).split()
    each = {"day": 1.0, "days": 1.0, "month": 30.44, "months": 30.44, "year": 365.25, "years": 365.25}[unit]
    assert abs(int(count) * each - days) <= max(0.5 * each, 1.0 - days)
    assert (count == "1") is not unit.endswith("s")


def test_a_share_just_short_of_what_is_wanted_is_seen_to_be_short() -> None:
    row = {"format": "percent", "low": None, "high": None, "wanted": {"low": 0.87, "high": 0.93}}
    assert [figure_text({**row, "value": value}) for value in (0.869996, 0.87, 0.9, None)] == [
        "86.9996 %",
        "87.0 %",
        "90.0 %",
        "–",
    ]


def test_without_limits_none_are_counted() -> None:
    row = {"tested": True, "met": None, "limit": None, "name": "Bias"}
    assert _acceptance({"rows": [row], "reasons": []})[:2] == ("1 of 1", "–")


def test_a_card_s_page_writes_units_as_other_pages_do() -> None:
    table = quantities_table(card_values(effect("thermal_hysteresis")))
    assert [row.cells[2] for row in table.rows] == ["deg/h", "°C"]


def test_ratios_of_entries_are_drawn_by_data_and_of_all_cases() -> None:
    read = Page(benchmark("FOG-1"))
    names = [[trace["name"] for trace in figure["data"]] for figure in read.figures]
    assert ["thermal cycle, MEMS", "synthetic, second reality", "all, with 95 % interval"] in names
