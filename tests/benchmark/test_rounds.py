"""Rounds of the open benchmark: nothing leaks, what is bound is held, and scores are those of the house."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from fogml.benchmark.answers import answer_by, entry_name, entry_plan, read_drift, write_drift
from fogml.benchmark.make import DriftCase, make_round, write_round
from fogml.benchmark.rounds import RoundDesign, TrackFolder
from fogml.benchmark.score import DriftMark, _told_unknown, drift_figures, geometric_mean, score_round
from fogml.blind.folders import case_files
from fogml.blind.run import case_stamp, run_cases
from fogml.blind.scoring.answers import NAMED
from fogml.cli.main import app
from fogml.errors import InputError
from fogml.models.names import make_model
from fogml.runs.reading import read_run
from fogml.runs.run import Run
from tests.blind.suites import HandMade, make_suite

AVERAGING_S = 100.0
CUBIC = (1.0, 0.05, 0.0, 1e-5)


def chamber_run(name: str, seed: int, ends: tuple[float, ...]) -> Run:
    """A gyro whose drift is a cubic in T, with white noise."""
    time = np.arange(0.0, 7200.0, 5.0)
    T = np.interp(time, np.linspace(0.0, 7200.0, len(ends)), ends)
    noise = np.random.default_rng(seed).normal(0.0, 0.05, len(time))
    return Run.from_columns(name, time=time, gyro=np.polynomial.polynomial.polyval(T, CUBIC) + noise, T=T)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A round of one drift case and one diagnosis case, answered by a cubic, and by hand."""
    home = tmp_path_factory.mktemp("round")
    train = (chamber_run("a", 1, (20.0, -20.0, 60.0)), chamber_run("b", 2, (60.0, -20.0, 30.0)))
    case = DriftCase("own", "unit 1", train, chamber_run("c", 3, (0.0, 50.0, 0.0)), AVERAGING_S)
    thermal = {"thermal_hysteresis": (0.5, {"half_width": 10.0})}
    suite = make_suite(home / "suite", [HandMade("one", thermal)])
    write_round(home / "round", [case], suite, 5)
    cubic = TrackFolder(home / "round", "drift").answers("cubic") / "0001"
    quiet = TrackFolder(home / "round", "diagnosis").answers("quiet") / "0001"
    for folder in (cubic, quiet):
        folder.mkdir(parents=True)
    answer_by(
        make_model("polynomial", "T^1..3"), case_files(home / "round" / "handout" / "drift" / "0001"), cubic
    )
    (quiet / "gap.json").write_text('{"verdict": "no_gap", "unknown": {"probability": 0.0}, "which": []}')
    return home / "round"


def test_what_is_handed_out_tells_no_answer(made: Path) -> None:
    handed = read_run(made / "handout" / "drift" / "0001" / "held-out-1.csv")
    kept = read_run(made / "kept" / "drift" / "0001" / "held-out-1.csv")
    assert not handed.gyro.any() and kept.gyro.std() > 0.5
    np.testing.assert_array_equal(handed.columns["T"], kept.columns["T"])
    names = {path.name for path in (made / "handout").rglob("*")}
    assert not names & {"key.json", "0001.json", "0001.npz", "SHA256SUMS"}
    key = json.loads((made / "kept" / "key.json").read_text())
    handout = "".join(path.read_text() for path in (made / "handout").rglob("*") if path.is_file())
    assert key["salt"] not in handout


