"""The model of a unit whose constants are drawn to its fleet's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Self

from fogml.errors import InputError
from fogml.features.parse import parse_features
from fogml.fleet.constants import ROWS, FleetConstants
from fogml.fleet.covariates import CovariateEffects, Covariates
from fogml.models.feature_model import FeatureModel
from fogml.models.linear import LinearRegressor
from fogml.models.prior import Prior, PriorRegressor
from fogml.runs.run import Run

COVERED = 0.25
"""Least share of the fleet's temperatures in a unit's runs if the fleet is followed beyond them."""
ODD = 0.05
"""A unit is odd if one of the fleet would lie as far out with less than this probability."""
_BEYOND = 0.01
# Share of the fleet's span that has to lie beyond a unit's own runs to be told.


class SharedModel(FeatureModel):
    """A unit's drift by the fleet's form, its constants drawn to the fleet's.

    The trained box is the fleet's and the unit's own together: where the unit's runs did not go,
    the fleet's constants tell what to expect. An odd unit is left to its own runs, as if there were
    no fleet; so is one whose runs cover less than a quarter of the fleet's temperatures, as it
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

    Attributes
    ----------
    from_fleet_ : dict
        Temperature to the stretches of it, lower and upper end [degC], that the unit's runs have not
        shown and that are compensated with the fleet's constants; empty for a unit left to its own runs.
    """

    def __init__(self, features: str, prior: dict[str, Any], box: dict[str, list[float]]) -> None:
        super().__init__(features, PriorRegressor(prior), kind="shared", max_rows=ROWS)
        self.prior = prior
        self.box = box

    def fit(self, runs: Run | Sequence[Run]) -> Self:
        """Fit to training runs, as `FeatureModel.fit`."""
        super().fit(runs)
        own = self.features_.box
        covered = min((_span(own[name]) / _span(self.box[name]) for name in self._levels()), default=1.0)
        if covered < COVERED:
            return self._alone(
                runs,
                f"the runs cover {covered:.0%} of the fleet's temperatures, too little to tell an odd unit",
            )
        agreement = getattr(self.regressor_, "agreement_", 0.0)
        if agreement < ODD:
            return self._alone(
                runs,
                f"this unit is odd: of units like the fleet's, {agreement:.1%} would lie as far out "
                f"(odd below {ODD:.0%})",
            )
        wider = {
            name: (min(low, self.box[name][0]), max(high, self.box[name][1]))
            for name, (low, high) in own.items()
        }
        self.from_fleet_ = {
            name: stretches for name in self._levels() if (stretches := _beyond(own[name], self.box[name]))
        }
        self.features_.set_box(wider)
        note = (
            "constants are drawn to the fleet's, and the trained box is the fleet's and the unit's together"
        )
        self.card_ = replace(
            self.card_,
            box=self.features_.box,
            slices=None,
            notes=(*self.card_.notes, note, *self._resting()),
        )
        return self

    def _alone(self, runs: Run | Sequence[Run], why: str) -> Self:
        """Leave the unit to its own runs: the form by least squares, its ridge by cross-validation."""
        alone = FeatureModel(self.features, LinearRegressor(ridge="auto"), kind=self.kind).fit(runs)
        for name, value in vars(alone).items():
            if name.endswith("_"):
                setattr(self, name, value)
        self.from_fleet_ = {}
        self.card_ = replace(self.card_, notes=(*self.card_.notes, f"{why}; it is left to its own runs"))
        return self

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

    def _levels(self) -> list[str]:
        """Atoms that are temperatures themselves."""
        return [atom.text for atom in self.features_.atoms if atom.operator == "value"]


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

    Raises
    ------
    InputError
        If the values are no fleet's constants.
    """
    if isinstance(fleet, FleetConstants):
        return SharedModel(fleet.features, fleet.effects.prior(covariates or {}).as_dict(), fleet.box)
    try:
        features, prior, box = str(fleet["features"]), dict(fleet["prior"]), dict(fleet["box"])
        box = {str(name): [float(low), float(high)] for name, (low, high) in box.items()}
    except (KeyError, TypeError, ValueError):
        raise InputError(
            "the fleet's constants are not understood; was this fleet.json written whole?"
        ) from None
    Prior.from_dict(prior)
    parse_features(features)
    if "covariates" in fleet:
        prior = CovariateEffects.from_dict(fleet["covariates"]).prior(covariates or {}).as_dict()
    return SharedModel(features, prior, box)


def _span(ends: Sequence[float]) -> float:
    return max(float(ends[1]) - float(ends[0]), 1e-12)


def _beyond(own: Sequence[float], fleet: Sequence[float]) -> list[tuple[float, float]]:
    """Stretches of a fleet's range that a unit's own does not cover."""
    least = _BEYOND * _span(fleet)
    sides = [(fleet[0], min(own[0], fleet[1])), (max(own[1], fleet[0]), fleet[1])]
    return [(float(low), float(high)) for low, high in sides if high - low > least]
