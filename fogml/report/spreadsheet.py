"""``report.xlsx``: a judgement as sheets that anyone can go on calculating with."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fogml.escaping import cell_text, visible
from fogml.numerals import label, unit_of
from fogml.outputs import scratch_folder, whole_file
from fogml.report.tables import coefficients_of, noticed, repeatability_table
from fogml.report.verdict import advice_words, model_card, stated_limits, subject, verdict
from fogml.validation.advice import advice_on
from fogml.validation.results import AveragedSeries, Judgement, Metrics, RunJudgement

if TYPE_CHECKING:
    from xlsxwriter.worksheet import Worksheet

_NO_DATE = datetime(1980, 1, 1)
"""When a workbook says it was made, as the archive that it is does: the same results are the same bytes."""
SAFE_TEXT = {"strings_to_formulas": False, "strings_to_urls": False, "strings_to_numbers": False}
"""Options of a workbook: names come from files, and no text may turn into a formula or a link."""
_LONGEST_NAME = 31
_MOST_ROWS = 1_048_575
_FORBIDDEN = str.maketrans(dict.fromkeys("[]:*?/\\'", "_"))
_SERIES = (
    ("time", "time [s]"),
    ("temperature", "T [degC]"),
    ("rate", "dT [degC/min]"),
    ("before", "before [deg/h]"),
    ("drift", "drift [deg/h]"),
    ("after", "after [deg/h]"),
    ("lower", "lower 90 % [deg/h]"),
    ("upper", "upper 90 % [deg/h]"),
    ("regime", "regime"),
    ("flag", "flag"),
)


def spreadsheet(judgement: Judgement, path: str | Path) -> None:
    """Write a judgement as an Excel workbook that appears whole or not at all.

    Sheets: the summary, figures per run, averaged series per run, coefficients where the model
    tells them, findings and notes.

    Parameters
    ----------
    judgement
        As :func:`fogml.validation.judge.judge` gives it.
    path
        The file, ending in ``.xlsx``.

    Raises
    ------
    InputError
        If the folder is missing or can't be written.
    """
    with whole_workbook(path) as writer:
        _summary(writer, judgement)
        _figures(writer, judgement)
        if coefficients_of(judgement.model):
            heads = ("term", "coefficient [deg/h per unit of the term]", "standard error")
            writer.table_sheet("Coefficients", heads, coefficients_of(judgement.model), (22,))
        _findings(writer, judgement)
        for kind, runs in (("test", judgement.test), ("train", judgement.train)):
            for index, run in enumerate(runs, start=1):
                _averages(writer, f"{kind} {index} {run.run}", run)


@contextmanager
def whole_workbook(path: str | Path) -> Iterator[Writer]:
    """Yield what writes the sheets of a workbook that appears whole or not at all.

    Raises
    ------
    InputError
        If the folder is missing or can't be written.
    OSError
        If the disk is full.
    """
    import xlsxwriter
    from xlsxwriter.exceptions import FileCreateError

    # The library's own temporary files would stay where its process is killed.
    with whole_file(path) as partial, scratch_folder() as scratch:
        try:
            with xlsxwriter.Workbook(str(partial), {**SAFE_TEXT, "tmpdir": str(scratch)}) as workbook:
                workbook.set_properties({"created": _NO_DATE})
                yield Writer(workbook)
        except FileCreateError as error:
            cause = error.args[0] if error.args else None
            raise (cause if isinstance(cause, OSError) else error) from None


Heads = Sequence[str] | Mapping[str, str]
"""Heads of a table whose rows are cells, or by the keys under which its rows, mappings, hold them."""


class Writer:
    """Sheets with a bold header, frozen, and cells by type."""

    def __init__(self, workbook: Any) -> None:
        self.workbook = workbook
        self.bold = workbook.add_format({"bold": True, "text_wrap": True, "valign": "top"})
        self.title = workbook.add_format({"bold": True, "font_size": 14})
        self.wrapped = workbook.add_format({"text_wrap": True, "valign": "top"})
        self._names: set[str] = set()

    def sheet(self, name: str) -> Worksheet:
        """A new sheet, its name made fit for Excel and unlike the others."""
        fit = visible(name).translate(_FORBIDDEN)[:_LONGEST_NAME].strip() or "sheet"
        number = 1
        while fit.lower() in self._names:
            number += 1
            fit = f"{fit[: _LONGEST_NAME - 4].rstrip()} ({number})"
        self._names.add(fit.lower())
        return self.workbook.add_worksheet(fit)

    def table_sheet(
        self, name: str, heads: Heads, rows: Iterable[Any], widths: Sequence[float] = ()
    ) -> Worksheet:
        """A new sheet of a table alone, its heads frozen, with the columns' widths, the last for the rest."""
        sheet = self.sheet(name)
        self.table(sheet, heads, rows)
        for column, width in enumerate(widths):
            sheet.set_column(column, column if column < len(widths) - 1 else len(heads) - 1, width)
        sheet.freeze_panes(1, 0)
        return sheet

    def table(self, sheet: Worksheet, heads: Heads, rows: Iterable[Any], top: int = 0) -> int:
        """Write a table from row ``top`` on; the row after it."""
        by_key = heads if isinstance(heads, Mapping) else None
        for column, head in enumerate(heads if by_key is None else by_key.values()):
            sheet.write_string(top, column, cell_text(head), self.bold)
        for row in rows:
            top += 1
            for column, value in enumerate(row if by_key is None else map(row.get, by_key)):
                self.cell(sheet, top, column, value)
        return top + 1

    def cell(self, sheet: Worksheet, row: int, column: int, value: Any) -> None:
        """A number, a text, or nothing where the value is missing or not finite."""
        if value is None or value == "":
            return
        if isinstance(value, bool | str):
            text = "yes" if value is True else "no" if value is False else cell_text(value)
            sheet.write_string(row, column, text)
        elif math.isfinite(value):
            sheet.write_number(row, column, float(value))