def test_the_drift_score_is_that_of_averages_by_hand(made: Path) -> None:
    values = score_round(made)
    told = values["drift"]["cubic"]["cases"][0]
    kept = read_run(made / "kept" / "drift" / "0001" / "held-out-1.csv")
    answer = read_drift(made / "entries" / "cubic" / "drift" / "0001", len(kept))
    train = [chamber_run("a", 1, (20.0, -20.0, 60.0)), chamber_run("b", 2, (60.0, -20.0, 30.0))]
    mean = np.mean([run.gyro.mean() for run in train])
    settled = kept.time >= RoundDesign().settling_s

    def rms(left: np.ndarray) -> float:
        rows = left[settled]
        width = round(AVERAGING_S / 5.0)
        averaged = rows[: len(rows) // width * width].reshape(-1, width).mean(axis=1)
        return float(np.sqrt(np.mean(averaged**2)))

    assert answer.drift is not None
    assert told["after"] == pytest.approx(rms(kept.gyro - answer.drift), rel=0.02)
    assert told["nothing"] == pytest.approx(rms(kept.gyro - mean), rel=0.02)
    # White noise alone is left: 0.05 over the root of 20 samples an average.
    assert told["after"] == pytest.approx(0.05 / np.sqrt(20.0), rel=0.4)
    figures = values["drift"]["cubic"]["figures"]["all"]
    assert figures["ratio"]["value"] == pytest.approx(told["after"] / told["nothing"])
    assert figures["harmful"]["value"] == 0.0 and figures["bytes"] == 32.0
    assert 0.5 < figures["coverage"]["value"] <= 1.0


def test_the_diagnosis_score_tells_who_names_nothing(made: Path) -> None:
    figures = score_round(made, ["quiet"])["diagnosis"]["quiet"]["figures"]["all"]
    assert figures["found"]["value"] == 0.0 and figures["found"]["n"] == 1
    assert figures["mass_on_true"]["value"] == 0.0
    assert figures["false"]["value"] is None


def test_a_failed_case_counts_as_doing_nothing(made: Path) -> None:
    for track in ("drift", "diagnosis"):
        broken = TrackFolder(made, track).answers("broken") / "0001"
        broken.mkdir(parents=True)
        (broken / "outcome.json").write_text('{"done": false, "reason": "error", "message": "no fit"}')
    values = score_round(made, ["broken"])
    told = values["drift"]["broken"]
    assert told["figures"]["all"]["ratio"]["value"] == 1.0 and told["figures"]["all"]["failed"] == 1
    assert told["cases"][0]["failure"] == "error: no fit"
    assert values["diagnosis"]["broken"]["figures"]["all"]["false"]["value"] == 1.0


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("nan", r"column 'drift \[deg/h\]', row 3: 'nan', expected a finite number"),
        ("one", r"row 3: 'one', expected a finite number"),
        ("1,-2", r"column 'half_width \[deg/h\]', row 3: '-2', expected a finite number, not below 0"),
        ("1e300", r"row 3: '1e300', expected a finite number, its size below 1e\+100"),
        ("1,2,3", r"row 3: 3 cells, expected"),
    ],
)
def test_an_answer_that_is_no_number_is_refused(tmp_path: Path, row: str, message: str) -> None:
    header = "drift [deg/h],half_width [deg/h]" if "," in row else "drift [deg/h]"
    sound = "1,1" if "," in row else "1"
    (tmp_path / "drift.csv").write_text(f"{header}\n{sound}\n{row}\n{sound}\n")
    with pytest.raises(InputError, match=message):
        read_drift(tmp_path, 3)


def test_an_entry_that_lacks_a_case_or_rows_is_refused(made: Path) -> None:
    short = TrackFolder(made, "drift").answers("short") / "0001"
    short.parent.mkdir(parents=True)
    with pytest.raises(InputError, match=r"0001.drift\.csv: no such file; every case needs an answer"):
        score_round(made, ["short"])
    short.mkdir()
    write_drift(short, np.zeros(7))
    with pytest.raises(InputError, match="7 rows below the header, expected 1440"):
        score_round(made, ["short"])
    (TrackFolder(made, "diagnosis").answers("short") / "0001").mkdir(parents=True)
    (short.parent / "0001" / "drift.csv").unlink()
    write_drift(short, np.zeros(1440))
    with pytest.raises(InputError, match=r"every case needs a sound gap\.json"):
        score_round(made, ["short"])
    with pytest.raises(InputError, match="no such entry"):
        score_round(made, ["nobody"])


