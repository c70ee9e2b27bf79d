"""What commands print: tables whose words stay whole where the terminal has room for them."""

from __future__ import annotations

import io
import re
import sys

import pytest

from fogml.cli.terminal import Terminal, fitted
from fogml.gap.result_parts import Rehearsed
from fogml.report.gap_tables_ahead import rehearsal_table
from fogml.report.page import Tile
from fogml.report.tables import Row, Table
from fogml.twin.registry import effects

WAYS = [
    ["drift-observing", "26.25", "-1.234e-07", "1.909e-06", "1.348e-07", "0.5363"],
    ["plain", "60", "0", "0", "0", "–"],
]
HEADER = ["way", "dwell [s]", "error here [deg]", "greatest [deg]", "rms [deg]", "se of noise, rms [deg]"]


@pytest.mark.parametrize("columns", [62, 72, 80, 200])
def test_words_stay_whole_where_they_fit(columns: int, monkeypatch, capsys) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    Terminal().table("Ways", HEADER, WAYS)
    told = capsys.readouterr().out
    assert max(map(len, told.splitlines())) <= columns
    assert {word for row in [HEADER, *WAYS] for cell in row for word in cell.split()} <= set(told.split())


def test_chinese_names_stay_whole_though_their_signs_are_two_wide(monkeypatch, capsys) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    Terminal().table(
        "", ["column", "unit", "mean"], [["转台速率", "deg/s", "0"], ["壳体温度", "degC", "25.0"]]
    )
    assert {"转台速率", "壳体温度"} <= set(capsys.readouterr().out.split())


def test_words_of_a_page_s_table_stay_whole_at_80(monkeypatch, capsys) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    names = {id: declared.title for id, declared in effects().items()}
    first, second = sorted(names, key=lambda id: max(map(len, names[id].split())))[-2:]
    likely = {"form": "usual", "size": "usual", "probability": 0.42}
    rehearsed = [
        Rehearsed(effect=second, length=15.0, outcome="mistaken", named_as=(first,), **likely),
        Rehearsed(effect=first, length=2.5, outcome="missed", named_as=(), **likely),
    ]
    table = rehearsal_table(rehearsed, names)
    Terminal().show(table, "What these runs would name")
    told = capsys.readouterr().out
    assert max(map(len, told.splitlines())) <= 80
    assert {word for row in table.rows for cell in row.cells for word in cell.split()} <= set(told.split())


def test_a_page_s_table_has_units_its_caption_and_what_is_chosen(capsys) -> None:
    rows = [Row(("a", "1 × 10⁻⁶"), "chosen"), Row(("b", "2"), "baseline"), ("c", "3")]
    Terminal().show(Table("Model | >Rms [deg/h]", rows, "What is left."), most=2)
    Terminal().show(None, "nothing")
    told = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [line for line in told if line and set("".join(line)) != {"─"}] == [
        ["What", "is", "left."],
        ["Model", "Rms", "[deg/h]", "chosen"],
        ["a", "1×10⁻⁶", "✓"],
        ["b", "2"],
    ]


def test_a_page_s_tiles_are_lines(capsys) -> None:
    Terminal().tiles([Tile("Minimum", "0.04", "deg/h", "at 800 s"), Tile("Runs", "3")])
    assert capsys.readouterr().out.splitlines() == ["Minimum: 0.04 deg/h, at 800 s", "Runs: 3"]


def test_no_figure_is_lost_where_they_do_not_fit(monkeypatch, capsys) -> None:
    monkeypatch.setenv("COLUMNS", "30")
    Terminal().table("Ways", HEADER, WAYS)
    told = capsys.readouterr().out
    assert max(map(len, told.splitlines())) <= 30
    for row in WAYS:
        for letter in "".join(row):
            assert letter in told


