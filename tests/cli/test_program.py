"""The program itself, as a process of its own: exit statuses, streams, signals, no traceback."""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from inspect import Parameter, signature
from pathlib import Path

import pytest

from fogml.cli.model_commands import CompareSettings, TrainSettings
from fogml.cli.twin_commands import DiagnoseSettings
from fogml.gap.diagnosis import diagnose
from fogml.outputs import whole_file, whole_folder
from fogml.validation.judge import judge
from tests.cli.conftest import csv_text

PROGRAM = [sys.executable, "-c", "from fogml.cli.main import main; main()"]


def run(*arguments: object, cwd=None):
    command = [*PROGRAM, *[str(argument) for argument in arguments]]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, cwd=cwd)


def test_an_unmet_limit_is_status_1_and_what_is_written_is_used(run_files, tmp_path, invoke):
    arguments = ("--model", "M1", "--limit", "rms=0.001", "-o", "out", "--json")
    found = run("train", "a.csv", "--test", "b.csv", *arguments, cwd=tmp_path)
    assert (found.returncode, found.stderr) == (1, "")
    report = json.loads(found.stdout)
    assert report["schema"] == "fogml.train/1" and not report["limits"][0]["met"]
    assert json.loads((tmp_path / "out" / "report.json").read_text()) == report
    assert (tmp_path / "out" / "certificate.html").exists()
    model = tmp_path / "out" / "model"
    found = invoke("compensate", tmp_path / "b.csv", "--model", model, "-o", tmp_path / "c.csv", "--quiet")
    assert (found.stdout, found.stderr) == ("", "")
    header = (tmp_path / "c.csv").read_text().split("\n", 1)[0]
    assert header == "time [s],gyro [deg/h],T [degC],drift [deg/h],gyro_compensated [deg/h],flag"


def test_bad_input_is_status_2_and_one_line(run_files, tmp_path, invoke, monkeypatch):
    (tmp_path / "bad.csv").write_bytes(bytes(range(256)) * 20)
    process = run("train", "bad.csv", "--test", "b.csv", "-o", "out", cwd=tmp_path)
    assert process.returncode == 2
    monkeypatch.chdir(tmp_path)
    here = [invoke("train", name, "--test", "b.csv", "-o", "out", status=2) for name in ("bad.csv", "no.csv")]
    assert process.stderr == here[0].stderr
    for found, name in zip((process, *here), ("bad.csv", "bad.csv", "no.csv"), strict=True):
        assert found.stdout == ""
        assert len(found.stderr.strip().splitlines()) == 1
        assert name in found.stderr
        assert not (tmp_path / "out").exists()


# Under a job in the background an interrupt is ignored from the start.
WAITING = """
import pathlib, signal, time
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)
import {module}

def wait(*words, **more):
    pathlib.Path("waiting").touch()
    time.sleep(60.0)

{module}.{function} = wait
from fogml.cli.main import main
main()
"""