def test_an_answer_that_was_changed_after_it_was_bound_is_refused(made: Path, tmp_path: Path) -> None:
    other = shutil.copytree(made, tmp_path / "other")
    path = other / "kept" / "drift" / "0001" / "held-out-1.csv"
    path.write_text(path.read_text() + "\n")
    with pytest.raises(InputError, match=r"is not the answer that round\.json binds"):
        score_round(other)
    (other / "kept" / "key.json").unlink()
    with pytest.raises(InputError, match="only who keeps a round's answers can score it"):
        score_round(other)


@pytest.mark.parametrize(
    ("file", "message"),
    [
        ("handout/drift/0001/fit-1.csv", "0001: holds other files than round.json binds"),
        ("handout/drift/0001/held-out-1.yaml", "0001: holds other files than round.json binds"),
        ("handout/diagnosis/0001/held-out-1.csv", "0001: holds other files than round.json binds"),
        ("kept/drift/0001/held-out-1.yaml", "held-out-1.yaml: is not .*as it was made"),
    ],
)
def test_no_file_that_a_score_reads_can_be_changed_unseen(
    made: Path, tmp_path: Path, file: str, message: str
) -> None:
    """An offset in a training run would make doing nothing worse, another latitude move the reference."""
    path = shutil.copytree(made, tmp_path / "other") / file
    path.write_text((path.read_text() if path.exists() else "") + "latitude: 60.0\ninput_axis: up\n")
    with pytest.raises(InputError, match=message):
        score_round(tmp_path / "other")


def test_a_closed_round_states_no_seed_and_hashes_by_a_salt_of_its_own(tmp_path: Path) -> None:
    suite = make_suite(tmp_path / "suite", [HandMade("nothing")])
    case = DriftCase("own", "1", (chamber_run("a", 1, (0.0, 9.0)),), chamber_run("b", 2, (9.0, 0.0)), 100.0)
    closed = [write_round(tmp_path / name, [case], suite, 5, closed=True) for name in ("a", "b")]
    opened = [write_round(tmp_path / name, [case], suite, 5) for name in ("c", "d")]
    assert closed[0]["seed"] is None and opened[0] == opened[1]
    hashes = {told["tracks"]["drift"]["0001"]["answer_sha256"] for told in (*closed, *opened)}
    assert len(hashes) == 3
    with pytest.raises(InputError, match="holds a round already"):
        make_round(tmp_path / "a")


