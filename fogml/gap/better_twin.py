"""What a diagnosis leaves for simulation: covariance, courses of effects, and the twin with all of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag

from fogml.gap.fitted_model import Fit
from fogml.gap.how_far import Foretold
from fogml.gap.inference import Inference
from fogml.gap.model import within_limits
from fogml.gap.posterior import Cause
from fogml.gap.result import Diagnosis
from fogml.gap.result_parts import Counterfactual, Course
from fogml.gap.rows import READ
from fogml.gap.step_settings import Reported
from fogml.gap.where import averages
from fogml.numerals import with_error
from fogml.runs.run import Run
from fogml.signals.noise_expectation import floor_square
from fogml.twin.draws import parameter_values
from fogml.twin.effect import Effect, NoiseEffect
from fogml.twin.plant.fit import PlantFit, fit_plant
from fogml.twin.plant.standard import QUANTITIES
from fogml.twin.registry import effect
from fogml.twin.twin import Twin
from fogml.twin.uncertainty import Suspected, Uncertainty

NOT_LINEAR = ("line", "power_cycles", "sensor_steps")
"""Families that no size moves alone: of a phase of their own, or not in proportion to their size."""


def counterfactuals(found: Inference, fit: Fit, named: Sequence[Cause]) -> tuple[Counterfactual, ...]:
    """Every run with courses of what is named, of what the twin has, and of others at their usual size."""
    settings, told = found.setting.priors.reported, []
    sizes = {effect.id: effect.amplitude for effect in fit.effects}
    for i, rows in enumerate(found.scene.runs):
        windows = averages(rows, settings.averaging_s)
        courses = [c for c in _courses(found, fit.foretold, named, sizes, i) if np.isfinite(c.values).all()]
        acting = np.sum([c.values for c in courses if c.acts], axis=0) if courses else 0.0
        # What is replayed in all, less what acts: the twin's own effects are part of its replay.
        whole = rows.recorded - fit.foretold.left_on(i)
        floor = float(floor_square(found.field.whitening.noise, windows.time, windows.window_s)) ** 0.5
        averaged = [replace(c, values=windows.of(c.values)) for c in courses]
        least = settings.shown_share * floor
        told.append(
            Counterfactual(
                run=rows.run.name,
                held_out=i >= found.scene.fitted,
                averaging_s=windows.window_s,
                time_s=windows.time,
                temperature_degc=windows.of(rows.temperature),
                recorded=windows.of(rows.recorded),
                replayed=windows.of(whole - acting),
                floor=floor,
                courses=tuple(c for c in averaged if c.acts or float(np.std(c.values)) > least),
            )
        )
    return tuple(told)


def _courses(
    found: Inference, after: Foretold, named: Sequence[Cause], sizes: Mapping[str, float], run: int
) -> list[Course]:
    scene, values = found.scene, found.setting.values
    rows = scene.runs[run]
    on = {declared.id: setting for declared, setting in found.plant.on}
    by_id = {cause.ids[0]: cause for cause in named}
    courses = []
    for id, declared in scene.candidates.items():
        acts = id in by_id or id in on
        # A size that acts out of proportion moves no course of its own: it stays in what is replayed.
        if declared.amplitudes or not (acts or _linear(declared)):
            continue
        if id in by_id:
            size, course = sizes[id], after.of_cause(run, by_id[id])
        elif id in on:
            size = on[id].amplitude
            course = rows.made(declared, size, on[id].shape, values)
        else:
            size = declared.amplitude.typical(scene.grade)
            course = rows.made(declared, size, declared.default_shape(scene.grade), values)
        courses.append(Course(id, size, declared.amplitude.unit, acts, declared.amplitude.signed, course))
    return courses


def _linear(declared: Effect) -> bool:
    """Whether an effect of the catalogue is in proportion to its size and the same on each run."""
    random = isinstance(declared, NoiseEffect) and not declared.steady
    return not (random or declared.drawn_per_run or declared.family in NOT_LINEAR or declared.amplitudes)


def better_twin(
    twin: Twin, found: Diagnosis, runs: Sequence[Run], least: float = Reported.suspected
) -> tuple[Twin, tuple[str, ...]]:
    """A diagnosed twin with what is known and not known of it, and what was fitted in sentences.

    Parameters
    ----------
    twin
        With the constants and effects that were found.
    found
        The diagnosis.
    runs
        Fit runs, for the plant; without any it stays as it was.
    least
        A cause is kept as suspected from this probability on.
    """
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
        units = {f"plant.{quantity.name}": quantity.unit for quantity in QUANTITIES}
        sizes = ", ".join(
            f"{name.removeprefix('plant.')} {with_error(value, sd)} {units.get(name, '')}".rstrip()
            for name, value, sd in zip(fitted.names, scale, deviations)
        )
        told.append(f"Plant fitted to recorded temperatures: {sizes}")
    elif why_not:
        told.append(why_not)
    suspected = {}
    for f in (*found.found, *found.suspected):
        if not f.named and f.probability >= least and f.effect not in twin.settings:
            shape = {name: value.value for name, value in f.parameters.items()}
            amplitude, held = within_limits(f.effect, f.amplitude.value, shape, twin.grade)
            suspected[f.effect] = Suspected(f.probability, amplitude, held)
    if suspected:
        told.append(f"Suspected, and not on in twin.yaml: {', '.join(suspected)}")
    source = f"diagnosis of {' and '.join(found.fit)}"
    uncertainty = Uncertainty(tuple(names), block_diag(*matrices), source) if names else None
    return replace(twin, uncertainty=uncertainty, suspected=suspected), tuple(told)


def diagnosed_plant(twin: Twin, runs: Sequence[Run]) -> tuple[PlantFit | None, str]:
    """The plant fitted to what runs recorded, or none and, where it could be, why not.

    An effect that follows a temperature which no run recorded was found with that temperature as the twin's
    own plant has it; with another plant its numbers would no longer be right, so that one stays.
    """
    if not runs or not all("T_chamber" in run.columns for run in runs):
        return None, ""
    recorded = set.intersection(*(set(run.columns) for run in runs)) | set(READ)
    for id in twin.settings:
        lacking = sorted(n for n in effect(id).needs if n.startswith("T_") and n not in recorded)
        if lacking:
            return None, f"Plant as it was: {id} follows {lacking[0]}, which was not recorded"
    return fit_plant(twin, runs), ""
