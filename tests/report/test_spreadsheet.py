"""``report.xlsx``, read back by another library: the numbers of the judgement, as numbers."""

from __future__ import annotations

import re
import zipfile
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest

from fogml.errors import InputError
from fogml.report.spreadsheet import spreadsheet
from fogml.report.spreadsheets import fleet_spreadsheet
from fogml.runs.findings import Finding
from fogml.validation.results import Judgement, Metrics
from tests.report.judgements import judged_run, judgement, linear_judgement
from tests.report.many_units import fleet_values


def sheets(judged: Judgement, folder: Path) -> dict[str, list[tuple[Any, ...]]]:
    path = folder / "report.xlsx"
    spreadsheet(judged, path)
    workbook = openpyxl.load_workbook(path)
    return {sheet.title: list(sheet.iter_rows(values_only=True)) for sheet in workbook.worksheets}


def test_figures_before_and_after_of_every_run(tmp_path: Path) -> None:
    judged = judgement(2)
    rows = sheets(judged, tmp_path)["Figures"]
    assert len(rows) == 1 + 2 * 3
    head, first = rows[0], rows[2]
    assert first[:3] == ("b.csv", "test", "after")
    for offset, field in enumerate(fields(Metrics)):
        assert first[6 + offset] == pytest.approx(getattr(judged.test[0].after, field.name))
        assert head[6 + offset] is not None and "[" in head[6 + offset]
    assert first[head.index("noise floor [deg/h]")] == judged.test[0].floor


def test_averages_of_every_run_with_a_chart(tmp_path: Path) -> None:
    judged = judgement(2)
    found = sheets(judged, tmp_path)
    rows = found["test 2 c.csv"]
    assert rows[0][:3] == ("time [s]", "T [degC]", "dT [degC/min]")
    after = [row[rows[0].index("after [deg/h]")] for row in rows[1:]]
    assert np.allclose(np.array(after, dtype=float), judged.test[1].series.after, rtol=1e-14)
    assert [row[rows[0].index("regime")] for row in rows[1:]] == judged.test[1].series.regime.tolist()
    assert "train 1 a.csv" in found
    workbook = openpyxl.load_workbook(tmp_path / "report.xlsx")
    for told in (*judged.train, *judged.test):
        (sheet,) = [sheet for sheet in workbook.worksheets if sheet.title.endswith(told.run)]
        (chart,) = sheet._charts
        assert len(chart.series) == 2
        for drawn, name in zip(chart.series, ("before", "after"), strict=True):
            assert cells(workbook, drawn.tx.strRef.f) == [f"{name} [deg/h]"]
            for at, values in ((drawn.xVal, told.series.time), (drawn.yVal, getattr(told.series, name))):
                np.testing.assert_allclose(cells(workbook, at.numRef.f), values, rtol=1e-14)


def cells(workbook: openpyxl.Workbook, reference: str) -> list[Any]:
    """What stands in a range that a chart is drawn from."""
    sheet, _, span = reference.rpartition("!")
    found = workbook[sheet.strip("'")][span]
    return [row[0].value for row in found] if isinstance(found, tuple) else [found.value]


def test_the_summary_states_verdict_and_limits(tmp_path: Path) -> None:
    rows = sheets(judgement(limit=0.001), tmp_path)["Summary"]
    text = " ".join(str(cell) for row in rows for cell in row if cell is not None)
    assert "FOG-0417, axis x: rbf on b.csv" in text and "leaves" in text
    assert ("Design index (largest rms)", 0.001) in [row[:2] for row in rows]
    assert "no" in [row[4] for row in rows]


def test_coefficients_where_the_model_is_linear(tmp_path: Path) -> None:
    rows = sheets(linear_judgement(), tmp_path)["Coefficients"]
    assert rows[1:] == [("1", 0.1, 0.001), ("T", 0.004, 0.0001), ("dT", 0.4, 0.002)]
    assert "Coefficients" not in sheets(judgement(), tmp_path)


def test_findings_and_notes(tmp_path: Path) -> None:
    finding = Finding("gap", "378 gaps", "time", 12, 378)
    rows = sheets(judgement(findings=(finding,), notes=("MEMS unit",)), tmp_path)["Findings and notes"]
    assert ("b.csv", "gap", "378 gaps", "column time, from row 12") in rows
    assert ("b.csv", "note", "MEMS unit", None) in rows


def test_names_of_runs_turn_into_neither_formulas_nor_broken_sheets(tmp_path: Path) -> None:
    names = ["=1+1", "a[1]/b?.csv", "x" * 60, "x" * 61]
    judged = replace(judgement(), test=tuple(judged_run(name, n=60) for name in names))
    found = sheets(judged, tmp_path)
    assert found["Figures"][1][0] == "=1+1"
    workbook = openpyxl.load_workbook(tmp_path / "report.xlsx")
    assert workbook["Figures"]["A2"].data_type == "s"
    assert len(found) == 3 + 5
    assert all(len(name) <= 31 for name in found)


def test_a_fleet_s_sheets_name_units_and_tell_limits_only_where_some_are_stated(tmp_path: Path) -> None:
    fleet = fleet_values()
    fleet["constants"] = {**fleet["constants"], "distance": [1.0] * len(fleet["constants"]["units"])}
    assert {unit["met"] for unit in fleet["units"]} >= {True}
    for stated, told in (({}, set()), ({"design_index": 0.05}, {"yes", "no"})):
        fleet_spreadsheet({**fleet, "settings": stated}, tmp_path / "fleet.xlsx")
        book = openpyxl.load_workbook(tmp_path / "fleet.xlsx")
        rows = list(book["Units"].iter_rows(values_only=True))
        assert {row[rows[0].index("limits met")] for row in rows[1:]} - {None} == told
    heads = [cell.value for cell in book["Constants"][1]]
    assert heads[1:3] == ["1 [deg/h]", "T [deg/h per its unit]"]
    assert all("[" in head for head in heads if head not in ("unit", "distance"))


def test_missing_values_are_empty_cells(tmp_path: Path) -> None:
    run = judged_run(n=60)
    series = replace(run.series, temperature=np.full(60, np.nan))
    rows = sheets(replace(judgement(), test=(replace(run, series=series),)), tmp_path)["test 1 b.csv"]
    assert [row[1] for row in rows[1:]] == [None] * 60


def test_nothing_is_left_where_it_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such folder"):
        spreadsheet(judgement(), tmp_path / "missing" / "report.xlsx")
    assert list(tmp_path.iterdir()) == []


def test_the_same_results_are_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one.xlsx", "two.xlsx"):
        spreadsheet(judgement(2), tmp_path / name)
    assert (tmp_path / "one.xlsx").read_bytes() == (tmp_path / "two.xlsx").read_bytes()
    with zipfile.ZipFile(tmp_path / "one.xlsx") as archive:
        assert set(re.findall(rb"20\d\d-\d\d-\d\dT", archive.read("docProps/core.xml"))) == set()


def test_an_interrupt_leaves_no_temporary_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(packager: Any) -> None:
        raise KeyboardInterrupt

    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    monkeypatch.setattr("xlsxwriter.packager.Packager._write_root_rels_file", interrupted)
    with pytest.raises(KeyboardInterrupt):
        spreadsheet(judgement(1), tmp_path / "report.xlsx")
    assert not list((tmp_path / "tmp").iterdir()) and not list(tmp_path.glob("*.xlsx"))
