"""Runs of several units in one diagnosis: causes are shared, sizes are each unit's own.

What acts is the same in all units of a kind; constants, noise, sizes and forms are not. For a set K of known
causes the evidence of all units is the product of theirs, each with whatever unknown acts in it besides::

    p(K | all) ~ p(K) prod_u sum over sets of u that name K alone p(data of u | set) p(what else is in it)

A unit whose runs can't show a cause says nothing of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import softmax

from fogml.errors import InputError
from fogml.gap.cards import in_form, replaced
from fogml.gap.diagnosis import answered, check_cost, inferred
from fogml.gap.inference import Inference, Progress
from fogml.gap.model import AnyModel
from fogml.gap.result import Diagnosis, Estimate
from fogml.gap.search import Explanation
from fogml.gap.settings import Priors
from fogml.numerals import probability_words, short, with_error
from fogml.runs.run import Run
from fogml.settings_check import check_whole
from fogml.signals.large import release
from fogml.signals.restricted import next_value, random_effects
from fogml.twin.twin import Twin

SCHEMA = "fogml.gap_units/1"


@dataclass(frozen=True)
class SharedCause:
    """A cause in all units, and what of its size goes over to the next unit.

    Attributes
    ----------
    effect
        Its id.
    probability
        That it acts in units of this kind.
    sizes
        Its amplitude in each unit that shows it.
    mean, spread
        Of the sizes: with its standard error; their standard deviation from unit to unit. None of one unit.
    next_unit
        Where the next unit's size lies with 90 %; None of one unit.
    unit
        Of the amplitude.
    """

    effect: str
    probability: float
    sizes: dict[str, Estimate]
    mean: Estimate | None
    spread: float | None
    next_unit: tuple[float, float] | None
    unit: str


@dataclass(frozen=True)
class UnitsDiagnosis:
    """The diagnosis of several units: each with what is known from the others, and what they share."""

    by_unit: dict[str, Diagnosis]
    shared: tuple[SharedCause, ...]

    def as_dict(self) -> dict[str, Any]:
        """``units.json``."""
        return {
            "schema": SCHEMA,
            "units": {unit: found.verdict for unit, found in self.by_unit.items()},
            "shared": [asdict(cause) for cause in self.shared],
        }

    def lines(self) -> tuple[str, ...]:
        """What is shared, in sentences."""
        said = []
        for c in self.shared:
            sizes = ", ".join(f"{u} {with_error(s.value, s.se)}" for u, s in c.sizes.items())
            line = f"{c.effect}: {probability_words(c.probability)} probable in all units; {sizes} {c.unit}"
            if c.next_unit is not None and c.mean is not None:
                low, high = c.next_unit
                line += (
                    f"; mean {with_error(c.mean.value, c.mean.se)}, {short(c.spread, 2)} from unit "
                    f"to unit: the next unit's lies between {short(low)} and {short(high)} {c.unit} (90 %)"
                )
            said.append(line + ".")
        return tuple(said)


def diagnose_units(
    model: Twin | AnyModel | str | Path,
    fit: Sequence[Run],
    held_out: Sequence[Run] = (),
    *,
    noise: Sequence[Run] = (),
    without: Iterable[str] = (),
    seed: int = 0,
    priors: Priors | None = None,
    cost_of_false_name: float = 1.0,
    progress: Progress | None = None,
) -> UnitsDiagnosis:
    """Diagnose several units of one kind together; arguments as `fogml.gap.diagnose`.

    Parameters
    ----------
    noise
        Static runs, one of a unit at most.

    Raises
    ------
    InputError
        If a run does not say its unit, a unit has no fit run, or as of one unit.
    """
    tell, without = (
        progress or (lambda what: None),
        (without,) if isinstance(without, str) else tuple(without),
    )
    check_whole("seed", seed)
    check_cost(cost_of_false_name)
    units = _by_unit(fit)
    held, static = _by_unit(held_out), _by_unit(noise)
    for unit in (*held, *static):
        if unit not in units:
            raise InputError(f"unit {unit} has runs, and none to fit on; name one before --held-out")
    several = next((u for u, runs in static.items() if len(runs) > 1), None)
    if several is not None:
        raise InputError(f"unit {several} has several noise runs; one of each unit is enough")
    quiet = {unit: runs[0] for unit, runs in static.items()}
    found: dict[str, Inference] = {}
    for unit, runs in units.items():
        tell(f"unit {unit}")
        own = inferred(model, runs, held.get(unit, ()), quiet.get(unit), without, priors, tell)
        found[unit] = own.put_away() if len(units) > 1 else own
        release()
    told = {unit: _Told(f) for unit, f in found.items()}
    by_unit = {}
    for unit, f in found.items():
        others = [t for u, t in told.items() if u != unit]
        shared = replace(f, shared=_by_others(others, told[unit]))
        by_unit[unit] = answered(shared, quiet.get(unit), unit not in held, seed, cost_of_false_name)
        release()
    return UnitsDiagnosis(by_unit, _shared(by_unit, list(told.values())))


def _by_unit(runs: Sequence[Run]) -> dict[str, list[Run]]:
    units: dict[str, list[Run]] = {}
    for run in runs:
        if not run.facts.unit:
            raise InputError(
                f"{run.name}: does not say its unit, and other runs do; state 'unit' in its side file"
            )
        units.setdefault(run.facts.unit, []).append(run)
    return units


class _Told:
    """What one unit says of sets of known causes."""

    def __init__(self, found: Inference) -> None:
        self.found = found
        families = found.columns.families
        least, own = found.setting.priors.least_size, found.search.names(found.explanations[0])
        # Within its range a cause may be too small to be seen here, whatever it is in other units.
        known = (f for f in found.search.families_of("known") if f in own or found.field.shows(f, least))
        self.families = {families[f].id: f for f in known}
        self._scores: dict[frozenset[str], float] = {}

    def names(self, explanation: Explanation) -> frozenset[str]:
        """Those among a set that these runs can show."""
        named = (self.found.columns.families[f].id for f in self.found.search.names(explanation))
        return frozenset(self.families).intersection(named)

    @property
    def sets(self) -> set[frozenset[str]]:
        """Sets that the unit finds worth keeping."""
        return {self.names(e) for e in self.found.explanations}

    def score(self, names: frozenset[str]) -> float:
        """Log evidence of what the unit can show of a set, priors of known causes left out."""
        shown = names.intersection(self.families)
        if shown not in self._scores:
            held = [e for e in self.found.explanations if self.names(e) == shown]
            if not held:
                held = [self._grown(shown)]
                release()
            own = self.found.search.log_odds
            prior = sum(float(own[self.families[id]]) for id in shown)
            self._scores[shown] = float(np.logaddexp.reduce([e.score - prior for e in held]))
        return self._scores[shown]

    def _grown(self, names: frozenset[str]) -> Explanation:
        """The likeliest set of what is unknown that names nothing, with these causes added."""
        best, search = self.found.explanations[0], self.found.search
        nameless = next((e for e in self.found.explanations if not self.names(e)), None)
        grown = search.grown(
            nameless or search.without(best, search.names(best)), [self.families[id] for id in sorted(names)]
        )
        ahead = grown.log_evidence - best.log_evidence
        return replace(grown, by_noise=tuple(x + ahead for x in best.by_noise))


def _by_others(others: Sequence[_Told], own: _Told) -> Callable[[frozenset[str]], float]:
    """What other units say of a set, against what they say of the one that they find likeliest.

    Causes that this unit can't show act as it suits the others.
    """
    sets = {names for t in (*others, own) for names in t.sets}
    said = {names: sum(t.score(names) for t in others) for names in sets}
    best = max(said.values())

    def score(names: frozenset[str]) -> float:
        shown = names.intersection(own.families)
        alike = [told for held, told in said.items() if held.intersection(own.families) == shown]
        return max(alike, default=sum(t.score(names) for t in others)) - best

    return score


def _shared(by_unit: dict[str, Diagnosis], told: Sequence[_Told]) -> tuple[SharedCause, ...]:
    priors = told[0].found.setting.priors
    sets = sorted({names for t in told for names in t.sets}, key=sorted)
    weights = softmax([_prior(told, names) + sum(t.score(names) for t in told) for names in sets])
    causes = []
    for id in sorted({f.effect for d in by_unit.values() for f in d.found}):
        acts = float(sum(w for w, names in zip(weights, sets) if id in names))
        odds = np.log(max(acts, 1e-12)) - np.log(max(1.0 - acts, 1e-12))
        probability = priors.believed(float(odds))
        sizes = {u: f.amplitude for u, d in by_unit.items() for f in d.found if f.effect == id}
        if probability < priors.reported.listed or not sizes:
            continue
        unit = next(iter(sizes.values())).unit
        going_over = _going_over(sizes, unit, _possible(told[0].found, id))
        causes.append(SharedCause(id, probability, sizes, *going_over, unit))
    return tuple(sorted(causes, key=lambda c: -c.probability))


def _possible(found: Inference, id: str) -> tuple[float, float]:
    """Sizes that an effect may have beyond what the model has of it; what each run draws is a deviation."""
    declared = found.scene.candidates[id]
    low, high = declared.amplitude.limits
    had = sum(setting.amplitude for _, setting in replaced(found, [id]))
    return (low if in_form(declared) else 0.0) - had, high - had


def _going_over(
    sizes: dict[str, Estimate], unit: str, possible: tuple[float, float]
) -> tuple[Estimate | None, float | None, tuple[float, float] | None]:
    """Mean, spread from unit to unit, and where the next unit's size lies; None of one unit."""
    if len(sizes) < 2:
        return None, None, None
    told = [s.value for s in sizes.values()], [s.se for s in sizes.values()]
    held = random_effects(*told)
    low, high = np.clip(next_value(*told), *possible).tolist()
    return Estimate(held.mean, held.se, unit), held.between, (low, high)


def _prior(told: Sequence[_Told], names: frozenset[str]) -> float:
    """Log prior of a set of known causes, each by the first unit that may show it."""
    return sum(
        next(float(t.found.search.log_odds[t.families[id]]) for t in told if id in t.families) for id in names
    )
