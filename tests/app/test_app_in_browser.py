"""The app in a browser: from files to firmware past a bad file, two pages and a killed server; 200 units."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.app.running import Running
from tests.cli.conftest import csv_text, write_runs
from tests.report.chromium import CHROMIUM, Browser, Opened

pytest.importorskip("tornado")
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"no Chromium at {CHROMIUM}"),
]
LAYOUT = (Path(__file__).parents[1] / "report" / "layout.js").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    one = Browser(tmp_path_factory.mktemp("browser") / "profile")
    yield one
    one.close()


def wait(page: Opened, condition: str) -> None:
    """Wait until a condition holds in a page."""
    ends = time.monotonic() + 120.0
    while not page.tell(f"Boolean({condition})"):
        assert time.monotonic() < ends, (condition, page.tell("document.body.innerText"))
        time.sleep(0.05)


def click(page: Opened, selector: str) -> None:
    """Click what a selector finds, once it is there and may be clicked."""
    found = f"document.querySelector({selector!r})"
    wait(page, f"{found} && !{found}.disabled")
    page.tell(f"{found}.click()")


def choose(page: Opened, *files: Path) -> None:
    """Choose files from the disk, as the browser's own window does."""
    root = page.ask("DOM.getDocument")["root"]["nodeId"]
    node = page.ask("DOM.querySelector", nodeId=root, selector="#pick")["nodeId"]
    page.ask("DOM.setFileInputFiles", nodeId=node, files=[str(path) for path in files])


def run_it(page: Opened, command: str, **inputs: list[str]) -> str:
    """Choose a command and its files, and run it; the line that stands beside it."""
    click(page, f"[data-command={command}]")
    for key, names in inputs.items():
        for name in names:
            click(page, f'[data-key={key}][data-file="{name}"]')
    marks = [f"files/{name}" for names in inputs.values() for name in names]
    held = " && ".join(f"document.getElementById('line').textContent.includes({mark!r})" for mark in marks)
    wait(
        page, f"document.getElementById('line').textContent.startsWith('fogml {command}') && {held or 'true'}"
    )
    line: str = page.tell("document.getElementById('line').textContent")
    click(page, "#run")
    return line


def job(page: Opened, name: str, state: str) -> None:
    """Wait for a job's state, and until what it said is shown."""
    wait(page, f"document.querySelector('[data-job=\"{name}\"][data-state={state}]')")


