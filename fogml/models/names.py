"""Models by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from inspect import signature
from typing import TYPE_CHECKING, Any

from fogml.errors import InputError, known_are
from fogml.settings_check import GREATEST_SEED, check_whole

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
        Text of the features, for ``auto``, ``polynomial``, ``rbf``, ``rbf-patent``, ``mixed-effects``, dotted
        names and a package's; for ``joint`` of those that the bias depends on besides its own.
    seed
        Seed of whatever is random; a package's regressor gets it where it takes ``seed`` or ``random_state``.
    parameters
        Parameters of the regressor, for ``polynomial``, ``rbf``, ``rbf-patent``, dotted names and a
        package's, e.g. ``{"ridge": 1e-4}`` or ``{"centres": 16}``.

    Raises
    ------
    InputError
        If the name is not known, or features or parameters are stated for a model that fixes its own.
    """
    from fogml.models.others_code import asked
    from fogml.models.regressors import own_regressor, own_regressors
    from fogml.models.scikit_learn import clone

    check_whole("seed", seed, 0, GREATEST_SEED)
    if name in own_regressors():
        own = own_regressor(name)
        with asked(own, "can't be made and cloned"):
            return clone(
                _of_features(own, name, features or RBF_FEATURES, _seeded(own, parameters or {}, seed))
            )
    if "." not in name and name not in MODEL_NAMES:
        raise InputError(_unknown(name))
    if parameters and "." not in name and name not in PARAMETRIC:
        takers = ", ".join((*PARAMETRIC, *own_regressors()))
        raise InputError(
            f"model '{name}' takes no parameters (found '{next(iter(parameters))}'); models that do are "
            f"{takers} and scikit-learn's regressors by their dotted names"
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


def model_names() -> tuple[str, ...]:
    """`MODEL_NAMES`, and those of regressors that installed packages declare."""
    from fogml.models.regressors import own_regressors

    return (*MODEL_NAMES, *own_regressors())


def _seeded(regressor: Any, parameters: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """Parameters with the seed beside them, under the name that the regressor has for it."""
    takes = signature(regressor).parameters
    return {name: seed for name in ("seed", "random_state") if name in takes} | dict(parameters)


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
    return (
        f"model '{name}' is not known; {known_are(name, model_names())}, "
        "or a scikit-learn regressor by its dotted name, e.g. sklearn.svm.SVR"
    )
