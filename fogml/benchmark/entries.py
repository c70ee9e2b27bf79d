"""Letting methods answer a round: each case by a sealed process that gets the case's files alone."""

from __future__ import annotations

from pathlib import Path

from fogml.benchmark.rounds import ANSWER, Track, TrackFolder, read_round
from fogml.blind.run import RunPlan

_DRIFT_MODEL = "fogml.benchmark.answers:drift_model"


def entry_name(method: str, name: str | None = None) -> str:
    """What the answers of a method are called: its name, without the module of a function or regressor."""
    return name or method.rpartition(":")[2].rpartition(".")[2]


def entry_plan(
    directory: str | Path,
    track: Track,
    method: str,
    *,
    name: str | None = None,
    features: str | None = None,
    code: Path | None = None,
    workers: int = 1,
    limit_s: float = 600.0,
    retry: bool = False,
    seed: int = 0,
) -> RunPlan:
    """How a method answers a track.

    Parameters
    ----------
    directory
        The round, or what was handed out of it as ``handout`` in a folder.
    track
        ``drift`` or ``diagnosis``.
    method
        Of the drift track a model's name, of the diagnosis track that of a method of ``fogml blind run``; of
        both ``module:function``, called with the case's files and the folder for its answer.
    name
        What its answers are called.
    features
        Of a drift model by its name.
    code
        Folder of the method's own code, where that is not installed.
    workers, limit_s, retry, seed
        As of `fogml.blind.run.RunPlan`.
    """
    read_round(directory)
    by_name = track == "drift" and ":" not in method
    if by_name:
        from fogml.models.names import make_model

        make_model(method, features)  # a name that is not known is told before any process begins
    folder = TrackFolder(Path(directory), track)
    called = entry_name(method, name)
    return RunPlan(
        folder=folder,
        method=_DRIFT_MODEL if by_name else method,
        name=called,
        code=code,
        workers=workers,
        limit_s=limit_s,
        retry=retry,
        into=folder.answers(called),
        seed=seed,
        options={"model": method, "features": features} if by_name else {},
        answer=ANSWER[track],
    )
