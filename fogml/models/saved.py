"""Saved models: ``model.json`` and ``weights.safetensors`` in a folder, whole or not at all.

``model.json`` (schema ``fogml.model/2``)::

    {"schema": "fogml.model/2",
     "kind": "M2",                      the name by which the model was asked for
     "form": "features",                which class reads it: a key of FORMS
     "model": {...},                    features' text and settings, as the class writes them
     "card": {...},                     unit, axis, hashes of the training runs, version, box, ...
     "interval": {...},                 half-widths of the prediction interval
     "parameters": 9, "bytes": 72,      size of the weights
     "sha256": "..."}                   over all of the above and the bytes of the weights

Loading reads numbers and text and executes nothing. The hash tells whether anything was changed
since the model was saved, not who saved it; so every number and text is checked beside: kinds are
known, types are as they stand, numbers are finite, arrays are of the stated type and shape.
Scikit-learn's regressors are kept in skops' form inside the weights, and only a fixed list of types
is read back.
"""

from __future__ import annotations

import warnings
from importlib import import_module
from pathlib import Path
from typing import Any

from numpy.typing import NDArray
from pydantic import Field

from fogml.errors import InputError, UnknownName, quoted
from fogml.json_files import content_hash, json_object, json_text, read_bytes, read_json
from fogml.models.base import DriftModel
from fogml.models.card import TrainingCard
from fogml.models.intervals import saved_intervals
from fogml.models.names import PRESETS
from fogml.models.parameters import arrays_from_bytes, arrays_to_bytes
from fogml.models.regressors import SKOPS, own_regressors
from fogml.outputs import whole_folder
from fogml.strict import Strict, as_written, strictly

SCHEMA = "fogml.model/2"
MODEL_FILE = "model.json"
WEIGHTS_FILE = "weights.safetensors"
FORMS: dict[str, tuple[str, tuple[str, ...] | None]] = {
    "none": ("fogml.models.baselines:NoCompensation", ("none",)),
    "mean": ("fogml.models.baselines:MeanModel", ("mean",)),
    "features": (
        "fogml.models.feature_model:FeatureModel",
        (
            "features",
            "polynomial",
            *PRESETS,
            "rbf",
            "rbf-patent",
            "mixed-effects",
            "combination",
            "shared",
            "causes",
        ),
    ),
    "sklearn": ("fogml.models.sklearn_model:SklearnModel", None),
    "joint": ("fogml.models.joint:JointModel", ("joint", "joint-patent")),
    "auto": ("fogml.models.auto:AutoModel", ("auto",)),
}
"""Forms of saved models: where their classes are, and the kinds that they can be; None: the class tells."""
_REMEDY = "name the folder that 'fogml train' wrote the model into, e.g. DIR/model; or train again"
_MOST_MODEL_BYTES = 16 << 20
_MOST_WEIGHT_BYTES = 1 << 30
# The largest regressors of scikit-learn, forests, take a tenth of it.


class _Document(Strict):
    """The content of `MODEL_FILE`."""

    schema_: str = Field(alias="schema")
    kind: str
    form: str
    model: dict[str, Any]
    card: dict[str, Any]
    interval: dict[str, Any]
    parameters: int = Field(ge=0)
    bytes: int = Field(ge=0)
    sha256: str


def as_model(found: Any) -> DriftModel:
    """What has to be a drift model.

    Raises
    ------
    InputError
        If it is another thing, as a bare regressor.
    """
    from fogml.models.base import DriftModel

    if not isinstance(found, DriftModel):
        kind = type(found).__name__
        raise InputError(
            f"a drift model is needed, found {kind}; fogml.make_model makes one, of a bare regressor "
            f"fogml.models.feature_model.FeatureModel('T, dT', {kind}())"
        )
    return found


def save_model(model: DriftModel, folder: str | Path) -> None:
    """Write a fitted model into a folder; existing model files there are replaced.

    Raises
    ------
    InputError
        If the folder can't be written, the model is of no known kind, or holds what can't be saved
        without pickle.
    """
    document, weights = _saved_document(as_model(model))
    model_of_form(document["form"], document["kind"])
    text = json_text(document, MODEL_FILE, indent=1)
    with whole_folder(folder) as staging:
        (staging / MODEL_FILE).write_text(text + "\n", encoding="utf-8")
        (staging / WEIGHTS_FILE).write_bytes(weights)


def model_hash(model: DriftModel) -> str:
    """The hash that a fitted model is saved with: SHA-256 over its card and weights, in hexadecimal.

    Raises
    ------
    InputError
        If the model holds what can't be saved without pickle.
    """
    return str(_saved_document(model)[0]["sha256"])


