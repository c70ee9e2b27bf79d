"""Sealed processes: what they can't reach, and what becomes of those that fail."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import fogml
from fogml.blind.folders import BlindFolder
from fogml.blind.methods import code_state, load_method
from fogml.blind.run import RunPlan, check_answers_to, check_out_of_reach, run_cases
from fogml.blind.worker import _KERNELS, own_roots
from fogml.cli.blind import RunSettings
from fogml.cli.blind_job import run_and_tell
from fogml.cli.terminal import Terminal
from fogml.errors import InputError

CHEAT = """
import ctypes, json, os, shutil, socket, subprocess
from pathlib import Path

import fogml

SEEN = []

def ways(truth):
    link = Path("link")
    yield "open", lambda: open(truth / "0001.json").read()
    yield "os.open", lambda: os.open(truth / "0001.json", os.O_RDONLY)
    yield "listdir", lambda: os.listdir(truth)
    yield "scandir", lambda: list(os.scandir(truth))
    yield "above", lambda: os.listdir(truth.parent)
    yield "chdir", lambda: os.chdir(truth)
    yield "link", lambda: (link.symlink_to(truth / "0001.json"), link.read_text())
    yield "hard link", lambda: os.link(truth / "0001.json", "hard")
    yield "by way of /proc", lambda: open(f"/proc/self/root{truth}/0001.json").read()
    yield "parent's folder", lambda: os.listdir(f"/proc/{os.getppid()}/cwd")
    yield "system", lambda: os.system(f"cat {truth}/0001.json")
    yield "child", lambda: subprocess.run(["cat", truth / "0001.json"])
    yield "fork", lambda: os.fork()
    own = Path(fogml.__file__).parent
    yield "write to the package", lambda: (own / "blind/zz_written.txt").write_text("x")
    yield "write where compiled code is kept", lambda: (own / "blind/__pycache__/zz.pyc").write_text("x")
    yield "change of the package", lambda: os.utime(own / "blind/run.py")
    yield "memory of all", lambda: Path("/dev/shm/zz_written").write_text("x")
    yield "parent's environment", lambda: open(f"/proc/{os.getppid()}/environ").read()
    yield "connect", lambda: socket.create_connection(("127.0.0.1", 9), 1.0)
    yield "listen", lambda: socket.socket().bind(("127.0.0.1", 0))
    yield "datagram", lambda: socket.socket(type=socket.SOCK_DGRAM).sendto(b"x", ("127.0.0.1", 9))

def below_python(truth):
    library = ctypes.CDLL(None, use_errno=True)
    return library.open(str(truth / "0001.json").encode(), 0)

def peek(case, out):
    # The test tells where the truth lies; the runner does not.
    truth = Path((Path(__file__).parent / "where.txt").read_text())
    told = {}
    for name, way in ways(truth):
        try:
            told[name] = f"reached: {way()!r}"
        except PermissionError:
            told[name] = "refused"
    told["arguments"] = " ".join([*__import__("sys").argv, *os.environ.values(), os.getcwd()])
    told["below"] = below_python(truth)
    told["own file"] = case.fit[0].read_text()[:4]
    (out / "gap.json").write_text(json.dumps(told))

def links(case, out):
    # To what the keeper could read, by a call below Python.
    elsewhere = (Path(__file__).parent / "where.txt").read_text()
    ctypes.CDLL(None).symlink(f"{elsewhere}/0001.json".encode(), str(out / "gap.json").encode())
    ctypes.CDLL(None).symlink(elsewhere.encode(), str(out / "more").encode())

def remembers(case, out):
    SEEN.append(case.name)
    (out / "gap.json").write_text(json.dumps(SEEN))

def said(text):
    for descriptor in range(3, 20):
        try:
            os.write(descriptor, text)
        except OSError:
            pass

def strays(case, out):
    (out / "gap.json").write_text("{}")
    if case.name == "0001":
        os.mkfifo(out / "pipe")
        (out / "outcome.json").mkdir()
    if case.name == "0002":
        shutil.rmtree(out)
        shutil.rmtree(case.fit[0].parent)
    if case.name == "0003":
        said(b"nothing\\n")
    if case.name == "0004":
        said(b"[1]\\n")
    if case.name == "0005":
        said(b'{"done": true}\\n')

