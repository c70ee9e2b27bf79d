"""A batch of acceptance reports: yield, distribution, links, order."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from click.testing import CliRunner

from fogml.cli.main import app
from fogml.errors import InputError
from fogml.lab.acceptance_rows import QUANTITIES
from fogml.lab.batch import batch_json, read_reports, report_files
from fogml.numerals import in_order_of_serial
from fogml.report.acceptance_page import batch_page, distribution_table, verdict_sentences
from fogml.report.spreadsheets import batch_spreadsheet

SERIAL = "FOG-70-A-2026-BATCH-17-OF-THE-SECOND-LINE-{:04d}"
LIMIT = {"from": -0.05, "to": 0.05}


def report(place: int, bias: float | None, runs: int = 1) -> dict:
    """An acceptance report of a unit with a bias and a limit on it."""
    rows = []
    for quantity in QUANTITIES:
        tested = quantity.key == "bias" and bias is not None
        limit = LIMIT if quantity.key == "bias" else None
        rows.append(
            {
                "quantity": quantity.key,
                "name": quantity.name,
                "ieee_952": quantity.ieee_952,
                "clause": quantity.clause or None,
                "gjb_2426a": quantity.gjb_2426a or None,
                "unit": quantity.unit,
                "tested": tested,
                "before": bias if tested else None,
                "after": None,
                "of": "cycle.csv" if tested else None,
                "remark": "" if tested else f"not tested: needs {quantity.needs}",
                "limit": limit,
                "met": abs(bias) <= 0.05 if tested and limit and bias is not None else None,
            }
        )
    verdict = "incomplete" if bias is None else "accepted" if abs(bias) <= 0.05 else "rejected"
    soaks = [
        {
            "run": "cycle.csv",
            "temperature_degC": float(t),
            **{
                when: {"start": None, "up": 0.01 * t, "down": 0.011 * t, "hysteresis": 0.001 * t}
                for when in ("before", "after")
            },
        }
        for t in (-40, 25, 70)
    ]
    run = {"started": "2026-03-02T08:00:00+00:00", "span_h": 14.0}
    more = {"temperature_degC": [-40.0, 70.0], "outside_training": 0.0}
    return {
        "schema": "fogml.acceptance/1",
        "serial_number": SERIAL.format(place),
        "axis": "z",
        "date": None,
        "synthetic": True,
        "averaging_s": 100.0,
        "runs": [
            {"run": f"{SERIAL.format(place)}-run-{i}.csv", "sha256": f"{place:032x}{i:032x}", **run, **more}
            for i in range(runs)
        ],
        "model": None,
        "limits": {"file": "limits.yaml", "sha256": "ab" * 32, "customer": "ACME", "document": None},
        "soaks": soaks,
        "rows": rows,
        "verdict": verdict,
        "reasons": [verdict],
        "notes": [],
    }


@pytest.fixture
def folders(tmp_path):
    """Reports of ten units, one of which is rejected and one incomplete."""
    biases = [0.01, -0.02, 0.03, 0.09, 0.0, 0.02, 0.01, None, -0.01, 0.04]
    for place, bias in enumerate(biases, start=1):
        folder = tmp_path / f"unit{place}"
        folder.mkdir()
        (folder / "acceptance.json").write_text(json.dumps(report(place, bias)))
    return sorted(tmp_path.glob("unit*"))


def test_yield_distribution_and_order(folders, tmp_path):
    values = batch_json(read_reports(folders), tmp_path / "batch")
    assert values["counts"] == {"rejected": 1, "incomplete": 1, "no_limits": 0, "accepted": 8}
    found = values["yield"]
    assert (found["share"], found["judged"]) == (8 / 9, 9)
    # Clopper and Pearson: at the lower end, 8 or more of 9 come up in 5 % of the cases.
    low, high = found["ci90"]
    assert 9 * low**8 * (1 - low) + low**9 == pytest.approx(0.05) and high < 1.0
    assert 1.0 - high**9 == pytest.approx(0.05)
    (bias,) = values["quantities"]
    sizes = np.abs([0.01, -0.02, 0.03, 0.09, 0.0, 0.02, 0.01, -0.01, 0.04])
    shares = {"least": 0, "q10": 10, "median": 50, "q90": 90, "largest": 100}
    assert bias["distribution"] == pytest.approx({k: np.percentile(sizes, v) for k, v in shares.items()})
    assert (bias["over"], bias["tested"], bias["limit"]) == (1, 9, LIMIT)
    names = [unit["serial_number"][-4:] for unit in values["units"]]
    assert names[:2] == ["0004", "0008"] and names[2:] == sorted(names[2:])
    assert values["units"][0]["page"] == "../unit4/acceptance.html"


def test_figures_that_are_bounds_and_limits_that_differ_are_told_as_such(tmp_path):
    reports = [(Path(f"{place}.json"), report(place, bias)) for place, bias in enumerate((0.01, 0.02))]
    for place, (_, told) in enumerate(reports):
        (row,) = (row for row in told["rows"] if row["quantity"] == "bias")
        row |= {"at_most": True, "limit": {"from": -0.1 - place, "to": 0.1 + place}}
    values = batch_json(reports)
    (cells,) = (row.cells for row in distribution_table(values).rows)
    assert cells[3:8] == ("≤ 0.0100", "≤ 0.0110", "≤ 0.0150", "≤ 0.0190", "≤ 0.0200")
    assert cells[8] == "they differ"
    assert "≤ 0.0200" in batch_page(values)
    (bias,) = values["quantities"]
    bias |= {"limits_differ": False, "limit": {"from": -0.02, "to": 0.02}}
    bias["distribution"]["largest"] = 0.020001
    assert distribution_table(values).rows[0].cells[7:9] == ("≤ 0.020001", "± 0.02")
    batch_spreadsheet(values, tmp_path / "batch.xlsx")
    head, first, *_ = openpyxl.load_workbook(tmp_path / "batch.xlsx")["Units"].iter_rows(values_only=True)
    assert first[head.index("told as at most")] == "bias" and "told as at least" not in head
    sheet = openpyxl.load_workbook(tmp_path / "batch.xlsx")["Distribution"]
    head, first, *_ = sheet.iter_rows(values_only=True)
    assert (first[head.index("limit from")], first[head.index("limit to")]) == (-0.02, 0.02)


def test_units_without_a_report_are_told_and_not_in_the_yield():
    reports = [(Path("1.json"), report(1, 0.01))]
    values = batch_json(reports, lacking=["FOG-9 z"])
    assert values["without_report"] == ["FOG-9 z"] and values["yield"]["judged"] == 1
    assert "Without a report, and not in the yield: FOG-9 z." in verdict_sentences(values)
    assert not any("Without a report" in told for told in verdict_sentences(batch_json(reports)))


def test_recordings_that_stand_under_two_serial_numbers_are_told():
    """A copied file makes a unit that was never tested pass; a gyro has recordings of its own."""
    reports = [(Path(f"{place}.json"), report(place, 0.01, runs=2)) for place in (1, 2, 3)]
    assert batch_json(reports)["notes"] == []
    reports[2][1]["runs"][1]["sha256"] = reports[0][1]["runs"][0]["sha256"]
    values = batch_json(reports)
    (told,) = values["notes"]
    first, third = (f"{SERIAL.format(place)} z" for place in (1, 3))
    assert told.startswith(f"{first}, {third}: the same recordings") and SERIAL.format(2) not in told
    assert told in batch_page(values) and "synthetic data" in batch_page(values)


@pytest.mark.parametrize(
    ("other", "told"),
    [
        ({"averaging_s": 10.0}, "Averages are not the same for all units: 100 s, but 10 s for {}"),
        (
            {"model": {"kind": "mean"}},
            "Compensation is not the same for all units: none, but by a model for {}",
        ),
        ({"limits": None}, "Limits are not the same for all units: limits.yaml (abababab), but none for {}"),
    ],
)
def test_units_whose_reports_were_made_another_way_are_told(other, told):
    """Their figures, as of bias stability over 10 s and over 100 s, are no one distribution."""
    reports = [(Path(f"{place}.json"), report(place, 0.01)) for place in (1, 2, 3)]
    reports[1][1].update(other)
    (note,) = batch_json(reports)["notes"]
    assert note.startswith(told.format(f"{SERIAL.format(2)} z"))


def test_a_limit_that_only_some_units_have_is_not_the_batch_s():
    reports = [(Path(f"{place}.json"), report(place, 0.07)) for place in (1, 2)]
    for row in reports[1][1]["rows"]:
        row |= {"limit": None, "met": None}
    reports[1][1]["verdict"] = "no_limits"
    values = batch_json(reports)
    (bias,) = values["quantities"]
    assert (bias["limit"], bias["limits_differ"], bias["over"]) == (None, True, 1)
    assert "1 unit without limits: not in the yield." in verdict_sentences(values)
    assert "Units that miss a limit: bias (1)." in verdict_sentences(values)


def test_a_folder_stands_for_the_reports_in_its_own_folders(folders, tmp_path):
    (tmp_path / "triad" / "x").mkdir(parents=True)
    (tmp_path / "empty").mkdir()
    (folders[0] / "acceptance.json").rename(tmp_path / "triad" / "x" / "acceptance.json")
    files, lacking = report_files([tmp_path / "triad", folders[1], tmp_path / "empty"])
    assert files == [tmp_path / "triad" / "x" / "acceptance.json", folders[1] / "acceptance.json"]
    assert lacking == ["empty"]
    words = ["lab", "batch", files[0], tmp_path / "empty"]
    result = CliRunner().invoke(app, list(map(str, words)))
    assert result.exit_code == 1 and "Without a report, and not in the yield: empty." in result.stdout
    with pytest.raises(InputError, match=r"holds no acceptance\.json"):
        report_files([tmp_path / "empty"])


def test_a_unit_twice_and_a_file_of_another_kind_are_refused(folders, tmp_path):
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "acceptance.json").write_text(json.dumps(report(1, 0.0)))
    with pytest.raises(InputError, match="are both of"):
        read_reports([*folders, tmp_path / "more"])
    (tmp_path / "more" / "acceptance.json").write_text('{"schema": "fogml.train/1"}')
    with pytest.raises(InputError, match=r"expected 'fogml.acceptance/1'"):
        read_reports([tmp_path / "more"])


def test_command(folders, tmp_path):
    words = ["lab", "batch", *folders, "--title", "Lot 17", "-o", tmp_path / "batch"]
    result = CliRunner().invoke(app, list(map(str, words)))
    assert result.exit_code == 1
    assert "8 of 9 units accepted: a yield of 88.9 %" in result.stdout
    page = (tmp_path / "batch" / "batch.html").read_text()
    assert 'href="../unit4/acceptance.html"' in page and "Lot 17" in page
    sheet = openpyxl.load_workbook(tmp_path / "batch" / "batch.xlsx")["Units"]
    lines = list(sheet.iter_rows(min_row=2, values_only=True))
    assert len(lines) == 10 and lines[0][2] == "rejected"


@pytest.mark.parametrize(
    "damage",
    [{"serial_number": ["FOG"]}, {"rows": [{}]}, {"verdict": "good"}, {"reasons": None}, {"runs": [{}]}],
)
def test_a_damaged_report_is_named(tmp_path, damage):
    path = tmp_path / "acceptance.json"
    path.write_text(json.dumps({**report(1, 0.02), **damage}))
    with pytest.raises(InputError, match="parts of an acceptance report lack"):
        read_reports([path])


def test_serial_numbers_may_hold_any_digits():
    """A superscript two is a digit and no number; one of thousands of digits is longer than Python reads."""
    labels = ["FOG-10", "FOG-9²", "FOG-9", "FOG-" + "8" * 5000]
    assert sorted(labels, key=in_order_of_serial) == ["FOG-9", "FOG-9²", "FOG-10", labels[3]]
