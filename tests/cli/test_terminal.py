"""What commands print: tables whose words stay whole where the terminal has room for them."""

from __future__ import annotations

import pytest

from fogml.cli.terminal import Terminal, number

WAYS = [
    ["drift-observing", "26.25", "-1.234e-07", "1.909e-06", "1.348e-07", "0.5363"],
    ["plain", "60", "0", "0", "0", "–"],
]
HEADER = ["way", "dwell [s]", "error here [deg]", "greatest [deg]", "rms [deg]", "se of noise, rms [deg]"]


@pytest.mark.parametrize("columns", [72, 80, 200])
def test_words_stay_whole_where_they_fit(columns: int, monkeypatch, capsys) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    Terminal().table("Ways", HEADER, WAYS)
    told = capsys.readouterr().out
    assert max(map(len, told.splitlines())) <= columns
    assert {word for row in [HEADER, *WAYS] for cell in row for word in cell.split()} <= set(told.split())


def test_no_figure_is_lost_where_they_do_not_fit(monkeypatch, capsys) -> None:
    monkeypatch.setenv("COLUMNS", "30")
    Terminal().table("Ways", HEADER, WAYS)
    told = capsys.readouterr().out
    assert max(map(len, told.splitlines())) <= 30
    for row in WAYS:
        for letter in "".join(row):
            assert letter in told


def test_a_table_without_names_has_no_head(capsys) -> None:
    Terminal().table("Export", ["", ""], [["weights", "72 bytes"]])
    assert [line.split() for line in capsys.readouterr().out.splitlines()] == [
        ["Export"],
        [],
        ["weights", "72", "bytes"],
        [],
    ]


@pytest.mark.parametrize(
    ("value", "told"),
    [(None, "–"), (0.11182, "0.1118"), (79341.3, "79341"), (-3.602e5, "-360200"), (2.5e8, "2.5e+08")],
)
def test_seconds_of_a_day_have_no_exponent(value: float | None, told: str) -> None:
    assert number(value) == told
