"""What the diagnoses of a fleet's units tell together: shared causes, units apart, what to change."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.fleet.shares import (
    apart,
    bayes_factor,
    discoveries,
    prevalence,
    probability_of_difference,
    share_interval,
)
from fogml.gap.result import NAMED
from fogml.gap.settings import Priors
from fogml.numerals import short
from fogml.signals.restricted import random_effects
from fogml.strict import Strict, strictly

Probability = Annotated[float, Field(ge=0.0, le=1.0)]


@dataclass(frozen=True)
class LineRules:
    """What is told of a line of units.

    Attributes
    ----------
    false_share
        Of the units that are said to stand apart, the share that may be wrong in the mean.
    shared
        A cause is the line's if more than half of its units have it with this probability; by lot likewise.
    rare
        A cause is rare where no more than this share of the units, or one alone, have it.
    """

    false_share: float = 0.05
    shared: float = 0.95
    rare: float = 0.1


RULES = LineRules()
"""Of a line's diagnosis unless others are given."""


class Cause(Strict, extra="ignore"):
    """A cause of a unit's gap, as its diagnosis tells it; `prior_probability` is that before the data."""

    effect: str
    members: list[str]
    probability: Probability
    prior_probability: Annotated[float, Field(gt=0.0, lt=1.0)]
    share: float | None
    place: str
    amplitude: float
    se: Annotated[float, Field(ge=0.0)]
    unit: str
    times_usual: float | None


class UnitDiagnosis(Strict, extra="ignore"):
    """What a unit's diagnosis tells the fleet: causes, the probability of something unknown, and the gap.

    `gap_square` is its mean square [(deg/h)^2]: what the twin with fitted constants leaves above the floor.
    """

    causes: list[Cause]
    unknown: Probability
    undetectable: list[str]
    gap_square: Annotated[float, Field(ge=0.0)]
    floor_square: Annotated[float, Field(ge=0.0)]
    covariates: dict[str, str] = {}


def unit_diagnosis(found: Any, covariates: Mapping[str, str]) -> dict[str, Any]:
    """What a `fogml.gap.result.Diagnosis` tells the fleet, JSON-ready."""
    # Where fitted constants do harm, the fit runs do not tell them: that is no gap of the line's.
    far = [item for item in found.how_far if item.recalibrated is not None and _told(item)]
    worst = max(far, key=lambda item: item.recalibrated, default=None)
    floor = 0.0 if worst is None else float(worst.floor) ** 2
    return UnitDiagnosis(
        causes=[
            Cause(
                effect=one.effect,
                members=list(one.members),
                probability=float(one.probability),
                prior_probability=float(one.prior_probability),
                share=None if one.share is None else float(one.share),
                place=one.place,
                amplitude=float(one.amplitude.value),
                se=float(one.amplitude.se),
                unit=one.amplitude.unit,
                times_usual=None if one.times_usual is None else float(one.times_usual),
            )
            for one in found.found
        ],
        unknown=float(found.unknown.probability),
        undetectable=list(found.undetectable),
        gap_square=0.0 if worst is None else max(float(worst.recalibrated) ** 2 - floor, 0.0),
        floor_square=floor,
        covariates=dict(covariates),
    ).model_dump()


def _told(item: Any) -> bool:
    return bool(item.before is None or item.recalibrated <= item.before)


def line_diagnosis(
    labels: Sequence[str], told: Sequence[Mapping[str, Any]], rules: LineRules = RULES
) -> dict[str, Any]:
    """What n units' diagnoses tell together, JSON-ready.

    Parameters
    ----------
    labels
        Serial number and axis of each.
    told
        As `unit_diagnosis` gives them.
    rules
        When a cause is shared or rare, and how often a unit may be told apart falsely.

    Raises
    ------
    InputError
        If one is none.
    """
    units = [_read(label, one) for label, one in zip(labels, told, strict=True)]
    effects = sorted({cause.effect for unit in units for cause in unit.causes})
    causes = [_cause(effect, labels, units, rules) for effect in effects]
    causes.sort(key=lambda one: -one["energy_share"])
    unknown = prevalence([bayes_factor(unit.unknown, Priors.unknown) for unit in units])
    return {
        "units": len(units),
        "causes": causes,
        "unknown": {"prevalence": unknown.mean, "prevalence_ci90": list(unknown.ci90)},
        "gap_rms": _rms([unit.gap_square for unit in units]),
        "apart": _apart(labels, units, causes, rules),
    }


def _read(label: str, told: Mapping[str, Any]) -> UnitDiagnosis:
    try:
        return strictly(UnitDiagnosis, told, "diagnosis")
    except InputError as error:
        raise InputError(f"{label}: its outcome holds no diagnosis ({error}); run the fleet again") from None


def _of(unit: UnitDiagnosis, effect: str) -> Cause | None:
    return next((cause for cause in unit.causes if cause.effect == effect), None)


def _probability(unit: UnitDiagnosis, effect: str) -> float:
    """That a unit has a cause: of an effect that its diagnosis does not list, none is seen."""
    cause = _of(unit, effect)
    return cause.probability if cause is not None else 0.0


