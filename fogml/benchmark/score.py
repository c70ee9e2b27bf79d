"""The score of a round: every entry of every track, as ``score.json`` holds it."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import fogml
from fogml.benchmark.diagnosis_score import diagnosis_figures, diagnosis_marks
from fogml.benchmark.drift_score import drift_figures, drift_marks
from fogml.benchmark.rounds import TRACKS, TrackFolder, check_kept, read_round
from fogml.errors import InputError

SCHEMA = "fogml.benchmark/1"


def score_round(directory: str | Path, entries: Sequence[str] = (), *, workers: int = 1) -> dict[str, Any]:
    """Score entries of a round; all that lie in its folder ``entries`` if none are named.

    Raises
    ------
    InputError
        If there is nothing to score, what was kept was changed, or an answer is missing or not finite.
    """
    home = Path(directory)
    told = read_round(home)
    check_kept(home, told)
    folders = {track: TrackFolder(home, track) for track in TRACKS}
    chosen = {
        track: [name for name in folder.methods() if not entries or name in entries]
        for track, folder in folders.items()
    }
    found = {name for names in chosen.values() for name in names}
    for name in entries:
        if name not in found:
            raise InputError(
                f"{home / 'entries' / name}: no such entry; run a method or put its answers there"
            )
    if not found:
        raise InputError(f"{home / 'entries'}: holds no answers; run a method first: fogml benchmark run")
    settling_s = told["design"]["settling_s"]
    drift = drift_marks(folders["drift"], told["tracks"]["drift"], chosen["drift"], settling_s)
    named = diagnosis_marks(folders["diagnosis"], chosen["diagnosis"], workers)
    return {
        "schema": SCHEMA,
        "version": fogml.__version__,
        "round": {
            "seed": told["seed"],
            "closed": told["closed"],
            "made_by": told["version"],
            "rules": told["rules"],
            "design": told["design"],
            "handout_sha256": round_hash(home),
        },
        "cases": {track: told["tracks"][track] for track in TRACKS},
        "drift": {
            name: {"figures": drift_figures(marks), "cases": [_case(asdict(m)) for m in marks]}
            for name, marks in drift.items()
        },
        "diagnosis": {
            name: {
                "figures": diagnosis_figures(marks),
                "cases": [{"case": m.truth.case, "kind": m.truth.kind, "verdict": m.verdict} for m in marks],
            }
            for name, marks in named.items()
        },
    }


def round_hash(home: Path) -> str:
    """SHA-256 of ``round.json``, which binds every answer: the round's own name."""
    return hashlib.sha256((home / "handout" / "round.json").read_bytes()).hexdigest()


def _case(values: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if key != "group" and value not in (None, "")}
