"""A regressor of another package: least squares over the middle of the residuals."""

from __future__ import annotations

from typing import Any

import numpy as np
from sklearn.base import BaseEstimator, RegressorMixin

from fogml.models.linear import LinearRegressor


class TrimmedRegressor(RegressorMixin, BaseEstimator):
    """Least squares, then again without the share of the rows that it leaves furthest."""

    def __init__(self, share: float = 0.05) -> None:
        self.share = share

    def fit(self, X: Any, y: Any) -> TrimmedRegressor:
        away = np.abs(y - LinearRegressor().fit(X, y).predict(X))
        kept = away <= np.quantile(away, 1.0 - self.share)
        self.linear_ = LinearRegressor().fit(X[kept], y[kept])
        self.n_features_in_ = X.shape[1]
        return self

    def predict(self, X: Any) -> Any:
        return self.linear_.predict(X)

    def to_saved(self) -> tuple[dict[str, Any], dict[str, Any]]:
        values, arrays = self.linear_.to_saved()
        return {"share": self.share, "linear": values}, arrays

    @classmethod
    def from_saved(cls, values: dict[str, Any], arrays: dict[str, Any]) -> TrimmedRegressor:
        model = cls(float(values["share"]))
        model.linear_ = LinearRegressor.from_saved(values["linear"], arrays)
        model.n_features_in_ = model.linear_.n_features_in_
        return model
