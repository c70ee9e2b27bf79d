"""The fleet that is killed: what is compared, and what the page of scale says of it."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import pytest

from experiments.benchmarks.fleet_run import make_units, results
from experiments.benchmarks.scale import found_in, scale_page
from fogml.fleet.manifest import read_manifest
from fogml.json_files import write_json
from fogml.runs.reading import read_run

RESULTS: dict[str, Any] = {
    "machine": {"processor": "one", "date": "today"},
    "jobs": [{"name": "write-parquet-1e7-pyarrow", "ours_s": {"median": 1.0}, "quick": False}],
}
FLEET: dict[str, Any] = {
    "schema": "fogml.fleet_run/1",
    "version": "0.2.0",
    "date": "2026-11-26",
    "units": 500,
    "files": 4000,
    "differ": [],
    "done": 500,
    "core_s": {"killed": 700.0, "alone": 600.0},
    "killed": {"kills": {"worker": 8}, "starts": 9, "ends": {"-9": 8, "0": 1}, "partial": []},
}


def written(folder: Path, when: str, text: str) -> dict[str, str]:
    """Results of a fleet: a page that names its folder, and a workbook that names its time."""
    (folder / "U000").mkdir(parents=True)
    (folder / "U000" / "train.config.yaml").write_text(f"out: {folder}\ntext: {text}\n")
    with zipfile.ZipFile(folder / "fleet.xlsx", "w") as book:
        book.writestr("docProps/core.xml", when)
        book.writestr("xl/workbook.xml", text)
    return results(folder)


def test_folders_and_hours_do_not_differ_and_all_else_does(tmp_path: Path) -> None:
    first = written(tmp_path / "a" / "killed", "noon", "same")
    second = written(tmp_path / "a" / "alone", "one o'clock", "same")
    other = written(tmp_path / "a" / "third", "noon", "other")
    assert first == second
    assert {name for name in first if first[name] != other[name]} == set(first)


def test_each_unit_has_a_run_to_train_on_and_another_to_judge_on(tmp_path: Path) -> None:
    units = read_manifest(make_units(tmp_path, 2))
    assert [unit.name for unit in units] == ["U000", "U001"]
    runs = [read_run(path) for unit in units for path in (*unit.train, *unit.test)]
    assert [run.facts.unit for run in runs] == ["U000", "U000", "U001", "U001"]
    assert len({run.gyro.tobytes() for run in runs}) == 4


@pytest.mark.parametrize(
    ("differ", "words"),
    [([], "are the same, bit for bit"), (["U1/report.json"], "**1 of 4,000 files differ**")],
)
def test_the_page_of_scale_tells_of_the_run(tmp_path: Path, differ: list[str], words: str) -> None:
    assert found_in(tmp_path, "fleet_run.json") is None
    write_json(tmp_path / "fleet_run.json", FLEET | {"differ": differ})
    page = scale_page(RESULTS, fleet=found_in(tmp_path, "fleet_run.json"))
    assert words in page and "500 of 500 units done" in page and "8 × worker" in page
    # 600 core-seconds of 500 units are 1.2 of each, and 3.3 core-hours of 10,000.
    assert "1.2 core-seconds a unit" in page and "3.3 core-hours" in page
    assert "A real run" not in scale_page(RESULTS)


def test_the_page_of_scale_tells_what_a_cluster_and_a_database_cost(tmp_path: Path) -> None:
    told = {
        "schema": "fogml.scale_costs/1",
        "version": "0.2.0",
        "date": "2026-11-27",
        "fleet": {
            "units": 40,
            "processes": {"wall_s": 20.0, "core_s": 40.0},
            "dask": {"wall_s": 30.0, "core_s": 60.0},
        },
        "sweep": {
            "trials": 60,
            "journal": {"wall_s": 6.0, "core_s": 12.0},
            "database": {"wall_s": 9.0, "core_s": 18.0},
        },
        "store": {
            "held": 20_000,
            "folder": {"add_s": 0.9, "read_s": 0.4},
            "database": {"add_s": 0.018, "read_s": 0.2},
        },
    }
    page = scale_page(RESULTS, shared=told)
    assert "| a unit of a fleet | two processes | 1 | 0.5 | Dask, two workers | 1.5 | 0.75 |" in page
    assert "| a trial of a sweep | journal file | 0.2 | 0.1 | PostgreSQL | 0.3 | 0.15 |" in page
    # 20,000 runs a month of 0.9 s are 5 h, of 0.018 s 0.1 h.
    assert "take 5 h in a folder of that size and 0.1 h in PostgreSQL" in page
    assert "cluster" not in scale_page(RESULTS).split("## Cost drivers")[0]
