"""Whether a judged model may be used: use it, use it with care, or do not; why, and what to do next."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.intervals import LEVEL
from fogml.models.box import LEAST_SPAN_DEGC, ways_moved
from fogml.numerals import against, label, percent, short, stated, unit_of
from fogml.validation.reasons import (
    Grade,
    Reason,
    gained_reasons,
    implausible_reasons,
    opposite_reasons,
    reversed_reasons,
    saturated_reason,
    still_reason,
    unit_reasons,
)
from fogml.validation.results import Judgement, RunJudgement

SEEN = "seen_in_training"
"""Code of the finding that a test run holds samples of a training run."""


@dataclass(frozen=True)
class Asked:
    """What is asked of a judgement before its model is called fit for use.

    Attributes
    ----------
    outside
        Share of a test run at temperatures and rates that training did not hold, from which on care is due:
        less than a hundredth is a sample or two at the ends of a range.
    mostly_outside
        The same from which on the judgement is of another model than the one in use: over half. Where it
        does not take away what it should there, it is not to be used.
    mostly_still
        Share of a run's samples at which the output stands still, from which on the run says nothing: half.
    saturated
        Share of a run's samples at the ends of the output's range at rest, from which on care is due: what
        fewer are cut off by moves its averages by less than their noise.
    beside
        Share of the rms on the worst test run by which a model judged beside has to leave less before it is
        named instead: two fits of one unit differ by as much from run to run.
    judged
        Share of the trained temperatures that the test runs go over, below which care is due: of most of what
        the model is for, no figure tells.
    coverage
        Share of a test run's averages that the model's 90 % interval holds, below which the interval can't
        be relied on. Averages that follow each other are alike, so that a run may hold 0.8 by chance.
    """

    outside: float = 0.01
    mostly_outside: float = 0.5
    mostly_still: float = 0.5
    saturated: float = 0.01
    beside: float = 0.05
    judged: float = 0.5
    coverage: float = 0.8


@dataclass(frozen=True)
class Advice:
    """The verdict on a model.

    Attributes
    ----------
    grade
        Of the gravest reason; ``use`` where there is none.
    brief, reasons
        It in a few words; sentences, the gravest first; where nothing speaks against use, what speaks for it.
    next_step
        What to do now.
    """

    grade: Grade
    brief: str
    reasons: tuple[str, ...]
    next_step: str


def advice_on(judgement: Judgement, asked: Asked | None = None) -> Advice:
    """The verdict on a judged model, from what training and judging know.

    Parameters
    ----------
    judgement
        Of the model.
    asked
        What is asked of it; the defaults of `Asked` if None.
    """
    order: list[Grade] = ["do_not_use", "use_with_care"]
    found = sorted(_reasons(judgement, asked or Asked()), key=lambda one: order.index(one.grade))
    if not found:
        worst = max(judgement.test, key=lambda run: run.after.rms)
        told = (
            f"On {worst.run}, which it has not seen, it leaves {short(worst.after.rms)} of "
            f"{short(worst.before.rms)} deg/h rms; nothing that training or judging knows speaks against it."
        )
        return Advice(
            "use",
            "judged on a run it has not seen",
            (told,),
            "Export it, and judge it again on the next run of the unit.",
        )
    gravest = found[0]
    return Advice(gravest.grade, gravest.brief, tuple(one.sentence for one in found), gravest.next_step)


def which_to_use(judgement: Judgement, asked: Asked | None = None) -> tuple[str | None, str]:
    """The model judged beside that is the better one, None if there is none, and that in a sentence.

    By the worst test run of each, on the same rows: by its rms; where that is alike, as where the run's mean
    moved by more than models differ, by its bias stability.
    """
    margin, kind = (asked or Asked()).beside, judgement.model["kind"]
    either = ""
    for figure, unit in (("rms", "deg/h rms"), ("bias_stability", "deg/h of bias stability")):
        own = max(getattr(run.after, figure) for run in judgement.test)
        left = {name: max(getattr(r.after, figure) for r in runs) for name, runs in judgement.beside.items()}
        if not left:
            return None, ""
        best = min(left, key=lambda name: left[name])
        told = f"{best} leaves {short(left[best])} {unit} on its worst test run, {kind} {short(own)}"
        if left[best] < (1.0 - margin) * own:
            return best, f"Use {best}: {told}."
        if own < (1.0 - margin) * left[best]:
            return None, f"Use this model rather than {best}: {told}."
        either = (
            either or f"Use either: {told}, which is no difference that another run would be sure to repeat."
        )
    return None, either


def output_reasons(judgement: Judgement, asked: Asked | None = None) -> Iterator[Reason]:
    """What speaks against any model of these runs: an output that is still or saturates, what can't be."""
    asked = asked or Asked()
    for runs, what in ((judgement.train, "learnt"), (judgement.test, "judged")):
        for run in runs:
            if (still := still_reason(run, asked.mostly_still, what)) is not None:
                yield still
            if (cut := saturated_reason(run, asked.saturated, asked.mostly_still, what)) is not None:
                yield cut
            yield from implausible_reasons(run)


