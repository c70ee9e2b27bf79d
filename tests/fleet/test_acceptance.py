"""Acceptance as a fleet's job: each unit's report, the batch of all, done once."""

from __future__ import annotations

import json
import re
from pathlib import Path
from urllib.parse import unquote

import openpyxl
import pytest
from click.testing import CliRunner

from fogml.cli.main import app
from tests.fleet.units import write_run

UNITS = {"FOG 1#a": 0.0, "FOG-2": 0.0, "FOG-3": 0.05}
"""Serial number and slope of its drift [deg/h/degC]."""


def command(*words: object) -> tuple[int, str]:
    """Exit status and output of a command."""
    done = CliRunner().invoke(app, [*map(str, words)])
    return done.exit_code, done.output


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three units, the second with a model; a fourth has no run."""
    folder = tmp_path_factory.mktemp("acceptance")
    lines = ["unit,job,train,test,axis"]
    for place, (name, slope) in enumerate(UNITS.items()):
        for part, seed in (("a", 2 * place), ("b", 2 * place + 1)):
            write_run(folder / f"{place}{part}.csv", f"'{name}'", seed, slope=slope, cycles=1.0, rows=300)
        lines.append(f"{name},acceptance,{f'{place}a.csv' if place == 1 else ''},{place}b.csv,x")
    lines.append("FOG-4,acceptance,,none.csv,x")
    (folder / "lot.csv").write_text("\n".join(lines) + "\n")
    (folder / "limits.yaml").write_text("limits: {temperature_sensitivity: 0.01, bias_stability: 0.5}\n")
    code, told = command(
        *("fleet", folder / "lot.csv", "--model", "polynomial", "--features", "T, dT"),
        *("--acceptance-limits", folder / "limits.yaml", "-o", folder / "out"),
    )
    assert code == 1 and "FOG-4 x: " in told
    return folder


def test_a_unit_s_report_is_that_of_the_command(fleet: Path) -> None:
    values = json.loads((fleet / "out" / "fleet.json").read_text())
    assert values["counts"] == {"done": 3, "failed": 1}
    folder = fleet / "out" / values["units"][0]["folder"]
    command(
        *("lab", "acceptance", fleet / "0b.csv", "--limits", fleet / "limits.yaml", "-o", fleet / "alone"),
    )
    alone = json.loads((fleet / "alone" / "acceptance.json").read_text())
    assert json.loads((folder / "acceptance.json").read_text()) == alone
    assert (folder / "acceptance.xlsx").exists() and (folder / "acceptance.html").exists()


def test_the_batch_holds_every_unit_with_its_page(fleet: Path) -> None:
    out = fleet / "out"
    batch = json.loads((out / "batch.json").read_text())
    assert {unit["serial_number"] for unit in batch["units"]} == set(UNITS)
    assert batch["without_report"] == ["FOG-4 x"] and "FOG-4 x" in (out / "batch.html").read_text()
    found = {unit["serial_number"]: unit for unit in batch["units"]}
    for page in ("batch.html", "fleet.html"):
        links = re.findall(r'<a href="([^"]+)"', (out / page).read_text())
        assert [link for link in links if not (out / unquote(link)).is_file()] == []
        assert len([link for link in links if link.endswith("/acceptance.html")]) == len(UNITS)
    sheet = openpyxl.load_workbook(out / "batch.xlsx").worksheets[0]
    assert sheet.max_row > len(UNITS)
    reports = {
        name: json.loads((out / unquote(unit["page"])).with_suffix(".json").read_text())
        for name, unit in found.items()
    }
    assert reports["FOG-2"]["model"] is not None and reports["FOG-3"]["model"] is None
    # The model takes out what the temperature's rate drives; without one it stays.
    (stability,) = (row for row in reports["FOG-2"]["rows"] if row["quantity"] == "bias_stability")
    assert stability["after"] < 0.1 * stability["before"]


def verdicts(out: Path) -> dict[str, str]:
    """Verdict of each unit of the batch."""
    units = json.loads((out / "batch.json").read_text())["units"]
    return {unit["serial_number"]: unit["verdict"] for unit in units}


def test_what_is_done_is_done_once_and_new_limits_judge_again(fleet: Path) -> None:
    out = fleet / "out"
    words = ("fleet", fleet / "lot.csv", "--model", "polynomial", "--features", "T, dT")
    words = (*words, "--acceptance-limits", fleet / "limits.yaml", "-o", out)
    before = {path: path.stat().st_mtime_ns for path in out.glob("*/acceptance.json")}
    assert len(before) == 3
    command(*words)
    assert {path: path.stat().st_mtime_ns for path in before} == before
    first = verdicts(out)
    (fleet / "limits.yaml").write_text("limits: {bias_stability: 1e-6}\n")
    command(*words)
    assert set(verdicts(out).values()) == {"rejected"} and verdicts(out) != first
