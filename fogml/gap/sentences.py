"""What a diagnosis says in sentences: the result, what it took for granted, what is doubtful in its runs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.how_far import Foretold
from fogml.gap.inference import Inference
from fogml.gap.noise import not_static
from fogml.gap.posterior import Judgement
from fogml.gap.result import Diagnosis, Onset, in_doubt
from fogml.gap.result_parts import ConstantFit, beyond_noise
from fogml.numerals import percent, probability_words, short
from fogml.runs.findings import IMPLAUSIBLE, SPOILING
from fogml.runs.plausible import FACTORS
from fogml.runs.run import Run
from fogml.signals.shared import shared_samples

_UNITS = (FACTORS["deg/h taken for deg/s"], FACTORS["deg/h taken for rad/s"])


def headline(found: Inference, told: Diagnosis, other_plant: bool) -> tuple[str, ...]:
    """The verdict, each cause with its size, share and place, the nearest where none is sure.

    `other_plant` says that the likeliest set holds another flow of heat.
    """
    said, titles = [], found.scene.candidates
    verdict, unknown, out = told.verdict, told.unknown, beyond_noise(told.how_far)
    slow_noise = _slow_noise(found)
    could = f"the fitted runs could show; {out}." if out else "these runs could show."
    if verdict == "no_gap" and other_plant:
        said.append(
            "Heat flows a little otherwise than the model's plant says, or a sensor lags: fit its time "
            f"constants. Nothing beyond that is missing that {could}"
        )
    elif verdict == "no_gap" and (doubt := in_doubt(verdict, told.found, unknown)) is not None:
        said.append(
            f"Nothing is sure enough to be named, and that nothing is missing is not sure: "
            f"{titles[doubt.effect].title} is {probability_words(doubt.probability)} probable, something "
            f"unknown {probability_words(unknown.probability)}{f'; {out}' if out else ''}."
        )
    elif verdict == "no_gap":
        said.append(f"Nothing is missing that {could}")
    for f in told.named:
        title = titles[f.effect].title
        others = f" (or {', '.join(f.others)})" if f.others else ""
        size = f"{short(f.amplitude.value)} {f.amplitude.unit}"
        usual = f", {short(f.times_usual, 2)} times the usual most" if (f.times_usual or 0.0) > 1.0 else ""
        share = f", {percent(f.share, 0)} of the gap" if f.share is not None else ""
        look = f"; look at the {f.place}" if f.place else ""
        said.append(
            f"{title}{others}: {probability_words(f.probability)} probable, {size}{usual}{share}{look}."
        )
        if f.onset is not None:
            since = f"{short(f.onset.amplitude.value)} {f.amplitude.unit} since then"
            said.append(f"{title} {_since(found, f.onset)}, and not before: {since}.")
        if f.grows is not None:
            way = "grows" if f.grows * f.amplitude.value > 0.0 else "fades"
            said.append(
                f"{title} {way} from run to run, by {short(abs(f.grows), 2)} {f.amplitude.unit} a day."
            )
        elif not f.consistent and len(f.by_run) > 1:
            said.append(f"{title}: the runs do not agree in its size.")
    for f in (f for f in told.found if f.left_out):
        said.append(
            f"{titles[f.effect].title} may as well be {', '.join(f.left_out)}, left out of the candidates."
        )
    if verdict in ("unknown", "partly_explained"):
        like = unknown.looks_like
        said.append(f"Something acts that is not known{': it ' + like if like else ''}.")
        if found.points.static is None and like in _in_time(found) and not slow_noise:
            said.append("Slow noise of the gyro itself looks like that: give a static run (--noise).")
        for n in [n for n in told.nearest if n.effect not in {f.effect for f in told.named}][:2]:
            if n.share >= found.setting.priors.reported.near_share:
                said.append(
                    f"Nearest known cause: {titles[n.effect].title}, in whatever form, holds "
                    f"{percent(n.share, 0)} of the gap."
                )
    if slow_noise:
        said.append(slow_noise)
    runs, segments = [found.scene.runs[i].run.name for i in found.scene.in_time], told.where.segments
    first = min((runs.index(s.run) for s in segments), default=0)
    if first > 0:
        begun = min(s.from_s for s in segments if s.run == runs[first])
        part = f", without {runs[first]} if it began within," if first + 1 < len(runs) else ""
        said.append(
            f"The gap shows from {runs[first]}, {begun:.0f} s, on, and in no run before: a diagnosis of the "
            f"runs from there on{part} may name more."
        )
    for h in told.how_far:
        if h.closed is None:
            said.append(f"{h.run}: {h.note}.")
        elif told.named:
            said.append(
                f"{h.run}: {percent(h.closed, 0)} of the gap closes{' — ' + h.note if h.note else ''}."
            )
        elif h.note:
            said.append(f"{h.run}: {h.note}.")
    return tuple(said)


def _since(found: Inference, onset: Onset) -> str:
    """When something began: between two runs, or within one."""
    scene, order = found.scene, found.scene.in_time
    names = [scene.runs[i].run.name for i in order]
    at = names.index(onset.run)
    if at and onset.time_s <= float(scene.runs[order[at]].time_s[0]):
        return f"began between {names[at - 1]} and {onset.run}"
    return f"acts from {onset.run} on, {onset.time_s:.0f} s into it"


def _in_time(found: Inference) -> set[str]:
    """What unknown causes look like that go in time alone, as slow noise does."""
    return {f.words for f in found.columns.families if f.id == "steps" or f.id.startswith("time_")}


def _slow_noise(found: Inference) -> str:
    """A sentence where no static run was given and slow noise is beyond what the prior's grid holds."""
    points, offsets = found.points, found.setting.priors.slow_noise
    flicker, walk = points.steps[points.best]
    if points.static is not None or (flicker <= offsets[-2] and walk <= offsets[-1]):
        return ""
    _, most_flicker, most_walk = points.prior.deviations
    times = math.exp(max(flicker * most_flicker, walk * most_walk))
    return (
        f"Slow noise is taken as {short(times, 2)} times what the model states, which may hide a gap: give "
        "a static run (--noise)."
    )


