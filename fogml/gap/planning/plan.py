"""Planning of runs: programmes that make wanted constants and effects identifiable, without a diagnosis.

Runs are planned one after another, each for what those before it leave open.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fogml.errors import InputError, listed
from fogml.gap.inference import foreseen
from fogml.gap.model import TwinModel
from fogml.gap.planning.fisher import (
    UNSEEN,
    Criterion,
    Unknowns,
    expected,
    information,
    merit,
    unknowns,
    usual_value,
)
from fogml.gap.planning.lab import Lab
from fogml.gap.planning.plan_result import ExpectedError, Outlook, Plan, PlannedRun, Separation
from fogml.gap.planning.programme_family import Design, Family, Mounting
from fogml.gap.planning.programme_search import MOST_RUNS, Tried, finely, search
from fogml.gap.planning.rehearsal import (
    COARSE_S,
    FINE_S,
    ExpectedRuns,
    Rehearsal,
    Stage,
    Together,
    mounted,
    planned,
    rehearse,
    stage,
)
from fogml.gap.planning.separating import Member, distances, log_distance, members_of
from fogml.gap.result_parts import Rehearsed
from fogml.gap.settings import STANDARD
from fogml.runs.facts import Facts
from fogml.settings_check import check_whole
from fogml.signals.noise_model import NoiseModel
from fogml.twin.nominal import NAMES
from fogml.twin.twin import Twin

MOST_PLANNED = 8
_EXACT = (
    "table rate and clock are exact, so that noise alone limits what acts at edges of the rate, such as a "
    "skew of the clock; the plant, the noise and the constants' priors are the twin's"
)


@dataclass(frozen=True)
class _Goal:
    """What is asked for: parameters, and groups of effects to be told apart."""

    of: Unknowns | None
    groups: tuple[tuple[Member, ...], ...]
    criterion: Criterion

    def merit(self, rehearsed: ExpectedRuns) -> float:
        """Logarithm of how well it is reached, each part counting the same."""
        total = 0.0
        if self.of is not None:
            total += merit(information(rehearsed, self.of), self.of.wanted, self.criterion)
        for group in self.groups:
            total += log_distance(rehearsed, group) / len(self.groups)
        return total

    def outlook(self, rehearsed: ExpectedRuns) -> Outlook:
        """What runs are expected to tell."""
        separations = tuple(
            Separation(tuple(m.value.id for m in group), distances(rehearsed, group, refined=True))
            for group in self.groups
        )
        if self.of is None:
            return Outlook((), np.zeros((0, 0)), separations)
        block = expected(rehearsed, self.of)[np.ix_(self.of.wanted, self.of.wanted)]
        deviations = np.sqrt(np.diag(block))
        errors = tuple(
            ExpectedError(p.name, p.unit, p.value, p.prior, float(d) * p.scale if d < UNSEEN else None)
            for p, d in zip((self.of.parameters[i] for i in self.of.wanted), deviations)
        )
        return Outlook(errors, block / np.outer(deviations, deviations), separations)


def plan_runs(
    twin: Twin,
    want: Sequence[str] = (),
    *,
    separate: Sequence[Sequence[str]] = (),
    hours: float = 24.0,
    criterion: Criterion = "D",
    runs: int = 1,
    limits: tuple[float, float] = (-40.0, 60.0),
    noise: NoiseModel | None = None,
    facts: Facts | None = None,
    mountings: Sequence[Mounting] | None = None,
    columns: Sequence[str] | None = None,
    power_steps: bool = True,
    lab: Lab | None = None,
    seed: int = 0,
    most: int = MOST_RUNS,
    rehearsed: bool = False,
    progress: Callable[[str], None] | None = None,
) -> Plan:
    """Programmes that make wanted parameters identifiable, or pull effects apart, within so many hours.

    Parameters
    ----------
    twin
        Whose responses, priors and noise are planned with; its effects that are on are wanted at their
        values, others at the usual ones of its grade.
    want
        Nominal constants such as ``k1``, effects, or single parameters such as
        ``thermal_hysteresis.half_width``. All are fitted together, with the nominal constants beside them
        under their priors.
    separate
        Groups of effects to be told apart; a group of one is to be shown.
    hours
        Longest time of each run [h].
    criterion
        ``D``: the volume of the wanted parameters' confidence ellipsoid; ``A``: the mean of their squared
        standard errors; each in prior standard deviations or usual sizes.
    runs
        How many runs; each is planned for what those before it leave open.
    limits
        Lowest and highest temperature [degC].
    noise
        Of the gyro; the twin's if None.
    facts
        Of the set-up; latitude 39.9 deg if None.
    mountings
        Where the input axis may point; if None as the facts say, or up or north where there are none.
    columns
        What a run records; what `fogml simulate` does if None.
    power_steps
        Whether the power may be switched.
    lab
        What chamber, table and fixture can do; as usual if None.
    seed
        Of the search.
    most
        Programmes that are tried at most for each run.
    rehearsed
        Whether to tell what a diagnosis of all planned runs would name of each candidate.
    progress
        Told what is being done.

    Raises
    ------
    InputError
        If nothing is asked for, a name is unknown, or hours, limits or the number of runs are out of range.
    """
    if not want and not separate:
        raise InputError(
            "nothing is asked for; name constants or effects with --want, or a pair with --separate"
        )
    check_whole("seed", seed)
    check_whole("most", most, 1)
    if criterion not in ("D", "A"):
        raise InputError(f"criterion '{criterion}': D or A was expected")
    if not 1 <= runs <= MOST_PLANNED:
        raise InputError(f"{runs} runs: 1 to {MOST_PLANNED} can be planned")
    ways: tuple[Mounting | None, ...] = ("up", "north") if facts is None else (None,)
    given = ways if mountings is None else tuple(mountings)
    family = Family(hours, limits, given, power_steps, lab or Lab())
    noise = _noise_of(twin) if noise is None else noise
    values, assumed = _values(twin)
    on = stage(twin, noise, values, facts=facts, columns=columns)
    goal = _Goal(
        unknowns(on, want) if want else None,
        tuple(members_of(on, family, [usual_value(on, id) for id in group]) for group in separate),
        criterion,
    )
    runs_planned: list[PlannedRun] = []
    for number in range(runs):
        tell = _numbered(progress, number, runs)
        runs_planned.append(_next_run(on, family, goal, runs_planned, seed + number, most, tell))
    return Plan(
        twin.name,
        twin.grade,
        criterion,
        hours,
        limits,
        noise,
        family.lab,
        on.acting,
        tuple(runs_planned),
        (*on.assumed, *assumed, *_known(twin, goal), _EXACT),
        _rehearsed(on, runs_planned, seed, progress) if rehearsed else (),
    )


def _noise_of(twin: Twin) -> NoiseModel:
    if not twin.noise.N:
        raise InputError(
            f"twin {twin.name} has no white noise, and without any no error can be expected; state 'N' "
            "[deg/sqrt(h)] under its 'noise'"
        )
    return NoiseModel(twin.noise.N, twin.noise.B, twin.noise.K)


def _known(twin: Twin, goal: _Goal) -> list[str]:
    """That effects of the twin are taken as known, where there are some that nothing is asked of."""
    asked = {one.id for one in goal.of.effects} if goal.of else set()
    asked |= {member.value.id for group in goal.groups for member in group}
    known = [
        declared.id for declared, _ in twin.on if declared.id not in asked and not declared.drawn_per_run
    ]
    if not known:
        return []
    return [f"what twin {twin.name} has of {listed(known)} is taken as known exactly"]


def _rehearsed(
    on: Stage,
    planned: Sequence[PlannedRun],
    seed: int,
    progress: Callable[[str], None] | None,
) -> tuple[Rehearsed, ...]:
    """What a diagnosis of the planned runs, their sensors as the twin's, would name of each candidate."""
    if progress is not None:
        progress("rehearsing each candidate")
    told = [(p.programme, p.facts, seed + i) for i, p in enumerate(planned)]
    runs = [
        on.acting.simulate(steps, sample_s=FINE_S, facts=facts, columns=on.columns, seed=own).run
        for steps, facts, own in told
    ]
    return rehearse(foreseen(TwinModel(on.acting), runs, on.noise, STANDARD))


