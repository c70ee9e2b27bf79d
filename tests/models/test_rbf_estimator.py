"""The networks as scikit-learn regressors: its contract, saving, refitting, determinism."""

from __future__ import annotations

from typing import Any

import pytest
from sklearn.utils.estimator_checks import parametrize_with_checks

from fogml.models.rbf import PatentRBFRegressor, RBFRegressor


@parametrize_with_checks(
    [RBFRegressor(), RBFRegressor(objective="validation", centres=8), PatentRBFRegressor()]
)
def test_contract_of_scikit_learn(estimator: Any, check: Any) -> None:
    check(estimator)