def test_a_closed_round_is_made_and_scored_by_its_keeper(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The whole command, so some seconds: a unit of each track is drawn."""
    monkeypatch.setattr("fogml.benchmark.make.secrets.randbits", lambda bits: 2**bits - 59)
    told = make_round(tmp_path / "round", closed=True, drift=1, diagnosis=1, real=False, workers=1)
    assert told["closed"] and told["seed"] is None
    seed = json.loads((tmp_path / "round" / "kept" / "key.json").read_text())["seed"]
    handout = (path for path in (tmp_path / "round" / "handout").rglob("*") if path.is_file())
    assert not any(str(seed) in path.read_text() for path in handout)
    answers = TrackFolder(tmp_path / "round", "diagnosis").answers("quiet") / "0001"
    answers.mkdir(parents=True)
    (answers / "gap.json").write_text('{"verdict": "no_gap"}')
    figures = score_round(tmp_path / "round")["diagnosis"]["quiet"]["figures"]["all"]
    assert figures["cases"] == 1 and figures["failed"] == 0


def test_the_commands_answer_and_score(made: Path, tmp_path: Path) -> None:
    runner = CliRunner()
    ran = runner.invoke(app, ["benchmark", "run", str(made), "--method", "mean", "--workers", "1", "--json"])
    assert ran.exit_code == 0, ran.output
    assert json.loads(ran.stdout) == {"mean": {"answered": 1, "failed": 0}}
    entries = ["--entry", "mean", "--entry", "cubic", "--entry", "quiet"]
    scored = runner.invoke(app, ["benchmark", "score", str(made), *entries, "-o", str(tmp_path), "--json"])
    assert scored.exit_code == 0, scored.output
    values = json.loads((tmp_path / "score.json").read_text())
    assert values == json.loads(scored.stdout)
    assert values["drift"]["mean"]["figures"]["all"]["ratio"]["value"] == pytest.approx(1.0)
    page = (tmp_path / "score.html").read_text()
    assert "cubic leaves the least of the drift" in page and "Rules" in page
    wrong = runner.invoke(app, ["benchmark", "run", str(made), "--method", "polynomail"])
    assert wrong.exit_code == 2 and "did you mean" in wrong.output


def test_names_and_means() -> None:
    assert entry_name("sklearn.svm.SVR") == "SVR" and entry_name("mine.one:gru") == "gru"
    found = geometric_mean([0.5, 2.0])
    assert found.value == pytest.approx(1.0) and found.n == 2
    # Of answers one of which is the truth itself; each rms over nothing stays a number.
    assert geometric_mean([0.0, 2.0]).value == 0.0


def test_an_answer_to_a_case_that_is_another_one_by_now_is_not_scored(made: Path, tmp_path: Path) -> None:
    home = shutil.copytree(made, tmp_path / "round")
    drift = TrackFolder(home, "drift")
    shutil.rmtree(home / "entries")
    assert run_cases(entry_plan(home, "drift", "mean")) == (1, 0)
    assert score_round(home, ["mean"])["drift"]["mean"]["figures"]["all"]["failed"] == 0
    outcome = drift.answers("mean") / "0001" / "outcome.json"
    told = json.loads(outcome.read_text())
    (key,) = (key for key, value in told.items() if value == case_stamp(drift.cases / "0001"))
    outcome.write_text(json.dumps({**told, key: "0" * 64}))
    with pytest.raises(InputError, match="answers other files than"):
        score_round(home, ["mean"])


@pytest.mark.parametrize(
    ("unknown", "wrong", "told"), [(NAMED, "", True), (NAMED, "lag", False), (0.4, "", False)]
)
def test_what_is_named_is_called_unknown_from_the_same_probability_on(unknown, wrong, told):
    assert _told_unknown(SimpleNamespace(unknown=unknown, wrong_name=wrong)) is told


def test_a_method_that_fails_says_why_at_once(made: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("def bent(case, out):\n    raise ValueError('no such bend')\n")
    command = ["benchmark", "run", str(made), "--method", "mine:bent", "--code", str(tmp_path)]
    ran = CliRunner().invoke(app, [*command, "--workers", "1"])
    assert ran.exit_code == 0, ran.output
    assert "1 failed" in ran.output and "case 0001: ValueError: no such bend" in ran.output


def test_an_interval_of_a_share_ends_at_one():
    shares = np.array([1.0, 0.9, 1.0])
    marks = [DriftMark(str(i), "own", 1.0, 0.5, 0.1, share, 0.2, None) for i, share in enumerate(shares)]
    told = drift_figures(marks)["all"]["coverage"]
    half = 4.302653 * shares.std(ddof=1) / np.sqrt(3)
    assert told["value"] == pytest.approx(shares.mean())
    assert told["low"] == pytest.approx(shares.mean() - half) and told["high"] == 1.0 < shares.mean() + half


def test_an_answer_that_a_spreadsheet_saved_is_read(tmp_path):
    (tmp_path / "drift.csv").write_text("drift [deg/h]\n0.5\n0.25\n", encoding="utf-8-sig")
    assert read_drift(tmp_path, 2).drift.tolist() == [0.5, 0.25]