def _reasons(judgement: Judgement, asked: Asked) -> Iterator[Reason]:
    yield from output_reasons(judgement, asked)
    yield from unit_reasons(judgement.train, judgement.test)
    yield from opposite_reasons(judgement.train)
    yield from _not_judged(judgement)
    yield from _one_way(judgement)
    yield from _one_temperature(judgement)
    yield from _partly_judged(judgement, asked)
    for run in judgement.test:
        yield from reversed_reasons(run)
        still = still_reason(run, asked.mostly_still, "judged")
        if still is None or still.grade != "do_not_use":
            yield from _of_run(run, asked)
    better, told = which_to_use(judgement, asked)
    if better is not None:
        yield Reason("do_not_use", f"{better} leaves less", told, f"Train {better} in its place.")
    yield from _limits(judgement)
    yield from _another_unit(judgement)


def _not_judged(judgement: Judgement) -> Iterator[Reason]:
    seen = [run.run for run in judgement.test if any(finding.code == SEEN for finding in run.findings)]
    if seen:
        yield Reason(
            "do_not_use" if len(seen) == len(judgement.test) else "use_with_care",
            "not judged on another run",
            f"{', '.join(seen)} holds samples of a training run: its figures say how well the model fits, "
            "not how well it holds.",
            "Record another run, and name it after --test.",
        )


def _one_way(judgement: Judgement) -> Iterator[Reason]:
    trained = _ways(judgement.train)
    if len(trained) != 1:
        return
    (way,) = trained
    back = "down" if way == "up" else "up"
    gone_back = back in _ways(judgement.test)
    yield Reason(
        "do_not_use" if gone_back else "use_with_care",
        "trained one way",
        f"Trained on temperature going {way} only: what follows temperature, its rate and time can't be told "
        f"apart, and what holds going {back} "
        + ("is not in the model, though the test run goes there." if gone_back else "was not tested either."),
        "Train on a run that goes up and down.",
    )


def _of_run(run: RunJudgement, asked: Asked) -> Iterator[Reason]:
    against = list(gained_reasons(run))
    yield from against
    if run.outside_training > asked.outside:
        mostly = run.outside_training > asked.mostly_outside
        yield Reason(
            # What it takes away there all the same, it takes away as it falls back.
            "do_not_use" if mostly and against else "use_with_care",
            f"{percent(run.outside_training, 0)} of {run.run} is outside of what was trained",
            f"{percent(run.outside_training)} of {run.run} lies at temperatures or rates that training did "
            "not hold: there the model falls back.",
            "Train over the whole range of use.",
        )
    held = run.coverage
    if held is not None and held < asked.coverage:
        yield Reason(
            "use_with_care",
            f"its interval does not hold on {run.run}",
            f"Its {percent(LEVEL, 0)} interval holds {percent(held, 0)} of the averages of {run.run}: that "
            "run is unlike the training runs.",
            "Train on more runs, this one among them, and judge on a new one.",
        )


