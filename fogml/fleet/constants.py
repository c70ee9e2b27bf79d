"""What the units of a fleet have in common: their constants, and the prior that these make for the next.

Every unit's drift is described by the same linear form, the shared part of a mixed-effects model
(`fogml.models.mixed_effects`). The rows of each run are condensed to a triangle that tells all of them, white
and slow noise counted (`fogml.models.generalised_least_squares`), so a fleet's constants can be put together
without its runs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.features.parse import parse_features
from fogml.fleet import FORM
from fogml.fleet.covariates import CovariateColumns, CovariateEffects, Covariates
from fogml.fleet.shares import each_unit, least_squares, widening
from fogml.intervals import SIGMA_PER_MEDIAN
from fogml.models.box import learn_box
from fogml.models.generalised_least_squares import runs_noise, shift_of_runs, shifted
from fogml.models.mixed_effects import OWN_PARTS, fit_mixed_effects
from fogml.models.mixed_effects_model import averages_of, composed
from fogml.models.prior import Prior, rarity
from fogml.models.size_priors import SizePriors
from fogml.models.table import run_rows
from fogml.runs.run import Run
from fogml.signals.distributions import chi2_ppf

_ROUNDS = 200
_TOLERANCE = 1e-6
_FREEDOM = 5.0
# Degrees of freedom of the fleet's t distribution: odd units do not pull at the mean.
_WORTH_UNITS = 2.0
# Units' worth of belief that constants vary independently, and that a covariate tells nothing of them.
_NOISE = ("N", "B", "K")
LEAST_UNITS = 3
ONE_RUN = SizePriors(slow=1e-4)
"""Priors of sizes where no unit has several runs: a run's slow drift can't be told from that of one cycle."""


@dataclass(frozen=True)
class UnitConstants:
    """A unit's training rows, condensed.

    Attributes
    ----------
    features
        The form.
    triangles
        Of each of r runs, equations ``[1, features, y]`` that tell of the constants what its rows do, of unit
        noise but for the run's shift, shape (r, m, k + 2).
    noise
        N, B and K of the rows' noise, as `fogml.signals.noise_model.NoiseModel` has them.
    unseen_shift
        Standard deviation of flicker slower than a run [deg/h], which shifts it as a whole.
    rows
        Number of averaged rows.
    shift, scale
        Mean and standard deviation of the features, shape (k,).
    box
        Range of each of the features' atoms.
    covariates
        What is known of the unit's production.
    own
        Sizes of the runs' own parts, by their names in `fogml.models.mixed_effects.OWN_PARTS` [deg/h]; shift
        and slow drift where there are several runs.
    """

    features: str
    triangles: FloatArray
    noise: dict[str, float]
    unseen_shift: float
    rows: int
    shift: FloatArray
    scale: FloatArray
    box: dict[str, list[float]]
    covariates: dict[str, str] = field(default_factory=dict)
    own: dict[str, float] = field(default_factory=dict)

    @classmethod
    def of(
        cls, runs: Sequence[Run], features: str = FORM, covariates: Covariates | None = None
    ) -> UnitConstants:
        """The constants of a unit from its training runs, in any features, those with memory among them.

        Raises
        ------
        InputError
            If the runs lack a temperature of the form, or are too short for it.
        """
        form = parse_features(features)
        rows = [run_rows(run, form) for run in runs]
        learn_box(form, [part.atoms for part in rows])
        table = composed(averages_of(rows), form)
        if len(table) < 2 * (len(form) + 1):
            raise InputError(f"{runs[0].name}: {len(table)} rows are too few for the constants of {features}")
        scale = np.where(table.X.std(axis=0) > 0.0, table.X.std(axis=0), 1.0)
        # One run can't tell what goes slowly from its temperature; of several the rows tell, not a prior.
        several = SizePriors(own_spread=SizePriors.noise_spread)
        found = fit_mixed_effects(table, form.terms, several if len(runs) > 1 else ONE_RUN)
        noise = runs_noise(table, found.sizes["noise"])
        triangles = noise.triangles(table, np.column_stack([np.ones(len(table)), table.X / scale]))
        own = {name: found.sizes[name] for name in (OWN_PARTS[1:] if len(runs) > 1 else OWN_PARTS[2:])}
        if len(runs) > 1:
            median = several.shift * (float(table.y.std()) or 1.0)
            own[OWN_PARTS[0]] = shift_of_runs([triangles], median, several.own_spread)
        box = {name: [float(low), float(high)] for name, (low, high) in form.box.items()}
        known = dict(covariates or {})
        shift = table.X.mean(axis=0)
        triangles *= np.concatenate([[1.0], scale, [1.0]])
        density = {name: getattr(noise.model, name) for name in _NOISE}
        unseen = noise.unseen_shift
        return cls(form.text, triangles, density, unseen, len(table), shift, scale, box, known, own)

    def in_columns(
        self, shift: FloatArray, scale: FloatArray, own_shift: float | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Information and image of the rows in the columns ``[1, (x - shift) / scale]``.

        `own_shift` is the size of a run's own shift [deg/h], `unseen_shift` where None.
        """
        width = len(shift)
        change = np.zeros((width + 1, width + 1))
        change[0, 0] = 1.0
        change[0, 1:] = -shift / scale
        change[1:, 1:] = np.diag(1.0 / scale)
        rows = shifted(self.triangles, self.unseen_shift if own_shift is None else own_shift)
        columns = rows[:, :-1] @ change
        return columns.T @ columns, columns.T @ rows[:, -1]

    def as_dict(self) -> dict[str, Any]:
        """The constants as JSON-ready values."""
        return {
            key: value.tolist() if isinstance(value, np.ndarray) else value
            for key, value in vars(self).items()
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> UnitConstants:
        """The constants that `as_dict` wrote."""
        try:
            names = ("triangles", "shift", "scale")
            arrays = {name: np.asarray(values[name], dtype=np.float64) for name in names}
            found = cls(
                features=str(values["features"]),
                noise={name: float(values["noise"][name]) for name in _NOISE},
                unseen_shift=float(values["unseen_shift"]),
                rows=int(values["rows"]),
                box=dict(values["box"]),
                covariates={
                    str(name): str(value) for name, value in dict(values.get("covariates", {})).items()
                },
                own={str(name): float(value) for name, value in dict(values.get("own", {})).items()},
                **arrays,
            )
            shape = (found.triangles.ndim, found.triangles.shape[-1:], found.scale.shape)
            if shape != (3, (len(found.shift) + 2,), found.shift.shape):
                raise ValueError("sizes don't belong together")
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise InputError(
                f"a unit's constants are damaged ({error}); remove its outcome.json, or choose another --out"
            ) from None
        return found


@dataclass(frozen=True)
class FleetConstants:
    """A fleet's constants.

    Attributes
    ----------
    features
        The form.
    prior
        Distribution of the constants over units, whatever their covariates.
    effects
        How the constants go with covariates of production; of none where none are stated.
    values, errors
        Constant and coefficients of each unit in the prior's columns, drawn to the fleet where the
        unit's runs tell little, and their standard errors [deg/h], shapes (u, k + 1).
    alone
        The same by each unit's runs alone.
    probabilities
        Probability that a unit like the fleet would lie so far out or farther, its rows' noise counted, shape
        (u,).
    distances
        How far each unit lies from the fleet, or from what it says of units with such covariates: Mahalanobis
        distance over the root of k + 1, shape (u,).
    box
        Range of each atom that half of the units cover.
    own
        Sizes of runs' own parts [deg/h]: of the shift as the runs of all units together tell it, of others
        the root of the mean square over units.
    noise
        N, B and K of the rows' noise, roots of the mean squares over units.
    """

    features: str
    prior: Prior
    effects: CovariateEffects
    values: FloatArray
    errors: FloatArray
    alone: FloatArray
    distances: FloatArray
    probabilities: FloatArray
    box: dict[str, list[float]]
    own: dict[str, float]
    noise: dict[str, float]

    @property
    def names(self) -> list[str]:
        """Names of the constants, ``1`` the first."""
        return ["1", *parse_features(self.features).names()]


def fleet_constants(units: Sequence[UnitConstants]) -> FleetConstants:
    """Distribution of constants over units, by expectation and maximisation.

    Each unit's constants are drawn from a multivariate t distribution with the fleet's mean and
    covariance, and seen through its rows (N. Laird & J. Ware, Biometrics 38 (1982) 963; K. Lange,
    R. Little & J. Taylor, J. Am. Stat. Assoc. 84 (1989) 881). The mean is linear in the units' covariates,
    whose slopes are drawn to 0 by two units' worth: few units, or many lots, tell little of them.

    Raises
    ------
    InputError
        If there are fewer than three units, or they are not of one form.
    """
    if len(units) < LEAST_UNITS:
        raise InputError(f"{len(units)} units: at least {LEAST_UNITS} are needed to tell what they share")
    if len({unit.features for unit in units}) > 1:
        raise InputError("the units' constants are of different forms; run the fleet with one form for all")
    shift = np.mean([unit.shift for unit in units], axis=0)
    scale = np.sqrt(np.mean([unit.scale**2 for unit in units], axis=0))
    sizes = {name: [unit.own[name] for unit in units if name in unit.own] for name in OWN_PARTS}
    own = {name: float(np.sqrt(np.mean(np.square(found)))) for name, found in sizes.items() if found}
    if sizes[OWN_PARTS[0]]:
        # Runs of all units together tell it better than the mean of what those of each do.
        median = float(np.median(sizes[OWN_PARTS[0]]))
        own[OWN_PARTS[0]] = shift_of_runs([unit.triangles for unit in units], median, SizePriors.noise_spread)
    seen = [unit.in_columns(shift, scale, own.get(OWN_PARTS[0])) for unit in units]
    width = len(shift) + 1
    columns = CovariateColumns.of([unit.covariates for unit in units])
    rows = np.array([columns.row(unit.covariates)[0] for unit in units])
    design = np.column_stack([np.ones(len(units)), rows])
    draw = np.diag(np.append(0.0, np.full(rows.shape[1], _WORTH_UNITS)))
    middle, covariance = _begin(seen)
    centres = np.tile(middle, (len(units), 1))
    for _ in range(_ROUNDS):
        means, spreads, distances = each_unit(seen, centres, covariance)
        weights = (_FREEDOM + width) / (_FREEDOM + distances)
        inverse = np.linalg.inv(design.T @ (weights[:, None] * design) + draw)
        slopes = inverse @ design.T @ (weights[:, None] * means)
        new_centres = design @ slopes
        apart = means - new_centres
        scatter = np.einsum("u,ui,uj->ij", weights, apart, apart) + spreads.sum(axis=0)
        belief = np.diag(np.diag(scatter)) / len(units)
        new = (scatter + _WORTH_UNITS * belief) / (len(units) + _WORTH_UNITS)
        still = np.allclose(new, covariance, rtol=_TOLERANCE, atol=0.0) and np.allclose(
            new_centres, centres, rtol=_TOLERANCE
        )
        centres, covariance = new_centres, new
        if still:
            break
    *_, distances = each_unit(seen, centres, covariance)
    # What the covariates' slopes take of the units' freedom.
    taken = float(np.einsum("ui,ij,uj,u->", design, inverse, design, weights)) - 1.0
    left = max(len(units) - taken, 1.0)
    wider = widening(seen, centres, covariance, weights) * np.sqrt(left / len(units))
    covariance = covariance * (len(units) / left) / _of_normal(width)
    within = Prior(slopes[0], covariance, shift, scale, left, wider)
    means, spreads, _ = each_unit(seen, centres, within.of_a_next)
    errors = np.sqrt(np.diagonal(spreads, axis1=1, axis2=2))
    spread = np.atleast_2d(rows.T @ rows / len(units)) if rows.shape[1] else np.empty((0, 0))
    effects = CovariateEffects(columns, slopes[1:], spread, inverse, within)
    prior = effects.prior({})
    box = {
        name: [float(np.median([unit.box[name][end] for unit in units])) for end in (0, 1)]
        for name in units[0].box
    }
    distances = np.sqrt(distances / width)
    probabilities = np.array(
        [rarity(*one, effects.prior(unit.covariates)) for one, unit in zip(seen, units, strict=True)]
    )
    noise = {name: float(np.sqrt(np.mean([unit.noise[name] ** 2 for unit in units]))) for name in _NOISE}
    alone, _ = least_squares(seen)
    return FleetConstants(
        units[0].features, prior, effects, means, errors, alone, distances, probabilities, box, own, noise
    )


def _of_normal(width: int) -> float:
    """Share of the covariance of normal constants that the t distribution's scatter matrix comes out at.

    The root c of ``E[(f + k) x / (f c + x)] = k`` with x chi-square of k degrees of freedom, f those of the t
    distribution (consistency at the normal: R. Maronna, Ann. Statist. 4 (1976) 51).
    """
    from scipy.optimize import brentq

    squares = chi2_ppf((np.arange(2048) + 0.5) / 2048, width)
    return float(
        brentq(lambda c: np.mean((_FREEDOM + width) * squares / (_FREEDOM * c + squares)) - width, 0.05, 1.0)
    )


def _begin(seen: Sequence[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray]:
    """Mean and covariance of the units' own least-squares constants."""
    own, _ = least_squares(seen)
    spread = np.median(np.abs(own - np.median(own, axis=0)), axis=0) * SIGMA_PER_MEDIAN
    least = 1e-6 * max(float(np.abs(own).max()), 1e-12)
    return np.median(own, axis=0), np.diag(np.maximum(spread, least) ** 2)