def _summary(writer: Writer, judgement: Judgement) -> None:
    sheet = writer.sheet("Summary")
    sheet.set_column(0, 0, 30)
    sheet.set_column(1, 6, 16)
    sheet.write_string(0, 0, cell_text(subject(judgement)), writer.title)
    row = 1
    told = advice_words(advice_on(judgement))
    for sentence in (told["words"], *told["reasons"], told["next_step"], *verdict(judgement)):
        sheet.merge_range(row, 0, row, 6, "", writer.wrapped)
        sheet.write_string(row, 0, cell_text(sentence), writer.wrapped)
        sheet.set_row(row, 32)
        row += 1
    heads = ["test run", "averaging [s]", "rms before [deg/h]", "rms after [deg/h]"]
    heads += ["bias stability after [deg/h]", "noise floor [deg/h]", "outside training [share]"]
    rows = [
        (
            run.run,
            run.averaging_s,
            run.before.rms,
            run.after.rms,
            run.after.bias_stability,
            run.floor,
            run.outside_training,
        )
        for run in judgement.test
    ]
    row = writer.table(sheet, heads, rows, row + 1) + 1
    repeatability = repeatability_table(judgement.repeatability)
    if repeatability is not None and judgement.repeatability is not None:
        found = judgement.repeatability
        figures = [("bias_repeatability", found.bias), ("scale_factor_repeatability", found.scale_factor)]
        spreads = [
            (label(name), figure.before, figure.after, unit_of(name), *figure.after_ci90)
            for name, figure in figures
            if figure is not None
        ]
        spread_heads = (repeatability.caption, "before", "after", "unit", "after, 90 % from", "to")
        row = writer.table(sheet, spread_heads, spreads, row) + 1
    outcomes = stated_limits(judgement)
    if outcomes:
        limits = [(label(o.quantity), o.limit, o.value, unit_of(o.quantity), o.met) for o in outcomes]
        row = writer.table(sheet, ("limit on", "limit", "reached", "unit", "met"), limits, row) + 1
    counts = {"parameters": judgement.model.get("parameters"), "training rows": judgement.model.get("rows")}
    card = [(name, counts.get(name) or told) for name, told in model_card(judgement.model)]
    writer.table(sheet, ("model", ""), card, row)


def _figures(writer: Writer, judgement: Judgement) -> None:
    rows: list[tuple[Any, ...]] = []
    for part, runs in (("test", judgement.test), ("train", judgement.train)):
        for run in runs:
            for when, metrics in (("before", run.before), ("after", run.after)):
                values = (getattr(metrics, field.name) for field in fields(Metrics))
                about = (run.floor, run.outside_training, run.rows_used, run.rows_left_out)
                start = (run.run, part, when, run.unit, run.axis, run.averaging_s)
                rows.append((*start, *values, *about, run.bias_reference))
    heads = ["run", "part", "when", "unit", "axis", "averaging [s]"]
    heads += [f"{label(field.name).lower()} [{unit_of(field.name)}]" for field in fields(Metrics)]
    heads += [
        "noise floor [deg/h]",
        "outside training [share]",
        "samples used",
        "samples left out",
        "bias relative to",
    ]
    writer.table_sheet("Figures", heads, rows, (26, 13)).freeze_panes(1, 1)


def _findings(writer: Writer, judgement: Judgement) -> None:
    rows = []
    for run in (*judgement.train, *judgement.test):
        rows += [(run.run, *told) for told in noticed(run.findings)]
        rows += [(run.run, "note", note, "") for note in run.notes]
    rows += [("", "note", str(note), "") for note in (*judgement.notes, *judgement.model.get("notes", ()))]
    writer.table_sheet("Findings and notes", ("run", "code", "message", "place"), rows, (22, 22, 100, 28))


def _averages(writer: Writer, name: str, run: RunJudgement) -> None:
    sheet = writer.sheet(name)
    count = min(len(run.series.time), _MOST_ROWS)
    for column, (key, head) in enumerate(_SERIES):
        sheet.write_string(0, column, head, writer.bold)
        values = getattr(run.series, key)[:count].tolist()
        if all(
            isinstance(value, int) or (isinstance(value, float) and math.isfinite(value)) for value in values
        ):
            sheet.write_column(1, column, values)
        else:
            for row, value in enumerate(values, start=1):
                writer.cell(sheet, row, column, value)
    sheet.set_column(0, len(_SERIES) - 1, 13)
    sheet.freeze_panes(1, 1)
    _chart(writer, sheet, run.series, count)


def _chart(writer: Writer, sheet: Worksheet, series: AveragedSeries, count: int) -> None:
    """Before and after against time, beside the columns that they are drawn from."""
    chart = writer.workbook.add_chart({"type": "scatter", "subtype": "straight"})
    keys = [key for key, _ in _SERIES]
    for key, colour, dash in (("before", "#3B4048", "dash"), ("after", "#009E73", "solid")):
        chart.add_series(
            {
                "name": [sheet.get_name(), 0, keys.index(key)],
                "categories": [sheet.get_name(), 1, 0, count, 0],
                "values": [sheet.get_name(), 1, keys.index(key), count, keys.index(key)],
                "line": {"color": colour, "width": 1.25, "dash_type": dash},
            }
        )
    chart.set_x_axis({"name": "time [s]", "min": float(series.time[0]), "label_position": "low"})
    chart.set_y_axis({"name": "drift [deg/h]"})
    chart.set_legend({"position": "bottom"})
    chart.set_size({"width": 720, "height": 360})
    sheet.insert_chart(1, len(_SERIES) + 1, chart)
