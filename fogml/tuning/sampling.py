"""What a trial tries next: Optuna's samplers, seeded trial by trial."""

from __future__ import annotations

import warnings
from typing import Any
from zlib import crc32

import numpy as np
import optuna
from optuna.distributions import BaseDistribution
from optuna.samplers import BaseSampler, RandomSampler, TPESampler
from optuna.trial import FrozenTrial, TrialState

SAMPLERS = ("tpe", "random")


class SeededByTrial(BaseSampler):
    """A sampler whose random numbers follow from the seed and the trial's place alone.

    So a study that was interrupted goes on as it would have gone, and ``random`` tries the same
    whatever the number of workers. ``tpe`` learns from what has finished, in whatever order
    several workers finish it. A trial's place does not count those that a killed worker left.

    Parameters
    ----------
    name
        ``tpe`` (tree-structured Parzen estimator) or ``random``.
    seed
        The sweep's seed.
    """

    def __init__(self, name: str, seed: int) -> None:
        self._name, self._seed = name, seed

    def infer_relative_search_space(
        self, study: optuna.Study, trial: FrozenTrial
    ) -> dict[str, BaseDistribution]:
        """Nothing: which parameters there are depends on what is chosen first."""
        return {}

    def sample_relative(
        self, study: optuna.Study, trial: FrozenTrial, search_space: dict[str, BaseDistribution]
    ) -> dict[str, Any]:
        """Nothing: each parameter is drawn by itself."""
        return {}

    def sample_independent(
        self, study: optuna.Study, trial: FrozenTrial, param_name: str, param_distribution: BaseDistribution
    ) -> Any:
        """A parameter's value; it follows from seed, place and name, whatever was drawn before."""
        key = [self._seed, place_of(study, trial.number), crc32(param_name.encode())]
        seed = int(np.random.SeedSequence(key).generate_state(1)[0])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            kind: Any = TPESampler if self._name == "tpe" else RandomSampler
            return kind(seed=seed).sample_independent(study, trial, param_name, param_distribution)


def place_of(study: optuna.Study, number: int) -> int:
    """How many trials before this one count: all but those that failed."""
    trials = study.get_trials(deepcopy=False)
    return sum(trial.number < number and trial.state != TrialState.FAIL for trial in trials)