def _saved_document(model: DriftModel) -> tuple[dict[str, Any], bytes]:
    """What `MODEL_FILE` and `WEIGHTS_FILE` hold of a model."""
    values, arrays = model_to_saved(model)
    weights = arrays_to_bytes(arrays)
    document = {
        "schema": SCHEMA,
        **values,
        "parameters": model.parameter_count(),
        "bytes": sum(array.nbytes for array in arrays.values()),
    }
    document["sha256"] = content_hash(document, {WEIGHTS_FILE: weights})
    return document, weights


def load_model(folder: str | Path) -> DriftModel:
    """The model of a folder that `save_model` wrote, of its ``model.json``, or of the results that hold it.

    Raises
    ------
    InputError
        If a file is missing, not of this schema, or anything was changed since the model was saved.

    Warns
    -----
    UserWarning
        If a model of fogml 0.1 has features with windows: while these fill, its drift is now another.
    """
    folder = Path(folder)
    if folder.name == MODEL_FILE:
        folder = folder.parent
    if not (folder / MODEL_FILE).is_file() and (folder / "model" / MODEL_FILE).is_file():
        folder = folder / "model"  # results of a training were named
    path = folder / MODEL_FILE
    if folder.is_file():
        raise InputError(f"{folder}: is a file; {_REMEDY}")
    values = read_json(path, _REMEDY, _MOST_MODEL_BYTES)
    if isinstance(values, dict) and values.get("schema") == "fogml.model/1":
        raise InputError(
            f"{path}: was saved by a version of fogml that kept no hash of the whole model; train it again"
        )
    json_object(values, str(path), SCHEMA, _REMEDY)
    weights = read_bytes(
        folder / WEIGHTS_FILE, f"it belongs beside {MODEL_FILE}: copy the whole folder", _MOST_WEIGHT_BYTES
    )
    stated = values.get("sha256")
    hashed = {key: value for key, value in values.items() if key != "sha256"}
    if content_hash(hashed, {WEIGHTS_FILE: weights}) != stated:
        raise InputError(
            f"{folder}: {MODEL_FILE} or {WEIGHTS_FILE} was changed, cut short or damaged after the model was "
            "saved, or they are of two models; copy the whole folder again or train again"
        )
    try:
        document = strictly(_Document, values)
        try:
            arrays = arrays_from_bytes(weights)
        except InputError as error:
            raise InputError(f"{WEIGHTS_FILE}: {error}") from None
        model = model_from_saved(document.model_dump(), arrays)
        size = sum(array.nbytes for array in arrays.values())
        # Which of another library's numbers are parameters may change with its version.
        counted = document.parameters if SKOPS in arrays else model.parameter_count()
        if (counted, size) != (document.parameters, document.bytes):
            raise InputError("keys 'parameters' and 'bytes' are not those of the weights")
    except InputError as error:
        remedy = (
            "install the package that declares it" if isinstance(error, UnknownName) else "train it again"
        )
        raise InputError(f"{path}: {error}; {remedy}") from None
    features, version = model.features_, document.card["fogml_version"]
    if features is not None and features.window_s and version.startswith("0.1."):
        warnings.warn(
            f"{path}: made by fogml {version}, whose rates were 0 until their window was full; now they "
            f"begin at once. In the first {features.window_s:g} s of a run and after a gap (flag 2) its "
            "drift is another than then, else the same; train it again",
            stacklevel=2,
        )
    return model


def model_to_saved(model: DriftModel) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """A fitted model as JSON-ready values (kind, form, model, card, interval) and arrays."""
    model._check_fitted()
    own, arrays = model.to_saved()
    values = {
        "kind": model.kind,
        "form": model.form,
        "model": own,
        "card": as_written(model.card_),
        "interval": as_written(model.intervals_),
    }
    return values, arrays


def model_from_saved(values: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> DriftModel:
    """The model that `model_to_saved` gave."""
    model_class = model_of_form(values["form"], values["kind"])
    card = strictly(TrainingCard, values["card"], "card")
    intervals = saved_intervals(values["interval"])
    model = model_class.from_saved({**values["model"], "kind": values["kind"]}, arrays, card)
    if model.kind != values["kind"]:
        raise InputError(f"key 'kind': {quoted(values['kind'])}, but the model is of kind '{model.kind}'")
    model.card_ = card
    model.intervals_ = intervals
    return model


def model_of_form(form: str, kind: str) -> type[DriftModel]:
    """The class of saved models of a form and kind.

    Raises
    ------
    InputError
        If the form is not known, or has no such kind.
    """
    if form not in FORMS:
        raise InputError(f"form {quoted(form)} is not known; known are {', '.join(FORMS)}")
    home, kinds = FORMS[form]
    own = form == "features" and kind not in (kinds or ()) and kind in own_regressors()
    if kinds is not None and kind not in kinds and not own:
        others = ", and those of packages that are installed" if form == "features" else ""
        raise (UnknownName if others else InputError)(
            f"kind {quoted(kind)} is no model of form '{form}'; known are {', '.join(kinds)}{others}"
        )
    module, name = home.split(":")
    found: type[DriftModel] = getattr(import_module(module), name)
    return found
