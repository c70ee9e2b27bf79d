"""What a sweep is to do, as every worker is told."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from fogml.errors import InputError
from fogml.runs.run import Run
from fogml.tuning.space import Choice, Space

OBJECTIVES = {"rms": "deg/h", "bias_stability": "deg/h", "bytes": "byte", "operations": "per sample"}
"""What can be minimised, and its unit: error on held-out parts, the same about each held-out run's mean, size
of the weights, arithmetic."""


@dataclass(frozen=True)
class Plan:
    """A sweep.

    Attributes
    ----------
    name
        Name of the study in its storage.
    read
        Gives the training runs; every worker reads them for itself.
    space
        What to choose from.
    objectives
        Names out of `OBJECTIVES`, ``rms`` or ``bias_stability`` among them.
    folds, fold_count
        As in `fogml.tuning.held_out.HeldOut`.
    trials
        Trials to finish, whole or pruned.
    sampler
        ``tpe`` or ``random``.
    prune
        Whether a trial ends once a finished one that is no larger beats it.
    seed
        Seed of the sampler and of the networks.
    storage
        URL of a database; None for a journal in `folder`.
    folder
        Where results go.
    references
        Choices tried first, by name; None for those of `fogml.tuning.winner.reference_choices`.
    heartbeat_s
        A trial whose worker has not been heard of for three times this long is tried again [s].
    """

    name: str
    read: Callable[[], Sequence[Run]]
    space: Space
    objectives: tuple[str, ...] = ("rms",)
    folds: Literal["auto", "time", "runs"] = "auto"
    fold_count: int = 5
    trials: int = 50
    sampler: str = "tpe"
    prune: bool = True
    seed: int = 0
    storage: str | None = None
    folder: str = "sweep-results"
    references: Mapping[str, Choice] | None = None
    heartbeat_s: float = 10.0

    def check(self) -> None:
        """Check what can be checked before a run is read."""
        from fogml.tuning.held_out import FOLD_COUNTS

        if self.trials < 1:
            raise InputError(f"trials {self.trials}: at least 1 is needed")
        if not self.heartbeat_s > 0.0:
            raise InputError(f"heartbeat {self.heartbeat_s:g} s: a positive number of seconds is needed")
        if self.fold_count not in FOLD_COUNTS:
            known = ", ".join(map(str, FOLD_COUNTS))
            raise InputError(f"{self.fold_count} folds: one of {known} was expected")
        if self.sampler not in ("tpe", "random"):
            raise InputError(f"sampler '{self.sampler}': tpe or random was expected")
        unknown = [name for name in self.objectives if name not in OBJECTIVES]
        if unknown or len(set(self.objectives)) < len(self.objectives):
            raise InputError(
                f"objectives {', '.join(self.objectives)}: each once of {', '.join(OBJECTIVES)} was expected"
            )
        if not {"rms", "bias_stability"} & set(self.objectives):
            raise InputError(
                "objectives: rms is missing, or bias_stability in its place; "
                "a model's error is always among them"
            )
        self.space.check()

    def identity(self, runs: Sequence[Run]) -> dict[str, Any]:
        """What has to be the same for trials to belong to one study."""
        return {
            "search space": self.space.fingerprint(),
            "objectives": list(self.objectives),
            "folds": [self.folds, self.fold_count],
            "seed": self.seed,
            "sampler": self.sampler,
            "pruning": self.prune,
            "training runs": [run_identity(run) for run in runs],
        }


def run_identity(run: Run) -> list[Any]:
    """What has to be the same for a run to be the same: its columns, and its set-up facts."""
    return [run.hash, run.facts.as_dict()]
