"""What a judgement says, in one plain sentence or two."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fogml.numerals import against, averages, label, listed, number, percent, plural, stated, unit_of
from fogml.report.tables import reference_of
from fogml.validation.advice import SEEN, Advice, Asked
from fogml.validation.floors import left_is_noise, made_worse
from fogml.validation.results import Judgement, LimitOutcome, RunJudgement

UNSETTLED_SHARE = 0.01
"""A smaller share of samples at flag 2 is not told: in a run of some hours it is of windows that fill."""
GRADES = {
    "use": ("met", "✓", "Use it"),
    "use_with_care": ("care", "!", "Use with care"),
    "do_not_use": ("missed", "✗", "Do not use"),
}


def advice_words(advice: Advice) -> dict[str, Any]:
    """A verdict as it is shown: colour's class, sign, words, reasons, next step."""
    kind, sign, words = GRADES[advice.grade]
    return {
        "kind": kind,
        "sign": sign,
        "words": f"{words}: {advice.brief}",
        "reasons": advice.reasons,
        "next_step": advice.next_step,
    }


def subject(judgement: Judgement) -> str:
    """What was judged, as a heading: unit, axis, model and test runs."""
    units = list(dict.fromkeys(run.unit for run in judgement.test if run.unit))
    axes = list(dict.fromkeys(run.axis for run in judgement.test if run.axis))
    who = [listed(units)] if units else []
    who += [f"axis {listed(axes)}"] if axes else []
    what = f"{judgement.model.get('kind', 'model')} on {listed([run.run for run in judgement.test], 3)}"
    return ", ".join(who) + (": " if who else "") + what


def worst_run(runs: Sequence[RunJudgement]) -> RunJudgement:
    """The run with the largest rms after; the design index looks at this one."""
    return max(runs, key=lambda run: run.after.rms)


def stated_limits(judgement: Judgement) -> list[LimitOutcome]:
    """The design index, if stated, and the limits."""
    index = judgement.design_index
    if index is None:
        return list(judgement.limits)
    return [LimitOutcome("design_index", index.limit, index.value, index.met), *judgement.limits]


def verdict(judgement: Judgement) -> list[str]:
    """Sentences, the most important first: what is left of what, and what the reader must know."""
    worst = worst_run(judgement.test)
    still = worst.still is not None and worst.still[1] > Asked().mostly_still
    return [
        *(_still(judgement) if still else _what_is_left(judgement, worst)),
        *([] if still else _bias(worst)),
        *seen_told(judgement),
        *_limits(stated_limits(judgement)),
        *_outside(judgement.test),
    ]


def unseen(judgement: Judgement) -> bool:
    """Whether no test run holds the samples of a training run."""
    return not any(finding.code == SEEN for run in judgement.test for finding in run.findings)


def does_harm(judged: RunJudgement) -> bool:
    """Whether the rms after is larger than before by more than the run's noise hides."""
    return made_worse(judged, judged.before.rms, judged.after.rms)


def floor_told(run: RunJudgement) -> str:
    """A run's noise floor with its 90 % interval and where it comes from, as a part of a sentence."""
    told = f"the noise floor is {number(run.floor)} deg/h"
    if run.floor_ci90 is None:
        return told
    low, high = run.floor_ci90
    return f"{told} ({number(low)} to {number(high)}, from {run.floor_source})"


def own_noise_by(run: RunJudgement) -> str:
    """Whether what is left is the gyro's own noise, and where its floor comes from, as sentences."""
    return f"{own_noise(run)} The noise floor is from {run.floor_source}."


def own_noise(run: RunJudgement) -> str:
    """Whether what is left is the gyro's own noise, as a sentence.

    A bias that the floor of one average could not hide is told apart: noise has no mean.
    """
    if run.still is not None:
        return f"On {run.run} the output stands still: whether it is the gyro's own noise can't be told."
    if not left_is_noise(run):
        return "What is left is not the gyro's own noise alone."
    biased = abs(run.after.bias) > run.floor
    lead = f"Beside a bias of {number(run.after.bias)} deg/h, what" if biased else "What"
    return f"{lead} is left is the gyro's own noise, as far as these averages tell."


def _still(judgement: Judgement) -> list[str]:
    return [
        f"On {run.run} nothing is judged: {run.still[0]}"
        for run in judgement.test
        if run.still is not None and run.still[1] > Asked().mostly_still
    ]


def _what_is_left(judgement: Judgement, worst: RunJudgement) -> list[str]:
    kind = str(judgement.model.get("kind", "drift"))
    several = len(judgement.test) > 1
    where = f"On {worst.run}" + (
        f", the worst of {plural(len(judgement.test), 'test run')}," if several else ""
    )
    before, after = number(worst.before.bias_stability), number(worst.after.bias_stability)
    over = averages(worst.averaging_s)
    floor = floor_told(worst)
    if kind in ("none", "mean"):
        left = f"{where} nothing is compensated"
        if kind == "mean":
            left = f"{where} only the training runs' mean is taken off"
        return [f"{left}: {after} deg/h stays (bias stability, {over}); {floor}."]
    rms = f"from {number(worst.before.rms)} to {number(worst.after.rms)} deg/h"
    if does_harm(worst):
        return [
            f"{where} the {kind} model does harm: rms goes {rms}, bias stability from {before} to {after} "
            f"deg/h ({over}); {floor}."
        ]
    if made_worse(worst, worst.before.bias_stability, worst.after.bias_stability):
        did = f"brings the rms {rms} and makes the bias stability worse, {before} to {after} deg/h ({over})"
    else:
        did = f"leaves {after} deg/h of {before} deg/h (bias stability, {over})"
    sentence = f"{where} the {kind} model {did}; {floor}."
    harmed = [run.run for run in judgement.test if does_harm(run)]
    return [sentence, own_noise(worst), *([f"It makes {listed(harmed)} worse."] if harmed else [])]