def test_from_files_to_firmware_past_a_bad_file_and_a_killed_server(browser: Browser, tmp_path: Path) -> None:
    first, second = write_runs(tmp_path)
    bad = tmp_path / "bad <b>.csv"
    bad.write_text("time [s],gyro [deg/h],T [degC]\n0,1,20\n1,what,20\n")
    app = Running(tmp_path / "lab")
    page = browser.open_at(app.address)
    wait(page, "document.querySelector('[data-command=inspect]')")
    assert "token" not in page.tell("location.href")
    choose(page, *sorted(tmp_path.glob("*.csv")), *sorted(tmp_path.glob("*.yaml")))
    wait(page, "document.querySelectorAll('#files tbody tr').length === 5")

    # A bad file is one message, on any page, and no markup.
    other = browser.open_at(app.address)
    run_it(page, "inspect", runs=[bad.name])
    job(other, "0001", "refused")
    click(other, '[data-job="0001"] summary')
    wait(other, "document.querySelector('[data-job=\"0001\"] pre.bad')")
    assert "line 3" in other.tell("document.querySelector('pre.bad').textContent")
    assert not page.tell("document.querySelector('#files td.name b, .job code b')")
    click(page, f'[data-key=runs][data-file="{bad.name}"]')

    # The server is killed while a job runs: the job goes on, and is found again.
    click(page, "[data-command=train]")
    page.tell(
        "(function () { var field = document.querySelector('#settings [data-key=model]');"
        " field.value = 'polynomial'; field.dispatchEvent(new Event('input')); })()"
    )
    wait(page, "document.getElementById('line').textContent.includes('--model=polynomial')")
    line = run_it(page, "train", runs=[first.name], test=[second.name])
    assert line == "fogml train files/a.csv --test files/b.csv --model=polynomial --out jobs/NEW/results"
    job(page, "0002", "running")
    app.kill()
    wait(page, "document.getElementById('fault').textContent.includes('Jobs go on')")
    app = Running(tmp_path / "lab")
    page = browser.open_at(app.address)
    job(page, "0002", "done")

    click(page, "[data-command=export]")
    wait(page, "document.querySelector('#choices select option:nth-child(2)')")
    page.tell(
        "(function () { var list = document.querySelector('#choices select'); list.selectedIndex = 1;"
        " list.dispatchEvent(new Event('change')); })()"
    )
    wait(page, "document.getElementById('line').textContent.includes('export jobs/0002/results/model')")
    click(page, "#run")
    job(page, "0003", "done")
    wait(page, "document.querySelector('[data-job=\"0003\"] .results a')")
    names = page.tell(
        "[...document.querySelectorAll('[data-job=\"0003\"] .results a')].map((a) => a.textContent)"
    )
    assert "fogml_model.c" in names
    # The page of a result: drawn, and of an origin that cannot ask the server.
    click(page, '[data-job="0002"] summary')
    wait(page, "document.querySelector('[data-job=\"0002\"] .results a.page')")
    opened = browser.open_at(page.tell("document.querySelector('[data-job=\"0002\"] .results a.page').href"))
    wait(opened, "document.querySelector('[data-drawn]')")
    assert opened.tell("self.origin") == "null"
    assert not opened.console
    for paper in (False, True):
        page.on_paper(paper)
        assert not page.tell(f"({LAYOUT})({str(paper).lower()})"), paper
    app.kill()


def pick(page: Opened, key: str, value: str) -> None:
    """Choose from a list, once it holds the value."""
    field = f"document.querySelector('#choices select[data-key={key}], #settings select[data-key={key}]')"
    wait(page, f"{field} && [...{field}.options].some((one) => one.value === {value!r})")
    page.tell(f"{field}.value = {value!r}; {field}.dispatchEvent(new Event('change'))")
    wait(page, f"document.getElementById('line').textContent.includes({value!r})")


def switch_off(page: Opened, key: str) -> None:
    """Untick a setting that is ticked."""
    page.tell(f"document.querySelector('#settings input[data-key={key}]').click()")
    wait(page, f"document.getElementById('line').textContent.includes('--no-{key.replace('_', '-')}')")