def looks_like(found: Inference, judged: Judgement) -> str:
    """What the unknown looks like; empty where there is none."""
    weights: dict[str, float] = {}
    for e, w in zip(judged.explanations, judged.weights):
        for m in e.members:
            if found.kind(m) == "unknown":
                between = found.columns.nodes[m.node].shape.get("between")
                words = found.columns.families[m.family].words + (f", {between}" if between else "")
                weights[words] = weights.get(words, 0.0) + float(w)
    if judged.unknown < found.setting.priors.reported.possible or not weights:
        return ""
    return max(weights, key=weights.__getitem__)


def assumed(found: Inference, constants: Sequence[ConstantFit]) -> tuple[str, ...]:
    """What was taken for granted, in sentences, the priors among them; `constants` as they were found."""
    setting, said = found.setting, []
    for rows in found.setting.scene.runs:
        for one in rows.run.findings:
            if one.code in IMPLAUSIBLE or (one.code in SPOILING and one.column == "gyro"):
                said.append(
                    f"{rows.run.name}: {one.message}; taken as it is, and if it is wrong, so is all here."
                )
    for fit in constants:
        off = abs(fit.value - fit.prior_mean)
        if fit.name in setting.widened and off > setting.priors.noise.far_off * fit.prior_sd:
            said.append(
                f"{fit.name} = {short(fit.value, 4)} {fit.unit} is {short(off / fit.prior_sd)} standard "
                f"deviations off what was expected ({fit.prior_mean:g} ± {fit.prior_sd:g}): a unit, a sign "
                f"or the twin may be wrong. Its prior was widened {short(setting.widened[fit.name])} times "
                "for the rest."
            )
    for rows in setting.scene.runs:
        if rows.masked:
            listed = ", ".join(f"{count} {why}" for why, count in rows.masked.items())
            said.append(f"{rows.run.name}: samples left out: {listed}.")
    if any("T_electronics" not in r.readings for r in setting.scene.runs):
        said.append(
            "The temperature of the electronics is not recorded: what follows it is looked for at several "
            "places. A column T_electronics would tell."
        )
    widths = sorted({f"{r.row_s:g}" for r in setting.scene.runs})
    said.append(f"Runs were brought to means over {', '.join(widths)} s; faster effects can't be seen.")
    said.append(f"Noise: {found.points.source}; white noise is what the runs themselves show.")
    said.append("Priors: " + "; ".join(setting.priors.described()) + ".")
    return tuple(said)


