"""Models by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from fogml.errors import InputError

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
    "joint",
    "joint-patent",
)
"""Every name that `make_model` knows beside dotted names of scikit-learn's regressors."""


def make_model(name: str, features: str | None = None, seed: int = 0) -> DriftModel:
    """An unfitted drift model by its name.

    Parameters
    ----------
    name
        One of `MODEL_NAMES`, or a scikit-learn regressor by its dotted name.
    features
        Text of the features, for ``auto``, ``polynomial``, ``rbf``, ``rbf-patent`` and dotted names.
    seed
        Seed of whatever is random.

    Raises
    ------
    InputError
        If the name is not known, or features are stated for a model that fixes its own.
    """
    if "." in name:
        from fogml.models.sklearn_model import SklearnModel, sklearn_regressor_class

        sklearn_regressor_class(name)
        return SklearnModel(name, _understood(features or RBF_FEATURES), seed=seed)
    if name not in MODEL_NAMES:
        raise InputError(_unknown(name))
    if name == "auto":
        from fogml.models.auto import AutoModel

        return AutoModel(features=features, seed=seed)
    if name == "polynomial":
        return _linear(name, features or POLYNOMIAL_FEATURES, "auto")
    if name in ("rbf", "rbf-patent"):
        return _rbf(name, features, seed)
    if features is not None:
        raise InputError(
            f"model '{name}' has its own columns, so features can't be stated for it; "
            "use --model polynomial with these features, or leave them out"
        )
    if name in PRESETS:
        return _linear(name, PRESETS[name].features, 0.0)
    if name in ("joint", "joint-patent"):
        from fogml.models.joint import JointModel

        return JointModel(patent=name == "joint-patent")
    from fogml.models.baselines import MeanModel, NoCompensation

    return MeanModel() if name == "mean" else NoCompensation()


def _linear(kind: str, features: str, ridge: float | str) -> DriftModel:
    from fogml.models.feature_model import FeatureModel
    from fogml.models.linear import LinearRegressor

    return FeatureModel(_understood(features), LinearRegressor(ridge=ridge), kind=kind)  # type: ignore[arg-type]


def _rbf(kind: str, features: str | None, seed: int) -> DriftModel:
    from fogml.models.feature_model import FeatureModel
    from fogml.models.rbf import PatentRBFRegressor, RBFRegressor

    patent = kind == "rbf-patent"
    text = _understood(features or (RBF_PATENT_FEATURES if patent else RBF_FEATURES))
    regressor = PatentRBFRegressor(seed=seed) if patent else RBFRegressor(seed=seed)
    return FeatureModel(text, regressor, kind=kind)


def _understood(features: str) -> str:
    """The text itself, once it is known to be understood; a fault is told before any run is read."""
    from fogml.features.parse import parse_features

    parse_features(features.replace("{sensor}", "T1"))
    return features


def _unknown(name: str) -> str:
    from difflib import get_close_matches

    near = get_close_matches(name, MODEL_NAMES, n=1)
    hint = f"did you mean '{near[0]}'? " if near else ""
    return (
        f"model '{name}' is not known; {hint}known are {', '.join(MODEL_NAMES)}, "
        "or a scikit-learn regressor by its dotted name, e.g. sklearn.svm.SVR"
    )
