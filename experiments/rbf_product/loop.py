"""Training again until the design index is met: on the validation run, as printed, and on training folds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from experiments.rbf_product.world import Made, deviation, made, unit
from fogml.models.base import DriftModel
from fogml.models.names import make_model
from fogml.validation.index_search import train_until_index

FEATURES = "T, dT, T*dT"


def loops(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Rms of averages [deg/h] on the validation run, on a fresh one of its kind, and at another rate."""
    found: dict[str, list[dict[str, float]]] = {}
    for seed in settings["seeds"]:
        twin = unit(settings, settings["product"])
        train, validation, fresh = (
            made(twin, 10, way, 100 * seed + k, settings["sample"])
            for k, way in enumerate(("up", "down", "down"))
        )
        both = made(twin, 10, "both", 100 * seed + 3, settings["sample"])
        faster = made(twin, 60, "both", 100 * seed + 4, settings["sample"])
        judged = {"validation": validation, "fresh": fresh, "60 degC/h": faster}
        for name, model in _found(train, both, validation, settings).items():
            told = {run: deviation(model, test, settings["averaging"])["rms"] for run, test in judged.items()}
            told["printed"] = _printed(model, train, validation, settings["averaging"])
            found.setdefault(name, []).append(told)
    return {
        name: {key: float(np.median([row[key] for row in rows])) for key in rows[0]}
        for name, rows in found.items()
    }


def _found(train: Made, both: Made, validation: Made, settings: Mapping[str, Any]) -> dict[str, DriftModel]:
    told, averaging = settings["loop"], settings["averaging"]
    tried = [
        make_model("rbf-patent", FEATURES, parameters={"max_centres": centres, "width": width}).fit(train.run)
        for centres in told["centres"]
        for width in told["widths"]
    ]
    least = min(tried, key=lambda model: deviation(model, validation, averaging)["rms"])
    index = told["index"]
    return {
        "trained up, chosen on the validation run": least,
        "trained up, chosen on its folds": make_model("rbf-patent", FEATURES).fit(train.run),
        "trained up and down, patent's form, its folds": make_model("rbf-patent", FEATURES).fit(both.run),
        "trained up and down, fogml's search on folds": train_until_index(
            both.run, index, averaging_s=averaging
        ).model,
    }


def _printed(model: DriftModel, train: Made, validation: Made, averaging_s: float) -> float:
    """Step 7 as printed: the training run's Q1 less the validation run's Q2, rms of averages [deg/h]."""
    width = round(averaging_s / train.run.sample_s)
    rows = min(len(train.run), len(validation.run)) // width * width
    measured = train.run.error_deg_h - train.run.error_deg_h.mean()
    left = measured[:rows] - model.predict(validation.run)[:rows]
    return float(np.sqrt(np.mean(left.reshape(-1, width).mean(axis=1) ** 2)))
