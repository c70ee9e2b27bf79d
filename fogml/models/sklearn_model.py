"""Drift models from scikit-learn's regressors by their dotted names."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Mapping
from importlib import import_module
from typing import Any, ClassVar

from numpy.typing import NDArray

from fogml.errors import InputError, first_line
from fogml.features.features import Features
from fogml.models.card import TrainingCard
from fogml.models.feature_model import FeatureModel, SavedFeatures
from fogml.models.parameters import check_parameters
from fogml.models.scikit_learn import BaseEstimator, RegressorMixin, clone
from fogml.models.table import TrainingTable
from fogml.strict import strictly

MAX_ROWS = 800
"""Averages that training runs are brought down to: kernel methods take time in its cube."""


class _Saved(SavedFeatures):
    """What `SklearnModel.to_saved` writes beside the arrays."""

    name: str
    options: dict[str, Any]
    seed: int


class SklearnModel(FeatureModel):
    """Drift as a scikit-learn regressor's value of features of the temperatures.

    Features and drift are standardised with the training rows' means and standard deviations
    before the regressor sees them, so settings such as an SVR's ``epsilon`` are in standard
    deviations. A Gaussian process without a stated kernel gets a signal of own width for each
    feature, a linear part and white noise, as its default kernel is not fitted at all.

    Parameters
    ----------
    name
        Dotted name, e.g. ``sklearn.svm.SVR``.
    features
        Features, or their text.
    options
        Arguments of the regressor.
    max_rows
        Training rows are averaged over blocks of time down to this number.
    seed
        Random state, where the regressor takes one.
    """

    form: ClassVar[str] = "sklearn"

    def __init__(
        self,
        name: str = "sklearn.svm.SVR",
        features: str | Features = "T, dT, T*dT",
        options: Mapping[str, Any] | None = None,
        max_rows: int | None = MAX_ROWS,
        seed: int = 0,
    ) -> None:
        self.name = name
        self.features = features
        self.options = options
        self.max_rows = max_rows
        self.seed = seed

    @property
    def kind(self) -> str:  # type: ignore[override]
        """The dotted name."""
        return self.name

    def unfitted_regressor(self, width: int) -> Any:
        """An unfitted regressor for `width` columns."""
        kind, options = self.check_options()
        if kind.__name__ == "GaussianProcessRegressor" and options.get("kernel") is None:
            # Own width for each feature, a linear part and white noise, for standardised columns.
            from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct, WhiteKernel

            smooth = ConstantKernel(1.0, (1e-4, 1e4)) * RBF([1.0] * width, (1e-1, 1e3))
            linear = ConstantKernel(1.0, (1e-4, 1e4)) * DotProduct(1.0, "fixed")
            options["kernel"] = smooth + linear + WhiteKernel(1e-2, (1e-8, 1e1))
        from sklearn.compose import TransformedTargetRegressor
        from sklearn.pipeline import make_pipeline
        from sklearn.preprocessing import StandardScaler

        scaled = make_pipeline(StandardScaler(), kind(**options))
        return TransformedTargetRegressor(scaled, transformer=StandardScaler())

    def check_options(self) -> tuple[type, dict[str, Any]]:
        """The regressor's class and its arguments, the seed among them.

        Raises
        ------
        InputError
            If an argument is not known or its value not allowed.
        """
        kind = sklearn_regressor_class(self.name)
        options = dict(self.options or {})
        if "random_state" in inspect.signature(kind).parameters:
            options.setdefault("random_state", self.seed)
        check_parameters(kind, options, self.name)
        return kind, options

    def _fit_regressor(self, regressor: Any, table: TrainingTable) -> Any:
        from sklearn.exceptions import ConvergenceWarning

        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", ConvergenceWarning)
            try:
                fitted = regressor.fit(table.X, table.y)
            except Exception as error:
                # What only the rows tell, and values that the estimator's own check lets pass: others' code
                # raises whatever they lead to.
                raise InputError(f"{self.name}: can't be fitted to these runs: {first_line(error)}") from None
        told = {str(warning.message).strip().split("\n")[0] for warning in caught}
        self._convergence = [f"{self.name}: {message}" for message in sorted(told)]
        return fitted

    def _fit_notes(self) -> list[str]:
        return self._convergence

    def _refitted(self, table: TrainingTable) -> Any:
        held = clone(self.regressor_)
        fitted, unfitted = self.regressor_.regressor_[-1], held.regressor[-1]
        if hasattr(fitted, "kernel_") and "optimizer" in unfitted.get_params():
            # A Gaussian process keeps the kernel that it was tuned to.
            unfitted.set_params(kernel=fitted.kernel_, optimizer=None)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return held.fit(table.X, table.y)

    def to_saved(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """The fitted model as JSON-ready values and arrays."""
        values, arrays = super().to_saved()
        return {**values, "name": self.name, "options": dict(self.options or {}), "seed": self.seed}, arrays

    @classmethod
    def from_saved(
        cls, values: dict[str, Any], arrays: dict[str, NDArray[Any]], card: TrainingCard
    ) -> SklearnModel:
        """The model that `to_saved` gave."""
        from sklearn.compose import TransformedTargetRegressor
        from sklearn.preprocessing import StandardScaler

        saved = strictly(_Saved, values, "model")
        kind = sklearn_regressor_class(saved.name)
        model = cls(saved.name, saved.asked_features, saved.options or None, saved.max_rows, saved.seed)
        model._restore(saved, arrays, card)
        found = model.regressor_
        steps = [type(step) for _, step in getattr(getattr(found, "regressor_", None), "steps", ())]
        if not isinstance(found, TransformedTargetRegressor) or steps != [StandardScaler, kind]:
            raise InputError(f"the saved regressor is not a scaled {saved.name}")
        return model


def sklearn_regressor_class(name: str) -> type:
    """The scikit-learn regressor of a dotted name.

    Raises
    ------
    InputError
        If the name is not one of scikit-learn's regressors.
    """
    package, _, attribute = name.rpartition(".")
    example = "give e.g. sklearn.svm.SVR"
    if package.split(".")[0] != "sklearn":
        raise InputError(f"model '{name}': a dotted name must be one of scikit-learn's regressors; {example}")
    try:
        kind = getattr(import_module(package), attribute)
    except (ImportError, AttributeError):
        raise InputError(f"model '{name}': scikit-learn has no such regressor; {example}") from None
    if not (inspect.isclass(kind) and issubclass(kind, RegressorMixin) and issubclass(kind, BaseEstimator)):
        raise InputError(f"model '{name}': is not a regressor; {example}")
    needed = [
        parameter.name
        for parameter in inspect.signature(kind).parameters.values()
        if parameter.default is inspect.Parameter.empty
        and parameter.kind not in (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    ]
    if needed or inspect.isabstract(kind):
        raise InputError(f"model '{name}': does not stand alone (it needs {', '.join(needed)}); {example}")
    return kind