@pytest.mark.parametrize(
    ("number", "status", "module", "function", "model"),
    [
        (signal.SIGINT, 130, "sklearn.svm", "SVR.fit", "sklearn.svm.SVR"),
        (signal.SIGTERM, 143, "fogml.cli.runs", "open_runs", "mean"),
        (signal.SIGHUP, 129, "fogml.cli.runs", "open_runs", "mean"),
    ],
    ids=["keyboard, in the fit", "end, while reading", "hang-up, while reading"],
)
def test_an_interrupt_leaves_nothing(run_files, tmp_path, number, status, module, function, model):
    arguments = ["train", "a.csv", "--test", "b.csv", "--model", model, "-o", "out"]
    process = subprocess.Popen(
        [sys.executable, "-c", WAITING.format(module=module, function=function), *arguments],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 60
    while not (tmp_path / "waiting").exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    os.kill(process.pid, number)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == status
    assert "Traceback" not in errors
    assert "interrupted: what is finished is kept, nothing is half written" in errors
    assert {path.name for path in tmp_path.iterdir()} == {"a.csv", "a.yaml", "b.csv", "b.yaml", "waiting"}


@pytest.mark.parametrize("words", ["inspect {run}", "effects --json", "--help"])
def test_a_closed_pipe_is_told_from_a_missed_limit(run_files, words):
    # By rich, by click, and before a command begins.
    command = shlex.join([*PROGRAM, *words.format(run=run_files[0]).split()])
    shell = command + " | true; exit ${PIPESTATUS[0]}"
    found = subprocess.run(["bash", "-c", shell], capture_output=True, text=True, timeout=120)
    assert (found.returncode, found.stderr) == (141, "")


@pytest.mark.parametrize(("closed", "status"), [(">&-", 0), ("<&- >&- 2>&- --nothing", 2)])
def test_standard_streams_that_are_closed(run_files, tmp_path, closed, status):
    command = shlex.join([*PROGRAM, "inspect", str(run_files[0])])
    found = subprocess.run(["bash", "-c", f"{command} {closed}"], timeout=120, cwd=tmp_path)
    assert found.returncode == status
    assert not list(tmp_path.glob("fogml-report*"))


@pytest.mark.parametrize("whole", [whole_file, whole_folder])
def test_an_interrupt_while_the_staging_folder_is_made_leaves_nothing(whole, tmp_path, monkeypatch):
    make = Path.mkdir

    def interrupted(path, *args, **more):
        make(path, *args, **more)
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "mkdir", interrupted)
    with pytest.raises(KeyboardInterrupt), whole(tmp_path / "out"):
        pass
    assert not list(tmp_path.iterdir())


def test_a_name_that_is_no_text_is_told_or_taken(run_files, tmp_path, invoke):
    named = os.fsdecode(bytes(tmp_path) + b"/a\xff.csv")
    os.rename(tmp_path / "a.csv", named)
    invoke("inspect", named)
    made = os.fsdecode(bytes(tmp_path) + b"/made\xff.csv")
    result = invoke("simulate", "--twin", "nominal", "--programme", "four-positions", "-o", made, status=2)
    assert len(result.stderr.splitlines()) == 1
    assert re.search(r"fogml: made\ufffd\S*: a name that is no text in UTF-8; rename", result.stderr)
    # A folder of results may have any name; running its settings again finds it.
    out = Path(os.fsdecode(bytes(tmp_path) + b"/out\xfe"))
    runs = (tmp_path / "b.csv", "--test", tmp_path / "b.csv", "--model", "M1")
    invoke("train", *runs, "--out", out)
    report = (out / "report.json").read_bytes()
    invoke("train", "--config", out / "train.config.yaml")
    assert (out / "report.json").read_bytes() == report
    assert {path.name for path in tmp_path.glob("*out*")} == {out.name}


def test_a_locale_of_ascii(tmp_path):
    (tmp_path / "a.csv").write_text(csv_text(0, rows=300))
    ascii_only = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii", "PYTHONCOERCECLOCALE": "0"}
    found = subprocess.run(
        [*PROGRAM, "noise", "a.csv", "-o", "out"],
        cwd=tmp_path,
        env={**os.environ, **ascii_only},
        capture_output=True,
        timeout=120,
    )
    assert found.returncode == 0, found.stderr
    assert found.stdout.isascii() and found.stderr.isascii()
    json.loads((tmp_path / "out" / "noise.json").read_text(encoding="utf-8"))
    card = subprocess.run(
        [*PROGRAM, "effects", "kerr"], env={**os.environ, **ascii_only}, capture_output=True, timeout=120
    )
    assert card.stdout.isascii() and b"10^-5 to" in card.stdout and b"??" not in card.stdout


@pytest.mark.parametrize(
    ("settings", "function"), [(DiagnoseSettings, diagnose), (TrainSettings, judge), (CompareSettings, judge)]
)
def test_a_command_takes_the_defaults_of_its_function(settings, function):
    stated = {name: one.default or None for name, one in settings.model_fields.items()}
    given = {name: one.default or None for name, one in signature(function).parameters.items()}
    shared = {name for name in stated.keys() & given.keys() if given[name] is not Parameter.empty}
    assert len(shared) > 3 and {n: stated[n] for n in shared} == {n: given[n] for n in shared}
