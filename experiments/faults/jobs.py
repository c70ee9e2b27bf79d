"""The jobs that are killed, what they read, and what they give."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from experiments.faults import world as sound
from experiments.faults.sandbox import Limits, Sandbox
from fogml.runs.writing import write_run


@dataclass(frozen=True)
class Job:
    """A command to kill.

    Attributes
    ----------
    command
        Arguments of ``fogml``.
    outputs
        What it writes: files and folders.
    units
        Folders that appear one by one; the rest only at the end.
    resumes
        Whether it goes on where it was.
    needs
        Sound files that it reads, by the beginning of their names.
    """

    command: tuple[str, ...]
    outputs: tuple[str, ...]
    units: str = ""
    resumes: bool = False
    needs: tuple[str, ...] = ("a.", "b.", "c.")


_FLEET = ("fleet", "units.csv", "--any-unit", "--model", "M2", "--averaging", "30", "-o", "out")
JOBS = {
    "train": Job(
        (
            "train",
            "a.csv",
            "--test",
            "b.csv",
            "--model",
            "polynomial",
            "--features",
            "T",
            "--averaging",
            "30",
            "-o",
            "out",
        ),
        ("out",),
    ),
    "compensate": Job(
        ("compensate", "long.csv", "--model", "trained/polynomial/model", "--any-unit", "-o", "y.csv"),
        ("y.csv", "y.yaml"),
        needs=("long.", "trained/polynomial/model/"),
    ),
    "simulate": Job(
        ("simulate", "simulation.yaml", "--sample", "0.1", "-o", "y.csv", "--truth", "z.csv"),
        ("y.csv", "y.yaml", "z.csv"),
        needs=("simulation.yaml",),
    ),
    "sweep": Job(
        ("sweep", "sweep.yaml", "--trials", "6"),
        ("swept",),
        resumes=True,
        needs=("a.", "b.", "c.", "sweep.yaml"),
    ),
    "fleet": Job(_FLEET, ("out",), "out/*", True, ("a.", "b.", "c.", "units.csv")),
    "fleet, 2 processes": Job(
        (*_FLEET, "--workers", "2"), ("out",), "out/*", True, ("a.", "b.", "c.", "units.csv")
    ),
    "diagnose": Job(("diagnose", "d.csv", "-o", "out"), ("out",), needs=("d.",)),
    "blind run": Job(
        ("blind", "run", "suite", "--method", "abstain", "--workers", "1"),
        ("suite/answers-abstain",),
        units="suite/answers-abstain/*",
        resumes=True,
        needs=("suite/cases/", "suite/truth/"),
    ),
}
"""The kinds of job that are killed."""


def sound_files(home: Path, names: Sequence[str]) -> dict[str, bytes]:
    """What the jobs read; each is run once here, so that its libraries are loaded and compiled."""
    quick = not {"sweep", "fleet", "fleet, 2 processes", "blind run"} & set(names)
    files = dict(sound.make_world(home / "sound", quick=quick))
    made = home / "made"
    made.mkdir()
    write_run(sound.run(0, rows=60_000), made / "long.csv")
    write_run(sound.run(0, rows=100), made / "d.csv")
    files |= {path.name: path.read_bytes() for path in made.iterdir()}
    lines = [f"F-{number},train,{'abc'[number % 3]}.csv,b.csv,x" for number in range(4) if number % 3 != 1]
    files["units.csv"] = "\n".join(["unit,job,train,test,axis", *lines]).encode() + b"\n"
    sandbox = Sandbox(home / "warm", Limits())
    was = Path.cwd()
    try:
        with sandbox.catching():
            for name in names:
                if name not in ("blind run", "fleet, 2 processes"):
                    folder = home / "warm" / name.replace(" ", "-")
                    prepare(folder, JOBS[name], files)
                    os.chdir(folder)
                    status, _, stderr = sandbox.command((*JOBS[name].command, "--quiet"))
                    if status not in (0, 1):
                        raise RuntimeError(f"{name}: {status}: {stderr}")
    finally:
        os.chdir(was)
    return files


def prepare(folder: Path, job: Job, files: Mapping[str, bytes]) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, content in files.items():
        if name.startswith(job.needs) and "/answers" not in name:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)


def whole_unit(unit: str, found: Mapping[str, str], wanted: Mapping[str, str]) -> bool:
    """Whether a unit's folder holds all that it has at the end, but for the note that it is done."""
    whole = {name: held for name, held in wanted.items() if name.startswith(unit + "/")}
    here = {name: held for name, held in found.items() if name.startswith(unit + "/")}
    missing = whole.keys() - here.keys()
    return all(whole.get(name) == held for name, held in here.items()) and all(
        name.endswith("outcome.json") for name in missing
    )


TIMES = re.compile(r'"(seconds|retried|number|code|fingerprint)": [^,}\]\n]+')
"""What differs between two runs of the same: how long it took, and which tries a study counts."""
_UNFINISHED = (".partial-", ".commit-")
_OWN = (".journal", ".lock", ".log")


def results(folder: Path, job: Job) -> dict[str, str]:
    """Relative name of each output to what it holds, without what may differ between two runs of the same.

    Of pages and workbooks it tells only that they are whole: plotting libraries draw random names.
    """
    found = {}
    for output in job.outputs:
        place = folder / output
        for path in [place] if place.is_file() else sorted(place.rglob("*")):
            name = str(path.relative_to(folder))
            if path.is_file() and not path.name.endswith(_OWN) and not _is_unfinished(name):
                found[name] = _told(path)
    return found


def unfinished(folder: Path) -> list[str]:
    """Folders of what was being written."""
    names = (str(path.relative_to(folder)) for path in folder.rglob(".*"))
    return [name for name in names if name.rpartition("/")[2].startswith(_UNFINISHED)]


def _is_unfinished(name: str) -> bool:
    return any(part.startswith(_UNFINISHED) for part in name.split("/"))


def _told(path: Path) -> str:
    held = path.read_bytes()
    if path.suffix == ".html":
        return "whole" if held.rstrip().endswith(b"</html>") else f"cut at {len(held)}"
    if path.suffix == ".xlsx":
        try:
            with zipfile.ZipFile(path) as book:
                return "whole" if book.testzip() is None else "damaged"
        except zipfile.BadZipFile:
            return "damaged"
    if path.suffix == ".json":
        held = TIMES.sub("", held.decode("utf-8", errors="replace")).encode()
    return hashlib.sha256(held).hexdigest()