def test_a_bound_stands_beside_its_sign(monkeypatch, capsys) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    rows = [["Bias instability of a gyro", "≤ 0.0313", "± 1.5"], ["Rate ramp", "≥ 1.2 × 10⁻⁵", "≤ 2"]]
    Terminal().table("t", ["quantity", "before", "limit"], rows)
    words = capsys.readouterr().out.split()
    assert {"≤0.0313", "±1.5", "≥1.2×10⁻⁵", "≤2"} <= set(words)


def test_a_table_without_names_has_no_head(capsys) -> None:
    Terminal().table("Export", ["", ""], [["weights", "72 bytes"]])
    assert [line.split() for line in capsys.readouterr().out.splitlines()] == [
        ["Export"],
        [],
        ["weights", "72", "bytes"],
        [],
    ]


def test_figures_stand_right_and_words_left(monkeypatch, capsys) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    rows = [["a", "–", "1", "rises"], ["b", "12.5", "deg/h", "of the coil"], ["c", "–", "deg/h", "falls"]]
    Terminal().table("", ["name", "value", "unit", "meaning"], rows)
    lines = capsys.readouterr().out.splitlines()
    assert [lines[i].index(w) for i, w in ((3, "1"), (4, "deg"))] == [lines[1].index("unit")] * 2
    assert [lines[i].index(w) for i, w in ((3, "rises"), (4, "of the"))] == [lines[1].index("meaning")] * 2
    assert lines[4].index("12.5") + 4 == lines[1].index("value") + 5


def test_a_long_remark_leaves_the_other_columns_room(monkeypatch, capsys) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    remark = "neither levelled off nor flagged: limit the features to the trained box first, or export anew"
    Terminal().table("", ["", ""], [["largest difference in the box", "72 bytes"], ["beyond", remark]])
    assert "largest difference" in capsys.readouterr().out


def test_where_nobody_looks_a_row_is_a_line(monkeypatch, capsys) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    Terminal().table("Ways", ["id", "title"], [["a", "word " * 60]])
    assert "word " * 59 in capsys.readouterr().out


class _Screen(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_in_a_terminal_sentences_break_between_words(monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    text = (
        "  - The run-in of /some/long/folder/that/no/terminal/holds/in/forty.csv leaves 0.1234 deg/h, ±0.02."
    )
    lines = fitted(text, _Screen()).split("\n")
    assert " ".join(lines).split() == text.split()
    assert all(len(line) <= 40 or len(line.split()) == 1 for line in lines)
    assert all(line.startswith("    ") for line in lines[1:])
    for kept in ("fogml " + text, text + "\n" + text):
        assert fitted(kept, _Screen()) == kept
    assert fitted(text, io.StringIO()) == text


def test_a_bar_cuts_the_description_and_not_the_times(monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", screen := _Screen())
    with Terminal().work("searching for programmes that tell the causes apart, run 3 of 12", total=2) as work:
        work.advance()
        work.advance()
    shown = re.sub("\x1b\\[[0-9;?]*[a-zA-Z]", "", screen.getvalue()).split("\r")
    last = next(line for line in reversed(shown) if "searching" in line).splitlines()[0]
    assert len(last) <= 60 and "…" in last
    assert re.search(r"0:00:0\d left: 0:00:00", last)


def test_a_line_of_a_log_tells_the_time_left(monkeypatch, capsys) -> None:
    clock = iter([0.0, 100.0, 101.0, 300.0])
    monkeypatch.setattr("fogml.cli.terminal.time.monotonic", lambda: next(clock))
    with Terminal().work("reading", total=4.0) as work:
        work.advance()
        work.advance()  # too soon for another line
        work.advance()
    told = capsys.readouterr().err.splitlines()
    assert told == ["reading: 25 %, about 0:05:00 left", "reading: 75 %, about 0:01:40 left"]


def test_a_note_stands_on_a_line_of_its_own_above_the_bar(monkeypatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", screen := _Screen())
    terminal = Terminal()
    with terminal.work("fitting"):
        terminal.note("unit A failed")
    before, _, after = screen.getvalue().partition("unit A failed")
    assert before.endswith("\x1b[2K") and after.startswith("\n")
