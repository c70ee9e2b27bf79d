"""Models by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fogml.errors import InputError, known_are

if TYPE_CHECKING:
    from fogml.models.base import DriftModel

_GRADIENT = "T_in-T_out"
POLYNOMIAL_FEATURES = "T^1..3, dT, T*dT"
RBF_FEATURES = "T, dT, T*dT"
RBF_PATENT_FEATURES = "T, diff(T)[first], T*diff(T)[first]"


@dataclass(frozen=True)
class _Preset:
    """A linear model of fixed features; ``{sensor}`` stands for each coil sensor."""

    features: str
    meaning: str


PRESETS = {
    "M1": _Preset("T^1..5", "quintic in T"),
    "M2": _Preset("T^1..5, dT^1..3", "quintic in T, cubic in its rate"),
    "M3": _Preset(f"T^1..5, dT^1..3, ({_GRADIENT})^1..3", "M2 and a cubic in the gradient"),
    "M4": _Preset(f"({_GRADIENT})^1..5, d({_GRADIENT})^1..3", "quintic in the gradient, cubic in its rate"),
    "multipoint-5-3": _Preset(
        "{sensor}^1..5, d({sensor})^1..3", "quintic and cubic in the rate, each sensor"
    ),
    "multipoint-2-1": _Preset("{sensor}^1..2, d({sensor})", "quadratic and the rate, each sensor"),
}
"""The linear models of the multi-point paper, plain least squares as there."""

MODEL_NAMES = (
    "auto",
    "none",
    "mean",
    "polynomial",
    *PRESETS,
    "rbf",
    "rbf-patent",
    "mixed-effects",
    "joint",
    "joint-patent",
)
"""Every name that `make_model` knows beside dotted names of scikit-learn's regressors."""


PARAMETRIC = ("polynomial", "rbf", "rbf-patent")
"""Names of `MODEL_NAMES` whose regressor takes parameters."""


def make_model(
    name: str, features: str | None = None, seed: int = 0, parameters: Mapping[str, Any] | None = None
) -> DriftModel:
    """An unfitted drift model by its name.

    Parameters
    ----------
    name
        One of `MODEL_NAMES`, a scikit-learn regressor by its dotted name, or one that an installed package
        declares (`fogml.models.regressors`) by its name there.
    features
        Text of the features, for ``auto``, ``polynomial``, ``rbf``, ``rbf-patent``, ``mixed-effects`` and
        dotted names; for ``joint`` of those that the bias depends on besides its own.
    seed
        Seed of whatever is random.
    parameters
        Parameters of the regressor, for ``polynomial``, ``rbf``, ``rbf-patent`` and dotted names, e.g.
        ``{"ridge": 1e-4}`` or ``{"centres": 16}``.

    Raises
    ------
    InputError
        If the name is not known, or features or parameters are stated for a model that fixes its own.
    """
    if "." not in name and name not in MODEL_NAMES:
        from fogml.models.regressors import own_regressor, own_regressors

        if name not in own_regressors():
            raise InputError(_unknown(name))
        return _of_features(own_regressor(name), name, features or RBF_FEATURES, parameters or {})
    if parameters and "." not in name and name not in PARAMETRIC:
        raise InputError(
            f"model '{name}' takes no parameters (found '{next(iter(parameters))}'); models that do are "
            f"{', '.join(PARAMETRIC)} and scikit-learn's regressors by their dotted names"
        )
    if "." in name:
        from fogml.models.sklearn_model import SklearnModel

        options = dict(parameters) if parameters else None
        model = SklearnModel(name, _understood(features or RBF_FEATURES), options, seed=seed)
        model.check_options()
        return model
    if name == "auto":
        from fogml.models.auto import AutoModel

        return AutoModel(features if features is None else _understood(features), seed=seed)
    if name == "polynomial":
        return _linear(name, features or POLYNOMIAL_FEATURES, {"ridge": "auto", **(parameters or {})})
    if name in ("rbf", "rbf-patent"):
        return _rbf(name, features, {"seed": seed, **(parameters or {})})
    if name == "mixed-effects":
        from fogml.models.mixed_effects_model import MixedEffectsModel

        return MixedEffectsModel(None if features is None else _understood(features))
    if name == "joint":
        from fogml.models.joint import JointModel

        return JointModel(features=None if features is None else _understood(features))
    if features is not None:
        raise InputError(
            f"model '{name}' has its own columns, so features can't be stated for it; "
            "use --model polynomial with these features, or leave them out"
        )
    if name in PRESETS:
        return _linear(name, PRESETS[name].features, {"ridge": 0.0})
    if name == "joint-patent":
        from fogml.models.joint import JointModel

        return JointModel(patent=True)
    from fogml.models.baselines import MeanModel, NoCompensation

    return MeanModel() if name == "mean" else NoCompensation()


def _linear(kind: str, features: str, parameters: Mapping[str, Any]) -> DriftModel:
    from fogml.models.linear import LinearRegressor

    return _of_features(LinearRegressor, kind, features, parameters)


def _rbf(kind: str, features: str | None, parameters: Mapping[str, Any]) -> DriftModel:
    from fogml.models.rbf import PatentRBFRegressor, RBFRegressor

    if kind == "rbf-patent":
        return _of_features(PatentRBFRegressor, kind, features or RBF_PATENT_FEATURES, parameters)
    return _of_features(RBFRegressor, kind, features or RBF_FEATURES, parameters)


def _of_features(regressor: Any, kind: str, features: str, parameters: Mapping[str, Any]) -> DriftModel:
    """A model of features with a regressor of a class, once both are known to be allowed."""
    from fogml.models.feature_model import FeatureModel
    from fogml.models.parameters import check_parameters

    check_parameters(regressor, parameters, kind)
    return FeatureModel(_understood(features), regressor(**parameters), kind=kind)


def _understood(features: str) -> str:
    """The text itself, once it is known to be understood; a fault is told before any run is read."""
    from fogml.models.feature_model import check_feature_text

    check_feature_text(features)
    return features


def _unknown(name: str) -> str:
    from fogml.models.regressors import own_regressors

    known = (*MODEL_NAMES, *own_regressors())
    return (
        f"model '{name}' is not known; {known_are(name, known)}, "
        "or a scikit-learn regressor by its dotted name, e.g. sklearn.svm.SVR"
    )