def _bias(worst: RunJudgement) -> list[str]:
    """The bias is worth a sentence where it makes up most of what is left."""
    if abs(worst.after.bias) <= worst.after.bias_stability or worst.after.rms <= worst.floor:
        return []
    return [
        f"Its mean is off by {number(worst.after.bias)} deg/h from {reference_of(worst)}: most of its rms of "
        f"{number(worst.after.rms)} deg/h."
    ]


def seen_told(judgement: Judgement) -> list[str]:
    """That a test run holds the samples of a training run, as a sentence; none where none does."""
    if unseen(judgement):
        return []
    return [
        "A test run holds the samples of a training run: the figures say how well the model fits, "
        "not how well it holds."
    ]


def _limits(outcomes: Sequence[LimitOutcome]) -> list[str]:
    missed = [outcome for outcome in outcomes if not outcome.met]
    if not outcomes:
        return []
    if not missed:
        count = {1: "The stated limit is", 2: "Both stated limits are"}
        return [count.get(len(outcomes), f"All {len(outcomes)} stated limits are") + " met."]
    described = [
        f"{label(o.quantity).lower()} {against(o.value, o.limit)}, limit {stated(o.limit)} "
        f"{unit_of(o.quantity)}"
        for o in missed
    ]
    return [f"Not met: {'; '.join(described)}."]


def _outside(runs: Sequence[RunJudgement]) -> list[str]:
    outside = [run for run in runs if run.outside_training >= Asked().outside]
    if not outside:
        return []
    shares = listed([f"{percent(run.outside_training)} of {run.run}" for run in outside])
    return [f"Outside the temperatures and rates of training: {shares}; there the model falls back."]


def model_card(model: dict[str, Any], most: int | None = None) -> list[tuple[str, str]]:
    """Name and value of what a model tells of itself, for a definition list.

    Of features and of what it was trained within, `most` are listed.
    """
    rows = [("kind", str(model.get("kind", "")))]
    if model.get("features"):
        rows.append(("features", _first(model["features"], ", ", most)))
    parameters = model.get("parameters")
    if parameters is not None:
        rows.append(("parameters", f"{parameters:,}".replace(",", "\u202f")))
    if model.get("bytes") is not None:
        rows.append(("weights", plural(int(model["bytes"]), "byte")))
    for key, words, unit in (("window_s", "longest window", " s"), ("rows", "training rows", "")):
        if model.get(key):
            rows.append((words, f"{number(float(model[key]), 4) if unit else int(model[key])}{unit}"))
    for key in ("unit", "axis"):
        if model.get(key):
            rows.append((key, str(model[key])))
    if model.get("box"):
        spans = [
            f"{name} {number(low)} to {number(high)}{_atom_unit(name)}"
            for name, (low, high) in model["box"].items()
        ]
        rows.append(("trained within", _first(spans, "; ", most)))
    interval = model.get("interval") or {}
    if interval.get("half_width_90") is not None:
        rows.append(("90 % band", interval_words(interval)))
    if model.get("chosen_by"):
        among = "mixed effects and simple forms" if model.get("kind") == "combination" else "those below"
        rows.append(("chosen by", f"{model['chosen_by']}, among {among}"))
    return rows


def _first(names: Sequence[object], between: str, most: int | None) -> str:
    left = 0 if most is None else max(len(names) - most, 0)
    return between.join(map(str, names[:most])) + (f" and {left} more" if left > 0 else "")


def _atom_unit(name: str) -> str:
    """The unit of a feature's atom, from its name: a temperature, a rate of one, or a pure number."""
    if name.startswith(("sign", "since_on")):
        return ""
    return " °C/min" if name.startswith(("dT", "d(")) else " °C"


def interval_words(interval: Mapping[str, Any]) -> str:
    """The 90 % band of a model and what it stands on."""
    return (
        f"± {number(float(interval['half_width_90']))} deg/h for {averages(interval['averaging_s'])}, "
        f"from {plural(int(interval['residuals']), 'residual')} of parts left out of training"
    )


def unsettled(judged: RunJudgement) -> str:
    """What is left where windows and memories went by what was before the run; empty where that is little."""
    if judged.not_settled < UNSETTLED_SHARE:
        return ""
    flag, after = judged.series.flag, judged.series.after
    rms = [number(float(np.sqrt(np.mean(after[part] ** 2)))) for part in (flag == 2, flag != 2) if part.any()]
    there = (
        f"Rms after {' deg/h there, '.join(rms)} deg/h elsewhere"
        if len(rms) == 2
        else "So it is everywhere here"
    )
    return (
        f"{percent(judged.not_settled)} of the samples judged come before the model's windows are full and "
        f"its memories settled (flag 2): what was before the run still matters. {there}."
    )