def doubts(found: Inference, recalibrated: Foretold, noise_run: Run | None, part: bool) -> tuple[str, ...]:
    """A noise run that is not static, replays of another sign or unit, samples in two runs, runs at one time.

    `part` says that the held-out run is a stretch of a fit run.
    """
    told = (*not_static(noise_run, found.setting.priors.noise), *_against(found, recalibrated))
    return told if part else (*told, *_shared(found), *_at_once(found))


def _against(found: Inference, recalibrated: Foretold) -> Iterator[str]:
    """Where recording and replay are of another sign or unit: as given, and held out."""
    scene = found.scene
    recorded = [r.samples(r.run.gyro_deg_h) for r in scene.runs]
    fit = range(scene.fitted)
    replayed = [recorded[i] - scene.runs[i].gap for i in fit]
    if doubt := other_way([recorded[i] for i in fit], replayed):
        yield f"What the model as given replays is {doubt}."
    for i in range(scene.fitted, len(scene.runs)):
        if doubt := other_way([recorded[i]], [recorded[i] - recalibrated.left_on(i)]):
            yield f"{scene.runs[i].run.name}: what the recalibrated twin replays is {doubt}."


def other_way(
    recorded: Sequence[FloatArray], replayed: Sequence[FloatArray], alike: float = 0.8, factor: float = 1.5
) -> str:
    """In words that replays are of another sign or unit than recordings; empty where not.

    Parameters
    ----------
    recorded, replayed
        Of each run [deg/h], shape (m,); they count about their means.
    alike
        Correlation, of either sign, from which on one is a multiple of the other.
    factor
        A multiple is -1, or one between units, within this factor: constants differ from unit to unit.
    """
    own, other = (np.concatenate([v - v.mean() for v in group]) for group in (recorded, replayed))
    squares = float(own @ own), float(other @ other)
    correlation = float(own @ other) / (squares[0] * squares[1]) ** 0.5 if min(squares) > 1e-18 else 0.0
    if abs(correlation) < alike:
        return ""
    times = (squares[0] / squares[1]) ** 0.5
    sign = "of the other sign" if correlation < 0.0 else ""
    if any(1.0 / factor < ratio < factor for unit in _UNITS for ratio in (times / unit, times * unit)):
        how = f"about {short(max(times, 1.0 / times), 2)} times {'less' if times > 1.0 else 'more'}"
        return f"{how}{f' and {sign}' if sign else ''} than was recorded: a unit may be wrong"
    if sign and 1.0 / factor < times < factor:
        return f"{sign} than what was recorded, and as large: a sign may be wrong"
    return ""


def _shared(found: Inference) -> Iterator[str]:
    scene = found.scene
    for i, j in combinations(range(len(scene.runs)), 2):
        if i >= scene.fitted:
            return
        fit, other = scene.runs[i].run, scene.runs[j].run
        share = shared_samples(other.gyro, fit.gyro)
        if share and j < scene.fitted:
            yield (
                f"{other.name} holds samples of {fit.name} (about {percent(share, 0)}): what they show "
                "counts twice."
            )
        elif share:
            yield (
                f"{other.name} holds samples of the fit run {fit.name} (about {percent(share, 0)}): its "
                "figures say how well the twin was fitted, not how far the gap closes."
            )


def _at_once(found: Inference) -> Iterator[str]:
    """Of runs that state when they started: those that were recorded at the same time by that."""
    scene = found.scene
    if not scene.order_known:
        return
    spans = [
        (begun + float(r.run.time[0]), begun + float(r.run.time[-1]), r)
        for begun, r in zip(scene.begun_s, scene.runs)
    ]
    for (from_s, to_s, a), (since_s, until_s, b) in combinations(spans, 2):
        both_s = min(to_s, until_s) - max(from_s, since_s)
        # A start that is rounded to minutes is no fault.
        if both_s > 60.0 + max(a.row_s, b.row_s):
            yield (
                f"{a.run.name} and {b.run.name} are of one unit and overlap by {short(both_s / 3600.0, 2)} h "
                "by their 'started', which is wrong in one of them: order, ageing and memory rest on it."
            )
