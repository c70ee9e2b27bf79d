"""What drift models ask of bare regressors: fit to a table, predict, refit, count, save.

A bare regressor has scikit-learn's ``fit(X, y)`` and ``predict(X)``. It may also have

``fit(X, y, groups=..., time=..., folds=...)``
    any of these: the run of each row, its time [s], the fold of time it falls in;
``predict_unchecked(X)``
    predict for columns known to be finite float64;
``for_features(features, atom_values)``
    an unfitted regressor that heeds which columns it will get and what the training rows'
    atoms, shape (n, a), tell of them;
``refitted(X, y)``
    a new regressor fitted to other rows, what was tuned (shape, size, ridge) being kept;
``linear_beyond``
    True where it goes on linearly in its inputs beyond its training rows;
``parameter_count``
    number of fitted parameters;
``to_saved()`` and ``from_saved(values, arrays)``
    JSON-ready values and arrays, and back, with ``n_features_in_``, the number of columns.

Another package makes one known to the commands by the entry point group ``fogml.regressors``: the entry
point's name is the model's, ``--model NAME``; its class has ``to_saved`` and ``from_saved``, and from
``sklearn.base.BaseEstimator`` ``get_params`` and ``set_params``. Only what an
installed package declares so is ever loaded, whatever a file says.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray
from fogml.entry_points import REGRESSORS as GROUP
from fogml.entry_points import loaded, origin
from fogml.errors import InputError, UnknownName, quoted
from fogml.features.features import Features
from fogml.models.folds import FOLDS
from fogml.models.names import MODEL_NAMES
from fogml.models.others_code import asked, fitted_to, predicted, saved_by
from fogml.models.parameters import expect_arrays
from fogml.models.scikit_learn import clone
from fogml.models.table import TrainingTable

FORMS = {
    "linear": "fogml.models.linear:LinearRegressor",
    "rbf": "fogml.models.rbf:RBFRegressor",
    "rbf-patent": "fogml.models.rbf:PatentRBFRegressor",
}
"""Forms of saved regressors, and where their classes are."""
SKOPS = "skops"
_PREDICTED_ROWS = 4096
_NEEDED = ("fit", "predict", "to_saved", "from_saved", "get_params", "set_params")


@cache
def own_regressors() -> dict[str, EntryPoint]:
    """The entry points of regressors that installed packages declare, by name; nothing is loaded yet.

    Raises
    ------
    InputError
        If two packages have one name.
    """
    found: dict[str, EntryPoint] = {}
    for point in entry_points(group=GROUP):
        other = found.setdefault(point.name, point)
        if other is not point:
            raise InputError(f"{origin(point)} in group '{GROUP}': {origin(other)} has this name already")
    return found


def own_regressor(name: str) -> Any:
    """The class of a regressor that an installed package declares.

    Raises
    ------
    InputError
        If it does not load, is no regressor that can be saved, or has the name of one of fogml's own.
    """
    point = own_regressors()[name]
    place = f"{origin(point)} in group '{GROUP}'"
    if name in FORMS or name in MODEL_NAMES or name == SKOPS:
        raise InputError(f"{place}: '{name}' is a regressor of fogml's own; the package has to name another")
    kind = loaded(point)
    lacking = [each for each in _NEEDED if not hasattr(kind, each)]
    if not inspect.isclass(kind) or lacking:
        raise InputError(
            f"{place}: {point.value} is no regressor; it lacks {', '.join(lacking) or 'a class'}"
        )
    return kind


def for_features(regressor: Any, features: Features, atoms: Sequence[FloatArray]) -> Any:
    """The unfitted regressor, made for features and training rows where it has such a way.

    ``atoms`` are the values of the features' atoms in each training run, shapes (n, a).
    """
    if hasattr(regressor, "for_features"):
        return regressor.for_features(features, np.concatenate(atoms))
    return regressor


def fit_regressor(regressor: Any, table: TrainingTable) -> Any:
    """Fit a regressor to a table, telling it runs, times and folds where its fit asks for them.

    Raises
    ------
    InputError
        If the rows are none that it can be fitted to: too few, as a rule.
    """
    takes = inspect.signature(regressor.fit).parameters
    told = {
        "groups": table.run_index,
        "time": table.time_s,
        "folds": table.block % FOLDS,
    }
    return fitted_to(regressor, table.X, table.y, {name: told[name] for name in told if name in takes})


def refit(regressor: Any, table: TrainingTable) -> Any:
    """A new regressor fitted to other rows, what was tuned being kept where the regressor can."""
    if hasattr(regressor, "refitted"):
        return regressor.refitted(table.X, table.y)
    return fit_regressor(clone(regressor), table)


def predict_rows(regressor: Any, columns: FloatArray) -> FloatArray:
    """Values for columns that are finite float64, shape (n,).

    Raises
    ------
    InputError
        If another's regressor can't be applied to them.
    """
    if hasattr(regressor, "predict_unchecked"):
        return np.asarray(regressor.predict_unchecked(columns))
    # Kernel methods hold a value for each row and each training row; so few rows at a time.
    starts = range(0, len(columns), _PREDICTED_ROWS)
    values = [predicted(regressor, columns[start : start + _PREDICTED_ROWS]) for start in starts]
    return np.concatenate(values) if values else np.empty(0)


def goes_on_linearly(regressor: Any) -> bool:
    """Whether a regressor goes on linearly in its inputs beyond its training rows."""
    return bool(getattr(regressor, "linear_beyond", False))


def parameter_count(regressor: Any) -> int:
    """Number of fitted parameters; of a regressor that saves none, of the numbers that it predicts from."""
    count = getattr(regressor, "parameter_count", None)
    if count is not None:
        with asked(regressor, "its parameter_count is no number"):
            return int(count() if callable(count) else count)
    if hasattr(regressor, "to_saved"):
        return sum(array.size for array in saved_by(regressor)[1].values())
    from fogml.models.sklearn_compact import numbers_of

    return numbers_of(regressor)


def weight_bytes(regressor: Any) -> int:
    """Bytes of a fitted regressor's arrays; of one that saves none, of those that it predicts from."""
    if hasattr(regressor, "to_saved"):
        return sum(array.nbytes for array in saved_by(regressor)[1].values())
    from fogml.models.sklearn_compact import bytes_of

    return bytes_of(regressor)


