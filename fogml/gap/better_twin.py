"""The twin that a diagnosis leaves: what was found with its covariance, a fitted plant, what is suspected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import block_diag

from fogml.gap.twin_model import within_limits
from fogml.runs.run import Run
from fogml.twin.draws import parameter_values
from fogml.twin.plant.fit import PlantFit, fit_plant
from fogml.twin.registry import effect
from fogml.twin.twin import Twin
from fogml.twin.uncertainty import Suspected, Uncertainty

if TYPE_CHECKING:
    from fogml.gap.result import Diagnosis

LEAST_SUSPECTED = 0.05
"""A cause is kept as suspected from this probability on."""
RECORDED = ("T", "T_in", "T_out")
"""What an effect may need and a plant not change, any run of a coil having it."""


def better_twin(twin: Twin, found: Diagnosis, runs: Sequence[Run]) -> tuple[Twin, tuple[str, ...]]:
    """A diagnosed twin with what is known and not known of it, and what was fitted in sentences.

    Parameters
    ----------
    twin
        With the constants and effects that were found.
    found
        The diagnosis.
    runs
        Fit runs, for the plant; without any it stays as it was.
    """
    source = f"diagnosis of {' and '.join(found.fit)}"
    told, matrices, names = [], [], list[str]()
    if found.uncertainty is not None:
        names += found.uncertainty.names
        matrices.append(found.uncertainty.covariance)
    fitted, why_not = diagnosed_plant(twin, runs)
    if fitted is not None:
        twin = replace(twin, plant=fitted.plant)
        values = parameter_values(twin)
        scale = np.array([values[name] for name in fitted.names])
        names += fitted.names
        matrices.append(fitted.covariance * np.outer(scale, scale))
        deviations = scale * np.sqrt(np.diag(fitted.covariance))
        sizes = ", ".join(
            f"{name.removeprefix('plant.')} {value:.3g} ± {sd:.2g}"
            for name, value, sd in zip(fitted.names, scale, deviations)
        )
        told.append(f"Plant fitted to recorded temperatures: {sizes}")
    elif why_not:
        told.append(why_not)
    on = set(twin.settings)
    unsure = [f for f in (*found.found, *found.suspected) if not f.named and f.probability >= LEAST_SUSPECTED]
    suspected = {}
    for f in unsure:
        if f.effect not in on:
            shape = {name: value.value for name, value in f.parameters.items()}
            amplitude, held = within_limits(f.effect, f.amplitude.value, shape, twin.grade)
            suspected[f.effect] = Suspected(f.probability, amplitude, held)
    if suspected:
        told.append(f"Suspected, and not on in twin.yaml: {', '.join(suspected)}")
    uncertainty = Uncertainty(tuple(names), block_diag(*matrices), source) if names else None
    return replace(twin, uncertainty=uncertainty, suspected=suspected), tuple(told)


def diagnosed_plant(twin: Twin, runs: Sequence[Run]) -> tuple[PlantFit | None, str]:
    """The plant fitted to what runs recorded, or none and, where it could be, why not.

    An effect that follows a temperature which no run recorded was found with that temperature as the twin's
    own plant has it; with another plant its numbers would no longer be right, so that one stays.
    """
    if not runs or not all("T_chamber" in run.columns for run in runs):
        return None, ""
    recorded = set.intersection(*(set(run.columns) for run in runs)) | set(RECORDED)
    asked = {
        id: sorted(n for n in effect(id).needs if n.startswith("T_") and n not in recorded)
        for id in twin.settings
    }
    for id, lacking in asked.items():
        if lacking:
            return None, f"Plant as it was: {id} follows {lacking[0]}, which was not recorded"
    return fit_plant(twin.plant, runs), ""
