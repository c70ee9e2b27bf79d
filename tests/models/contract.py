"""scikit-learn's own checks of an estimator, each a test."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest
from sklearn.utils.estimator_checks import parametrize_with_checks


def with_scikit_learns_checks(estimators: Sequence[Any]) -> pytest.MarkDecorator:
    """As scikit-learn's decorator, with a list of checks: pytest refuses the generators of older ones."""
    made = parametrize_with_checks(estimators)
    names, checks = made.args
    return pytest.mark.parametrize(names, list(checks), **made.kwargs)
