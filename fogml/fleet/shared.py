"""The model of a unit whose constants are drawn to its fleet's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.features.features import Features
from fogml.features.parse import parse_features
from fogml.fleet.constants import ONE_RUN, FleetConstants
from fogml.fleet.covariates import CovariateEffects, Covariates
from fogml.models.combination import LeftOut, SharedMember, standard_errors
from fogml.models.generalised_least_squares import (
    RunsNoise,
    runs_noise,
    shift_of_runs,
    shifted,
)
from fogml.models.linear import LinearRegressor
from fogml.models.mixed_effects import OWN_PARTS, MixedEffects, linear_regressor
from fogml.models.mixed_effects_model import MixedEffectsModel
from fogml.models.prior import Prior, agreement, posterior
from fogml.models.size_priors import SizePriors
from fogml.models.table import TrainingTable
from fogml.numerals import percent, short
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel

COVERED = 0.25
"""Least share of the fleet's temperatures in a unit's runs if the fleet is followed beyond them."""
ODD = 0.05
"""A unit is odd if one of the fleet would lie as far out with less than this probability."""
_BEYOND = 0.01
# Share of the fleet's span that has to lie beyond a unit's own runs to be told.


@dataclass(frozen=True, eq=False)
class DrawnMember(SharedMember):
    """A unit's shared part with its fleet's prior, the noise of its rows kept.

    Attributes
    ----------
    prior
        The fleet's.
    noise
        Of the rows.
    shift
        Size of a run's own shift [deg/h].
    """

    prior: Prior
    noise: RunsNoise
    shift: float

    @classmethod
    def of(
        cls,
        features: Features,
        found: MixedEffects,
        table: TrainingTable,
        prior: Prior,
        own: Mapping[str, float],
        fleets_noise: Mapping[str, float],
    ) -> Self:
        """The part of a unit, from averages of features, and sizes of its fleet's own parts and noise."""
        noise = runs_noise(table, found.sizes["noise"])
        sizes = size_priors(own, table)
        if fleets_noise:
            noise = noise.like_others(table, NoiseModel(**fleets_noise), sizes.own_spread)
        known = OWN_PARTS[0] in own
        shift = own[OWN_PARTS[0]] if known else noise.unseen_shift
        if len(np.unique(table.run_index)) > 1:
            spread = sizes.own_spread if known else sizes.noise_spread
            triangles = noise.triangles(table, prior.columns(table.X))
            shift = shift_of_runs([triangles], sizes.shift * (float(table.y.std()) or 1.0), spread)
        return cls(features, found, prior, noise, shift)

    def told(self, table: TrainingTable) -> tuple[FloatArray, FloatArray]:
        """Information and image of averages of features in the prior's columns."""
        rows = shifted(self.noise.triangles(table, self.prior.columns(table.X)), self.shift)
        return rows[:, :-1].T @ rows[:, :-1], rows[:, :-1].T @ rows[:, -1]

    def on(self, own: Features, rest: TrainingTable, held: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Drift [deg/h] of feature columns held out (n, k), of a fit to the rest's; its standard errors."""
        columns = self.prior.columns(held)
        solution, covariance, _ = posterior(*self.told(rest), self.prior)
        return columns @ solution, standard_errors(columns, covariance, self.found.own_variance)

    def regressor(self, table: TrainingTable) -> LinearRegressor:
        """The shared part given averages of features."""
        solution, covariance, _ = posterior(*self.told(table), self.prior)
        raw = self.prior.to_raw()
        intercept, *coef = raw @ solution
        return linear_regressor(
            np.array(coef), intercept, raw @ covariance @ raw.T, self.found.sizes["noise"]
        )


class SharedModel(MixedEffectsModel):
    """A unit's drift by a mixed-effects model whose shared part is drawn to its fleet's.

    The prior of the shared part's coefficients is how they are spread over the fleet's units. What the unit's
    rows tell counts their slow noise and a run's shift, and all of what comes of both is kept: no skill is
    asked for beyond it, as the prior has drawn together what the rows do not tell.

    The trained box is the fleet's and the unit's own together: where the unit's runs did not go,
    the fleet's constants tell what to expect. An odd unit is left to its own runs, but for the sizes
    of what is a run's own; so is one whose runs cover less than a quarter of the fleet's temperatures, as it
    could not be told whether it is odd. A unit that is odd only where its runs did not go looks
    like any other: which temperatures rest on the fleet alone is told, in `from_fleet_` and on the
    model's card.

    Parameters
    ----------
    features
        The form.
    prior
        As `fogml.models.prior.Prior.as_dict` gives it.
    box
        The fleet's box.
    own
        Sizes of runs' own parts [deg/h], as `fogml.fleet.constants.FleetConstants.own` has them.
    noise
        The fleet's noise, as `fogml.fleet.constants.FleetConstants.noise` has it: the unit's is taken to be
        as slow, of a size that its own rows tell.

    Attributes
    ----------
    agreement_ : float
        Probability of a unit of the fleet lying at least as far out, see `fogml.models.prior.agreement`.
    from_fleet_ : dict
        Temperature to the stretches of it, lower and upper end [degC], that the unit's runs have not
        shown and that are compensated with the fleet's constants; empty for a unit left to its own runs.
    """

    def __init__(
        self,
        features: str,
        prior: dict[str, Any],
        box: dict[str, list[float]],
        own: Mapping[str, float] | None = None,
        noise: Mapping[str, float] | None = None,
    ) -> None:
        super().__init__(features, kind="shared")
        self.prior = prior
        self.box = box
        self.own = dict(own or {})
        self.noise = dict(noise or {})

    def fit(self, runs: Run | Sequence[Run], y: None = None) -> Self:
        """Fit to training runs, as `FeatureModel.fit`."""
        super().fit(runs, y)
        if self._alone:
            return self
        self.regressor_.covariance_ = self._covariance
        own = self.features_.box
        self.features_.set_box(
            {
                name: (min(low, self.box[name][0]), max(high, self.box[name][1]))
                for name, (low, high) in own.items()
            }
        )
        self.card_ = replace(self.card_, box=self.features_.box, slices=None)
        return self

    def _size_priors(self, table: TrainingTable) -> SizePriors:
        return size_priors(self.own, table)

    def _shared_part(self, features: Features, table: TrainingTable) -> tuple[SharedMember, LinearRegressor]:
        prior = Prior.from_dict(self.prior)
        member = DrawnMember.of(features, self.fitted_, table, prior, self.own, self.noise)
        self._member = member
        own = features.box
        levels = [atom.text for atom in features.atoms if atom.operator == "value"]
        covered = min((_covered(own[name], self.box[name]) for name in levels), default=1.0)
        self.agreement_ = agreement(*member.told(table), prior)
        self._alone = self._why_alone(covered)
        self.from_fleet_ = {}
        if self._alone:
            return super()._shared_part(features, table)
        self.from_fleet_ = {
            name: stretches for name in levels if (stretches := _beyond(own[name], self.box[name]))
        }
        regressor = member.regressor(table)
        self._covariance = regressor.covariance_
        return member, regressor

    def _kept(self, parts: Sequence[LeftOut]) -> FloatArray:
        return super()._kept(parts) if self._alone else np.ones(1)

    def _why_alone(self, covered: float) -> str:
        """Why the unit is left to its own runs, which cover so much of the fleet's temperatures."""
        if covered < COVERED:
            return (
                f"the runs cover {percent(covered, 0)} of the fleet's temperatures, too little to tell "
                "an odd unit"
            )
        if self.agreement_ < ODD:
            return (
                f"this unit is odd: of units like the fleet's, {percent(self.agreement_)} would lie as far "
                f"out (odd below {percent(ODD, 0)})"
            )
        return ""

    def _fit_notes(self) -> list[str]:
        if self._alone:
            return [*super()._fit_notes(), f"{self._alone}; it is left to its own runs"]
        noise = self._member.noise.model
        told = (
            f"noise of the averages: N {short(noise.N, 2)} deg/sqrt(h), B {short(noise.B, 2)} deg/h, "
            f"K {short(noise.K, 2)} deg/h/sqrt(h), shift of a run {short(self._member.shift, 2)} deg/h"
        )
        drawn = (
            "constants are drawn to the fleet's, and the trained box is the fleet's and the unit's together"
        )
        return [told, drawn, *self._resting()]

    def _resting(self) -> list[str]:
        """What the card says of temperatures that the unit's own runs have not shown."""
        notes = []
        for name, stretches in self.from_fleet_.items():
            where = " and from ".join(f"{low:.1f} to {high:.1f} degC" for low, high in stretches)
            notes.append(
                f"{name} from {where} rests on the fleet alone: whether this unit is odd there, its own "
                "runs cannot tell"
            )
        return notes


def size_priors(own: Mapping[str, float], table: TrainingTable) -> SizePriors:
    """Priors of a unit's sizes that have its fleet's sizes of runs' own parts [deg/h] as medians."""
    spread = float(table.y.std()) or 1.0
    fields = zip(("shift", "slow", "fast"), OWN_PARTS, strict=True)
    return replace(ONE_RUN, **{field: own[name] / spread for field, name in fields if name in own})


def shared_model(
    fleet: FleetConstants | Mapping[str, Any], covariates: Covariates | None = None
) -> SharedModel:
    """An unfitted model of a unit whose constants are drawn to its fleet's.

    Parameters
    ----------
    fleet
        The fleet's constants, or ``shared`` of a ``fleet.json``.
    covariates
        What is known of the unit's production; then it is drawn to units like it in that.
    """
    if isinstance(fleet, FleetConstants):
        prior = fleet.effects.prior(covariates or {}).as_dict()
        return SharedModel(fleet.features, prior, fleet.box, fleet.own, fleet.noise)
    try:
        features, prior, box = str(fleet["features"]), dict(fleet["prior"]), dict(fleet["box"])
        box = {str(name): [float(low), float(high)] for name, (low, high) in box.items()}
        sizes = fleet.get("own", {})
        own = {name: float(sizes[name]) for name in OWN_PARTS if name in sizes}
        noise = {str(name): float(size) for name, size in dict(fleet.get("noise", {})).items()}
        if noise:
            NoiseModel(**noise)
    except (KeyError, TypeError, ValueError, InputError):
        raise InputError(
            "the fleet's constants are not understood; was this fleet.json written whole?"
        ) from None
    width, form = len(Prior.from_dict(prior).shift), parse_features(features)
    atoms = {atom.text for atom in form.atoms}
    if width != len(form) or not atoms <= set(box) or not all(0.0 < size < np.inf for size in own.values()):
        raise InputError(
            f"the fleet's constants are not understood: prior of {width} columns, box of {len(box)} inputs "
            f"or sizes of runs' own parts do not belong to {features}"
        )
    if "covariates" in fleet:
        prior = CovariateEffects.from_dict(fleet["covariates"]).prior(covariates or {}).as_dict()
    return SharedModel(features, prior, box, own, noise)


def _span(ends: Sequence[float]) -> float:
    return max(float(ends[1]) - float(ends[0]), 1e-12)


def _covered(own: Sequence[float], fleet: Sequence[float]) -> float:
    """Share of a fleet's range that lies in a unit's own; a single value lies in it or not."""
    if fleet[0] == fleet[1]:
        return float(own[0] <= fleet[0] <= own[1])
    return max(min(own[1], fleet[1]) - max(own[0], fleet[0]), 0.0) / _span(fleet)


def _beyond(own: Sequence[float], fleet: Sequence[float]) -> list[tuple[float, float]]:
    """Stretches of a fleet's range that a unit's own does not cover."""
    least = _BEYOND * _span(fleet)
    sides = [(fleet[0], min(own[0], fleet[1])), (max(own[1], fleet[0]), fleet[1])]
    return [(float(low), float(high)) for low, high in sides if high - low > least]