def regressor_to_saved(regressor: Any) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """A fitted regressor as JSON-ready values, with its form, and arrays.

    Raises
    ------
    InputError
        If it is neither fogml's, nor scikit-learn's, nor declared by an installed package.
    """
    if _is_sklearn(regressor):
        from fogml.models.sklearn_compact import dump_sklearn

        return {"form": SKOPS}, {"skops": dump_sklearn(regressor)}
    form = _form_among(FORMS, regressor)
    if form is None:
        form = _form_among({name: point.value for name, point in own_regressors().items()}, regressor)
        if form in FORMS:
            own_regressor(form)  # which refuses its name
    if form is not None:
        values, arrays = saved_by(regressor)
        return {"form": form, **values}, arrays
    raise InputError(
        f"{type(regressor).__name__}: cannot be saved; fogml's and scikit-learn's regressors can, and those "
        f"that an installed package declares (entry points '{GROUP}')"
    )


def regressor_from_saved(values: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Any:
    """The regressor that `regressor_to_saved` gave.

    Raises
    ------
    InputError
        If the form is not known or holds types that are not scikit-learn's.
    """
    values = dict(values)
    form = values.pop("form", None)
    if form == SKOPS:
        from fogml.models.sklearn_compact import load_sklearn

        if values:
            raise InputError(f"key {quoted('regressor.' + next(iter(values)))} does not belong there")
        expect_arrays(arrays, {"skops": (np.uint8, np.shape(arrays.get("skops", (0,))))})
        return load_sklearn(arrays["skops"])
    if isinstance(form, str) and form not in FORMS and form in own_regressors():
        kind = own_regressor(form)
        with asked(kind, "its from_saved does not take what is stored"):
            return kind.from_saved(values, arrays)
    if not isinstance(form, str) or form not in FORMS:
        raise UnknownName(
            f"regressor form {quoted(form)} is not known; known are "
            f"{', '.join([*FORMS, SKOPS, *own_regressors()])}, and those of packages that are installed"
        )
    module, name = FORMS[form].split(":")
    return getattr(import_module(module), name).from_saved(values, arrays)


def _form_among(homes: Mapping[str, str], regressor: Any) -> str | None:
    """The form of a regressor by the place of its class, ``module:Class``; None where it is none of these."""
    kind = type(regressor)
    for form, home in homes.items():
        module, name = home.split(":")
        if kind.__name__ == name and kind.__module__.startswith(module.rsplit(".", 1)[0]):
            return form
    return None


def _is_sklearn(regressor: Any) -> bool:
    return type(regressor).__module__.split(".")[0] == "sklearn"