def _limits(judgement: Judgement) -> Iterator[Reason]:
    for outcome in (*judgement.limits, *([judgement.design_index] if judgement.design_index else [])):
        if not outcome.met:
            name = label(outcome.quantity)
            yield Reason(
                "do_not_use",
                f"{name[:1].lower()}{name[1:]} over its limit",
                f"{name} is {against(outcome.value, outcome.limit)} {unit_of(outcome.quantity)}, the limit "
                f"{stated(outcome.limit)}.",
                "See which regime the rest comes from, train on more runs, or compare other models.",
            )


def _one_temperature(judgement: Judgement) -> Iterator[Reason]:
    held, used = _temperatures(judgement.train), _temperatures(judgement.test)
    if held and used and _span(used) < LEAST_SPAN_DEGC <= _span(held):
        yield Reason(
            "use_with_care",
            "judged at one temperature",
            f"The test runs stay within {short(_span(used), 2)} degC, where training went over "
            f"{short(_span(held), 2)}: what it makes of temperatures that change was not tested.",
            "Judge it on a run that goes over the range of use.",
        )
    if held and _span(held) < LEAST_SPAN_DEGC:
        yield Reason(
            "do_not_use" if used and _span(used) >= LEAST_SPAN_DEGC else "use_with_care",
            "trained at one temperature",
            f"Temperature spans {short(_span(held), 2)} degC in training: what is compensated holds at "
            f"{short(float(np.mean(held[0])))} degC alone.",
            "Train on a ramp up and a ramp down over the range of use.",
        )


def _partly_judged(judgement: Judgement, asked: Asked) -> Iterator[Reason]:
    held, used = _temperatures(judgement.train), _temperatures(judgement.test)
    if not held or not used or min(_span(held), _span(used)) < LEAST_SPAN_DEGC:
        return
    low, high = min(T.min() for T in held), max(T.max() for T in held)
    # Of runs at several temperatures each counts by what it goes over itself.
    ends = sorted((max(T.min(), low), min(T.max(), high)) for T in used)
    over, reached = 0.0, low
    for begin, end in ends:
        over += max(end - max(begin, reached), 0.0)
        reached = max(reached, end)
    if over < asked.judged * (high - low):
        yield Reason(
            "use_with_care",
            "judged over a part of its temperatures",
            f"The test runs go over {short(over, 2)} of the {short(high - low, 2)} degC from "
            f"{short(low, 2)} to {short(high, 2)} degC that it was trained over: the rest was not tested.",
            "Judge it on a run that goes over the range of use.",
        )


def _another_unit(judgement: Judgement) -> Iterator[Reason]:
    for what in ("unit", "axis"):
        of_model = judgement.model.get(what)
        others = {getattr(run, what) for run in judgement.test} - {of_model, None}
        if of_model and others:
            told = ", ".join(sorted(map(str, others)))
            yield Reason(
                "use_with_care",
                f"trained on another {what}",
                f"Trained on {what} {of_model}, judged on {what} {told}.",
                f"Train on runs of {what} {told}.",
            )


def _ways(runs: Sequence[RunJudgement]) -> frozenset[str]:
    """Which ways temperature moves in some runs; none where it hardly does."""
    held = _temperatures(runs)
    return ways_moved(held) if held and _span(held) >= LEAST_SPAN_DEGC else frozenset()


def _span(temperatures: Sequence[FloatArray]) -> float:
    return float(max(T.max() for T in temperatures) - min(T.min() for T in temperatures))


def _temperatures(runs: Sequence[RunJudgement]) -> list[FloatArray]:
    """T of the averages of runs that record one [degC]."""
    return [run.series.temperature for run in runs if np.all(np.isfinite(run.series.temperature))]