def ends(case, out):
    if case.name == "0002":
        os._exit(7)
    if case.name == "0003":
        raise ValueError("no such luck")
    if case.name == "0004":
        return
    if case.name == "0005":
        __import__("time").sleep(60)
    (out / "gap.json").write_text("{}")
"""


@pytest.fixture
def folder(tmp_path: Path) -> BlindFolder:
    suite = BlindFolder(tmp_path / "suite")
    for number in range(1, 7):
        case = suite.cases / f"{number:04d}"
        case.mkdir(parents=True)
        (case / "fit-1.csv").write_text("time [s],gyro [deg/h],T [degC]\n0,1,2\n1,1,2\n")
    suite.truth.mkdir()
    (suite.truth / "0001.json").write_text("secret")
    code = tmp_path / "code"
    code.mkdir()
    (code / "cheat.py").write_text(CHEAT)
    (code / "where.txt").write_text(str(suite.truth))
    return suite


def outcome(plan: RunPlan, name: str) -> dict[str, object]:
    values: dict[str, object] = json.loads((plan.answers / name / "outcome.json").read_text())
    return values


def test_a_sealed_process_cannot_reach_the_truth(folder: BlindFolder, tmp_path: Path) -> None:
    code = tmp_path / "code"
    plan = RunPlan(folder, "cheat:peek", name="cheat", code=code, only=("0001",))
    assert run_cases(plan) == (1, 0), outcome(plan, "0001")
    told = json.loads((plan.answers / "0001" / "gap.json").read_text())
    assert str(folder.path) not in told.pop("arguments")
    assert told.pop("own file") == "time"
    below = told.pop("below")
    if outcome(plan, "0001")["sealed_by"] == "landlock and audit":
        assert below < 0
    assert set(told.values()) == {"refused"}, told


def test_a_keeper_follows_no_link_of_a_method(folder: BlindFolder, tmp_path: Path) -> None:
    plan = RunPlan(folder, "cheat:links", name="links", code=tmp_path / "code", only=("0001",))
    assert run_cases(plan) == (1, 1)
    assert outcome(plan, "0001")["reason"] == "no answer"
    assert [path.name for path in (plan.answers / "0001").iterdir()] == ["outcome.json"]


def test_each_case_of_anyones_method_has_a_process_of_its_own(folder: BlindFolder, tmp_path: Path) -> None:
    plan = RunPlan(folder, "cheat:remembers", name="all", code=tmp_path / "code", only=("0001", "0002"))
    assert run_cases(plan) == (2, 0)
    for name in plan.only or ():
        assert json.loads((plan.answers / name / "gap.json").read_text()) == [name]


def test_what_a_method_leaves_or_says_ends_no_other_case(folder: BlindFolder, tmp_path: Path) -> None:
    plan = RunPlan(folder, "cheat:strays", name="strays", code=tmp_path / "code", workers=2)
    assert run_cases(plan) == (6, 4)
    assert [path.name for path in sorted((plan.answers / "0001").iterdir())] == ["gap.json", "outcome.json"]
    assert outcome(plan, "0001")["done"] is True and outcome(plan, "0006")["done"] is True
    assert outcome(plan, "0002")["reason"] == "no answer"
    for name, told in (("0003", "nothing"), ("0004", "[1]"), ("0005", '{"done": true}')):
        assert outcome(plan, name)["reason"] == "crashed"
        assert outcome(plan, name)["message"] == f"it said what is no answer: {told}"


def test_failures_are_recorded_and_the_rest_goes_on(folder: BlindFolder, tmp_path: Path) -> None:
    code = tmp_path / "code"
    plan = RunPlan(folder, "cheat:ends", name="ends", code=code, limit_s=2.0, workers=2)
    done: list[str] = []
    assert run_cases(plan, done.append) == (6, 4)
    assert sorted(done) == list(folder.names())
    reasons = {name: outcome(plan, name)["reason"] for name in folder.names()}
    assert reasons == {
        "0001": None,
        "0002": "crashed",
        "0003": "error",
        "0004": "no answer",
        "0005": "timed out",
        "0006": None,
    }
    assert "status 7" in str(outcome(plan, "0002")["message"])
    assert outcome(plan, "0001")["samples"] == 2
    # Everything has an outcome: nothing is left but what is to be tried again.
    assert plan.left() == ()
    again = RunPlan(folder, "cheat:ends", name="ends", code=code, retry=True)
    assert again.left() == ("0002", "0003", "0004", "0005")


def test_workers_run_the_package_that_starts_them(tmp_path: Path) -> None:
    own = Path(fogml.__file__).parent
    shutil.copytree(own, tmp_path / "fogml", ignore=shutil.ignore_patterns("__pycache__", "recordings"))
    changed = tmp_path / "fogml/gap/diagnosis.py"
    changed.write_text(changed.read_text() + "\n# another state\n")
    script = "from fogml.blind.pool import Worker; w = Worker('abstain'); print(w.code); w.end()"
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    told = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert told.stdout.strip() == code_state("abstain", package=tmp_path / "fogml"), told.stderr
    assert told.stdout.strip() != code_state("abstain")


def test_answers_of_code_that_changed_meanwhile_are_refused(
    folder: BlindFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fogml.blind.run.code_state", lambda *_: "0" * 16)
    plan = RunPlan(folder, "cheat:ends", code=tmp_path / "code", only=("0001",))
    with pytest.raises(InputError, match=r"sources .* changed while cases were answered"):
        run_cases(plan)
    assert plan.left() == ("0001",)


def test_a_case_that_has_changed_is_answered_again(folder: BlindFolder, tmp_path: Path) -> None:
    plan = RunPlan(folder, "cheat:ends", code=tmp_path / "code", only=("0001", "0006"))
    assert run_cases(plan) == (2, 0)
    assert plan.left() == ()
    side = folder.cases / "0006" / "fit-1.yml"
    side.write_text("latitude: 39.9\n")
    assert plan.left() == ("0006",)
    check_answers_to(plan.answers / "0001", folder.cases / "0001")
    with pytest.raises(InputError, match="answers other files than"):
        check_answers_to(plan.answers / "0006", folder.cases / "0006")
    assert run_cases(plan) == (1, 0)
    check_answers_to(plan.answers / "0006", folder.cases / "0006")
    assert plan.left() == ()


def test_shards_share_the_cases(folder: BlindFolder) -> None:
    parts = [RunPlan(folder, "abstain", shard=(i, 4)).left() for i in (1, 2, 3, 4)]
    assert sorted(name for part in parts for name in part) == list(folder.names())
    with pytest.raises(InputError, match="i/n"):
        RunPlan(folder, "abstain", shard=(5, 4))


@pytest.mark.parametrize("name", ["", ".", "..", "../other", "a/b", "/tmp/x"])
def test_answers_lie_in_the_suite_whatever_they_are_called(folder: BlindFolder, name: str) -> None:
    with pytest.raises(InputError, match="no path"):
        RunPlan(folder, "abstain", name=name)


def test_a_truth_among_readable_folders_is_refused(folder: BlindFolder) -> None:
    check_out_of_reach(RunPlan(folder, "abstain"))
    with pytest.raises(InputError, match="move the suite"):
        check_out_of_reach(RunPlan(BlindFolder(own_roots()[0] / "suite"), "abstain"))
    with pytest.raises(InputError, match="move the suite"):
        check_out_of_reach(RunPlan(folder, "cheat:peek", code=folder.path))


def test_a_method_that_does_not_load_is_said_at_once(folder: BlindFolder) -> None:
    with pytest.raises(InputError, match="did not start"):
        run_cases(RunPlan(folder, "nowhere:nothing"))


def test_a_name_of_no_method_is_said_as_such(folder: BlindFolder) -> None:
    with pytest.raises(InputError, match=r"^no method 'diagnosi'; .*did you mean 'diagnosis'"):
        run_cases(RunPlan(folder, "diagnosi"))


def test_the_cost_of_a_false_name_is_asked_of_the_diagnosis_alone(folder: BlindFolder) -> None:
    settings = RunSettings(directory=str(folder.path), methods=["abstain"], cost_of_false_name=3.0)
    with pytest.raises(InputError, match="no method but 'diagnosis' takes it"):
        run_and_tell(settings, Terminal())


def test_a_method_that_is_the_diagnosis_itself_is_said_to_be() -> None:
    with pytest.raises(InputError, match="it is what 'diagnosis' does"):
        load_method("families")


def test_what_is_compiled_is_loaded_before_a_process_is_shut_in() -> None:
    package = Path(fogml.__file__).parent
    made = {path for path in package.rglob("*.py") if "fogml.signals.compiled import" in path.read_text()}
    named = {f"fogml.{'.'.join(path.relative_to(package).with_suffix('').parts)}" for path in made}
    assert set(_KERNELS) == named