def test_from_a_logger_s_file_to_a_diagnosis_and_a_fleet(browser: Browser, tmp_path: Path) -> None:
    """What is imported is a run as any other; a table of units finds the runs beside it."""
    write_runs(tmp_path)
    rows = csv_text(2).splitlines()[1:]
    (tmp_path / "log.csv").write_text("Timestamp;Rate;Temp\n" + "\n".join(rows).replace(",", ";") + "\n")
    (tmp_path / "logger.yaml").write_text(
        "schema: fogml.import/1\ndescription: one axis\nseparator: semicolon\nsignature: Temp\ncolumns:\n"
        "  time: {source: Timestamp, unit: s}\n  gyro: {unit: deg/h}\n  T: {source: Temp, unit: degC}\n"
        "axes: {x: Rate}\nfacts: {unit: FOG-1}\n"
    )
    table = "unit,job,train,test,axis\nFOG-1,train,a.csv,b.csv,x\nFOG-1,diagnose,a.csv,b.csv,x\n"
    (tmp_path / "line.csv").write_text(table)
    app = Running(tmp_path / "lab")
    page = browser.open_at(app.address)
    wait(page, "document.querySelector('[data-command=import]')")
    choose(page, *sorted(tmp_path.glob("*.csv")), *sorted(tmp_path.glob("*.yaml")))
    wait(page, "document.querySelectorAll('#files tbody tr').length === 7")
    click(page, "[data-command=import]")
    pick(page, "profile", "files/logger.yaml")
    run_it(page, "import", file=["log.csv"])
    job(page, "0001", "done")
    imported = "jobs/0001/results/log-x.csv"
    wait(page, f"document.querySelector('[data-file=\"{imported}\"]')")

    click(page, "[data-command=diagnose]")
    switch_off(page, "next_run")
    click(page, f'[data-key=held_out][data-file="{imported}"]')
    line = run_it(page, "diagnose", runs=["a.csv"])
    assert f"--held-out {imported}" in line
    job(page, "0002", "done")
    names = "[...document.querySelectorAll('[data-job=\"0002\"] .results a')].map((a) => a.textContent)"
    wait(page, f"{names}.includes('gap.html')")

    click(page, "[data-command=fleet]")
    pick(page, "manifest", "files/line.csv")
    switch_off(page, "next_run")
    run_it(page, "fleet")
    wait(page, "document.querySelector('[data-job=\"0003\"][data-state=done]')")
    wait(page, "document.querySelector('[data-job=\"0003\"] .results a.page')")
    assert not page.tell(f"({LAYOUT})(false)")
    assert not page.console
    app.kill()


def test_two_hundred_units_are_found_and_chosen(browser: Browser, tmp_path: Path) -> None:
    files = tmp_path / "lab" / "files"
    files.mkdir(parents=True)
    (files / "FOG-000.csv").write_text(csv_text(0, rows=300))
    for place in range(1, 200):
        shutil.copy(files / "FOG-000.csv", files / f"FOG-{place:03d}.csv")
    app = Running(tmp_path / "lab")
    page = browser.open_at(app.address)
    wait(page, "document.querySelectorAll('#files tbody tr').length === 200")
    assert not page.tell(f"({LAYOUT})(false)")
    page.tell(
        "(function () { var filter = document.getElementById('filter'); filter.value = 'fog-19';"
        " filter.dispatchEvent(new Event('input')); })()"
    )
    wait(page, "document.getElementById('count').textContent === '10 of 200 files'")
    click(page, "[data-all=runs]")
    wait(page, "(document.getElementById('line').textContent.match(/FOG-19/g) || []).length === 10")
    page.tell(
        "(function () { var filter = document.getElementById('filter'); filter.value = '';"
        " filter.dispatchEvent(new Event('input')); })()"
    )
    click(page, "[data-all=runs]")
    wait(page, "(document.getElementById('line').textContent.match(/FOG-/g) || []).length === 200")
    assert not page.console
    app.kill()


def test_a_file_that_was_chosen_and_is_removed_is_chosen_no_more(browser: Browser, tmp_path: Path) -> None:
    """Its mark is gone with its name, so that it could not be taken off."""
    files = tmp_path / "lab" / "files"
    files.mkdir(parents=True)
    for name in ("a.csv", "b.csv", "own.yaml"):
        (files / name).write_text(csv_text(0, rows=300))
    app = Running(tmp_path / "lab")
    page = browser.open_at(app.address)
    click(page, "[data-command=import]")
    pick(page, "profile", "files/own.yaml")
    click(page, "[data-command=inspect]")
    for name in ("a.csv", "b.csv"):
        click(page, f'[data-key=runs][data-file="{name}"]')
    wait(page, "document.getElementById('line').textContent.includes('files/a.csv files/b.csv')")
    for name in ("a.csv", "own.yaml"):
        assert app.ask("DELETE", f"/api/files/{name}")[0] == 200
    wait(
        page,
        "document.getElementById('line').textContent === 'fogml inspect files/b.csv --out jobs/NEW/results'",
    )
    click(page, "[data-command=import]")
    wait(page, "!document.getElementById('line').textContent.includes('own.yaml')")
    assert not page.console
    app.kill()
