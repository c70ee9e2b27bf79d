"""A round of the benchmark: its design, what is handed out and kept, hashes that bind the one to the other.

::

    DIR/handout/round.json           cases, rules, a hash of each case's files, a salted one of its answer
    DIR/handout/drift/NNNN/          fit-1.csv … held-out-1.csv, its gyro column 0 in every row
    DIR/handout/diagnosis/NNNN/      as `fogml blind make` makes it
    DIR/kept/                        key.json (seed and salt), drift/NNNN/held-out-1.csv, diagnosis/NNNN.*
    DIR/entries/NAME/TRACK/NNNN/     drift.csv or gap.json; about.json, outcome.json
"""

from __future__ import annotations

import hashlib
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from fogml.blind.folders import BlindFolder, read_json
from fogml.blind.run import case_stamp
from fogml.blind.truth import Kind
from fogml.errors import InputError
from fogml.json_files import json_object
from fogml.signals.averages import AVERAGING_S


@dataclass(frozen=True)
class RoundDesign:
    """What a round's cases are drawn from and how drift is averaged; its ``round.json`` states it.

    Attributes
    ----------
    sample_s
        Of synthetic runs [s]: as in the suites of ``fogml blind``.
    drift_kinds, drift_d_prime
        Causes of drift that a synthetic unit of the drift track has, and the range of their whitened lengths:
        plain to see in a run, and below what would drown all else.
    least_d_prime
        Whitened length beside the constants that a cause of the diagnosis track has at least: what a
        detection of one false in a thousand sees nearly always.
    averaging_s
        Of figures of synthetic runs [s]: short beside a coil's thermal time, long beside white noise.
    cycle_pairs
        Legs of the thermal cycle to train on, and the one to test on.
    cycle_averaging_rows
        Samples in an average of its figures.
    cold_pairs
        Thirds of the cold start to train on, counted from 0, and the one to test on.
    cold_sample_s, cold_averaging_s
        It is handed out as averages over so long [s], as its 59 Hz say nothing more of its drift, and its
        figures are averages over so long [s]: a third lasts minutes.
    settling_s
        Start of a held-out run that enters no figure, as windows fill there [s].
    """

    sample_s: float = 10.0
    drift_kinds: tuple[Kind, ...] = ("one", "two", "three", "unknown_invented")
    drift_d_prime: tuple[float, float] = (20.0, 60.0)
    least_d_prime: float = 10.0
    averaging_s: float = AVERAGING_S
    cycle_pairs: tuple[tuple[str, str], ...] = (("12", "3"), ("13", "2"), ("23", "1"), ("1", "2"), ("2", "3"))
    cycle_averaging_rows: int = 20
    cold_pairs: tuple[tuple[tuple[int, ...], int], ...] = (((0, 1), 2), ((1, 2), 0))
    cold_sample_s: float = 0.3
    cold_averaging_s: float = 20.0
    settling_s: float = 128.0

    def stated(self) -> dict[str, Any]:
        """As ``round.json`` states it."""
        return {key: list(v) if isinstance(v, tuple) else v for key, v in asdict(self).items()}


DESIGN = RoundDesign()
"""Of rounds that are made unless another is asked for."""


Track = Literal["drift", "diagnosis"]
TRACKS: tuple[Track, ...] = get_args(Track)
ANSWER = {"drift": "drift.csv", "diagnosis": "gap.json"}
"""What a method writes for a case, by track."""
SCHEMA = "fogml.benchmark_round/1"
SEED = 2026
"""Of the round that everyone can make: its answers are the same for all."""
RULES = (
    "The gyro of a drift case's held-out run is 0 in every row: it is what is asked for.",
    "A method may use the files of the case that it answers, and what was known before the round.",
    "One setting for all cases of a track; nothing is chosen by a score of this round.",
    "Every case is answered. A case on which a method fails is told as failed, and counts as no compensation "
    "or as a wrong answer.",
    "Real legs and rounds whose seed is stated are open: who looks can see the answers, and an entry says "
    "that its author did not. Of a closed round nobody but its keeper can.",
)


@dataclass(frozen=True)
class TrackFolder(BlindFolder):
    """One track of a round, laid out for what runs and scores blind suites.

    Attributes
    ----------
    track
        Name of the track.
    """

    track: Track = "diagnosis"

    @property
    def cases(self) -> Path:
        """What is handed out."""
        return self.path / "handout" / self.track

    @property
    def truth(self) -> Path:
        """What is kept."""
        return self.path / "kept" / self.track

    def answers(self, method: str = "") -> Path:
        """An entry's answers."""
        return self.path / "entries" / method / self.track

    def methods(self) -> tuple[str, ...]:
        """Names of the entries that answer this track."""
        found = (self.path / "entries").glob(f"*/{self.track}")
        return tuple(sorted(path.parent.name for path in found if path.is_dir()))

    def kept(self, case: str) -> tuple[Path, ...]:
        """Files that hold the answer of a case."""
        if self.track == "drift":
            return (self.truth / case / "held-out-1.csv",)
        return (self.truth / f"{case}.json", self.truth / f"{case}.npz")


def commitment(salt: str, files: tuple[Path, ...]) -> str:
    """SHA-256 over a salt and the files of an answer, in hexadecimal digits.

    Without the salt nobody can try likely answers until one has the hash that was published.
    """
    found = hashlib.sha256(salt.encode("ascii"))
    for path in files:
        if not path.is_file():
            raise InputError(f"{path}: no such file; the kept folder of the round is not complete")
        with path.open("rb") as file:
            found.update(hashlib.file_digest(file, "sha256").digest())
    return found.hexdigest()


def read_round(directory: str | Path) -> dict[str, Any]:
    """``handout/round.json`` of a round."""
    path = Path(directory) / "handout" / "round.json"
    if not path.is_file():
        raise InputError(f"{path}: no such file; make a round first: fogml benchmark make {directory}")
    return json_object(read_json(path), str(path), SCHEMA, "make the round anew")


def _content(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() else None


def check_kept(directory: str | Path, told: dict[str, Any]) -> None:
    """Hold what was kept, and the cases' own files, against the hashes that were handed out.

    The side file of a drift answer tells nothing that is not handed out, so it has to be that one.
    """
    path = Path(directory) / "kept" / "key.json"
    if not path.is_file():
        raise InputError(f"{path}: no such file; only who keeps a round's answers can score it")
    salt = read_json(path)["salt"]
    for track in TRACKS:
        folder = TrackFolder(Path(directory), track)
        for case, values in told["tracks"][track].items():
            files = folder.kept(case)
            if commitment(salt, files) != values["answer_sha256"]:
                raise InputError(f"{files[0]}: is not the answer that round.json binds; it was changed")
            # Rounds that were made before cases were bound state no hash of them.
            cases = TrackFolder(Path(directory), track).cases / case
            if "files_sha256" in values and case_stamp(cases) != values["files_sha256"]:
                raise InputError(
                    f"{cases}: holds other files than round.json binds; put back what was handed out"
                )
            side = files[0].with_suffix(".yaml")
            if track == "drift" and _content(side) != _content(cases / side.name):
                raise InputError(f"{side}: is not {cases / side.name}, as it was made; one was changed")
