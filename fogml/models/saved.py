"""Saved models: ``model.json`` and ``weights.safetensors`` in a folder, whole or not at all.

``model.json`` (schema ``fogml.model/1``)::

    {"schema": "fogml.model/1",
     "kind": "M2",                      the name by which the model was asked for
     "form": "features",                which class reads it: a key of FORMS
     "model": {...},                    features' text and settings, as the class writes them
     "card": {...},                     unit, axis, hashes of the training runs, version, box, ...
     "interval": {...},                 half-widths of the prediction interval
     "parameters": 9, "bytes": 72,      size of the weights
     "weights_sha256": "..."}           of weights.safetensors, so that the two files belong together

Loading reads numbers and text and executes nothing. Scikit-learn's regressors are kept in
skops' form inside the weights, and only scikit-learn's own types are read back.
"""

from __future__ import annotations

import hashlib
import json
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.json_files import json_text
from fogml.models.base import DriftModel
from fogml.models.card import TrainingCard
from fogml.models.intervals import Intervals
from fogml.outputs import whole_folder

SCHEMA = "fogml.model/1"
MODEL_FILE = "model.json"
WEIGHTS_FILE = "weights.safetensors"
FORMS = {
    "none": "fogml.models.baselines:NoCompensation",
    "mean": "fogml.models.baselines:MeanModel",
    "features": "fogml.models.feature_model:FeatureModel",
    "sklearn": "fogml.models.sklearn_model:SklearnModel",
    "joint": "fogml.models.joint:JointModel",
    "auto": "fogml.models.auto:AutoModel",
}
"""Forms of saved models, and where their classes are."""
_KEYS = {"schema", "kind", "form", "model", "card", "interval", "parameters", "bytes", "weights_sha256"}


def save_model(model: DriftModel, folder: str | Path) -> None:
    """Write a fitted model into a folder; existing model files there are replaced.

    Raises
    ------
    InputError
        If the folder can't be written, or the model holds what can't be saved without pickle.
    """
    values, arrays = model_to_saved(model)
    weights = _weights_bytes(arrays)
    document = {
        "schema": SCHEMA,
        **values,
        "parameters": model.parameter_count(),
        "bytes": sum(array.nbytes for array in arrays.values()),
        "weights_sha256": hashlib.sha256(weights).hexdigest(),
    }
    text = json_text(document, MODEL_FILE, indent=1)
    with whole_folder(folder) as staging:
        (staging / MODEL_FILE).write_text(text + "\n", encoding="utf-8")
        (staging / WEIGHTS_FILE).write_bytes(weights)


def load_model(folder: str | Path) -> DriftModel:
    """The model in a folder that `save_model` wrote, or whose ``model.json`` is given.

    Raises
    ------
    InputError
        If a file is missing, cut short, damaged, or not of this schema.
    """
    folder = Path(folder)
    if folder.name == MODEL_FILE:
        folder = folder.parent
    document = _read_document(folder / MODEL_FILE)
    arrays = _read_weights(folder / WEIGHTS_FILE, document["weights_sha256"])
    return model_from_saved(document, arrays, str(folder / MODEL_FILE))


def model_to_saved(model: DriftModel) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """A fitted model as JSON-ready values (kind, form, model, card, interval) and arrays."""
    model._check_fitted()
    own, arrays = model.to_saved()
    values = {
        "kind": model.kind,
        "form": model.form,
        "model": own,
        "card": model.card_.as_dict(),
        "interval": model.intervals_.as_dict(),
    }
    return values, arrays


def model_from_saved(values: dict[str, Any], arrays: dict[str, NDArray[Any]], source: str) -> DriftModel:
    """The model that `model_to_saved` gave; `source` names it in messages.

    Raises
    ------
    InputError
        If the values are not those of a saved model.
    """
    try:
        model_class = model_of_form(str(values["form"]))
        card = TrainingCard.from_dict(values["card"])
        intervals = Intervals.from_dict(values["interval"])
        own = {"kind": str(values["kind"]), **values["model"]}
        model = model_class.from_saved(own, arrays, card)
    except InputError as error:
        raise InputError(f"{source}: {error}") from None
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise InputError(f"{source}: not a whole saved model ({error!r}); train it again") from None
    model.card_ = card
    model.intervals_ = intervals
    return model


def model_of_form(form: str) -> type[DriftModel]:
    """The class of saved models of a form.

    Raises
    ------
    InputError
        If the form is not known.
    """
    if form not in FORMS:
        raise InputError(
            f"form '{form}' is not known (known are {', '.join(FORMS)}); "
            "the model was written by another version of fogml, or damaged: train it again"
        )
    module, name = FORMS[form].split(":")
    found: type[DriftModel] = getattr(import_module(module), name)
    return found


def _read_document(path: Path) -> dict[str, Any]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(
            f"{path}: no such file; name the folder that 'fogml train' wrote the model into, e.g. DIR/model"
        ) from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not text; name the folder of a saved model") from None
    except json.JSONDecodeError as error:
        raise InputError(
            f"{path}, line {error.lineno}: cut short or damaged ({error.msg}); copy it again or train again"
        ) from None
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        found = document.get("schema") if isinstance(document, dict) else type(document).__name__
        raise InputError(f"{path}: schema '{found}', expected '{SCHEMA}'; name the folder of a saved model")
    missing, unknown = _KEYS - document.keys(), document.keys() - _KEYS
    if missing or unknown:
        fault = f"key '{min(missing)}' is missing" if missing else f"unknown key '{min(unknown)}'"
        raise InputError(f"{path}: {fault}; copy the model again or train again")
    return document


def _weights_bytes(arrays: dict[str, NDArray[Any]]) -> bytes:
    from safetensors.numpy import save

    return bytes(save({name: np.ascontiguousarray(array) for name, array in arrays.items()}))


def _read_weights(path: Path, sha256: str) -> dict[str, NDArray[Any]]:
    from safetensors import SafetensorError
    from safetensors.numpy import load

    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise InputError(
            f"{path}: no such file; it belongs beside {MODEL_FILE}: copy the whole folder"
        ) from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    if hashlib.sha256(data).hexdigest() != sha256:
        raise InputError(
            f"{path}: cut short, damaged, or of another model than {MODEL_FILE}; "
            "copy the whole folder again or train again"
        )
    try:
        return dict(load(data))
    except SafetensorError as error:
        raise InputError(f"{path}: damaged ({error}); train it again") from None