def _factor(unit: UnitDiagnosis, effect: str) -> float:
    """Of a cause that a unit's diagnosis does not list, none."""
    cause = _of(unit, effect)
    return 0.0 if cause is None else bayes_factor(cause.probability, cause.prior_probability)


def _cause(
    effect: str, labels: Sequence[str], units: Sequence[UnitDiagnosis], rules: LineRules
) -> dict[str, Any]:
    """One cause on the line."""
    # Units whose runs could not show it say nothing on how common it is.
    showing = [unit for unit in units if effect not in unit.undetectable or _of(unit, effect) is not None]
    common = prevalence([_factor(unit, effect) for unit in showing])
    named = [(label, cause) for label, unit in zip(labels, units) if (cause := _of(unit, effect)) is not None]
    sure = [(label, cause) for label, cause in named if cause.probability >= NAMED]
    by_size = sorted(named, key=lambda item: -item[1].probability)
    line = random_effects([c.amplitude for _, c in sure], [c.se for _, c in sure]) if sure else None
    energy = np.array([_energy(unit, effect) for unit in units])
    gap = np.array([unit.gap_square for unit in units])
    return {
        "effect": effect,
        "members": sorted({member for _, cause in named for member in cause.members}),
        "place": by_size[0][1].place,
        "units_told": len(showing),
        "units_named": len(sure),
        "prevalence": common.mean,
        "prevalence_ci90": list(common.ci90),
        "shared": bool(common.over_half >= rules.shared),
        "amplitude": None if line is None else line.mean,
        "amplitude_se": None if line is None else line.se,
        "amplitude_ci90": None if line is None else list(line.interval()),
        "between_units": None if line is None or np.isnan(line.between) else line.between,
        "unit": by_size[0][1].unit,
        "energy_share": float(energy.sum() / gap.sum()) if gap.sum() > 0.0 else 0.0,
        "energy_share_ci90": list(share_interval(energy, gap)),
        "gap_rms_without": _rms(gap - energy),
        "depends_on": _depends(effect, showing, rules),
    }


def _energy(unit: UnitDiagnosis, effect: str) -> float:
    """What of a unit's gap a cause makes, in the mean over whether it acts [(deg/h)^2]."""
    cause = _of(unit, effect)
    if cause is None or cause.share is None:
        return 0.0
    return cause.probability * min(max(cause.share, 0.0), 1.0) * unit.gap_square


def _rms(squares: Sequence[float] | FloatArray) -> float:
    return float(np.sqrt(np.maximum(np.mean(squares), 0.0)))


def _depends(effect: str, units: Sequence[UnitDiagnosis], rules: LineRules) -> list[dict[str, Any]]:
    """What is known of production that a cause goes with, and how common it is with each of its values."""
    told = []
    for name in sorted({name for unit in units for name in unit.covariates}):
        groups: dict[str, list[float]] = defaultdict(list)
        for unit in units:
            if name in unit.covariates:
                groups[unit.covariates[name]].append(_factor(unit, effect))
        # Where every unit has a value of its own there is nothing to compare.
        if not 2 <= len(groups) <= sum(map(len, groups.values())) / 2:
            continue
        probability = probability_of_difference(list(groups.values()))
        if probability >= rules.shared:
            shares = {value: prevalence(group).mean for value, group in sorted(groups.items())}
            told.append({"name": name, "probability": probability, "prevalence": shares})
    return told


def _apart(
    labels: Sequence[str],
    units: Sequence[UnitDiagnosis],
    causes: Sequence[Mapping[str, Any]],
    rules: LineRules,
) -> list[dict[str, Any]]:
    """Units whose size of a cause is unlike the others', that have a rare one, or lack a shared one."""
    told: list[dict[str, Any]] = []
    tested: list[tuple[str, str, str, float]] = []
    for cause in causes:
        effect = cause["effect"]
        has = [(label, one) for label, unit in zip(labels, units) if (one := _of(unit, effect)) is not None]
        sure = [(label, one) for label, one in has if one.probability >= NAMED]
        values, errors = [one.amplitude for _, one in sure], [one.se for _, one in sure]
        for (label, one), p in zip(sure, apart(values, errors)):
            size = f"{short(one.amplitude)} {one.unit}, the line's is {short(cause['amplitude'])}"
            tested.append((label, effect, size, float(p)))
        rare = cause["prevalence_ci90"][1] < 0.5 and len(sure) <= max(1.0, rules.rare * cause["units_told"])
        for label, _ in sure:
            if rare and len(units) > 3:
                why = f"has it, as {cause['units_named']} of {cause['units_told']} units do"
                told.append({"unit": label, "effect": effect, "kind": "rare", "why": why})
        if cause["shared"]:
            lacking = [
                label
                for label, unit in zip(labels, units)
                if _probability(unit, effect) < 1.0 - rules.shared and effect not in unit.undetectable
            ]
            told += [
                {
                    "unit": label,
                    "effect": effect,
                    "kind": "without",
                    "why": "does not show it, most others do",
                }
                for label in lacking
            ]
    found = discoveries([p for *_, p in tested], rules.false_share)
    sizes_apart = [
        {"unit": label, "effect": effect, "kind": "size", "why": why, "p_value": p}
        for (label, effect, why, p), is_told in zip(tested, found)
        if is_told
    ]
    return [*sizes_apart, *told]