def _next_run(
    on: Stage,
    family: Family,
    goal: _Goal,
    before: Sequence[PlannedRun],
    seed: int,
    most: int,
    progress: Callable[[str], None] | None,
) -> PlannedRun:
    earlier = [run.rehearsal for run in before]

    def together(design: Design, sample_s: float) -> ExpectedRuns:
        new = Rehearsal(on, family, design, sample_s)
        return Together([*earlier, new]) if earlier else new

    tried = search(
        family, lambda d: goal.merit(together(d, COARSE_S)), seed=seed, most=most, progress=progress
    )
    finals: list[Tried] = finely(tried, lambda d: goal.merit(together(d, FINE_S)))
    name = "planned" if not before else f"planned-{len(before) + 1}"
    best = finals[0].design
    rehearsal = Rehearsal(on, family, best, FINE_S)
    return PlannedRun(
        planned(on, family, best, name),
        family.in_words(best),
        mounted(on.facts, best),
        goal.outlook(Together([*earlier, rehearsal])),
        tuple(
            (
                planned(on, family, one.design, f"{name}-alternative-{i}"),
                family.in_words(one.design),
                goal.outlook(together(one.design, FINE_S)),
            )
            for i, one in enumerate(finals[1:], start=1)
        ),
        rehearsal,
    )


def _values(twin: Twin) -> tuple[dict[str, float], list[str]]:
    """Constants at which effects on inputs are taken: the twin's, or one prior deviation for those at 0."""
    values, zero = {}, []
    for name in NAMES:
        value, sd = getattr(twin.nominal, name), getattr(twin.nominal_sd, name)
        values[name] = value or sd
        zero += [] if value else [name]
    if not zero:
        return values, []
    listed = ", ".join(zero)
    return values, [
        f"effects of sensors act by way of the constants: {listed} are taken as one prior standard deviation"
    ]


def _numbered(progress: Callable[[str], None] | None, number: int, runs: int) -> Callable[[str], None] | None:
    if progress is None or runs == 1:
        return progress
    return lambda text: progress(f"run {number + 1} of {runs}, {text}")
