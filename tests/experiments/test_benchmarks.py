"""The benchmarks' harness is right and their pairs agree; how fast they are is not tested here."""

from __future__ import annotations

import itertools
import json
import sys
import time
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from experiments.benchmarks import command_jobs, harness, run  # noqa: E402
from experiments.benchmarks.harness import Job, Ran, Timed, Work, measure, run_python  # noqa: E402
from experiments.benchmarks.jobs import JOBS  # noqa: E402
from experiments.benchmarks.pages import results_page  # noqa: E402


def job(work: Work, **limits: float) -> Job:
    return Job("made", "a made-up job", "ours", "plain", lambda quick, folder: work, **limits)


def agree(a: object, b: object) -> str:
    assert a == b
    return "equal"


def test_sides_alternate_after_one_run_that_does_not_count(tmp_path: Path):
    calls: list[str] = []
    ours = iter([99.0, 1.0, 4.0, 2.0, 5.0, 3.0])
    plain = iter([99.0, 10.0, 8.0, 40.0, 50.0, 30.0])

    def timed(name: str, times: object) -> Timed:
        calls.append(name)
        return Timed(next(times), "same")

    work = Work(lambda: timed("a", ours), lambda: timed("b", plain), agree)
    got = measure(job(work), tmp_path)
    assert "".join(calls) == "ab" + "abbaabbaab"
    assert got["ours_s"] == {
        "median": 3.0,
        "least": 1.0,
        "greatest": 5.0,
        "all": [1.0, 4.0, 2.0, 5.0, 3.0],
    }
    # Of the pairs: 10, 2, 20, 10, 10.
    assert got["ratio"]["median"] == 10.0
    assert got["ratio"]["least"] == 2.0


def test_time_is_that_of_the_call(tmp_path: Path):
    work = Work(lambda: time.sleep(0.03), lambda: time.sleep(0.09), agree)
    got = measure(job(work), tmp_path)
    # A busy machine only makes it longer.
    assert 0.03 <= got["ours_s"]["least"] < 0.09 <= got["plain_s"]["least"]
    assert got["ratio"]["median"] > 1.2


def test_limits_are_held_against_the_figures(tmp_path: Path):
    work = Work(lambda: Timed(2.0), lambda: Timed(6.0), agree)
    got = measure(job(work, limit_s=1.5, least_ratio=3.0), tmp_path)
    assert {held["quantity"]: held["met"] for held in got["held"]} == {"seconds": False, "ratio": True}
    memory = Work(lambda: Timed(2.0, None, 900.0), lambda: Timed(6.0), agree)
    got = measure(job(memory, limit_mb=800.0, memory=True), tmp_path)
    assert got["peak_mb"] == 900.0
    assert [held["met"] for held in got["held"]] == [False]
    assert measure(job(work, limit_s=1.5), tmp_path, quick=True)["held"] == []


def test_results_that_differ_stop_the_measurement(tmp_path: Path):
    with pytest.raises(AssertionError):
        measure(job(Work(lambda: 1, lambda: 2, agree)), tmp_path)


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the system keeps no high-water mark")
def test_memory_of_a_process_is_its_own_greatest():
    ballast = np.ones(40_000_000)  # 320 MB here must not count there
    small = run_python(["-c", "import time; time.sleep(0.3)"], watch_memory=True)
    large = run_python(
        ["-c", "import time; x = bytearray(300_000_000); time.sleep(0.3); del x; time.sleep(0.1)"],
        watch_memory=True,
    )
    assert small.peak_mb < 60 < 290 < large.peak_mb < 400
    assert small.seconds >= 0.3
    assert len(ballast)
    with pytest.raises(RuntimeError, match="exit 3"):
        run_python(["-c", "raise SystemExit(3)"])


