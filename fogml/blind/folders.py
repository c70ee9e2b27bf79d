"""Where a blind suite keeps its cases, answers and truth, and what a case is made of.

::

    DIR/cases/NNNN/    fit-1.csv ... held-out-1.csv ... static.csv, side files, options.json
    DIR/answers/NNNN/  gap.json, gap.html, twin.yaml, outcome.json
    DIR/answers-NAME/  the same of a baseline
    DIR/truth/         NNNN.json, NNNN.npz, SHA256SUMS
"""

from __future__ import annotations

import hashlib
import os
import re
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fogml import json_files
from fogml.errors import InputError
from fogml.outputs import whole_file

DIAGNOSIS = "diagnosis"
"""The method whose answers stand in the folder ``answers``."""
OUTCOME = "outcome.json"
OUTCOME_SCHEMA = "fogml.blind_outcome/1"
_ANSWERS = "answers"


@dataclass(frozen=True)
class CaseFiles:
    """What a diagnosis gets of a case.

    Attributes
    ----------
    name
        The case's number.
    fit, held_out
        Runs, in the order of their numbers.
    noise
        The static run for the noise, if there is one.
    without
        Ids that are no candidates.
    seed
        Of what a method draws.
    twin
        Name of the shipped twin that the runs are held against.
    """

    name: str
    fit: tuple[Path, ...]
    held_out: tuple[Path, ...]
    noise: Path | None
    without: tuple[str, ...]
    seed: int = 0
    twin: str = "nominal"


@dataclass(frozen=True)
class BlindFolder:
    """A blind suite's folder."""

    path: Path

    @property
    def cases(self) -> Path:
        """The folder of the cases."""
        return self.path / "cases"

    @property
    def truth(self) -> Path:
        """The folder of the truths."""
        return self.path / "truth"

    def answers(self, method: str = DIAGNOSIS) -> Path:
        """The folder of a method's answers."""
        return self.path / (_ANSWERS if method == DIAGNOSIS else f"{_ANSWERS}-{method}")

    def methods(self) -> tuple[str, ...]:
        """Methods that answered, the diagnosis first."""
        found = [DIAGNOSIS] if self.answers().is_dir() else []
        others = sorted(self.path.glob(f"{_ANSWERS}-*"))
        return (*found, *(path.name.removeprefix(f"{_ANSWERS}-") for path in others if path.is_dir()))

    def names(self) -> tuple[str, ...]:
        """Numbers of the cases, in order.

        Raises
        ------
        InputError
            If there are none.
        """
        found = [p.name for p in self.cases.glob("[0-9]*") if p.is_dir() and p.name.isdecimal()]
        found.sort(key=lambda name: (len(name), name))  # past 9999 names are longer
        if not found:
            raise InputError(f"{self.cases}: holds no cases; make them first (fogml blind make)")
        return tuple(found)


def case_files(folder: Path, seed: int = 0) -> CaseFiles:
    """What lies in a case's folder.

    Raises
    ------
    InputError
        If there is no fit run, or ``options.json`` is not as it should be.
    """
    fit, held_out = _numbered(folder, "fit"), _numbered(folder, "held-out")
    if not fit:
        raise InputError(f"{folder}: holds no fit-1.csv; make the cases anew")
    static = folder / "static.csv"
    options = read_json(folder / "options.json") if (folder / "options.json").is_file() else {}
    without = options.get("without", [])
    if not isinstance(without, list) or not all(isinstance(id, str) for id in without):
        raise InputError(f"{folder / 'options.json'}: key 'without' must list ids of effects")
    twin = options.get("twin", "nominal")
    if not isinstance(twin, str):
        raise InputError(f"{folder / 'options.json'}: key 'twin' must be the name of a shipped twin")
    noise = static if static.is_file() else None
    return CaseFiles(folder.name, fit, held_out, noise, tuple(without), seed, twin)


def read_json(path: Path) -> dict[str, Any]:
    """The mapping in a JSON file."""
    values = json_files.read_json(path, "fogml blind makes, answers and scores cases")
    if not isinstance(values, dict):
        raise InputError(f"{path}: a JSON object was expected")
    return values


def _numbered(folder: Path, stem: str) -> tuple[Path, ...]:
    found = {}
    for path in folder.glob(f"{stem}-*.csv"):
        match = re.fullmatch(rf"{stem}-(\d+)", path.stem)
        if match:
            found[int(match.group(1))] = path
    return tuple(found[number] for number in sorted(found))


SUMS = "SHA256SUMS"


def write_sums(folder: Path) -> None:
    """Write ``SHA256SUMS`` over every truth in the folder."""
    files = sorted(path for path in folder.iterdir() if path.suffix in (".json", ".npz"))
    with whole_file(folder / SUMS) as partial:
        lines = [f"{_digest(path)}  {path.name}\n" for path in files]
        partial.write_text("".join(lines), encoding="ascii")


def check_sums(folder: Path) -> int:
    """How many truths there are, once all of them have the hashes that were written.

    Raises
    ------
    InputError
        If the list is missing, a file changed, is missing, or is not listed.
    """
    path = folder / SUMS
    if not path.is_file():
        raise InputError(f"{path}: no such file; the truth must be hashed when it is made")
    lines = [line.partition("  ") for line in path.read_text(encoding="utf-8", errors="replace").splitlines()]
    stated = {name: digest for digest, _, name in lines}
    held = {file.name for file in folder.iterdir() if file.suffix in (".json", ".npz")}
    for name in sorted(held ^ set(stated)):
        what = "is not listed" if name in held else "is listed, but missing"
        raise InputError(f"{folder / name}: {what} in {SUMS}; make the cases anew")
    for name, digest in stated.items():
        if _digest(folder / name) != digest:
            raise InputError(f"{folder / name}: changed since it was hashed; make the cases anew")
    return sum(name.endswith(".json") for name in held)


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def count_samples(folder: Path) -> int:
    """Samples in all runs of a case: lines less one header each."""
    files = case_files(folder)
    return sum(_lines(path) - 1 for path in (*files.fit, *files.held_out))


def not_answers(folder: str, names: list[str]) -> list[str]:
    """What a method may leave besides files and folders: its keeper would read what the method itself can't.

    ``outcome.json`` is the keeper's to write.
    """

    def is_none(name: str) -> bool:
        kind = os.lstat(os.path.join(folder, name)).st_mode
        return name == OUTCOME or not (stat.S_ISREG(kind) or stat.S_ISDIR(kind))

    return [name for name in names if is_none(name)]


def _lines(path: Path) -> int:
    with path.open("rb") as file:
        return sum(block.count(b"\n") for block in iter(lambda: file.read(1 << 20), b""))
