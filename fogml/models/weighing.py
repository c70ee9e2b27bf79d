"""What `auto` is made of: members fitted, weighed on what is left out, and put together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.features.features import Features
from fogml.features.parse import parse_features
from fogml.models.base import DriftModel
from fogml.models.box import each_moves_both_ways, learn_box, moves_both_ways
from fogml.models.candidates import Candidate
from fogml.models.card import hash_ahead, training_card
from fogml.models.combination import (
    LEAST_WEIGHT,
    FittedMember,
    LeftOut,
    Member,
    SharedMember,
    combined,
    errors_of_all,
    left_out,
    left_out_parts,
    temperatures_of,
)
from fogml.models.feature_model import FeatureModel, resolve_features
from fogml.models.intervals import of_usual_averages
from fogml.models.linear import LinearRegressor
from fogml.models.mixed_effects import fit_mixed_effects, linear_regressor
from fogml.models.mixed_effects_model import averages_of, composed, offered, static_features
from fogml.models.table import TrainingTable, run_rows
from fogml.models.trial import fit_candidate
from fogml.models.weights import intervals_of, shifts_apart, weights_of
from fogml.numerals import percent, short
from fogml.runs.run import Run

STATIC = "cubic in T"
"""The member of temperature alone."""
CLEARLY = 0.95
"""A network is taken alone where it leaves less than this share of what the others together leave."""


@dataclass(frozen=True, eq=False)
class Weighed:
    """The model that was put together, and what of.

    Attributes
    ----------
    model
        The model, fitted to all training runs.
    weights
        Weight of each member, by name.
    left, mean_left
        Rms of it, and of the training mean, on the runs or blocks left out [deg/h], parts counting alike.
    members
        What is weighed, in the weights' order.
    table
        The averages that it is made of, of the atoms of `union`.
    union
        Features that hold all atoms of the members.
    """

    model: DriftModel
    weights: dict[str, float]
    left: float
    mean_left: float
    members: tuple[Member, ...]
    table: TrainingTable
    union: Features

    def told(self) -> str:
        """A note for the card."""
        rms = (
            f"{short(self.left, 4)} deg/h rms on parts left out, the training mean "
            f"{short(self.mean_left, 4)} deg/h"
        )
        if not any(self.weights.values()):
            return f"no compensation: nothing beats the training mean on parts left out; it leaves {rms}"
        shares = ", ".join(f"{percent(weight, 0)} {name}" for name, weight in self.weights.items() if weight)
        return f"made of {shares}: it leaves {rms}"


def weigh(runs: Sequence[Run], choice: Candidate, features: str | None, seed: int, one_rate: bool) -> Weighed:
    """Fit the members, weigh them on what is left out, and put them together.

    Parameters
    ----------
    runs
        Training runs.
    choice
        The simple candidate to weigh; one without features is no member.
    features
        Features to keep to; None leaves them open.
    seed
        Seed of a network.
    one_rate
        Whether the runs hold too few rates of temperature to tell terms in the rate from others: members that
        hold more than the simple candidate must improve on it.
    """
    hashes = hash_ahead(runs)
    shared = {"mixed effects": offered(runs) if features is None else resolve_features(features, runs)}
    if features is None:
        shared[STATIC] = static_features(runs)
    simple = fit_candidate(choice, runs, seed) if choice.features else None
    held = [*shared.values(), *([simple.features_] if simple is not None and simple.features_ else [])]
    union: Features = parse_features(reduce(add, held).text)
    rows = [run_rows(run, union) for run in runs]
    table = averages_of(rows)
    members: dict[str, Member] = {}
    for name, own in shared.items():
        part = _of(table, union, own)
        members[name] = SharedMember(own, fit_mixed_effects(composed(part, own), own.terms))
    regressor: Any = getattr(simple, "regressor_", None)
    if simple is not None and isinstance(regressor, LinearRegressor) and simple.features_ is not None:
        members[choice.name] = FittedMember(simple.features_, regressor)
    parts = left_out_parts(table, temperatures_of(table, union))
    lefts = left_out(list(members.values()), union, table, parts)
    temperatures = [run.temperature("T") for run in runs]
    both_ways, courses_tell = moves_both_ways(temperatures), each_moves_both_ways(temperatures)
    must_improve_on = [STATIC] if len(runs) > 1 else []
    must_improve_on += [choice.name] if one_rate else []
    beside = [place for place, name in enumerate(members) if name in must_improve_on]
    apart = shifts_apart(lefts) if courses_tell else lefts
    weights = weights_of(apart, len(members), both_ways, beside)
    if not _rms(apart, weights) ** 2 < (1.0 - LEAST_WEIGHT) * _rms(apart, 0.0 * weights) ** 2:
        weights = 0.0 * weights
    left, mean_left = _rms(lefts, weights), _rms(lefts, 0.0 * weights)
    if simple is not None and choice.network and simple.features_ is not None:
        own_member = FittedMember(simple.features_, regressor)
        alone = left_out([own_member], union, table, parts)
        both = [
            replace(one, predicted=np.column_stack((one.predicted, other.predicted)))
            for one, other in zip(lefts, alone, strict=True)
        ]
        both = shifts_apart(both) if courses_tell else both
        others, network = np.append(weights, 0.0), np.append(0.0 * weights, 1.0)
        if _rms(both, network) < CLEARLY * _rms(both, others):
            left = _rms(alone, np.ones(1))
            return Weighed(simple, {choice.name: 1.0}, left, mean_left, (own_member,), table, union)
    errors = errors_of_all(list(members.values()), union, table)
    intervals = intervals_of(lefts, weights, table, both_ways, errors)
    chosen = [
        (member.features, _regressor(member)) for member, weight in zip(members.values(), weights) if weight
    ]
    chosen = chosen or [(shared.get(STATIC, union), _still(shared.get(STATIC, union)))]
    own, linear = combined(
        chosen, weights[weights > 0.0] if weights.any() else np.zeros(1), float(table.y.mean())
    )
    own = parse_features(own.text)
    model = FeatureModel(own.text, kind="combination")
    places = [union.atoms.index(atom) for atom in own.atoms]
    learn_box(own, [part.atoms[:, places] for part in rows])
    intervals = of_usual_averages(
        intervals, rows, table, lambda atoms: linear.predict_unchecked(own.compose(atoms[:, places]))
    )
    model.features_, model.regressor_, model.intervals_ = own, linear, intervals
    notes = [note for part in rows for note in part.notes]
    model.card_ = training_card(runs, hashes=hashes, rows=len(table), features=own, notes=notes)
    shares = dict(zip(members, weights.tolist(), strict=True))
    return Weighed(model, shares, left, mean_left, tuple(members.values()), table, union)


def _of(table: TrainingTable, union: Features, own: Features) -> TrainingTable:
    """The table of a member's atoms."""
    return replace(table, X=table.X[:, [union.atoms.index(atom) for atom in own.atoms]])


def _regressor(member: Member) -> LinearRegressor:
    return member.found.regressor() if isinstance(member, SharedMember) else member.regressor  # type: ignore[attr-defined]


def _still(features: Features) -> LinearRegressor:
    """A regressor that tells nothing of features."""
    count = len(features)
    return linear_regressor(np.zeros(count), 0.0, np.zeros((count + 1, count + 1)), 0.0)


def _rms(parts: Sequence[LeftOut], weights: FloatArray) -> float:
    """Root mean square left on runs, or else blocks or halves, left out [deg/h], parts counting alike."""
    for kind in ("runs", "blocks", "halves"):
        squares = [float(np.mean((p.told - p.predicted @ weights) ** 2)) for p in parts if p.kind == kind]
        if squares:
            return float(np.sqrt(np.mean(squares)))
    return 0.0