@pytest.mark.parametrize("name", [each.name for each in JOBS])
def test_each_job_agrees_with_the_plain_way(name: str, tmp_path: Path):
    chosen = next(each for each in JOBS if each.name == name)
    if chosen.missing():
        pytest.skip(chosen.missing() or "")
    work = chosen.prepare(True, tmp_path)
    ours, plain = work.ours(), work.plain()
    told = work.check(*(side.value if isinstance(side, Timed) else side for side in (ours, plain)))
    assert told


def test_command_writes_results_and_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    status = run.main(["--quick", "--only", "allan-octaves", "--repeats", "1", "--out", str(tmp_path)])
    assert status == 0
    results = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert results["schema"] == "fogml.benchmarks/1"
    assert {"processor", "cores", "python", "versions", "date"} <= set(results["machine"])
    assert results["command"] == "python -m experiments.benchmarks --quick --only allan-octaves"
    assert results["jobs"][0]["peak_mb"] > 30
    page = (tmp_path / "results.md").read_text(encoding="utf-8")
    assert page == results_page(results)
    assert "Allan deviation" in page and capsys.readouterr().out.strip() == page.strip()


def test_what_is_missing_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setenv("GNSS_INS_SIM", str(tmp_path / "nowhere"))
    status = run.main(["--quick", "--only", "gauss-markov", "--repeats", "1", "--out", str(tmp_path)])
    assert status == 0
    (left,) = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))["skipped"]
    assert left["name"] == "gauss-markov" and "nowhere" in left["reason"]
    assert left["reason"] in capsys.readouterr().out


def test_a_job_measured_on_its_own_takes_its_place_among_the_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    # What a process of its own takes is told elsewhere; no two of these take the same.
    seconds = itertools.count(1)
    monkeypatch.setattr(command_jobs, "run_python", lambda words: Ran(f"{next(seconds)}", 1.0, 0.0))
    monkeypatch.setattr(harness, "run_python", lambda words: Ran('{"peak_mb": 100.0}', 1.0, 0.0))

    def quick(*names: str, merge: bool = True) -> dict:
        only = [word for name in names for word in ("--only", name)]
        words = ["--quick", *only, "--repeats", "1", "--out", str(tmp_path), *(["--merge"] if merge else [])]
        assert run.main(words) == 0
        return json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))

    with pytest.raises(SystemExit):
        quick("import")
    assert "holds no results" in capsys.readouterr().err
    first = quick("allan-octaves", "import", merge=False)
    both = quick("csv")
    assert [job["name"] for job in both["jobs"]] == ["csv", "allan-octaves", "import"]
    assert [both["jobs"][i] for i in (1, 2)] == first["jobs"]
    again = quick("csv", "import")
    assert [entry["jobs"] for entry in again["merged"]] == [["csv", "import"]]
    assert again["jobs"][1] == first["jobs"][0] and again["jobs"][2] != first["jobs"][1]
    page = (tmp_path / "results.md").read_text(encoding="utf-8")
    assert "`python -m experiments.benchmarks --quick --merge --only NAME`" in page
    assert ": csv, import." in page
    foreign = {**again, "machine": {**again["machine"], "processor": "another"}}
    (tmp_path / "results.json").write_text(json.dumps(foreign), encoding="utf-8")
    mixed = quick("import")
    assert mixed["machine"]["processor"] == "another"
    page = (tmp_path / "results.md").read_text(encoding="utf-8")
    rows = [line for line in page.splitlines() if line.startswith("| ")]
    assert any("import fogml (B)" in row for row in rows)
    assert any("octaves (A)" in row for row in rows)
    assert "A: another" in page and f"B: {first['machine']['processor']}" in page


@pytest.mark.parametrize(
    "arguments", [["--only", "nonsense"], ["--repeats", "3"], ["--quick", "--merge", "--only", "import"]]
)
def test_bad_usage(arguments: list[str], capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit) as stopped:
        run.main(arguments)
    assert stopped.value.code == 2
    assert "error:" in capsys.readouterr().err
