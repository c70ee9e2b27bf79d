"""What a trial tries next: Optuna's samplers, seeded trial by trial."""

from __future__ import annotations

import warnings
from typing import Any
from zlib import crc32

import numpy as np
import optuna
from optuna.distributions import BaseDistribution
from optuna.samplers import BaseSampler, RandomSampler, TPESampler
from optuna.trial import FrozenTrial

PLACE = "place"
"""Attribute of a trial: which of the trials asked for it is, from 0; a trial tried again keeps it."""


class SeededByTrial(BaseSampler):
    """A sampler whose random numbers follow from the seed and the trial's place alone.

    What a trial draws follows from the seed, the trial's place and, with ``tpe``, the trials that have
    finished. So one worker, killed anywhere and started again on its machine, goes on as it would have
    gone, bit for bit. Several workers try the same with ``random``; with ``tpe`` what they try depends on
    the order in which they finish.

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
        key = [self._seed, place_of(trial), crc32(param_name.encode())]
        seed = int(np.random.SeedSequence(key).generate_state(1)[0])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            kind: Any = TPESampler if self._name == "tpe" else RandomSampler
            return kind(seed=seed).sample_independent(study, trial, param_name, param_distribution)


def place_of(trial: FrozenTrial | optuna.Trial) -> int:
    """Which of the trials asked for one is."""
    return int(trial.user_attrs.get(PLACE, trial.number))
